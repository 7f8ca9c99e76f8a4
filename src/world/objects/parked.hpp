// SPDX-License-Identifier: MIT
#pragma once

#include <cassert>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "world/objects/numbers.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Active objects that no longer change, in the order in which they come to rest. If many stop at once,
/// putting all of them into the index would make one update long, and visiting each of them in every update
/// until then would make all updates slow. Here their boxes are contiguous: changed objects are compared with
/// them, at a nanosecond or two each, and nothing else is done with them until their turn.
template <int Dim, class T>
class Parked
{
  public:
    using Box = Aabb<Dim, T>;
    static constexpr Index nobody{~std::uint32_t{0}};

    explicit Parked(std::pmr::memory_resource* memory) : boxes_(memory), indices_(memory), place_of_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return indices_.size() - front_ - gone_; }

    /// The boxes, including some of objects that have left or changed since. Their places are numbered from
    /// 0.
    [[nodiscard]] std::span<const Box> boxes() const noexcept
    {
        return std::span<const Box>(boxes_).subspan(front_);
    }
    /// The object whose box it is; `nobody` if the object has left.
    [[nodiscard]] Index index(std::size_t place) const noexcept { return indices_[front_ + place]; }
    /// Calls body(index) for each, in the order in which they come to rest, until it returns false.
    template <class Body>
    void each(const Body& body) const
    {
        for (std::size_t at = front_; at < indices_.size(); ++at)
            if (indices_[at] != nobody && !body(indices_[at])) return;
    }

    /// Makes room for all objects of the world.
    void make_room(std::size_t objects)
    {
        if (place_of_.size() < objects) place_of_.grow(objects);
    }
    /// Makes room for this many more.
    void reserve(std::size_t count)
    {
        reserve_more(boxes_, count);
        reserve_more(indices_, count);
    }

    // When an update is committed:

    void clear() noexcept
    {
        boxes_.clear();
        indices_.clear();
        front_ = gone_ = 0;
    }
    /// Adds the object at the end. There is room for it.
    void push(Index object, const Box& box) noexcept
    {
        place_of_[object] = static_cast<std::uint32_t>(indices_.size());
        indices_.push_back(object);
        boxes_.push_back(box);
    }
    /// Removes an object that is here.
    void remove(Index object) noexcept
    {
        const std::size_t at = place_of_[object];
        assert(at >= front_ && at < indices_.size() && indices_[at] == object);
        indices_[at] = nobody;
        ++gone_;
    }
    /// Called after some were removed. Takes no longer than adding and removing them took.
    void close_gaps() noexcept
    {
        while (front_ < indices_.size() && indices_[front_] == nobody) {
            ++front_;
            --gone_;
        }
        if (2 * (front_ + gone_) <= indices_.size()) return;
        std::size_t to = 0;
        for (std::size_t at = front_; at < indices_.size(); ++at) {
            if (indices_[at] == nobody) continue;
            boxes_[to] = boxes_[at];
            indices_[to] = indices_[at];
            place_of_[indices_[to]] = static_cast<std::uint32_t>(to);
            ++to;
        }
        front_ = gone_ = 0;
        boxes_.resize(to);
        indices_.resize(to);
    }

  private:
    std::pmr::vector<Box> boxes_;
    std::pmr::vector<Index> indices_;
    std::size_t front_ = 0;                // the first that is still here
    std::size_t gone_ = 0;                 // how many after it have left
    Table<Index, std::uint32_t> place_of_; // of objects that are here
};

} // namespace world
JOSTLE_NAMESPACE_END
