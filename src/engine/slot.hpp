// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <exception>
#include <memory>
#include <memory_resource>
#include <mutex>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "engine/brick_store.hpp"
#include "engine/kernels/kernels.hpp"
#include "engine/record.hpp"
#include "engine/sample.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// Work that is too much for one task: a crowd that gets its own grid, or a single brick that is swept in
/// parts. All threads do it together, after all bricks.
struct Job
{
    enum class Kind
    {
        crowd,
        brick
    };

    explicit Job(std::pmr::memory_resource* memory) : records(memory), window_end(memory) {}

    bool in_use = false;
    Kind kind = Kind::crowd;
    /// Where it was found, and its number there. This orders jobs, whichever task found them.
    std::uint64_t block = 0;
    std::uint32_t number = 0;
    int depth = 0; // of the grid that has its records, or of the one that a crowd gets
    std::uint32_t count = 0;
    Buffer<Record> records;           // sorted along the sweep axis, and padded
    Buffer<std::uint32_t> window_end; // of a brick
};

/// A pool of jobs, kept for their memory.
class JobPool
{
  public:
    /// Returns the smallest job with room for `records`, or the largest if none has, so that a steady frame
    /// needs no new memory whichever thread finds which job first. Callable from any thread.
    Job& take(std::uint32_t records, std::pmr::memory_resource* memory);
    void take_all_back() noexcept;
    /// Makes as many jobs as `other` has, each with as much memory. No search may be running.
    void match(const JobPool& other, std::pmr::memory_resource* memory);
    [[nodiscard]] std::uint64_t bytes() const noexcept;
    void release() noexcept { jobs_.clear(); }

  private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<Job>> jobs_;
};

/// A candidate that a row touches, by the number of its record and the object; perhaps.
struct ApartHit
{
    std::uint32_t place, object;
    bool tie;
};

/// The statistics of a task.
struct Counts
{
    std::uint64_t records = 0, steps = 0, ties = 0, bricks = 0, nested = 0;
};

/// The working memory of one task. Which thread runs the task doesn't matter.
struct alignas(128) Slot
{
    explicit Slot(std::pmr::memory_resource* resource) : memory(resource) {}

    std::pmr::memory_resource* memory;

    // For boxes between the user's memory and bricks.
    BrickStore store{memory};
    std::pmr::vector<std::unique_ptr<BrickStore>> nested{memory}; // of nested grids, by depth
    Buffer<Unit<float>> unit_float{memory};
    Buffer<Unit<double>> unit_double{memory};
    Buffer<Sample> sample{memory};

    // The brick being swept.
    Buffer<std::uint32_t> bucket{memory};
    std::uint32_t buckets = 0;
    Buffer<Record> sorted{memory};
    Buffer<std::uint32_t> window_end{memory};
    Buffer<std::uint32_t> columns{memory};

    // The same set by set: see apart.hpp.
    Buffer<Record> apart{memory};
    Buffer<std::uint32_t> apart_place{memory};
    Buffer<std::uint32_t> before{memory};
    Buffer<Outcome> outcomes{memory};
    Buffer<ApartHit> hits{memory};

    // The output.
    Buffer<Pair> ties{memory};
    Buffer<Pair> to_sink{memory};                             // pairs to be passed to a sink
    std::pmr::vector<std::span<const Pair>> segments{memory}; // of the result
    Pair* chunk_next = nullptr;                               // what is left of the last chunk of the result
    Pair* chunk_end = nullptr;
    std::pmr::vector<Job*> jobs{memory}; // found and not yet taken, in the order of their bricks
    Counts counts;
    bool bad_box = false; // some box is NaN or inverted
    std::exception_ptr error;

    /// Clears the results of the last search, and keeps the memory.
    void start_search() noexcept;
    /// Reserves as much memory as `other` has, because next time the work may be divided the other way round.
    void match(const Slot& other);
    [[nodiscard]] std::uint64_t bytes() const noexcept;

    BrickStore& nested_store(int depth);
    template <class T>
    Unit<T>& unit()
    {
        if constexpr (sizeof(T) == 4)
            return *unit_float.reserve_exactly(1);
        else
            return *unit_double.reserve_exactly(1);
    }

  private:
    /// The list of all buffers: every operation on each of them goes through here.
    template <class Self>
    static auto buffers(Self& self)
    {
        return std::tie(self.unit_float, self.unit_double, self.sample, self.bucket, self.sorted,
                        self.window_end, self.columns, self.apart, self.apart_place, self.before,
                        self.outcomes, self.hits, self.ties, self.to_sink);
    }
};

} // namespace engine
JOSTLE_NAMESPACE_END
