// SPDX-License-Identifier: MIT
#include "world/update/near_pairs.hpp"

#include <algorithm>

#include "base/box.hpp"
#include "base/instantiate.hpp"
#include "jostle/process.hpp"
#include "pairs/pair_finder_access.hpp"
#include "pairs/sort_pairs.hpp"
#include "world/update/sort_keys.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

// Fewer are tried each against each, which takes no longer.
constexpr std::size_t least_entries = 25;
// Where more than one of so many has left, to go on has to prove worth it.
constexpr std::size_t stay_per_leaver = 128;
// Where that doesn't pay, so many updates pass at most before it is tried again.
constexpr std::uint32_t longest_wait = 64;
// So few pairs are tried one by one: a grid for all would be made for a few leavers alone.
constexpr std::size_t few_tries = 32'768;

/// However the sums are rounded, the box is inside.
template <int Dim, class T>
Aabb<Dim, T> padded(Aabb<Dim, T> box, T slack) noexcept
{
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] -= slack;
        box.hi[d] += slack;
    }
    return box;
}

/// Entries that have changed ascend by index, and behind them the others do.
template <int Dim, class T>
void list_by_index(const Entries<Dim, T>& entries, std::pmr::vector<Entry>& order)
{
    const auto count = static_cast<std::uint32_t>(entries.size());
    const auto changed = static_cast<std::uint32_t>(entries.changed);
    order.reserve(count);
    std::uint32_t next = 0;
    const auto take_before = [&](std::uint64_t index) {
        for (; next != changed && raw(entries.index[Entry{next}]) < index; ++next)
            order.push_back(Entry{next});
    };
    for (std::uint32_t other = changed; other != count; ++other) {
        take_before(raw(entries.index[Entry{other}]));
        order.push_back(Entry{other});
    }
    take_before(~std::uint64_t{0});
}

} // namespace

template <int Dim, class T>
bool NearPairs<Dim, T>::is_inside(const Entries<Dim, T>& entries, Entry entry) const noexcept
{
    const Index index = entries.index[entry];
    const std::uint32_t slot = slot_of_[index];
    return slot < owners_.size() && owners_[slot] == index && inside(entries.box[entry], padded_[slot]);
}

/// Puts entries that are inside their padded boxes into their slots. Returns how many aren't.
template <int Dim, class T>
std::size_t NearPairs<Dim, T>::place(const State<Dim, T>& state, const Entries<Dim, T>& entries, Arena& arena)
{
    const std::size_t runs = (entries.size() + object_run - 1) / object_run;
    auto& inside_of_run = arena.list<std::uint32_t>("entries of runs in their padded boxes");
    inside_of_run.resize(runs);
    entry_.assign(owners_.size(), nobody);
    now_.resize(owners_.size());
    const auto place_some = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        std::uint32_t inside = 0;
        for (std::uint64_t i = begin; i < end; ++i) {
            const Entry entry{static_cast<std::uint32_t>(i)};
            if (!is_inside(entries, entry)) continue;
            const std::uint32_t slot = slot_of_[entries.index[entry]];
            entry_[slot] = entry;
            now_[slot] = entries.box[entry];
            ++inside;
        }
        inside_of_run[work.block] = inside;
    };
    process_items(entries.size(), place_some, {state.executor_for(entries.size()), object_run});
    std::size_t inside = 0;
    for (const std::uint32_t of_run : inside_of_run)
        inside += of_run;
    if (inside != owners_.size()) {
        const Box nowhere = nowhere_box<Dim, T>();
        for (std::size_t slot = 0; slot < owners_.size(); ++slot)
            if (entry_[slot] == nobody) now_[slot] = nowhere;
    }
    return entries.size() - inside;
}

template <int Dim, class T>
void NearPairs<Dim, T>::forget() noexcept
{
    owners_.clear();
    padded_.clear();
    first_.clear();
    partners_.clear();
}

template <int Dim, class T>
bool NearPairs<Dim, T>::follow(const State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                               std::uint64_t& padded, Arena& arena)
{
    padded = 0;
    if (slack_ == 0 || entries.size() < least_entries) return false;
    if (waits_ != 0) {
        --waits_;
        return false;
    }
    slot_of_.grow(state.objects.capacity());
    const std::size_t outside = place(state, entries, arena);
    if (stay_per_leaver * outside > entries.size()) {
        // What wasn't active before may come to rest at once, and so isn't worth a trial.
        const auto known = static_cast<std::size_t>(
            std::count(entries.moves_on.values().begin(), entries.moves_on.values().end(), std::uint8_t{1}));
        if (2 * known < entries.size()) return false;
        if (on_trial_) {
            on_trial_ = false;
            waits_ = next_wait_;
            next_wait_ = std::min(2 * next_wait_, longest_wait);
            forget();
            return false;
        }
        on_trial_ = true;
    } else if (on_trial_) {
        on_trial_ = false;
        next_wait_ = 1;
    }
    padded = outside;
    // Slots of objects that are no longer active aren't worth much, but to go by them takes time.
    if (outside == 0 && owners_.size() <= entries.size() + entries.size() / 4) return true;
    renew(state, entries, finder, arena);
    return true;
}

/// What the slots will be: one for each entry, ascending by index, and for nobody else.
template <int Dim, class T>
struct NearPairs<Dim, T>::Renewed
{
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    explicit Renewed(Arena& arena)
        : order(arena.list<Entry>("entries by index")),
          owners(arena.list<Index>("who is padded")),
          boxes(arena.list<Box>("padded boxes")),
          slot_after(arena.list<std::uint32_t>("new slots by those before")),
          leavers(arena.list<std::uint32_t>("slots that are padded anew")),
          boxes_of_leavers(arena.list<Box>("boxes that are padded anew"))
    {
    }
    [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(order.size()); }

    std::pmr::vector<Entry>& order;
    std::pmr::vector<Index>& owners;
    std::pmr::vector<Box>& boxes;
    std::pmr::vector<std::uint32_t>& slot_after; // of slots until now; none: its object is no longer active
    std::pmr::vector<std::uint32_t>& leavers;
    std::pmr::vector<Box>& boxes_of_leavers;
};

template <int Dim, class T>
void NearPairs<Dim, T>::renew(const State<Dim, T>& state, const Entries<Dim, T>& entries, PairFinder& finder,
                              Arena& arena)
{
    Renewed renewed(arena);
    list_by_index(entries, renewed.order);
    pad(entries, renewed);
    const std::span<const Pair> pairs = find_new(state, renewed, finder, arena);
    auto& first = arena.list<std::size_t>("where partners begin");
    auto& partners = arena.list<std::uint32_t>("partners of slots");
    merge(renewed, pairs, first, partners);
    const std::uint32_t count = renewed.size();
    entry_.reserve(count);
    now_.reserve(count);

    // Nothing fails from here on.
    owners_.swap(renewed.owners);
    padded_.swap(renewed.boxes);
    first_.swap(first);
    partners_.swap(partners);
    entry_.assign(renewed.order.begin(), renewed.order.end());
    now_.resize(count);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        slot_of_[owners_[slot]] = slot;
        now_[slot] = entries.box[entry_[slot]];
    }
}

/// Whoever has left its padded box, or had none, gets one.
template <int Dim, class T>
void NearPairs<Dim, T>::pad(const Entries<Dim, T>& entries, Renewed& renewed) const
{
    const std::uint32_t count = renewed.size();
    renewed.slot_after.assign(owners_.size(), Renewed::none);
    renewed.owners.reserve(count);
    renewed.boxes.reserve(count);
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        const Entry entry = renewed.order[slot];
        const Index index = entries.index[entry];
        renewed.owners.push_back(index);
        if (is_inside(entries, entry)) {
            const std::uint32_t before = slot_of_[index];
            renewed.slot_after[before] = slot;
            renewed.boxes.push_back(padded_[before]);
        } else {
            renewed.boxes.push_back(padded(entries.box[entry], slack_));
            renewed.leavers.push_back(slot);
            renewed.boxes_of_leavers.push_back(renewed.boxes.back());
        }
    }
}

/// The pairs of those that were padded anew, sorted.
template <int Dim, class T>
std::span<const Pair> NearPairs<Dim, T>::find_new(const State<Dim, T>& state, const Renewed& renewed,
                                                  PairFinder& finder, Arena& arena)
{
    const std::uint32_t count = renewed.size();
    const auto& leavers = renewed.leavers;
    const auto& boxes_of_leavers = renewed.boxes_of_leavers;
    const BoxView<Dim, T> all{std::span<const Box>(renewed.boxes)};
    auto& found = arena.take<PairBuffer>("new near pairs, as they are found");
    auto& pairs = arena.list<Pair>("new near pairs");
    if (leavers.size() == count) {
        PairFinderAccess::find(finder, all, {}, found);
        auto& sorted = arena.take<PairBuffer>("new near pairs, sorted");
        arena.take<PairSorter>("sorter of near pairs")
            .sort(found, count, *state.executor, state.options.instruction_set, sorted);
        pairs.reserve(static_cast<std::size_t>(sorted.size()));
        for (const std::span<const Pair> block : sorted.blocks())
            pairs.insert(pairs.end(), block.begin(), block.end());
        return pairs;
    }
    const auto take = [&](std::uint32_t leaver, std::uint32_t other) {
        // Two leavers are found from both sides, and each finds itself.
        const bool other_left = other <= leaver && std::binary_search(leavers.begin(), leavers.end(), other);
        if (!other_left) pairs.push_back({std::min(leaver, other), std::max(leaver, other)});
    };
    if (leavers.size() * count > few_tries) {
        PairFinderAccess::find(finder, BoxView<Dim, T>(std::span<const Box>(boxes_of_leavers)), all, {},
                               found);
        for (const std::span<const Pair> block : found.blocks())
            for (const Pair& pair : block)
                take(leavers[pair.a], pair.b);
    } else {
        for (std::size_t k = 0; k < leavers.size(); ++k)
            for (std::uint32_t other = 0; other < count; ++other)
                if (overlaps_branchless(boxes_of_leavers[k], renewed.boxes[other])) take(leavers[k], other);
    }
    sort_pairs(pairs, arena.list<Pair>("new near pairs, in another order"));
    return pairs;
}

/// The partners until now, in the same order as before, and among them the new ones.
template <int Dim, class T>
void NearPairs<Dim, T>::merge(const Renewed& renewed, std::span<const Pair> pairs,
                              std::pmr::vector<std::size_t>& first,
                              std::pmr::vector<std::uint32_t>& partners) const
{
    const std::uint32_t count = renewed.size();
    const auto& slot_after = renewed.slot_after;
    first.reserve(count + std::size_t{1});
    partners.reserve(partners_.size() + pairs.size());
    const Pair* next = pairs.data();
    const Pair* const end = next + pairs.size();
    const auto take_new = [&](std::uint32_t slot, std::uint32_t before) {
        for (; next != end && next->a == slot && next->b < before; ++next)
            partners.push_back(next->b);
    };
    std::uint32_t before = 0;
    for (std::uint32_t slot = 0; slot < count; ++slot) {
        first.push_back(partners.size());
        while (before != slots() && (slot_after[before] == Renewed::none || slot_after[before] < slot))
            ++before;
        if (before != slots() && slot_after[before] == slot)
            for (const std::uint32_t partner : this->partners(before)) {
                const std::uint32_t after = slot_after[partner];
                if (after == Renewed::none) continue;
                take_new(slot, after);
                partners.push_back(after);
            }
        take_new(slot, Renewed::none);
    }
    first.push_back(partners.size());
}

#define JOSTLE_INSTANTIATE(Dim, T) template class NearPairs<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
