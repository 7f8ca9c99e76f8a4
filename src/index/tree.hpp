// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Tells whether an object counts; null where all do.
using Wanted = FunctionRef<bool(std::uint32_t id)>;

template <int Dim, class T>
class Tree
{
  public:
    using Box = Aabb<Dim, T>;
    explicit Tree(const FinderOptions& options);

    void insert(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    void erase(std::span<const std::uint32_t> ids) noexcept;
    void move(std::span<const std::uint32_t> ids, const BoxView<Dim, T>& boxes);
    void clear() noexcept;
    std::size_t size() const noexcept { return size_; }
    std::uint64_t id_end() const noexcept { return here_.size(); }
    bool contains(std::uint32_t id) const noexcept { return id < here_.size() && here_[id] != 0; }
    Box box(std::uint32_t id) const noexcept { return box_[id]; }

    // Results come in any order.
    template <class Line>
    Hit<T> first(const Line& line, Wanted wanted) const
    {
        Hit<T> best;
        each(wanted, [&](std::uint32_t id, const Box& box) {
            const std::optional<T> at = hit_fraction(line, box);
            if (at && (best.id == Hit<T>::none || Hit<T>{id, *at} < best)) best = {id, *at};
            return true;
        });
        return best;
    }
    template <class Line>
    void all(const Line& line, Wanted wanted, std::vector<Hit<T>>& out) const
    {
        each(wanted, [&](std::uint32_t id, const Box& box) {
            if (const std::optional<T> at = hit_fraction(line, box)) out.push_back({id, *at});
            return true;
        });
    }
    template <class Region>
    void all(const Region& region, Wanted wanted, std::vector<std::uint32_t>& out) const
    {
        each(wanted, [&](std::uint32_t id, const Box& box) {
            if (overlaps(region, box)) out.push_back(id);
            return true;
        });
    }
    void nearest(const Nearest<Dim, T>& question, Wanted wanted, std::vector<Hit<T>>& out) const
    {
        each(wanted, [&](std::uint32_t id, const Box& box) {
            const T at = squared_distance(question.point, box);
            if (at <= question.max_distance * question.max_distance) out.push_back({id, at});
            return true;
        });
    }
    void join(const BoxView<Dim, T>& boxes, std::uint32_t first, std::uint32_t last,
              std::vector<Pair>& out) const
    {
        for (std::uint32_t i = first; i < last; ++i)
            each({}, [&](std::uint32_t id, const Box& box) {
                if (overlaps(boxes[i], box)) out.push_back({i, id});
                return true;
            });
    }

  private:
    template <class Visit>
    void each(Wanted wanted, const Visit& visit) const
    {
        for (std::uint32_t id = 0; id < here_.size(); ++id)
            if (here_[id] && (!wanted || wanted(id)) && !visit(id, box_[id])) return;
    }
    std::vector<Box> box_;
    std::vector<std::uint8_t> here_;
    std::size_t size_ = 0;
};

} // namespace index
JOSTLE_NAMESPACE_END
