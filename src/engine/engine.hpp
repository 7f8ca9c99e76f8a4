// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <span>
#include <vector>

#include "engine/record.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/stats.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

class BrickStore;
struct Job;
class JobPool;
struct Slot;

/// Takes a segment of pairs, moves the accepted ones to its front and returns their end.
using PairSelection = FunctionRef<Pair*(Pair* first, Pair* last)>;

/// What a search does with the pairs it finds.
struct Request
{
    PairSelection select;          // null: every pair is wanted
    PairSink sink;                 // null: pairs are stored in `result`
    PairBuffer* result = nullptr;  // appended to
    std::uint64_t first_block = 0; // the number of the first block given to the sink
    std::uint32_t offset_a = 0;    // added to every pair's objects
    std::uint32_t offset_b = 0;
};

/// Thrown when a box is NaN or inverted. The caller, which knows all slices, finds the lowest such box.
struct BadBox
{
};

/// The number of pairs in a chunk, the memory that a task writes to at a time.
inline constexpr std::size_t chunk_pairs = std::size_t{1} << 15;

/// Hands out the result's memory to the tasks, chunk by chunk.
class ResultChunks
{
  public:
    void begin_call() noexcept { used_ = 0; }
    /// Returns a chunk with room for at least `pairs`, if they are few. Callable from any thread.
    std::span<Pair> next(PairBuffer& result, std::size_t pairs = chunk_pairs);
    /// Called after a search by this many tasks. The same pairs may fill one chunk more or less per task by
    /// chance, so spare chunks are kept, twice as many when they run short, and steady frames don't allocate.
    void keep_spare(PairBuffer& result, std::uint32_t tasks);
    /// Makes this many chunks, if there aren't as many yet.
    static void reserve(PairBuffer& result, std::uint64_t chunks);

  private:
    std::mutex mutex_;
    std::uint32_t used_ = 0;
};

/// A grid of bricks over the boxes of one call, swept brick by brick. Keeps only its working memory from call
/// to call. docs/inside/engine.md describes how it works.
class Engine
{
  public:
    explicit Engine(const FinderOptions& options);
    ~Engine();

    /// Finds the pairs of `boxes` (at most 2^27 in each set). Returns false if the sink stopped it.
    template <int Dim, class T>
    bool search(const Boxes<Dim, T>& boxes, const Request& request);

    /// Begins a call, which may take several searches: `stats` are summed up, blocks counted and chunks of
    /// the result used from here on.
    void begin_call() noexcept;
    Stats stats;
    std::uint64_t next_block = 0; // the number after the last block of the last search

    [[nodiscard]] Executor& executor() const noexcept { return *executor_; }
    [[nodiscard]] InstructionSet instruction_set() const noexcept { return options_.instruction_set; }
    /// Reserves as much memory as `other` has: next time the work may be divided the other way round.
    void match(const Engine& other);
    [[nodiscard]] std::uint64_t bytes() const noexcept;
    void release();

  private:
    template <int Dim, class T>
    class Search;

    /// Which slot wrote a block of the result, and which of its segments.
    struct Block
    {
        std::uint32_t slot, first, last;
    };

    template <int Dim, class T>
    bool search_few(const Boxes<Dim, T>& boxes, const Request& request);
    void use_slots(std::uint32_t count);

    FinderOptions options_;
    Executor* executor_;
    // Working memory, kept from call to call.
    std::vector<std::unique_ptr<Slot>> slots_;
    std::unique_ptr<JobPool> job_pool_;
    std::pmr::vector<Block> blocks_;
    std::pmr::vector<Job*> jobs_;                // of the current round
    std::pmr::vector<const BrickStore*> stores_; // the slots'
    ResultChunks chunks_;
};

} // namespace engine
JOSTLE_NAMESPACE_END
