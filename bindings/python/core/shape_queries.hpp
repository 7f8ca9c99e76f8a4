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
        : kept(given), count(static_cast<std::uint64_t>(given.ndim() == 2 ? given.shape(0) : 0))
    {
        const py::ssize_t width = moving == nullptr ? 2 * dim_of(space) + 1 : dim_of(space);
        want_rows(given, space, width, count, moving == nullptr ? "rays" : "displacements");
        if ((moving != nullptr) != moving_poses.has_value()) refuse("shapes that move need poses");
        const jostle_values numbers{given.data(), count, given.strides(0)};
        if (moving == nullptr) {
            view.rays = numbers;
            return;
        }
        movers.emplace(*moving, *moving_poses, space, false, "moving_poses");
        if (movers->view.poses.count != count)
            refuse("there are " + std::to_string(movers->view.poses.count) + " poses and " +
                   std::to_string(count) + " displacements");
        view.moving = &movers->view;
        view.displacements = numbers;
    }
    Casts(const Casts&) = delete;

    py::array kept;
    std::uint64_t count;
    jostle_casts view{};

  private:
    std::optional<Objects> movers;
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

    py::tuple ask_first(const Handle* handle, jostle_space space, const Casts& casts, const Shapes& shapes,
                        const py::array& poses, AskFilter& filter, const py::dtype& type) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(casts.count));
        py::array hits(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(casts.count)});
        std::uint64_t* const first_id = ids.mutable_data();
        void* const data = hits.mutable_data();
        const jostle_query_filter* const one = filter.one();
        call(
            [&](jostle_error* error) {
                return first(handle, &of.view, &casts.view, one, 1, first_id, data, error);
            },
            &filter.pending);
        return py::make_tuple(ids, hits);
    }
    py::tuple ask_all(const Handle* handle, jostle_space space, const Casts& casts, const Shapes& shapes,
                      const py::array& poses, AskFilter& filter, std::uint64_t max_results,
                      const py::dtype& type) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        const Results results = new_results();
        const jostle_query_filter* const one = filter.one();
        call(
            [&](jostle_error* error) {
                return all(handle, &of.view, &casts.view, one, 1, max_results, results.get(), error);
            },
            &filter.pending);
        jostle_lists lists;
        jostle_blocks blocks;
        call([&](jostle_error* error) { return jostle_results_lists(results.get(), &lists, error); });
        call([&](jostle_error* error) { return jostle_results_blocks(results.get(), &blocks, error); });
        py::array hits(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(blocks.count)});
        void* const data = hits.mutable_data();
        call([&](jostle_error* error) { return jostle_blocks_copy(&blocks, blocks.count, data, error); });
        return py::make_tuple(copy_array(lists.first, lists.questions + 1),
                              copy_array(lists.ids, lists.count), hits,
                              copy_array(lists.more, lists.questions));
    }
    py::tuple ask_nearest(const Handle* handle, jostle_space space, const Shapes& near_shapes,
                          const py::array& near_poses, const Packed<double>& max_distances,
                          const Shapes& shapes, const py::array& poses, AskFilter& filter) const
    {
        const Objects of(shapes, poses, space, false, "poses");
        const Objects near(near_shapes, near_poses, space, false, "near_poses");
        const std::uint64_t count = near.view.poses.count;
        want_length(max_distances, count, "max_distances");
        const jostle_values most{max_distances.data(), count, sizeof(double)};
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(count));
        py::array out(number_of(space),
                      {static_cast<py::ssize_t>(count), py::ssize_t(3 * dim_of(space) + 1)});
        std::uint64_t* const first_id = ids.mutable_data();
        void* const data = out.mutable_data();
        const jostle_query_filter* const one = filter.one();
        call(
            [&](jostle_error* error) {
                return nearest(handle, &of.view, &near.view, &most, one, 1, first_id, data, error);
            },
            &filter.pending);
        return py::make_tuple(ids, out);
    }
};

} // namespace jostle_python
