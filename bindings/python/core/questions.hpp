// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/arrays.hpp"

// Rays, regions and the like, put to an index or a world.

namespace jostle_python {

/// Questions as Python packed them: rows of numbers, or planes, or points.
struct Questions
{
    Questions(jostle_question given, const py::array& numbers, jostle_space space,
              const std::vector<py::array>& planes, std::uint32_t near_count)
        : kind(given), kept(numbers), kept_planes(planes)
    {
        const int dim = dim_of(space);
        if (kind == JOSTLE_FRUSTUM) {
            for (const py::array& one : planes) {
                want_rows(one, space, dim + 1, static_cast<std::uint64_t>(one.ndim() == 2 ? one.shape(0) : 0),
                          "planes");
                frusta.push_back({one.data(), static_cast<std::uint64_t>(one.shape(0))});
            }
            data = frusta.data();
            count = frusta.size();
            return;
        }
        const int widths[] = {0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0, dim + 1};
        count = static_cast<std::uint64_t>(numbers.ndim() == 2 ? numbers.shape(0) : 0);
        if (kind < JOSTLE_RAY || kind > JOSTLE_NEAREST) refuse("there is no such kind of question");
        want_rows(numbers, space, widths[kind], count, "questions");
        data = numbers.data();
        if (kind != JOSTLE_NEAREST) return;
        switch (space) { // point and greatest distance, as rows
        case JOSTLE_2F:
            fill<jostle_nearest_2f, float, 2>(near_count);
            return;
        case JOSTLE_3F:
            fill<jostle_nearest_3f, float, 3>(near_count);
            return;
        case JOSTLE_2D:
            fill<jostle_nearest_2d, double, 2>(near_count);
            return;
        default:
            fill<jostle_nearest_3d, double, 3>(near_count);
            return;
        }
    }
    Questions(const Questions&) = delete;

    jostle_question kind;
    const void* data = nullptr;
    std::uint64_t count = 0;

  private:
    template <class Nearest, class T, int Dim>
    void fill(std::uint32_t near_count)
    {
        nearest.resize(count * sizeof(Nearest));
        const T* row = static_cast<const T*>(data);
        for (std::uint64_t i = 0; i < count; ++i, row += Dim + 1) {
            Nearest one{};
            std::copy_n(row, Dim, one.point);
            one.count = near_count;
            one.max_distance = row[Dim];
            std::memcpy(nearest.data() + i * sizeof one, &one, sizeof one);
        }
        data = nearest.data();
    }
    py::array kept;
    std::vector<py::array> kept_planes;
    std::vector<jostle_frustum> frusta;
    std::vector<char> nearest;
};

struct AskFilter
{
    AskFilter(std::optional<py::array> category, std::optional<py::array> mask,
              std::optional<py::array> owner, std::optional<std::array<std::uint32_t, 3>> by,
              std::optional<std::uint64_t> excluded, py::object function)
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
        if (accept.is_none()) return;
        filter.context = this;
        filter.accept = [](void* context, std::uint32_t question, std::uint64_t id) {
            auto* const self = static_cast<AskFilter*>(context);
            return self->pending.call([&] { return self->accept(question, id).cast<bool>(); });
        };
    }
    AskFilter(const AskFilter&) = delete;

    jostle_query_filter filter{};
    Pending pending;

  private:
    jostle_asker asker{};
    std::uint64_t exclude = 0;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

/// The functions of an index or a world.
template <class Handle>
struct Asked
{
    jostle_status (*first)(const Handle*, jostle_question, const void*, std::uint64_t,
                           const jostle_query_filter*, jostle_hit*, jostle_error*);
    jostle_status (*all)(const Handle*, jostle_question, const void*, std::uint64_t,
                         const jostle_query_filter*, std::uint64_t, jostle_results*, jostle_error*);
    jostle_status (*any)(const Handle*, jostle_question, const void*, std::uint64_t,
                         const jostle_query_filter*, std::uint8_t*, jostle_error*);
    jostle_status (*count)(const Handle*, jostle_question, const void*, std::uint64_t,
                           const jostle_query_filter*, std::uint64_t*, jostle_error*);

    py::tuple ask_first(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        std::vector<jostle_hit> hits(questions.count);
        call(
            [&](jostle_error* error) {
                return first(handle, questions.kind, questions.data, questions.count, &filter.filter,
                             hits.data(), error);
            },
            &filter.pending);
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(hits.size()));
        Packed<double> at(static_cast<py::ssize_t>(hits.size()));
        for (std::size_t i = 0; i < hits.size(); ++i) {
            ids.mutable_data()[i] = hits[i].id;
            at.mutable_data()[i] = hits[i].at;
        }
        return py::make_tuple(ids, at);
    }
    py::tuple ask_all(const Handle* handle, const Questions& questions, AskFilter& filter,
                      std::uint64_t max_results) const
    {
        const Results results = new_results();
        call(
            [&](jostle_error* error) {
                return all(handle, questions.kind, questions.data, questions.count, &filter.filter,
                           max_results, results.get(), error);
            },
            &filter.pending);
        jostle_lists lists;
        call([&](jostle_error* error) { return jostle_results_lists(results.get(), &lists, error); });
        return py::make_tuple(
            copy_array(lists.first, lists.questions + 1), copy_array(lists.ids, lists.count),
            lists.at == nullptr ? py::object(py::none()) : copy_array(lists.at, lists.count),
            copy_array(lists.more, lists.questions));
    }
    py::array ask_any(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint8_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint8_t* const out = answers.mutable_data();
        call(
            [&](jostle_error* error) {
                return any(handle, questions.kind, questions.data, questions.count, &filter.filter, out,
                           error);
            },
            &filter.pending);
        return answers;
    }
    py::array ask_count(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint64_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint64_t* const out = answers.mutable_data();
        call(
            [&](jostle_error* error) {
                return count(handle, questions.kind, questions.data, questions.count, &filter.filter, out,
                             error);
            },
            &filter.pending);
        return answers;
    }
};
} // namespace jostle_python
