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

/// A pool of elements of one type, named by number, which never move. They are taken and given back in any
/// order; memory comes in chunks and is freed with the pool. Elements are constructed once, with their chunk,
/// and reused as they are. The first chunk is short, since indexes of a few boxes are made and destroyed
/// often, and preparing a full chunk would take longer than building the index.
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
        for (std::size_t chunk = chunks_.size(); chunk-- > 0;)
            push_numbers(chunk);
    }
    /// For pools with the same memory resource.
    void swap(Pool& other) noexcept
    {
        chunks_.swap(other.chunks_);
        free_.swap(other.free_);
    }
    /// Frees all memory.
    void release() noexcept
    {
        for (std::size_t chunk = 0; chunk < chunks_.size(); ++chunk)
            memory()->deallocate(chunks_[chunk], sizeof(X) * size_of(chunk), alignof(X));
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
    [[nodiscard]] std::uint64_t in_use() const noexcept { return capacity(chunks_.size()) - free_.size(); }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return capacity(chunks_.size()) * (sizeof(X) + sizeof(std::uint32_t));
    }

  private:
    static constexpr std::uint32_t per_chunk = 64;
    static constexpr std::uint32_t in_first_chunk = 4; // its other numbers are unused

    static constexpr std::uint32_t size_of(std::size_t chunk) noexcept
    {
        return chunk == 0 ? in_first_chunk : per_chunk;
    }
    static constexpr std::size_t capacity(std::size_t chunks) noexcept
    {
        return chunks == 0 ? 0 : in_first_chunk + (chunks - 1) * per_chunk;
    }
    std::pmr::memory_resource* memory() const noexcept { return chunks_.get_allocator().resource(); }
    void add_chunk()
    {
        const std::size_t chunk = chunks_.size();
        chunks_.reserve(chunk + 1);
        if (free_.capacity() < capacity(chunk + 1)) free_.reserve(2 * capacity(chunk + 1));
        X* const elements = static_cast<X*>(memory()->allocate(sizeof(X) * size_of(chunk), alignof(X)));
        for (std::uint32_t k = 0; k < size_of(chunk); ++k)
            new (elements + k) X; // not initialised before it is used, perhaps by another thread
        chunks_.push_back(elements);
        push_numbers(chunk);
    }
    /// The lowest on top, so that elements taken together are neighbours in memory.
    void push_numbers(std::size_t chunk)
    {
        const auto first = static_cast<std::uint32_t>(chunk * per_chunk);
        for (std::uint32_t k = size_of(chunk); k-- > 0;)
            free_.push_back(first + k);
    }

    std::pmr::vector<X*> chunks_;
    std::pmr::vector<std::uint32_t> free_;
};

} // namespace index
JOSTLE_NAMESPACE_END
