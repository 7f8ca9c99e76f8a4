// SPDX-License-Identifier: MIT
#pragma once

#include <cassert>
#include <cstddef>
#include <span>

#include "jostle/block_buffer.hpp"
#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN

/// How the library fills a BlockBuffer: memory from `chunk`, blocks in order through `append`.
template <class Item>
class BlockBufferAccess
{
  public:
    explicit BlockBufferAccess(BlockBuffer<Item>& buffer) noexcept : buffer_(buffer) {}

    /// Memory for at least `capacity` items, reused from before if there is enough; what was in it is lost
    /// if not. Index is the caller's numbering of its chunks, from 0 up without gaps. Several threads may
    /// ask for different chunks at a time if `reserve_chunks` has made them.
    std::span<Item> chunk(std::size_t index, std::size_t capacity)
    {
        reserve_chunks(index + 1);
        auto& chunk = buffer_.chunks_[index];
        if (chunk.capacity < capacity) {
            detail::MovingAllocator<Item> memory(buffer_.chunks_.get_allocator());
            Item* const grown = memory.allocate(capacity);
            if (chunk.capacity != 0) memory.deallocate(chunk.items, chunk.capacity);
            chunk = {grown, capacity};
        }
        return {chunk.items, chunk.capacity};
    }
    /// Chunks of no size at first.
    void reserve_chunks(std::size_t count)
    {
        if (buffer_.chunks_.size() < count) buffer_.chunks_.resize(count);
    }
    [[nodiscard]] std::size_t capacity(std::size_t index) const noexcept
    {
        return buffer_.chunks_[index].capacity;
    }
    /// Room for that many blocks more, and some to spare where it has to grow.
    void reserve_blocks(std::size_t count)
    {
        const std::size_t wanted = buffer_.blocks_.size() + count;
        if (wanted > buffer_.blocks_.capacity()) buffer_.blocks_.reserve(wanted + wanted / 4);
    }
    void append(std::span<const Item> items)
    {
        if (items.empty()) return;
        buffer_.blocks_.push_back(items);
        buffer_.size_ += items.size();
    }

  private:
    BlockBuffer<Item>& buffer_;
};

using PairBufferAccess = BlockBufferAccess<Pair>;

JOSTLE_NAMESPACE_END
