// SPDX-License-Identifier: MIT
#include "jostle/pair_buffer.hpp"

#include <algorithm>
#include <cassert>
#include <new>
#include <string>
#include <utility>

#include "jostle/error.hpp"
#include "pair_arena.hpp"

JOSTLE_NAMESPACE_BEGIN

PairBuffer::PairBuffer(std::pmr::memory_resource* memory) : memory_(memory), blocks_(memory), chunks_(memory)
{
}

PairBuffer::PairBuffer(PairBuffer&& other) noexcept
    : memory_(other.memory_),
      blocks_(std::move(other.blocks_)),
      chunks_(std::move(other.chunks_)),
      size_(std::exchange(other.size_, 0)),
      bytes_reserved_(std::exchange(other.bytes_reserved_, 0))
{
    other.blocks_.clear();
    other.chunks_.clear();
}

PairBuffer& PairBuffer::operator=(PairBuffer&& other) noexcept
{
    if (this != &other) {
        this->~PairBuffer(); // pmr containers don't take over a memory resource by assignment
        new (this) PairBuffer(std::move(other));
    }
    return *this;
}

PairBuffer::~PairBuffer()
{
    release();
}

std::vector<Pair> PairBuffer::to_vector() const
{
    std::vector<Pair> all(size_);
    copy_to(all);
    return all;
}

void PairBuffer::copy_to(std::span<Pair> out) const
{
    if (out.size() < size_)
        throw Error(ErrorCode::size_mismatch, "room for " + std::to_string(out.size()) +
                                                  " pairs, but there are " + std::to_string(size_));
    auto next = out.begin();
    for (const std::span<const Pair> block : blocks_)
        next = std::copy(block.begin(), block.end(), next);
}

void PairBuffer::clear() noexcept
{
    blocks_.clear();
    size_ = 0;
}

void PairBuffer::release() noexcept
{
    clear();
    for (const Chunk& chunk : chunks_)
        if (chunk.pairs != nullptr)
            memory_->deallocate(chunk.pairs, chunk.capacity * sizeof(Pair), alignof(Pair));
    chunks_.clear();
    bytes_reserved_ = 0;
}

std::uint64_t pair_checksum(std::span<const Pair> pairs) noexcept
{
    std::uint64_t sum = 0;
    for (const Pair& pair : pairs) {
        // splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators (2014), fig. 16.
        std::uint64_t z = ((std::uint64_t{pair.a} << 32) | pair.b) + 0x9e3779b97f4a7c15u;
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        sum += z ^ (z >> 31);
    }
    return sum;
}

std::uint64_t pair_checksum(const PairBuffer& pairs) noexcept
{
    std::uint64_t sum = 0;
    for (const std::span<const Pair> block : pairs.blocks())
        sum += pair_checksum(block);
    return sum;
}

std::span<Pair> PairBufferAccess::chunk(std::size_t index, std::size_t capacity)
{
    std::pmr::memory_resource& memory = *buffer_.memory_;
    assert(index <= buffer_.chunks_.size());
    if (index == buffer_.chunks_.size()) buffer_.chunks_.push_back({nullptr, 0});
    PairBuffer::Chunk& chunk = buffer_.chunks_[index];
    if (chunk.capacity < capacity) {
        auto* grown = static_cast<Pair*>(memory.allocate(capacity * sizeof(Pair), alignof(Pair)));
        if (chunk.pairs != nullptr)
            memory.deallocate(chunk.pairs, chunk.capacity * sizeof(Pair), alignof(Pair));
        buffer_.bytes_reserved_ += (capacity - chunk.capacity) * sizeof(Pair);
        chunk = {grown, capacity};
    }
    return {chunk.pairs, chunk.capacity};
}

void PairBufferAccess::reserve_blocks(std::size_t count)
{
    const std::size_t wanted = buffer_.blocks_.size() + count;
    if (wanted > buffer_.blocks_.capacity()) buffer_.blocks_.reserve(wanted + wanted / 4);
}

void PairBufferAccess::append(std::span<const Pair> pairs)
{
    if (pairs.empty()) return;
    buffer_.blocks_.push_back(pairs);
    buffer_.size_ += pairs.size();
}

JOSTLE_NAMESPACE_END
