// SPDX-License-Identifier: MIT
// What every WebAssembly module exports beside the C interface: callbacks into JavaScript, whose `context` is
// the number of a function in callbacks.js.

#include <cstdint>

#include "extras/js/module.hpp"

extern "C" {
std::int32_t jostle_js_accept_pair(std::uint32_t function, std::uint32_t a, std::uint32_t b);
std::int32_t jostle_js_accept_scene_pair(std::uint32_t function, std::uint32_t scene, std::uint32_t a,
                                         std::uint32_t b);
std::int32_t jostle_js_take_pairs(std::uint32_t function, const jostle_pair* pairs, std::uint32_t count);
std::int32_t jostle_js_accept_answer(std::uint32_t function, std::uint32_t query, std::uint64_t id);
std::int32_t jostle_js_accept_objects(std::uint32_t function, jostle_id a, jostle_id b);
std::int32_t jostle_js_visit_answer(std::uint32_t function, std::uint64_t id, double at, double* bound);
}

namespace {

std::uint32_t number_of(const void* context)
{
    return static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(context));
}

std::int32_t accept_pair(void* context, std::uint32_t a, std::uint32_t b)
{
    return jostle_js_accept_pair(number_of(context), a, b);
}
std::int32_t accept_scene_pair(void* context, std::uint64_t scene, std::uint32_t a, std::uint32_t b)
{
    return jostle_js_accept_scene_pair(number_of(context), static_cast<std::uint32_t>(scene), a, b);
}
std::int32_t take_pairs(void* context, const jostle_pair* pairs, std::uint64_t count, std::uint64_t,
                        std::uint64_t)
{
    return jostle_js_take_pairs(number_of(context), pairs, static_cast<std::uint32_t>(count));
}
std::int32_t accept_answer(void* context, std::uint32_t query, std::uint64_t id)
{
    return jostle_js_accept_answer(number_of(context), query, id);
}
std::int32_t accept_objects(void* context, jostle_id a, jostle_id b)
{
    return jostle_js_accept_objects(number_of(context), a, b);
}

std::int32_t visit_answer(void* context, std::uint64_t id, double at, const void*, double* bound)
{
    return jostle_js_visit_answer(number_of(context), id, at, bound);
}

} // namespace

JOSTLE_JS jostle_accept_pair_function jostle_js_accept_pair_pointer()
{
    return accept_pair;
}
JOSTLE_JS jostle_accept_scene_pair_function jostle_js_accept_scene_pair_pointer()
{
    return accept_scene_pair;
}
JOSTLE_JS jostle_sink_function jostle_js_take_pairs_pointer()
{
    return take_pairs;
}
JOSTLE_JS jostle_accept_answer_function jostle_js_accept_answer_pointer()
{
    return accept_answer;
}
JOSTLE_JS jostle_visit_answer_function jostle_js_visit_answer_pointer()
{
    return visit_answer;
}
JOSTLE_JS jostle_accept_object_pair_function jostle_js_accept_objects_pointer()
{
    return accept_objects;
}
