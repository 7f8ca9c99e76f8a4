// SPDX-License-Identifier: MIT
// Decides which command wins if several threads, or commands with a sequence, set the same property of an
// object. First the result of each queue alone is computed, then the queues are compared property by
// property. So a queue's result doesn't depend on the others, nor the winner on the order of the queues.
#include <algorithm>
#include <array>
#include <cstring>

#include "base/instantiate.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// A property that may have been set.
template <class Value>
struct Setting
{
    bool is_given = false;
    std::uint32_t sequence = 0;
    Value value = {};

    /// Within a queue: whether a command with this sequence sets it. Of equal sequences the later command
    /// wins.
    bool takes(std::uint32_t of_command) noexcept
    {
        if (is_given && of_command < sequence) return false;
        is_given = true;
        sequence = of_command;
        return true;
    }
    /// Between queues: the greater sequence wins, and of equal ones the greater value, in any fixed order.
    template <class Greater>
    void compete(const Setting& other, const Greater& is_greater) noexcept
    {
        const bool wins = other.is_given && (!is_given || other.sequence > sequence ||
                                             (other.sequence == sequence && is_greater(other.value, value)));
        if (wins) *this = other;
    }
};

/// The resulting properties of one object.
template <int Dim, class T>
struct Settings
{
    struct Position
    {
        Aabb<Dim, T> box;
        T displacement[Dim];
    };
    Setting<Position> position;
    Setting<ObjectFilter> filter;
    Setting<T> margin; // without the world's
    Setting<bool> enabled;

    void compete(const Settings& other) noexcept
    {
        // Any choice will do that doesn't depend on which came first.
        position.compete(other.position, [](const Position& x, const Position& y) {
            return std::memcmp(&x, &y, sizeof x) > 0;
        });
        const auto numbers = [](const ObjectFilter& f) {
            return std::array<std::uint32_t, 4>{f.category, f.mask, f.owner, f.is_static ? 1u : 0u};
        };
        filter.compete(other.filter,
                       [&](const ObjectFilter& x, const ObjectFilter& y) { return numbers(x) > numbers(y); });
        margin.compete(other.margin, std::greater<T>());
        enabled.compete(other.enabled, [](bool x, bool) { return x; });
    }
};

/// A contested object: the result of the current queue, and what wins so far.
template <int Dim, class T>
struct Contest
{
    Index index;
    bool is_removed;                     // which beats everything
    std::uint32_t queue = 0, queues = 0; // the current one, and how many had commands
    Settings<Dim, T> of_queue = {}, best = {};
};

template <int Dim, class T>
class Contests
{
  public:
    Contests(State<Dim, T>& state, Changes<Dim, T>& changes, Writer<Dim, T>& writer, Arena& arena)
        : state_(state),
          changes_(changes),
          writer_(writer),
          contests_(arena.list<Contest<Dim, T>>("contested objects")),
          place_of_(arena.take<Table<Index, std::uint32_t>>("places of contested objects")),
          additions_(arena.list<const Addition<Dim, T>*>("additions of contested objects"))
    {
    }

    void gather(const Queues<Dim, T>& queues)
    {
        place_of_.grow(state_.objects.capacity());
        for (const Index index : changes_.objects())
            if (state_.objects[index].has(flag::contested)) {
                place_of_[index] = static_cast<std::uint32_t>(contests_.size());
                contests_.push_back({index, !state_.objects[index].has(flag::alive)});
            }
        for (const Contest<Dim, T>& contest : contests_)
            writer_.touch(contest.index);
        for (const Queue<Dim, T>* queue = queues.first(); queue != nullptr; queue = queue->next)
            for (const Addition<Dim, T>& addition : queue->taken_additions)
                if (is_contested(addition.id)) additions_.push_back(&addition);
        std::sort(additions_.begin(), additions_.end(),
                  [](const auto* x, const auto* y) { return x->id.index < y->id.index; });
    }

    void settle(const Queues<Dim, T>& queues, const Moves<Dim, T>& moves, std::uint32_t own_queue)
    {
        // The caller's queue last, since the moves continue from its result.
        const Queue<Dim, T>* own = nullptr;
        for (const Queue<Dim, T>* queue = queues.first(); queue != nullptr; queue = queue->next) {
            if (queue->number == own_queue)
                own = queue;
            else
                hear(*queue);
        }
        if (own != nullptr) hear(*own);
        for (std::size_t i = 0; i < moves.ids.size(); ++i)
            if (is_contested(moves.ids[i]))
                obey({moves.ids[i], 0, CommandKind::move, moves.boxes[i]}, own_queue);
        changes_.contested = 0;
        for (Contest<Dim, T>& contest : contests_) {
            contest.best.compete(contest.of_queue);
            restart(contest.index);
            write(contest.index, contest.best);
            if (contest.is_removed) state_.objects[contest.index].set(flag::alive, false);
            changes_.contested += contest.queues > 1 ? 1 : 0;
        }
    }

  private:
    [[nodiscard]] bool is_contested(ObjectId id) const noexcept
    {
        return state_.ids.is_good(id) && state_.objects[Index{id.index}].has(flag::contested);
    }
    /// Starts from the object's old state, or its state when added.
    void restart(Index index)
    {
        const auto addition =
            std::partition_point(additions_.begin(), additions_.end(),
                                 [index](const auto* each) { return each->id.index < raw(index); });
        if (addition != additions_.end() && (*addition)->id.index == raw(index))
            writer_.add(**addition);
        else
            changes_.reset(index);
    }
    void hear(const Queue<Dim, T>& queue)
    {
        for (const Command<Dim, T>& command : queue.taken_commands)
            if (is_contested(command.id)) obey(command, queue.number);
    }
    void obey(const Command<Dim, T>& command, std::uint32_t queue)
    {
        Contest<Dim, T>& contest = contests_[place_of_[Index{command.id.index}]];
        if (contest.queue != queue) {
            contest.best.compete(contest.of_queue);
            contest.of_queue = {};
            contest.queue = queue;
            ++contest.queues;
            restart(contest.index);
        }
        Settings<Dim, T>& settings = contest.of_queue;
        switch (command.kind) {
        case CommandKind::remove: // settle() has handled it
        case CommandKind::report: // no other command can contradict it
        case CommandKind::report_pair:
            break;
        case CommandKind::move:
        case CommandKind::sweep:
        case CommandKind::resize:
            if (!settings.position.takes(command.sequence)) break;
            writer_.apply(command); // its effect depends on the box so far
            settings.position.value = position_of(Index{command.id.index});
            break;
        case CommandKind::filter:
            if (settings.filter.takes(command.sequence)) settings.filter.value = command.filter;
            break;
        case CommandKind::margin:
            if (settings.margin.takes(command.sequence)) settings.margin.value = command.box.lo[0];
            break;
        case CommandKind::enable:
        case CommandKind::disable:
            if (settings.enabled.takes(command.sequence))
                settings.enabled.value = command.kind == CommandKind::enable;
            break;
        }
    }
    [[nodiscard]] typename Settings<Dim, T>::Position position_of(Index index) const noexcept
    {
        typename Settings<Dim, T>::Position position{state_.objects.box(index), {}};
        if (state_.objects[index].has(flag::has_reach))
            std::copy_n(state_.objects.reach(index).displacement, Dim, position.displacement);
        return position;
    }
    void write(Index index, const Settings<Dim, T>& settings)
    {
        if (settings.filter.is_given) writer_.set_filter(index, settings.filter.value);
        if (settings.margin.is_given) writer_.set_margin(index, state_.margin + settings.margin.value);
        if (settings.position.is_given) {
            const auto& [box, displacement] = settings.position.value;
            writer_.set_box(index, box);
            if (std::any_of(displacement, displacement + Dim, [](T by) { return by != 0; }))
                writer_.set_displacement(index, displacement);
        }
        if (settings.enabled.is_given) state_.objects[index].set(flag::enabled, settings.enabled.value);
    }

    State<Dim, T>& state_;
    Changes<Dim, T>& changes_;
    Writer<Dim, T>& writer_;
    std::pmr::vector<Contest<Dim, T>>& contests_;
    Table<Index, std::uint32_t>& place_of_; // of contested objects only
    std::pmr::vector<const Addition<Dim, T>*>& additions_;
};

} // namespace

template <int Dim, class T>
void settle_contests(State<Dim, T>& state, Changes<Dim, T>& changes, Writer<Dim, T>& writer,
                     const Queues<Dim, T>& queues, const Moves<Dim, T>& moves, std::uint32_t own_queue,
                     Arena& arena)
{
    changes.sort_filters();
    changes.sort_reaches();
    Contests<Dim, T> contests(state, changes, writer, arena);
    contests.gather(queues);
    contests.settle(queues, moves, own_queue);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template void settle_contests(State<Dim, T>&, Changes<Dim, T>&, Writer<Dim, T>&, const Queues<Dim, T>&,  \
                                  const Moves<Dim, T>&, std::uint32_t, Arena&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
