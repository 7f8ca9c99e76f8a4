// SPDX-License-Identifier: MIT
#include "pairs/sort_pairs.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <functional>
#include <limits>
#include <span>

#include "base/block_buffer_access.hpp"
#include "base/radix.hpp"
#include "base/run_tasks.hpp"
#include "engine/kernels/kernels.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

// Objects are sorted in groups, large enough that a pass can write to all groups in turn, and small enough
// that a group's pairs fit the L1 cache.
constexpr std::size_t most_groups = 1024;
constexpr std::size_t least_objects_per_group = 256;
// A single task sorts up to this many objects as one group: missing the L1 cache costs less than the pass
// that divides pairs among groups.
constexpr std::size_t most_objects_alone = std::size_t{1} << 18;
// For fewer pairs than this per thread, waking a thread doesn't pay.
constexpr std::uint64_t pairs_per_task = 8192;

/// Sorts the first `count` of the N numbers at `from`, 4 or 8, and writes N pairs, the first `count` of which
/// are good. No branch depends on the numbers, since branches for short lists can't be predicted.
template <std::uint32_t N>
void sort_few(const std::uint32_t* from, std::uint32_t count, std::uint32_t a, Pair* to)
{
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    static constexpr std::uint32_t blank[16] = {0,    0,    0,    0,    0,    0,    0,    0,
                                                none, none, none, none, none, none, none, none};
    std::uint32_t b[N];
    for (std::uint32_t k = 0; k < N; ++k)
        b[k] = from[k] | blank[8 - count + k];
    const auto order = [&b](int i, int j) {
        const std::uint32_t difference = (b[i] ^ b[j]) & (0u - std::uint32_t{b[j] < b[i]});
        b[i] ^= difference;
        b[j] ^= difference;
    };
    // Source: Batcher, Sorting networks and their applications (1968).
    for (int i = 0; i < static_cast<int>(N); i += 4) {
        order(i, i + 1), order(i + 2, i + 3);
        order(i, i + 2), order(i + 1, i + 3);
        order(i + 1, i + 2);
    }
    if constexpr (N == 8) {
        order(0, 4), order(1, 5), order(2, 6), order(3, 7);
        order(2, 4), order(3, 5);
        order(1, 2), order(3, 4), order(5, 6);
    }
    for (std::uint32_t k = 0; k < N; ++k)
        to[k] = {a, b[k]};
}

/// Sorts pairs by a with a counting sort, then each object's partners, mostly a handful, by b. `from` may be
/// `sorted` itself. `partners` and `spare` have room for eight more than the pairs.
void sort_group(std::span<const std::span<const Pair>> from, std::span<Pair> sorted, std::uint32_t first,
                std::uint32_t objects, const engine::Kernels& kernels, std::uint32_t* place,
                std::uint32_t* partners, std::uint32_t* spare)
{
    std::fill_n(place, objects, 0u);
    for (const std::span<const Pair> block : from)
        for (const Pair& pair : block)
            ++place[pair.a - first];
    exclusive_sum(place, objects);
    for (const std::span<const Pair> block : from)
        for (const Pair& pair : block)
            partners[place[pair.a - first]++] = pair.b;
    std::fill_n(partners + sorted.size(), 8, 0u);
    Pair* const to = sorted.data(); // all pairs have been read
    std::uint32_t begin = 0;
    for (std::uint32_t a = 0; a < objects; ++a) { // now place[a] is where the partners of a end
        const std::uint32_t end = place[a], count = end - begin;
        if (count == 0) continue;
        if (count <= 8 && begin + 8 <= sorted.size()) { // excess writes are overwritten
            if (count <= 4)
                sort_few<4>(partners + begin, count, first + a, to + begin);
            else
                sort_few<8>(partners + begin, count, first + a, to + begin);
        } else {
            std::uint32_t* in_order = partners + begin;
            if (count <= engine::most_sorted) {
                kernels.sort_few(in_order, count);
            } else {
                std::uint32_t differing = 0;
                for (std::uint32_t i = 1; i < count; ++i)
                    differing |= in_order[i] ^ in_order[0];
                in_order = radix_sort<8>(in_order, spare, count, std::identity(), differing);
            }
            for (std::uint32_t i = 0; i < count; ++i)
                to[begin + i] = {first + a, in_order[i]};
        }
        begin = end;
    }
}

} // namespace

void PairSorter::sort(const PairBuffer& from, std::size_t objects, Executor& executor, InstructionSet set,
                      PairBuffer& to)
{
    to.clear();
    const std::uint64_t pairs = from.size();
    if (pairs == 0) return;
    const std::span<const std::span<const Pair>> blocks = from.blocks();
    const auto tasks = static_cast<std::uint32_t>(std::clamp<std::uint64_t>(
        pairs / pairs_per_task, 1, std::min<std::uint64_t>(executor.concurrency(), blocks.size())));
    PairBufferAccess access(to);
    // In steps, so that a scene whose size fluctuates doesn't allocate at every new pair.
    const std::uint64_t step = std::max<std::uint64_t>(1024, std::bit_floor(pairs) / 8);
    const std::span<Pair> sorted = access.chunk(0, (pairs + step - 1) / step * step).first(pairs);
    access.reserve_blocks(1);
    const engine::Kernels& kernels = engine::kernels_for(set);
    if (tasks == 1 && objects <= most_objects_alone && pairs <= std::numeric_limits<std::uint32_t>::max()) {
        const auto room = static_cast<std::size_t>(pairs) + 8;
        std::uint32_t* const partners = partners_.reserve(2 * room);
        sort_group(blocks, sorted, 0, static_cast<std::uint32_t>(objects), kernels, places_.reserve(objects),
                   partners, partners + room);
        access.append(sorted);
        return;
    }
    std::size_t bits = 0;
    while ((least_objects_per_group << bits) * most_groups < objects)
        ++bits;
    const std::size_t group_objects = least_objects_per_group << bits;
    const auto group_of = [shift = static_cast<unsigned>(8 + bits)](const Pair& pair) {
        return pair.a >> shift;
    };
    static_assert(least_objects_per_group == 1 << 8);
    const std::size_t groups = (objects + group_objects - 1) / group_objects;
    std::uint64_t* counts = counts_.reserve(tasks * groups);
    std::uint32_t* places = places_.reserve(tasks * group_objects);
    const auto run = [&](const auto& task) {
        if (tasks == 1)
            task(std::uint32_t{0});
        else
            run_tasks(executor, tasks, task);
    };
    const auto each_pair = [&](std::uint32_t task, const auto& visit) {
        for (std::size_t b = blocks.size() * task / tasks; b < blocks.size() * (task + 1) / tasks; ++b)
            for (const Pair& pair : blocks[b])
                visit(pair);
    };
    run([&](std::uint32_t task) {
        std::uint64_t* mine = counts + task * groups;
        std::fill_n(mine, groups, std::uint64_t{0});
        each_pair(task, [&](const Pair& pair) { ++mine[group_of(pair)]; });
    });
    exclusive_sum_of_parts(counts, tasks, groups);
    run([&](std::uint32_t task) {
        std::uint64_t* next = counts + task * groups;
        each_pair(task, [&](const Pair& pair) { sorted[next[group_of(pair)]++] = pair; });
    });
    // Now the last task's count is where a group ends.
    const std::uint64_t* end = counts + (tasks - 1) * groups;
    std::uint64_t largest = end[0];
    for (std::size_t g = 1; g < groups; ++g)
        largest = std::max(largest, end[g] - end[g - 1]);
    const std::size_t room = static_cast<std::size_t>(largest) + 8;
    std::uint32_t* partners = partners_.reserve(2 * tasks * room);
    std::atomic<std::size_t> cursor{0};
    run([&](std::uint32_t task) {
        for (std::size_t g; (g = cursor.fetch_add(1, std::memory_order_relaxed)) < groups;) {
            const std::uint64_t begin = g == 0 ? 0 : end[g - 1];
            const std::span<Pair> group = sorted.subspan(begin, end[g] - begin);
            if (group.size() > std::numeric_limits<std::uint32_t>::max()) {
                std::sort(group.begin(), group.end());
                continue;
            }
            const std::size_t first = g * group_objects;
            std::uint32_t* const mine = partners + 2 * task * room;
            const std::span<const Pair> unsorted = group;
            sort_group(std::span(&unsorted, 1), group, static_cast<std::uint32_t>(first),
                       static_cast<std::uint32_t>(std::min(group_objects, objects - first)), kernels,
                       places + task * group_objects, mine, mine + room);
        }
    });
    access.append(sorted);
}

JOSTLE_NAMESPACE_END
