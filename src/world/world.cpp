// SPDX-License-Identifier: MIT
// The interface of World: checks arguments, queues commands, returns results. Updates are in update.cpp,
// queries and snapshots in separate folders.
#include "jostle/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <string>
#include <tuple>

#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "world/implementation.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
World<Dim, T>::Implementation::Implementation(const WorldOptions& options)
    : memory(options.memory),
      queues(&memory),
      state(options, &memory),
      user_data(&memory),
      neighbour_lists(&memory),
      finder({options.executor, &memory, options.instruction_set}),
      arena(&memory),
      lists{world::Lists(&memory), world::Lists(&memory)},
      change_log(&memory),
      began_pairs(&memory),
      changed_pairs(&memory),
      active_index({options.executor, &memory, options.instruction_set})
{
    for (const QueryLayer& layer : options.layers)
        layers.push_back(std::make_unique<world::Layer<Dim, T>>(
            layer, IndexOptions{options.executor, &memory, options.instruction_set}));
    BoxIndexAccess::tree(state.resting).expect_to_come_back();
}

template <int Dim, Coordinate T>
auto World<Dim, T>::Implementation::checked(ObjectId id) const -> typename world::Objects<Dim, T>::ConstObject
{
    state.ids.check(id);
    if (!state.is_alive(id.index))
        throw Error(ErrorCode::stale_id,
                    "object " + std::to_string(id.index) + " is not in the world " +
                        (state.was_there(id.index)
                             ? "any more"
                             : "yet; its add() takes effect in the next apply() or update()"),
                    id.index);
    return state.objects[world::Index{id.index}];
}

namespace world {
namespace {

/// Concatenates text and numbers, independent of the locale.
template <class... Parts>
std::string text_of(const Parts&... parts)
{
    std::ostringstream text;
    text.imbue(std::locale::classic());
    (text << ... << parts);
    return text.str();
}

/// `whose` is an object's index if there is one.
std::string name_of(const char* whose, std::uint64_t index)
{
    return whose + (index == Error::no_index ? std::string() : std::to_string(index));
}

/// `margin`, as given, for a world of T.
template <class T>
void check_margin(double margin, const char* whose, std::uint64_t index)
{
    if (margin >= 0 && margin <= double{std::numeric_limits<T>::max()}) return;
    throw Error(ErrorCode::invalid_argument,
                text_of("margin ", margin, name_of(whose, index), "; give a number from 0 to ",
                        std::numeric_limits<T>::max()),
                index);
}

/// An object's own margin. Together with the world's it is finite, so that bounds are numbers.
template <class T>
void check_own_margin(T margin, T of_world, const char* whose, std::uint64_t index)
{
    check_margin<T>(margin, whose, index);
    if (of_world + margin <= std::numeric_limits<T>::max()) return;
    throw Error(ErrorCode::invalid_argument,
                text_of("margin ", margin, name_of(whose, index), " and the world's margin ", of_world,
                        " are together more than ", std::numeric_limits<T>::max(), "; give less"),
                index);
}

void check_layers(std::span<const QueryLayer> layers)
{
    constexpr std::size_t most = 8;
    if (layers.size() > most)
        throw Error(ErrorCode::invalid_argument, std::to_string(layers.size()) +
                                                     " layers; each has indexes to keep, give at most " +
                                                     std::to_string(most));
    for (std::size_t k = 0; k < layers.size(); ++k)
        if (layers[k].category == ~0u && layers[k].mask == ~0u)
            throw Error(ErrorCode::invalid_argument,
                        "layer " + std::to_string(k) +
                            " has all bits in category and mask, as queries about all objects have; drop it",
                        k);
}

/// Throws unless there is an id for each box, and the boxes are valid.
template <int Dim, class T>
void check_view(std::size_t ids, const BoxView<Dim, T>& boxes)
{
    check_one_id_each(ids, boxes.size());
    check_pointers(boxes);
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
World<Dim, T>::World(const WorldOptions& options)
{
    check_memory(options.memory);
    world::check_margin<T>(options.margin, " of the world", Error::no_index);
    world::check_layers(options.layers);
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
void World<Dim, T>::add_many(const Boxes& boxes, std::span<ObjectId> ids, std::span<const Options> options,
                             bool one_each)
{
    implementation_->add(boxes, ids, options, one_each);
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::add(const BoxView<Dim, T>& boxes, std::span<ObjectId> ids,
                                        std::span<const ObjectOptions<T>> options, bool one_each)
{
    world::check_view(ids.size(), boxes);
    if (one_each && options.size() != boxes.size())
        throw Error(ErrorCode::size_mismatch, std::to_string(options.size()) + " options for " +
                                                  std::to_string(boxes.size()) +
                                                  " boxes; give one for each, or one for all");
    check_boxes_of(boxes, "to be added ");
    if (one_each)
        for (std::size_t i = 0; i < options.size(); ++i)
            world::check_own_margin<T>(options[i].margin, state.margin, " of new object ", i);
    else
        world::check_own_margin<T>(options[0].margin, state.margin, " of new objects", Error::no_index);
    check_own();
    const auto of = [&](std::size_t i) -> const ObjectOptions<T>& { return options[one_each ? i : 0]; };
    const auto has_data = [](const ObjectOptions<T>& each) { return each.user_data != 0; };
    queues.with_own_queue([&](world::Queue<Dim, T>& queue) {
        world::reserve_more(queue.additions, ids.size());
        state.ids.take(ids, [&](std::span<const ObjectId> taken) {
            if (user_data.any() || std::any_of(options.begin(), options.end(), has_data))
                user_data.set(taken, [&](std::size_t i) { return of(i).user_data; });
        });
        for (std::size_t i = 0; i < ids.size(); ++i)
            queue.additions.push_back({ids[i], boxes[i], of(i)});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::check_own() const
{
    if (follows)
        throw Error(ErrorCode::invalid_argument,
                    "this World is a view that follows another one: it only answers queries; change the "
                    "other one, or make this one a world again by clear() or restore()");
}

template <int Dim, Coordinate T>
void World<Dim, T>::Implementation::queue(const world::Command<Dim, T>& command)
{
    check_own();
    state.ids.check(command.id);
    queues.with_own_queue([&](world::Queue<Dim, T>& queue) { queue.commands.push_back(command); });
}

template <int Dim, Coordinate T>
void World<Dim, T>::remove(ObjectId id)
{
    implementation_->queue({id, 0, world::CommandKind::remove});
}

template <int Dim, Coordinate T>
void World<Dim, T>::remove(std::span<const ObjectId> ids)
{
    implementation_->check_own();
    for (const ObjectId id : ids)
        implementation_->state.ids.check(id);
    implementation_->queues.with_own_queue([&](world::Queue<Dim, T>& queue) {
        world::reserve_more(queue.commands, ids.size());
        for (const ObjectId id : ids)
            queue.commands.push_back({id, 0, world::CommandKind::remove});
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
    world::check_view(ids.size(), boxes);
    implementation_->check_own();
    for (std::size_t i = 0; i < ids.size(); ++i) {
        implementation_->state.ids.check(ids[i]);
        world::check_box(boxes[i], ids[i]);
    }
    implementation_->queues.with_own_queue([&](world::Queue<Dim, T>& queue) {
        world::reserve_more(queue.commands, ids.size());
        for (std::size_t i = 0; i < ids.size(); ++i)
            queue.commands.push_back({ids[i], sequence, world::CommandKind::move, boxes[i]});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::move(ObjectId id, const Box& box, const Vector& displacement, std::uint32_t sequence)
{
    Box moved;
    for (int d = 0; d < Dim; ++d) {
        moved.lo[d] = box.lo[d] + displacement[d];
        moved.hi[d] = box.hi[d] + displacement[d];
    }
    implementation_->check_own();
    implementation_->state.ids.check(id);
    world::check_box(box, id);
    for (int d = 0; d < Dim; ++d)
        if (!(moved.lo[d] <= moved.hi[d]))
            throw Error(ErrorCode::nan_coordinate,
                        world::text_of("displacement of object ", id.index, ": displacement[", d, "] ") +
                            (std::isnan(displacement[d])
                                 ? "is NaN; give a number"
                                 : world::text_of("= ", displacement[d],
                                                  " moves a bound to NaN; give a finite number")),
                        id.index);
    Box packed{};
    packed.lo = displacement;
    implementation_->queues.with_own_queue([&](world::Queue<Dim, T>& queue) {
        world::reserve_more(queue.commands, 2);
        queue.commands.push_back({id, sequence, world::CommandKind::move, box});
        queue.commands.push_back({id, sequence, world::CommandKind::sweep, packed});
    });
}

template <int Dim, Coordinate T>
void World<Dim, T>::resize(ObjectId id, const Vector& size, std::uint32_t sequence)
{
    Box packed{};
    for (int d = 0; d < Dim; ++d) {
        if (!(size[d] >= 0))
            throw Error(ErrorCode::invalid_argument,
                        world::text_of("size of object ", id.index, ": size[", d, "] = ", size[d],
                                       " is not a number >= 0"),
                        id.index);
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
    world::check_own_margin<T>(margin, implementation_->state.margin, " of object ", id.index);
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

template <int Dim, Coordinate T>
void World<Dim, T>::report_again(ObjectId id)
{
    implementation_->queue({id, 0, world::CommandKind::report});
}

template <int Dim, Coordinate T>
void World<Dim, T>::report_again(ObjectId a, ObjectId b)
{
    implementation_->check_own();
    implementation_->state.ids.check(b);
    implementation_->queue({a, b});
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
    const InUse call = implementation_->users.change();
    implementation_->check_own();
    world::check_view(ids.size(), boxes);
    if (!implementation_->applied) return implementation_->update({ids, boxes});
    move(ids, boxes); // so that nothing fails in the middle of what may have to be undone
    implementation_->update({});
}

template <int Dim, Coordinate T>
void World<Dim, T>::apply()
{
    const InUse call = implementation_->users.change();
    implementation_->check_own();
    implementation_->apply_ahead();
}

template <int Dim, Coordinate T>
std::span<const ObjectPair> World<Dim, T>::began() const noexcept
{
    return implementation_->last_lists().began;
}

template <int Dim, Coordinate T>
std::span<const EndedPair> World<Dim, T>::ended() const noexcept
{
    return implementation_->last_lists().ended;
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::persisted() const noexcept
{
    return implementation_->last_lists().persisted;
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::began_pairs() const
{
    return implementation_->began_pairs.of(implementation_->last_lists().began, nullptr);
}

template <int Dim, Coordinate T>
const PairBuffer& World<Dim, T>::changed_pairs() const
{
    const world::Lists& lists = implementation_->last_lists();
    if (lists.began.empty()) return lists.persisted;
    return implementation_->changed_pairs.of(lists.began, &lists.persisted);
}

template <int Dim, Coordinate T>
void World<Dim, T>::clear()
{
    std::unique_ptr<Implementation> fresh; // in the end the old one, which must outlive its `call`
    const InUse call = implementation_->users.change();
    fresh = std::make_unique<Implementation>(implementation_->state.options);
    implementation_.swap(fresh);
}

// --- User data ---

template <int Dim, Coordinate T>
void World<Dim, T>::set_user_data(ObjectId id, std::uint64_t data)
{
    implementation_->check_own();
    implementation_->state.ids.check(id);
    implementation_->user_data.set(id.index, data);
}

template <int Dim, Coordinate T>
std::uint64_t World<Dim, T>::user_data(ObjectId id) const
{
    implementation_->check_own();
    if (implementation_->state.ids.is_good(id)) return implementation_->user_data.of(id.index);
    if (const std::uint64_t* data = implementation_->user_data.of_removed(id)) return *data;
    implementation_->state.ids.throw_stale(id);
}

template <int Dim, Coordinate T>
void World<Dim, T>::user_data(std::span<const ObjectId> ids, std::span<std::uint64_t> out) const
{
    if (ids.size() != out.size())
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(ids.size()) +
                                                  " ids and room for the data of " +
                                                  std::to_string(out.size()) + "; give room for one each");
    for (std::size_t i = 0; i < ids.size(); ++i)
        out[i] = user_data(ids[i]);
}

// --- Objects ---------------------------------------------------------------------------------------------

template <int Dim, Coordinate T>
std::size_t World<Dim, T>::size() const noexcept
{
    const auto& [state, applied] = std::tie(implementation_->state, implementation_->applied);
    return state.alive + (state.shown != nullptr ? applied->added - applied->removed : 0);
}

template <int Dim, Coordinate T>
std::uint32_t World<Dim, T>::index_end() const noexcept
{
    return implementation_->state.index_end();
}

template <int Dim, Coordinate T>
bool World<Dim, T>::contains(ObjectId id) const noexcept
{
    const world::State<Dim, T>& state = implementation_->state;
    return state.ids.is_good(id) && state.is_alive(id.index);
}

template <int Dim, Coordinate T>
ObjectId World<Dim, T>::id(std::uint32_t index) const noexcept
{
    const world::State<Dim, T>& state = implementation_->state;
    return state.is_alive(index) ? state.id_of(world::Index{index}) : ObjectId{};
}

template <int Dim, Coordinate T>
auto World<Dim, T>::box(ObjectId id) const -> Box
{
    (void)implementation_->checked(id);
    return implementation_->state.objects.box(world::Index{id.index});
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
    const bool has_reach = implementation_->checked(id).has(world::flag::has_reach);
    return has_reach ? implementation_->state.objects.reach(world::Index{id.index}).margin : T{0};
}

template <int Dim, Coordinate T>
const WorldStats& World<Dim, T>::stats() const noexcept
{
    return implementation_->stats;
}

#define JOSTLE_INSTANTIATE(Dim, T) template class World<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
