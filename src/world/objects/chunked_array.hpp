// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <type_traits>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// An array that grows in chunks, which never move: growing copies nothing, so no update pays for all objects
/// because one was added.
template <class T, std::uint32_t chunk_bits>
class ChunkedArray
{
    static_assert(std::is_trivially_destructible_v<T>);
    static constexpr std::uint32_t chunk_size = 1u << chunk_bits;

  public:
    explicit ChunkedArray(std::pmr::memory_resource* memory) : memory_(memory), chunks_(memory) {}
    ChunkedArray(const ChunkedArray&) = delete;
    ChunkedArray& operator=(const ChunkedArray&) = delete;
    ~ChunkedArray()
    {
        for (T* chunk : chunks_)
            memory_->deallocate(chunk, chunk_size * sizeof(T), alignof(T));
    }

    /// Makes room for at least `count` elements; new ones are default-initialised.
    void grow(std::size_t count)
    {
        while (chunks_.size() * chunk_size < count) {
            chunks_.push_back(nullptr); // so that nothing can fail once the chunk exists
            try {
                chunks_.back() = static_cast<T*>(memory_->allocate(chunk_size * sizeof(T), alignof(T)));
            } catch (...) {
                chunks_.pop_back();
                throw;
            }
            for (std::uint32_t i = 0; i < chunk_size; ++i)
                new (chunks_.back() + i) T;
        }
    }
    [[nodiscard]] std::size_t capacity() const noexcept { return chunks_.size() * chunk_size; }
    [[nodiscard]] T& operator[](std::uint32_t i) noexcept
    {
        return chunks_[i >> chunk_bits][i & (chunk_size - 1)];
    }
    [[nodiscard]] const T& operator[](std::uint32_t i) const noexcept
    {
        return chunks_[i >> chunk_bits][i & (chunk_size - 1)];
    }

  private:
    std::pmr::memory_resource* memory_;
    std::pmr::vector<T*> chunks_;
};

} // namespace world
JOSTLE_NAMESPACE_END
