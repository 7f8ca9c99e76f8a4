// SPDX-License-Identifier: MIT
// Decides what became of the pairs since the last update, by merging two lists: the pairs that touch now,
// found in this update, and those that touched before, kept from the last update or, for objects that wake
// up, found again. A pair in both lists persists, one only in the first began, and one only in the second
// ended, or is of two objects that didn't change.
#include "world/update/events.hpp"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "base/block_buffer_access.hpp"
#include "base/instantiate.hpp"
#include "jostle/process.hpp"
#include "world/update/in_runs.hpp"
#include "world/update/sort_keys.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

struct Ended
{
    Key key;
    EndReason reason;
};

// Every reason for the end of a pair comes from one of these three.

/// Why a pair that is no longer found ends.
template <int Dim, class T>
[[nodiscard]] EndReason reason_of(const State<Dim, T>& state, const Pair& pair) noexcept
{
    const auto a = state.objects[Index{pair.a}], b = state.objects[Index{pair.b}];
    if (!a.has(flag::alive) || !b.has(flag::alive)) return EndReason::removed;
    if (!a.has(flag::enabled) || !b.has(flag::enabled)) return EndReason::disabled;
    // With unchanged filters, they would be found if they touched.
    if (!a.has(flag::refiltered) && !b.has(flag::refiltered)) return EndReason::moved_apart;
    return overlaps_branchless(a.now(), b.now()) ? EndReason::filtered : EndReason::moved_apart;
}
/// The result of reason_of() for every pair in an update in which objects only moved, so that no object need
/// be read.
constexpr EndReason reason_if_only_moves = EndReason::moved_apart;
/// Why a pair ends that is still found, but that `accept` now refuses.
constexpr EndReason reason_of_accept = EndReason::filtered;

/// What is known about all pairs, so that not every one has to be examined.
struct Knowledge
{
    bool any_idle;    // there may be pairs of two unchanged objects
    bool any_refused; // there may be pairs that `accept` refused
    bool asks_again;  // `accept` may have to be called for a pair that persists
    bool any_again;   // a pair that persists may have to be reported as new
    bool only_moves;  // every pair that ended did so because an object moved
    bool all_changed; // an object of each old pair has changed: one was active, and none is idle
    bool any_woken;   // there are old pairs of objects that wake up

    /// A pair in both lists persists.
    [[nodiscard]] bool both_means_persists() const noexcept
    {
        return !any_idle && !any_refused && !asks_again && !any_again;
    }
    /// Only the lists that a pair is in matter.
    [[nodiscard]] bool lists_say_all() const noexcept
    {
        return both_means_persists() && all_changed && only_moves && !any_woken;
    }
};

/// Merges the lists, in runs of pairs that touch now.
template <int Dim, class T>
class Merge
{
  public:
    Merge(const State<Dim, T>& state, const Changes<Dim, T>& changes, const Knowledge& known,
          std::span<Pair> touching, const Lists& last, std::span<const Pair> old_pairs, Arena& arena)
        : state_(state),
          changes_(changes),
          known_(known),
          touching_(touching),
          last_(last),
          last_others_(last.others),
          old_pairs_(old_pairs),
          began_(arena.take<InRuns<Key>>("pairs that begin, by runs")),
          asked_(arena.take<InRuns<Key>>("pairs about which accept is asked again, by runs")),
          ended_(arena.take<InRuns<Ended>>("pairs that end, by runs")),
          others_(arena.take<InRuns<Pair>>("other pairs, by runs")),
          kept_of_run_(arena.list<std::uint32_t>("pairs of runs that persist")),
          first_of_run_(arena.list<Key>("first pairs of runs"))
    {
        began_.clear();
        asked_.clear();
        ended_.clear();
        others_.clear();
    }
    /// Pairs that persist move to the front of their run; these fronts become `next.persisted`.
    void run(Lists& next);

    InRuns<Key>& began() noexcept { return began_; }
    InRuns<Key>& asked() noexcept { return asked_; }
    InRuns<Ended>& ended() noexcept { return ended_; }

  private:
    /// The state of a run: its pairs that touch now, the old ones in three lists, and the output.
    struct Run
    {
        Run(Merge& merge, std::uint32_t number);

        const Pair* next; // to be compared
        const Pair* end;
        Pair* kept; // after those that persist
        PairCursor persisted, others, woken;
        typename InRuns<Key>::Run began_out, asked_out;
        typename InRuns<Ended>::Run ended_out;
        typename InRuns<Pair>::Run others_out;
    };

    void merge_by_lists(Run& run) const;
    void merge_each(Run& run, Key limit) const;
    [[nodiscard]] bool persists(Run& run, const Pair& pair) const;
    void touched_only(Run& run, const Pair& pair) const;
    [[nodiscard]] bool either_has(const Pair& pair, std::uint32_t bits) const noexcept
    {
        return ((state_.objects[Index{pair.a}].state() | state_.objects[Index{pair.b}].state()) & bits) != 0;
    }
    [[nodiscard]] EndReason reason_of_ended(const Pair& pair) const noexcept
    {
        assert(!known_.only_moves || reason_of(state_, pair) == reason_if_only_moves);
        return known_.only_moves ? reason_if_only_moves : reason_of(state_, pair);
    }
    static std::span<const std::span<const Pair>> as_blocks(const std::span<const Pair>& pairs) noexcept
    {
        return {&pairs, pairs.empty() ? std::size_t{0} : std::size_t{1}};
    }

    const State<Dim, T>& state_;
    const Changes<Dim, T>& changes_;
    const Knowledge known_;
    const std::span<Pair> touching_;
    const Lists& last_;
    const std::span<const Pair> last_others_;
    const std::span<const Pair> old_pairs_;
    InRuns<Key>&began_, &asked_;
    InRuns<Ended>& ended_;
    InRuns<Pair>& others_;
    std::pmr::vector<std::uint32_t>& kept_of_run_;
    std::pmr::vector<Key>& first_of_run_; // looked up before any run moves its pairs; `no_key` after the last
};

template <int Dim, class T>
Merge<Dim, T>::Run::Run(Merge& merge, std::uint32_t number)
    : next(merge.touching_.data() + number * run_length),
      end(merge.touching_.data() + std::min(merge.touching_.size(), (number + 1) * run_length)),
      kept(merge.touching_.data() + number * run_length),
      persisted(merge.last_.persisted.blocks(), merge.first_of_run_[number]),
      others(as_blocks(merge.last_others_), merge.first_of_run_[number]),
      woken(as_blocks(merge.old_pairs_), merge.first_of_run_[number]),
      began_out(merge.began_, number),
      asked_out(merge.asked_, number),
      ended_out(merge.ended_, number),
      others_out(merge.others_, number)
{
}

template <int Dim, class T>
void Merge<Dim, T>::run(Lists& next)
{
    const std::size_t runs = std::max<std::size_t>(1, (touching_.size() + run_length - 1) / run_length);
    kept_of_run_.resize(runs);
    first_of_run_.assign(runs + 1, no_key);
    for (std::size_t run = 0; run < runs; ++run)
        first_of_run_[run] = run == 0 ? 0 : key_of(touching_[run * run_length]);
    const auto merge_run = [&](std::uint64_t number, std::uint64_t, Work) {
        Run run(*this, static_cast<std::uint32_t>(number));
        const Pair* const begin = run.kept;
        if (known_.lists_say_all()) merge_by_lists(run);
        merge_each(run, first_of_run_[number + 1]);
        kept_of_run_[number] = static_cast<std::uint32_t>(run.kept - begin);
        run.began_out.flush();
        run.asked_out.flush();
        run.ended_out.flush();
        run.others_out.flush();
    };
    process_items(runs, merge_run, {state_.executor_for(touching_.size()), 1});

    next.persisted.clear();
    PairBufferAccess persisted(next.persisted);
    persisted.reserve_blocks(runs);
    for (std::size_t run = 0; run < runs; ++run)
        persisted.append({touching_.data() + run * run_length, kept_of_run_[run]});
    others_.copy_to(next.others);
}

/// For the case that only the lists a pair is in matter: a loop without branches, since those between begin,
/// persist and end can't be predicted. Stops before the end of the old pairs.
template <int Dim, class T>
void Merge<Dim, T>::merge_by_lists(Run& run) const
{
    constexpr std::uint64_t most_steps = 128; // between tests for the end of a list
    constexpr std::ptrdiff_t stretch = 16;
    const Pair* next = run.next;
    Pair* kept = run.kept;
    while (next != run.end) {
        // If little happens, long stretches are unchanged.
        while (run.end - next >= stretch && run.persisted.key != no_key && run.persisted.left() >= stretch &&
               key_of(next[stretch - 1]) < run.others.key &&
               std::memcmp(next, run.persisted.at(), stretch * sizeof(Pair)) == 0) {
            if (kept != next) std::copy(next, next + stretch, kept);
            kept += stretch;
            next += stretch;
            run.persisted.skip_to(run.persisted.at() + stretch);
        }
        std::uint64_t steps = std::min(run.persisted.left(), run.others.left());
        steps = std::min({steps, static_cast<std::uint64_t>(run.end - next), most_steps});
        Key* const began_to = run.began_out.make_room(steps);
        Ended* const ended_to = run.ended_out.make_room(steps);
        Pair* const others_to = run.others_out.make_room(steps);
        std::size_t begin_count = 0, end_count = 0;
        const Pair *persisted_at = run.persisted.at(), *others_at = run.others.at();
        for (; steps != 0; --steps) {
            const Pair pair = *next;
            const Key persisted_key = key_of(*persisted_at), others_key = key_of(*others_at);
            const Key new_key = key_of(pair), old_key = std::min(persisted_key, others_key);
            const bool is = new_key <= old_key, was = old_key <= new_key;
            *kept = pair;
            kept += is & was;
            began_to[begin_count] = new_key;
            others_to[begin_count] = pair;
            begin_count += is & !was;
            ended_to[end_count] = {old_key, reason_if_only_moves};
            end_count += was & !is;
            next += is;
            persisted_at += was & (persisted_key == old_key);
            others_at += was & (others_key == old_key);
        }
        assert(std::all_of(ended_to, ended_to + end_count, [this](const Ended& each) {
            return reason_of_ended(pair_of(each.key)) == each.reason;
        }));
        run.began_out.take(begin_count);
        run.others_out.take(begin_count);
        run.ended_out.take(end_count);
        run.persisted.skip_to(persisted_at);
        run.others.skip_to(others_at);
    }
    run.next = next;
    run.kept = kept;
}

/// Merges pair by pair, up to the first pair of the next run.
template <int Dim, class T>
void Merge<Dim, T>::merge_each(Run& run, Key limit) const
{
    const bool both_means_persists = known_.both_means_persists();
    PairCursor persisted = run.persisted, others = run.others, woken = run.woken;
    const Pair* next = run.next;
    Pair* kept = run.kept;
    for (;;) {
        const Key other_key = std::min(others.key, woken.key);
        if (both_means_persists) // most pairs are unchanged
            for (; next != run.end && key_of(*next) == persisted.key && persisted.key < other_key;
                 persisted.next())
                *kept++ = *next++;
        const Key new_key = next != run.end ? key_of(*next) : no_key;
        const Key old_key = std::min(persisted.key, other_key);
        const Key key = std::min(new_key, old_key);
        if (key >= limit) break;
        const bool is = new_key == key, was = old_key == key;
        if (was) {
            if (persisted.key == key) persisted.next();
            if (others.key == key) others.next();
            if (woken.key == key) woken.next();
        }
        next += is;
        const Pair pair = pair_of(key);
        if (is && was) {
            if (persists(run, pair)) *kept++ = pair;
        } else if (is) {
            run.began_out.push(key);
            run.others_out.push(pair); // until the next update compares
        } else {
            touched_only(run, pair);
        }
    }
    run.kept = kept;
}

/// Whether a pair in both lists persists; otherwise puts it where it belongs.
template <int Dim, class T>
bool Merge<Dim, T>::persists(Run& run, const Pair& pair) const
{
    const Key key = key_of(pair);
    const bool changed = !known_.any_idle || either_has(pair, flag::written);
    if (changed && known_.any_again && changes_.is_again(pair)) {
        (known_.asks_again ? run.asked_out : run.began_out).push(key);
        run.others_out.push(pair); // as one that begins
        return false;
    }
    if (changed && known_.asks_again && either_has(pair, flag::refiltered)) run.asked_out.push(key);
    if (changed && (!known_.any_refused || !state_.refused.contains(key))) return true;
    run.others_out.push(pair);
    return false;
}

template <int Dim, class T>
void Merge<Dim, T>::touched_only(Run& run, const Pair& pair) const
{
    if (known_.all_changed || either_has(pair, flag::written)) {
        run.ended_out.push({key_of(pair), reason_of_ended(pair)});
        return;
    }
    // Two unchanged objects. They still touch; if both now rest or are parked, the pair is in no list.
    const auto is_listed = [&](std::uint32_t index) {
        return state_.objects[Index{index}].place() == Place::active;
    };
    if (is_listed(pair.a) || is_listed(pair.b)) run.others_out.push(pair);
}

template <int Dim, class T>
ObjectPair ids_of(const State<Dim, T>& state, Key key) noexcept
{
    const Pair pair = pair_of(key);
    return {state.id_of(Index{pair.a}), state.id_of(Index{pair.b})};
}

/// Computes a value for each of many keys, in parallel.
template <int Dim, class T, class KeyAt, class Set>
void for_each_pair(const State<Dim, T>& state, std::size_t count, const KeyAt& key_at, const Set& set)
{
    if (count == 0) return;
    const auto set_some = [&](std::uint64_t begin, std::uint64_t end, Work) {
        for (std::uint64_t k = begin; k < end; ++k) {
            if (k + fetch_ahead < end) state.ids.prefetch(pair_of(key_at(k + fetch_ahead)).b);
            set(k);
        }
    };
    process_items(count, set_some, {state.executor_for(count), run_length});
}

/// Calls `accept` for pairs that would begin, and again for some that persist, in ascending order of both
/// together. Returns those of the latter that it now refuses.
template <int Dim, class T>
std::span<const Key> ask(const State<Dim, T>& state, const Changes<Dim, T>& changes,
                         std::span<const Key> begin, std::span<const Key> again, Refusals& refusals,
                         std::pmr::vector<ObjectPair>& began, Arena& arena)
{
    auto& retracted = arena.list<Key>("pairs that accept ends");
    began.reserve(begin.size());
    while (!begin.empty() || !again.empty()) {
        const bool is_new = again.empty() || (!begin.empty() && begin.front() < again.front());
        std::span<const Key>& from = is_new ? begin : again;
        const Key key = from.front();
        from = from.subspan(1);
        const ObjectPair pair = ids_of(state, key);
        const bool was_refused = !is_new && refusals.has(key);
        if (state.options.accept(pair.a, pair.b)) {
            if (is_new || was_refused || changes.is_again(pair_of(key))) began.push_back(pair);
            if (was_refused) refusals.remove(key);
        } else if (!was_refused) {
            refusals.add(key);
            if (!is_new) retracted.push_back(key);
        }
    }
    return retracted;
}

/// Ends pairs that seemed to persist, because `accept` now refuses them.
template <int Dim, class T>
void retract(const Changes<Dim, T>& changes, std::span<const Key> retracted, std::pmr::vector<Ended>& ended,
             Lists& next, Arena& arena)
{
    for (const Key key : retracted) {
        ended.push_back({key, reason_of_accept});
        if (!changes.is_again(pair_of(key))) next.others.push_back(pair_of(key)); // else already there
    }
    sort_by_key(ended, arena.list<Ended>("pairs that end, in another order"),
                [](const Ended& each) { return each.key; });
    sort_pairs(next.others, arena.list<Pair>("other pairs, in another order"));
    auto& left = arena.list<Pair>("pairs that persist in spite of accept");
    for (const Pair& pair : next.persisted)
        if (!std::binary_search(retracted.begin(), retracted.end(), key_of(pair))) left.push_back(pair);
    next.persisted.clear();
    PairBufferAccess persisted(next.persisted);
    const std::span<Pair> memory = persisted.chunk(0, left.size()).first(left.size());
    std::copy(left.begin(), left.end(), memory.begin());
    persisted.append(memory);
}

} // namespace

template <int Dim, class T>
Refusals judge(State<Dim, T>& state, const Changes<Dim, T>& changes, const Entries<Dim, T>& entries,
               std::span<Pair> touching, std::span<const Pair> old_pairs, const Lists& last, Lists& next,
               Arena& arena)
{
    assert(std::adjacent_find(touching.begin(), touching.end(), std::greater_equal<>{}) == touching.end());
    Refusals refusals(state.refused, arena);
    next.began.clear();
    if (touching.empty() && old_pairs.empty() && last.persisted.empty() && last.others.empty()) {
        next.persisted.clear();
        next.others.clear();
        next.ended.clear();
        return refusals;
    }
    const bool asks = state.options.accept != nullptr;
    const Knowledge known = {
        .any_idle = entries.any_idle,
        .any_refused = !state.refused.empty(),
        .asks_again = asks,
        .any_again = changes.any_again(),
        .only_moves = entries.only_moves,
        .all_changed = !entries.any_idle && last.all_active,
        .any_woken = !old_pairs.empty(),
    };
    Merge<Dim, T> merge(state, changes, known, touching, last, old_pairs, arena);
    merge.run(next);
    auto& begin = arena.list<Key>("pairs that begin");
    auto& ended = arena.list<Ended>("pairs that end");
    merge.began().copy_to(begin);
    merge.ended().copy_to(ended);

    if (known.any_refused) { // the end of a refused pair is no event
        const auto was_refused = [&](const Ended& each) {
            if (!refusals.has(each.key)) return false;
            refusals.remove(each.key);
            return true;
        };
        ended.erase(std::remove_if(ended.begin(), ended.end(), was_refused), ended.end());
    }
    if (asks) {
        auto& again = arena.list<Key>("pairs about which accept is asked again");
        merge.asked().copy_to(again);
        const std::span<const Key> retracted = ask(state, changes, begin, again, refusals, next.began, arena);
        if (!retracted.empty()) retract(changes, retracted, ended, next, arena);
    } else {
        if (known.any_again && known.any_refused) // the snapshot's world had an `accept`
            for (const Key key : begin)
                if (refusals.has(key)) refusals.remove(key);
        next.began.resize(begin.size());
        for_each_pair(
            state, begin.size(), [&](std::size_t k) { return begin[k]; },
            [&](std::size_t k) { next.began[k] = ids_of(state, begin[k]); });
    }
    next.ended.resize(ended.size());
    for_each_pair(
        state, ended.size(), [&](std::size_t k) { return ended[k].key; },
        [&](std::size_t k) {
            const ObjectPair pair = ids_of(state, ended[k].key);
            next.ended[k] = {pair.a, pair.b, ended[k].reason};
        });
    refusals.make_room();
    return refusals;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template Refusals judge(State<Dim, T>&, const Changes<Dim, T>&, const Entries<Dim, T>&, std::span<Pair>, \
                            std::span<const Pair>, const Lists&, Lists&, Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
