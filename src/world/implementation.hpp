// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/users.hpp"
#include "index/queries/check.hpp"
#include "jostle/world.hpp"
#include "world/kept/change_log.hpp"
#include "world/kept/following_index.hpp"
#include "world/kept/journal.hpp"
#include "world/kept/on_demand.hpp"
#include "world/objects/pair_lists.hpp"
#include "world/objects/state.hpp"
#include "world/objects/user_data.hpp"
#include "world/update/arena.hpp"
#include "world/update/changes.hpp"
#include "world/update/commands.hpp"
#include "world/update/neighbour_lists.hpp"
#include "world/update/writer.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

template <int Dim, class T>
struct Rest;
class Refusals;

/// The pairs that began, by index, alone or in one list with those that persist. Made on demand.
class ListedPairs
{
  public:
    explicit ListedPairs(std::pmr::memory_resource* memory) : list_(memory) {}
    const PairBuffer& of(const std::pmr::vector<ObjectPair>& began, const PairBuffer* persisted);
    void forget() noexcept { made_.forget(); }

  private:
    OnDemand made_;
    PairBuffer list_;
};

/// The statistics of a world, except those of the last update.
template <int Dim, class T>
[[nodiscard]] WorldStats describe(const State<Dim, T>& state, const Lists& lists);

/// How far a view has followed, and its working memory.
template <int Dim, class T>
struct Following
{
    explicit Following(std::pmr::memory_resource* memory)
        : touched(memory), changed(memory), gone(memory), come(memory), come_boxes(memory)
    {
    }
    ChangeLog::Position position;
    std::pmr::vector<std::uint32_t> touched;    // objects that may have changed
    std::pmr::vector<Index> changed;            // those that have
    std::pmr::vector<std::uint32_t> gone, come; // from and to the index of resting objects
    std::pmr::vector<Aabb<Dim, T>> come_boxes;
};

} // namespace world

/// docs/inside/world.md describes how it works.
namespace world {
template <int Dim, class T>
class Asking;
template <int Dim, class T>
class AskingMany;
} // namespace world

template <int Dim, Coordinate T>
struct World<Dim, T>::Implementation
{
    // The interface for queries: see index/queries/verbs.hpp.
    using Asking = world::Asking<Dim, T>;
    using AskingMany = world::AskingMany<Dim, T>;
    using Filters = detail::QueryFilters<ObjectQueryFilter>;
    using JoinVisitor = typename World::JoinVisitor;
    using ClosestVisitor = typename World::ClosestVisitor;

    explicit Implementation(const WorldOptions& options);

    [[nodiscard]] Executor& executor() const noexcept { return *state.executor; }
    /// One set of options for all, or one for each box.
    void add(const BoxView<Dim, T>& boxes, std::span<ObjectId> ids, std::span<const ObjectOptions<T>> options,
             bool one_each);
    template <class Allocator>
    void join(const BoxView<Dim, T>& boxes, std::vector<Pair, Allocator>& out, const Filters& filters);
    bool visit_joined(const BoxView<Dim, T>& boxes, JoinVisitor visitor, const Filters& filters) const;
    bool closest_pairs(const Implementation& other, ClosestVisitor visitor, T max_distance) const;

    void queue(const world::Command<Dim, T>& command);
    /// Throws if this is a view of another world.
    void check_own() const;
    /// What queries see of these may have changed: after an update or apply(), or because that is undone.
    void note(std::span<const world::Index> changed, std::span<const std::uint32_t> settling) noexcept;
    /// Resting objects have changed as well: after an update.
    void note_resting(std::span<const std::uint32_t> rested,
                      std::span<const std::uint32_t> settling) noexcept;
    /// In update.cpp: an update, stage by stage, and what can be done ahead of one for queries.
    void update(const world::Moves<Dim, T>& moves);
    void begin_changes();
    void note_removals();
    void commit(const world::Entries<Dim, T>& entries, const world::Rest<Dim, T>& rest,
                world::Refusals& refusals, world::Lists& next) noexcept;
    void apply_ahead();
    /// Queues again what was applied, and restores the state after the last update.
    void take_back() noexcept;
    /// In snapshot.cpp: saves the whole world with these ids, which are State::picture_ids().
    [[nodiscard]] std::vector<std::byte> save(const world::IdTable::Picture& ids) const;
    /// After a restore: finds the pairs that the last update would have left.
    void recall_pairs();
    /// The same, once, if it hasn't been done yet.
    void recall_if_due();
    [[nodiscard]] typename world::Objects<Dim, T>::ConstObject checked(ObjectId id) const;
    [[nodiscard]] const world::Lists& last_lists() const noexcept { return lists[last]; }
    [[nodiscard]] world::Lists& last_lists() noexcept { return lists[last]; }
    [[nodiscard]] std::uint64_t bytes() const noexcept { return sizeof *this + memory.bytes(); }

    mutable Users users{"World", "queue commands there, and update the world afterwards"};
    world::CountedMemory memory; // of all members below; results for users are allocated in theirs

    world::Queues<Dim, T> queues;
    world::State<Dim, T> state;
    world::UserData user_data;
    world::NeighbourLists<Dim, T> neighbour_lists;
    PairFinder finder;
    world::Arena arena;
    std::optional<world::Applied<Dim, T>> applied; // since the last update; during an update, by it
    world::Lists lists[2];                         // of the last update and, during an update, of that one
    std::uint32_t last = 0;                        // which of them is the last update's
    WorldStats stats;
    std::optional<world::Journal<Dim, T>> journal; // in a world with a base
    bool recall_is_due = false;
    world::ChangeLog change_log;                     // for views of this world
    std::optional<world::Following<Dim, T>> follows; // in a view

    mutable world::ListedPairs began_pairs, changed_pairs;
    mutable world::FollowingIndex<Dim, T> active_index;        // of active objects
    std::vector<std::unique_ptr<world::Layer<Dim, T>>> layers; // those that the options declare
};

JOSTLE_NAMESPACE_END
