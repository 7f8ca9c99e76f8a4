// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <tuple>

#include "index/box_index_access.hpp"
#include "jostle/process.hpp"
#include "pair_arena.hpp"
#include "validate.hpp"
#include "world/sort_keys.hpp"
#include "world/state.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

// Updates an object must stay as it is before it comes to rest. New objects need one only.
constexpr std::uint32_t idle_updates = 3;
// This many may come to rest in an update that has nothing else to do.
constexpr std::uint64_t least_settling = 512;
// Below this many boxes all pairs are tried: a grid takes longer to choose.
constexpr std::size_t few = 24;
// With fewer resting objects the index is as quick as a list.
constexpr std::size_t worth_listing = 64;
// Candidates are looked at in runs of this many.
constexpr std::size_t run_length = 4096;

/// Objects are all over the place: loops ask for those to come.
constexpr std::size_t fetch_ahead = 16;
inline void fetch(const void* address) noexcept
{
#ifdef __GNUC__
    __builtin_prefetch(address);
#else
    (void)address;
#endif
}

using Clock = std::chrono::steady_clock;
inline double microseconds(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::micro>(to - from).count();
}

} // namespace world

// ---------------------------------------------------------------------------------------------------------
// Applying commands
// ---------------------------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::prefetch(std::uint32_t index) const noexcept
{
    if (index < objects.capacity()) world::fetch(&objects[index]);
}

template <int Dim, Coordinate T>
auto World<Dim, T>::Implementation::touch(ObjectId id) -> Object*
{
    if (!ids.is_good(id) || !objects[id.index].has(world::flag::alive)) {
        ++next_stats.dropped;
        return nullptr;
    }
    Object& object = objects[id.index];
    if (!object.has(world::flag::touched)) {
        changed.push_back(id.index);
        object.before = object.now;
        object.state |= world::flag::touched;
        if (!one_lane) writer[id.index] = current_lane;
    } else if (!one_lane && writer[id.index] != current_lane) {
        contest(object, id.index);
    }
    return &object;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::contest(Object& object, std::uint32_t index)
{
    if (object.has(world::flag::contested)) return;
    contested.push_back(index);
    object.state |= world::flag::contested;
}

template <int Dim, Coordinate T>
auto World<Dim, T>::Implementation::shape_of(Object& object, std::uint32_t index) -> Shape&
{
    shapes.grow(std::size_t{index} + 1);
    Shape& shape = shapes[index];
    const bool had = object.has(world::flag::has_shape);
    if (!object.has(world::flag::shape_saved)) {
        old_shapes.push_back({index, had, shape});
        object.state |= world::flag::shape_saved;
    }
    if (!had) {
        shape = {object.now, {}, 0};
        object.state |= world::flag::has_shape;
    }
    return shape;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::set_box(Object& object, std::uint32_t index, const Box& box)
{
    if (!object.has(world::flag::has_shape)) {
        object.now = box;
        return;
    }
    Shape& shape = shape_of(object, index);
    shape.box = box;
    for (T& each : shape.displacement)
        each = 0;
    object.now = shape.bounds();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::resize_box(Object& object, std::uint32_t index, const Box& size)
{
    const bool shaped = object.has(world::flag::has_shape);
    Box box = shaped ? shapes[index].box : object.now;
    for (int d = 0; d < Dim; ++d) {
        const T centre = box.lo[d] + (box.hi[d] - box.lo[d]) / 2, half = size.lo[d] / 2;
        if (!(centre - half <= centre + half)) continue; // infinite bounds have no centre: they stay
        box.lo[d] = centre - half;
        box.hi[d] = centre + half;
    }
    if (!shaped) {
        object.now = box;
        return;
    }
    Shape& shape = shape_of(object, index);
    shape.box = box;
    object.now = shape.bounds();
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::set_filter(Object& object, std::uint32_t index,
                                               const ObjectFilter& filter)
{
    if (object.place() != world::Place::none && !object.has(world::flag::refiltered)) {
        if (object.filter() == filter && !options.accept) return;
        old_filters.push_back({index, object.filter()});
        object.state |= world::flag::refiltered;
    }
    object.set_filter(filter);
    if (options.accept) object.state |= world::flag::asked;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::apply_command(const Command& command)
{
    Object* const object = touch(command.id);
    if (object == nullptr) return;
    const std::uint32_t index = command.id.index;
    if (command.sequence != 0) contest(*object, index);
    switch (command.kind) {
    case world::CommandKind::remove:
        object->set(world::flag::alive, false);
        break;
    case world::CommandKind::move:
        set_box(*object, index, command.box);
        break;
    case world::CommandKind::teleport:
        set_box(*object, index, command.box);
        object->state |= world::flag::leap;
        break;
    case world::CommandKind::sweep: {
        Shape& shape = shape_of(*object, index);
        std::copy_n(command.box.lo, Dim, shape.displacement);
        object->now = shape.bounds();
        break;
    }
    case world::CommandKind::resize:
        resize_box(*object, index, command.box);
        break;
    case world::CommandKind::filter:
        set_filter(*object, index, command.filter);
        break;
    case world::CommandKind::margin: {
        Shape& shape = shape_of(*object, index);
        shape.margin = margin + command.box.lo[0];
        object->now = shape.bounds();
        break;
    }
    case world::CommandKind::enable:
    case world::CommandKind::disable:
        object->set(world::flag::enabled, command.kind == world::CommandKind::enable);
        break;
    }
}

/// The object as it was, or as it was added.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::reset(Object& object, std::uint32_t index) noexcept
{
    const world::Place place = object.place();
    object.now = object.before;
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
    Object& object = objects[index];
    if (!object.has(world::flag::touched)) changed.push_back(index);
    object.state = static_cast<std::uint32_t>(world::Place::none) | world::flag::alive |
                   (object.state & world::flag::transient) | world::flag::touched;
    object.set(world::flag::enabled, addition.options.enabled);
    object.now = object.before = addition.box;
    object.set_filter(addition.options.filter);
    if (const T own = margin + addition.options.margin; own != 0) {
        Shape& shape = shape_of(object, index);
        shape.margin = own;
        object.now = shape.bounds();
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
    current_lane = own_lane;
    for (std::size_t i = 0; i < move_ids.size(); ++i) {
        const ObjectId id = move_ids[i];
        if (i + world::fetch_ahead < move_ids.size()) prefetch(move_ids[i + world::fetch_ahead].index);
        ids.check(id);
        const Box box = boxes[i];
        for (int d = 0; d < Dim; ++d)
            if (!(box.lo[d] <= box.hi[d])) throw_bad_box(box, id.index, "of object ");
        if (!one_lane && writer[id.index] == 0) writer[id.index] = current_lane;
        if (Object* const object = touch(id)) set_box(*object, id.index, box);
    }
    if (!contested.empty()) settle_contests(move_ids, boxes, own_lane);
    world::sort_by_key(old_filters, old_filter_scratch, [](const OldFilter& old) { return old.index; });
    drop_unchanged();
    world::sort_by_key(changed, index_scratch, [](std::uint32_t index) { return index; });
    next_stats.changed = changed.size();
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
        bool enabled = false, leap = false;
    };
    // Ties between lanes: any choice does that doesn't depend on who came first.
    const auto greater = [](const auto& x, const auto& y) { return std::memcmp(&x, &y, sizeof x) > 0; };
    const auto filter_numbers = [](const ObjectFilter& f) {
        return std::array<std::uint32_t, 4>{f.category, f.mask, f.owner, f.is_static ? 1u : 0u};
    };

    auto statement = statements.begin();
    for (auto group = statements.begin(); group != statements.end(); group = statement) {
        const std::uint32_t index = group->index;
        Object& object = objects[index];
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
                case world::CommandKind::teleport:
                case world::CommandKind::sweep:
                case world::CommandKind::resize:
                    if (!newer(said.box_given, said.box_sequence)) break;
                    apply_command(command);
                    if (object.has(world::flag::has_shape)) {
                        said.place.box = shapes[index].box;
                        std::copy_n(shapes[index].displacement, Dim, said.place.displacement);
                    } else {
                        said.place.box = object.now;
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
            object.now = shape.bounds();
        }
        if (best.box_given) {
            set_box(object, index, best.place.box);
            const auto is_zero = [](T x) { return x == 0; };
            if (!std::all_of(best.place.displacement, best.place.displacement + Dim, is_zero)) {
                Shape& shape = shape_of(object, index);
                std::copy_n(best.place.displacement, Dim, shape.displacement);
                object.now = shape.bounds();
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
        Object& object = objects[index];
        const bool differs = object.place() == world::Place::none || !object.has(world::flag::alive) ||
                             object.has(world::flag::enabled) != (object.place() != world::Place::disabled) ||
                             object.has(world::flag::asked) || object.filter() != old_filter(object, index) ||
                             !world::same(object.now, object.before);
        if (differs) return false;
        object.now = object.before;
        object.state &= ~world::flag::transient;
        return true;
    };
    std::size_t kept = 0;
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (i + world::fetch_ahead < changed.size()) prefetch(changed[i + world::fetch_ahead]);
        if (!is_unchanged(changed[i])) changed[kept++] = changed[i];
    }
    changed.resize(kept);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::undo() noexcept
{
    for (const std::uint32_t index : changed) {
        Object& object = objects[index];
        if (object.place() == world::Place::none) {
            object.state = 0;
            continue;
        }
        object.now = object.before;
        object.set(world::flag::alive, true);
        object.set(world::flag::enabled, object.place() != world::Place::disabled);
    }
    for (const OldFilter& old : old_filters)
        if (objects[old.index].state != 0) objects[old.index].set_filter(old.filter);
    for (const OldShape& old : old_shapes) {
        shapes[old.index] = old.shape;
        if (objects[old.index].state != 0) objects[old.index].set(world::flag::has_shape, old.had_shape);
    }
    for (const std::uint32_t index : changed) {
        objects[index].state &= ~world::flag::transient;
        if (objects[index].place() == world::Place::resting)
            class_of[index] = filter_classes.of(objects[index].filter());
    }
    for (const std::uint64_t key : newly_refused)
        refused.erase(key);
    hoods.invalidate_all(); // new ones left out what woke up
}

// ---------------------------------------------------------------------------------------------------------
// Finding pairs
// ---------------------------------------------------------------------------------------------------------

/// One side of a search: what its numbers stand for.
template <int Dim, Coordinate T>
struct World<Dim, T>::Implementation::Side
{
    const std::uint32_t* index; // of the object that a number of the search stands for; null: of itself
    const Entry* kind;          // null: all of them `both`
    bool resting;               // objects that woke up in this update are found as changed ones
};

template <int Dim, Coordinate T>
ObjectFilter World<Dim, T>::Implementation::old_filter(const Object& object,
                                                       std::uint32_t index) const noexcept
{
    if (!object.has(world::flag::refiltered)) return object.filter();
    return std::lower_bound(old_filters.begin(), old_filters.end(), index,
                            [](const OldFilter& old, std::uint32_t wanted) { return old.index < wanted; })
        ->filter;
}

/// Tells from the exact boxes and filters, old and new, what became of each candidate. Those that persist
/// move to the front, by the objects' indices; the others are noted.
template <int Dim, Coordinate T>
Pair* World<Dim, T>::Implementation::classify(Pair* first, Pair* last, const Side& side_a, const Side& side_b)
{
    constexpr std::size_t room = 256, ahead = 12;
    std::uint64_t began[room], asked[room];
    Ended ended[room];
    std::size_t began_count = 0, asked_count = 0, ended_count = 0, misses = 0;
    const auto note = [&](bool counts) {
        const std::lock_guard lock(found_mutex);
        found_began.insert(found_began.end(), began, began + began_count);
        found_asked.insert(found_asked.end(), asked, asked + asked_count);
        found_ended.insert(found_ended.end(), ended, ended + ended_count);
        began_count = asked_count = ended_count = 0;
        if (counts) {
            candidates += static_cast<std::uint64_t>(last - first);
            false_positives += misses;
        }
    };
    const bool any_refused = !refused.empty();
    const bool plain = side_a.kind == nullptr && side_b.kind == nullptr && !any_refused;
    const auto object_of = [&](const Side& side, std::uint32_t number) {
        return side.index != nullptr ? side.index[number] : number;
    };
    Pair* kept = first;
    for (Pair* pair = first; pair != last; ++pair) {
        if (static_cast<std::size_t>(last - pair) > ahead) {
            world::fetch(&objects[object_of(side_a, pair[ahead].a)]);
            world::fetch(&objects[object_of(side_b, pair[ahead].b)]);
        }
        const std::uint32_t index_a = object_of(side_a, pair->a), index_b = object_of(side_b, pair->b);
        const Object &a = objects[index_a], &b = objects[index_b];
        const std::uint32_t either = a.state | b.state, both = a.state & b.state;
        // What needs no second look: two that were and are there, in one place of the search each, and
        // whose filters are as they were.
        constexpr std::uint32_t there = 2u | world::flag::alive | world::flag::enabled;
        constexpr std::uint32_t special = world::flag::refiltered | world::flag::asked;
        const bool usual = ((both & there) == there) & ((either & special) == 0);
        const bool pass = passes(a, b), now_touch = world::touch(a.now, b.now),
                   old_touch = world::touch(a.old(), b.old());
        const bool one_changed = (either & world::flag::touched) != 0;
        if (usual & pass & now_touch & old_touch & one_changed & plain) {
            if (side_b.resting && b.has(world::flag::touched)) continue;
            *kept++ = {std::min(index_a, index_b), std::max(index_a, index_b)};
            continue;
        }
        const Entry kind_a = side_a.kind != nullptr ? side_a.kind[pair->a] : Entry::both;
        const Entry kind_b = side_b.kind != nullptr ? side_b.kind[pair->b] : Entry::both;
        if (!one_changed || index_a == index_b || (side_b.resting && b.has(world::flag::touched))) continue;

        const bool now = now_touch && pass && a.is_there() && b.is_there();
        bool before = old_touch && a.was_there() && b.was_there();
        if (before)
            before = either & world::flag::refiltered
                         ? world::passes(old_filter(a, index_a), old_filter(b, index_b))
                         : pass;
        const std::uint64_t key = world::pair_key(index_a, index_b);
        if (now) {
            // Of an object's two places the new one tells that a pair is there, the old one that it was.
            if (kind_a == Entry::old_only || kind_b == Entry::old_only) continue;
            if (!before) {
                began[began_count++] = key;
            } else if ((a.state | b.state) & world::flag::asked) {
                asked[asked_count++] = key;
            } else if (!any_refused || refused.find(key) == refused.end()) {
                *kept++ = {static_cast<std::uint32_t>(key >> 32), static_cast<std::uint32_t>(key)};
            }
        } else if (before) {
            if (kind_a == Entry::new_only || kind_b == Entry::new_only) continue;
            EndReason reason = EndReason::filtered;
            if (!a.has(world::flag::alive) || !b.has(world::flag::alive))
                reason = EndReason::removed;
            else if (!a.has(world::flag::enabled) || !b.has(world::flag::enabled))
                reason = EndReason::disabled;
            else if (!now_touch)
                reason = EndReason::moved_apart;
            ended[ended_count++] = {key, reason};
        } else {
            ++misses;
        }
        if (began_count == room || asked_count == room || ended_count == room) note(false);
    }
    note(true);
    return kept;
}

/// Calls body(run, begin, end) for runs of numbers below `count`, shared out over the executor.
template <int Dim, Coordinate T>
template <class Body>
void World<Dim, T>::Implementation::in_runs(std::size_t count, const Body& body)
{
    process_items(count,
                  [&](std::uint64_t begin, std::uint64_t end, Work work) { body(work.block, begin, end); },
                  // With fewer than two runs a thread, waking one takes longer than it helps.
                  {count < 4 * world::run_length ? &serial_executor() : executor, world::run_length});
}

/// Finds out for which changed entries a list of neighbours will do instead of the index, and makes new lists
/// for those that have none and look as if they moved on.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::begin_in_neighbourhoods()
{
    starts.assign(changed_entries, {});
    entry_created.assign(changed_entries, ~std::uint32_t{0});
    newcomers.clear();
    ways.clear();
    if (resting.size() < world::worth_listing) return;
    const auto begin_at = [&](std::uint32_t entry, const auto& hood) {
        if (hood.blocks == 0) return;
        starts[entry] = {hood.block, hood.blocks};
        entry_created[entry] = hood.created;
    };
    for (std::uint32_t entry = 0; entry < changed_entries; ++entry) {
        if (!entry_moves_on[entry]) continue;
        const auto* const hood = hoods.find(entry_index[entry]);
        if (hood != nullptr && hood->valid && world::holds(hood->bounds, entry_boxes[entry])) {
            begin_at(entry, *hood);
        } else if (calm) {
            newcomers.push_back(entry);
            ways.push_back(world::way_of(entry_before[entry], entry_now[entry], entry_boxes[entry]));
        }
    }
    if (newcomers.empty()) return;
    resting.join(Boxes(std::span<const Box>(ways)), way_pairs);
    auto pair = way_pairs.begin();
    for (std::uint32_t k = 0; k < newcomers.size(); ++k) {
        const auto first = pair;
        while (pair != way_pairs.end() && pair->a == k) {
            if (way_pairs.end() - pair > static_cast<std::ptrdiff_t>(world::fetch_ahead))
                prefetch(pair[world::fetch_ahead].b);
            ++pair;
        }
        auto& hood = hoods.make(entry_index[newcomers[k]], ways[k], update_number,
                                static_cast<std::size_t>(pair - first));
        std::uint32_t lane = 0;
        if (hood.blocks != 0)
            for (auto each = first; each != pair; ++each)
                if (const Object& object = objects[each->b]; !object.has(world::flag::touched)) {
                    auto& block = hood.block[lane / index::lanes];
                    block.bounds.set(lane % index::lanes, object.now);
                    block.id[lane % index::lanes] = each->b;
                    ++lane;
                }
        for (; lane < hood.blocks * index::lanes; ++lane) {
            hood.block[lane / index::lanes].bounds.clear(lane % index::lanes);
            hood.block[lane / index::lanes].id[lane % index::lanes] = index::no_id;
        }
        begin_at(newcomers[k], hood);
    }
}

/// Lists that the objects about to settle belong into are of no more use.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::invalidate_neighbourhoods()
{
    calm = 8 * settling.size() <= changed.size();
    if (settling.empty() || hoods.size() == 0) return;
    if (!calm && settling.size() > 64) {
        hoods.invalidate_all();
        return;
    }
    hood_bounds.clear();
    hood_numbers.clear();
    auto& all = hoods.all();
    for (std::uint32_t h = 0; h < all.size(); ++h)
        if (all[h].valid) {
            hood_bounds.push_back(all[h].bounds);
            hood_numbers.push_back(h);
        }
    if (hood_bounds.size() * settling.size() <= 4096) {
        for (const Box& box : settling_boxes)
            for (std::size_t h = 0; h < hood_bounds.size(); ++h)
                if (world::touch(box, hood_bounds[h])) all[hood_numbers[h]].valid = false;
        return;
    }
    const auto select = [&](Pair* first, Pair* last) {
        const std::lock_guard lock(found_mutex);
        for (const Pair* pair = first; pair != last; ++pair)
            all[hood_numbers[pair->b]].valid = false;
        return first;
    };
    PairFinderAccess::find(finder, Boxes(std::span<const Box>(settling_boxes)),
                           Boxes(std::span<const Box>(hood_bounds)), select, scratch_pairs);
}

/// Pairs of changed and resting objects.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::join_resting(const Side& side, std::pmr::vector<Pair>& persisting)
{
    const auto changed_part = [&](const std::pmr::vector<Box>& boxes) {
        return Boxes(std::span<const Box>(boxes).first(changed_entries));
    };
    begin_in_neighbourhoods();
    BoxIndexAccess::join(resting, changed_part(entry_boxes), changed_part(entry_before),
                         changed_part(entry_now), std::span<const index::Start<Dim, T>>(starts), joined,
                         joined_rest);
    // What a list holds and has woken up since is found elsewhere, if anywhere.
    const auto is_stale = [&](const Pair& pair) { return rested_at[pair.b] > entry_created[pair.a]; };

    // Steady pairs touched before and touch now. Their filters' classes tell the rest, mostly.
    kept_of_run.resize((joined.size() + world::run_length - 1) / world::run_length);
    const bool any_refused = !refused.empty();
    in_runs(joined.size(), [&](std::size_t run, std::size_t begin, std::size_t end) {
        Pair* kept = joined.data() + begin;
        std::size_t elsewhere = 0;
        for (std::size_t k = begin; k < end; ++k) {
            const Pair pair = joined[k];
            if (is_stale(pair)) {
                ++elsewhere;
                continue;
            }
            const std::uint8_t class_a = entry_class[pair.a], class_b = class_of[pair.b];
            const std::uint32_t index_a = entry_index[pair.a];
            const Pair named{std::min(index_a, pair.b), std::max(index_a, pair.b)};
            bool pass;
            if (class_a == world::FilterClasses::look || class_b == world::FilterClasses::look) {
                // One that woke up is found as a changed one; else there are more filters than classes. Which
                // filters got a class depends on history, so these pairs must stay in their places.
                const Object& b = objects[pair.b];
                if (b.has(world::flag::touched)) {
                    ++elsewhere;
                    continue;
                }
                pass = passes(objects[index_a], b);
            } else {
                pass = filter_classes.pass(class_a, class_b);
            }
            if (pass && (!any_refused || refused.find(world::pair_key(named.a, named.b)) == refused.end()))
                *kept++ = named;
        }
        kept_of_run[run] = static_cast<std::uint32_t>(kept - (joined.data() + begin));
        const std::lock_guard lock(found_mutex);
        candidates += end - begin - elsewhere;
        false_positives += end - begin - elsewhere - kept_of_run[run];
    });
    std::size_t total = persisting.size();
    for (const std::uint32_t kept : kept_of_run)
        total += kept;
    persisting.reserve(total);
    for (std::size_t run = 0; run < kept_of_run.size(); ++run) {
        const Pair* const first = joined.data() + run * world::run_length;
        persisting.insert(persisting.end(), first, first + kept_of_run[run]);
    }

    // The others are looked at one by one. They come in no order, so what persists is put in one.
    joined_rest.erase(std::remove_if(joined_rest.begin(), joined_rest.end(), is_stale), joined_rest.end());
    kept_of_run.resize((joined_rest.size() + world::run_length - 1) / world::run_length);
    const Side resting_side{nullptr, nullptr, true};
    in_runs(joined_rest.size(), [&](std::size_t run, std::size_t begin, std::size_t end) {
        Pair* const first = joined_rest.data() + begin;
        Pair* const last = joined_rest.data() + end;
        kept_of_run[run] = static_cast<std::uint32_t>(classify(first, last, side, resting_side) - first);
    });
    joined_late.clear();
    for (std::size_t run = 0; run < kept_of_run.size(); ++run) {
        const Pair* const first = joined_rest.data() + run * world::run_length;
        joined_late.insert(joined_late.end(), first, first + kept_of_run[run]);
    }
    world::sort_by_key(joined_late, joined_rest,
                       [](const Pair& pair) { return std::uint64_t{pair.a} << 32 | pair.b; });
    persisting.insert(persisting.end(), joined_late.begin(), joined_late.end());
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::search()
{
    entry_boxes.clear();
    entry_index.clear();
    entry_kind.clear();
    found_began.clear();
    found_asked.clear();
    found_ended.clear();
    candidates = false_positives = 0;
    Results& result = results[1 - shown];
    result.among_active.clear();
    result.with_idle.clear();
    result.others.clear();
    if (changed.empty()) return;

    bool all_both = true;
    entry_before.clear();
    entry_now.clear();
    entry_class.clear();
    entry_moves_on.clear();
    const auto enter_changed = [&](const Object& object, std::uint32_t index, bool usual) {
        static constexpr T nan = std::numeric_limits<T>::quiet_NaN();
        entry_before.push_back(object.before);
        entry_now.push_back(object.now);
        entry_moves_on.push_back(usual && object.place() == world::Place::active);
        entry_class.push_back(usual ? class_of[index] : world::FilterClasses::look);
        if (!usual) entry_before.back().lo[0] = nan;
    };
    const auto enter = [&](std::uint32_t index, const Box& box, Entry kind) {
        entry_boxes.push_back(box);
        entry_index.push_back(index);
        entry_kind.push_back(kind);
        all_both &= kind == Entry::both;
    };
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (i + world::fetch_ahead < changed.size()) prefetch(changed[i + world::fetch_ahead]);
        const std::uint32_t index = changed[i];
        const Object& object = objects[index];
        const bool was = object.was_there(), is = object.is_there();
        if (was && is) {
            const Box around = world::hull(object.before, object.now);
            if (object.has(world::flag::leap) || world::is_leap(object.before, object.now, around)) {
                enter(index, object.before, Entry::old_only);
                enter_changed(object, index, false);
                enter(index, object.now, Entry::new_only);
                enter_changed(object, index, false);
            } else {
                enter(index, around, Entry::both);
                enter_changed(object, index, !object.has(world::flag::refiltered | world::flag::asked));
            }
        } else if (was || is) {
            enter(index, was ? object.before : object.now, was ? Entry::old_only : Entry::new_only);
            enter_changed(object, index, false);
        }
        // Found as a changed one; as a resting one it takes a second look, which sees that it isn't.
        if (object.place() == world::Place::resting) class_of[index] = world::FilterClasses::look;
    }
    changed_entries = entry_index.size();
    if (changed_entries == 0) return;
    // Idle objects: active, but not changed this time.
    for (const Active& each : active)
        if (const Object& object = objects[each.index]; !object.has(world::flag::touched))
            enter(each.index, object.now, Entry::both);
    const std::size_t idle = entry_index.size() - changed_entries;

    const auto t0 = world::Clock::now();
    const Side side{entry_index.data(), all_both ? nullptr : entry_kind.data(), false};
    const auto select = [&](Pair* first, Pair* last) { return classify(first, last, side, side); };
    // Idle objects among themselves are tried in vain; many of them are better kept apart.
    const bool together = idle <= changed_entries;
    const std::span<const Box> all(entry_boxes);
    const std::size_t first_search = together ? all.size() : changed_entries;
    if (first_search <= world::few) {
        Pair found[world::few * world::few / 2];
        Pair* end = found;
        for (std::uint32_t i = 0; i < first_search; ++i)
            for (std::uint32_t j = i + 1; j < first_search; ++j)
                if (world::touch(entry_boxes[i], entry_boxes[j])) *end++ = {i, j};
        end = select(found, end);
        result.others.insert(result.others.end(), found, end);
    } else {
        PairFinderAccess::find(finder, Boxes(all.first(first_search)), select, result.among_active);
    }
    if (!together) {
        const Side idle_side{side.index + changed_entries,
                             side.kind != nullptr ? side.kind + changed_entries : nullptr, false};
        const auto select_idle = [&](Pair* first, Pair* last) {
            return classify(first, last, side, idle_side);
        };
        PairFinderAccess::find(finder, Boxes(all.first(changed_entries)), Boxes(all.subspan(changed_entries)),
                               select_idle, result.with_idle);
    }
    const auto t1 = world::Clock::now();
    next_stats.us_active = world::microseconds(t0, t1);

    if (resting.size() != 0) join_resting(side, result.others);
    next_stats.us_resting = world::microseconds(t1, world::Clock::now());
}

/// Puts what was found in order, and asks `accept`.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::settle_events()
{
    Results& result = results[1 - shown];
    const auto low = [](std::uint64_t key) { return static_cast<std::uint32_t>(key); };
    const auto high = [](std::uint64_t key) { return static_cast<std::uint32_t>(key >> 32); };
    const auto itself = [](std::uint64_t key) { return key; };
    world::sort_by_key(found_began, key_scratch, itself);
    result.began.clear();
    newly_refused.clear();
    no_longer_refused.clear();
    if (!options.accept) {
        result.began.reserve(found_began.size());
        for (const std::uint64_t key : found_began)
            result.began.push_back({id_of(high(key)), id_of(low(key))});
    } else {
        // The ends of refused pairs are nobody's business.
        const auto is_refused = [&](const Ended& ended) {
            if (refused.find(ended.key) == refused.end()) return false;
            no_longer_refused.push_back(ended.key);
            return true;
        };
        found_ended.erase(std::remove_if(found_ended.begin(), found_ended.end(), is_refused),
                          found_ended.end());
        world::sort_by_key(found_asked, key_scratch, itself);
        auto new_one = found_began.begin();
        auto old_one = found_asked.begin();
        while (new_one != found_began.end() || old_one != found_asked.end()) {
            const bool is_new =
                old_one == found_asked.end() || (new_one != found_began.end() && *new_one < *old_one);
            const std::uint64_t key = is_new ? *new_one++ : *old_one++;
            const ObjectPair pair{id_of(high(key)), id_of(low(key))};
            const bool was_refused = !is_new && refused.find(key) != refused.end();
            if (options.accept(pair.a, pair.b)) {
                if (is_new || was_refused)
                    result.began.push_back(pair);
                else
                    result.others.push_back({high(key), low(key)});
                if (was_refused) no_longer_refused.push_back(key);
            } else if (!was_refused) {
                newly_refused.push_back(key);
                if (!refused.insert(key).second) newly_refused.pop_back();
                if (!is_new) found_ended.push_back({key, EndReason::filtered});
            }
        }
    }
    world::sort_by_key(found_ended, ended_scratch, [](const Ended& ended) { return ended.key; });
    result.ended.clear();
    result.ended.reserve(found_ended.size());
    for (const Ended& ended : found_ended)
        result.ended.push_back({id_of(high(ended.key)), id_of(low(ended.key)), ended.reason});

    result.persisted.clear();
    PairBufferAccess persisted(result.persisted);
    persisted.reserve_blocks(result.among_active.blocks().size() + result.with_idle.blocks().size() + 1);
    for (const PairBuffer* part : {&result.among_active, &result.with_idle})
        for (const std::span<const Pair> block : part->blocks())
            persisted.append(block);
    persisted.append(result.others);
    next_stats.candidates = candidates;
    next_stats.false_positives = false_positives;
    next_stats.began = result.began.size();
    next_stats.ended = result.ended.size();
    next_stats.persisted = result.persisted.size();
}

// ---------------------------------------------------------------------------------------------------------
// Coming to rest
// ---------------------------------------------------------------------------------------------------------

/// Who will be active, and who comes to rest: no more at a time than there was work anyhow of late, so that
/// no update takes much longer than those before it.
template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::plan_rest()
{
    next_active.clear();
    waking.clear();
    settling.clear();
    recent_work_next = std::max<std::uint64_t>(changed.size(), recent_work - recent_work / 4);
    const std::uint64_t budget = std::max(world::least_settling, recent_work_next);
    const auto keep = [&](std::uint32_t index, std::uint32_t idle) {
        if (idle >= world::idle_updates && settling.size() < budget)
            settling.push_back(index);
        else
            next_active.push_back({index, idle});
    };
    auto one = active.begin();
    auto other = changed.begin();
    while (one != active.end() || other != changed.end()) {
        if (other == changed.end() || (one != active.end() && one->index < *other)) {
            keep(one->index, std::min(one->idle + 1, world::idle_updates));
            ++one;
            continue;
        }
        if (changed.end() - other > static_cast<std::ptrdiff_t>(world::fetch_ahead))
            prefetch(other[world::fetch_ahead]);
        const std::uint32_t index = *other++;
        if (one != active.end() && one->index == index) ++one;
        const Object& object = objects[index];
        if (object.place() == world::Place::resting) waking.push_back(index);
        if (!object.is_there()) continue;
        const bool is_new = object.place() == world::Place::none;
        keep(index, !is_new                              ? 0
                    : object.has(world::flag::is_static) ? world::idle_updates
                                                         : world::idle_updates - 1);
    }
    next_stats.woken = waking.size();
    next_stats.settled = settling.size();

    settling_boxes.clear();
    for (const std::uint32_t index : settling)
        settling_boxes.push_back(objects[index].now);
    next_active.reserve(next_active.size() + settling.size()); // see commit
    invalidate_neighbourhoods();
    BoxIndexAccess::erase(resting, waking);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::commit() noexcept
{
    for (std::size_t i = 0; i < changed.size(); ++i) {
        if (i + world::fetch_ahead < changed.size()) prefetch(changed[i + world::fetch_ahead]);
        const std::uint32_t index = changed[i];
        Object& object = objects[index];
        const world::Place place = object.place();
        disabled -= place == world::Place::disabled;
        alive -= place != world::Place::none;
        if (place == world::Place::resting) rested_at[index] = ~std::uint32_t{0};
        if (!object.is_there()) hoods.drop(index);
        if (!object.has(world::flag::alive)) {
            ids.release(id_of(index));
            object.state = 0;
            continue;
        }
        if (place == world::Place::none || place == world::Place::resting ||
            object.has(world::flag::refiltered))
            class_of[index] = filter_classes.of(object.filter());
        object.set_place(object.is_there() ? world::Place::active : world::Place::disabled);
        ++alive;
        disabled += !object.is_there();
        object.state &= ~world::flag::transient;
    }
    try {
        if (!settling.empty())
            BoxIndexAccess::insert(resting, settling, Boxes(std::span<const Box>(settling_boxes)));
        for (const std::uint32_t index : settling) {
            objects[index].set_place(world::Place::resting);
            rested_at[index] = update_number + 1;
            hoods.drop(index);
        }
    } catch (...) { // no memory: they may stay active as long as it takes
        next_stats.settled = 0;
        for (const std::uint32_t index : settling)
            next_active.push_back({index, world::idle_updates});
        std::sort(next_active.begin(), next_active.end(),
                  [](const Active& x, const Active& y) { return x.index < y.index; });
    }
    if (!changed.empty() || next_stats.settled != 0)
        active_index_is_fresh.store(false, std::memory_order_relaxed);
    active.swap(next_active);
    recent_work = recent_work_next;
    for (const std::uint64_t key : no_longer_refused)
        refused.erase(key);
    if (++update_number == ~std::uint32_t{0} - 1) { // numbers begin again
        hoods.invalidate_all();
        for (std::uint32_t& at : rested_at)
            at = at == ~std::uint32_t{0} ? at : 0;
        update_number = 1;
    }
    queues.forget();
    shown = 1 - shown;
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::update(std::span<const ObjectId> move_ids, const Boxes& boxes)
{
    const auto t0 = world::Clock::now();
    next_stats = {};
    changed.clear();
    old_filters.clear();
    old_shapes.clear();
    contested.clear();
    newly_refused.clear();
    no_longer_refused.clear();
    queues.take();
    try {
        apply(move_ids, boxes);
        const auto t1 = world::Clock::now();
        next_stats.us_apply = world::microseconds(t0, t1);
        search();
        const auto t2 = world::Clock::now();
        settle_events();
        const auto t3 = world::Clock::now();
        next_stats.us_events = world::microseconds(t2, t3);
        plan_rest();
        commit();
        const auto t4 = world::Clock::now();
        next_stats.us_index = world::microseconds(t3, t4);
        next_stats.us_total = world::microseconds(t0, t4);
    } catch (...) {
        undo();
        throw;
    }
    next_stats.objects = alive;
    next_stats.resting = resting.size();
    next_stats.active = active.size();
    next_stats.disabled = disabled;
    next_stats.refused = refused.size();
    next_stats.bytes_reserved = bytes();
    stats = next_stats;
}

JOSTLE_NAMESPACE_END
