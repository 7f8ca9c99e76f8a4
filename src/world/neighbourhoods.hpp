// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <vector>

#include "index/groups.hpp"
#include "jostle/world.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// What rests around the objects that keep moving: for each a list of the resting objects near the way that it
/// seems to take, with their boxes. As long as it stays on that way, the list is all that it can meet, and
/// going through one or two blocks of 16 boxes is several times faster than coming down the index. Only a
/// cache: what is found doesn't depend on it.
template <int Dim, class T>
class Neighbourhoods
{
  public:
    using Box = Aabb<Dim, T>;
    using Block = index::Block<Dim, T>;
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    /// Objects with more around them are searched for in the index.
    static constexpr std::uint32_t most_blocks = 4;

    struct Hood
    {
        Box bounds;
        std::uint32_t object;  // `none`: not in use
        std::uint32_t created; // the update; objects that came to rest later aren't in it
        std::uint32_t blocks;  // 0: there were too many
        bool valid;
        Block* block;
    };

    explicit Neighbourhoods(std::pmr::memory_resource* memory)
        : memory_(memory), hood_of_(memory), hoods_(memory), free_(memory), chunks_(memory)
    {
    }
    Neighbourhoods(const Neighbourhoods&) = delete;
    Neighbourhoods& operator=(const Neighbourhoods&) = delete;
    ~Neighbourhoods()
    {
        for (Block* chunk : chunks_)
            memory_->deallocate(chunk, blocks_per_chunk * sizeof(Block), alignof(Block));
    }

    void make_room(std::size_t objects)
    {
        if (hood_of_.size() < objects) hood_of_.resize(objects, none);
    }
    /// The object's, if it has one.
    [[nodiscard]] const Hood* find(std::uint32_t object) const noexcept
    {
        const std::uint32_t h = hood_of_[object];
        return h == none ? nullptr : &hoods_[h];
    }
    /// A hood with room for so many neighbours, in place of the one before. The caller fills the blocks.
    Hood& make(std::uint32_t object, const Box& bounds, std::uint32_t update, std::size_t neighbours)
    {
        std::uint32_t h = hood_of_[object];
        if (h == none) {
            if (free_.empty()) {
                hoods_.push_back({});
                free_.reserve(hoods_.capacity());
                hoods_.back().object = none;
                free_.push_back(static_cast<std::uint32_t>(hoods_.size() - 1));
            }
            h = free_.back();
            hoods_[h] = {bounds, none, 0, 0, false, nullptr};
        }
        Hood& hood = hoods_[h];
        hood.valid = false;
        const auto wanted = static_cast<std::uint32_t>((neighbours + index::lanes - 1) / index::lanes);
        const std::uint32_t blocks = wanted > most_blocks ? 0 : std::max(1u, wanted);
        if (blocks != hood.blocks) {
            Block* const fresh = blocks != 0 ? take(blocks) : nullptr;
            give(hood.block, hood.blocks);
            hood.block = fresh;
            hood.blocks = blocks;
        }
        if (hood_of_[object] == none) {
            free_.pop_back();
            hood_of_[object] = h;
            hood.object = object;
        }
        hood.bounds = bounds;
        hood.created = update;
        hood.valid = true;
        return hood;
    }
    void drop(std::uint32_t object) noexcept
    {
        if (object >= hood_of_.size() || hood_of_[object] == none) return;
        Hood& hood = hoods_[hood_of_[object]];
        give(hood.block, hood.blocks);
        hood = {hood.bounds, none, 0, 0, false, nullptr};
        free_.push_back(hood_of_[object]); // there is room: as many as hoods
        hood_of_[object] = none;
    }
    void invalidate_all() noexcept
    {
        for (Hood& hood : hoods_)
            hood.valid = false;
    }
    [[nodiscard]] std::pmr::vector<Hood>& all() noexcept { return hoods_; }
    [[nodiscard]] std::size_t size() const noexcept { return hoods_.size() - free_.size(); }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return chunks_.size() * blocks_per_chunk * sizeof(Block) + hoods_.capacity() * sizeof(Hood) +
               (hood_of_.capacity() + free_.capacity()) * sizeof(std::uint32_t) +
               chunks_.capacity() * sizeof(Block*);
    }

  private:
    static constexpr std::size_t blocks_per_chunk = 128;

    Block* take(std::uint32_t blocks)
    {
        Block*& first = unused_[blocks];
        if (first != nullptr) {
            Block* const taken = first;
            first = next_of(taken);
            return taken;
        }
        if (left_ < blocks) {
            chunks_.push_back(nullptr);
            try {
                chunks_.back() =
                    static_cast<Block*>(memory_->allocate(blocks_per_chunk * sizeof(Block), alignof(Block)));
            } catch (...) {
                chunks_.pop_back();
                throw;
            }
            while (left_ > 0) { // a remnant of the last chunk
                give(fresh_, 1);
                ++fresh_;
                --left_;
            }
            fresh_ = chunks_.back();
            left_ = blocks_per_chunk;
        }
        Block* const taken = fresh_;
        fresh_ += blocks;
        left_ -= blocks;
        return taken;
    }
    void give(Block* block, std::uint32_t blocks) noexcept
    {
        if (block == nullptr) return;
        new (block) Block*(unused_[blocks]);
        unused_[blocks] = block;
    }
    static Block* next_of(Block* block) noexcept { return *reinterpret_cast<Block**>(block); }

    std::pmr::memory_resource* memory_;
    std::pmr::vector<std::uint32_t> hood_of_; // objects
    std::pmr::vector<Hood> hoods_;
    std::pmr::vector<std::uint32_t> free_;
    std::pmr::vector<Block*> chunks_;
    std::array<Block*, most_blocks + 1> unused_ = {}; // by number of blocks: a list of runs
    Block* fresh_ = nullptr;
    std::size_t left_ = 0;
};

/// Around the way that an object takes: as far on as it would come in some updates, and a bit back.
template <int Dim, class T>
[[nodiscard]] Aabb<Dim, T> way_of(const Aabb<Dim, T>& before, const Aabb<Dim, T>& now) noexcept
{
    constexpr T updates = 16;
    Aabb<Dim, T> way = now;
    for (int d = 0; d < Dim; ++d) {
        const T step = now.lo[d] - before.lo[d], size = now.hi[d] - now.lo[d];
        const T length = step < 0 ? -step : step;
        // Not so far that there would be much more around it than at it.
        const T ahead = std::min(updates * length, size), back = std::min(length, size);
        way.lo[d] -= step < 0 ? ahead : back;
        way.hi[d] += step < 0 ? back : ahead;
        if (!(way.lo[d] <= now.lo[d] && way.hi[d] >= now.hi[d])) { // infinite sizes
            way.lo[d] = now.lo[d];
            way.hi[d] = now.hi[d];
        }
    }
    return way;
}

template <int Dim, class T>
[[nodiscard]] bool holds(const Aabb<Dim, T>& outer, const Aabb<Dim, T>& inner) noexcept
{
    bool all = true;
    for (int d = 0; d < Dim; ++d)
        all &= (outer.lo[d] <= inner.lo[d]) & (inner.hi[d] <= outer.hi[d]);
    return all;
}

} // namespace world
JOSTLE_NAMESPACE_END
