// SPDX-License-Identifier: MIT
// Questions. Those about all objects go to the ranks whose regions they may reach, and what is found there
// comes back. An object that several of these ranks search is reported by the lowest of them: all can work
// out who that is, as with pairs.
#include "questions.hpp"

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
template <int Dim, Coordinate T, class Question, class Item>
class Inquiry
{
  public:
    using Own = typename World<Dim, T>::Implementation;
    using Items = std::pmr::vector<Item>;

    Inquiry(Own& own, Purpose purpose, std::span<const Question> questions, const Filters& filters,
            std::uint64_t most)
        : own_(own),
          purpose_(purpose),
          questions_(questions),
          filters_(filters),
          most_(most),
          found_(own.options.memory),
          asked_(own.options.memory)
    {
    }

    /// `room`: places for answers, one for each question. Calls give(i, items, more) for each question.
    template <class Give>
    void run(std::size_t room, const Give& give)
    {
        Clock total;
        own_.question_stats = {.asked = questions_.size()};
        Agreement agreement(own_.handle);
        agreement.attempt([&] {
            check(room);
            own_.region.recover(own_.partition);
            found_.resize(questions_.size());
        });
        agree(agreement);
        try {
            if constexpr (is_near) {
                const auto home = [&](const Question& question) {
                    return own_.partition.at_middle_of(Form<Question>::asker(question));
                };
                ask(agreement, [&](std::size_t i, Ranks& ranks, T&) {
                    if (questions_[i].count != 0) ranks.assign(1, home(questions_[i]));
                });
                ask(agreement, [&](std::size_t i, Ranks& ranks, T& limit) {
                    const Question& question = questions_[i];
                    if (question.count == 0) return;
                    double distance = question.max_distance;
                    if (const Items& near = found_[i]; near.size() >= question.count) {
                        limit = near.back().at;
                        distance = std::min(distance, std::sqrt(double{limit}));
                    }
                    own_.partition.touched(reach_around(Form<Question>::asker(question), distance), ranks);
                    std::erase(ranks, home(question));
                });
            } else
                ask(agreement, [&](std::size_t i, Ranks& ranks, T&) {
                    own_.partition.touched(Form<Question>::reach(questions_[i]), ranks);
                });
            agreement.attempt([&] {
                for (std::size_t i = 0; i < questions_.size(); ++i)
                    give(i, found_[i], merge(found_[i], wanted(questions_[i], most_)));
            });
            wait([&] { agreement.settle(); });
        } catch (...) {
            own_.exchange.clear();
            throw;
        }
        own_.question_stats.us_total = total.lap();
    }

  private:
    static constexpr bool is_near = requires(const Question& question) { question.count; };
    static constexpr bool is_count = std::is_same_v<Item, std::uint64_t>;
    static constexpr T infinity = std::numeric_limits<T>::infinity();

    /// A question that has come to this rank, also from itself.
    struct Asked
    {
        int source;
        std::uint32_t number; ///< there
        Question question;
        Planes<Dim, T> planes;
        QueryFilter filter;
        T limit;            ///< nothing is wanted that is further away
        std::uint64_t most; ///< nor more than these
        Items items;
    };

    /// As jostle::BoxIndex does, also where there is nothing to be found.
    void check(std::size_t room) const
    {
        if (room != questions_.size())
            detail::throw_not_one_each(questions_.size(), room, "places for answers");
        filters_.check(questions_.size());
        if (questions_.size() > ~std::uint32_t{0})
            throw Error(ErrorCode::too_many_objects,
                        std::to_string(questions_.size()) + " questions; give at most 4294967295 at a time");
        const BoxIndex<Dim, T> nothing({.executor = &serial_executor(), .memory = own_.options.memory});
        if constexpr (is_near) {
            jostle::ResultLists<jostle::Hit<T>> lists(own_.options.memory);
            nothing.nearest(questions_, lists);
        } else {
            std::pmr::vector<std::uint64_t> counts(questions_.size(), own_.options.memory);
            nothing.count(questions_, std::span<std::uint64_t>(counts));
        }
    }

    /// Whether all ranks ask for the same.
    void agree(Agreement& agreement)
    {
        const double mine = static_cast<double>(purpose_) * 16 + question_code();
        double extremes[] = {mine, -mine};
        wait([&] { agreement.settle(extremes); });
        agreement.attempt([&] {
            if (extremes[0] != -extremes[1])
                throw Error(ErrorCode::invalid_argument,
                            "ranks ask for different things at a time; all of them make the same calls, in "
                            "the same order, if need be without a question");
        });
        if (agreement.failed()) agreement.settle(); // on all ranks
    }
    static constexpr int question_code()
    {
        return std::is_same_v<Question, Ray<Dim, T>>       ? 1
               : std::is_same_v<Question, Sweep<Dim, T>>   ? 2
               : std::is_same_v<Question, Aabb<Dim, T>>    ? 3
               : std::is_same_v<Question, Sphere<Dim, T>>  ? 4
               : std::is_same_v<Question, Frustum<Dim, T>> ? 5
               : std::is_same_v<Question, Nearest<Dim, T>> ? 6
                                                           : 7;
    }

    /// How many answers decide: one more than are given, where it is told whether there are more.
    [[nodiscard]] std::uint64_t wanted(const Question& question, std::uint64_t most) const
    {
        if (purpose_ == Purpose::first) return 1;
        if constexpr (is_near)
            return question.count;
        else
            return most == ~std::uint64_t{0} ? most : most + 1;
    }

    /// Two exchanges: route(i, ranks, limit) says whom question i goes to.
    template <class Route>
    void ask(Agreement& agreement, const Route& route)
    {
        Exchange& exchange = own_.exchange;
        agreement.attempt([&] {
            asked_.clear();
            for (std::size_t i = 0; i < questions_.size(); ++i) {
                T limit = infinity;
                own_.is.clear();
                route(i, own_.is, limit);
                for (const int rank : own_.is) {
                    Exchange::Bytes& bytes = exchange.to(rank);
                    put(bytes, std::uint8_t{1});
                    put(bytes, static_cast<std::uint32_t>(i));
                    Form<Question>::write(bytes, questions_[i]);
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
            answer(0); // while others' questions are on their way
        });
        wait([&] { exchange.finish(agreement); });
        agreement.attempt([&] {
            const std::size_t answered = asked_.size();
            for (const Exchange::Message& message : exchange.received())
                hear(message.source, message.bytes);
            answer(answered);
        });
        exchange.clear();
        own_.question_stats.answered += asked_.size();
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
                for (std::size_t i = 0; i < questions_.size(); ++i)
                    merge(found_[i], questions_[i].count);
        });
        exchange.clear();
    }

    void start(const Agreement& agreement)
    {
        own_.exchange.start(agreement);
        own_.question_stats.messages += own_.exchange.messages_sent();
        own_.question_stats.bytes += own_.exchange.bytes_sent();
    }
    template <class Call>
    void wait(const Call& call)
    {
        Clock clock;
        call();
        own_.question_stats.us_wait += clock.lap();
    }
    void hear(int source, std::span<const std::byte> message)
    {
        for (Reader from(message); !from.empty() && from.take<std::uint8_t>() != 0;) {
            std::pmr::memory_resource* const memory = own_.options.memory;
            Asked& asked = asked_.emplace_back(Asked{
                source, from.take<std::uint32_t>(), {}, Planes<Dim, T>(memory), {}, {}, {}, Items(memory)});
            Form<Question>::read(from, asked.question, asked.planes);
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
        Question question = asked.question;
        if constexpr (std::is_same_v<Question, Frustum<Dim, T>>) question.planes = asked.planes;
        ObjectQueryFilter filter{asked.filter.category, asked.filter.mask, asked.filter.owner, {}, {}};
        if (asked.filter.exclude) filter.exclude = region.local(*asked.filter.exclude);
        const std::uint64_t most = wanted(question, asked.most);
        if constexpr (is_near) {
            question.count = ~std::uint32_t{0}; // as many as are as near as the last one
            visit_best(question, filter, asked.limit, most, asked.items);
        } else {
            const Reach<Dim> reach = Form<Question>::reach(question);
            const auto is_reported = [&](std::uint32_t, ObjectId id) {
                own_.partition.touched(common(reach, region.bounds(id)), ranks);
                return ranks.front() == own_.rank;
            };
            if (purpose_ != Purpose::first) filter.accept = is_reported;
            if constexpr (is_count) {
                if (const std::uint64_t count = region.searched().count(question, filter); count != 0)
                    asked.items.push_back(count);
            } else if constexpr (std::is_same_v<Item, Found>) {
                region.searched().visit(
                    question, [&](ObjectId id) { return asked.items.push_back(region.found(id)), true; },
                    filter);
            } else
                visit_best(question, filter, infinity, most, asked.items);
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
    std::span<const Question> questions_;
    const Filters& filters_;
    std::uint64_t most_;
    std::pmr::vector<Items> found_; // by question
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
template <class Question, class Item>
void World<Dim, T>::Implementation::list(Purpose purpose, std::span<const Question> questions,
                                         Answers<Item>& out, const Filters& filters, std::uint64_t most)
{
    out.clear();
    Inquiry<Dim, T, Question, Item> inquiry(*this, purpose, questions, filters, most);
    inquiry.run(questions.size(), [&](std::size_t, const auto& items, bool more) {
        out.items_.insert(out.items_.end(), items.begin(), items.end());
        out.more_.push_back(more);
        out.ends_.push_back(out.items_.size());
    });
}
template <int Dim, Coordinate T>
template <class Question>
void World<Dim, T>::Implementation::count(std::span<const Question> questions, std::span<std::uint64_t> out,
                                          const Filters& filters)
{
    Inquiry<Dim, T, Question, std::uint64_t> inquiry(*this, Purpose::count, questions, filters, 0);
    inquiry.run(out.size(), [&](std::size_t i, const auto& items, bool) { out[i] = items.front(); });
}

// With one filter for all questions, and with one for each.
#define JOSTLE_QUESTIONS(Given)                                                                              \
    template <int Dim, Coordinate T>                                                                         \
    template <class Line>                                                                                    \
    void World<Dim, T>::first(std::span<const Line> lines, std::span<ObjectHit<T>> out, Given filter) const  \
    {                                                                                                        \
        implementation_->first(lines, out, Filters(filter));                                                 \
    }                                                                                                        \
    template <int Dim, Coordinate T>                                                                         \
    template <class Line>                                                                                    \
    void World<Dim, T>::all(std::span<const Line> lines, Answers<ObjectHit<T>>& out, Given filter,           \
                            std::uint64_t max_results) const                                                 \
    {                                                                                                        \
        implementation_->list(Purpose::all, lines, out, Filters(filter), max_results);                       \
    }                                                                                                        \
    template <int Dim, Coordinate T>                                                                         \
    template <class Region>                                                                                  \
    void World<Dim, T>::all(std::span<const Region> regions, Answers<Found>& out, Given filter,              \
                            std::uint64_t max_results) const                                                 \
    {                                                                                                        \
        implementation_->list(Purpose::all, regions, out, Filters(filter), max_results);                     \
    }                                                                                                        \
    template <int Dim, Coordinate T>                                                                         \
    template <class Near>                                                                                    \
    void World<Dim, T>::nearest(std::span<const Near> questions, Answers<ObjectHit<T>>& out, Given filter)   \
        const                                                                                                \
    {                                                                                                        \
        implementation_->list(Purpose::nearest, questions, out, Filters(filter), no_limit);                  \
    }                                                                                                        \
    template <int Dim, Coordinate T>                                                                         \
    template <class Question>                                                                                \
    void World<Dim, T>::count(std::span<const Question> questions, std::span<std::uint64_t> out,             \
                              Given filter) const                                                            \
    {                                                                                                        \
        implementation_->count(questions, out, Filters(filter));                                             \
    }
JOSTLE_QUESTIONS(const QueryFilter&)
JOSTLE_QUESTIONS(FilterOfEach)
#undef JOSTLE_QUESTIONS

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
void World<Dim, T>::nearest_owned(const Near& question, std::vector<ObjectHit<T>>& out,
                                  const QueryFilter& filter) const
{
    (void)implementation_->ask_owned(out, filter, [&](const auto& index, auto& found, const auto& wanted) {
        index.nearest(question, found, wanted);
        return false;
    });
}
template <int Dim, Coordinate T>
template <class Question>
std::uint64_t World<Dim, T>::count_owned(const Question& question, const QueryFilter& filter) const
{
    Implementation& own = *implementation_;
    return own.owned_index.with(own.owned, own.margin, filter, [&](const auto& index, const auto& wanted) {
        return index.count(question, wanted);
    });
}

// What questions there are, for each kind of world.
#define JOSTLE_LINE(Dim, T, Line, Given)                                                                     \
    template void World<Dim, T>::first(std::span<const Line<Dim, T>>, std::span<ObjectHit<T>>, Given) const; \
    template void World<Dim, T>::all(std::span<const Line<Dim, T>>, Answers<ObjectHit<T>>&, Given,           \
                                     std::uint64_t) const;                                                   \
    template void World<Dim, T>::count(std::span<const Line<Dim, T>>, std::span<std::uint64_t>, Given) const;
#define JOSTLE_REGION(Dim, T, Region, Given)                                                                 \
    template void World<Dim, T>::all(std::span<const Region<Dim, T>>, Answers<Found>&, Given, std::uint64_t) \
        const;                                                                                               \
    template void World<Dim, T>::count(std::span<const Region<Dim, T>>, std::span<std::uint64_t>, Given)     \
        const;
#define JOSTLE_NEAR(Dim, T, Near, Given)                                                                     \
    template void World<Dim, T>::nearest(std::span<const Near<Dim, T>>, Answers<ObjectHit<T>>&, Given) const;
#define JOSTLE_ABOUT_ALL(Dim, T, Given)                                                                      \
    JOSTLE_LINE(Dim, T, Ray, Given)                                                                          \
    JOSTLE_LINE(Dim, T, Sweep, Given)                                                                        \
    JOSTLE_REGION(Dim, T, Aabb, Given)                                                                       \
    JOSTLE_REGION(Dim, T, Sphere, Given)                                                                     \
    JOSTLE_REGION(Dim, T, Frustum, Given)                                                                    \
    JOSTLE_NEAR(Dim, T, Nearest, Given)                                                                      \
    JOSTLE_NEAR(Dim, T, NearestToBox, Given)
#define JOSTLE_LINE_OWNED(Dim, T, Line)                                                                      \
    template std::optional<ObjectHit<T>> World<Dim, T>::first_owned(const Line<Dim, T>&, const QueryFilter&) \
        const;                                                                                               \
    template bool World<Dim, T>::all_owned(const Line<Dim, T>&, std::vector<ObjectHit<T>>&,                  \
                                           const QueryFilter&, std::uint64_t) const;                         \
    template std::uint64_t World<Dim, T>::count_owned(const Line<Dim, T>&, const QueryFilter&) const;
#define JOSTLE_REGION_OWNED(Dim, T, Region)                                                                  \
    template bool World<Dim, T>::all_owned(const Region<Dim, T>&, std::vector<Found>&, const QueryFilter&,   \
                                           std::uint64_t) const;                                             \
    template std::uint64_t World<Dim, T>::count_owned(const Region<Dim, T>&, const QueryFilter&) const;
#define JOSTLE_NEAR_OWNED(Dim, T, Near)                                                                      \
    template void World<Dim, T>::nearest_owned(const Near<Dim, T>&, std::vector<ObjectHit<T>>&,              \
                                               const QueryFilter&) const;
#define JOSTLE_WORLD(Dim, T)                                                                                 \
    JOSTLE_ABOUT_ALL(Dim, T, const QueryFilter&)                                                             \
    JOSTLE_ABOUT_ALL(Dim, T, FilterOfEach)                                                                   \
    JOSTLE_LINE_OWNED(Dim, T, Ray)                                                                           \
    JOSTLE_LINE_OWNED(Dim, T, Sweep)                                                                         \
    JOSTLE_REGION_OWNED(Dim, T, Aabb)                                                                        \
    JOSTLE_REGION_OWNED(Dim, T, Sphere)                                                                      \
    JOSTLE_REGION_OWNED(Dim, T, Frustum)                                                                     \
    JOSTLE_NEAR_OWNED(Dim, T, Nearest)                                                                       \
    JOSTLE_NEAR_OWNED(Dim, T, NearestToBox)
JOSTLE_WORLD(2, float)
JOSTLE_WORLD(2, double)
JOSTLE_WORLD(3, float)
JOSTLE_WORLD(3, double)

} // namespace mpi
JOSTLE_NAMESPACE_END
