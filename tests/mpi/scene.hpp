// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "jostle/mpi.hpp"
#include "tests/world/churn.hpp"

/// A scene over all ranks, beside one jostle::World that each rank has for itself. All ranks draw the same
/// random commands; each gives those to the distributed world that are about its own objects.
namespace mpi_tests {

using jostle_scenes::Random;

inline int rank()
{
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}
inline int ranks()
{
    int ranks = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    return ranks;
}

/// True on all ranks or on none: a test that one rank left would leave the others waiting.
inline bool everywhere(bool good)
{
    int all = good;
    MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, MPI_COMM_WORLD);
    return all != 0;
}
inline std::uint64_t sum(std::uint64_t number)
{
    MPI_Allreduce(MPI_IN_PLACE, &number, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return number;
}

/// The lists of all ranks one after another.
template <class Item>
std::vector<Item> gathered(std::span<const Item> items)
{
    std::vector<int> counts(static_cast<std::size_t>(ranks())), starts(counts.size());
    const int count = static_cast<int>(items.size_bytes());
    MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD);
    std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
    std::vector<Item> all(static_cast<std::size_t>(starts.back() + counts.back()) / sizeof(Item));
    MPI_Allgatherv(items.data(), count, MPI_BYTE, all.data(), counts.data(), starts.data(), MPI_BYTE,
                   MPI_COMM_WORLD);
    return all;
}

template <int Dim, class T>
std::vector<jostle::mpi::Pair<Dim, T>> gathered(const jostle::mpi::PairList<Dim, T>& pairs)
{
    const std::vector<jostle::mpi::Pair<Dim, T>> all = pairs.to_vector();
    return gathered(std::span(all));
}

template <int Dim, class T>
bool same(const jostle::Aabb<Dim, T>& a, const jostle::Aabb<Dim, T>& b)
{
    for (int d = 0; d < Dim; ++d)
        if (a.lo[d] != b.lo[d] || a.hi[d] != b.hi[d]) return false;
    return true;
}

/// What every rank throws; "" where nothing is thrown. All have to say the same.
template <class Call>
std::string failure_of(const Call& call)
{
    std::string text;
    try {
        call();
    } catch (const jostle::mpi::Failure& failure) {
        text = std::to_string(failure.rank()) + " " + std::to_string(static_cast<int>(failure.cause())) +
               " " + std::to_string(static_cast<int>(failure.code())) + " " +
               std::to_string(failure.index()) + " " + failure.what();
    }
    std::string first = text;
    first.resize(2000);
    MPI_Bcast(first.data(), 2000, MPI_BYTE, 0, MPI_COMM_WORLD);
    EXPECT_EQ(std::string(first.c_str()), text) << "other ranks say something else";
    return text;
}

/// Has no memory once it has given some number of times.
class FailingMemory : public std::pmr::memory_resource
{
  public:
    std::atomic<std::int64_t> left{std::numeric_limits<std::int64_t>::max()};

  private:
    void* do_allocate(std::size_t bytes, std::size_t alignment) override
    {
        if (left.fetch_sub(1) <= 0) throw std::bad_alloc();
        return std::pmr::new_delete_resource()->allocate(bytes, alignment);
    }
    void do_deallocate(void* place, std::size_t bytes, std::size_t alignment) override
    {
        std::pmr::new_delete_resource()->deallocate(place, bytes, alignment);
    }
    bool do_is_equal(const memory_resource& other) const noexcept override { return this == &other; }
};

/// What is missing where memory runs out.
enum class Shortage
{
    of_resource, ///< from one allocation on, the world's own memory resource gives nothing
    of_one,      ///< one call of the global operator new fails
    of_all,      ///< this one and all that follow
};
/// Whether a shortage can be made here: the thread sanitizer brings an operator new that never fails.
bool can_be_made(Shortage shortage);

/// While it lives, memory runs out on this rank after some allocations.
class Starving
{
  public:
    Starving(Shortage shortage, FailingMemory& memory, std::uint64_t allocations);
    ~Starving();
    Starving(const Starving&) = delete;
    Starving& operator=(const Starving&) = delete;

  private:
    FailingMemory& memory_;
};

/// failure_of(call) where memory runs out on one rank. With nothing left at all that rank can't even have the
/// text, and throws std::bad_alloc; the others have to say what it is about.
template <class Call>
std::string starved_failure_of(const Call& call, Shortage shortage, FailingMemory& memory, int failing,
                               std::uint64_t allocations)
{
    return failure_of([&] {
        if (rank() != failing) return call();
        try {
            const Starving starving(shortage, memory, allocations);
            call();
        } catch (const std::bad_alloc&) {
            if (shortage != Shortage::of_all) throw;
            throw jostle::mpi::Failure(
                failing, jostle::mpi::FailureCause::memory, jostle::ErrorCode::invalid_argument,
                "no memory left; give it less, or the job more ranks", jostle::Error::no_index);
        }
    });
}
/// Calls call() with less and less memory on one rank, failing at each of its allocations in turn, until it
/// succeeds. After each failure check() says on each rank whether all is as it was. Returns how often it
/// failed; an answer of check() that isn't true ends it, with a failure of the test.
template <class Call, class Check>
std::uint64_t fail_at_each_allocation(const Call& call, Shortage shortage, FailingMemory& memory, int failing,
                                      const Check& check)
{
    for (std::uint64_t allocations = 0;; ++allocations) {
        const std::string failure = starved_failure_of(call, shortage, memory, failing, allocations);
        if (failure.empty()) return allocations;
        const bool is_told =
            failure.find("rank " + std::to_string(failing) + ": no memory left") != std::string::npos;
        if (everywhere(is_told && check())) continue;
        ADD_FAILURE() << "allocation " << allocations << ": " << (is_told ? "not as it was" : failure);
        return allocations;
    }
}

template <int Dim, class T>
class Scene
{
  public:
    using Box = jostle::Aabb<Dim, T>;
    using World = jostle::mpi::World<Dim, T>;
    struct Thing
    {
        jostle::ObjectId id;
        Box box;
    };
    Random random;
    double extent;
    jostle::mpi::WorldOptions options;
    std::unique_ptr<World> world;
    jostle::World<Dim, T> one;
    std::map<std::uint64_t, Thing> things; ///< by their id in the distributed world
    std::uint64_t began = 0, persisted = 0, ended[4] = {}, migrated = 0, ghosts = 0, delivered = 0;

    explicit Scene(std::uint64_t seed, double space, jostle::mpi::WorldOptions with = {})
        : random(seed),
          extent(space),
          options(with),
          world(std::make_unique<World>(MPI_COMM_WORLD, options)),
          one({.margin = with.margin})
    {
    }

    /// Ids of the distributed world ascend as the indices of the other one do.
    static std::uint64_t global(jostle::ObjectId id)
    {
        return std::uint64_t{id.index} << 40 | std::uint64_t{id.generation} << 3 | 5;
    }
    /// Adds an object on a rank, -1 for a random one.
    std::uint64_t add(const Box& box, int where = -1, jostle::ObjectOptions<T> with = {})
    {
        const int drawn = static_cast<int>(random.below(static_cast<std::uint32_t>(ranks())));
        const jostle::ObjectId id = one.add(box, with);
        if ((where < 0 ? drawn : where) == rank()) world->add(global(id), box, with);
        things[global(id)] = {id, box};
        return global(id);
    }
    template <class Call>
    void say(std::uint64_t id, const Call& call)
    {
        call(one, things.at(id).id);
        if (world->contains(id)) call(*world, id);
    }
    void move(std::uint64_t id, const Box& box)
    {
        things.at(id).box = box;
        say(id, [&](auto& each, auto name) { each.move(name, box); });
    }
    void remove(std::uint64_t id)
    {
        say(id, [](auto& each, auto name) { each.remove(name); });
        things.erase(id);
    }
    std::uint64_t any_thing()
    {
        return std::next(things.begin(), random.below(static_cast<std::uint32_t>(things.size())))->first;
    }

    /// One random command, so that there are about `target` objects in the long run.
    void operate(std::size_t target)
    {
        const std::uint32_t kind = random.below(32);
        const bool few = things.size() < target;
        if (things.empty() || (few && kind < 12)) {
            jostle::ObjectOptions<T> with;
            with.filter = world_tests::random_filter(random);
            with.enabled = random.below(8) != 0;
            if (random.below(8) == 0) with.margin = T(0.25);
            add(world_tests::random_box<Dim, T>(random, extent), -1, with);
            return;
        }
        const std::uint64_t id = any_thing();
        if (kind < (few ? 14u : 4u)) return remove(id);
        Thing& thing = things.at(id);
        if (kind < 8) return move(id, world_tests::random_box<Dim, T>(random, extent));
        if (kind < 22) {
            Box box = thing.box;
            for (int d = 0; d < Dim; ++d) {
                const T by = static_cast<T>(random.uniform(-0.3, 0.3));
                box.lo[d] += by;
                box.hi[d] += by;
                if (!(box.lo[d] <= box.hi[d])) return move(id, thing.box);
            }
            return move(id, box);
        }
        if (kind < 25) {
            jostle::Vec<Dim, T> by{};
            for (int d = 0; d < Dim; ++d)
                by[d] = static_cast<T>(random.uniform(-2, 2));
            return say(id, [&](auto& each, auto name) { each.move(name, thing.box, by); });
        }
        if (kind < 28) {
            const jostle::ObjectFilter filter = world_tests::random_filter(random);
            return say(id, [&](auto& each, auto name) { each.set_filter(name, filter); });
        }
        if (kind < 30) {
            const T margin = random.below(2) == 0 ? T(0) : T(0.5);
            return say(id, [&](auto& each, auto name) { each.set_margin(name, margin); });
        }
        const bool enabled = random.below(2) != 0;
        say(id, [&](auto& each, auto name) { each.set_enabled(name, enabled); });
    }

    /// Whose an object is, as of the last update.
    int owner(std::uint64_t id) const { return owners_.at(id); }

    /// Updates both. The same answer on all ranks.
    testing::AssertionResult update()
    {
        world->update();
        return update_after_world();
    }
    /// After the distributed world's.
    testing::AssertionResult update_after_world()
    {
        one.update();
        return everywhere(agree()) ? testing::AssertionSuccess()
                                   : testing::AssertionFailure() << (why_.empty() ? "another rank" : why_);
    }

  private:
    bool agree()
    {
        const auto began_all = gathered(world->began()), persisted_all = gathered(world->persisted()),
                   changed_all = gathered(world->changed_pairs());
        const auto ended_all = gathered(world->ended());
        const std::uint64_t objects = sum(world->size());
        std::vector<std::uint64_t> ids;
        world->ids(ids);
        std::vector<Owned> mine_now;
        for (const std::uint64_t id : ids)
            mine_now.push_back({id, rank()});
        owners_.clear();
        for (const Owned& each : gathered(std::span<const Owned>(mine_now)))
            owners_[each.id] = each.rank;
        why_.clear();
        began += began_all.size();
        persisted += persisted_all.size();
        migrated += sum(world->arrived().size());
        ghosts += sum(world->stats().ghosts);
        delivered += sum(world->stats().bytes_of_pairs);
        std::vector<jostle::Pair> pairs;
        for (const jostle::ObjectPair& pair : one.began())
            pairs.push_back({pair.a.index, pair.b.index});
        if (!are("began", began_all, pairs) ||
            !are("persisted", persisted_all, one.persisted().to_vector()) ||
            !are("changed", changed_all, one.changed_pairs().to_vector()))
            return false;
        if (!mine(world->began(), "began") || !mine(world->persisted(), "persisted")) return false;
        std::vector<jostle::mpi::EndedPair> ended_one, merged = ended_all;
        for (const jostle::EndedPair& pair : one.ended()) {
            ended_one.push_back({global(pair.a), global(pair.b), pair.reason});
            ++ended[static_cast<int>(pair.reason)];
        }
        std::sort(merged.begin(), merged.end(),
                  [](const auto& x, const auto& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
        if (merged != ended_one) {
            why_ = "ended: " + std::to_string(merged.size()) + " pairs, one world has " +
                   std::to_string(ended_one.size());
            return false;
        }
        if (objects != one.size()) why_ = std::to_string(objects) + " objects";
        if (sum(world->stats().arrived) != sum(world->stats().departed)) why_ = "objects lost on their way";
        return why_.empty();
    }
    /// The pairs of all ranks, merged, are those of one world, and so are their bounds.
    bool are(const std::string& what, std::vector<jostle::mpi::Pair<Dim, T>> all,
             const std::vector<jostle::Pair>& expected)
    {
        std::sort(all.begin(), all.end(),
                  [](const auto& x, const auto& y) { return std::pair(x.a, x.b) < std::pair(y.a, y.b); });
        if (all.size() != expected.size())
            why_ = what + ": " + std::to_string(all.size()) + " pairs, one world has " +
                   std::to_string(expected.size());
        for (std::size_t k = 0; why_.empty() && k < all.size(); ++k) {
            const jostle::ObjectId a = one.id(expected[k].a), b = one.id(expected[k].b);
            if (all[k].a != global(a) || all[k].b != global(b))
                why_ = what + ": other pairs";
            else if (!same(all[k].bounds_a, one.bounds(a)) || !same(all[k].bounds_b, one.bounds(b)))
                why_ = what + ": other bounds";
            else if (owners_.at(all[k].b) != all[k].rank_of_b)
                why_ = what + ": somebody else's";
        }
        return why_.empty();
    }
    bool mine(const jostle::mpi::PairList<Dim, T>& list, const char* what)
    {
        for (std::size_t k = 0; k < list.size(); ++k)
            if (!world->contains(list[k].a) || list[k].a >= list[k].b ||
                (k != 0 && std::pair(list[k - 1].a, list[k - 1].b) >= std::pair(list[k].a, list[k].b)))
                why_ = std::string(what) + ": not in order, or not this rank's";
        return why_.empty();
    }

    struct Owned
    {
        std::uint64_t id;
        int rank;
    };
    std::map<std::uint64_t, int> owners_; // which rank has which object
    std::string why_;
};

} // namespace mpi_tests
