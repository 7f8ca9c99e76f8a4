// SPDX-License-Identifier: MIT
// Queries. Those about all objects go to the ranks whose regions they may reach, and what is found there
// comes back. An object that several of these ranks search is reported by the lowest of them: all can work
// out who that is, as with pairs.
#include "queries.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>

#include "agreement.hpp"
#include "clock.hpp"
#include "implementation.hpp"
#include "jostle/box_index.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
namespace {

/// Calls work(i, ranks) for i in [first, last) on the executor's threads, each of which has a list of ranks
/// to work with.
template <class Work>
void for_each_of(Executor& executor, std::pmr::memory_resource* memory, std::size_t first, std::size_t last,
                 const Work& work)
{
    constexpr std::size_t at_a_time = 8;
    std::atomic<std::size_t> next{first};
    std::mutex mutex;
    std::exception_ptr thrown;
    const auto task = [&](std::uint32_t) {
        try {
            Ranks ranks(memory);
            for (;;) {
                const std::size_t begin = next.fetch_add(at_a_time);
                if (begin >= last) return;
                for (std::size_t i = begin; i < std::min(begin + at_a_time, last); ++i)
                    work(i, ranks);
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            thrown = std::current_exception();
        }
    };
    const std::size_t tasks =
        std::min<std::size_t>(executor.concurrency(), (last - first + at_a_time - 1) / at_a_time);
    if (tasks > 1)
        executor.run(static_cast<std::uint32_t>(tasks), task);
    else if (tasks == 1)
        task(0);
    if (thrown) std::rethrow_exception(thrown);
}

/// The part that two boxes share.
template <int Dim, class T>
Reach<Dim> common(const Reach<Dim>& reach, const Aabb<Dim, T>& bounds) noexcept
{
    Reach<Dim> both;
    for (int d = 0; d < Dim; ++d) {
        both.lo[d] = std::max(reach.lo[d], double{bounds.lo[d]});
        both.hi[d] = std::min(reach.hi[d], double{bounds.hi[d]});
    }
    return both;
}

/// One collective call. `Item` is what is found: Found, ObjectHit, or a number that counts.
template <int Dim, Coordinate T, class Query, class Item>
class Inquiry
{
  public:
    using Own = typename World<Dim, T>::Implementation;
    using Items = std::pmr::vector<Item>;

    Inquiry(Own& own, Purpose purpose, std::span<const Query> queries, const Filters& filters,
            std::uint64_t most)
        : own_(own),
          purpose_(purpose),
          queries_(queries),
          filters_(filters),
          most_(most),
          found_(own.options.memory),
          asked_(own.options.memory)
    {
    }

    /// `room`: places for answers, one for each query. Calls give(i, items, more) for each query.
    template <class Give>
    void run(std::size_t room, const Give& give)
    {
        Clock total;
        own_.query_stats = {.asked = queries_.size()};
        Agreement agreement(own_.handle);
        agreement.attempt([&] {
            check(room);
            own_.region.recover(own_.partition);
            found_.resize(queries_.size());
        });
        agree(agreement);
        try {
            if constexpr (is_near) {
                const auto home = [&](const Query& query) {
                    return own_.partition.at_middle_of(Form<Query>::asker(query));
                };
                ask(agreement, [&](std::size_t i, Ranks& ranks, T&) {
                    if (queries_[i].count != 0) ranks.assign(1, home(queries_[i]));
                });
                ask(agreement, [&](std::size_t i, Ranks& ranks, T& limit) {
                    const Query& query = queries_[i];
                    if (query.count == 0) return;
                    double distance = query.max_distance;
                    if (const Items& near = found_[i]; near.size() >= query.count) {
                        limit = near.back().at;
                        distance = std::min(distance, std::sqrt(double{limit}));
                    }
                    own_.partition.touched(reach_around(Form<Query>::asker(query), distance), ranks);
                    std::erase(ranks, home(query));
                });
            } else
                ask(agreement, [&](std::size_t i, Ranks& ranks, T&) {
                    own_.partition.touched(Form<Query>::reach(queries_[i]), ranks);
                });
            agreement.attempt([&] {
                for (std::size_t i = 0; i < queries_.size(); ++i)
                    give(i, found_[i], merge(found_[i], wanted(queries_[i], most_)));
            });
            wait([&] { agreement.settle(); });
        } catch (...) {
            own_.exchange.clear();
            throw;
        }
        own_.query_stats.us_total = total.lap();
    }

  private:
    static constexpr bool is_near = requires(const Query& query) { query.count; };
    static constexpr bool is_count = std::is_same_v<Item, std::uint64_t>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();

    /// A query that has come to this rank, also from itself.
    struct Asked
    {
        int source;
        std::uint32_t number; ///< there
        Query query;
        Planes<Dim, T> planes;
        QueryFilter filter;
        T limit;            ///< nothing is wanted that is further away
        std::uint64_t most; ///< nor more than these
        Items items;
    };

    /// As jostle::BoxIndex does, also where there is nothing to be found.
    void check(std::size_t room) const
    {
        if (room != queries_.size()) detail::throw_not_one_each(queries_.size(), room, "places for answers");
        filters_.check(queries_.size());
        if (queries_.size() > ~std::uint32_t{0})
            throw Error(ErrorCode::too_many_objects,
                        std::to_string(queries_.size()) + " queries; give at most 4294967295 at a time");
        const BoxIndex<Dim, T> nothing({.executor = &serial_executor(), .memory = own_.options.memory});
        if constexpr (is_near) {
            jostle::ResultLists<jostle::Hit<T>> lists(own_.options.memory);
            nothing.nearest(queries_, lists);
        } else {
            std::pmr::vector<std::uint64_t> counts(queries_.size(), own_.options.memory);
            nothing.count(queries_, std::span<std::uint64_t>(counts));
        }
    }

    /// Whether all ranks ask for the same.
    void agree(Agreement& agreement)
    {
        const double mine = static_cast<double>(purpose_) * 16 + query_code();
        double extremes[] = {mine, -mine};
        wait([&] { agreement.settle(extremes); });
        agreement.attempt([&] {
            if (extremes[0] != -extremes[1])
                throw Error(ErrorCode::invalid_argument,
                            "ranks ask for different things at a time; all of them make the same calls, in "
                            "the same order, if need be without a query");
        });
        if (agreement.failed()) agreement.settle(); // on all ranks
    }
    static constexpr int query_code()
    {
        return std::is_same_v<Query, Ray<Dim, T>>       ? 1
               : std::is_same_v<Query, Sweep<Dim, T>>   ? 2
               : std::is_same_v<Query, Aabb<Dim, T>>    ? 3
               : std::is_same_v<Query, Sphere<Dim, T>>  ? 4
               : std::is_same_v<Query, Frustum<Dim, T>> ? 5
               : std::is_same_v<Query, Nearest<Dim, T>> ? 6
                                                        : 7;
    }

    /// How many answers decide: one more than are given, where it is told whether there are more.
    [[nodiscard]] std::uint64_t wanted(const Query& query, std::uint64_t most) const
    {
        if (purpose_ == Purpose::first) return 1;
        if constexpr (is_near)
            return query.count;
        else
            return most == ~std::uint64_t{0} ? most : most + 1;
    }

    /// Two exchanges: route(i, ranks, limit) says whom query i goes to.
    template <class Route>
    void ask(Agreement& agreement, const Route& route)
    {
        Exchange& exchange = own_.exchange;
        agreement.attempt([&] {
            asked_.clear();
            for (std::size_t i = 0; i < queries_.size(); ++i) {
                T limit = infinity;
                own_.is.clear();
                route(i, own_.is, limit);
                for (const int rank : own_.is) {
                    Exchange::Bytes& bytes = exchange.to(rank);
                    put(bytes, std::uint8_t{1});
                    put(bytes, static_cast<std::uint32_t>(i));
                    Form<Query>::write(bytes, queries_[i]);
                    put(bytes, filters_[i]);
                    put(bytes, limit);
                    put(bytes, most_);
                }
            }
            exchange.seal();
        });
        start(agreement);
        agreement.attempt([&] {
            hear(own_.rank, exchange.to_myself());
            answer(0); // while others' queries are on their way
        });
        wait([&] { exchange.finish(agreement); });
        agreement.attempt([&] {
            const std::size_t answered = asked_.size();
            for (const Exchange::Message& message : exchange.received())
                hear(message.source, message.bytes);
            answer(answered);
        });
        exchange.clear();
        own_.query_stats.answered += asked_.size();
        agreement.attempt([&] {
            for (const Asked& asked : asked_) {
                if (asked.items.empty()) continue;
                Exchange::Bytes& bytes = exchange.to(asked.source);
                put(bytes, std::uint8_t{1});
                put(bytes, asked.number);
                put(bytes, std::uint64_t{asked.items.size()});
                for (const Item& item : asked.items)
                    put(bytes, item);
            }
            exchange.seal();
        });
        start(agreement);
        agreement.attempt([&] { hear_answers(exchange.to_myself()); });
        wait([&] { exchange.finish(agreement); });
        agreement.attempt([&] {
            for (const Exchange::Message& message : exchange.received())
                hear_answers(message.bytes);
            if constexpr (is_near)
                for (std::size_t i = 0; i < queries_.size(); ++i)
                    merge(found_[i], queries_[i].count);
        });
        exchange.clear();
    }

    void start(const Agreement& agreement)
    {
        own_.exchange.start(agreement);
        own_.query_stats.messages += own_.exchange.messages_sent();
        own_.query_stats.bytes += own_.exchange.bytes_sent();
    }
    template <class Call>
    void wait(const Call& call)
    {
        Clock clock;
        call();
        own_.query_stats.us_wait += clock.lap();
    }
    void hear(int source, std::span<const std::byte> message)
    {
        for (Reader from(message); !from.empty() && from.take<std::uint8_t>() != 0;) {
            std::pmr::memory_resource* const memory = own_.options.memory;
            Asked& asked = asked_.emplace_back(Asked{
                source, from.take<std::uint32_t>(), {}, Planes<Dim, T>(memory), {}, {}, {}, Items(memory)});
            Form<Query>::read(from, asked.query, asked.planes);
            take(from, asked.filter);
            asked.limit = from.take<T>();
            asked.most = from.take<std::uint64_t>();
        }
    }
    void hear_answers(std::span<const std::byte> message)
    {
        for (Reader from(message); !from.empty() && from.take<std::uint8_t>() != 0;) {
            Items& items = found_[from.take<std::uint32_t>()];
            for (auto left = from.take<std::uint64_t>(); left != 0; --left)
                take(from, items.emplace_back());
        }
    }
    /// Those from this one on.
    void answer(std::size_t first)
    {
        for_each_of(*own_.executor, own_.options.memory, first, asked_.size(),
                    [&](std::size_t i, Ranks& ranks) { answer_one(asked_[i], ranks); });
    }

    void answer_one(Asked& asked, Ranks& ranks) const
    {
        const Region<Dim, T>& region = own_.region;
        Query query = asked.query;
        if constexpr (std::is_same_v<Query, Frustum<Dim, T>>) query.planes = asked.planes;
        ObjectQueryFilter filter{asked.filter.category, asked.filter.mask, asked.filter.owner, {}, {}};
        if (asked.filter.exclude) filter.exclude = region.local(*asked.filter.exclude);
        const std::uint64_t most = wanted(query, asked.most);
        if constexpr (is_near) {
            query.count = ~std::uint32_t{0}; // as many as are as near as the last one
            visit_best(query, filter, asked.limit, most, asked.items);
        } else {
            const Reach<Dim> reach = Form<Query>::reach(query);
            const auto is_reported = [&](std::uint32_t, ObjectId id) {
                own_.partition.touched(common(reach, region.bounds(id)), ranks);
                return ranks.front() == own_.rank;
            };
            if (purpose_ != Purpose::first) filter.accept = is_reported;
            if constexpr (is_count) {
                if (const std::uint64_t count = region.searched().count(query, filter); count != 0)
                    asked.items.push_back(count);
            } else if constexpr (std::is_same_v<Item, Found>) {
                region.searched().visit(
                    query, [&](ObjectId id) { return asked.items.push_back(region.found(id)), true; },
                    filter);
            } else
                visit_best(query, filter, infinity, most, asked.items);
        }
        if constexpr (!is_count) cut(asked.items, most);
    }
    /// The first `most` that are no further than limit, and those that are as far as the last of them: which
    /// of these are the first by id is seen later.
    template <class Line>
    void visit_best(const Line& line, const ObjectQueryFilter& filter, T limit, std::uint64_t most,
                    Items& items) const
    {
        if constexpr (std::is_same_v<Item, ObjectHit<T>>) {
            own_.region.searched().visit(
                line,
                [&](const jostle::Hit<T, jostle::ObjectId>& hit, T& bound) {
                    if (hit.at > limit) return false;
                    const Found found = own_.region.found(hit.id);
                    items.push_back({found.id, found.rank, hit.at});
                    if (items.size() >= most) limit = bound = items[static_cast<std::size_t>(most) - 1].at;
                    return true;
                },
                filter);
        }
    }
    static void cut(Items& items, std::uint64_t most)
    {
        std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return earlier(a, b); });
        if (items.size() > most) items.resize(static_cast<std::size_t>(most));
    }

    /// Answers of several ranks become one list. Says whether there are more than may be given.
    bool merge(Items& items, std::uint64_t most) const
    {
        if constexpr (is_count) {
            std::uint64_t sum = 0;
            for (const std::uint64_t each : items)
                sum += each;
            items.assign(1, sum);
            return false;
        } else {
            cut(items, ~std::uint64_t{0});
            // What is near, or first, may have come from each rank that searches it.
            items.erase(std::unique(items.begin(), items.end()), items.end());
            const bool limited = purpose_ == Purpose::all && items.size() > most_;
            cut(items, limited ? most_ : most);
            return limited;
        }
    }

    Own& own_;
    Purpose purpose_;
    std::span<const Query> queries_;
    const Filters& filters_;
    std::uint64_t most_;
    std::pmr::vector<Items> found_; // by query
    std::pmr::vector<Asked> asked_;
};

} // namespace

// --- About all objects -----------------------------------------------------------------------------------

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::Implementation::first(std::span<const Line> lines, std::span<ObjectHit<T>> out,
                                          const Filters& filters)
{
    Inquiry<Dim, T, Line, ObjectHit<T>> inquiry(*this, Purpose::first, lines, filters, 1);
    inquiry.run(out.size(), [&](std::size_t i, const auto& items, bool) {
        out[i] = items.empty() ? ObjectHit<T>{} : items.front();
    });
}
template <int Dim, Coordinate T>
template <class Query, class Item>
void World<Dim, T>::Implementation::list(Purpose purpose, std::span<const Query> queries, Answers<Item>& out,
                                         const Filters& filters, std::uint64_t most)
{
    out.clear();
    Inquiry<Dim, T, Query, Item> inquiry(*this, purpose, queries, filters, most);
    inquiry.run(queries.size(), [&](std::size_t, const auto& items, bool more) {
        out.items_.insert(out.items_.end(), items.begin(), items.end());
        out.more_.push_back(more);
        out.ends_.push_back(out.items_.size());
    });
}
template <int Dim, Coordinate T>
template <class Query>
void World<Dim, T>::Implementation::count(std::span<const Query> queries, std::span<std::uint64_t> out,
                                          const Filters& filters)
{
    Inquiry<Dim, T, Query, std::uint64_t> inquiry(*this, Purpose::count, queries, filters, 0);
    inquiry.run(out.size(), [&](std::size_t i, const auto& items, bool) { out[i] = items.front(); });
}

template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::first(std::span<const Line> lines, std::span<ObjectHit<T>> out,
                          const Filters& filters) const
{
    implementation_->first(lines, out, filters);
}
template <int Dim, Coordinate T>
template <class Line>
void World<Dim, T>::all(std::span<const Line> lines, Answers<ObjectHit<T>>& out, const Filters& filters,
                        std::uint64_t max_results) const
{
    implementation_->list(Purpose::all, lines, out, filters, max_results);
}
template <int Dim, Coordinate T>
template <class Region>
void World<Dim, T>::all(std::span<const Region> regions, Answers<Found>& out, const Filters& filters,
                        std::uint64_t max_results) const
{
    implementation_->list(Purpose::all, regions, out, filters, max_results);
}
template <int Dim, Coordinate T>
template <class Near>
void World<Dim, T>::nearest(std::span<const Near> queries, Answers<ObjectHit<T>>& out,
                            const Filters& filters) const
{
    implementation_->list(Purpose::nearest, queries, out, filters, no_limit);
}
template <int Dim, Coordinate T>
template <class Query>
void World<Dim, T>::count(std::span<const Query> queries, std::span<std::uint64_t> out,
                          const Filters& filters) const
{
    implementation_->count(queries, out, filters);
}

// --- About this rank's -----------------------------------------------------------------------------------

template <int Dim, Coordinate T>
template <class Line>
std::optional<ObjectHit<T>> World<Dim, T>::first_owned(const Line& line, const QueryFilter& filter) const
{
    std::vector<ObjectHit<T>> hits;
    (void)all_owned(line, hits, filter, 1);
    return hits.empty() ? std::nullopt : std::optional(hits.front());
}
template <int Dim, Coordinate T>
template <class Line>
bool World<Dim, T>::all_owned(const Line& line, std::vector<ObjectHit<T>>& out, const QueryFilter& filter,
                              std::uint64_t max_results) const
{
    return implementation_->ask_owned(out, filter, [&](const auto& index, auto& found, const auto& wanted) {
        return index.all(line, found, wanted, max_results);
    });
}
template <int Dim, Coordinate T>
template <class Region>
bool World<Dim, T>::all_owned(const Region& region, std::vector<Found>& out, const QueryFilter& filter,
                              std::uint64_t max_results) const
{
    return implementation_->ask_owned(out, filter, [&](const auto& index, auto& found, const auto& wanted) {
        return index.all(region, found, wanted, max_results);
    });
}
template <int Dim, Coordinate T>
template <class Near>
void World<Dim, T>::nearest_owned(const Near& query, std::vector<ObjectHit<T>>& out,
                                  const QueryFilter& filter) const
{
    (void)implementation_->ask_owned(out, filter, [&](const auto& index, auto& found, const auto& wanted) {
        index.nearest(query, found, wanted);
        return false;
    });
}
template <int Dim, Coordinate T>
template <class Query>
std::uint64_t World<Dim, T>::count_owned(const Query& query, const QueryFilter& filter) const
{
    Implementation& own = *implementation_;
    return own.owned_index.with(own.owned, own.margin, filter, [&](const auto& index, const auto& wanted) {
        return index.count(query, wanted);
    });
}

// What queries there are, for each kind of world.
#define JOSTLE_LINE(Dim, T, Line)                                                                            \
    template void World<Dim, T>::first(std::span<const Line<Dim, T>>, std::span<ObjectHit<T>>,               \
                                       const Filters&) const;                                                \
    template void World<Dim, T>::all(std::span<const Line<Dim, T>>, Answers<ObjectHit<T>>&, const Filters&,  \
                                     std::uint64_t) const;                                                   \
    template void World<Dim, T>::count(std::span<const Line<Dim, T>>, std::span<std::uint64_t>,              \
                                       const Filters&) const;                                                \
    template std::optional<ObjectHit<T>> World<Dim, T>::first_owned(const Line<Dim, T>&, const QueryFilter&) \
        const;                                                                                               \
    template bool World<Dim, T>::all_owned(const Line<Dim, T>&, std::vector<ObjectHit<T>>&,                  \
                                           const QueryFilter&, std::uint64_t) const;                         \
    template std::uint64_t World<Dim, T>::count_owned(const Line<Dim, T>&, const QueryFilter&) const;
#define JOSTLE_REGION(Dim, T, Region)                                                                        \
    template void World<Dim, T>::all(std::span<const Region<Dim, T>>, Answers<Found>&, const Filters&,       \
                                     std::uint64_t) const;                                                   \
    template void World<Dim, T>::count(std::span<const Region<Dim, T>>, std::span<std::uint64_t>,            \
                                       const Filters&) const;                                                \
    template bool World<Dim, T>::all_owned(const Region<Dim, T>&, std::vector<Found>&, const QueryFilter&,   \
                                           std::uint64_t) const;                                             \
    template std::uint64_t World<Dim, T>::count_owned(const Region<Dim, T>&, const QueryFilter&) const;
#define JOSTLE_NEAR(Dim, T, Near)                                                                            \
    template void World<Dim, T>::nearest(std::span<const Near<Dim, T>>, Answers<ObjectHit<T>>&,              \
                                         const Filters&) const;                                              \
    template void World<Dim, T>::nearest_owned(const Near<Dim, T>&, std::vector<ObjectHit<T>>&,              \
                                               const QueryFilter&) const;
#define JOSTLE_WORLD(Dim, T)                                                                                 \
    JOSTLE_LINE(Dim, T, Ray)                                                                                 \
    JOSTLE_LINE(Dim, T, Sweep)                                                                               \
    JOSTLE_REGION(Dim, T, Aabb)                                                                              \
    JOSTLE_REGION(Dim, T, Sphere)                                                                            \
    JOSTLE_REGION(Dim, T, Frustum)                                                                           \
    JOSTLE_NEAR(Dim, T, Nearest)                                                                             \
    JOSTLE_NEAR(Dim, T, NearestToBox)
JOSTLE_WORLD(2, float)
JOSTLE_WORLD(2, double)
JOSTLE_WORLD(3, float)
JOSTLE_WORLD(3, double)

} // namespace mpi
JOSTLE_NAMESPACE_END
