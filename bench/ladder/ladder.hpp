// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/pair_buffer.hpp"

/// The way from the thesis chapter's broad phase to today's engine, in eight ways to find pairs among the
/// same boxes, each a step on from the one before; docs/inside/chapter.md tells what that
/// brought. For study and measurement: the library uses none of it.
namespace jostle_ladder {

using Boxes = std::span<const jostle::Aabb3f>;

/// What a rung did in its last find().
struct Counts
{
    std::uint64_t probes = 0;     ///< cells looked into
    std::uint64_t candidates = 0; ///< pairs of boxes that were compared
    std::uint64_t bytes = 0;      ///< working memory, without the boxes and the pairs
    std::uint64_t again = 0;      ///< pairs met once more, and dropped
    std::uint64_t selves = 0;     ///< boxes reported as touching themselves
    std::uint64_t searched = 0;   ///< objects that searched: fewer than all where a rung takes too long
};

class Rung
{
  public:
    virtual ~Rung() = default;
    /// One frame: everything is built from the boxes, and all pairs are found. The same executor each time.
    virtual void find(Boxes boxes, jostle::Executor& executor) = 0;
    /// What find() found, a <= b in each, in any order. Each pair once.
    [[nodiscard]] virtual std::vector<jostle::Pair> pairs() const = 0;
    [[nodiscard]] virtual Counts counts() const = 0;
};

struct RungInfo
{
    std::string_view name;
    std::string_view change; ///< what it does that the rung before it doesn't
    bool exact;              ///< finds every pair, and no other
    std::unique_ptr<Rung> (*make)(std::uint32_t most_searches);
};

/// All rungs, from the printed text upwards. `most_searches` bounds how many objects search on the first one,
/// which takes hours for a million: every k-th one then; times and counts are for those only.
[[nodiscard]] std::span<const RungInfo> ladder();

/// The cell sizes of the chapter's levels for these boxes: a power of two for each size that occurs.
[[nodiscard]] std::vector<float> level_sizes(Boxes boxes);

std::unique_ptr<Rung> make_counted(std::uint32_t);
std::unique_ptr<Rung> make_copied(std::uint32_t);
std::unique_ptr<Rung> make_swept(std::uint32_t);

} // namespace jostle_ladder
