// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>

#include "base/block_buffer_access.hpp"
#include "engine/engine.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/record.hpp"
#include "engine/slot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Shared by the tasks of a search.
template <int Dim, class T>
struct Shared
{
    const Boxes<Dim, T>& boxes;
    const Request& request;
    ResultChunks& chunks;
    std::atomic<bool> stopped{false};

    [[nodiscard]] bool is_stopped() const noexcept { return stopped.load(std::memory_order_relaxed); }
};

/// The output of a task for one block: to memory of the result, in segments, or to the sink.
template <int Dim, class T>
class Output : public PairOutput
{
  public:
    Output(Shared<Dim, T>& shared, Slot& slot, std::uint64_t block)
        : block_(block), shared_(shared), slot_(slot)
    {
        ties = slot.ties.reserve_exactly(tie_capacity);
        tie_count = 0;
        make_room = [](PairOutput& self) { return static_cast<Output&>(self).make_room_here(); };
        if (shared.request.sink) {
            next = first_ = slot.to_sink.reserve_exactly(chunk_pairs);
            end = first_ + chunk_pairs;
        } else {
            next = first_ = slot.chunk_next;
            end = slot.chunk_end;
        }
    }

    [[nodiscard]] std::uint64_t block() const noexcept { return block_; }

    /// Decides ties by the user's coordinates. Called when a brick is done or ties overflow, never because a
    /// chunk is full: where chunks end depends on the slot's earlier work, and the order of pairs must not.
    void resolve_ties()
    {
        slot_.counts.ties += tie_count;
        for (std::uint32_t k = 0; k < tie_count; ++k) {
            const Pair later = ties[std::min(k + 8, tie_count - 1)];
            shared_.boxes.prefetch(later.a);
            shared_.boxes.prefetch(later.b);
            const Pair tie = ties[k];
            if (!overlaps(shared_.boxes[tie.a], shared_.boxes[tie.b])) continue;
            if (next == end) hand_over();
            *next++ = {std::min(tie.a, tie.b) & index_mask, std::max(tie.a, tie.b) & index_mask};
        }
        tie_count = 0;
    }

    /// The block is done.
    void close()
    {
        resolve_ties();
        flush();
        if (!shared_.request.sink) {
            slot_.chunk_next = next;
            slot_.chunk_end = end;
        }
    }

  private:
    bool make_room_here()
    {
        if (tie_count > tie_capacity - sweep_room) resolve_ties();
        if (static_cast<std::size_t>(end - next) < sweep_room) hand_over();
        return !shared_.is_stopped();
    }

    /// Passes on what was written and gets a new chunk.
    void hand_over()
    {
        flush();
        if (shared_.request.sink) {
            next = first_ = slot_.to_sink.data();
        } else {
            const std::span<Pair> chunk = shared_.chunks.next(*shared_.request.result);
            next = first_ = chunk.data();
            end = first_ + chunk.size();
        }
    }

    /// Passes on what was written.
    void flush()
    {
        const Request& request = shared_.request;
        if (next == first_) return;
        if (request.offset_a != 0 || request.offset_b != 0)
            for (Pair* pair = first_; pair != next; ++pair)
                *pair = {pair->a + request.offset_a, pair->b + request.offset_b};
        if (request.select) next = request.select(first_, next);
        if (next == first_) return;
        const std::span<const Pair> pairs(first_, next);
        if (!request.sink) {
            slot_.segments.push_back(pairs);
        } else if (!shared_.is_stopped()) {
            if (!request.sink({pairs, request.first_block + block_, part_++})) shared_.stopped = true;
            next = first_;
        }
        first_ = next;
    }

    const std::uint64_t block_;
    std::uint64_t part_ = 0;
    Pair* first_ = nullptr; // of the segment being written
    Shared<Dim, T>& shared_;
    Slot& slot_;
};

} // namespace engine
JOSTLE_NAMESPACE_END
