// SPDX-License-Identifier: MIT
// Queries about a scene over all ranks have the answers that one World gives.
#include "queries.hpp"

#include "partition.hpp"
#include "scene.hpp"

namespace mpi_tests {
namespace {

using jostle::Aabb;
using jostle::ObjectId;
using jostle::mpi::Form;
using jostle::mpi::Found;
using jostle::mpi::QueryFilter;

const jostle::mpi::WorldOptions serial{.executor = &jostle::serial_executor()};

/// What one rank asks, of each kind. Ranks draw on their own.
template <int Dim, class T>
class Asker
{
  public:
    using Ray = jostle::Ray<Dim, T>;
    using Sweep = jostle::Sweep<Dim, T>;
    using Sphere = jostle::Sphere<Dim, T>;
    using Frustum = jostle::Frustum<Dim, T>;
    using Nearest = jostle::Nearest<Dim, T>;
    using NearestToBox = jostle::NearestToBox<Dim, T>;

    Asker(Scene<Dim, T>& scene, std::uint64_t seed)
        : scene_(scene), random_(seed, static_cast<unsigned>(rank()), 0), count_(random_.below(6))
    {
        for (const auto& [id, thing] : scene.things)
            if (scene.one.contains(thing.id)) there_.push_back(id);
        for (std::size_t i = 0; i < count_; ++i) {
            Aabb<Dim, T> box;
            jostle::Vec<Dim, T> at, way;
            for (int d = 0; d < Dim; ++d) {
                at[d] = coordinate();
                box.lo[d] = coordinate();
                box.hi[d] = box.lo[d] + static_cast<T>(random_.below(3) == 0 ? 1 : random_.uniform(0, 3));
                way[d] = static_cast<T>(random_.below(4) == 0 ? 0 : random_.uniform(-3, 3));
            }
            way[0] += T(0.01);
            boxes.push_back(box);
            rays.push_back({at, way, length()});
            sweeps.push_back({box, way, length()});
            spheres.push_back({at, static_cast<T>(random_.below(3) == 0 ? 0 : random_.uniform(0, 4))});
            nears.push_back({at, random_.below(12)});
            if (random_.below(2) == 0) nears.back().max_distance = static_cast<T>(random_.uniform(0, 3));
            nears_to_box.push_back({box, random_.below(12), nears.back().max_distance});
            planes.emplace_back(random_.below(4));
            for (auto& plane : planes.back()) {
                for (int d = 0; d < Dim; ++d)
                    plane.normal[d] = static_cast<T>(random_.uniform(-1, 1)) + T(0.01);
                plane.offset = static_cast<T>(random_.uniform(-1, 3));
            }
        }
        for (const auto& each : planes)
            frusta.push_back({each});
        for (std::size_t i = 0; i < count_; ++i) {
            QueryFilter filter;
            jostle::ObjectQueryFilter same;
            if (random_.below(2) == 0) {
                same.mask = filter.mask = 3;
                same.category = filter.category = 1 + random_.below(3);
                same.owner = filter.owner = random_.below(6);
            }
            if (!there_.empty() && random_.below(2) == 0) {
                filter.exclude = there_[random_.below(static_cast<std::uint32_t>(there_.size()))];
                same.exclude = scene.things.at(*filter.exclude).id;
            } else if (random_.below(4) == 0)
                filter.exclude = 3; // nobody
            filters.push_back(filter);
            filters_of_one.push_back(same);
        }
    }

    /// "" where all answers, of all ranks, are those of one World.
    std::string disagreement()
    {
        std::string wrong;
        lines(rays, "rays", wrong);
        lines(sweeps, "sweeps", wrong);
        regions(boxes, "boxes", wrong);
        regions(spheres, "spheres", wrong);
        regions(frusta, "frusta", wrong);
        nearest(nears, "nearest", wrong);
        nearest(nears_to_box, "nearest to boxes", wrong);
        return everywhere(wrong.empty()) ? "" : wrong + ", or another rank's";
    }
    /// The same of the queries about a rank's own objects, which ranks ask alone.
    std::string disagreement_of_owned()
    {
        std::string wrong;
        const auto mine = [&](std::uint32_t, ObjectId id) { return scene_.owner(global(id)) == rank(); };
        for (auto& filter : filters_of_one)
            filter.accept = mine;
        for (int k = 0; k < 1 + rank(); ++k) { // some ask more often than others
            owned_lines(rays, "rays", wrong);
            owned_lines(sweeps, "sweeps", wrong);
            owned_regions(boxes, "boxes", wrong);
            owned_regions(spheres, "spheres", wrong);
            owned_regions(frusta, "frusta", wrong);
            owned_nearest(nears, "nearest", wrong);
            owned_nearest(nears_to_box, "nearest to boxes", wrong);
        }
        for (auto& filter : filters_of_one)
            filter.accept = {};
        return everywhere(wrong.empty()) ? "" : wrong + ", or another rank's";
    }

    std::vector<Ray> rays;
    std::vector<Sweep> sweeps;
    std::vector<Aabb<Dim, T>> boxes;
    std::vector<Sphere> spheres;
    std::vector<std::vector<jostle::Plane<Dim, T>>> planes;
    std::vector<Frustum> frusta;
    std::vector<Nearest> nears;
    std::vector<NearestToBox> nears_to_box;
    std::vector<QueryFilter> filters;
    std::vector<jostle::ObjectQueryFilter> filters_of_one;
    std::uint64_t results = 0, ties = 0;

  private:
    using Hit = jostle::mpi::ObjectHit<T>;
    using HitOfOne = jostle::Hit<T, jostle::ObjectId>;

    T coordinate()
    {
        const double at = random_.uniform(-1, scene_.extent + 1);
        return static_cast<T>(random_.below(2) == 0 ? at : std::floor(at));
    }
    T length()
    {
        const std::uint32_t kind = random_.below(8);
        return kind == 0   ? std::numeric_limits<T>::infinity()
               : kind == 1 ? T(0)
                           : static_cast<T>(random_.uniform(0, 9));
    }
    static std::uint64_t global(ObjectId id) { return Scene<Dim, T>::global(id); }

    // What one World found, as many ranks say it.
    Hit as(const HitOfOne& hit) const { return {global(hit.id), scene_.owner(global(hit.id)), hit.at}; }
    Found as(ObjectId id) const { return {global(id), scene_.owner(global(id))}; }
    template <class Item, class List>
    std::vector<Item> all_as(const List& list) const
    {
        std::vector<Item> items;
        for (const auto& each : list)
            items.push_back(as(each));
        return items;
    }
    template <class Item, class List>
    bool equal(std::span<const Item> found, const List& expected)
    {
        results += found.size();
        if constexpr (std::is_same_v<Item, Hit>)
            for (std::size_t i = 1; i < found.size(); ++i)
                ties += found[i].at == found[i - 1].at;
        const std::vector<Item> same = all_as<Item>(expected);
        return std::equal(found.begin(), found.end(), same.begin(), same.end());
    }
    template <class Item, class ItemOfOne, class Query>
    void all(const std::vector<Query>& queries, const char* name, std::string& wrong)
    {
        const std::span<const Query> asked(queries);
        for (const std::uint64_t most : {~std::uint64_t{0}, std::uint64_t{3}, std::uint64_t{0}}) {
            jostle::mpi::Answers<Item> found;
            jostle::ResultLists<ItemOfOne> expected;
            scene_.world->all(asked, found, filters, most);
            scene_.one.all(asked, expected, filters_of_one, most);
            bool good = found.size() == queries.size();
            std::size_t items = 0;
            for (std::size_t i = 0; good && i < queries.size(); ++i) {
                good = equal(found[i], expected[i]) && found.more(i) == expected.more(i);
                items += found[i].size();
            }
            if (!good || items != found.items().size()) wrong += std::string(" all ") + name;
        }
        std::vector<std::uint64_t> counts(queries.size(), 77), expected(queries.size());
        scene_.world->count(asked, std::span<std::uint64_t>(counts), filters);
        scene_.one.count(asked, std::span<std::uint64_t>(expected), filters_of_one);
        if (counts != expected) wrong += std::string(" count of ") + name;
        // One filter for all.
        scene_.world->count(asked, std::span<std::uint64_t>(counts), QueryFilter{.mask = 2});
        scene_.one.count(asked, std::span<std::uint64_t>(expected), {.mask = 2});
        if (counts != expected) wrong += std::string(" count with one filter of ") + name;
    }
    template <class Line>
    void lines(const std::vector<Line>& queries, const char* name, std::string& wrong)
    {
        all<Hit, HitOfOne>(queries, name, wrong);
        std::vector<Hit> found(queries.size(), Hit{1, 2, 3});
        std::vector<HitOfOne> expected(queries.size());
        scene_.world->first(std::span<const Line>(queries), std::span<Hit>(found), filters);
        scene_.one.first(std::span<const Line>(queries), std::span<HitOfOne>(expected), filters_of_one);
        for (std::size_t i = 0; i < queries.size(); ++i)
            if (found[i] != (expected[i].id == ObjectId{} ? Hit{} : as(expected[i])))
                wrong += std::string(" first of ") + name;
    }
    template <class Region>
    void regions(const std::vector<Region>& queries, const char* name, std::string& wrong)
    {
        all<Found, ObjectId>(queries, name, wrong);
    }
    template <class Near>
    void nearest(const std::vector<Near>& queries, const char* name, std::string& wrong)
    {
        jostle::mpi::Answers<Hit> found;
        jostle::ResultLists<HitOfOne> expected;
        scene_.world->nearest(std::span<const Near>(queries), found, filters);
        scene_.one.nearest(std::span<const Near>(queries), expected, filters_of_one);
        bool good = found.size() == queries.size();
        for (std::size_t i = 0; good && i < queries.size(); ++i)
            good = equal(found[i], expected[i]) && !found.more(i);
        if (!good) wrong += std::string(" ") + name;
    }

    template <class Item, class ItemOfOne, class Query>
    void owned_all(const std::vector<Query>& queries, const char* name, std::string& wrong)
    {
        for (std::size_t i = 0; i < queries.size(); ++i)
            for (const std::uint64_t most : {~std::uint64_t{0}, std::uint64_t{2}}) {
                std::vector<Item> found(3);
                std::vector<ItemOfOne> expected;
                const bool more = scene_.world->all_owned(queries[i], found, filters[i], most);
                const bool more_of_one = scene_.one.all(queries[i], expected, filters_of_one[i], most);
                if (!equal(std::span<const Item>(found), expected) || more != more_of_one ||
                    scene_.world->count_owned(queries[i], filters[i]) !=
                        scene_.one.count(queries[i], filters_of_one[i]))
                    wrong += std::string(" owned ") + name;
            }
    }
    template <class Line>
    void owned_lines(const std::vector<Line>& queries, const char* name, std::string& wrong)
    {
        owned_all<Hit, HitOfOne>(queries, name, wrong);
        for (std::size_t i = 0; i < queries.size(); ++i) {
            const auto found = scene_.world->first_owned(queries[i], filters[i]);
            const auto expected = scene_.one.first(queries[i], filters_of_one[i]);
            if (found.has_value() != expected.has_value() || (found && *found != as(*expected)))
                wrong += std::string(" first owned of ") + name;
        }
    }
    template <class Region>
    void owned_regions(const std::vector<Region>& queries, const char* name, std::string& wrong)
    {
        owned_all<Found, ObjectId>(queries, name, wrong);
    }
    template <class Near>
    void owned_nearest(const std::vector<Near>& queries, const char* name, std::string& wrong)
    {
        for (std::size_t i = 0; i < queries.size(); ++i) {
            std::vector<Hit> found(2);
            std::vector<HitOfOne> expected;
            scene_.world->nearest_owned(queries[i], found, filters[i]);
            scene_.one.nearest(queries[i], expected, filters_of_one[i]);
            if (!equal(std::span<const Hit>(found), expected)) wrong += std::string(" owned ") + name;
        }
    }

    Scene<Dim, T>& scene_;
    Random random_;
    std::size_t count_;
    std::vector<std::uint64_t> there_;
};

template <int Dim, class T>
void ask(std::uint32_t threads, double extent, std::size_t objects, jostle::mpi::WorldOptions options)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(threads);
    options.executor = executor.get();
    Scene<Dim, T> scene(threads, extent, options);
    std::uint64_t results = 0, ties = 0;
    for (std::uint64_t update = 0; update < 16; ++update) {
        Asker<Dim, T> asker(scene, update);
        EXPECT_EQ(asker.disagreement(), "") << "update " << update;
        EXPECT_EQ(asker.disagreement_of_owned(), "") << "update " << update;
        results += asker.results;
        ties += asker.ties;
        for (std::size_t k = 0; k < (update % 4 == 0 ? 2 * objects : update % 4 == 1 ? 0 : 40); ++k)
            scene.operate(objects);
        ASSERT_TRUE(scene.update());
    }
    EXPECT_GT(sum(results), 1000u);
    EXPECT_GT(sum(ties), 20u);
}
TEST(Queries, Float3)
{
    ask<3, float>(1, 7, 300, {});
}
TEST(Queries, Float2TwoThreads)
{
    ask<2, float>(2, 16, 250, {.margin = 0.125});
}
TEST(Queries, Double2OfThoseWhoStay)
{
    ask<2, double>(1, 16, 250, {.migrate = false});
}
TEST(Queries, Double3TwoThreads)
{
    ask<3, double>(2, 7, 300, {.rebalance = jostle::mpi::Rebalance::on_request});
}

/// More than there are threads, so that they share them.
TEST(Queries, Many)
{
    const std::unique_ptr<jostle::Executor> executor = jostle::make_thread_executor(2);
    Scene<3, float> scene(1, 12, {.executor = executor.get()});
    for (int k = 0; k < 2000; ++k)
        scene.operate(800);
    ASSERT_TRUE(scene.update());
    Random random(5, static_cast<unsigned>(rank()), 0);
    std::vector<jostle::Aabb3f> boxes;
    std::vector<jostle::Ray3f> rays;
    for (int i = 0; i < 400; ++i) {
        const auto at = [&] { return static_cast<float>(random.uniform(0, 12)); };
        boxes.push_back(jostle::Aabb3f{{at(), at(), at()}, {13, 13, 13}});
        rays.push_back({{at(), at(), at()}, {at() - 6, at() - 6, at() - 6.5f}});
    }
    jostle::mpi::Answers<Found> found;
    scene.world->all(std::span<const jostle::Aabb3f>(boxes), found);
    std::vector<jostle::mpi::ObjectHit<float>> hits(rays.size());
    scene.world->first(std::span<const jostle::Ray3f>(rays), std::span<jostle::mpi::ObjectHit<float>>(hits));
    bool good = true;
    std::vector<ObjectId> expected;
    for (std::size_t i = 0; good && i < boxes.size(); ++i) {
        (void)scene.one.all(boxes[i], expected);
        good = found[i].size() == expected.size();
        for (std::size_t k = 0; good && k < expected.size(); ++k)
            good = found[i][k].id == scene.global(expected[k]);
        const auto first = scene.one.first(rays[i]);
        good = good && (first ? hits[i].id == scene.global(first->id) && hits[i].at == first->at
                              : hits[i].rank == -1);
    }
    EXPECT_TRUE(good);
}

TEST(Queries, BeforeThereIsAnything)
{
    jostle::mpi::World3f world(MPI_COMM_WORLD, serial);
    const std::vector<jostle::Ray3f> rays(2, {{0, 0, 0}, {1, 0, 0}});
    std::vector<jostle::mpi::ObjectHit<float>> hits(2, {1, 2, 3});
    world.first(std::span<const jostle::Ray3f>(rays), std::span<jostle::mpi::ObjectHit<float>>(hits));
    EXPECT_EQ(hits[1], jostle::mpi::ObjectHit<float>{});
    EXPECT_FALSE(world.first_owned(rays[0]));
    world.add(static_cast<unsigned>(rank()), jostle::Aabb3f{{1, 0, 0}, {2, 1, 1}}); // queued, not there
    EXPECT_FALSE(world.first_owned(rays[0]));
    world.update();
    world.first(std::span<const jostle::Ray3f>(rays), std::span<jostle::mpi::ObjectHit<float>>(hits));
    EXPECT_EQ(hits[0].id, 0u);
    EXPECT_EQ(hits[0].at, 1.f);
}

/// On how many ranks a query is answered: on those alone whose regions it touches.
TEST(Queries, GoWhereTheyReach)
{
    Scene<3, float> scene(3, 20, serial);
    for (int i = 0; i < 600; ++i)
        scene.add(jostle::Aabb3f{{float(i % 20), float(i / 20 % 5), float(i / 100)},
                                 {float(i % 20) + 1, float(i / 20 % 5) + 1, float(i / 100) + 1}});
    ASSERT_TRUE(scene.update());
    EXPECT_EQ(scene.world->query_stats().asked, 0u);
    const std::vector<jostle::Aabb3f> small(rank() == 0 ? 1 : 0, {{0.1f, 0.1f, 0.1f}, {0.2f, 0.2f, 0.2f}}),
        whole(rank() == 0 ? 1 : 0, {{-9, -9, -9}, {99, 99, 99}});
    std::vector<std::uint64_t> counts(small.size());
    scene.world->count(std::span<const jostle::Aabb3f>(small), std::span<std::uint64_t>(counts));
    EXPECT_EQ(sum(scene.world->query_stats().answered), 1u);
    scene.world->count(std::span<const jostle::Aabb3f>(whole), std::span<std::uint64_t>(counts));
    EXPECT_EQ(sum(scene.world->query_stats().answered), static_cast<unsigned>(ranks()));
    EXPECT_TRUE(counts.empty() || counts[0] == 600);
}

TEST(Queries, WhatIsWrongIsSaidOnAllRanks)
{
    auto scene = Scene<3, float>(4, 6, serial);
    for (int k = 0; k < 300; ++k)
        scene.operate(100);
    ASSERT_TRUE(scene.update());
    const bool last = rank() == ranks() - 1;
    const std::string at = "rank " + std::to_string(ranks() - 1) + ": ";
    std::vector<jostle::Ray3f> rays(3, {{0, 0, 0}, {1, 0, 0}});
    std::vector<jostle::mpi::ObjectHit<float>> hits(3);
    const auto firsts = [&] {
        scene.world->first(std::span<const jostle::Ray3f>(rays),
                           std::span<jostle::mpi::ObjectHit<float>>(hits));
    };
    const auto says = [](const std::string& text, const std::string& part) {
        return text.find(part) != std::string::npos;
    };
    EXPECT_EQ(failure_of(firsts), "");
    if (last) rays[1].origin[2] = std::numeric_limits<float>::quiet_NaN();
    std::string text = failure_of(firsts);
    EXPECT_TRUE(says(text, at + "ray 1")) << text;
    rays[1].origin[2] = 0;
    if (last) hits.pop_back();
    text = failure_of(firsts);
    EXPECT_TRUE(says(text, at + "there are 3 queries and 2 places for answers")) << text;
    hits.resize(3);
    jostle::mpi::Answers<jostle::mpi::ObjectHit<float>> lists;
    const std::vector<QueryFilter> filters(last ? 2 : 3);
    text = failure_of([&] { scene.world->all(std::span<const jostle::Ray3f>(rays), lists, filters); });
    EXPECT_TRUE(says(text, at + "there are 3 queries and 2 filters")) << text;
    if (ranks() > 1) {
        text = failure_of([&] {
            if (last)
                scene.world->all(std::span<const jostle::Ray3f>(rays), lists);
            else
                firsts();
        });
        EXPECT_TRUE(says(text, "ranks ask for different things at a time")) << text;
        const std::vector<jostle::Nearest3f> near(1, jostle::Nearest3f{{0, 0, 0}});
        text = failure_of([&] {
            if (last)
                scene.world->nearest(std::span<const jostle::Nearest3f>(near), lists);
            else
                firsts();
        });
        EXPECT_TRUE(says(text, "ranks ask for different things at a time")) << text;
    }
    EXPECT_EQ((Asker<3, float>(scene, 9).disagreement()), "");
    EXPECT_THROW((void)scene.world->first_owned(jostle::Ray3f{{0, 0, 0}, {0, 0, 0}}), jostle::Error);
    ASSERT_TRUE(scene.update());
}

/// Fails at each allocation of a query in turn, on one rank; and asks where an update has failed halfway.
template <class Item>
std::vector<Item> items_of(const jostle::mpi::Answers<Item>& answers)
{
    return {answers.items().begin(), answers.items().end()};
}
TEST(Queries, NoMemory)
{
    FailingMemory memory;
    auto options = serial;
    options.memory = &memory;
    Scene<3, float> scene(5, 6, options);
    for (int k = 0; k < 300; ++k)
        scene.operate(80);
    ASSERT_TRUE(scene.update());
    const int failing = ranks() - 1;
    const auto& world = *scene.world;
    const std::vector<jostle::Aabb3f> boxes(4, {{0, 0, 0}, {5, 5, 5}});
    const std::vector<jostle::Nearest3f> near(4, {{1, 2, 3}, 9});
    const std::vector<jostle::Ray3f> rays(4, {{0, 0, 0}, {1, 1, 1}});
    jostle::mpi::Answers<Found> found;
    jostle::mpi::Answers<jostle::mpi::ObjectHit<float>> nearest, all;
    std::vector<jostle::mpi::ObjectHit<float>> firsts(rays.size());
    std::vector<std::uint64_t> counts(boxes.size());
    const auto ask = [&] {
        world.all(std::span<const jostle::Aabb3f>(boxes), found);
        world.all(std::span<const jostle::Ray3f>(rays), all, {}, 3);
        world.nearest(std::span<const jostle::Nearest3f>(near), nearest);
        world.first(std::span<const jostle::Ray3f>(rays), std::span(firsts));
        world.count(std::span<const jostle::Aabb3f>(boxes), std::span(counts));
    };
    ask();
    const auto in_peace = std::tuple(items_of(found), items_of(all), items_of(nearest), firsts, counts);
    for (const Shortage shortage : {Shortage::of_resource, Shortage::of_all}) {
        if (!can_be_made(shortage)) continue;
        found = {}, all = {}, nearest = {};
        EXPECT_GT(fail_at_each_allocation(ask, shortage, memory, failing, [] { return true; }), 20u);
        EXPECT_TRUE(everywhere(
            in_peace == std::tuple(items_of(found), items_of(all), items_of(nearest), firsts, counts)));
    }
    for (std::int64_t given = 3; given < 3000; given *= 2) {
        for (int k = 0; k < 20; ++k)
            scene.operate(80);
        if (rank() == failing) memory.left = given;
        const std::string failure = failure_of([&] { scene.world->update(); });
        memory.left = std::numeric_limits<std::int64_t>::max();
        if (!failure.empty()) {
            EXPECT_EQ((Asker<3, float>(scene, static_cast<std::uint64_t>(given)).disagreement()), "")
                << "as if it hadn't been called";
            scene.world->update();
        }
        ASSERT_TRUE(scene.update_after_world());
    }
}

/// Numbers that make differences, quotients and squares as inexact as they get: whatever a query finds,
/// its reach meets.
template <class T>
void check_reaches(std::uint64_t seed)
{
    Random random(seed);
    std::uint64_t lines = 0, spheres = 0, beyond = 0;
    const auto number = [&](int least, int greatest) {
        const auto magnitude =
            least + static_cast<int>(random.below(static_cast<std::uint32_t>(greatest - least)));
        const T value = static_cast<T>(std::ldexp(1 + random.uniform(0, 1), magnitude));
        return random.below(2) == 0 ? value : -value;
    };
    const auto nudged = [&](T value) {
        for (std::uint32_t steps = random.below(6); steps > 0; --steps)
            value = std::nextafter(value, steps % 2 == 0 ? T(0) : std::numeric_limits<T>::infinity());
        return value;
    };
    const int small = std::numeric_limits<T>::min_exponent - 10, large = std::numeric_limits<T>::max_exponent;
    for (int i = 0; i < 200'000; ++i) {
        const bool extreme = random.below(2) == 0;
        const int least = extreme ? small / 2 : -6, greatest = extreme ? large / 2 - 2 : 6;
        jostle::Ray<2, T> ray{{number(least, greatest), number(least, greatest)},
                              {number(least, greatest), number(least, greatest)},
                              std::abs(number(least, greatest))};
        if (extreme && random.below(4) == 0) ray.direction[0] = number(small, large);
        if (random.below(4) == 0) ray.max_fraction = 0;
        Aabb<2, T> box;
        for (int d = 0; d < 2; ++d) { // ends about where the ray does
            const T end = ray.origin[d] + ray.direction[d] * (random.below(4) == 0 ? 0 : ray.max_fraction);
            const T other = end + number(least, greatest);
            box.lo[d] = nudged(std::min(end, other));
            box.hi[d] = std::max(box.lo[d], nudged(std::max(end, other)));
        }
        const auto reach = Form<jostle::Ray<2, T>>::reach(ray);
        const auto wide = jostle::mpi::reach_of(box);
        if (jostle::hit_fraction(ray, box)) {
            ++lines;
            ASSERT_TRUE(overlaps(reach, wide)) << "ray " << i;
        }
        beyond += !overlaps(reach, wide);
        jostle::Sphere<2, T> sphere{ray.origin, std::abs(number(least, greatest))};
        if (random.below(8) == 0) sphere.radius = 0;
        Aabb<2, T> near;
        for (int d = 0; d < 2; ++d) {
            near.lo[d] = d == 0 ? nudged(sphere.center[d] + sphere.radius) : sphere.center[d];
            near.hi[d] = std::max(near.lo[d], near.lo[d] + std::abs(number(least, greatest)));
        }
        if (jostle::overlaps(sphere, near)) {
            ++spheres;
            ASSERT_TRUE(overlaps(Form<jostle::Sphere<2, T>>::reach(sphere), jostle::mpi::reach_of(near)))
                << i;
        }
    }
    EXPECT_GT(lines, 10'000u);
    EXPECT_GT(spheres, 10'000u);
    EXPECT_GT(beyond, 10'000u);
}
TEST(Queries, ReachMeetsAllThatIsFound)
{
    check_reaches<float>(1);
    check_reaches<double>(2);
}

} // namespace
} // namespace mpi_tests
