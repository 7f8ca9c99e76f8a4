// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/questions.hpp"
#include "core/shapes.hpp"

// Rays, moving shapes and distances, put to all shapes of an index or a world.

namespace jostle_python {

/// Rays, or shapes that move by displacements where `moving` is given.
struct Casts
{
    Casts(const Shapes* moving, const std::optional<py::array>& moving_poses, const py::array& given,
          jostle_space space)
        : count(static_cast<std::uint64_t>(given.ndim() == 2 ? given.shape(0) : 0)), rows_(given)
    {
        const py::ssize_t width = moving == nullptr ? 2 * dim_of(space) + 1 : dim_of(space);
        want_rows(given, space, width, count, moving == nullptr ? "rays" : "displacements");
        if ((moving != nullptr) != moving_poses.has_value()) refuse("shapes that move need poses");
        if (moving == nullptr) return;
        movers_.emplace(*moving, *moving_poses, space, false, "moving_poses");
        if (movers_->view.poses.count != count)
            refuse("there are " + std::to_string(movers_->view.poses.count) + " poses and " +
                   std::to_string(count) + " displacements");
        movers_->want_pose_each("moving_poses");
    }
    Casts(const Casts&) = delete;

    /// Makes `part` some of them, until the next call.
    jostle_status part_of(std::uint64_t first, std::uint64_t some, jostle_casts& part, jostle_error* error)
    {
        const py::ssize_t row = rows_.strides(0);
        const jostle_values rows{
            static_cast<const char*>(rows_.data()) + static_cast<std::int64_t>(first) * row, some, row};
        part = {};
        (movers_ ? part.displacements : part.rays) = rows;
        if (!movers_) return JOSTLE_OK;
        part.moving = &some_movers_;
        return movers_->part_of(first, some, some_movers_, error);
    }

    std::uint64_t count;

  private:
    py::array rows_;
    std::optional<Objects> movers_;
    jostle_objects some_movers_{};
};

/// The functions of an index or a world.
template <class Handle>
struct AskedShapes
{
    jostle_status (*first)(const Handle*, const jostle_objects*, const jostle_casts*,
                           const jostle_query_filter*, std::uint64_t, std::uint64_t*, void*, jostle_error*);
    jostle_status (*all)(const Handle*, const jostle_objects*, const jostle_casts*,
                         const jostle_query_filter*, std::uint64_t, std::uint64_t, jostle_results*,
                         jostle_error*);
    jostle_status (*nearest)(const Handle*, const jostle_objects*, const jostle_objects*,
                             const jostle_values*, const jostle_query_filter*, std::uint64_t, std::uint64_t*,
                             void*, jostle_error*);

    py::tuple ask_first(const Handle* handle, jostle_space space, Casts& casts, const Shapes& shapes,
                        const py::array& poses, AskFilter& filter, const py::dtype& type) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(casts.count));
        py::array hits(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(casts.count)});
        std::uint64_t* const first_id = ids.mutable_data();
        auto* const data = static_cast<char*>(hits.mutable_data());
        const auto size = static_cast<std::uint64_t>(type.itemsize());
        const jostle_query_filter* const one = filter.one();
        ask_in_parts(casts.count, filter, [&](auto from, auto number, auto* error) {
            jostle_casts some;
            const jostle_status status = casts.part_of(from, number, some, error);
            if (status != JOSTLE_OK) return status;
            return first(handle, &of.view, &some, one, 1, first_id + from, data + from * size, error);
        });
        return py::make_tuple(ids, hits);
    }
    py::tuple ask_all(const Handle* handle, jostle_space space, Casts& casts, const Shapes& shapes,
                      const py::array& poses, AskFilter& filter, std::uint64_t max_results,
                      const py::dtype& type) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        FoundLists found;
        const jostle_query_filter* const one = filter.one();
        ask_in_parts(casts.count, filter, [&](auto from, auto number, auto* error) {
            jostle_casts some;
            const jostle_status status = casts.part_of(from, number, some, error);
            if (status != JOSTLE_OK) return status;
            return found.add(from, error, [&](jostle_results* results) {
                return all(handle, &of.view, &some, one, 1, max_results, results, error);
            });
        });
        const py::tuple lists = found.joined(casts.count, false);
        py::array hits(type, std::vector<py::ssize_t>{py::array(lists[1]).shape(0)});
        auto* data = static_cast<char*>(hits.mutable_data());
        for (const Results& part : found.parts())
            call([&](jostle_error* error) {
                jostle_blocks blocks;
                jostle_status status = jostle_results_blocks(part.get(), &blocks, error);
                if (status == JOSTLE_OK) status = jostle_blocks_copy(&blocks, blocks.count, data, error);
                data += blocks.count * static_cast<std::uint64_t>(type.itemsize());
                return status;
            });
        return py::make_tuple(lists[0], lists[1], hits, lists[3]);
    }
    py::tuple ask_nearest(const Handle* handle, jostle_space space, const Shapes& near_shapes,
                          const py::array& near_poses, const Packed<double>& max_distances,
                          const Shapes& shapes, const py::array& poses, AskFilter& filter) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        Objects near(near_shapes, near_poses, space, false, "near_poses");
        near.want_pose_each("near_poses");
        const std::uint64_t count = near.view.poses.count;
        want_length(max_distances, count, "max_distances");
        const double* const most = max_distances.data();
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(count));
        py::array out(number_of(space),
                      {static_cast<py::ssize_t>(count), py::ssize_t(3 * dim_of(space) + 1)});
        std::uint64_t* const first_id = ids.mutable_data();
        auto* const data = static_cast<char*>(out.mutable_data());
        const auto size = static_cast<std::uint64_t>(out.strides(0));
        const jostle_query_filter* const one = filter.one();
        ask_in_parts(count, filter, [&](auto from, auto number, auto* error) {
            jostle_objects some;
            const jostle_status status = near.part_of(from, number, some, error);
            if (status != JOSTLE_OK) return status;
            const jostle_values limits{most + from, number, sizeof(double)};
            return nearest(handle, &of.view, &some, &limits, one, 1, first_id + from, data + from * size,
                           error);
        });
        return py::make_tuple(ids, out);
    }
};

} // namespace jostle_python
