// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/arrays.hpp"
#include "core/interrupts.hpp"
#include "core/shapes.hpp"
#include "core/visits.hpp"

// Queries of an index or a world, of boxes or of shapes.

namespace jostle_python {

/// Queries as Python packed them: a row of numbers for each, or planes, and shapes with poses for the kinds
/// that have some.
class Queries
{
  public:
    Queries(jostle_query_kind kind, const py::array& numbers, jostle_space space,
            const std::vector<py::array>& planes, std::uint32_t nearest, const Shapes* shapes,
            const std::optional<py::array>& poses)
        : numbers_(numbers), planes_(planes)
    {
        const int dim = dim_of(space);
        all_.kind = kind;
        all_.nearest = nearest;
        if (kind == JOSTLE_FRUSTUM) {
            for (const py::array& one : planes) {
                want_rows(one, space, dim + 1, static_cast<std::uint64_t>(one.ndim() == 2 ? one.shape(0) : 0),
                          "planes");
                frusta_.push_back({one.data(), static_cast<std::uint64_t>(one.shape(0))});
            }
            all_.values = {frusta_.data(), frusta_.size(), sizeof frusta_[0]};
            return;
        }
        const int widths[] = {0,       2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0,
                              dim + 1, 2 * dim + 1, dim,         0,       1};
        if (kind < JOSTLE_RAY || kind > JOSTLE_NEAREST_TO_SHAPE) refuse("there is no such kind of query");
        const auto rows = static_cast<std::uint64_t>(numbers.ndim() == 2 ? numbers.shape(0) : 0);
        want_rows(numbers, space, widths[kind], rows, "queries");
        if (widths[kind] != 0) all_.values = {numbers.data(), rows, widths[kind] * numbers.itemsize()};
        if ((shapes != nullptr) != poses.has_value()) refuse("shapes need poses");
        if (shapes == nullptr) return;
        shapes_.emplace(*shapes, *poses, space, false, "the queries' poses");
        shapes_->want_pose_each("the queries' poses");
        if (widths[kind] != 0 && rows != shapes_->view.poses.count)
            raise_error("size_mismatch",
                        "there are " + std::to_string(shapes_->view.poses.count) + " poses and " +
                            std::to_string(rows) +
                            (kind == JOSTLE_SHAPE_SWEEP ? " displacements" : " distances"),
                        py::none());
        all_.shapes = &shapes_->view;
    }
    Queries(const Queries&) = delete;

    [[nodiscard]] jostle_query_kind kind() const { return all_.kind; }
    /// Whether it asks for the 0 nearest, which C can't.
    [[nodiscard]] bool asks_for_none() const
    {
        return all_.nearest == 0 && (all_.kind == JOSTLE_NEAREST || all_.kind == JOSTLE_NEAREST_TO_BOX ||
                                     all_.kind == JOSTLE_NEAREST_TO_SHAPE);
    }
    [[nodiscard]] std::uint64_t count() const
    {
        return shapes_ ? shapes_->view.poses.count : all_.values.count;
    }
    /// Makes `part` some of them, until the next call.
    jostle_status part_of(std::uint64_t first, std::uint64_t some, jostle_queries& part, jostle_error* error)
    {
        part = all_;
        if (all_.values.count != 0) {
            part.values.data = static_cast<const char*>(all_.values.data) +
                               static_cast<std::int64_t>(first) * all_.values.stride;
            part.values.count = some;
        }
        if (!shapes_) return JOSTLE_OK;
        part.shapes = &some_shapes_;
        return shapes_->part_of(first, some, some_shapes_, error);
    }

  private:
    py::array numbers_;
    std::vector<py::array> planes_;
    std::vector<jostle_frustum> frusta_;
    std::optional<Objects> shapes_;
    jostle_objects some_shapes_{};
    jostle_queries all_{};
};

struct AskFilter
{
    AskFilter(std::optional<py::array> category, std::optional<py::array> mask,
              std::optional<py::array> owner, std::optional<std::array<std::uint32_t, 3>> by,
              std::optional<std::uint64_t> excluded,
              const std::optional<Packed<std::uint64_t>>& excluded_each, py::object function)
        : kept{category, mask, owner}, accept(std::move(function))
    {
        filter.struct_size = sizeof filter;
        filter.category = values_of<std::uint32_t>(category, "category");
        filter.mask = values_of<std::uint32_t>(mask, "mask");
        filter.owner = values_of<std::uint32_t>(owner, "owner");
        if (by) {
            asker = {(*by)[0], (*by)[1], (*by)[2]};
            filter.asker = &asker;
        }
        if (excluded) {
            exclude = *excluded;
            filter.exclude = &exclude;
        }
        if (!accept.is_none()) {
            filter.context = this;
            filter.accept = [](void* context, std::uint32_t query, std::uint64_t id) {
                auto* const self = static_cast<AskFilter*>(context);
                return self->pending.call(
                    [&] { return truth_of(self->accept(self->first_query + query, id)); });
            };
        }
        if (!excluded_each) return;
        has_each = true;
        excludes.assign(excluded_each->data(), excluded_each->data() + excluded_each->size());
        each.assign(excludes.size(), filter);
        for (std::size_t i = 0; i < each.size(); ++i)
            each[i].exclude = &excludes[i];
    }
    AskFilter(const AskFilter&) = delete;

    /// The one filter, where there can be no more.
    [[nodiscard]] const jostle_query_filter* one() const
    {
        if (has_each) refuse("exclude is an array: give a single id here");
        return &filter;
    }
    /// What serves `number` queries from number `first` on, once check() has passed.
    [[nodiscard]] const jostle_query_filter* from(std::uint64_t first, std::uint64_t number)
    {
        if (!has_each || number == 0) return &filter;
        each[first].count = number;
        return &each[first];
    }
    [[nodiscard]] bool asks_python() const { return !accept.is_none(); }
    void check(std::uint64_t queries) const
    {
        if (has_each && excludes.size() != queries)
            refuse("there are " + std::to_string(queries) + " queries and " +
                   std::to_string(excludes.size()) + " ids to exclude: give one for all, or one for each");
    }

    std::uint64_t first_query = 0; // of those that are being asked
    Pending pending;

  private:
    jostle_query_filter filter{};
    bool has_each = false;
    std::vector<std::uint64_t> excludes;
    std::vector<jostle_query_filter> each; // one for each query
    jostle_asker asker{};
    std::uint64_t exclude = 0;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

/// Calls ask(first, count, error) about `count` queries, a few at a time, and looks for Ctrl-C in between.
/// Where a function in Python is asked, one at a time, which stays on this thread: of several, each would
/// wait for the others most of the time, and not notice Ctrl-C.
template <class F>
void ask_in_parts(std::uint64_t count, AskFilter& filter, F&& ask)
{
    filter.check(count);
    const auto part = [&](std::uint64_t first, std::uint64_t now, jostle_error* error) {
        filter.first_query = first;
        return ask(first, now, error);
    };
    call_in_parts(count, &filter.pending, part, filter.asks_python() ? 1 : UINT64_MAX);
}

/// Lists of answers, one for each query, which were asked in parts.
class FoundLists
{
  public:
    /// Calls ask(results) about the queries from number `first` on.
    template <class F>
    jostle_status add(std::uint64_t first, jostle_error* error, F&& ask)
    {
        if (first == 0) parts_.clear();
        jostle_results* results = nullptr;
        const jostle_status status = jostle_results_new(nullptr, &results, error);
        if (status != JOSTLE_OK) return status;
        Results part(results); // at once: there may be no memory for one more
        parts_.push_back(std::move(part));
        return ask(results);
    }
    /// Where each list begins, and their end; the ids; where they are, or None if these queries have no
    /// order; which queries have more; and their details, of this type, or None.
    [[nodiscard]] py::tuple joined(std::uint64_t queries, bool has_at,
                                   const std::optional<py::dtype>& type) const
    {
        std::vector<jostle_lists> lists(parts_.size());
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            call(
                [&](jostle_error* error) { return jostle_results_lists(parts_[i].get(), &lists[i], error); });
            count += lists[i].count;
        }
        Packed<std::uint64_t> begins(static_cast<py::ssize_t>(queries + 1));
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(count));
        Packed<double> at(static_cast<py::ssize_t>(has_at ? count : 0));
        Packed<std::uint8_t> more(static_cast<py::ssize_t>(queries));
        std::uint64_t query = 0, answer = 0;
        for (const jostle_lists& one : lists) {
            for (std::uint64_t i = 0; i < one.queries; ++i)
                begins.mutable_data()[query + i] = answer + one.first[i];
            std::copy_n(one.more, one.queries, more.mutable_data() + query);
            std::copy_n(one.ids, one.count, ids.mutable_data() + answer);
            if (has_at) std::copy_n(one.at, one.count, at.mutable_data() + answer);
            query += one.queries;
            answer += one.count;
        }
        begins.mutable_data()[query] = answer;
        return py::make_tuple(begins, ids, has_at ? py::object(at) : py::object(py::none()), more,
                              type ? py::object(details(count, *type)) : py::object(py::none()));
    }

  private:
    [[nodiscard]] py::array details(std::uint64_t count, const py::dtype& type) const
    {
        py::array all(type, std::vector<py::ssize_t>{static_cast<py::ssize_t>(count)});
        auto* data = static_cast<char*>(all.mutable_data());
        for (const Results& part : parts_)
            call([&](jostle_error* error) {
                jostle_blocks blocks;
                jostle_status status = jostle_results_blocks(part.get(), &blocks, error);
                if (status == JOSTLE_OK) status = jostle_blocks_copy(&blocks, blocks.count, data, error);
                data += blocks.count * static_cast<std::uint64_t>(type.itemsize());
                return status;
            });
        return all;
    }

    std::vector<Results> parts_;
};

/// The shapes in the boxes, where they are asked about.
class Target
{
  public:
    Target(const Shapes* shapes, const std::optional<py::array>& poses, jostle_space space)
    {
        if ((shapes != nullptr) != poses.has_value()) refuse("give shapes and poses, or neither");
        if (shapes != nullptr) objects_.emplace(*shapes, *poses, space, false, "poses");
    }
    [[nodiscard]] const jostle_objects* get() const { return objects_ ? &objects_->view : nullptr; }

  private:
    std::optional<Objects> objects_;
};

/// What an index or a world answers. `type` is that of the details that its answers have, if any.
struct Verbs
{
    /// Calls ask(queries, filter, first, error) about some of the queries at a time.
    template <class F>
    static void in_parts(Queries& queries, AskFilter& filter, F&& ask)
    {
        ask_in_parts(queries.count(), filter, [&](auto from, auto number, auto* error) {
            jostle_queries some;
            const jostle_status status = queries.part_of(from, number, some, error);
            return status == JOSTLE_OK ? ask(&some, filter.from(from, number), from, error) : status;
        });
    }
    static py::array any(const void* handle, Queries& queries, AskFilter& filter, const Target& target)
    {
        Packed<std::uint8_t> answers(static_cast<py::ssize_t>(queries.count()));
        std::uint8_t* const out = answers.mutable_data();
        in_parts(queries, filter, [&](auto* some, auto* wish, auto from, auto* error) {
            return jostle_query_any(handle, some, target.get(), wish, out + from, error);
        });
        return answers;
    }
    static py::array count(const void* handle, Queries& queries, AskFilter& filter, const Target& target)
    {
        Packed<std::uint64_t> answers(static_cast<py::ssize_t>(queries.count()));
        std::uint64_t* const out = answers.mutable_data();
        in_parts(queries, filter, [&](auto* some, auto* wish, auto from, auto* error) {
            return jostle_query_count(handle, some, target.get(), wish, out + from, error);
        });
        return answers;
    }
    /// Ids; where they are; details, or None.
    static py::tuple first(const void* handle, Queries& queries, AskFilter& filter, const Target& target,
                           const std::optional<py::dtype>& type)
    {
        const auto number = static_cast<py::ssize_t>(queries.count());
        std::vector<jostle_hit> hits(queries.count());
        std::optional<py::array> details;
        char* data = nullptr;
        std::uint64_t size = 0;
        if (type) {
            details.emplace(*type, std::vector<py::ssize_t>{number});
            data = static_cast<char*>(details->mutable_data());
            size = static_cast<std::uint64_t>(type->itemsize());
        }
        in_parts(queries, filter, [&](auto* some, auto* wish, auto from, auto* error) {
            return jostle_query_first(handle, some, target.get(), wish, hits.data() + from,
                                      data == nullptr ? nullptr : data + from * size, error);
        });
        Packed<std::uint64_t> ids(number);
        Packed<double> at(number);
        for (std::size_t i = 0; i < hits.size(); ++i) {
            ids.mutable_data()[i] = hits[i].id;
            at.mutable_data()[i] = hits[i].at;
        }
        return py::make_tuple(ids, at, details ? py::object(*details) : py::object(py::none()));
    }
    static py::tuple all(const void* handle, Queries& queries, AskFilter& filter, const Target& target,
                         std::uint64_t max_results, const std::optional<py::dtype>& type)
    {
        FoundLists found;
        if (queries.asks_for_none()) max_results = 0;
        in_parts(queries, filter, [&](auto* some, auto* wish, auto from, auto* error) {
            return found.add(from, error, [&](jostle_results* results) {
                return jostle_query_all(handle, some, target.get(), wish, max_results, results, error);
            });
        });
        const bool is_region = queries.kind() == JOSTLE_BOX || queries.kind() == JOSTLE_SPHERE ||
                               queries.kind() == JOSTLE_FRUSTUM || queries.kind() == JOSTLE_POSED_SHAPE;
        return found.joined(queries.count(), !is_region, type);
    }
    /// Whether the function never said stop.
    static bool visit(const void* handle, Queries& queries, AskFilter& filter, const Target& target,
                      py::object function, std::uint64_t chunk)
    {
        if (queries.count() != 1)
            refuse("there are " + std::to_string(queries.count()) + " queries: visit takes one");
        const jostle_query_filter* const one = filter.one();
        if (queries.asks_for_none()) return true;
        jostle_queries all;
        call([&](jostle_error* error) { return queries.part_of(0, 1, all, error); });
        Visitor visitor(std::move(function), chunk, 1, false, filter.pending);
        return visitor.run([&](void* context, auto* finished, auto* error) {
            return jostle_query_visit(handle, &all, target.get(), one, Visitor::take_answer, context,
                                      finished, error);
        });
    }
    /// The same. Ids are `narrow` where they fit into 32 bits.
    static bool closest_pairs(const void* handle, const void* other, double max_distance, py::object function,
                              std::uint64_t chunk, bool narrow)
    {
        Pending pending;
        Visitor visitor(std::move(function), chunk, 2, narrow, pending);
        return visitor.run([&](void* context, auto* finished, auto* error) {
            return jostle_query_closest_pairs(handle, other, max_distance, Visitor::take_pair, context,
                                              finished, error);
        });
    }
};

/// Defines the verbs of a class that has `users`, `handle` and `space`.
template <class Class, class Bound>
void define_verbs(Bound& bound)
{
    // Looks on, so that nothing changes the object meanwhile.
    const auto asking = [](const Class& self, const Shapes* shapes, const Maybe& poses, auto&& ask) {
        const Users::Reading now(self.users);
        const Target target(shapes, poses, self.space);
        return ask(static_cast<const void*>(self.handle.get()), target);
    };
    bound
        .def("any",
             [=](const Class& self, Queries& queries, AskFilter& filter, const Shapes* shapes,
                 const Maybe& poses) {
                 return asking(self, shapes, poses, [&](const void* handle, const Target& target) {
                     return Verbs::any(handle, queries, filter, target);
                 });
             })
        .def("count",
             [=](const Class& self, Queries& queries, AskFilter& filter, const Shapes* shapes,
                 const Maybe& poses) {
                 return asking(self, shapes, poses, [&](const void* handle, const Target& target) {
                     return Verbs::count(handle, queries, filter, target);
                 });
             })
        .def("first",
             [=](const Class& self, Queries& queries, AskFilter& filter, const Shapes* shapes,
                 const Maybe& poses, const std::optional<py::dtype>& type) {
                 return asking(self, shapes, poses, [&](const void* handle, const Target& target) {
                     return Verbs::first(handle, queries, filter, target, type);
                 });
             })
        .def("all",
             [=](const Class& self, Queries& queries, AskFilter& filter, const Shapes* shapes,
                 const Maybe& poses, std::uint64_t max_results, const std::optional<py::dtype>& type) {
                 return asking(self, shapes, poses, [&](const void* handle, const Target& target) {
                     return Verbs::all(handle, queries, filter, target, max_results, type);
                 });
             })
        .def("visit", [=](const Class& self, Queries& queries, AskFilter& filter, const Shapes* shapes,
                          const Maybe& poses, py::object function, std::uint64_t chunk) {
            return asking(self, shapes, poses, [&](const void* handle, const Target& target) {
                return Verbs::visit(handle, queries, filter, target, std::move(function), chunk);
            });
        });
}

} // namespace jostle_python
