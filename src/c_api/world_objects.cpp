// SPDX-License-Identifier: MIT
#include "c_api/world.hpp"

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_index_end(const jostle_world* world, uint32_t* end, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(end, "end");
        content.on([&](const auto& typed) { *end = typed.index_end(); });
    });
}
jostle_status jostle_world_contains(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                    uint8_t* contains, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(contains, count, "contains");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            contains[i] = typed.contains(id) ? 1 : 0;
        });
    });
}
jostle_status jostle_world_ids(const jostle_world* world, const uint32_t* indices, uint64_t count,
                               jostle_id* ids, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted_array(indices, count, "indices");
        wanted_array(ids, count, "ids");
        content.on([&](const auto& typed) {
            for (std::uint64_t i = 0; i < count; ++i)
                ids[i] = to_c(typed.id(indices[i]));
        });
    });
}
jostle_status jostle_world_boxes(const jostle_world* world, const jostle_id* ids, uint64_t count, void* boxes,
                                 jostle_error* error)
{
    return guarded(error, [&] {
        read_each(world, ids, count,
                  [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, ObjectId id, std::size_t i) {
                      wanted_array_of<Aabb<Dim, T>>(boxes, count, "boxes")[i] = typed.box(id);
                  });
    });
}
jostle_status jostle_world_bounds(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                  void* boxes, jostle_error* error)
{
    return guarded(error, [&] {
        read_each(world, ids, count,
                  [&]<int Dim, Coordinate T>(const World<Dim, T>& typed, ObjectId id, std::size_t i) {
                      wanted_array_of<Aabb<Dim, T>>(boxes, count, "boxes")[i] = typed.bounds(id);
                  });
    });
}
jostle_status jostle_world_filters(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   jostle_object_filter* filters, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(filters, count, "filters");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            const ObjectFilter filter = typed.filter(id);
            filters[i] = {filter.category, filter.mask, filter.owner, filter.is_static ? 1 : 0};
        });
    });
}
jostle_status jostle_world_enabled(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   uint8_t* enabled, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(enabled, count, "enabled");
        read_each(world, ids, count, [&](const auto& typed, ObjectId id, std::size_t i) {
            enabled[i] = typed.enabled(id) ? 1 : 0;
        });
    });
}
jostle_status jostle_world_margins(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                   double* margins, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(margins, count, "margins");
        read_each(world, ids, count,
                  [&](const auto& typed, ObjectId id, std::size_t i) { margins[i] = typed.margin(id); });
    });
}
jostle_status jostle_world_user_data(const jostle_world* world, const jostle_id* ids, uint64_t count,
                                     uint64_t* data, jostle_error* error)
{
    return guarded(error, [&] {
        wanted_array(data, count, "data");
        read_each(world, ids, count,
                  [&](const auto& typed, ObjectId id, std::size_t i) { data[i] = typed.user_data(id); });
    });
}

} // extern "C"
