// SPDX-License-Identifier: MIT
// Rows of a neighbour list: found in blocks, each by one task, then written one behind the other.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

#include "base/buffer.hpp"
#include "base/exact_floats.hpp"
#include "base/radix.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/process.hpp"
#include "neighbors/candidates.hpp"
#include "neighbors/kernels/neighbors.hpp"
#include "neighbors/request.hpp"
#include "neighbors/shifts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {

/// What a block of rows has found, row after row.
struct BlockFound
{
    explicit BlockFound(std::pmr::memory_resource* memory) : index(memory), image(memory) {}
    Buffer<std::uint32_t> index, image;
    std::size_t count = 0;
};

inline bool needs_shifts(const NeighborOptions& what)
{
    return what.shifts || what.vectors || what.distances;
}

/// A list in memory of its own.
template <int Dim, Coordinate T>
struct StoredNeighbors
{
    explicit StoredNeighbors(std::pmr::memory_resource* memory)
        : offsets(memory), neighbors(memory), shifts(memory), vectors(memory), distances(memory)
    {
    }

    Buffer<std::uint64_t> offsets;
    Buffer<std::uint32_t> neighbors;
    Buffer<Periods<Dim>> shifts;
    Buffer<Vec<Dim, T>> vectors;
    Buffer<T> distances;

    /// Makes room for n rows with these numbers of neighbours.
    void allot(const std::uint64_t* counts, std::size_t n, const NeighborOptions& what)
    {
        std::uint64_t* const begins = offsets.reserve(n + 1);
        begins[n] = exclusive_sum(std::copy_n(counts, n, begins) - n, n);
        const std::uint64_t total = begins[n];
        neighbors.reserve(total + neighbor_padding);
        if (needs_shifts(what)) shifts.reserve(total);
        if (what.vectors) vectors.reserve(total);
        if (what.distances) distances.reserve(total + neighbor_padding);
    }

    /// By the definition, from a point to what stands at `at`.
    Vec<Dim, T> vector(const Request<Dim, T>& request, std::size_t point, std::size_t at)
    {
        return request.vectors.between(request.a.points[point], request.b.points[neighbors[at]], shifts[at]);
    }
    /// Writes the distances of a point's neighbours, of which all else is there.
    void measure(const Request<Dim, T>& request, const NeighborOptions& what, std::size_t point,
                 std::size_t first, std::size_t count)
    {
        if (!what.distances) return;
        for (std::size_t at = first; at < first + count; ++at)
            distances[at] = length(what.vectors ? vectors[at] : vector(request, point, at));
    }

    void release()
    {
        offsets.release(), neighbors.release(), shifts.release(), vectors.release(), distances.release();
    }
};

/// Rows shared out among tasks, in blocks.
template <int Dim, Coordinate T>
class RowTasks
{
  public:
    /// A task's working memory.
    struct Scratch
    {
        explicit Scratch(std::pmr::memory_resource* memory)
            : candidates(memory), chosen(memory), unsure(memory)
        {
        }
        Candidates<Dim, T> candidates;
        Buffer<std::uint32_t> chosen, unsure; ///< of a kept row: a bit for each neighbour, and places
    };

    explicit RowTasks(const FinderOptions& options)
        : blocks(options.memory),
          counts(options.memory),
          executor_(options.executor),
          memory_(options.memory),
          scratch_(options.memory)
    {
    }

    std::pmr::vector<BlockFound> blocks;
    Buffer<std::uint64_t> counts;                ///< of neighbours, in each row
    std::size_t most_runs = 0, longest_kept = 0; ///< what each Scratch has room for

    /// Calls body(scratch, block, begin, end) for each block of n rows. Up to three are done by the calling
    /// thread.
    template <class Body>
    void each_block(std::size_t n, const Body& body)
    {
        const bool few = n <= 3 * rows_per_block;
        const ProcessOptions by{few ? &serial_executor() : executor_, rows_per_block};
        const WorkPlan plan = plan_work(n, by);
        while (scratch_.size() < plan.slots)
            scratch_.emplace_back(memory_);
        while (blocks.size() < plan.blocks)
            blocks.emplace_back(memory_);
        std::size_t most = 0; // so far: which task has the most candidates is chance
        for (const Scratch& each : scratch_)
            most = std::max(most, each.candidates.room());
        for (Scratch& each : scratch_) {
            each.candidates.reserve_runs(most_runs);
            each.candidates.reserve(most);
            each.chosen.reserve(longest_kept / 32 + 1);
            each.unsure.reserve(longest_kept + neighbor_padding);
        }
        const auto run_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            const ExactFloats exact; // on this thread
            body(scratch_[work.slot], work.block, static_cast<std::size_t>(begin),
                 static_cast<std::size_t>(end));
        };
        process_items(n, run_block, by);
    }

    void release()
    {
        std::pmr::vector<Scratch>(memory_).swap(scratch_);
        std::pmr::vector<BlockFound>(memory_).swap(blocks);
        counts.release();
    }

  private:
    Executor* executor_;
    std::pmr::memory_resource* memory_;
    std::pmr::vector<Scratch> scratch_;
};

} // namespace neighbors
JOSTLE_NAMESPACE_END
