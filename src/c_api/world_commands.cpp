// SPDX-License-Identifier: MIT
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

ObjectFilter filter_of(const jostle_object_filter& filter) noexcept
{
    return {filter.category, filter.mask, filter.owner, filter.is_static != 0};
}

template <class T>
ObjectOptions<T> read_object_options(const jostle_object_options* options)
{
    const jostle_object_options given = read_options(options, "jostle_object_options");
    ObjectOptions<T> wish;
    if (given.filter != nullptr) wish.filter = filter_of(*given.filter);
    wish.margin = static_cast<T>(given.margin);
    wish.enabled = given.disabled == 0;
    wish.user_data = given.user_data;
    return wish;
}

/// inside(options) with the caller's: one for all objects, or one for each.
template <class T, class F>
void with_object_options(const jostle_object_options* options, std::size_t objects, WorkingMemories& memories,
                         F&& inside)
{
    const std::uint64_t count = read_options(options, "jostle_object_options").count;
    if (count <= 1) return inside(read_object_options<T>(options));
    if (count != objects)
        refuse("there are " + std::to_string(objects) + " boxes and " + std::to_string(count) +
                   " options: give none, one, or one for each",
               JOSTLE_SIZE_MISMATCH);
    WorkingMemories::Lent memory(memories);
    auto& of_each = memory.of<std::vector<ObjectOptions<T>>>();
    of_each.clear();
    for (std::size_t i = 0; i < objects; ++i)
        of_each.push_back(read_object_options<T>(options_number(options, i, "jostle_object_options")));
    inside(of_each);
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_add(jostle_world* world, const jostle_boxes* boxes,
                               const jostle_object_options* options, jostle_id* ids, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            wanted_array(ids, all.size(), "ids");
            with_object_options<T>(options, all.size(), content.memories, [&](const auto& wish) {
                if constexpr (same_in_memory) {
                    typed.add(all, std::span(reinterpret_cast<ObjectId*>(ids), all.size()), wish);
                } else {
                    std::vector<ObjectId> added(all.size());
                    typed.add(all, added, wish);
                    for (std::size_t i = 0; i < added.size(); ++i)
                        ids[i] = to_c(added[i]);
                }
            });
        });
    });
}
jostle_status jostle_world_remove(jostle_world* world, const jostle_id* ids, uint64_t count,
                                  jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) { typed.remove(std::span<const ObjectId>(Ids(ids, count))); });
    });
}
jostle_status jostle_world_report_again(jostle_world* world, const jostle_id* ids, const jostle_id* others,
                                        uint64_t count, jostle_error* error)
{
    return guarded(error, [&] {
        const Ids objects(ids, count);
        open(world).on([&](auto& typed) {
            if (others == nullptr)
                return for_each_object(objects.size(),
                                       [&](std::size_t i) { typed.report_again(objects[i]); });
            const Ids second(others, count);
            for_each_object(objects.size(),
                            [&](std::size_t i) { typed.report_again(objects[i], second[i]); });
        });
    });
}
jostle_status jostle_world_move(jostle_world* world, const jostle_id* ids, const jostle_boxes* boxes,
                                const void* displacements, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            const Ids moved(ids, all.size());
            if (displacements == nullptr) {
                typed.move(moved, all, sequence);
                return;
            }
            const auto* const by = wanted_array_of<Vec<Dim, T>>(displacements, all.size(), "displacements");
            for_each_object(all.size(),
                            [&](std::size_t i) { typed.move(moved[i], all[i], by[i], sequence); });
        });
    });
}
jostle_status jostle_world_resize(jostle_world* world, const jostle_id* ids, uint64_t count,
                                  const void* sizes, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const Ids resized(ids, count);
            const auto* const all = wanted_array_of<Vec<Dim, T>>(sizes, count, "sizes");
            for_each_object(resized.size(),
                            [&](std::size_t i) { typed.resize(resized[i], all[i], sequence); });
        });
    });
}
jostle_status jostle_world_set_filter(jostle_world* world, const jostle_id* ids, uint64_t count,
                                      const jostle_object_filter* filters, uint32_t sequence,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) {
            const Ids of(ids, count);
            wanted_array(filters, count, "filters");
            for_each_object(of.size(),
                            [&](std::size_t i) { typed.set_filter(of[i], filter_of(filters[i]), sequence); });
        });
    });
}
jostle_status jostle_world_set_margin(jostle_world* world, const jostle_id* ids, uint64_t count,
                                      const double* margins, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const Ids of(ids, count);
            wanted_array(margins, count, "margins");
            for_each_object(of.size(), [&](std::size_t i) {
                typed.set_margin(of[i], static_cast<T>(margins[i]), sequence);
            });
        });
    });
}
jostle_status jostle_world_set_enabled(jostle_world* world, const jostle_id* ids, uint64_t count,
                                       const uint8_t* enabled, uint32_t sequence, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) {
            const Ids of(ids, count);
            wanted_array(enabled, count, "enabled");
            for_each_object(of.size(),
                            [&](std::size_t i) { typed.set_enabled(of[i], enabled[i] != 0, sequence); });
        });
    });
}

jostle_status jostle_world_set_user_data(jostle_world* world, const jostle_id* ids, uint64_t count,
                                         const uint64_t* data, jostle_error* error)
{
    return guarded(error, [&] {
        open(world).on([&](auto& typed) {
            const Ids of(ids, count);
            wanted_array(data, count, "data");
            for_each_object(of.size(), [&](std::size_t i) { typed.set_user_data(of[i], data[i]); });
        });
    });
}

} // extern "C"
