// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory_resource>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

template <class Item>
class BlockBufferAccess;

namespace detail {

/// An allocator that moves and swaps with its container, so that neither can fail or copy, as
/// std::pmr::polymorphic_allocator would.
template <class Item>
struct MovingAllocator
{
    using value_type = Item;
    using propagate_on_container_move_assignment = std::true_type;
    using propagate_on_container_swap = std::true_type;

    std::pmr::memory_resource* memory;

    MovingAllocator(std::pmr::memory_resource* given) noexcept : memory(given) {}
    template <class Other>
    MovingAllocator(const MovingAllocator<Other>& other) noexcept : memory(other.memory)
    {
    }
    [[nodiscard]] Item* allocate(std::size_t count)
    {
        return static_cast<Item*>(memory->allocate(count * sizeof(Item), alignof(Item)));
    }
    void deallocate(Item* items, std::size_t count) noexcept
    {
        memory->deallocate(items, count * sizeof(Item), alignof(Item));
    }
    friend bool operator==(const MovingAllocator& a, const MovingAllocator& b) noexcept
    {
        return *a.memory == *b.memory;
    }
};

/// The `Error` for an array that is too short for a buffer's items.
[[noreturn]] JOSTLE_API void throw_no_room(std::uint64_t room, std::uint64_t size);
/// The `Error` for a number beyond the last item.
[[noreturn]] JOSTLE_API void throw_no_item(std::uint64_t number, std::uint64_t size);

/// Iterates over blocks, none of them empty, as if they were one array.
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

} // namespace detail

/// All results of one call, as blocks of contiguous memory: a `PairBuffer` or a `ContactBuffer`.
///
///     const jostle::PairBuffer& pairs = finder.find(boxes);
///     for (jostle::Pair pair : pairs) ...                        // one by one
///     for (std::span<const jostle::Pair> block : pairs.blocks()) // faster: arrays, a loop each
///         for (jostle::Pair pair : block) ...
///     std::vector<jostle::Pair> copy = pairs.to_vector();
///
/// Blocks stay where the threads wrote them; one contiguous array would cost a copy of everything. Iterate
/// over the blocks in the hot path, and over the buffer itself where convenience matters more.
///
/// Order     blocks, and items inside them, come in the order that the filling call documents.
/// Lifetime  blocks and iterators stay valid until the buffer is filled again, cleared, moved or destroyed.
///           Refilling reuses the memory: no allocation once it has grown to the size of the scene.
/// Threads   const members from any number of threads.
template <class Item>
class BlockBuffer
{
    static_assert(std::is_trivially_destructible_v<Item>);

  public:
    using value_type = Item;
    using Iterator = detail::BlockIterator<Item>;

    explicit BlockBuffer(std::pmr::memory_resource* memory = std::pmr::get_default_resource())
        : blocks_(memory), chunks_(memory)
    {
    }
    BlockBuffer(BlockBuffer&& other) noexcept
        : blocks_(std::move(other.blocks_)),
          chunks_(std::move(other.chunks_)),
          size_(std::exchange(other.size_, 0))
    {
    }
    /// Takes over the other buffer's memory and its memory resource, and frees its own memory.
    BlockBuffer& operator=(BlockBuffer&& other) noexcept
    {
        BlockBuffer taken(std::move(other));
        blocks_.swap(taken.blocks_);
        chunks_.swap(taken.chunks_);
        std::swap(size_, taken.size_);
        return *this;
    }
    BlockBuffer(const BlockBuffer&) = delete;
    BlockBuffer& operator=(const BlockBuffer&) = delete;
    ~BlockBuffer() { release(); }

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; }
    [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
    /// The items, in order; no block is empty.
    [[nodiscard]] std::span<const std::span<const Item>> blocks() const noexcept { return blocks_; }

    /// Returns item `number` in the buffer's order. It walks through the blocks, so don't call it in a loop.
    /// Errors    `Error` if there are fewer items.
    [[nodiscard]] const Item& at(std::uint64_t number) const
    {
        std::uint64_t left = number;
        for (const std::span<const Item> block : blocks_) {
            if (left < block.size()) return block[static_cast<std::size_t>(left)];
            left -= block.size();
        }
        detail::throw_no_item(number, size_);
    }

    [[nodiscard]] Iterator begin() const noexcept
    {
        return {blocks_.data(), blocks_.data() + blocks_.size()};
    }
    [[nodiscard]] Iterator end() const noexcept
    {
        return {blocks_.data() + blocks_.size(), blocks_.data() + blocks_.size()};
    }

    /// Copies the items to one array, in the buffer's order. `copy_to` throws if `out` has no room for size()
    /// items.
    [[nodiscard]] std::vector<Item> to_vector() const
    {
        std::vector<Item> all;
        all.reserve(size_);
        for (const std::span<const Item> block : blocks_)
            all.insert(all.end(), block.begin(), block.end());
        return all;
    }
    void copy_to(std::span<Item> out) const
    {
        if (out.size() < size_) detail::throw_no_room(out.size(), size_);
        auto next = out.begin();
        for (const std::span<const Item> block : blocks_)
            next = std::copy(block.begin(), block.end(), next);
    }

    /// Removes the items and keeps the memory.
    void clear() noexcept
    {
        blocks_.clear();
        size_ = 0;
    }
    /// Removes the items and frees the memory.
    void release() noexcept
    {
        clear();
        detail::MovingAllocator<Item> memory(chunks_.get_allocator());
        for (const Chunk& chunk : chunks_)
            if (chunk.capacity != 0) memory.deallocate(chunk.items, chunk.capacity);
        chunks_.clear();
    }
    [[nodiscard]] std::uint64_t bytes_reserved() const noexcept
    {
        std::uint64_t bytes = 0;
        for (const Chunk& chunk : chunks_)
            bytes += chunk.capacity * sizeof(Item);
        return bytes;
    }

  private:
    friend class BlockBufferAccess<Item>; // the library fills it; see src/base/block_buffer_access.hpp

    template <class Element>
    using Array = std::vector<Element, detail::MovingAllocator<Element>>;
    struct Chunk
    {
        Item* items = nullptr;
        std::size_t capacity = 0;
    };
    Array<std::span<const Item>> blocks_;
    Array<Chunk> chunks_;
    std::uint64_t size_ = 0;
};

JOSTLE_NAMESPACE_END
