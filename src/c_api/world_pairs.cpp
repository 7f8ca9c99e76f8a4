// SPDX-License-Identifier: MIT
#include "c_api/questions.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

static_assert(JOSTLE_FILTERED == static_cast<int>(EndReason::filtered));

/// list(world) is one of its lists of slots.
template <class F>
void list_slots(const jostle_world* world, const std::uint32_t** slots, std::uint64_t* count, F&& list)
{
    const WorldContent& content = open(world);
    wanted(slots, "slots");
    wanted(count, "count");
    content.on([&](const auto& typed) {
        const std::span<const std::uint32_t> listed = list(typed);
        *slots = listed.data();
        *count = listed.size();
    });
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
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        wanted(count, "count");
        const std::lock_guard lock(content.listing);
        if (!content.began_listed)
            content.on([&](const auto& typed) {
                content.began.clear();
                content.began.reserve(typed.began().size());
                for (const ObjectPair& pair : typed.began())
                    content.began.push_back({to_c(pair.a), to_c(pair.b)});
            });
        content.began_listed = true;
        *pairs = content.began.data();
        *count = content.began.size();
    });
}
jostle_status jostle_world_began_slots(const jostle_world* world, const uint32_t** slots, uint64_t* count,
                                       jostle_error* error)
{
    return guarded(error, [&] {
        list_slots(world, slots, count, [](const auto& typed) { return typed.began_slots(); });
    });
}
jostle_status jostle_world_ended_slots(const jostle_world* world, const uint32_t** slots, uint64_t* count,
                                       jostle_error* error)
{
    return guarded(error, [&] {
        list_slots(world, slots, count, [](const auto& typed) { return typed.ended_slots(); });
    });
}
jostle_status jostle_world_changed_slots(const jostle_world* world, const uint32_t** slots, uint64_t* count,
                                         jostle_error* error)
{
    return guarded(error, [&] {
        list_slots(world, slots, count, [](const auto& typed) { return typed.changed_slots(); });
    });
}
jostle_status jostle_world_pair_slots(const jostle_world* world, const jostle_pair* pairs, uint64_t count,
                                      uint32_t* slots, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted_array(pairs, count, "pairs");
        wanted_array(slots, count, "slots");
        content.on([&](const auto& typed) {
            for (std::uint64_t i = 0; i < count; ++i)
                slots[i] = typed.pair_slot(pairs[i].a, pairs[i].b);
        });
    });
}
jostle_status jostle_world_pair_slots_end(const jostle_world* world, uint32_t* end, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(end, "end");
        content.on([&](const auto& typed) { *end = typed.pair_slots_end(); });
    });
}
jostle_status jostle_world_ended(const jostle_world* world, const jostle_ended_pair** pairs, uint64_t* count,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        wanted(count, "count");
        const std::lock_guard lock(content.listing);
        if (!content.ended_listed)
            content.on([&](const auto& typed) {
                content.ended.clear();
                content.ended.reserve(typed.ended().size());
                for (const EndedPair& pair : typed.ended())
                    content.ended.push_back(
                        {to_c(pair.a), to_c(pair.b), static_cast<jostle_end_reason>(pair.reason), 0});
            });
        content.ended_listed = true;
        *pairs = content.ended.data();
        *count = content.ended.size();
    });
}
jostle_status jostle_world_persisted(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        const std::lock_guard lock(content.listing);
        if (!content.persisted_listed)
            content.on([&](const auto& typed) {
                const PairBuffer& found = typed.persisted();
                content.persisted = list_blocks<Pair>(found.blocks(), found.size(), content.persisted_table);
            });
        content.persisted_listed = true;
        *pairs = content.persisted;
    });
}
jostle_status jostle_world_changed_pairs(const jostle_world* world, jostle_blocks* pairs, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(pairs, "pairs");
        const std::lock_guard lock(content.listing);
        if (!content.changed_listed)
            content.on([&](const auto& typed) {
                const PairBuffer& found = typed.changed_pairs();
                content.changed_pairs =
                    list_blocks<Pair>(found.blocks(), found.size(), content.changed_table);
            });
        content.changed_listed = true;
        *pairs = content.changed_pairs;
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
        start(into.lists, false);
        std::vector<ObjectId> others;
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t) {
            typed.touching(id, others);
            append(into.lists, std::span<const ObjectId>(others), false, to_c);
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
