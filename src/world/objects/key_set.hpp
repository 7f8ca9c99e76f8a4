// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <memory_resource>
#include <vector>

#include "world/objects/pair_lists.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// Where the search for a key begins among this many places, a power of two.
[[nodiscard]] inline std::size_t home_of(Key key, std::size_t places) noexcept
{
    key ^= key >> 29;
    key *= 0xbf58476d1ce4e5b9u;
    key ^= key >> 32;
    key *= 0x94d049bb133111ebu;
    key ^= key >> 29;
    return static_cast<std::size_t>(key) & (places - 1);
}

/// A set of pairs that keeps its memory: nothing is allocated while it holds no more than before.
class KeySet
{
  public:
    explicit KeySet(std::pmr::memory_resource* memory) : table_(memory) {}
    /// If it fails, the set is unchanged.
    KeySet& operator=(const KeySet& other)
    {
        table_ = other.table_;
        size_ = other.size_;
        return *this;
    }

    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    [[nodiscard]] bool contains(Key key) const noexcept
    {
        return size_ != 0 && table_[place_of(key)] != no_key;
    }
    /// Returns whether the key is new. If it isn't, this can't fail; if it fails, the set is unchanged.
    bool insert(Key key)
    {
        if (contains(key)) return false;
        reserve(1);
        table_[place_of(key)] = key;
        ++size_;
        return true;
    }
    /// Makes room for this many more.
    void reserve(std::size_t more)
    {
        while (2 * (size_ + more) > table_.size())
            grow();
    }
    void erase(Key key) noexcept
    {
        if (contains(key)) erase_at(place_of(key));
    }
    template <class Condition>
    void erase_if(const Condition& condition)
    {
        for (std::size_t place = 0; place < table_.size();)
            if (table_[place] != no_key && condition(table_[place]))
                erase_at(place); // another one may have moved here
            else
                ++place;
    }
    void clear() noexcept
    {
        for (Key& key : table_)
            key = no_key;
        size_ = 0;
    }
    /// In an unspecified order.
    template <class Body>
    void each(const Body& body) const
    {
        for (const Key key : table_)
            if (key != no_key) body(key);
    }

  private:
    static constexpr std::size_t least_places = 64;

    /// Where the key is, or would be.
    [[nodiscard]] std::size_t place_of(Key key) const noexcept
    {
        std::size_t place = home_of(key, table_.size());
        while (table_[place] != no_key && table_[place] != key)
            place = (place + 1) & (table_.size() - 1);
        return place;
    }
    /// The following keys move up, so that no search stops before it reaches them.
    void erase_at(std::size_t hole) noexcept
    {
        const std::size_t mask = table_.size() - 1;
        for (std::size_t next = (hole + 1) & mask; table_[next] != no_key; next = (next + 1) & mask) {
            const std::size_t home = home_of(table_[next], table_.size());
            if (((next - home) & mask) < ((next - hole) & mask)) continue; // already in its own place
            table_[hole] = table_[next];
            hole = next;
        }
        table_[hole] = no_key;
        --size_;
    }
    void grow()
    {
        const std::size_t places = table_.empty() ? least_places : 2 * table_.size();
        std::pmr::vector<Key> before(places, no_key, table_.get_allocator());
        table_.swap(before);
        for (const Key key : before)
            if (key != no_key) table_[place_of(key)] = key;
    }

    // Open addressing: each key at its place or after it; no_key for empty places. The size is a power of
    // two, at most half of it in use.
    std::pmr::vector<Key> table_;
    std::size_t size_ = 0;
};

} // namespace world
JOSTLE_NAMESPACE_END
