// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <cstring>
#include <memory_resource>
#include <vector>

#include "engine/buffer.hpp"
#include "engine/record.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Records on their way into bricks: per brick a list of chunks, filled in the order of appending. No
/// counting pass, no capacity: chunks come one after the other from big blocks of memory that are kept for
/// the next frame.
class BrickStore
{
  public:
    /// 512 bytes, aligned to 512: the address of the next free record tells by itself when a chunk is full.
    struct alignas(512) Chunk
    {
        static constexpr std::uint32_t capacity = 31;
        Chunk* next;
        std::uint32_t chunks_before;
        std::uint32_t unused;
        Record record[capacity];
    };
    static_assert(sizeof(Chunk) == 512);

    struct List
    {
        Record* free; // null while there is no chunk; on a multiple of 512 when the last one is full
        Chunk* first;

        [[nodiscard]] std::uint32_t size() const noexcept
        {
            if (free == nullptr) return 0;
            const auto offset = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(free) & 511);
            const Chunk* last = reinterpret_cast<const Chunk*>(reinterpret_cast<std::uintptr_t>(free - 1) &
                                                               ~std::uintptr_t{511});
            return last->chunks_before * Chunk::capacity + (offset == 0 ? Chunk::capacity : offset / 16 - 1);
        }
    };

    explicit BrickStore(std::pmr::memory_resource* memory) : blocks_(memory), lists_(memory), memory_(memory)
    {
    }

    void clear(std::uint32_t bricks)
    {
        lists_.reserve(bricks);
        std::memset(static_cast<void*>(lists_.data()), 0, bricks * sizeof(List));
        block_ = 0;
        next_ = end_ = nullptr;
    }

    void append(std::uint32_t brick, const Record& record)
    {
        List& list = lists_[brick];
        Record* to = list.free;
        if ((reinterpret_cast<std::uintptr_t>(to) & 511) == 0) to = open_chunk(list);
        *to = record;
        list.free = to + 1;
    }

    [[nodiscard]] const List& list(std::uint32_t brick) const noexcept { return lists_.data()[brick]; }
    [[nodiscard]] std::size_t bytes() const noexcept { return blocks_.size() * block_bytes + lists_.bytes(); }

  private:
    static constexpr std::size_t block_bytes = std::size_t{1} << 18;

    Record* open_chunk(List& list)
    {
        if (next_ == end_) open_block();
        Chunk* chunk = next_++;
        chunk->next = nullptr;
        chunk->chunks_before = 0;
        if (list.free == nullptr) {
            list.first = chunk;
        } else {
            Chunk* last = reinterpret_cast<Chunk*>(list.free) - 1;
            last->next = chunk;
            chunk->chunks_before = last->chunks_before + 1;
        }
        return chunk->record;
    }
    void open_block()
    {
        if (block_ == blocks_.size()) {
            blocks_.emplace_back(memory_);
            try {
                blocks_.back().reserve_exactly(block_bytes / sizeof(Chunk));
            } catch (...) {
                blocks_.pop_back();
                throw;
            }
        }
        next_ = blocks_[block_++].data();
        end_ = next_ + block_bytes / sizeof(Chunk);
    }

    std::pmr::vector<Buffer<Chunk>> blocks_;
    Buffer<List> lists_;
    std::pmr::memory_resource* memory_;
    std::size_t block_ = 0;
    Chunk* next_ = nullptr;
    Chunk* end_ = nullptr;
};

} // namespace engine
JOSTLE_NAMESPACE_END
