// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <vector>

#include "core/arrays.hpp"

// Groups of pairs, each with one answer, from answers about some of the pairs.

namespace jostle_python {

/// Of each group the first pair that touches, or the nearest one. Pairs are asked about in parts that end
/// anywhere, since a single group may have them all.
class PairGroups
{
  public:
    /// `offsets` say where groups begin, and the last where they end. Distances are asked for where
    /// `max_distance` is given.
    PairGroups(const Packed<std::uint64_t>& offsets, std::optional<double> max_distance, jostle_space space)
        : offsets_(offsets.data(), offsets.data() + length_of(offsets, "offsets")),
          max_distance_(max_distance),
          single_(is_float(space)),
          numbers_(static_cast<py::ssize_t>(count())),
          rows_(number_of(space),
                {static_cast<py::ssize_t>(max_distance ? count() : 0), py::ssize_t(3 * dim_of(space) + 1)}),
          number_(numbers_.mutable_data()),
          row_(static_cast<char*>(rows_.mutable_data())),
          row_size_(static_cast<std::size_t>(rows_.strides(0)))
    {
    }
    /// Whether they are the groups of so many pairs, more than none.
    [[nodiscard]] bool can_be_cut(std::uint64_t pairs) const
    {
        return pairs != 0 && offsets_.front() == 0 && offsets_.back() == pairs &&
               std::is_sorted(offsets_.begin(), offsets_.end());
    }
    /// Calls ask(first pair, last pair, offsets counted from the first, greatest distance, distances, numbers
    /// of pairs, error) about all pairs.
    template <class F>
    jostle_status ask_all(std::uint64_t pairs, jostle_error* error, F&& ask)
    {
        return ask(std::uint64_t{0}, pairs, offsets_, max_distance_.value_or(0), row_, number_, error);
    }
    /// The same about the pairs from `first` to `last`. The pairs before `first` have been asked about.
    template <class F>
    jostle_status ask_some(std::uint64_t first, std::uint64_t last, jostle_error* error, F&& ask)
    {
        if (first == 0) forget();
        std::size_t group = group_of(first);
        if (!max_distance_ && number_[group] != none) { // what comes after the first isn't tested
            first = std::min(offsets_[group + 1], last);
            if (first == last) return JOSTLE_OK;
            group = group_of(first);
        }
        bounds_.assign(1, 0);
        for (std::size_t next = group + 1; offsets_[next] < last; ++next)
            bounds_.push_back(offsets_[next] - first);
        bounds_.push_back(last - first);
        const std::size_t groups = bounds_.size() - 1;
        some_numbers_.resize(groups);
        some_rows_.resize(max_distance_ ? groups * row_size_ : 0);
        double limit = max_distance_.value_or(0);
        if (max_distance_ && groups == 1 && number_[group] != none)
            limit = std::min(limit, std::max(distance(row_ + group * row_size_), 0.0));
        const jostle_status status =
            ask(first, last, bounds_, limit, some_rows_.data(), some_numbers_.data(), error);
        if (status != JOSTLE_OK) return status;
        for (std::size_t i = 0; i < groups; ++i) {
            if (some_numbers_[i] == none) continue;
            char* const row = row_ + (group + i) * row_size_;
            const char* const found = some_rows_.data() + i * row_size_;
            if (max_distance_) {
                if (number_[group + i] != none && !(distance(found) < distance(row))) continue;
                std::memcpy(row, found, row_size_);
            }
            number_[group + i] = first + some_numbers_[i];
        }
        return JOSTLE_OK;
    }
    [[nodiscard]] py::tuple answers() const { return py::make_tuple(numbers_, rows_); }

  private:
    static constexpr std::uint64_t none = UINT64_MAX;

    [[nodiscard]] std::uint64_t count() const { return offsets_.size() - 1; }
    [[nodiscard]] std::size_t group_of(std::uint64_t pair) const
    {
        const auto next = std::upper_bound(offsets_.begin(), offsets_.end(), pair);
        return static_cast<std::size_t>(next - offsets_.begin()) - 1;
    }
    void forget()
    {
        std::fill_n(number_, count(), none);
        if (!max_distance_) return;
        std::memset(row_, 0, count() * row_size_);
        for (std::uint64_t group = 0; group < count(); ++group) {
            char* const row = row_ + group * row_size_;
            if (single_)
                store(row, std::numeric_limits<float>::infinity());
            else
                store(row, std::numeric_limits<double>::infinity());
        }
    }
    template <class T>
    static void store(char* row, T distance)
    {
        std::memcpy(row, &distance, sizeof distance);
    }
    [[nodiscard]] double distance(const char* row) const
    {
        if (!single_) return load<double>(row);
        return static_cast<double>(load<float>(row));
    }
    template <class T>
    static T load(const char* row)
    {
        T distance;
        std::memcpy(&distance, row, sizeof distance);
        return distance;
    }

    std::vector<std::uint64_t> offsets_;
    std::optional<double> max_distance_;
    bool single_;
    Packed<std::uint64_t> numbers_;
    py::array rows_;
    std::uint64_t* number_; // of each group's pair
    char* row_;             // its distance and the rest
    std::size_t row_size_;
    // Of some of the pairs.
    std::vector<std::uint64_t> bounds_, some_numbers_;
    std::vector<char> some_rows_;
};

} // namespace jostle_python
