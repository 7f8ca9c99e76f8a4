// SPDX-License-Identifier: MIT
#include <functional>

#include "c_api/queries.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

/// A switch without a default, so that the compiler names this place where a reason is added.
constexpr jostle_end_reason reason_to_c(EndReason reason)
{
    switch (reason) {
    case EndReason::moved_apart:
        return JOSTLE_MOVED_APART;
    case EndReason::removed:
        return JOSTLE_REMOVED;
    case EndReason::disabled:
        return JOSTLE_DISABLED;
    case EndReason::filtered:
        return JOSTLE_FILTERED;
    }
    return -1;
}

/// Calls list() unless `kept` has been listed since the last update. Several threads may ask at a time.
template <class Kept, class F>
void list_once(const WorldContent& content, Kept& kept, F&& list)
{
    const std::lock_guard lock(content.listing);
    if (kept.listed) return;
    list();
    kept.listed = true;
}

/// of(world) is one of its lists of pairs, to_item(pair) a pair as C sees it.
template <class Item, class Of, class ToItem>
void list_pairs(const jostle_world* world, Listed<Item> UpdateLists::* which, const Item** pairs,
                std::uint64_t* count, Of&& of, ToItem&& to_item)
{
    const WorldContent& content = open(world);
    wanted(pairs, "pairs");
    wanted(count, "count");
    Listed<Item>& kept = content.lists.*which;
    list_once(content, kept, [&] {
        content.on([&](const auto& typed) {
            kept.items.clear();
            kept.items.reserve(of(typed).size());
            for (const auto& pair : of(typed))
                kept.items.push_back(to_item(pair));
        });
    });
    *pairs = kept.items.data();
    *count = kept.items.size();
}
/// of(world) is one of its buffers of pairs.
template <class Of>
void list_pairs(const jostle_world* world, ListedBlocks UpdateLists::* which, jostle_blocks* pairs, Of&& of)
{
    const WorldContent& content = open(world);
    wanted(pairs, "pairs");
    ListedBlocks& kept = content.lists.*which;
    list_once(content, kept, [&] {
        content.on([&](const auto& typed) {
            const PairBuffer& found = of(typed);
            kept.blocks = list_blocks<Pair>(found.blocks(), found.size(), kept.table);
        });
    });
    *pairs = kept.blocks;
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_began(const jostle_world* world, const jostle_id_pair** pairs, uint64_t* count,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        list_pairs(
            world, &UpdateLists::began, pairs, count, [](const auto& typed) { return typed.began(); },
            [](const ObjectPair& pair) { return jostle_id_pair{to_c(pair.a), to_c(pair.b)}; });
    });
}
jostle_status jostle_world_ended(const jostle_world* world, const jostle_ended_pair** pairs, uint64_t* count,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        list_pairs(
            world, &UpdateLists::ended, pairs, count, [](const auto& typed) { return typed.ended(); },
            [](const EndedPair& pair) {
                return jostle_ended_pair{to_c(pair.a), to_c(pair.b), reason_to_c(pair.reason), 0};
            });
    });
}
jostle_status jostle_world_persisted(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        list_pairs(world, &UpdateLists::persisted, pairs,
                   [](const auto& typed) -> const PairBuffer& { return typed.persisted(); });
    });
}
jostle_status jostle_world_changed_pairs(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        list_pairs(world, &UpdateLists::changed, pairs,
                   [](const auto& typed) -> const PairBuffer& { return typed.changed_pairs(); });
    });
}
jostle_status jostle_world_pairs(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](const auto& typed) { into.take(typed.pairs(), content.kept.memory); });
    });
}

jostle_status jostle_world_touching(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                    jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        into.begin();
        // For neighbours of neighbours, callers pass ids that lie in the lists to be filled.
        Lists before;
        const std::less<const std::uint64_t*> less;
        const std::vector<std::uint64_t>& listed = into.lists.ids;
        if (!less(ids, listed.data()) && less(ids, listed.data() + listed.size()))
            std::swap(before, into.lists);
        into.lists.start();
        auto& others = into.memory.of<std::vector<ObjectId>>();
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t) {
            typed.touching(id, others);
            append(into, std::span<const ObjectId>(others), false);
        });
        into.holds = ResultsContent::Holds::lists;
    });
}

jostle_status jostle_world_visit_pairs(const jostle_world* world, jostle_visit_pair_function visit,
                                       void* context, int32_t* finished, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted_function(visit, "visit");
        wanted(finished, "finished");
        const auto hand_over = [&](ObjectId a, ObjectId b) {
            return agreed(visit(context, to_c(a), to_c(b)));
        };
        content.on([&](const auto& typed) { *finished = typed.pairs(hand_over) ? 1 : 0; });
    });
}

} // extern "C"
