// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <utility>
#include <vector>

#include "directory.hpp"
#include "exchange.hpp"
#include "lists.hpp"
#include "owned.hpp"
#include "owned_index.hpp"
#include "partition.hpp"
#include "queries.hpp"
#include "rebalancing.hpp"
#include "region.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// What a piece of a message tells, about which object comes next; bytes that fill it up at its end are 0.
enum class Kind : std::uint8_t
{
    end,
    notice,    ///< to a region
    added,     ///< to the directory
    removed,   ///< to the directory
    migrating, ///< to the new rank of an object
    began,
    persisted,
    ended,
};

/// A communicator of our own, so that our messages meet no one else's.
class Communicator
{
  public:
    explicit Communicator(MPI_Comm from)
    {
        MPI_Comm_dup(from, &comm_);
        // A rank that is lost ends the job with a message: the others couldn't go on without its objects.
        MPI_Comm_set_errhandler(comm_, MPI_ERRORS_ARE_FATAL);
    }
    Communicator() = default;
    Communicator& operator=(Communicator&& from) noexcept
    {
        std::swap(comm_, from.comm_);
        return *this;
    }
    ~Communicator()
    {
        int ended = 0;
        MPI_Finalized(&ended);
        if (comm_ != MPI_COMM_NULL && ended == 0) MPI_Comm_free(&comm_);
    }
    [[nodiscard]] MPI_Comm get() const noexcept { return comm_; }

  private:
    MPI_Comm comm_ = MPI_COMM_NULL;
};

[[noreturn]] inline void throw_not_here(std::uint64_t id)
{
    throw Error(
        ErrorCode::stale_id,
        "object " + std::to_string(id) +
            " isn't this rank's: give commands about it on the rank that owns it, where contains() is true",
        id);
}

template <int Dim, Coordinate T>
struct World<Dim, T>::Implementation final : PairListener<Dim, T>
{
    using Entry = typename Owned<Dim, T>::Entry;

    Implementation(MPI_Comm given_comm, const WorldOptions& given, Executor* given_executor)
        : handle(given_comm),
          options(given),
          executor(given_executor),
          margin(static_cast<T>(given.margin)),
          rank(rank_in(handle)),
          owned(given.memory),
          owned_index(executor, given.memory),
          region(rank, executor, given.memory, given.layers),
          directory(given.memory),
          exchange(handle, given.memory),
          lists(given.memory),
          coming(given.memory),
          was(given.memory),
          is(given.memory)
    {
        MPI_Comm_size(handle, &ranks);
    }
    static int rank_in(MPI_Comm comm) noexcept
    {
        int found = 0;
        MPI_Comm_rank(comm, &found);
        return found;
    }

    Communicator comm; ///< given once all ranks have agreed; it goes last
    MPI_Comm handle;   ///< the same
    WorldOptions options;
    Executor* executor;
    T margin;
    int rank, ranks = 1;
    std::exception_ptr noted; ///< what was wrong with a command, the first one since the last update
    Owned<Dim, T> owned;
    OwnedIndex<Dim, T> owned_index;
    Region<Dim, T> region;
    Directory directory;
    Partition partition;
    Exchange exchange;
    Rebalancing rebalancing;
    Lists<Dim, T> lists, coming; ///< of the last update, and of the one under way
    WorldStats stats;
    QueryStats query_stats;
    Ranks was, is;                  ///< working memory of route()
    std::vector<std::byte> payload; ///< of one object; a std::vector because the user's `pack` gets it

    /// Calls command(); what it throws the next update will tell.
    template <class Command>
    void note(const Command& command) noexcept
    {
        try {
            command();
        } catch (...) {
            if (!noted) noted = std::current_exception();
        }
    }
    /// An object as of the last update.
    [[nodiscard]] Object<Dim, T> now(std::uint64_t id) const
    {
        const Entry* const found = owned.find(id);
        if (found == nullptr || !owned.exists(*found)) throw_not_here(id);
        return owned.now(*found);
    }
    /// One that commands may be about.
    [[nodiscard]] const Entry& entry(std::uint64_t id) const
    {
        const Entry* const found = owned.find(id);
        if (found == nullptr || !found->exists) throw_not_here(id);
        return *found;
    }

    /// A command that changes something besides an object's box.
    template <class Change>
    void change(std::uint64_t id, const Change& how) noexcept
    {
        note([&] { owned.change_details(entry(id), how); });
    }

    [[nodiscard]] PairList<Dim, T> shown(const ListedPairs<Dim, T>& pairs) const noexcept
    {
        return {pairs.places, region.shown(), pairs.told.data()};
    }
    void began(int to, const Pair<Dim, T>& pair) override { send(to, Kind::began, pair); }
    void persisted(int to, const Pair<Dim, T>& pair) override { send(to, Kind::persisted, pair); }
    void ended(int to, const EndedPair& pair) override
    {
        Exchange::Bytes& bytes = begin(to, Kind::ended, pair.a);
        put_short(bytes, pair.b - pair.a);
        put(bytes, static_cast<std::uint8_t>(pair.reason));
    }
    /// Ids as the steps from one to the next: most come in their order, and few bytes say the rest.
    Exchange::Bytes& begin(int to, Kind kind, std::uint64_t id)
    {
        Exchange::Bytes& bytes = exchange.to(to);
        std::uint64_t& last = exchange.last_id(to);
        put(bytes, static_cast<std::uint8_t>(kind));
        put_short(bytes, step_to(id, last));
        last = id;
        return bytes;
    }
    void send(int to, Kind kind, const Pair<Dim, T>& pair)
    {
        Exchange::Bytes& bytes = begin(to, kind, pair.a);
        put_short(bytes, pair.b - pair.a);
        put_near(bytes, pair.bounds_b, pair.bounds_a); // the receiver owns a, so that it knows its bounds
        put_short(bytes, static_cast<std::uint32_t>(pair.rank_of_b));
    }

    // Queries about all objects.

    template <class Line>
    void first(std::span<const Line> lines, std::span<ObjectHit<T>> out, const Filters& filters);
    template <class Query, class Item>
    void list(Purpose purpose, std::span<const Query> queries, Answers<Item>& out, const Filters& filters,
              std::uint64_t most);
    template <class Query>
    void count(std::span<const Query> queries, std::span<std::uint64_t> out, const Filters& filters);

    /// ask(index, found, filter) refills `found`, of the index's ids, which become `out`. Returns what that
    /// returns.
    template <class Item, class Ask>
    bool ask_owned(std::vector<Item>& out, const QueryFilter& given, const Ask& ask)
    {
        constexpr bool is_hit = std::is_same_v<Item, ObjectHit<T>>;
        std::vector<std::conditional_t<is_hit, Hit<T>, std::uint32_t>> found;
        out.clear();
        const bool more = owned_index.with(owned, margin, given, [&](const auto& index, const auto& filter) {
            return ask(index, found, filter);
        });
        for (const auto& each : found)
            if constexpr (is_hit)
                out.push_back({owned_index.id(each.id), rank, each.at});
            else
                out.push_back({owned_index.id(each), rank});
        return more;
    }

    // The steps of an update.

    void update();
    void collect(WeightedPoints& points) const;
    void stage(const Partition& now, bool divided);
    void route(std::uint64_t id, const State<Dim, T>& before, const State<Dim, T>& after, int home,
               const Partition& now, bool divided);
    void send_away(std::uint64_t id, const Object<Dim, T>& object, int home);
    void hear(std::span<const std::byte> message);
    void hear_pairs(std::span<const std::byte> message);
};

} // namespace mpi
JOSTLE_NAMESPACE_END
