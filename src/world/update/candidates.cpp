// SPDX-License-Identifier: MIT
// Finds the pairs of changed objects: with active objects by the engine of PairFinder, and with resting
// objects by lists of neighbours or the index.
#include "world/update/candidates.hpp"

#include <algorithm>
#include <atomic>

#include "base/block_buffer_access.hpp"
#include "base/buffer.hpp"
#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "index/kernels/kernels.hpp"
#include "jostle/process.hpp"
#include "pairs/pair_finder_access.hpp"
#include "pairs/sort_pairs.hpp"
#include "world/update/sort_keys.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// Up to this many entries are tested here: the engine's working memory takes more than a small world does.
constexpr std::size_t few_to_try = 24;

template <int Dim, class T>
class Search
{
  public:
    using Box = Aabb<Dim, T>;
    using Boxes = BoxView<Dim, T>;

    Search(State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
           NeighbourLists<Dim, T>& neighbour_lists, Arena& arena)
        : state_(state),
          entries_(entries),
          finder_(finder),
          neighbour_lists_(neighbour_lists),
          arena_(arena),
          found_(arena.take<PairBuffer>("pairs as they were found")),
          all_pass_(state.classes.all_pass()),
          has_rested_(state.objects.capacity(), entries.rested, arena)
    {
        found_.clear();
    }

    void among_active();
    void among_resting();
    /// Everything found, in the memory of `to`, and statistics.
    void tell(Candidates& candidates, PairBuffer& to)
    {
        candidates.touching = sorted(to);
        candidates.looked_at = looked_at_;
        candidates.rejected = rejected_;
        candidates.listed = listed_;
    }

  private:
    using Division = typename NeighbourLists<Dim, T>::Division;

    void count(std::uint64_t looked_at, std::uint64_t kept) noexcept
    {
        looked_at_.fetch_add(looked_at, std::memory_order_relaxed);
        rejected_.fetch_add(looked_at - kept, std::memory_order_relaxed);
    }
    [[nodiscard]] bool pass(FilterClass class_a, Index a, FilterClass class_b, Index b) const noexcept
    {
        if (class_a != FilterClass::look && class_b != FilterClass::look)
            return state_.classes.pass(class_a, class_b);
        return passes(state_.objects[a].filter(), state_.objects[b].filter());
    }
    template <class EntryOf>
    std::uint32_t select_resting(Pair* first, const Pair* last, const Division& division,
                                 const EntryOf& entry_of) noexcept;
    void among(std::span<const Box> boxes);
    template <class IndexOf>
    void between(std::span<const Box> moved, std::span<const Box> others, const IndexOf& index_of,
                 PairBuffer& pairs);
    void take(const PairBuffer& pairs)
    {
        for (const std::span<const Pair> block : pairs.blocks())
            PairBufferAccess(found_).append(block);
    }
    std::span<Pair> sorted(PairBuffer& to);
    void find_listed(const Division& division);
    void find_unlisted(const Division& division);

    State<Dim, T>& state_;
    const Entries<Dim, T>& entries_;
    PairFinder& finder_;
    NeighbourLists<Dim, T>& neighbour_lists_;
    Arena& arena_;
    PairBuffer& found_; // pairs of indices, in the memory of those that found them
    const bool all_pass_;
    const Marked has_rested_;
    std::atomic<std::uint64_t> looked_at_{0}, rejected_{0};
    std::uint64_t listed_ = 0;
};

/// Pairs of changed objects with each other, with idle ones and with parked ones.
template <int Dim, class T>
void Search<Dim, T>::among_active()
{
    // Pairs of idle objects are known; if there are many, it is better to keep these objects apart.
    const std::span<const Box> all(entries_.box.values());
    const std::span<const Box> moved = all.first(entries_.changed), idle = all.subspan(entries_.changed);
    if (idle.size() <= moved.size()) {
        among(all);
    } else {
        among(moved);
        const auto index_of = [&](std::uint32_t k) {
            return entries_.index[Entry{k + static_cast<std::uint32_t>(entries_.changed)}];
        };
        between(moved, idle, index_of, arena_.take<PairBuffer>("pairs of changed entries and idle ones"));
    }
    const auto parked = [&](std::uint32_t place) {
        const Index index = state_.parked.index(place); // changed objects are found as such
        const bool waits = index != state_.parked.nobody && !state_.objects[index].has(flag::written);
        return waits ? index : state_.parked.nobody;
    };
    between(moved, state_.parked.boxes(), parked,
            arena_.take<PairBuffer>("pairs of changed entries and parked objects"));
}

/// Pairs of the entries from the first on that have these boxes.
template <int Dim, class T>
void Search<Dim, T>::among(std::span<const Box> boxes)
{
    // If the entries are all objects, from the first one on, entries and indices are the same numbers.
    const bool same_numbers = all_pass_ && entries_.changed == entries_.size() &&
                              raw(entries_.index.values().back()) == entries_.size() - 1;
    const auto select = [&](Pair* const first, Pair* last) {
        Pair* kept = first;
        for (const Pair* pair = first; pair != last; ++pair) {
            const Entry a{pair->a}, b{pair->b};
            if (!all_pass_ &&
                !pass(entries_.filter[a], entries_.index[a], entries_.filter[b], entries_.index[b]))
                continue;
            *kept++ = pair_of(entries_.index[a], entries_.index[b]);
        }
        count(static_cast<std::uint64_t>(last - first), static_cast<std::uint64_t>(kept - first));
        return kept;
    };
    auto& pairs = arena_.take<PairBuffer>("pairs among entries");
    if (boxes.size() <= few_to_try) {
        Pair* const tried = PairBufferAccess(pairs).chunk(0, few_to_try * few_to_try / 2).data();
        Pair* end = tried;
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
            for (std::uint32_t j = i + 1; j < boxes.size(); ++j)
                if (overlaps_branchless(boxes[i], boxes[j])) *end++ = {i, j};
        PairBufferAccess(found_).append({tried, select(tried, end)});
        return;
    }
    PairFinderAccess::Selection wanted;
    if (!same_numbers) wanted = select;
    PairFinderAccess::find(finder_, Boxes(boxes), wanted, pairs);
    if (same_numbers) count(pairs.size(), pairs.size());
    take(pairs);
}

/// Pairs of a changed entry and one of `others`, whose object is index_of, or nobody.
template <int Dim, class T>
template <class IndexOf>
void Search<Dim, T>::between(std::span<const Box> moved, std::span<const Box> others, const IndexOf& index_of,
                             PairBuffer& pairs)
{
    if (others.empty()) return;
    const auto select = [&](Pair* const first, Pair* last) {
        Pair* kept = first;
        std::uint64_t candidates = 0;
        for (const Pair* pair = first; pair != last; ++pair) {
            const Entry entry{pair->a};
            const Index index = entries_.index[entry], other = index_of(pair->b);
            if (other == state_.parked.nobody) continue;
            ++candidates;
            if (all_pass_ || pass(entries_.filter[entry], index, state_.classes[other], other))
                *kept++ = pair_of(index, other);
        }
        count(candidates, static_cast<std::uint64_t>(kept - first));
        return kept;
    };
    PairFinderAccess::find(finder_, Boxes(moved), Boxes(others), select, pairs);
    take(pairs);
}

/// Keeps, of pairs of an entry and a resting object, those whose filters agree, as pairs of indices.
template <int Dim, class T>
template <class EntryOf>
std::uint32_t Search<Dim, T>::select_resting(Pair* const first, const Pair* last, const Division& division,
                                             const EntryOf& entry_of) noexcept
{
    Pair* kept = first;
    std::uint64_t candidates = 0;
    for (const Pair* each = first; each != last; ++each) {
        const Entry entry = entry_of(each->a);
        const Index index = entries_.index[entry], other{each->b};
        // An object in a list that has since moved or woken up is found elsewhere, if at all; one that does
        // so in this update is found as a changed one.
        if (neighbour_lists_.has_left(other, division.created[entry])) continue;
        if (has_rested_(other)) continue;
        ++candidates;
        if (all_pass_ || pass(entries_.filter[entry], index, state_.classes[other], other))
            *kept++ = pair_of(index, other);
    }
    count(candidates, static_cast<std::uint64_t>(kept - first));
    return static_cast<std::uint32_t>(kept - first);
}

/// Pairs of changed and resting objects.
template <int Dim, class T>
void Search<Dim, T>::among_resting()
{
    const Division division = neighbour_lists_.divide(state_, entries_, has_rested_, arena_);
    listed_ = division.listed;
    if (!division.lookups.empty()) find_listed(division);
    if (!division.unlisted.empty()) find_unlisted(division);
}

template <int Dim, class T>
void Search<Dim, T>::find_listed(const Division& division)
{
    const std::span<const index::Lookup<Dim>> lookups = division.lookups;
    const std::size_t runs = (lookups.size() + object_run - 1) / object_run;
    auto& first_of_run = arena_.list<std::uint64_t>("room for what runs find in lists");
    auto& kept_of_run = arena_.list<std::uint32_t>("pairs that runs find in lists");
    kept_of_run.resize(runs);
    std::uint64_t room = 0;
    for (std::size_t k = 0; k < lookups.size(); ++k) {
        if (k % object_run == 0) first_of_run.push_back(room);
        room += lookups[k].count * index::lanes;
    }
    Pair* const pairs =
        arena_.take<Buffer<Pair>>("pairs found in lists").reserve(static_cast<std::size_t>(room));
    const auto& kernels = index::kernels_for<Dim, T>(state_.options.instruction_set);
    const auto overlaps_object = [&](std::uint32_t entry, std::uint32_t index) {
        return overlaps_branchless(entries_.box[Entry{entry}], state_.objects[Index{index}].now());
    };
    const auto look_up = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        Pair* const to = pairs + first_of_run[work.block];
        const std::size_t count = kernels.look_up(&lookups[begin], end - begin, overlaps_object, to);
        kept_of_run[work.block] =
            select_resting(to, to + count, division, [](std::uint32_t entry) { return Entry{entry}; });
    };
    process_items(lookups.size(), look_up, {state_.executor_for(lookups.size()), object_run});
    for (std::size_t run = 0; run < runs; ++run)
        PairBufferAccess(found_).append({pairs + first_of_run[run], kept_of_run[run]});
}

template <int Dim, class T>
void Search<Dim, T>::find_unlisted(const Division& division)
{
    // If all resting objects are in one place, such as the ground below, most objects are nowhere near.
    const Box hull = BoxIndexAccess::tree(state_.resting).hull();
    auto& unlisted = arena_.list<Entry>("entries to be asked about");
    auto& boxes = arena_.list<Box>("boxes of entries to be asked about");
    unlisted.resize(division.unlisted.size());
    boxes.resize(division.unlisted.size());
    std::size_t asked = 0;
    for (const Entry entry : division.unlisted) {
        const Box& box = entries_.box[entry];
        unlisted[asked] = entry;
        boxes[asked] = box;
        asked += overlaps_branchless(box, hull);
    }
    if (asked == 0) return;
    unlisted.resize(asked);
    boxes.resize(asked);
    auto& pairs = arena_.list<Pair>("pairs found in the index");
    state_.resting.join(boxes, pairs);
    auto& kept_of_run = arena_.list<std::uint32_t>("pairs that runs find in the index");
    kept_of_run.resize((pairs.size() + run_length - 1) / run_length);
    const auto select = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        kept_of_run[work.block] = select_resting(pairs.data() + begin, pairs.data() + end, division,
                                                 [&](std::uint32_t number) { return unlisted[number]; });
    };
    process_items(pairs.size(), select, {state_.executor_for(pairs.size()), run_length});
    for (std::size_t run = 0; run < kept_of_run.size(); ++run)
        PairBufferAccess(found_).append({pairs.data() + run * run_length, kept_of_run[run]});
}

template <int Dim, class T>
std::span<Pair> Search<Dim, T>::sorted(PairBuffer& to)
{
    if (found_.size() == 0) return {};
    // The counting sort passes over all objects, though in parallel; the other passes over the pairs several
    // times.
    const std::uint64_t count = found_.size(), objects = state_.ids.end();
    if (count >= objects ||
        (count >= objects / 8 && count >= 16 * run_length && state_.executor->concurrency() > 1)) {
        arena_.take<PairSorter>("sorter of pairs")
            .sort(found_, objects, *state_.executor, state_.options.instruction_set, to);
        return PairBufferAccess(to).chunk(0, 0).first(to.size());
    }
    const std::span<Pair> sorted = PairBufferAccess(to).chunk(0, count).first(count);
    auto& pairs = arena_.list<Pair>("pairs being sorted");
    pairs.reserve(count);
    for (const std::span<const Pair> block : found_.blocks())
        pairs.insert(pairs.end(), block.begin(), block.end());
    sort_pairs(pairs, arena_.list<Pair>("pairs being sorted, in another order"));
    std::copy(pairs.begin(), pairs.end(), sorted.begin());
    return sorted;
}

} // namespace

template <int Dim, class T>
Candidates find(State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                NeighbourLists<Dim, T>& neighbour_lists, PairBuffer& to, Arena& arena)
{
    Candidates candidates;
    Search<Dim, T> search(state, entries, finder, neighbour_lists, arena);
    if (entries.changed != 0) {
        const auto t0 = Clock::now();
        search.among_active();
        const auto t1 = Clock::now();
        candidates.us_active = microseconds(t0, t1);
        if (state.resting.size() != 0) {
            search.among_resting();
            candidates.us_resting = microseconds(t1, Clock::now());
        }
    }
    search.tell(candidates, to);
    return candidates;
}

template <int Dim, class T>
std::span<const Pair> find_old_pairs(State<Dim, T>& state, const Changes<Dim, T>& changes,
                                     const Entries<Dim, T>& entries, PairFinder& finder, Arena& arena)
{
    if (entries.stirring.empty()) return {};
    const std::span<const Aabb<Dim, T>> boxes(entries.boxes_before);
    auto& pairs = arena.list<Pair>("old pairs of stirring objects");
    // All present and former filters of objects have a class.
    const bool all_pass = state.classes.all_pass();
    const auto take = [&](Index a, Index b) {
        if (a == b || (state.objects[b].has(flag::written) && b < a)) return; // found from the other side
        if (all_pass || passes(changes.old_filter(a), changes.old_filter(b))) pairs.push_back(pair_of(a, b));
    };
    auto& joined = arena.list<Pair>("stirring objects and what rested around them");
    if (state.resting.size() != 0) state.resting.join(boxes, joined);
    for (std::size_t k = 0; k < joined.size(); ++k) {
        if (k + fetch_ahead < joined.size()) state.objects[Index{joined[k + fetch_ahead].b}].prefetch_state();
        take(entries.stirring[joined[k].a], Index{joined[k].b});
    }
    auto& beside = arena.take<PairBuffer>("stirring objects and what was parked around them");
    beside.clear();
    const BoxView<Dim, T> parked(state.parked.boxes());
    if (parked.size() != 0) PairFinderAccess::find(finder, BoxView<Dim, T>(boxes), parked, {}, beside);
    for (const Pair& pair : beside)
        if (const Index other = state.parked.index(pair.b); other != state.parked.nobody)
            take(entries.stirring[pair.a], other);
    sort_pairs(pairs, arena.list<Pair>("old pairs of stirring objects, in another order"));
    return pairs;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template Candidates find(State<Dim, T>&, const Entries<Dim, T>&, PairFinder&, NeighbourLists<Dim, T>&,   \
                             PairBuffer&, Arena&);                                                           \
    template std::span<const Pair> find_old_pairs(State<Dim, T>&, const Changes<Dim, T>&,                    \
                                                  const Entries<Dim, T>&, PairFinder&, Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
