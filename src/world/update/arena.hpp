// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <new>
#include <vector>

#include "jostle/version.hpp"

#if defined(__SANITIZE_ADDRESS__)
#define JOSTLE_CHECKS_ADDRESSES
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define JOSTLE_CHECKS_ADDRESSES
#endif
#endif

JOSTLE_NAMESPACE_BEGIN
namespace world {

/// All memory of a world is allocated here, so that it can be counted. The first pieces are in a block that
/// is part of this object, one after another, and stay there: for a world of a few objects allocating each
/// would take longer than working with them.
class CountedMemory final : public std::pmr::memory_resource
{
  public:
#ifdef JOSTLE_CHECKS_ADDRESSES
    static constexpr std::size_t block_size = 1; // sanitizers check the ends of each allocation
#else
    static constexpr std::size_t block_size = 40960;
#endif
    explicit CountedMemory(std::pmr::memory_resource* source) noexcept : source_(source) {}
    /// Bytes allocated, without the block.
    [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_.load(std::memory_order_relaxed); }

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        const auto block = reinterpret_cast<std::uintptr_t>(block_);
        const std::size_t to = std::max(alignment, alignof(std::max_align_t));
        // Threads that queue commands allocate at the same time.
        for (std::size_t used = used_.load(std::memory_order_relaxed);;) {
            const std::size_t begin = ((block + used + to - 1) & ~(to - 1)) - block;
            if (begin > block_size || bytes > block_size - begin) break;
            if (used_.compare_exchange_weak(used, begin + bytes, std::memory_order_relaxed))
                return block_ + begin;
        }
        void* const memory = source_->allocate(bytes, alignment);
        bytes_.fetch_add(bytes, std::memory_order_relaxed);
        return memory;
    }
    void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override
    {
        const auto offset =
            reinterpret_cast<std::uintptr_t>(memory) - reinterpret_cast<std::uintptr_t>(block_);
        if (offset < block_size) return;
        source_->deallocate(memory, bytes, alignment);
        bytes_.fetch_sub(bytes, std::memory_order_relaxed);
    }
    [[nodiscard]] bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override
    {
        return this == &other;
    }

    std::pmr::memory_resource* source_;
    std::atomic<std::uint64_t> bytes_{0};
    std::atomic<std::size_t> used_{0}; // bytes of the block
    std::byte block_[block_size];
};

/// The temporary memory of updates: lists and buffers, each named for its contents. The stage that takes one
/// owns it until the next update begins, and no other stage may take it until then. Its memory stays for the
/// next time, so steady updates allocate nothing. Kept ones outlast calls between updates.
class Arena
{
  public:
    explicit Arena(std::pmr::memory_resource* memory)
        : memory_(memory), pieces_(memory), things_(4096, memory)
    {
    }
    Arena(const Arena&) = delete;
    Arena& operator=(const Arena&) = delete;
    ~Arena()
    {
        for (const Piece& piece : pieces_)
            piece.destroy(piece.thing);
    }

    /// Takes back all memory handed out so far.
    void begin() noexcept
    {
        for (Piece& piece : pieces_)
            piece.is_kept = false;
        begin_again();
    }
    /// What has been taken so far outlasts begin_again().
    void keep() noexcept
    {
        for (Piece& piece : pieces_)
            piece.is_kept = piece.is_taken;
    }
    /// Takes back all memory handed out since keep().
    void begin_again() noexcept
    {
        next_ = taken_ = 0;
        for (Piece& piece : pieces_) {
            piece.is_taken = piece.is_kept;
            taken_ += piece.is_taken;
        }
    }

    /// An empty list.
    template <class Value>
    [[nodiscard]] std::pmr::vector<Value>& list(const char* name)
    {
        auto& values = take<std::pmr::vector<Value>>(name);
        values.clear();
        return values;
    }
    /// Anything constructed from a memory resource, in the state in which it was left.
    template <class Thing>
    [[nodiscard]] Thing& take(const char* name)
    {
        Piece* piece = find(name);
        if (piece == nullptr) {
            assert(
                std::none_of(pieces_.begin(), pieces_.end(), [&](const Piece& p) { return p.name == name; }));
            // So that nothing can fail once the object exists.
            if (pieces_.size() == pieces_.capacity()) pieces_.reserve(pieces_.size() + 64);
            void* const place = things_.allocate(sizeof(Thing), alignof(Thing));
            pieces_.push_back({name, new (place) Thing(memory_), &destroy<Thing>, false, false});
            piece = &pieces_.back();
        }
        assert(!piece->is_taken && piece->destroy == &destroy<Thing>);
        piece->is_taken = true;
        ++taken_;
        return *static_cast<Thing*>(piece->thing);
    }

  private:
    struct Piece
    {
        const char* name;
        void* thing;
        void (*destroy)(void*);
        bool is_taken, is_kept;
    };
    template <class Thing>
    static void destroy(void* thing)
    {
        static_cast<Thing*>(thing)->~Thing();
    }
    /// Updates mostly take the same things in the same order, so the next one is tested first. Each name is a
    /// literal in one place in the code, and so identified by its address.
    Piece* find(const char* name) noexcept
    {
        if (taken_ == pieces_.size()) return nullptr; // in the first update each one is new
        for (std::size_t step = 0; step < pieces_.size(); ++step) {
            if (next_ >= pieces_.size()) next_ = 0;
            Piece& piece = pieces_[next_++];
            if (piece.name == name) return &piece;
        }
        return nullptr;
    }

    std::pmr::memory_resource* memory_;
    std::pmr::vector<Piece> pieces_;
    std::size_t next_ = 0, taken_ = 0;
    // Contiguous, since they are small, and for a small world allocating each would take longer than working
    // with them.
    std::pmr::monotonic_buffer_resource things_;
};

} // namespace world
JOSTLE_NAMESPACE_END
