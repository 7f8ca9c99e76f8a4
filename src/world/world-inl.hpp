// SPDX-License-Identifier: MIT
#pragma once

// The interface of World. Each kind of world is compiled in a file of its own, which includes this one.
#include <cmath>
#include <sstream>

#include "world/queries-inl.hpp"
#include "world/snapshot-inl.hpp"
#include "world/update-inl.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
World<Dim, T>::Implementation::Implementation(const WorldOptions& world_options)
    : options(world_options),
      executor(options.executor != nullptr ? options.executor : &default_executor()),
      margin(static_cast<T>(world_options.margin)),
      ids(options.memory),
      queues(options.memory),
      finder({options.executor, options.memory, options.instruction_set}),
      objects(options.memory),
      shapes(options.memory),
      class_of(options.memory),
      active(options.memory),
      resting({options.executor, options.memory, options.instruction_set}),
      refused(options.memory),
      results{Results(options.memory), Results(options.memory)},
      changed(options.memory),
      old_filters(options.memory),
      old_filter_scratch(options.memory),
      old_shapes(options.memory),
      contested(options.memory),
      writer(options.memory),
      entry_boxes(options.memory),
      entry_index(options.memory),
      entry_class(options.memory),
      entry_moves_on(options.memory),
      among_active(options.memory),
      with_idle(options.memory),
      joined(options.memory),
      kept_of_run(options.memory),
      found(options.memory),
      sorter(options.memory),
      pair_sorting(options.memory),
      pair_scratch(options.memory),
      woken_boxes(options.memory),
      old_of_woken(options.memory),
      hoods(options.memory),
      rested_at(options.memory),
      lookups(options.memory),
      unlisted(options.memory),
      entry_created(options.memory),
      near_pairs(options.memory),
      kernels(index::kernels_for<Dim, T>(options.instruction_set)),
      newcomers(options.memory),
      ways(options.memory),
      hood_bounds(options.memory),
      way_pairs(options.memory),
      hood_numbers(options.memory),
      scratch_pairs(options.memory),
      found_began(options.memory),
      found_asked(options.memory),
      found_ended(options.memory),
      found_others(options.memory),
      began_keys(options.memory),
      asked_keys(options.memory),
      key_scratch(options.memory),
      ended_keys(options.memory),
      ended_scratch(options.memory),
      index_scratch(options.memory),
      newly_refused(options.memory),
      no_longer_refused(options.memory),
      next_active(options.memory),
      waking(options.memory),
      settling(options.memory),
      settling_boxes(options.memory),
      changed_pairs_list(options.memory),
      active_index({options.executor, options.memory, options.instruction_set})
{
}

template <int Dim, Coordinate T>
auto World<Dim, T>::Implementation::checked(ObjectId id) const -> ConstObject
{
    ids.check(id);
    if (id.index >= objects.capacity() || !objects[id.index].has(world::flag::alive))
        throw Error(ErrorCode::stale_id,
                    "object " + std::to_string(id.index) +
                        " is not in the world yet; its add() takes effect in the next update()",
                    id.index);
    return objects[id.index];
}

template <int Dim, Coordinate T>
std::uint64_t World<Dim, T>::Implementation::bytes() const
{
    const auto of = [](const auto&... vectors) {
        return (std::uint64_t{0} + ... + (vectors.capacity() * sizeof(vectors[0])));
    };
    std::uint64_t sum =
        sizeof *this + ids.bytes() + queues.bytes() + objects.bytes() + shapes.bytes() +
        finder.stats().bytes_reserved + sorter.bytes() + resting.stats().bytes + active_index.stats().bytes +
        hoods.bytes() + near_pairs.bytes() + among_active.bytes_reserved() + with_idle.bytes_reserved() +
        scratch_pairs.bytes_reserved() + changed_pairs_list.bytes_reserved() + found_began.bytes() +
        found_asked.bytes() + found_ended.bytes() + found_others.bytes() +
        refused.bucket_count() * sizeof(void*) + refused.size() * 4 * sizeof(void*) +
        of(class_of, active, changed, old_filters, old_filter_scratch, old_shapes, contested, writer,
           entry_boxes, entry_index, entry_class, entry_moves_on, joined, kept_of_run, pair_sorting,
           pair_scratch, woken_boxes, old_of_woken, rested_at, lookups, unlisted, entry_created, newcomers,
           ways, hood_bounds, way_pairs, hood_numbers, began_keys, asked_keys, key_scratch, ended_keys,
           ended_scratch, index_scratch, newly_refused, no_longer_refused, next_active, waking, settling,
           settling_boxes);
    for (const Results& result : results)
        sum += result.persisted.bytes_reserved() + of(result.others, result.began, result.ended);
    return sum;
}

namespace world {

/// `margin` as it was given, for a world of T.
template <class T>
void check_margin(double margin, const char* whose, std::uint64_t index)
{
    if (margin >= 0 && margin <= double{std::numeric_limits<T>::max()}) return;
    std::ostringstream message;
    message.imbue(std::locale::classic());
    message << "margin " << margin << whose;
    if (index != Error::no_index) message << index;
    message << "; give a number from 0 to " << std::numeric_limits<T>::max();
    throw Error(ErrorCode::invalid_argument, message.str(), index);
}

inline void check_sizes(std::size_t ids, std::size_t boxes)
{
    if (ids != boxes)
        throw Error(ErrorCode::size_mismatch, std::to_string(ids) + " ids for " + std::to_string(boxes) +
                                                  " boxes; give one id for each box");
}

} // namespace world

template <int Dim, Coordinate T>
World<Dim, T>::World(const WorldOptions& options)
{
    world::check_margin<T>(options.margin, " of the world", Error::no_index);
    implementation_ = std::make_unique<Implementation>(options);
}
template <int Dim, Coordinate T>
World<Dim, T>::World(World&&) noexcept = default;
template <int Dim, Coordinate T>
World<Dim, T>& World<Dim, T>::operator=(World&&) noexcept = default;
template <int Dim, Coordinate T>
World<Dim, T>::~World() = default;

// --- Commands --------------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
ObjectId World<Dim, T>::add(const Box& box, const Options& options)
{
    ObjectId id;
    add(Boxes(std::span<const Box>(&box, 1)), std::span<ObjectId>(&id, 1), options);
    return id;
}

template <int Dim, Coordinate T>
void World<Dim, T>::add(const Boxes& boxes, std::span<ObjectId> ids, const Options& options)
{
    world::check_sizes(ids.size(), boxes.size());
    validate_boxes_of(boxes, "to be added ");
    world::check_margin<T>(options.margin, " of new objects", Error::no_index);
    implementation_->queues.with_own_lane([&](world::Lane<Dim, T>& lane) {
        world::reserve_more(lane.additions, ids.size());
        implementation_->ids.take(ids);
        for (std::size_t i = 0; i < ids.size(); ++i)
            lane.additions.push_back({ids[i], boxes[i], options});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::queue(const Command& command)
{
    ids.check(command.id);
    queues.with_own_lane([&](Lane& lane) { lane.commands.push_back(command); });
}

template <int Dim, Coordinate T>
void World<Dim, T>::remove(ObjectId id)
{
    implementation_->queue({id, 0, world::CommandKind::remove});
}

template <int Dim, Coordinate T>
void World<Dim, T>::remove(std::span<const ObjectId> ids)
{
    for (const ObjectId id : ids)
        implementation_->ids.check(id);
    implementation_->queues.with_own_lane([&](world::Lane<Dim, T>& lane) {
        world::reserve_more(lane.commands, ids.size());
        for (const ObjectId id : ids)
            lane.commands.push_back({id, 0, world::CommandKind::remove});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(ObjectId id, const Box& box, std::uint32_t sequence)
{
    world::check_box(box, id);
    implementation_->queue({id, sequence, world::CommandKind::move, box});
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(std::span<const ObjectId> ids, const Boxes& boxes, std::uint32_t sequence)
{
    world::check_sizes(ids.size(), boxes.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
        implementation_->ids.check(ids[i]);
        world::check_box(boxes[i], ids[i]);
    }
    implementation_->queues.with_own_lane([&](world::Lane<Dim, T>& lane) {
        world::reserve_more(lane.commands, ids.size());
        for (std::size_t i = 0; i < ids.size(); ++i)
            lane.commands.push_back({ids[i], sequence, world::CommandKind::move, boxes[i]});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(ObjectId id, const Box& box, Vector displacement, std::uint32_t sequence)
{
    Box moved;
    for (int d = 0; d < Dim; ++d) {
        moved.lo[d] = box.lo[d] + displacement[d];
        moved.hi[d] = box.hi[d] + displacement[d];
    }
    implementation_->ids.check(id);
    world::check_box(box, id);
    for (int d = 0; d < Dim; ++d)
        if (!(moved.lo[d] <= moved.hi[d])) {
            std::ostringstream message;
            message.imbue(std::locale::classic());
            message << "displacement of object " << id.index << ": displacement[" << d
                    << "] = " << displacement[d] << " doesn't take " << box.lo[d] << " to a number";
            throw Error(ErrorCode::nan_coordinate, message.str(), id.index);
        }
    Box packed{};
    std::copy_n(displacement, Dim, packed.lo);
    implementation_->queues.with_own_lane([&](world::Lane<Dim, T>& lane) {
        world::reserve_more(lane.commands, 2);
        lane.commands.push_back({id, sequence, world::CommandKind::move, box});
        lane.commands.push_back({id, sequence, world::CommandKind::sweep, packed});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::teleport(ObjectId id, const Box& box, std::uint32_t sequence)
{
    world::check_box(box, id);
    implementation_->queue({id, sequence, world::CommandKind::move, box});
}

template <int Dim, Coordinate T>
void World<Dim, T>::resize(ObjectId id, Vector size, std::uint32_t sequence)
{
    Box packed{};
    for (int d = 0; d < Dim; ++d) {
        if (!(size[d] >= 0)) {
            std::ostringstream message;
            message.imbue(std::locale::classic());
            message << "size of object " << id.index << ": size[" << d << "] = " << size[d]
                    << " is not a number >= 0";
            throw Error(ErrorCode::invalid_argument, message.str(), id.index);
        }
        packed.lo[d] = size[d];
    }
    implementation_->queue({id, sequence, world::CommandKind::resize, packed});
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_filter(ObjectId id, const ObjectFilter& filter, std::uint32_t sequence)
{
    implementation_->queue({id, sequence, filter});
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_margin(ObjectId id, T margin, std::uint32_t sequence)
{
    world::check_margin<T>(margin, " of object ", id.index);
    Box packed{};
    packed.lo[0] = margin;
    implementation_->queue({id, sequence, world::CommandKind::margin, packed});
}

template <int Dim, Coordinate T>
void World<Dim, T>::set_enabled(ObjectId id, bool enabled, std::uint32_t sequence)
{
    implementation_->queue(
        {id, sequence, enabled ? world::CommandKind::enable : world::CommandKind::disable});
}

// --- Update and what it found ----------------------------------------------------------------------------

template <int Dim, Coordinate T>
void World<Dim, T>::update()
{
    update({}, {});
}

template <int Dim, Coordinate T>
void World<Dim, T>::update(std::span<const ObjectId> ids, const Boxes& boxes)
{
    const InUse call(implementation_->in_use, "World");
    world::check_sizes(ids.size(), boxes.size());
    implementation_->update(ids, boxes);
}

template <int Dim, Coordinate T>
std::span<const ObjectPair> World<Dim, T>::began() const noexcept
{
    return implementation_->results[implementation_->shown].began;
}

template <int Dim, Coordinate T>
std::span<const EndedPair> World<Dim, T>::ended() const noexcept
{
    return implementation_->results[implementation_->shown].ended;
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::persisted() const noexcept
{
    return implementation_->results[implementation_->shown].persisted;
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::Implementation::changed_pairs() const
{
    const Results& last = results[shown];
    if (last.began.empty()) return last.persisted;
    if (changed_pairs_are_fresh.load(std::memory_order_acquire)) return changed_pairs_list;
    const std::lock_guard lock(changed_pairs_mutex);
    if (changed_pairs_are_fresh.load(std::memory_order_relaxed)) return changed_pairs_list;
    const std::size_t count = last.began.size() + last.persisted.size();
    const bool fits = count * sizeof(Pair) <= changed_pairs_list.bytes_reserved();
    changed_pairs_list.clear();
    PairBufferAccess access(changed_pairs_list);
    Pair* const first = access.chunk(0, fits ? count : count + count / 4).data();
    Pair* to = first;
    auto began = last.began.begin();
    const auto take_began = [&] {
        *to++ = {began->a.index, began->b.index};
        ++began;
    };
    for (const Pair& pair : last.persisted) {
        while (began != last.began.end() && Pair{began->a.index, began->b.index} < pair)
            take_began();
        *to++ = pair;
    }
    while (began != last.began.end())
        take_began();
    access.append({first, count});
    changed_pairs_are_fresh.store(true, std::memory_order_release);
    return changed_pairs_list;
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::changed_pairs() const
{
    return implementation_->changed_pairs();
}

template <int Dim, Coordinate T>
PairBuffer World<Dim, T>::pairs() const
{
    const Implementation& me = *implementation_;
    std::pmr::memory_resource* const memory = me.options.memory;
    // Static objects, of which there may be many, never pair with each other.
    std::pmr::vector<Box> boxes[2] = {std::pmr::vector<Box>(memory), std::pmr::vector<Box>(memory)};
    std::pmr::vector<std::uint32_t> index[2] = {std::pmr::vector<std::uint32_t>(memory),
                                                std::pmr::vector<std::uint32_t>(memory)};
    for (std::uint32_t i = 0; i < index_end(); ++i)
        if (const auto object = me.objects[i]; object.is_there()) {
            const bool is_static = object.has(world::flag::is_static);
            boxes[is_static].push_back(object.now());
            index[is_static].push_back(i);
        }
    PairFinder finder({me.options.executor, memory, me.options.instruction_set});
    PairBuffer found[2] = {PairBuffer(memory), PairBuffer(memory)};
    for (int other = 0; other < 2; ++other) {
        const auto select = [&](Pair* first, Pair* last) {
            Pair* kept = first;
            for (Pair* pair = first; pair != last; ++pair) {
                const std::uint32_t a = index[0][pair->a], b = index[other][pair->b];
                if (!world::passes(me.objects[a].filter(), me.objects[b].filter())) continue;
                if (!me.refused.empty() && me.refused.find(world::pair_key(a, b)) != me.refused.end())
                    continue;
                *kept++ = {std::min(a, b), std::max(a, b)};
            }
            return kept;
        };
        const std::span<const Box> moving(boxes[0]), fixed(boxes[1]);
        if (other == 0)
            PairFinderAccess::find(finder, Boxes(moving), select, found[0]);
        else
            PairFinderAccess::find(finder, Boxes(moving), Boxes(fixed), select, found[1]);
    }
    std::pmr::vector<Pair> all(memory), scratch(memory);
    all.reserve(found[0].size() + found[1].size());
    for (const PairBuffer& part : found)
        for (const std::span<const Pair> block : part.blocks())
            all.insert(all.end(), block.begin(), block.end());
    world::sort_pairs(all, scratch);
    PairBuffer result(memory);
    if (all.empty()) return result;
    PairBufferAccess access(result);
    const std::span<Pair> memory_of_result = access.chunk(0, all.size()).first(all.size());
    std::copy(all.begin(), all.end(), memory_of_result.begin());
    access.append(memory_of_result);
    return result;
}

// --- Objects ---------------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
std::size_t World<Dim, T>::size() const noexcept
{
    return implementation_->alive;
}

template <int Dim, Coordinate T>
std::uint32_t World<Dim, T>::index_end() const noexcept
{
    return static_cast<std::uint32_t>(
        std::min<std::size_t>(implementation_->ids.end(), implementation_->objects.capacity()));
}

template <int Dim, Coordinate T>
bool World<Dim, T>::contains(ObjectId id) const noexcept
{
    const Implementation& me = *implementation_;
    return me.ids.is_good(id) && id.index < me.objects.capacity() &&
           me.objects[id.index].has(world::flag::alive);
}

template <int Dim, Coordinate T>
ObjectId World<Dim, T>::id(std::uint32_t index) const noexcept
{
    const Implementation& me = *implementation_;
    if (index >= index_end() || !me.objects[index].has(world::flag::alive)) return {};
    return me.id_of(index);
}

template <int Dim, Coordinate T>
auto World<Dim, T>::box(ObjectId id) const -> Box
{
    const auto object = implementation_->checked(id);
    return object.has(world::flag::has_shape) ? implementation_->shapes[id.index].box : object.now();
}

template <int Dim, Coordinate T>
auto World<Dim, T>::bounds(ObjectId id) const -> Box
{
    return implementation_->checked(id).now();
}

template <int Dim, Coordinate T>
ObjectFilter World<Dim, T>::filter(ObjectId id) const
{
    return implementation_->checked(id).filter();
}

template <int Dim, Coordinate T>
bool World<Dim, T>::enabled(ObjectId id) const
{
    return implementation_->checked(id).has(world::flag::enabled);
}

template <int Dim, Coordinate T>
T World<Dim, T>::margin(ObjectId id) const
{
    const auto object = implementation_->checked(id);
    return object.has(world::flag::has_shape) ? implementation_->shapes[id.index].margin : T{0};
}

// --- Seeing inside ---------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
const WorldStats& World<Dim, T>::stats() const noexcept
{
    return implementation_->stats;
}

template <int Dim, Coordinate T>
std::string World<Dim, T>::explain() const
{
    const WorldStats& s = stats();
    std::ostringstream text;
    text.imbue(std::locale::classic());
    text.precision(3);
    const auto percent = [](std::uint64_t part, std::uint64_t of) {
        return of == 0 ? 0.0 : 100 * static_cast<double>(part) / static_cast<double>(of);
    };
    text << s.objects << " objects: " << s.resting << " at rest, " << s.active << " active, " << s.disabled
         << " disabled; " << s.bytes_reserved / 1024 << " KiB.\n";
    text << "The last update took " << s.us_total << " us: " << s.us_apply << " applying " << s.commands
         << " commands, " << s.us_active << " among active objects, " << s.us_resting
         << " between active and resting ones, " << s.us_events << " comparing them with those before, "
         << s.us_index << " for the index.\n";
    text << s.changed << " objects changed (" << s.woken << " woke up), " << s.settled << " came to rest; "
         << s.began << " pairs began, " << s.persisted << " persisted, " << s.ended << " ended.\n";
    text << "Of " << s.candidates << " candidates " << percent(s.false_positives, s.candidates)
         << "% were kept apart by filters.\n";
    if (s.dropped != 0)
        text << s.dropped << " commands were about objects that had been removed before their turn.\n";
    if (s.refused != 0) text << s.refused << " touching pairs are refused by accept.\n";
    if (s.candidates > 1000 && 2 * s.false_positives > s.candidates)
        text << "Slow because: filters reject most of what touches.\n";
    if (s.changed > 0 && s.persisted + s.began > 64 * s.changed)
        text << "Slow because: objects that moved touch " << (s.persisted + s.began) / s.changed
             << " others on average. A few giant boxes, or piles of boxes in one place; filter what needn't "
                "be known.\n";
    if (s.active > 1000 && s.active > 4 * s.changed)
        text << "For a while: " << s.active - s.changed
             << " objects stopped moving lately and come to rest bit by bit.\n";
    return text.str();
}

template <int Dim, Coordinate T>
void World<Dim, T>::draw(FunctionRef<void(const Box& box, DrawKind kind)> draw_box,
                         FunctionRef<void(Vector from, Vector to, DrawKind kind)> draw_line) const
{
    const Implementation& me = *implementation_;
    if (draw_box)
        for (std::uint32_t i = 0; i < index_end(); ++i) {
            const auto object = me.objects[i];
            if (!object.has(world::flag::alive)) continue;
            draw_box(object.now(), object.place() == world::Place::resting  ? DrawKind::resting
                                   : object.place() == world::Place::active ? DrawKind::active
                                                                            : DrawKind::disabled);
        }
    if (!draw_line) return;
    const auto line = [&](std::uint32_t a, std::uint32_t b, DrawKind kind) {
        T centre[2][Dim];
        for (int d = 0; d < Dim; ++d)
            for (int k = 0; k < 2; ++k) {
                const Box& box = me.objects[k == 0 ? a : b].now();
                centre[k][d] = box.lo[d] / 2 + box.hi[d] / 2;
            }
        draw_line(centre[0], centre[1], kind);
    };
    for (const ObjectPair& pair : began())
        line(pair.a.index, pair.b.index, DrawKind::began);
    for (const Pair& pair : persisted())
        line(pair.a, pair.b, DrawKind::persisted);
    for (const EndedPair& pair : ended())
        if (contains(pair.a) && contains(pair.b)) line(pair.a.index, pair.b.index, DrawKind::ended);
}

JOSTLE_NAMESPACE_END
