// SPDX-License-Identifier: MIT
// The same random commands and questions to worlds in C++ and in C, with every feature at once: views, accept
// that changes its mind, worlds updated inside another's accept, margins, changes, forks, stale ids.
#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using jostle::Aabb;
using jostle::Coordinate;
using jostle::EndedPair;
using jostle::Frustum;
using jostle::Hit;
using jostle::Nearest;
using jostle::NearestToBox;
using jostle::ObjectFilter;
using jostle::ObjectId;
using jostle::ObjectPair;
using jostle::ObjectQueryFilter;
using jostle::Plane;
using jostle::Ray;
using jostle::ResultLists;
using jostle::Sphere;
using jostle::Sweep;
using jostle::Vec;
using jostle::World;
using Bytes = std::vector<std::byte>;

jostle_id to_c(ObjectId id)
{
    return id.generation == 0 ? 0 : std::uint64_t{id.generation} << 32 | id.index;
}
std::vector<jostle_id> to_c(const std::vector<ObjectId>& ids)
{
    std::vector<jostle_id> out;
    for (const ObjectId id : ids)
        out.push_back(to_c(id));
    return out;
}

/// Numbers of things: none, and those beside powers of two.
constexpr std::size_t counts[] = {0, 1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 32, 33, 63, 64, 65};

template <int Dim, Coordinate T>
class Stream
{
  public:
    static constexpr jostle_space space =
        Dim == 2 ? (sizeof(T) == 4 ? JOSTLE_2F : JOSTLE_2D) : (sizeof(T) == 4 ? JOSTLE_3F : JOSTLE_3D);
    using Box = Aabb<Dim, T>;

    /// A world of each interface, and what its accept knows.
    struct Both
    {
        struct Asked
        {
            Stream* stream = nullptr;
            Both* inner = nullptr; ///< is updated by accept
            int left = 0;          ///< so many times
            bool is_c = false;
            bool answer(jostle_id a, jostle_id b)
            {
                if (left > 0 && (a + b) % 5 == 0) {
                    --left;
                    if (is_c)
                        EXPECT_EQ(jostle_world_update(inner->c, nullptr), JOSTLE_OK);
                    else
                        inner->cpp->update();
                }
                return (a * 5 + b * 3 + stream->mood_) % 4 != 0;
            }
        };
        std::unique_ptr<World<Dim, T>> cpp;
        jostle_world* c = nullptr;
        std::array<Asked, 2> asked{};
        std::vector<ObjectId> ids; ///< of all that ever were
        bool has_base = false;
        std::vector<Bytes> saved, changes;

        Both() = default;
        Both(const Both&) = delete;
        ~Both() { EXPECT_EQ(jostle_free(c, nullptr), JOSTLE_OK); }
        void make(Stream& stream, bool asks, Both* inner)
        {
            asked = {Asked{&stream, inner, 0, false}, Asked{&stream, inner, 0, true}};
            jostle::WorldOptions options;
            auto twins = options_of<jostle_world_options>();
            options.margin = twins.margin = stream.random_.below(2) * 0.25;
            if (asks) {
                options.accept = [one = &asked[0]](ObjectId a, ObjectId b) {
                    return one->answer(c_twin::to_c(a), c_twin::to_c(b));
                };
                twins.accept = [](void* context, jostle_id a, jostle_id b) {
                    return std::int32_t{static_cast<Asked*>(context)->answer(a, b)};
                };
                twins.context = &asked[1];
            }
            cpp = std::make_unique<World<Dim, T>>(options);
            ASSERT_EQ(jostle_world_new(space, &twins, &c, nullptr), JOSTLE_OK);
        }
    };

    explicit Stream(std::uint64_t seed) : random_(seed)
    {
        EXPECT_EQ(jostle_results_new(nullptr, &results_, &error_), JOSTLE_OK);
        world_.make(*this, random_.below(4) != 0, &inner_);
        inner_.make(*this, true, nullptr);
        other_.make(*this, false, nullptr);
    }
    Stream(const Stream&) = delete;
    ~Stream() { jostle_free(results_, nullptr); }

    void run(int turns)
    {
        for (int i = 0; i < turns && !testing::Test::HasFailure(); ++i)
            turn();
    }

  private:
    /// The two do the same, or fail both.
    template <class Cpp, class C>
    void both(const char* what, const Cpp& cpp, const C& c)
    {
        std::string refused;
        try {
            cpp();
        } catch (const jostle::Error& why) {
            refused = why.what();
        }
        const jostle_status status = c();
        EXPECT_EQ(status == JOSTLE_OK, refused.empty())
            << what << ": in C++ " << refused << ", in C " << error_.message;
    }

    // --- What is given ---

    std::size_t count() { return counts[random_.below(std::size(counts))]; }
    T number(double least, double most)
    {
        return static_cast<T>(least + random_.below(64) * ((most - least) / 64));
    }
    std::vector<Box> boxes(std::size_t n)
    {
        std::vector<Box> out(n);
        for (Box& box : out)
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = number(-8, 8);
                box.hi[d] = box.lo[d] + number(0, 4);
            }
        return out;
    }
    std::vector<Vec<Dim, T>> vectors(std::size_t n, double least, double most)
    {
        std::vector<Vec<Dim, T>> out(n);
        for (auto& each : out)
            for (int d = 0; d < Dim; ++d)
                each[d] = number(least, most);
        return out;
    }
    /// Ids of objects, in a few turns also of one that is gone.
    std::vector<ObjectId> some(const Both& of)
    {
        std::vector<ObjectId> out;
        for (std::size_t n = count(); n-- > 0 && !of.ids.empty();) {
            const ObjectId id = of.ids[random_.below(static_cast<std::uint32_t>(of.ids.size()))];
            if (random_.below(400) == 0 || of.cpp->contains(id)) out.push_back(id);
        }
        return out;
    }
    jostle_boxes view(const std::vector<Box>& given)
    {
        return jostle_boxes_strided(space, given.data(), given.empty() ? nullptr : given[0].hi.data(),
                                    given.size(), sizeof(Box));
    }
    jostle_object_filter filter()
    {
        return {1u << random_.below(3), random_.below(8),
                random_.below(2) == 0 ? UINT32_MAX : random_.below(3), random_.below(5) == 0};
    }
    static ObjectFilter to_cpp(const jostle_object_filter& of)
    {
        return {of.category, of.mask, of.owner, of.is_static != 0};
    }

    // --- Commands ---

    void add(Both& to)
    {
        const auto given = boxes(count());
        const jostle_object_filter one = filter();
        jostle::ObjectOptions<T> wish;
        auto twins = options_of<jostle_object_options>();
        wish.filter = to_cpp(one);
        twins.filter = &one;
        wish.margin = number(0, 1);
        twins.margin = wish.margin;
        twins.disabled = random_.below(6) == 0 ? 1 : 0;
        wish.enabled = twins.disabled == 0;
        wish.user_data = twins.user_data = random_.below(1000);
        std::vector<ObjectId> ids(given.size());
        std::vector<jostle_id> got(given.size());
        const jostle_boxes all = view(given);
        both(
            "add", [&] { to.cpp->add(given, ids, wish); },
            [&] { return jostle_world_add(to.c, &all, &twins, got.data(), &error_); });
        EXPECT_EQ(got, c_twin::to_c(ids));
        if (got != std::vector<jostle_id>(got.size())) to.ids.insert(to.ids.end(), ids.begin(), ids.end());
    }
    void command(Both& to)
    {
        const std::vector<ObjectId> ids = some(to);
        const std::vector<jostle_id> twins = c_twin::to_c(ids);
        const std::size_t n = ids.size();
        const std::uint32_t sequence = random_.below(3);
        const auto each = [&](const auto& call) {
            for (std::size_t i = 0; i < n; ++i)
                call(i);
        };
        const auto given = boxes(n);
        const jostle_boxes places = view(given);
        const auto ways = vectors(n, -2, 2), sizes = vectors(n, 0, 4);
        switch (to.cpp->size() < 20 ? 0 : random_.below(n == 0 ? 3 : 9)) { // a loop over none refuses nothing
        case 0:
            return add(to);
        case 1:
            return both(
                "remove", [&] { to.cpp->remove(ids); },
                [&] { return jostle_world_remove(to.c, twins.data(), n, &error_); });
        case 2:
            return both(
                "move", [&] { to.cpp->move(ids, given, sequence); },
                [&] { return jostle_world_move(to.c, twins.data(), &places, nullptr, sequence, &error_); });
        case 3:
            return both(
                "move by", [&] { each([&](auto i) { to.cpp->move(ids[i], given[i], ways[i], sequence); }); },
                [&] {
                    return jostle_world_move(to.c, twins.data(), &places, ways.data(), sequence, &error_);
                });
        case 4:
            return both(
                "resize", [&] { each([&](auto i) { to.cpp->resize(ids[i], sizes[i], sequence); }); },
                [&] { return jostle_world_resize(to.c, twins.data(), n, sizes.data(), sequence, &error_); });
        case 5:
            return set_filters(to, ids, twins, sequence);
        case 6:
            return set_numbers(to, ids, twins, sequence);
        default:
            const std::size_t half = n / 2;
            const bool pairs = random_.below(2) == 0;
            const auto last = pairs ? half : n;
            both(
                "report_again",
                [&] {
                    for (std::size_t i = 0; i < last; ++i)
                        pairs ? to.cpp->report_again(ids[i], ids[half + i]) : to.cpp->report_again(ids[i]);
                },
                [&] {
                    return jostle_world_report_again(to.c, twins.data(),
                                                     pairs ? twins.data() + half : nullptr, last, &error_);
                });
        }
    }
    void set_filters(Both& to, const std::vector<ObjectId>& ids, const std::vector<jostle_id>& twins,
                     std::uint32_t sequence)
    {
        std::vector<jostle_object_filter> filters;
        for (std::size_t i = 0; i < ids.size(); ++i)
            filters.push_back(filter());
        both(
            "set_filter",
            [&] {
                for (std::size_t i = 0; i < ids.size(); ++i)
                    to.cpp->set_filter(ids[i], to_cpp(filters[i]), sequence);
            },
            [&] {
                return jostle_world_set_filter(to.c, twins.data(), ids.size(), filters.data(), sequence,
                                               &error_);
            });
    }
    void set_numbers(Both& to, const std::vector<ObjectId>& ids, const std::vector<jostle_id>& twins,
                     std::uint32_t sequence)
    {
        std::vector<double> margins;
        std::vector<std::uint8_t> enabled;
        std::vector<std::uint64_t> data;
        for (std::size_t i = 0; i < ids.size(); ++i) {
            margins.push_back(random_.below(3) * 0.25);
            enabled.push_back(random_.below(3) != 0);
            data.push_back(random_.below(1000));
        }
        const std::uint32_t which = random_.below(3);
        both(
            "set",
            [&] {
                for (std::size_t i = 0; i < ids.size(); ++i)
                    if (which == 0)
                        to.cpp->set_margin(ids[i], static_cast<T>(margins[i]), sequence);
                    else if (which == 1)
                        to.cpp->set_enabled(ids[i], enabled[i] != 0, sequence);
                    else
                        to.cpp->set_user_data(ids[i], data[i]);
            },
            [&] {
                const std::uint64_t n = ids.size();
                if (which == 0)
                    return jostle_world_set_margin(to.c, twins.data(), n, margins.data(), sequence, &error_);
                if (which == 1)
                    return jostle_world_set_enabled(to.c, twins.data(), n, enabled.data(), sequence, &error_);
                return jostle_world_set_user_data(to.c, twins.data(), n, data.data(), &error_);
            });
    }
    void update(Both& to)
    {
        mood_ = random_.below(4);
        for (auto& asked : to.asked)
            asked.left = asked.inner == nullptr ? 0 : static_cast<int>(mood_);
        if (to.asked[0].inner != nullptr) command(*to.asked[0].inner);
        const std::vector<ObjectId> ids = some(to);
        const std::vector<jostle_id> twins = c_twin::to_c(ids);
        const auto given = boxes(ids.size());
        const jostle_boxes places = view(given);
        if (random_.below(2) == 0)
            both("update", [&] { to.cpp->update(); }, [&] { return jostle_world_update(to.c, &error_); });
        else
            both(
                "update with moves", [&] { to.cpp->update(ids, given); },
                [&] { return jostle_world_update_moves(to.c, twins.data(), &places, &error_); });
    }
    Bytes bytes_of_results()
    {
        const void* bytes = nullptr;
        std::uint64_t size = 0;
        EXPECT_EQ(jostle_results_bytes(results_, &bytes, &size, &error_), JOSTLE_OK);
        const auto* const first = static_cast<const std::byte*>(bytes);
        return {first, first + size};
    }
    void save(Both& of)
    {
        Bytes saved;
        const std::uint32_t which = random_.below(3);
        bool failed = false;
        both(
            "save",
            [&] {
                failed = true;
                if (which == 0) saved = of.cpp->save();
                if (which == 1) saved = of.cpp->save_base();
                if (which == 2) of.cpp->save_changes(saved);
                failed = false;
            },
            [&] {
                return which == 0   ? jostle_world_save(of.c, results_, &error_)
                       : which == 1 ? jostle_world_save_base(of.c, results_, &error_)
                                    : jostle_world_save_changes(of.c, results_, &error_);
            });
        if (failed) return;
        EXPECT_EQ(bytes_of_results(), saved);
        if (which == 1) of.changes.clear();
        (which == 2 ? of.changes : of.saved).push_back(saved);
    }
    void go_back(Both& of)
    {
        auto& from = random_.below(2) == 0 ? of.changes : of.saved;
        if (from.empty()) return;
        Bytes bytes = from[random_.below(static_cast<std::uint32_t>(from.size()))];
        if (random_.below(5) == 0) bytes.pop_back();
        const bool changes = &from == &of.changes;
        both(
            "restore", [&] { changes ? of.cpp->restore_changes(bytes) : of.cpp->restore(bytes); },
            [&] {
                return changes ? jostle_world_restore_changes(of.c, bytes.data(), bytes.size(), &error_)
                               : jostle_world_restore(of.c, bytes.data(), bytes.size(), &error_);
            });
    }
    /// The third world becomes a view of the first, or one of its own again.
    void follow_or_leave()
    {
        if (random_.below(3) != 0) {
            both(
                "follow", [&] { other_.cpp->follow(*world_.cpp); },
                [&] { return jostle_world_follow(other_.c, world_.c, &error_); });
            other_.ids = world_.ids;
            other_.saved.clear();
            return other_.changes.clear();
        }
        both("clear", [&] { other_.cpp->clear(); }, [&] { return jostle_clear(other_.c, &error_); });
        other_.ids.clear();
        check_lists(other_);
        for (int i = 0; i < 3; ++i)
            add(other_);
        update(other_);
        check_lists(other_);
    }
    void fork()
    {
        const World<Dim, T> fork = world_.cpp->fork();
        jostle_world* twin = nullptr;
        ASSERT_EQ(jostle_world_fork(world_.c, &twin, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_save(twin, results_, &error_), JOSTLE_OK);
        EXPECT_EQ(bytes_of_results(), fork.save());
        jostle_free(twin, nullptr);
    }
    void turn()
    {
        const std::uint32_t what = random_.below(16);
        Both& to = random_.below(4) == 0 ? (random_.below(2) == 0 ? inner_ : other_) : world_;
        if (what < 6)
            command(to);
        else if (what < 10)
            update(to);
        else if (what == 10)
            both("apply", [&] { to.cpp->apply(); }, [&] { return jostle_world_apply(to.c, &error_); });
        else if (what == 11)
            save(to);
        else if (what == 12)
            go_back(to);
        else if (what == 13)
            follow_or_leave();
        else if (what == 14)
            fork();
        for (Both* const one : {&world_, &inner_, &other_}) {
            if (random_.below(3) != 0) check_lists(*one);
            if (random_.below(2) == 0) check_objects(*one);
        }
        ask(*std::array{&world_, &inner_, &other_}[random_.below(3)]);
    }

    // --- What they say ---

    static bool same(const Box& a, const Box& b) { return a.lo == b.lo && a.hi == b.hi; }
    void check_lists(const Both& of)
    {
        const jostle_id_pair* began = nullptr;
        const jostle_ended_pair* ended = nullptr;
        std::uint64_t n = 0;
        ASSERT_EQ(jostle_world_began(of.c, &began, &n, &error_), JOSTLE_OK);
        const auto expected = of.cpp->began();
        ASSERT_EQ(n, expected.size());
        for (std::uint64_t i = 0; i < n; ++i) {
            EXPECT_EQ(began[i].a, c_twin::to_c(expected[i].a));
            EXPECT_EQ(began[i].b, c_twin::to_c(expected[i].b));
        }
        ASSERT_EQ(jostle_world_ended(of.c, &ended, &n, &error_), JOSTLE_OK);
        const auto gone = of.cpp->ended();
        ASSERT_EQ(n, gone.size());
        for (std::uint64_t i = 0; i < n; ++i) {
            EXPECT_EQ(ended[i].a, c_twin::to_c(gone[i].a));
            EXPECT_EQ(ended[i].b, c_twin::to_c(gone[i].b));
            EXPECT_EQ(ended[i].reason, static_cast<jostle_end_reason>(gone[i].reason));
        }
        jostle_blocks pairs{};
        ASSERT_EQ(jostle_world_persisted(of.c, &pairs, &error_), JOSTLE_OK);
        EXPECT_EQ(items_of<jostle::Pair>(pairs), of.cpp->persisted().to_vector());
        ASSERT_EQ(jostle_world_changed_pairs(of.c, &pairs, &error_), JOSTLE_OK);
        EXPECT_EQ(items_of<jostle::Pair>(pairs), of.cpp->changed_pairs().to_vector());
        ASSERT_EQ(jostle_world_pairs(of.c, results_, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_results_blocks(results_, &pairs, &error_), JOSTLE_OK);
        const Pairs all = of.cpp->pairs().to_vector();
        EXPECT_EQ(items_of<jostle::Pair>(pairs), all);
    }
    void check_objects(const Both& of)
    {
        std::uint64_t size = 0;
        std::uint32_t end = 0;
        std::int32_t any = 0;
        Box hull{};
        ASSERT_EQ(jostle_size(of.c, &size, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_index_end(of.c, &end, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_query_bounds(of.c, &any, &hull, &error_), JOSTLE_OK);
        EXPECT_EQ(size, of.cpp->size());
        EXPECT_EQ(end, of.cpp->index_end());
        EXPECT_EQ(any != 0, of.cpp->bounds().has_value());
        if (any != 0) {
            EXPECT_TRUE(same(hull, *of.cpp->bounds()));
        }
        std::vector<ObjectId> ids;
        for (std::uint32_t i = 0; i < end; ++i)
            if (of.cpp->contains(of.cpp->id(i))) ids.push_back(of.cpp->id(i));
        const std::vector<jostle_id> twins = c_twin::to_c(ids);
        const std::size_t n = ids.size();
        std::vector<Box> where(n), bounds(n);
        std::vector<jostle_object_filter> filters(n);
        std::vector<std::uint8_t> enabled(n);
        std::vector<double> margins(n);
        std::vector<std::uint64_t> data(n);
        ASSERT_EQ(jostle_world_boxes(of.c, twins.data(), n, where.data(), &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_bounds(of.c, twins.data(), n, bounds.data(), &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_filters(of.c, twins.data(), n, filters.data(), &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_enabled(of.c, twins.data(), n, enabled.data(), &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_world_margins(of.c, twins.data(), n, margins.data(), &error_), JOSTLE_OK);
        const bool has_data =
            jostle_world_user_data(of.c, twins.data(), n, data.data(), &error_) == JOSTLE_OK;
        jostle_lists near{};
        ASSERT_EQ(jostle_world_touching(of.c, twins.data(), n, results_, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_results_lists(results_, &near, &error_), JOSTLE_OK);
        std::vector<ObjectId> touching;
        for (std::size_t i = 0; i < n; ++i) {
            EXPECT_TRUE(same(where[i], of.cpp->box(ids[i])));
            EXPECT_TRUE(same(bounds[i], of.cpp->bounds(ids[i])));
            EXPECT_EQ(to_cpp(filters[i]), of.cpp->filter(ids[i]));
            EXPECT_EQ(enabled[i] != 0, of.cpp->enabled(ids[i]));
            EXPECT_EQ(margins[i], of.cpp->margin(ids[i]));
            if (has_data) {
                EXPECT_EQ(data[i], of.cpp->user_data(ids[i]));
            }
            of.cpp->touching(ids[i], touching);
            EXPECT_EQ(c_twin::to_c(touching),
                      std::vector(near.ids + near.first[i], near.ids + near.first[i + 1]));
        }
    }

    // --- Queries ---

    /// Filters for queries: none, one for all or one for each.
    struct Filters
    {
        std::vector<ObjectQueryFilter> cpp;
        std::vector<jostle_query_filter> c;
        std::vector<jostle_asker> askers;
        std::vector<jostle_id> excluded;
        std::function<bool(std::uint32_t, ObjectId)> accept;
    };
    void make_filters(Filters& filters, const Both& of, std::size_t queries)
    {
        const std::size_t n = random_.below(3) == 0 ? 1 : queries;
        filters.accept = [this](std::uint32_t query, ObjectId id) {
            return (query * 7 + id.index * 3 + mood_) % 4 != 0;
        };
        filters.askers.resize(n);
        filters.excluded.resize(n);
        for (std::size_t i = 0; i < n; ++i) {
            ObjectQueryFilter one;
            auto twin = options_of<jostle_query_filter>();
            if (random_.below(2) == 0) {
                filters.askers[i] = {1u << random_.below(3), random_.below(8), random_.below(3)};
                twin.asker = &filters.askers[i];
                one.category = twin.asker->category;
                one.mask = twin.asker->mask;
                one.owner = twin.asker->owner;
            }
            if (!of.ids.empty() && random_.below(2) == 0) {
                one.exclude = of.ids[random_.below(static_cast<std::uint32_t>(of.ids.size()))];
                filters.excluded[i] = c_twin::to_c(one.exclude);
                twin.exclude = &filters.excluded[i];
            }
            if (random_.below(2) == 0) {
                one.accept = filters.accept;
                twin.context = &filters.accept;
                twin.accept = [](void* context, std::uint32_t query, std::uint64_t id) {
                    const auto& accept = *static_cast<decltype(filters.accept)*>(context);
                    return std::int32_t{accept(query, {static_cast<std::uint32_t>(id), 1})};
                };
            }
            twin.count = n;
            filters.cpp.push_back(one);
            filters.c.push_back(twin);
        }
    }
    template <class F>
    static void with(const Filters& filters, const F& call)
    {
        if (filters.cpp.size() == 1)
            call(filters.cpp[0]);
        else
            call(filters.cpp);
    }
    template <class Item>
    void check_found(const ResultLists<Item>& expected)
    {
        jostle_lists found{};
        ASSERT_EQ(jostle_results_lists(results_, &found, &error_), JOSTLE_OK);
        ASSERT_EQ(found.queries, expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            ASSERT_EQ(found.first[i + 1] - found.first[i], expected[i].size()) << i;
            EXPECT_EQ(found.more[i] != 0, expected.more(i));
            for (std::size_t k = 0; k < expected[i].size(); ++k) {
                const std::uint64_t place = found.first[i] + k;
                if constexpr (requires { expected[i][k].at; }) {
                    EXPECT_EQ(found.ids[place], c_twin::to_c(expected[i][k].id));
                    EXPECT_EQ(found.at[place], expected[i][k].at);
                } else {
                    EXPECT_EQ(found.ids[place], c_twin::to_c(expected[i][k]));
                }
            }
        }
    }
    template <class Item, class Query>
    void ask_all(const Both& of, const std::vector<Query>& queries, const jostle_queries& given)
    {
        Filters filters;
        make_filters(filters, of, queries.size());
        const std::size_t n = queries.size();
        const std::uint64_t most = random_.below(2) == 0 ? UINT64_MAX : random_.below(5);
        const jostle_query_filter* const wish = filters.c.data();
        ResultLists<Item> lists;
        constexpr bool is_nearest = requires { queries[0].max_distance; };
        with(filters, [&](const auto& filter) {
            if constexpr (is_nearest)
                of.cpp->nearest(queries, lists, filter);
            else
                of.cpp->all(queries, lists, filter, most);
        });
        ASSERT_EQ(
            jostle_query_all(of.c, &given, nullptr, wish, is_nearest ? UINT64_MAX : most, results_, &error_),
            JOSTLE_OK)
            << error_.message;
        check_found(lists);
        if constexpr (!is_nearest) {
            std::vector<std::uint64_t> numbers(n), twins(n);
            with(filters, [&](const auto& filter) { of.cpp->count(queries, std::span(numbers), filter); });
            ASSERT_EQ(jostle_query_count(of.c, &given, nullptr, wish, twins.data(), &error_), JOSTLE_OK);
            EXPECT_EQ(numbers, twins);
            std::vector<std::uint8_t> any(n);
            ASSERT_EQ(jostle_query_any(of.c, &given, nullptr, wish, any.data(), &error_), JOSTLE_OK);
            for (std::size_t i = 0; i < n; ++i)
                EXPECT_EQ(any[i] != 0, numbers[i] != 0);
        }
        if constexpr (std::is_same_v<Item, Hit<T, ObjectId>>) {
            std::vector<Hit<T, ObjectId>> hits(n);
            std::vector<jostle_hit> twins(n);
            with(filters, [&](const auto& filter) {
                if constexpr (is_nearest)
                    of.cpp->nearest(queries, std::span(hits), filter);
                else
                    of.cpp->first(queries, std::span(hits), filter);
            });
            ASSERT_EQ(jostle_query_first(of.c, &given, nullptr, wish, twins.data(), nullptr, &error_),
                      JOSTLE_OK);
            for (std::size_t i = 0; i < n; ++i) {
                EXPECT_EQ(twins[i].id, c_twin::to_c(hits[i].id));
                if (twins[i].id != 0) {
                    EXPECT_EQ(twins[i].at, hits[i].at);
                }
            }
        }
    }
    void ask(const Both& of)
    {
        const std::size_t n = count();
        const auto regions = boxes(n);
        auto ways = vectors(n, -2, 2);
        const auto at = vectors(n, -9, 9);
        for (auto& way : ways)
            way[0] = way[0] == 0 ? T(1) : way[0];
        std::vector<Ray<Dim, T>> rays(n);
        std::vector<Sweep<Dim, T>> sweeps(n);
        std::vector<Sphere<Dim, T>> spheres(n);
        std::vector<Nearest<Dim, T>> nearest(n);
        std::vector<NearestToBox<Dim, T>> to_boxes(n);
        std::vector<Plane<Dim, T>> planes(n);
        std::vector<Frustum<Dim, T>> frusta(n);
        std::vector<jostle_frustum> twins(n);
        std::vector<std::array<T, Dim + 1>> points(n);
        std::vector<std::array<T, 2 * Dim + 1>> beside(n);
        const std::uint32_t near = 1 + random_.below(8);
        for (std::size_t i = 0; i < n; ++i) {
            rays[i] = {at[i], ways[i], number(0, 8)};
            sweeps[i] = {regions[i], ways[i], number(0, 8)};
            spheres[i] = {at[i], number(0, 4)};
            nearest[i] = {at[i], near, number(0, 8)};
            points[i].back() = nearest[i].max_distance;
            std::copy_n(at[i].begin(), Dim, points[i].begin());
            to_boxes[i] = {regions[i], near, number(0, 8)};
            beside[i].back() = to_boxes[i].max_distance;
            std::copy_n(regions[i].lo.begin(), Dim, beside[i].begin());
            std::copy_n(regions[i].hi.begin(), Dim, beside[i].begin() + Dim);
            planes[i] = {ways[i], number(-4, 9)};
            frusta[i] = {std::span(planes).subspan(i / 2, i - i / 2)};
            twins[i] = {frusta[i].planes.data(), frusta[i].planes.size()};
        }
        jostle_queries to_points = c_twin::queries_of(JOSTLE_NEAREST, points.data(), n);
        jostle_queries next_to = c_twin::queries_of(JOSTLE_NEAREST_TO_BOX, beside.data(), n);
        to_points.nearest = next_to.nearest = near;
        switch (random_.below(8)) {
        case 0:
            return ask_all<Hit<T, ObjectId>>(of, rays, c_twin::queries_of(JOSTLE_RAY, rays.data(), n));
        case 1:
            return ask_all<Hit<T, ObjectId>>(of, sweeps, c_twin::queries_of(JOSTLE_SWEEP, sweeps.data(), n));
        case 2:
            return ask_all<ObjectId>(of, regions, c_twin::queries_of(JOSTLE_BOX, regions.data(), n));
        case 3:
            return ask_all<ObjectId>(of, spheres, c_twin::queries_of(JOSTLE_SPHERE, spheres.data(), n));
        case 4:
            return ask_all<Hit<T, ObjectId>>(of, nearest, to_points);
        case 5:
            return ask_all<Hit<T, ObjectId>>(of, to_boxes, next_to);
        case 6:
            return ask_all<ObjectId>(of, frusta, c_twin::queries_of(JOSTLE_FRUSTUM, twins.data(), n));
        default:
            ask_closest();
            join(regions);
        }
    }
    struct Close
    {
        std::vector<std::array<std::uint64_t, 2>> pairs;
        std::vector<double> at;
        std::size_t most;
        T stop; ///< no further than that, once it is known
        bool take(std::uint64_t a, std::uint64_t b, double where)
        {
            pairs.push_back({a, b});
            at.push_back(where);
            return pairs.size() < most;
        }
    };
    void ask_closest()
    {
        const Both& first = random_.below(2) == 0 ? world_ : inner_;
        const Both& second = random_.below(2) == 0 ? world_ : other_;
        const T most = number(0, 8), bound = number(0, 8);
        Close cpp{{}, {}, 1 + count(), bound}, c = cpp;
        const bool finished = first.cpp->closest_pairs(
            *second.cpp,
            [&](const auto& hit, T& limit) {
                limit = std::min(limit, cpp.stop);
                return cpp.take(c_twin::to_c(hit.a), c_twin::to_c(hit.b), hit.at);
            },
            most);
        std::int32_t twins = 0;
        const auto take = [](void* context, std::uint64_t a, std::uint64_t b, double at, double* limit) {
            auto& into = *static_cast<Close*>(context);
            *limit = std::min(*limit, double{into.stop});
            return std::int32_t{into.take(a, b, at)};
        };
        ASSERT_EQ(jostle_query_closest_pairs(first.c, second.c, most, take, &c, &twins, &error_), JOSTLE_OK);
        EXPECT_EQ(twins != 0, finished);
        EXPECT_EQ(c.pairs, cpp.pairs);
        EXPECT_EQ(c.at, cpp.at);
    }
    void join(const std::vector<Box>& with_these)
    {
        Filters filters;
        make_filters(filters, world_, 1);
        const jostle_boxes given = view(with_these);
        std::pmr::vector<jostle::Pair> pairs;
        world_.cpp->join(with_these, pairs, filters.cpp[0]);
        jostle_blocks found{};
        ASSERT_EQ(jostle_query_join(world_.c, &given, filters.c.data(), results_, &error_), JOSTLE_OK);
        ASSERT_EQ(jostle_results_blocks(results_, &found, &error_), JOSTLE_OK);
        EXPECT_EQ(items_of<jostle::Pair>(found), Pairs(pairs.begin(), pairs.end()));
    }

    Random random_;
    std::uint32_t mood_ = 0;
    jostle_error error_{};
    jostle_results* results_ = nullptr;
    Both world_, inner_, other_;
};

template <int Dim, Coordinate T>
void run_streams(std::uint64_t first)
{
    for (std::uint64_t seed = first; seed < first + 30; ++seed) {
        SCOPED_TRACE(seed);
        Stream<Dim, T>(seed).run(150);
        if (testing::Test::HasFailure()) return;
    }
}

TEST(CStream, SaysWhatCppSaysIn3f)
{
    run_streams<3, float>(1);
}
TEST(CStream, SaysWhatCppSaysIn2d)
{
    run_streams<2, double>(1001);
}

} // namespace
} // namespace c_twin
