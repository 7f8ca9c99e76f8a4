// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <vector>

#include "index/listing.hpp"
#include "jostle/world.hpp"
#include "world/objects.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// What rests around the objects that keep moving: for each a list of the resting objects near the way that it
/// seems to take, with the measures of their boxes. As long as it stays on that way, the list is all that it
/// can meet, and going through one or two listings of 16 is many times faster than coming down the index. Only
/// a cache: what is found doesn't depend on it.
template <int Dim, class T>
class Neighbourhoods
{
  public:
    using Box = Aabb<Dim, T>;
    using Listing = index::Listing<Dim>;
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    /// Objects with more around them are searched for in the index.
    static constexpr std::uint32_t most_listings = 4;

    struct Hood
    {
        Box bounds;
        std::uint32_t object;  // `none`: not in use
        std::uint32_t created; // the update; objects that came to rest later aren't in it
        std::uint32_t count;   // of listings; 0: there were too many neighbours
        bool valid;
        Listing* listings;
    };

    explicit Neighbourhoods(std::pmr::memory_resource* memory)
        : memory_(memory), hood_of_(memory), hoods_(memory), free_(memory), chunks_(memory)
    {
    }
    Neighbourhoods(const Neighbourhoods&) = delete;
    Neighbourhoods& operator=(const Neighbourhoods&) = delete;
    ~Neighbourhoods()
    {
        for (Listing* chunk : chunks_)
            memory_->deallocate(chunk, listings_per_chunk * sizeof(Listing), alignof(Listing));
    }

    void make_room(std::size_t objects)
    {
        if (hood_of_.size() < objects) hood_of_.resize(objects, none);
    }
    void prefetch_number(std::uint32_t object) const noexcept { fetch(&hood_of_[object]); }
    void prefetch(std::uint32_t object) const noexcept
    {
        if (hood_of_[object] != none) fetch(&hoods_[hood_of_[object]]);
    }
    void prefetch_listings(std::uint32_t object) const noexcept
    {
        if (hood_of_[object] == none) return;
        const Hood& hood = hoods_[hood_of_[object]];
        for (std::size_t at = 0; at < hood.count * sizeof(Listing); at += 64)
            fetch(reinterpret_cast<const char*>(hood.listings) + at);
    }
    /// The object's, if it has one.
    [[nodiscard]] const Hood* find(std::uint32_t object) const noexcept
    {
        const std::uint32_t h = hood_of_[object];
        return h == none ? nullptr : &hoods_[h];
    }
    /// A hood with room for so many neighbours, in place of the one before. The caller fills the listings.
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
        const std::uint32_t count = wanted > most_listings ? 0 : std::max(1u, wanted);
        if (count != hood.count) {
            Listing* const fresh = count != 0 ? take(count) : nullptr;
            give(hood.listings, hood.count);
            hood.listings = fresh;
            hood.count = count;
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
        give(hood.listings, hood.count);
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
        return chunks_.size() * listings_per_chunk * sizeof(Listing) + hoods_.capacity() * sizeof(Hood) +
               (hood_of_.capacity() + free_.capacity()) * sizeof(std::uint32_t) +
               chunks_.capacity() * sizeof(Listing*);
    }

  private:
    static constexpr std::size_t listings_per_chunk = 128;

    Listing* take(std::uint32_t count)
    {
        Listing*& first = unused_[count];
        if (first != nullptr) {
            Listing* const taken = first;
            first = next_of(taken);
            return taken;
        }
        if (left_ < count) {
            chunks_.push_back(nullptr);
            try {
                chunks_.back() = static_cast<Listing*>(
                    memory_->allocate(listings_per_chunk * sizeof(Listing), alignof(Listing)));
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
            left_ = listings_per_chunk;
        }
        Listing* const taken = fresh_;
        fresh_ += count;
        left_ -= count;
        return taken;
    }
    void give(Listing* listings, std::uint32_t count) noexcept
    {
        if (listings == nullptr) return;
        new (listings) Listing*(unused_[count]);
        unused_[count] = listings;
    }
    static Listing* next_of(Listing* listings) noexcept { return *reinterpret_cast<Listing**>(listings); }

    std::pmr::memory_resource* memory_;
    std::pmr::vector<std::uint32_t> hood_of_; // objects
    std::pmr::vector<Hood> hoods_;
    std::pmr::vector<std::uint32_t> free_;
    std::pmr::vector<Listing*> chunks_;
    std::array<Listing*, most_listings + 1> unused_ = {}; // by number of listings: a list of runs
    Listing* fresh_ = nullptr;
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
