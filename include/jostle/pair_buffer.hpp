// SPDX-License-Identifier: MIT
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory_resource>
#include <span>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Two touching objects, by their positions in the input. Within one set a < b; between two sets a belongs
/// to the first and b to the second.
struct Pair
{
    std::uint32_t a;
    std::uint32_t b;
    friend constexpr bool operator==(const Pair&, const Pair&) = default;
    friend constexpr auto operator<=>(const Pair&, const Pair&) = default;
};

/// Goes through blocks, none of them empty, as if they were one array.
template <class Item>
class BlockIterator
{
  public:
    using value_type = Item;
    using difference_type = std::ptrdiff_t;
    using reference = const Item&;
    using pointer = const Item*;
    using iterator_category = std::forward_iterator_tag;

    BlockIterator() = default;
    BlockIterator(const std::span<const Item>* block, const std::span<const Item>* last) noexcept
        : block_(block), last_(last)
    {
        if (block_ != last_) item_ = block_->data();
    }
    reference operator*() const noexcept { return *item_; }
    pointer operator->() const noexcept { return item_; }
    BlockIterator& operator++() noexcept
    {
        if (++item_ == block_->data() + block_->size()) {
            ++block_;
            item_ = block_ == last_ ? nullptr : block_->data();
        }
        return *this;
    }
    BlockIterator operator++(int) noexcept
    {
        BlockIterator before = *this;
        ++*this;
        return before;
    }
    friend bool operator==(const BlockIterator& x, const BlockIterator& y) noexcept
    {
        return x.block_ == y.block_ && x.item_ == y.item_;
    }

  private:
    const std::span<const Item>* block_ = nullptr;
    const std::span<const Item>* last_ = nullptr;
    const Item* item_ = nullptr;
};

/// All pairs of one call, as blocks of contiguous memory.
///
/// One contiguous array would cost a copy of everything; blocks are where the workers wrote them. Iterate
/// over the blocks in the hot path, over the buffer itself where convenience matters more.
///
/// Order     blocks, and pairs inside them, come in the order that the filling call documents.
/// Lifetime  blocks and iterators stay valid until the buffer is filled again, cleared, moved or destroyed.
///           Refilling reuses the memory: no allocation once it has grown to the size of the scene.
/// Threads   const members from any number of threads.
class JOSTLE_API PairBuffer
{
  public:
    using Iterator = BlockIterator<Pair>;

    explicit PairBuffer(std::pmr::memory_resource* memory = std::pmr::get_default_resource());
    PairBuffer(PairBuffer&& other) noexcept;
    PairBuffer& operator=(PairBuffer&& other) noexcept;
    PairBuffer(const PairBuffer&) = delete;
    PairBuffer& operator=(const PairBuffer&) = delete;
    ~PairBuffer();

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    /// The pairs, in order; no block is empty.
    [[nodiscard]] std::span<const std::span<const Pair>> blocks() const noexcept { return blocks_; }

    [[nodiscard]] Iterator begin() const noexcept
    {
        return {blocks_.data(), blocks_.data() + blocks_.size()};
    }
    [[nodiscard]] Iterator end() const noexcept
    {
        return {blocks_.data() + blocks_.size(), blocks_.data() + blocks_.size()};
    }

    /// One array, in the buffer's order. `copy_to` wants room for size() pairs, or throws.
    [[nodiscard]] std::vector<Pair> to_vector() const;
    void copy_to(std::span<Pair> out) const;

    /// Forgets the pairs, keeps the memory.
    void clear() noexcept;
    /// Forgets the pairs and gives the memory back.
    void release() noexcept;
    [[nodiscard]] std::uint64_t bytes_reserved() const noexcept { return bytes_reserved_; }

  private:
    friend class PairBufferAccess; // the library's engines fill it; see src/pair_arena.hpp

    struct Chunk
    {
        Pair* pairs;
        std::size_t capacity;
    };
    std::pmr::memory_resource* memory_;
    std::pmr::vector<std::span<const Pair>> blocks_;
    std::pmr::vector<Chunk> chunks_;
    std::uint64_t size_ = 0;
    std::uint64_t bytes_reserved_ = 0;
};

/// Pairs to be read where they lie: a PairBuffer, or an array, vector or span.
class PairView
{
  public:
    PairView(const PairBuffer& pairs) noexcept : blocks_(pairs.blocks()), size_(pairs.size()) {}
    template <class Container>
        requires std::convertible_to<const Container&, std::span<const Pair>>
    PairView(const Container& pairs) noexcept : array_(pairs), size_(array_.size())
    {
    }
    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    [[nodiscard]] std::span<const std::span<const Pair>> blocks() const noexcept
    {
        return array_.empty() ? blocks_ : std::span(&array_, 1);
    }

  private:
    std::span<const Pair> array_;
    std::span<const std::span<const Pair>> blocks_;
    std::uint64_t size_;
};

/// An order-independent fingerprint of a set of pairs: the sum modulo 2^64 over its pairs of the splitmix64
/// finaliser of (a << 32 | b). Two systems that agree on count and checksum found the same pairs. For the sum
/// over parts, add the parts' checksums.
[[nodiscard]] JOSTLE_API std::uint64_t pair_checksum(std::span<const Pair> pairs) noexcept;
[[nodiscard]] JOSTLE_API std::uint64_t pair_checksum(const PairBuffer& pairs) noexcept;

JOSTLE_NAMESPACE_END
