// SPDX-License-Identifier: MIT
#include "jostle/pair_slots.hpp"
#include "c_api/results.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {

class PairSlotsContent final : public Content
{
  public:
    PairSlots slots;
    std::vector<ObjectPair> began; // as they were given last
    std::vector<EndedPair> ended;
};

template <>
struct Behind<jostle_pair_slots> : Kind<PairSlotsContent, 0x12>
{
    static constexpr const char* name = "jostle_pair_slots";
};

} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_pair_slots_new(jostle_pair_slots** out, jostle_error* error)
{
    return guarded(error, [&] { hand_out(out, std::make_unique<PairSlotsContent>()); });
}
jostle_status jostle_pair_slots_update(jostle_pair_slots* slots, const jostle_id_pair* began,
                                       uint64_t began_count, const jostle_ended_pair* ended,
                                       uint64_t ended_count, jostle_error* error)
{
    return guarded(error, [&] {
        PairSlotsContent& content = open(slots);
        wanted_array(began, began_count, "began");
        wanted_array(ended, ended_count, "ended");
        content.began.clear();
        content.ended.clear();
        for (std::uint64_t k = 0; k < began_count; ++k)
            content.began.push_back({from_c(began[k].a), from_c(began[k].b)});
        for (std::uint64_t k = 0; k < ended_count; ++k) // why doesn't matter
            content.ended.push_back({from_c(ended[k].a), from_c(ended[k].b), EndReason::moved_apart});
        content.slots.update(content.began, content.ended);
    });
}
jostle_status jostle_pair_slots_lists(const jostle_pair_slots* slots, const uint32_t** began,
                                      uint64_t* began_count, const uint32_t** ended, uint64_t* ended_count,
                                      uint32_t* end, jostle_error* error)
{
    return guarded(error, [&] {
        const PairSlots& known = open(slots).slots;
        wanted(began, "began") = known.began_slots().data();
        wanted(began_count, "began_count") = known.began_slots().size();
        wanted(ended, "ended") = known.ended_slots().data();
        wanted(ended_count, "ended_count") = known.ended_slots().size();
        wanted(end, "end") = known.end();
    });
}
jostle_status jostle_pair_slots_find(const jostle_pair_slots* slots, const jostle_pair* pairs, uint64_t count,
                                     uint32_t* found, jostle_error* error)
{
    return guarded(error, [&] {
        const PairSlots& known = open(slots).slots;
        wanted_array(pairs, count, "pairs");
        wanted_array(found, count, "found");
        for (std::uint64_t k = 0; k < count; ++k)
            found[k] = known.slot_of(pairs[k].a, pairs[k].b);
    });
}
jostle_status jostle_pair_slots_save(const jostle_pair_slots* slots, jostle_results* results,
                                     jostle_error* error)
{
    return guarded(error, [&] {
        const PairSlots& known = open(slots).slots;
        ResultsContent& into = open(results);
        into.begin();
        into.bytes = known.save();
        into.show_bytes();
    });
}
jostle_status jostle_pair_slots_restore(jostle_pair_slots* slots, const void* bytes, uint64_t size,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        PairSlots& known = open(slots).slots;
        const auto* const given = wanted_array_of<std::byte>(bytes, size, "bytes");
        known.restore(std::span(given, static_cast<std::size_t>(size)));
    });
}

} // extern "C"
