// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "core/arrays.hpp"

namespace jostle_python {

/// A pair's filter, and the function in Python that it may end in.
struct PairFilter
{
    PairFilter(std::optional<py::array> category, std::optional<py::array> mask,
               std::optional<py::array> owner, std::optional<py::array> category_b,
               std::optional<py::array> mask_b, std::optional<py::array> owner_b, std::uint64_t ghosts,
               std::optional<py::array> vertices, py::object function)
        : kept{category, mask, owner, category_b, mask_b, owner_b, vertices}, accept(std::move(function))
    {
        filter.struct_size = sizeof filter;
        filter.category = values_of<std::uint32_t>(category, "category");
        filter.mask = values_of<std::uint32_t>(mask, "mask");
        filter.owner = values_of<std::uint32_t>(owner, "owner");
        filter.category_b = values_of<std::uint32_t>(category_b, "category_b");
        filter.mask_b = values_of<std::uint32_t>(mask_b, "mask_b");
        filter.owner_b = values_of<std::uint32_t>(owner_b, "owner_b");
        filter.ghosts = ghosts;
        if (vertices) {
            if (vertices->ndim() != 2 || vertices->shape(1) != 3)
                refuse("vertices has the shape " + shape_text(*vertices) + ": it must be (n, 3)");
            filter.vertices = {vertices->data(), static_cast<std::uint64_t>(vertices->shape(0)),
                               3 * sizeof(std::uint32_t)};
        }
        if (accept.is_none()) return;
        filter.context = this;
        filter.accept = [](void* context, std::uint32_t a, std::uint32_t b) {
            auto* const self = static_cast<PairFilter*>(context);
            return self->pending.call([&] { return truth_of(self->accept(a, b)); });
        };
    }
    PairFilter(const PairFilter&) = delete;

    jostle_filter filter{};
    Pending pending;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

} // namespace jostle_python
