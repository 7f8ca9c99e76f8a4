// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "engine/record.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Stores records by bricks: a list of chunks per brick, filled in the order of appending. It needs no
/// counting pass and has no capacity: chunks are cut one after another from slabs of memory, which are kept
/// for the next frame.
///
///     free_     one pointer per brick, to where its next record goes
///     slabs_    |chunk|chunk|chunk|chunk|...    in the order in which bricks asked for them
///     order_    the same chunks brick by brick, made by close()
class BrickStore
{
  public:
    /// Aligned to its size, so that the address of the next free record tells when a chunk is full.
    struct alignas(512) Chunk
    {
        static constexpr std::uint32_t capacity = 32;
        Record record[capacity];
    };
    static_assert(sizeof(Chunk) == 512);

    explicit BrickStore(std::pmr::memory_resource* memory)
        : slabs_(memory), free_(memory), brick_of_(memory), first_(memory), order_(memory), memory_(memory)
    {
    }

    void clear(std::uint32_t bricks)
    {
        bricks_ = bricks;
        std::fill_n(free_.reserve(bricks), bricks, nullptr);
        chunks_ = room_ = 0;
        next_ = nullptr;
    }

    void prefetch(std::uint32_t brick) const { prefetch_to_write(free_.data()[brick]); }

    void append(std::uint32_t brick, const Record& record)
    {
        Record* to = free_.data()[brick];
        if ((reinterpret_cast<std::uintptr_t>(to) & (sizeof(Chunk) - 1)) == 0) to = open_chunk(brick);
        *to = record;
        free_.data()[brick] = to + 1;
    }

    /// Must be called after the last append. Lists each brick's chunks, so that a reader knows all their
    /// addresses at once and needn't load one to find the next.
    void close()
    {
        std::uint32_t* first = first_.reserve(std::size_t{bricks_} + 1);
        std::fill_n(first, bricks_ + 1, 0u);
        for (std::uint32_t c = 0; c < chunks_; ++c)
            ++first[brick_of_[c]];
        std::uint32_t sum = 0;
        for (std::uint32_t b = 0; b <= bricks_; ++b) {
            const std::uint32_t count = first[b];
            first[b] = sum += count;
        }
        Chunk** order = order_.reserve(chunks_ + 1);
        for (std::uint32_t c = chunks_; c-- > 0;)
            order[--first[brick_of_[c]]] = slabs_[c / chunks_per_slab].data() + c % chunks_per_slab;
    }

    /// Reserves as much memory as `other` has, so that it could hold the same.
    void match(const BrickStore& other)
    {
        while (slabs_.size() < other.slabs_.size())
            add_slab();
        free_.reserve_exactly(other.free_.capacity());
        brick_of_.reserve_exactly(other.brick_of_.capacity());
        first_.reserve_exactly(other.first_.capacity());
        order_.reserve_exactly(other.order_.capacity());
    }

    [[nodiscard]] std::uint32_t chunks(std::uint32_t brick) const noexcept
    {
        return first_.data()[brick + 1] - first_.data()[brick];
    }
    [[nodiscard]] const Chunk* chunk(std::uint32_t brick, std::uint32_t k) const noexcept
    {
        return order_.data()[first_.data()[brick] + k];
    }
    /// The records of a brick. All its chunks except the last are full.
    [[nodiscard]] std::uint32_t size(std::uint32_t brick) const noexcept
    {
        const std::uint32_t count = chunks(brick);
        if (count == 0) return 0;
        return (count - 1) * Chunk::capacity +
               static_cast<std::uint32_t>(free_.data()[brick] - chunk(brick, count - 1)->record);
    }
    [[nodiscard]] std::size_t bytes() const noexcept
    {
        return slabs_.size() * sizeof(Chunk) * chunks_per_slab + free_.bytes() + brick_of_.bytes() +
               first_.bytes() + order_.bytes();
    }

  private:
    static constexpr std::uint32_t chunks_per_slab = 512;

    Record* open_chunk(std::uint32_t brick)
    {
        if (chunks_ == room_) open_slab();
        brick_of_[chunks_++] = brick;
        Chunk* chunk = next_++;
        // It is filled bit by bit between writes to thousands of others, so prefetch its cache lines.
        for (std::size_t offset = 0; offset < sizeof(Chunk); offset += cache_line)
            prefetch_to_write(reinterpret_cast<char*>(chunk) + offset);
        return chunk->record;
    }
    void add_slab()
    {
        Buffer<Chunk> memory(memory_);
        memory.reserve_exactly(chunks_per_slab);
        slabs_.push_back(std::move(memory));
    }
    void open_slab()
    {
        const std::size_t slab = chunks_ / chunks_per_slab;
        if (slab == slabs_.size()) add_slab();
        brick_of_.grow(chunks_ + chunks_per_slab, chunks_);
        next_ = slabs_[slab].data();
        room_ = chunks_ + chunks_per_slab;
    }

    std::pmr::vector<Buffer<Chunk>> slabs_;
    Buffer<Record*> free_;           // per brick; at a multiple of the chunk's size if there is no room
    Buffer<std::uint32_t> brick_of_; // of each chunk
    Buffer<std::uint32_t> first_;    // per brick, in `order_`
    Buffer<Chunk*> order_;           // the chunks, brick by brick
    std::pmr::memory_resource* memory_;
    std::uint32_t bricks_ = 0;
    std::uint32_t chunks_ = 0;
    std::uint32_t room_ = 0;
    Chunk* next_ = nullptr;
};

} // namespace engine
JOSTLE_NAMESPACE_END
