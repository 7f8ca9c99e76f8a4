// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <memory_resource>
#include <vector>

#include "engine/brick_store.hpp"
#include "engine/buffer.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/record.hpp"
#include "engine/tuner.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/stats.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Takes a run of pairs, moves those that are wanted to its front and returns their end.
using PairSelection = FunctionRef<Pair*(Pair* first, Pair* last)>;

/// What a run is to do with what it finds.
struct Request
{
    PairSelection select;          // null: every pair is wanted
    PairSink sink;                 // null: pairs are stored in `result`
    PairBuffer* result = nullptr;  // appended to
    std::uint64_t first_block = 0; // the number of the first block given to the sink
    std::uint32_t offset_a = 0;    // added to every pair's objects
    std::uint32_t offset_b = 0;
};

/// Thrown when a box is NaN or inverted; those of the second set count on after those of the first.
struct BadBox
{
    std::uint64_t index;
};

/// A grid of bricks over the boxes of one call, swept brick by brick. Keeps its working memory from call to
/// call, and nothing else. docs/guide/engine.md tells how it works.
class Engine
{
  public:
    explicit Engine(const FinderOptions& options);
    ~Engine();

    /// Finds the pairs of `boxes` (at most 2^27 in each set). Returns false if the sink stopped it.
    template <int Dim, class T>
    bool run(const Boxes<Dim, T>& boxes, const Request& request);

    /// A call may take several runs: `stats` are summed up, blocks counted and chunks of the result used
    /// since this.
    void begin_call() noexcept;
    Stats stats;
    std::uint64_t next_block = 0; // the number after the last block of the last run

    [[nodiscard]] Executor& executor() const noexcept { return *executor_; }
    [[nodiscard]] std::uint64_t bytes() const noexcept;
    void release();

  private:
    struct Slot;
    struct Job;
    template <int Dim, class T>
    class Run;

    void use_slots(std::uint32_t count);

    FinderOptions options_;
    Executor* executor_;
    std::vector<std::unique_ptr<Slot>> slots_;
    /// Which slot wrote a block of the result, and which of its segments.
    struct Block
    {
        std::uint32_t slot, first, last;
    };
    std::pmr::vector<Block> blocks_;
    std::pmr::vector<Job*> jobs_;
    std::vector<std::unique_ptr<Job>> job_pool_;
    std::uint32_t chunks_used_ = 0; // of the result's memory
};

} // namespace engine
JOSTLE_NAMESPACE_END
