// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "c_api/handles.hpp"
#include "c_api/working_memory.hpp"

namespace jostle::c_api {

/// What queries ask: a BoxIndex or a World, in the space that it was made for.
template <class Held>
class StructureContent : public Content
{
  public:
    StructureContent(jostle_space in, Kept given) : kept(std::move(given)), space(in) {}
    template <class F>
    void on(F&& inside)
    {
        on_held(held, inside);
    }
    template <class F>
    void on(F&& inside) const
    {
        on_held(held, inside);
    }
    bool clear() override
    {
        on([](auto& typed) { typed.clear(); });
        return true;
    }
    [[nodiscard]] std::optional<std::uint64_t> size() const override
    {
        std::uint64_t size = 0;
        on([&](const auto& typed) { size = typed.size(); });
        return size;
    }

    Kept kept;
    jostle_space space;
    mutable WorkingMemories memories; // of queries
    Held held;                        ///< InSomeSpace of it
};

} // namespace jostle::c_api
