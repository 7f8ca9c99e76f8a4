// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bench/ladder/ladder.hpp"
#include "jostle/chapter.hpp"

namespace jostle_ladder {

using Cell = jostle::chapter::Cell<3>;
constexpr std::size_t line = jostle::chapter::cache_line;

inline Cell cell_of(const jostle::Vec3f& position, float cell_size)
{
    Cell cell;
    for (std::size_t d = 0; d < 3; ++d)
        cell[d] = jostle::chapter::cell_index(position[static_cast<int>(d)], cell_size);
    return cell;
}

/// Alg. 6, corrected: the first level whose cells hold the box, so that it lies over at most two of them per
/// axis.
inline std::uint32_t level_of(const jostle::Aabb3f& box, const std::vector<float>& sizes)
{
    const float edge =
        std::max(std::max(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1]), box.hi[2] - box.lo[2]);
    std::uint32_t level = 0;
    for (; level + 1 < sizes.size(); ++level) {
        if (sizes[level] < edge) continue;
        const Cell first = cell_of(box.lo, sizes[level]), last = cell_of(box.hi, sizes[level]);
        if (last[0] <= first[0] + 1 && last[1] <= first[1] + 1 && last[2] <= first[2] + 1) break;
    }
    return level;
}

/// Calls use(cell) for each cell from first to last, x fastest.
template <class Use>
void each_cell(const Cell& first, const Cell& last, Use use)
{
    Cell cell;
    for (cell[2] = first[2]; cell[2] <= last[2]; ++cell[2])
        for (cell[1] = first[1]; cell[1] <= last[1]; ++cell[1])
            for (cell[0] = first[0]; cell[0] <= last[0]; ++cell[0])
                use(cell);
}

inline std::uint32_t bucket_of(const Cell& cell, std::uint32_t level, std::uint32_t buckets)
{
    return jostle::chapter::bucket_index<3>(cell, level, buckets, jostle::chapter::Hash::mixing);
}

/// Records of the same bucket side by side, by a counting sort. `each(use)` calls use(bucket, record) for
/// every record, and is called twice, in the same order.
template <class Record>
class Sorted
{
  public:
    template <class Each>
    void sort(std::uint32_t buckets, Each each)
    {
        begin.assign(buckets + 1, 0);
        each([&](std::uint32_t bucket, const Record&) { ++begin[bucket]; });
        std::uint32_t sum = 0;
        for (std::uint32_t& b : begin)
            b = sum += b; // the bucket's end; filling backwards moves it to the begin
        records.resize(sum);
        std::vector<Record>& to = records;
        each([&](std::uint32_t bucket, const Record& record) { to[--begin[bucket]] = record; });
    }
    [[nodiscard]] std::uint64_t bytes() const
    {
        return begin.capacity() * sizeof(std::uint32_t) + records.capacity() * sizeof(Record);
    }

    std::vector<std::uint32_t> begin; ///< of each bucket in `records`; one more at the end
    std::vector<Record> records;
};

/// What a processor finds, on cache lines of its own.
struct alignas(line) Found
{
    std::vector<jostle::Pair> pairs;
    std::uint64_t probes = 0, candidates = 0;

    void add(std::uint32_t a, std::uint32_t b) { pairs.push_back({std::min(a, b), std::max(a, b)}); }
};

/// A rung whose processors take blocks of work from an atomic counter, and keep what they find.
class FoundByProcessor : public Rung
{
  public:
    [[nodiscard]] std::vector<jostle::Pair> pairs() const override
    {
        std::vector<jostle::Pair> all;
        for (const Found& found : found_)
            all.insert(all.end(), found.pairs.begin(), found.pairs.end());
        return all;
    }

  protected:
    /// search(begin, end, found) for blocks of 0 .. `items` - 1.
    template <class Search>
    void share(std::uint32_t items, jostle::Executor& executor, Search search)
    {
        constexpr std::uint32_t block = 1024;
        found_.resize(executor.concurrency());
        std::atomic<std::uint32_t> next{0};
        const std::uint32_t blocks = (items + block - 1) / block;
        jostle::chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t) {
            Found& found = found_[processor];
            found.pairs.clear();
            found.probes = found.candidates = 0;
            for (std::uint32_t b; (b = next.fetch_add(1)) < blocks;)
                search(b * block, std::min(items, (b + 1) * block), found);
        });
    }
    [[nodiscard]] Counts totals(std::uint64_t bytes, std::size_t objects) const
    {
        Counts counts{.bytes = bytes, .searched = objects};
        for (const Found& found : found_) {
            counts.probes += found.probes;
            counts.candidates += found.candidates;
        }
        return counts;
    }

  private:
    std::vector<Found> found_;
};

} // namespace jostle_ladder
