// SPDX-License-Identifier: MIT
#include <cstring>
#include <string>

#include "c_api/results.hpp"
#include "c_api/world.hpp"

namespace jostle::c_api {
namespace {

/// A switch without a default, so that the compiler names this place where a kind is added.
constexpr jostle_draw_kind drawn_as(DrawKind kind)
{
    switch (kind) {
    case DrawKind::active:
        return JOSTLE_DRAW_ACTIVE;
    case DrawKind::resting:
        return JOSTLE_DRAW_RESTING;
    case DrawKind::disabled:
        return JOSTLE_DRAW_DISABLED;
    case DrawKind::began:
        return JOSTLE_DRAW_BEGAN;
    case DrawKind::persisted:
        return JOSTLE_DRAW_PERSISTED;
    case DrawKind::ended:
        return JOSTLE_DRAW_ENDED;
    }
    return -1;
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_world_new(jostle_space space, const jostle_world_options* options, jostle_world** out,
                               jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<WorldContent>(space, read_options(options, "jostle_world_options")));
    });
}

jostle_status jostle_world_update(jostle_world* world, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([](auto& typed) { typed.update(); });
        content.changed();
    });
}
jostle_status jostle_world_apply(jostle_world* world, jostle_error* error)
{
    return guarded(error, [&] { open(world).on([](auto& typed) { typed.apply(); }); });
}
jostle_status jostle_world_update_moves(jostle_world* world, const jostle_id* ids, const jostle_boxes* boxes,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        content.on([&]<int Dim, Coordinate T>(World<Dim, T>& typed) {
            const BoxView<Dim, T> all = view<Dim, T>(boxes, "boxes");
            typed.update(Ids(ids, all.size()), all);
        });
        content.changed();
    });
}

// --- Snapshots ---

jostle_status jostle_world_save(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](const auto& typed) { into.bytes = typed.save(); });
        into.show_bytes();
    });
}
jostle_status jostle_world_restore(jostle_world* world, const void* snapshot, uint64_t size,
                                   jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        const auto* const bytes = wanted_array_of<std::byte>(snapshot, size, "snapshot");
        content.on([&](auto& typed) { typed.restore(std::span(bytes, static_cast<std::size_t>(size))); });
        content.changed();
    });
}
jostle_status jostle_world_save_base(jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](auto& typed) { into.bytes = typed.save_base(); });
        into.show_bytes();
    });
}
jostle_status jostle_world_save_changes(jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        content.on([&](auto& typed) { typed.save_changes(into.bytes); });
        into.show_bytes();
    });
}
jostle_status jostle_world_restore_changes(jostle_world* world, const void* changes, uint64_t size,
                                           jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        const auto* const bytes = wanted_array_of<std::byte>(changes, size, "changes");
        content.on(
            [&](auto& typed) { typed.restore_changes(std::span(bytes, static_cast<std::size_t>(size))); });
        content.changed();
    });
}
jostle_status jostle_world_fork(const jostle_world* world, jostle_world** out, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        wanted(out, "out");
        hand_out(out, std::make_unique<WorldContent>(content));
    });
}
jostle_status jostle_world_follow(jostle_world* world, const jostle_world* other, jostle_error* error)
{
    return guarded(error, [&] {
        WorldContent& content = open(world);
        const WorldContent& of = open(other);
        if (content.space != of.space) refuse("the two worlds are of different spaces");
        content.on([&](auto& typed) { typed.follow(std::get<std::decay_t<decltype(typed)>>(of.held)); });
        content.changed();
    });
}

// --- Seeing inside ---

jostle_status jostle_world_stats_read(const jostle_world* world, jostle_world_stats* stats,
                                      jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&](const auto& typed) {
            const WorldStats& s = typed.stats();
            write_stats(
                stats,
                jostle_world_stats{0,           s.objects,    s.resting,         s.active,   s.disabled,
                                   s.refused,   s.commands,   s.dropped,         s.changed,  s.woken,
                                   s.settled,   s.candidates, s.false_positives, s.listed,   s.began,
                                   s.persisted, s.ended,      s.bytes_reserved,  s.us_total, s.us_apply,
                                   s.us_active, s.us_resting, s.us_events,       s.us_index, s.contested},
                "jostle_world_stats");
        });
    });
}
jostle_status jostle_world_explain(const jostle_world* world, jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        ResultsContent& into = open(results);
        into.begin();
        std::string text;
        content.on([&](const auto& typed) { text = typed.explain(); });
        into.bytes.resize(text.size() + 1);
        std::memcpy(into.bytes.data(), text.c_str(), text.size() + 1);
        into.byte_count = text.size();
        into.holds = ResultsContent::Holds::bytes;
    });
}
jostle_status jostle_world_draw(const jostle_world* world, jostle_draw_function box,
                                jostle_draw_function line, void* context, jostle_error* error)
{
    return guarded(error, [&] {
        const WorldContent& content = open(world);
        content.on([&]<int Dim, Coordinate T>(const World<Dim, T>& typed) {
            const auto draw_box = [&](const Aabb<Dim, T>& drawn, DrawKind kind) {
                if (box != nullptr) agreed(box(context, drawn.lo.data(), drawn_as(kind)));
            };
            const auto draw_line = [&](const Vec<Dim, T>& from, const Vec<Dim, T>& to, DrawKind kind) {
                const Aabb<Dim, T> both{from, to};
                agreed(line(context, both.lo.data(), drawn_as(kind)));
            };
            if (line != nullptr)
                typed.draw(draw_box, draw_line);
            else
                typed.draw(draw_box);
        });
    });
}

} // extern "C"
