// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Many things of one kind, by number, that never change their place. Taken and given back in any order;
/// memory comes in chunks and goes with the pool. Elements are made once, when their chunk is, and reused as
/// they are.
template <class X>
class Pool
{
  public:
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    explicit Pool(std::pmr::memory_resource* memory) : chunks_(memory), free_(memory) {}
    Pool(const Pool&) = delete;
    Pool& operator=(const Pool&) = delete;
    ~Pool() { release(); }

    /// After this, `count` can be taken without failing.
    void reserve(std::size_t count)
    {
        while (free_.size() < count)
            add_chunk();
    }
    [[nodiscard]] std::uint32_t take() noexcept
    {
        const std::uint32_t number = free_.back();
        free_.pop_back();
        return number;
    }
    void give(std::uint32_t number) noexcept { free_.push_back(number); } // has room for all
    /// Takes all back.
    void clear() noexcept
    {
        free_.clear();
        for (auto number = static_cast<std::uint32_t>(chunks_.size() * per_chunk); number-- > 0;)
            free_.push_back(number);
    }
    /// For pools with the same memory resource.
    void swap(Pool& other) noexcept
    {
        chunks_.swap(other.chunks_);
        free_.swap(other.free_);
    }
    /// Gives the memory back, of all.
    void release() noexcept
    {
        for (X* chunk : chunks_)
            memory()->deallocate(chunk, sizeof(X) * per_chunk, alignof(X));
        chunks_.clear();
        chunks_.shrink_to_fit();
        free_.clear();
        free_.shrink_to_fit();
    }
    [[nodiscard]] X& operator[](std::uint32_t number) noexcept
    {
        return chunks_[number / per_chunk][number % per_chunk];
    }
    [[nodiscard]] const X& operator[](std::uint32_t number) const noexcept
    {
        return chunks_[number / per_chunk][number % per_chunk];
    }
    [[nodiscard]] std::uint64_t in_use() const noexcept { return chunks_.size() * per_chunk - free_.size(); }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return chunks_.size() * per_chunk * (sizeof(X) + sizeof(std::uint32_t));
    }

  private:
    static constexpr std::uint32_t per_chunk = 64;

    std::pmr::memory_resource* memory() const noexcept { return chunks_.get_allocator().resource(); }
    void add_chunk()
    {
        const std::size_t chunk = chunks_.size();
        chunks_.reserve(chunk + 1);
        if (free_.capacity() < (chunk + 1) * per_chunk) free_.reserve(2 * (chunk + 1) * per_chunk);
        X* const elements = static_cast<X*>(memory()->allocate(sizeof(X) * per_chunk, alignof(X)));
        for (std::uint32_t k = 0; k < per_chunk; ++k)
            new (elements + k) X; // not touched before it is used, perhaps by another thread
        chunks_.push_back(elements);
        // The lowest on top, so that neighbours in time are neighbours in memory.
        const auto first = static_cast<std::uint32_t>(chunk * per_chunk);
        for (std::uint32_t k = per_chunk; k-- > 0;)
            free_.push_back(first + k);
    }

    std::pmr::vector<X*> chunks_;
    std::pmr::vector<std::uint32_t> free_;
};

} // namespace index
JOSTLE_NAMESPACE_END
