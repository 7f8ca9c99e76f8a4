// SPDX-License-Identifier: MIT
#pragma once

// The first stage of an update: what was queued is applied to the objects. They keep what they were.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstring>
#include <tuple>

#include "jostle/process.hpp"
#include "validate.hpp"
#include "world/sort_keys.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
void check_box(const Aabb<Dim, T>& box, ObjectId id)
{
    for (int d = 0; d < Dim; ++d)
        if (!(box.lo[d] <= box.hi[d])) throw_bad_box(box, id.index, "of object ");
}

} // namespace world

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::prefetch(std::uint32_t index) const noexcept
{
    if (index < objects.capacity()) {
        objects[index].prefetch_state();
        objects[index].prefetch_boxes();
    }
}

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::touch(ObjectId id)
{
    if (!ids.is_good(id) || !objects[id.index].has(world::flag::alive)) {
        ++next_stats.dropped;
        return false;
    }
    const Object object = objects[id.index];
    if (!object.has(world::flag::touched)) {
        changed.push_back(id.index);
        object.keep_box();
        if (!one_lane) writer[id.index] = current_lane;
    } else if (!one_lane && writer[id.index] != current_lane) {
        contest(object, id.index);
    }
    return true;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::contest(Object object, std::uint32_t index)
{
    if (object.has(world::flag::contested)) return;
    contested.push_back(index);
    object.set(world::flag::contested);
}

template <int Dim, Coordinate T>
auto World<Dim, T>::Implementation::shape_of(Object object, std::uint32_t index) -> Shape&
{
    shapes.grow(std::size_t{index} + 1);
    Shape& shape = shapes[index];
    const bool had = object.has(world::flag::has_shape);
    if (!object.has(world::flag::shape_saved)) {
        old_shapes.push_back({index, had, shape});
        object.set(world::flag::shape_saved);
    }
    if (!had) {
        shape = {object.now(), {}, 0};
        object.set(world::flag::has_shape);
    }
    return shape;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::set_box(Object object, std::uint32_t index, const Box& box)
{
    if (!object.has(world::flag::has_shape)) {
        object.now() = box;
        return;
    }
    Shape& shape = shape_of(object, index);
    shape.box = box;
    for (T& each : shape.displacement)
        each = 0;
    object.now() = shape.bounds();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::resize_box(Object object, std::uint32_t index, const Box& size)
{
    const bool shaped = object.has(world::flag::has_shape);
    Box box = shaped ? shapes[index].box : object.now();
    for (int d = 0; d < Dim; ++d) {
        const T centre = box.lo[d] + (box.hi[d] - box.lo[d]) / 2, half = size.lo[d] / 2;
        if (!(centre - half <= centre + half)) continue; // infinite bounds have no centre: they stay
        box.lo[d] = centre - half;
        box.hi[d] = centre + half;
    }
    if (!shaped) {
        object.now() = box;
        return;
    }
    Shape& shape = shape_of(object, index);
    shape.box = box;
    object.now() = shape.bounds();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::set_filter(Object object, std::uint32_t index, const ObjectFilter& filter)
{
    if (object.place() != world::Place::none && !object.has(world::flag::refiltered)) {
        if (object.filter() == filter && !options.accept) return;
        old_filters.push_back({index, object.filter()});
        object.set(world::flag::refiltered);
    }
    object.set_filter(filter);
    if (options.accept) object.set(world::flag::asked);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::apply_command(const Command& command)
{
    if (!touch(command.id)) return;
    const std::uint32_t index = command.id.index;
    const Object object = objects[index];
    if (command.sequence != 0) contest(object, index);
    switch (command.kind) {
    case world::CommandKind::remove:
        object.set(world::flag::alive, false);
        break;
    case world::CommandKind::move:
        set_box(object, index, command.box);
        break;
    case world::CommandKind::sweep: {
        Shape& shape = shape_of(object, index);
        std::copy_n(command.box.lo, Dim, shape.displacement);
        object.now() = shape.bounds();
        break;
    }
    case world::CommandKind::resize:
        resize_box(object, index, command.box);
        break;
    case world::CommandKind::filter:
        set_filter(object, index, command.filter);
        break;
    case world::CommandKind::margin: {
        Shape& shape = shape_of(object, index);
        shape.margin = margin + command.box.lo[0];
        object.now() = shape.bounds();
        break;
    }
    case world::CommandKind::enable:
    case world::CommandKind::disable:
        object.set(world::flag::enabled, command.kind == world::CommandKind::enable);
        break;
    }
}

/// The object as it was, or as it was added.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::reset(Object object, std::uint32_t index) noexcept
{
    const world::Place place = object.place();
    object.now() = object.before();
    object.set(world::flag::enabled, place != world::Place::disabled);
    object.set(world::flag::alive, place != world::Place::none);
    // Sorted as far as `settle_contests` found them; it adds few.
    const auto find = [index](const auto& saved, std::size_t sorted) {
        const auto middle = saved.begin() + static_cast<std::ptrdiff_t>(sorted);
        const auto here = std::lower_bound(saved.begin(), middle, index,
                                           [](const auto& old, std::uint32_t i) { return old.index < i; });
        if (here != middle && here->index == index) return here;
        return std::find_if(middle, saved.end(), [index](const auto& old) { return old.index == index; });
    };
    if (object.has(world::flag::refiltered)) object.set_filter(find(old_filters, sorted_old_filters)->filter);
    if (object.has(world::flag::shape_saved)) {
        const auto old = find(old_shapes, sorted_old_shapes);
        object.set(world::flag::has_shape, old->had_shape);
        shapes[index] = old->shape;
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::add_object(const Addition& addition)
{
    const std::uint32_t index = addition.id.index;
    const Object object = objects[index];
    if (!object.has(world::flag::touched)) changed.push_back(index);
    object.set_state(static_cast<std::uint32_t>(world::Place::none) | world::flag::alive |
                     (object.state() & world::flag::transient) | world::flag::touched);
    object.set(world::flag::enabled, addition.options.enabled);
    object.now() = object.before() = addition.box;
    object.set_filter(addition.options.filter);
    if (const T own = margin + addition.options.margin; own != 0) {
        Shape& shape = shape_of(object, index);
        shape.margin = own;
        object.now() = shape.bounds();
    }
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::apply(std::span<const ObjectId> move_ids, const Boxes& boxes)
{
    objects.grow(ids.end());
    if (class_of.size() < objects.capacity()) class_of.resize(objects.capacity());
    if (rested_at.size() < objects.capacity()) rested_at.resize(objects.capacity());
    hoods.make_room(objects.capacity());
    // The lanes in use, the one of the calling thread with the moves given to update() as its last.
    const std::thread::id me = std::this_thread::get_id();
    std::uint32_t lanes = 0, number = 0, own_lane = 0;
    for (const Lane* lane = queues.first(); lane != nullptr; lane = lane->next) {
        ++number;
        const bool own = lane->owner.load(std::memory_order_relaxed) == me;
        if (own) own_lane = number;
        if (!lane->taken_commands.empty() || (own && !move_ids.empty())) ++lanes;
        next_stats.commands += lane->taken_commands.size() + lane->taken_additions.size();
    }
    if (own_lane == 0) {
        own_lane = number + 1;
        lanes += !move_ids.empty();
    }
    one_lane = lanes <= 1;
    if (!one_lane && writer.size() < objects.capacity()) writer.resize(objects.capacity());
    next_stats.commands += move_ids.size();

    for (const Lane* lane = queues.first(); lane != nullptr; lane = lane->next)
        for (const Addition& addition : lane->taken_additions) {
            add_object(addition);
            if (!one_lane) writer[addition.id.index] = 0; // to be told from every lane; see below
        }
    number = 0;
    for (const Lane* lane = queues.first(); lane != nullptr; lane = lane->next) {
        current_lane = ++number;
        const std::size_t count = lane->taken_commands.size();
        for (std::size_t i = 0; i < count; ++i) {
            if (i + world::fetch_ahead < count)
                prefetch(lane->taken_commands[i + world::fetch_ahead].id.index);
            const Command& command = lane->taken_commands[i];
            // A new object belongs to the first lane that says something about it.
            if (!one_lane && writer[command.id.index] == 0) writer[command.id.index] = current_lane;
            apply_command(command);
        }
    }
    if (!changed.empty() || !move_in_place(move_ids, boxes)) {
        current_lane = own_lane;
        move_one_by_one(move_ids, boxes);
        if (!contested.empty()) settle_contests(move_ids, boxes, own_lane);
        world::sort_by_key(old_filters, old_filter_scratch, [](const OldFilter& old) { return old.index; });
        drop_unchanged();
        world::sort_by_key(changed, index_scratch, [](std::uint32_t index) { return index; });
    }
    next_stats.changed = changed.size();
}

/// Moves objects of which no command has spoken, in parallel. Returns false, with nothing done, if ids don't ascend
/// or there is more to look at than boxes.
template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::move_in_place(std::span<const ObjectId> move_ids, const Boxes& boxes)
{
    const ProcessOptions in_runs{executor_for(move_ids.size()), world::run_length};
    std::atomic<bool> simple{true}, good{true};
    const auto look = [&](std::uint64_t begin, std::uint64_t end, Work) {
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const ObjectId id = move_ids[i];
            if (i + world::fetch_ahead < end) prefetch(move_ids[i + world::fetch_ahead].index);
            all &= ids.is_good(id) && (i == 0 || move_ids[i - 1].index < id.index) &&
                   (objects[id.index].state() & (world::flag::alive | world::flag::has_shape)) ==
                       world::flag::alive;
        }
        if (!all) simple.store(false, std::memory_order_relaxed);
    };
    process_items(move_ids.size(), look, in_runs);
    if (!simple) return false;

    changed.resize(move_ids.size());
    kept_of_run.resize((move_ids.size() + world::run_length - 1) / world::run_length);
    const auto set = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        std::uint32_t* kept = changed.data() + begin;
        bool all = true;
        for (std::uint64_t i = begin; i < end; ++i) {
            const std::uint32_t index = move_ids[i].index;
            if (i + world::fetch_ahead < end) prefetch(move_ids[i + world::fetch_ahead].index);
            const Object object = objects[index];
            const Box box = boxes[i];
            for (int d = 0; d < Dim; ++d)
                all &= box.lo[d] <= box.hi[d];
            if (world::same(object.now(), box)) continue;
            object.before() = box;
            object.exchange_boxes();
            *kept++ = index;
        }
        if (!all) good.store(false, std::memory_order_relaxed);
        kept_of_run[work.block] = static_cast<std::uint32_t>(kept - (changed.data() + begin));
    };
    process_items(move_ids.size(), set, in_runs);
    std::size_t kept = 0;
    for (std::size_t run = 0; run < kept_of_run.size(); ++run) {
        const auto first = changed.begin() + static_cast<std::ptrdiff_t>(run * world::run_length);
        if (kept != run * world::run_length)
            std::copy_n(first, kept_of_run[run], changed.begin() + static_cast<std::ptrdiff_t>(kept));
        kept += kept_of_run[run];
    }
    changed.resize(kept);
    if (!good)
        for (std::size_t i = 0; i < move_ids.size(); ++i)
            world::check_box(boxes[i], move_ids[i]);
    return true;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::move_one_by_one(std::span<const ObjectId> move_ids, const Boxes& boxes)
{
    for (std::size_t i = 0; i < move_ids.size(); ++i) {
        const ObjectId id = move_ids[i];
        if (i + world::fetch_ahead < move_ids.size()) prefetch(move_ids[i + world::fetch_ahead].index);
        ids.check(id);
        const Box box = boxes[i];
        world::check_box(box, id);
        if (!one_lane && writer[id.index] == 0) writer[id.index] = current_lane;
        if (touch(id)) set_box(objects[id.index], id.index, box);
    }
}

/// Objects about which several threads had something to say, or that were given a sequence.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::settle_contests(std::span<const ObjectId> move_ids, const Boxes& boxes,
                                                    std::uint32_t own_lane)
{
    const auto by_index = [](const auto& x, const auto& y) { return x.index < y.index; };
    std::sort(old_filters.begin(), old_filters.end(), by_index);
    std::sort(old_shapes.begin(), old_shapes.end(), by_index);
    sorted_old_filters = old_filters.size();
    sorted_old_shapes = old_shapes.size();
    struct Statement
    {
        std::uint32_t index, lane;
        std::uint64_t turn;
        Command command;
    };
    std::pmr::vector<Statement> statements(options.memory);
    std::pmr::vector<const Addition*> additions(options.memory);
    const auto is_contested = [&](ObjectId id) {
        return ids.is_good(id) && objects[id.index].has(world::flag::contested);
    };
    std::uint32_t number = 0;
    for (const Lane* lane = queues.first(); lane != nullptr; lane = lane->next) {
        ++number;
        for (const Addition& addition : lane->taken_additions)
            if (is_contested(addition.id)) additions.push_back(&addition);
        for (const Command& command : lane->taken_commands)
            if (is_contested(command.id))
                statements.push_back({command.id.index, number, statements.size(), command});
    }
    for (std::size_t i = 0; i < move_ids.size(); ++i)
        if (is_contested(move_ids[i]))
            statements.push_back({move_ids[i].index, own_lane, statements.size(),
                                  Command(move_ids[i], 0, world::CommandKind::move, boxes[i])});
    std::sort(statements.begin(), statements.end(), [](const Statement& x, const Statement& y) {
        return std::tie(x.index, x.lane, x.turn) < std::tie(y.index, y.lane, y.turn);
    });
    std::sort(additions.begin(), additions.end(),
              [](const Addition* x, const Addition* y) { return x->id.index < y->id.index; });

    // What one lane makes of an object, property by property, each with the sequence that it has.
    struct Said
    {
        bool box_given = false, filter_given = false, margin_given = false, enabled_given = false;
        std::uint32_t box_sequence = 0, filter_sequence = 0, margin_sequence = 0, enabled_sequence = 0;
        struct
        {
            Box box;
            T displacement[Dim];
        } place = {};
        ObjectFilter filter;
        T margin = 0;
        bool enabled = false;
    };
    // Ties between lanes: any choice does that doesn't depend on who came first.
    const auto greater = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) > 0; };
    const auto filter_numbers = [](const ObjectFilter& f) {
        return std::array<std::uint32_t, 4>{f.category, f.mask, f.owner, f.is_static ? 1u : 0u};
    };

    auto statement = statements.begin();
    for (auto group = statements.begin(); group != statements.end(); group = statement) {
        const std::uint32_t index = group->index;
        const Object object = objects[index];
        const bool removed = !object.has(world::flag::alive);
        const auto addition = std::lower_bound(
            additions.begin(), additions.end(), index,
            [](const Addition* each, std::uint32_t wanted) { return each->id.index < wanted; });
        const auto restart = [&] {
            if (addition != additions.end() && (*addition)->id.index == index)
                add_object(**addition);
            else
                reset(object, index);
        };
        Said best;
        while (statement != statements.end() && statement->index == index) {
            const std::uint32_t lane = statement->lane;
            restart();
            Said said;
            for (; statement != statements.end() && statement->index == index && statement->lane == lane;
                 ++statement) {
                const Command& command = statement->command;
                const auto newer = [&](bool& given, std::uint32_t& sequence) {
                    if (given && command.sequence < sequence) return false;
                    given = true;
                    sequence = command.sequence;
                    return true;
                };
                switch (command.kind) {
                case world::CommandKind::remove:
                    break; // `removed` knows
                case world::CommandKind::move:
                case world::CommandKind::sweep:
                case world::CommandKind::resize:
                    if (!newer(said.box_given, said.box_sequence)) break;
                    apply_command(command);
                    if (object.has(world::flag::has_shape)) {
                        said.place.box = shapes[index].box;
                        std::copy_n(shapes[index].displacement, Dim, said.place.displacement);
                    } else {
                        said.place.box = object.now();
                        std::fill_n(said.place.displacement, Dim, T{0});
                    }
                    break;
                case world::CommandKind::filter:
                    if (newer(said.filter_given, said.filter_sequence)) said.filter = command.filter;
                    break;
                case world::CommandKind::margin:
                    if (newer(said.margin_given, said.margin_sequence)) said.margin = command.box.lo[0];
                    break;
                case world::CommandKind::enable:
                case world::CommandKind::disable:
                    if (newer(said.enabled_given, said.enabled_sequence))
                        said.enabled = command.kind == world::CommandKind::enable;
                    break;
                }
            }
            const auto wins = [](bool given, std::uint32_t sequence, bool best_given,
                                 std::uint32_t best_sequence, bool is_greater) {
                return given &&
                       (!best_given || sequence > best_sequence || (sequence == best_sequence && is_greater));
            };
            if (wins(said.box_given, said.box_sequence, best.box_given, best.box_sequence,
                     greater(said.place, best.place))) {
                best.box_given = true;
                best.box_sequence = said.box_sequence;
                best.place = said.place;
            }
            if (wins(said.filter_given, said.filter_sequence, best.filter_given, best.filter_sequence,
                     filter_numbers(said.filter) > filter_numbers(best.filter))) {
                best.filter_given = true;
                best.filter_sequence = said.filter_sequence;
                best.filter = said.filter;
            }
            if (wins(said.margin_given, said.margin_sequence, best.margin_given, best.margin_sequence,
                     said.margin > best.margin)) {
                best.margin_given = true;
                best.margin_sequence = said.margin_sequence;
                best.margin = said.margin;
            }
            if (wins(said.enabled_given, said.enabled_sequence, best.enabled_given, best.enabled_sequence,
                     said.enabled)) {
                best.enabled_given = true;
                best.enabled_sequence = said.enabled_sequence;
                best.enabled = said.enabled;
            }
        }
        restart();
        if (best.filter_given) set_filter(object, index, best.filter);
        if (best.margin_given) {
            Shape& shape = shape_of(object, index);
            shape.margin = margin + best.margin;
            object.now() = shape.bounds();
        }
        if (best.box_given) {
            set_box(object, index, best.place.box);
            const auto is_zero = [](T x) { return x == 0; };
            if (!std::all_of(best.place.displacement, best.place.displacement + Dim, is_zero)) {
                Shape& shape = shape_of(object, index);
                std::copy_n(best.place.displacement, Dim, shape.displacement);
                object.now() = shape.bounds();
            }
        }
        if (best.enabled_given) object.set(world::flag::enabled, best.enabled);
        if (removed) object.set(world::flag::alive, false);
    }
}

/// Objects that commands left as they were.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::drop_unchanged()
{
    const auto is_unchanged = [&](std::uint32_t index) {
        const Object object = objects[index];
        const bool differs = object.place() == world::Place::none || !object.has(world::flag::alive) ||
                             object.has(world::flag::enabled) != (object.place() != world::Place::disabled) ||
                             object.has(world::flag::asked) ||
                             (object.has(world::flag::refiltered) && object.filter() != old_filter(index)) ||
                             !world::same(object.now(), object.before());
        if (differs) return false;
        object.now() = object.before();
        object.set(world::flag::transient, false);
        return true;
    };
    std::size_t kept = 0;
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (i + world::fetch_ahead < changed.size()) prefetch(changed[i + world::fetch_ahead]);
        if (!is_unchanged(changed[i])) changed[kept++] = changed[i];
    }
    changed.resize(kept);
}

JOSTLE_NAMESPACE_END
