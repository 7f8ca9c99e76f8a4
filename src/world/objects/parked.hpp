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
/// until then would make all updates slow. Here they only lie side by side: changed objects are compared with
/// them, at a nanosecond or two each, and nothing else is done with them until their turn comes.
template <int Dim, class T>
class Parked
{
  public:
    using Box = Aabb<Dim, T>;
    static constexpr Index nobody{~std::uint32_t{0}};

    explicit Parked(std::pmr::memory_resource* memory) : boxes_(memory), indices_(memory), place_of_(memory)
    {
    }

    [[nodiscard]] std::size_t size() const noexcept { return end_ - front_ - gone_; }

    /// The boxes, also of some that have left or changed since, and of those that are staged. Their places
    /// are numbered from 0.
    [[nodiscard]] std::span<const Box> boxes() const noexcept
    {
        return std::span<const Box>(boxes_).subspan(front_);
    }
    /// Whose box it is; `nobody` if the object has left.
    [[nodiscard]] Index index(std::size_t place) const noexcept { return indices_[front_ + place]; }
    /// Calls body(index) for each, in the order in which they come to rest, until it returns false.
    template <class Body>
    void each(const Body& body) const
    {
        for (std::size_t at = front_; at < end_; ++at)
            if (indices_[at] != nobody && !body(indices_[at])) return;
    }

    // What an update that may still fail says:

    void unstage() noexcept
    {
        boxes_.resize(end_);
        indices_.resize(end_);
    }
    /// The object comes last; it isn't here before keep_staged.
    void stage(Index object, const Box& box)
    {
        indices_.push_back(object);
        boxes_.push_back(box);
    }
    [[nodiscard]] std::span<const Index> staged() const noexcept
    {
        return std::span<const Index>(indices_).subspan(end_);
    }
    /// Room for all objects there are.
    void make_room(std::size_t objects)
    {
        if (place_of_.size() < objects) place_of_.grow(objects);
    }

    void reserve(std::size_t count)
    {
        boxes_.reserve(count);
        indices_.reserve(count);
    }

    // When an update is committed:

    void clear() noexcept
    {
        front_ = end_ = gone_ = 0;
        unstage();
    }
    /// The first `count` of what is staged is here from now on, the rest isn't.
    void keep_staged(std::size_t count) noexcept
    {
        for (; count != 0; --count, ++end_)
            place_of_[indices_[end_]] = static_cast<std::uint32_t>(end_);
        unstage();
    }
    /// An object that is here leaves.
    void remove(Index object) noexcept
    {
        const std::size_t at = place_of_[object];
        assert(at >= front_ && at < end_ && indices_[at] == object);
        indices_[at] = nobody;
        ++gone_;
    }
    /// After some have been removed. Takes no longer than they took to come and go.
    void close_gaps() noexcept
    {
        while (front_ < end_ && indices_[front_] == nobody) {
            ++front_;
            --gone_;
        }
        if (2 * (front_ + gone_) <= end_) return;
        std::size_t to = 0;
        for (std::size_t at = front_; at < end_; ++at) {
            if (indices_[at] == nobody) continue;
            boxes_[to] = boxes_[at];
            indices_[to] = indices_[at];
            place_of_[indices_[to]] = static_cast<std::uint32_t>(to);
            ++to;
        }
        front_ = gone_ = 0;
        end_ = to;
        unstage();
    }

  private:
    std::pmr::vector<Box> boxes_;
    std::pmr::vector<Index> indices_;
    std::size_t front_ = 0, end_ = 0;      // those that are here; what is staged follows
    std::size_t gone_ = 0;                 // of these: have left
    Table<Index, std::uint32_t> place_of_; // of objects that are here
};

} // namespace world
JOSTLE_NAMESPACE_END
