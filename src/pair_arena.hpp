// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/pair_buffer.hpp"

JOSTLE_NAMESPACE_BEGIN

/// How the library's engines fill a PairBuffer: memory from `allocate`, blocks in order through `append`.
class PairBufferAccess
{
  public:
    explicit PairBufferAccess(PairBuffer& buffer) noexcept : buffer_(buffer) {}

    /// A run of memory for at least one pair, reused from before if `index` was allocated already and is big
    /// enough. Index is the caller's numbering of its chunks, from 0 up without gaps.
    std::span<Pair> chunk(std::size_t index, std::size_t capacity);
    /// Room for that many blocks more, and some to spare where it has to grow.
    void reserve_blocks(std::size_t count);
    void append(std::span<const Pair> pairs);

  private:
    PairBuffer& buffer_;
};

JOSTLE_NAMESPACE_END
