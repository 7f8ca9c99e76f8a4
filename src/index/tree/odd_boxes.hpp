// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory_resource>
#include <span>
#include <utility>
#include <vector>

#include "base/box.hpp"
#include "index/tree/tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Those of some boxes that are valid, with their ids or, without any, their positions.
template <int Dim, class T>
struct ValidBoxes
{
    explicit ValidBoxes(std::pmr::memory_resource* memory) : ids(memory), boxes(memory) {}
    ValidBoxes(std::pmr::memory_resource* memory, const BoxView<Dim, T>& all) : ValidBoxes(memory)
    {
        for (std::size_t i = 0; i < all.size(); ++i)
            if (const Aabb<Dim, T> box = all[i]; valid(box)) add(static_cast<std::uint32_t>(i), box);
    }
    void add(std::uint32_t id, const Aabb<Dim, T>& box)
    {
        ids.push_back(id);
        boxes.push_back(box);
    }
    std::pmr::vector<std::uint32_t> ids;
    std::pmr::vector<Aabb<Dim, T>> boxes;
};

/// The objects of an index that ignores odd boxes (NaN or inverted) whose boxes are odd: what they touch is
/// nothing, so they are in no tree. The calls that change an index, with objects of both kinds; each leaves
/// everything as it was if it throws.
template <int Dim, class T>
class OddBoxes
{
  public:
    using Box = Aabb<Dim, T>;
    using View = BoxView<Dim, T>;
    using Ids = std::span<const std::uint32_t>;

    explicit OddBoxes(std::pmr::memory_resource* memory) : boxes_(typename Map::allocator_type(memory)) {}

    [[nodiscard]] std::size_t size() const noexcept { return boxes_.size(); }
    [[nodiscard]] bool contains(std::uint32_t id) const noexcept { return boxes_.contains(id); }
    [[nodiscard]] const Box& box(std::uint32_t id) const { return boxes_.find(id)->second; }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return boxes_.size() * (sizeof(typename Map::value_type) + 4 * sizeof(void*)); // a node's links
    }
    void clear() noexcept { boxes_.clear(); }

    void build(Tree<Dim, T>& tree, Ids ids, const View& boxes)
    {
        ValidBoxes<Dim, T> good(memory());
        Map odd = sort_out(ids, boxes, good);
        tree.build(good.ids, View(good.boxes));
        boxes_.swap(odd);
    }
    void insert(Tree<Dim, T>& tree, Ids ids, const View& boxes)
    {
        ValidBoxes<Dim, T> good(memory());
        Map odd = sort_out(ids, boxes, good);
        tree.insert(good.ids, View(good.boxes));
        boxes_.merge(odd);
    }
    void erase(Tree<Dim, T>& tree, Ids ids)
    {
        std::pmr::vector<std::uint32_t> good(memory());
        for (const std::uint32_t id : ids)
            if (!contains(id)) good.push_back(id);
        tree.erase(good);
        for (const std::uint32_t id : ids)
            boxes_.erase(id);
    }
    void move(Tree<Dim, T>& tree, Ids ids, const View& boxes)
    {
        ValidBoxes<Dim, T> stay(memory()), enter(memory()); // in the tree, and into it
        std::pmr::vector<std::uint32_t> leave(memory());    // it
        Map odd(boxes_.get_allocator());
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const Box box = boxes[i];
            const bool was_odd = contains(ids[i]);
            if (valid(box)) {
                (was_odd ? enter : stay).add(ids[i], box);
            } else {
                odd.emplace(ids[i], box);
                if (!was_odd) leave.push_back(ids[i]);
            }
        }
        tree.insert(enter.ids, View(enter.boxes));
        try {
            tree.move(stay.ids, View(stay.boxes));
        } catch (...) {
            tree.erase(enter.ids);
            throw;
        }
        tree.erase(leave);
        for (const std::uint32_t id : ids)
            boxes_.erase(id);
        boxes_.merge(odd);
    }

  private:
    // Not std::pmr::map, which not every standard library has.
    using Map = std::map<std::uint32_t, Box, std::less<>,
                         std::pmr::polymorphic_allocator<std::pair<const std::uint32_t, Box>>>;
    [[nodiscard]] std::pmr::memory_resource* memory() const { return boxes_.get_allocator().resource(); }
    /// Adds the valid ones to `good` and returns the others. Without ids, positions stand for them.
    [[nodiscard]] Map sort_out(Ids ids, const View& boxes, ValidBoxes<Dim, T>& good) const
    {
        Map odd(boxes_.get_allocator());
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const std::uint32_t id = ids.empty() ? static_cast<std::uint32_t>(i) : ids[i];
            if (const Box box = boxes[i]; valid(box))
                good.add(id, box);
            else
                odd.emplace(id, box);
        }
        return odd;
    }

    Map boxes_; // by id
};

} // namespace index
JOSTLE_NAMESPACE_END
