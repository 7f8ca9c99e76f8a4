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
#include "core/visits.hpp"

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
            size = sizeof frusta[0];
            return;
        }
        const int widths[] = {0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, 0, dim + 1, 2 * dim + 1};
        count = static_cast<std::uint64_t>(numbers.ndim() == 2 ? numbers.shape(0) : 0);
        if (kind < JOSTLE_RAY || kind > JOSTLE_NEAREST_TO_BOX) refuse("there is no such kind of question");
        want_rows(numbers, space, widths[kind], count, "questions");
        data = numbers.data();
        size = static_cast<std::uint64_t>(widths[kind] * numbers.itemsize());
        if (kind != JOSTLE_NEAREST && kind != JOSTLE_NEAREST_TO_BOX) return;
        const bool to_box = kind == JOSTLE_NEAREST_TO_BOX;
        using Fill = void (Questions::*)(std::uint32_t);
        const Fill fills[][2] = {
            {&Questions::fill<float, jostle_nearest_2f>, &Questions::fill<float, jostle_nearest_to_box_2f>},
            {&Questions::fill<float, jostle_nearest_3f>, &Questions::fill<float, jostle_nearest_to_box_3f>},
            {&Questions::fill<double, jostle_nearest_2d>, &Questions::fill<double, jostle_nearest_to_box_2d>},
            {&Questions::fill<double, jostle_nearest_3d>,
             &Questions::fill<double, jostle_nearest_to_box_3d>}};
        (this->*fills[space - JOSTLE_2F][to_box ? 1 : 0])(near_count);
    }
    Questions(const Questions&) = delete;

    /// Those from the one of this number on.
    [[nodiscard]] const void* from(std::uint64_t first) const
    {
        return static_cast<const char*>(data) + first * size;
    }

    jostle_question kind;
    const void* data = nullptr;
    std::uint64_t count = 0, size = 0; // how many, and of how many bytes each

  private:
    /// From rows of a point or box, which a Nearest begins with, and the greatest distance.
    template <class T, class Nearest>
    void fill(std::uint32_t near_count)
    {
        nearest.resize(count * sizeof(Nearest));
        const std::size_t place = size - sizeof(T);
        for (std::uint64_t i = 0; i < count; ++i) {
            const char* const row = static_cast<const char*>(from(i));
            Nearest one{};
            std::memcpy(static_cast<void*>(&one), row, place);
            one.count = near_count;
            std::memcpy(&one.max_distance, row + place, sizeof(T));
            std::memcpy(nearest.data() + i * sizeof one, &one, sizeof one);
        }
        data = nearest.data();
        size = sizeof(Nearest);
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
            filter.accept = [](void* context, std::uint32_t question, std::uint64_t id) {
                auto* const self = static_cast<AskFilter*>(context);
                return self->pending.call(
                    [&] { return truth_of(self->accept(self->first_question + question, id)); });
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
    /// What serves `number` questions from number `first` on, once check() has passed.
    [[nodiscard]] const jostle_query_filter* from(std::uint64_t first, std::uint64_t number)
    {
        if (!has_each || number == 0) return &filter;
        each[first].count = number;
        return &each[first];
    }
    [[nodiscard]] bool asks_python() const { return !accept.is_none(); }
    void check(std::uint64_t questions) const
    {
        if (has_each && excludes.size() != questions)
            refuse("there are " + std::to_string(questions) + " queries and " +
                   std::to_string(excludes.size()) + " ids to exclude: give one for all, or one for each");
    }

    std::uint64_t first_question = 0; // of those that are being asked
    Pending pending;

  private:
    jostle_query_filter filter{};
    bool has_each = false;
    std::vector<std::uint64_t> excludes;
    std::vector<jostle_query_filter> each; // one for each question
    jostle_asker asker{};
    std::uint64_t exclude = 0;
    std::vector<std::optional<py::array>> kept;
    py::object accept;
};

/// Calls ask(first, count, error) about `count` questions, a few at a time, and looks for Ctrl-C in between.
/// Where a function in Python is asked, one at a time, which stays on this thread: of several, each would
/// wait for the others most of the time, and not notice Ctrl-C.
template <class F>
void ask_in_parts(std::uint64_t count, AskFilter& filter, F&& ask)
{
    filter.check(count);
    const auto part = [&](std::uint64_t first, std::uint64_t now, jostle_error* error) {
        filter.first_question = first;
        return ask(first, now, error);
    };
    call_in_parts(count, &filter.pending, part, filter.asks_python() ? 1 : UINT64_MAX);
}

/// Lists of answers, one for each question, which were asked in parts.
class FoundLists
{
  public:
    /// Calls ask(results) about the questions from number `first` on.
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
    [[nodiscard]] const std::vector<Results>& parts() const { return parts_; }
    /// Where each list begins, and their end; the ids; where they are, or None if the kind of question
    /// doesn't say; which questions have more.
    [[nodiscard]] py::tuple joined(std::uint64_t questions, bool has_at) const
    {
        std::vector<jostle_lists> lists(parts_.size());
        std::uint64_t count = 0;
        for (std::size_t i = 0; i < parts_.size(); ++i) {
            call(
                [&](jostle_error* error) { return jostle_results_lists(parts_[i].get(), &lists[i], error); });
            count += lists[i].count;
        }
        Packed<std::uint64_t> begins(static_cast<py::ssize_t>(questions + 1));
        Packed<std::uint64_t> ids(static_cast<py::ssize_t>(count));
        Packed<double> at(static_cast<py::ssize_t>(has_at ? count : 0));
        Packed<std::uint8_t> more(static_cast<py::ssize_t>(questions));
        std::uint64_t question = 0, answer = 0;
        for (const jostle_lists& one : lists) {
            for (std::uint64_t i = 0; i < one.questions; ++i)
                begins.mutable_data()[question + i] = answer + one.first[i];
            std::copy_n(one.more, one.questions, more.mutable_data() + question);
            std::copy_n(one.ids, one.count, ids.mutable_data() + answer);
            if (has_at) std::copy_n(one.at, one.count, at.mutable_data() + answer);
            question += one.questions;
            answer += one.count;
        }
        begins.mutable_data()[question] = answer;
        return py::make_tuple(begins, ids, has_at ? py::object(at) : py::object(py::none()), more);
    }

  private:
    std::vector<Results> parts_;
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

    jostle_status (*visit)(const Handle*, jostle_question, const void*, const jostle_query_filter*,
                           jostle_visit_answer_function, void*, std::int32_t*, jostle_error*);
    jostle_status (*closest_pairs)(const Handle*, const Handle*, double, jostle_visit_close_pair_function,
                                   void*, std::int32_t*, jostle_error*);

    py::tuple ask_first(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        std::vector<jostle_hit> hits(questions.count);
        ask_in_parts(questions.count, filter, [&](auto from, auto number, auto* error) {
            return first(handle, questions.kind, questions.from(from), number, filter.from(from, number),
                         hits.data() + from, error);
        });
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
        FoundLists found;
        ask_in_parts(questions.count, filter, [&](auto from, auto number, auto* error) {
            return found.add(from, error, [&](jostle_results* results) {
                return all(handle, questions.kind, questions.from(from), number, filter.from(from, number),
                           max_results, results, error);
            });
        });
        const bool is_region = questions.kind == JOSTLE_BOX || questions.kind == JOSTLE_SPHERE ||
                               questions.kind == JOSTLE_FRUSTUM;
        return found.joined(questions.count, !is_region);
    }
    py::array ask_any(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint8_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint8_t* const out = answers.mutable_data();
        ask_in_parts(questions.count, filter, [&](auto from, auto number, auto* error) {
            return any(handle, questions.kind, questions.from(from), number, filter.from(from, number),
                       out + from, error);
        });
        return answers;
    }
    py::array ask_count(const Handle* handle, const Questions& questions, AskFilter& filter) const
    {
        Packed<std::uint64_t> answers(static_cast<py::ssize_t>(questions.count));
        std::uint64_t* const out = answers.mutable_data();
        ask_in_parts(questions.count, filter, [&](auto from, auto number, auto* error) {
            return count(handle, questions.kind, questions.from(from), number, filter.from(from, number),
                         out + from, error);
        });
        return answers;
    }
    /// Whether the function never said stop.
    bool ask_visit(const Handle* handle, const Questions& questions, AskFilter& filter, py::object function,
                   std::uint64_t chunk) const
    {
        if (questions.count != 1)
            refuse("there are " + std::to_string(questions.count) + " questions: visit takes one");
        const jostle_query_filter* const one = filter.one();
        Visitor visitor(std::move(function), chunk, 1, false, filter.pending);
        return visitor.run([&](void* context, auto* finished, auto* error) {
            return visit(handle, questions.kind, questions.data, one, Visitor::take_answer, context, finished,
                         error);
        });
    }
    /// The same. Ids are `narrow` where they fit into 32 bits.
    bool ask_closest_pairs(const Handle* handle, const Handle* other, double max_distance,
                           py::object function, std::uint64_t chunk, bool narrow) const
    {
        Pending pending;
        Visitor visitor(std::move(function), chunk, 2, narrow, pending);
        return visitor.run([&](void* context, auto* finished, auto* error) {
            return closest_pairs(handle, other, max_distance, Visitor::take_pair, context, finished, error);
        });
    }
};
} // namespace jostle_python
