// SPDX-License-Identifier: MIT
// Batches of questions with a filter for each, against the same questions asked one by one.
#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "jostle/jostle.hpp"
#include "tests/contract/error_of.hpp"
#include "tool/scenes/random.hpp"

using namespace jostle;
using contract::error_of;

namespace {

constexpr std::uint32_t objects = 700;
constexpr std::size_t questions = 90;

struct Scene
{
    explicit Scene(std::uint64_t seed) : random(seed)
    {
        for (std::uint32_t i = 0; i < objects; ++i) {
            boxes.push_back(box(0.5f));
            category.push_back(1u << random.below(4));
            mask.push_back(random.below(16));
            owner.push_back(random.below(20));
        }
        for (std::size_t i = 0; i < questions; ++i) {
            asked.push_back(box(2));
            rays.push_back({corner(), {number(-1, 1), number(-1, 1), 1}});
            spheres.push_back({corner(), number(0, 3)});
            near.push_back({corner(), 5, 4});
            near_boxes.push_back({box(1), 4, 4});
        }
    }
    float number(double lo, double hi) { return static_cast<float>(random.uniform(lo, hi)); }
    Vec3f corner() { return {number(0, 10), number(0, 10), number(0, 10)}; }
    Aabb3f box(float most)
    {
        const Vec3f lo = corner();
        return {lo, {lo[0] + number(0, most), lo[1] + number(0, most), lo[2] + number(0, most)}};
    }

    jostle_scenes::Random random;
    std::vector<Aabb3f> boxes, asked;
    std::vector<std::uint32_t> category, mask, owner;
    std::vector<Ray3f> rays;
    std::vector<Sphere3f> spheres;
    std::vector<Nearest3f> near;
    std::vector<NearestToBox3f> near_boxes;
};

/// `asked` is a BoxIndex3f or a World3f, and `accept` what a filter's is, told the number of the question.
template <class Asked, class Filter>
void agree(const Asked& asked, const Scene& scene, const std::vector<Filter>& filters)
{
    using Id = std::conditional_t<std::is_same_v<Filter, QueryFilter>, std::uint32_t, ObjectId>;
    using HitOf = std::conditional_t<std::is_same_v<Filter, QueryFilter>, Hit<float>, Hit<float, ObjectId>>;
    std::size_t results = 0;
    // In a batch, accept is told the question; alone it is always question 0.
    const auto alone = [&](std::size_t i, auto&& ask) {
        Filter filter = filters[i];
        const auto given = filter.accept;
        const auto numbered = [&](std::uint32_t, Id id) { return given(static_cast<std::uint32_t>(i), id); };
        if (given) filter.accept = numbered;
        ask(filter);
    };
    const auto regions = [&](const auto& those) {
        const std::span all_questions(those);
        ResultLists<Id> lists, few;
        std::unique_ptr<bool[]> any(new bool[questions]);
        std::vector<std::uint64_t> count(questions);
        asked.all(all_questions, lists, filters);
        asked.all(all_questions, few, filters, 2);
        asked.any(all_questions, std::span(any.get(), questions), filters);
        asked.count(all_questions, count, filters);
        for (std::size_t i = 0; i < questions; ++i)
            alone(i, [&](const Filter& filter) {
                std::vector<Id> expected;
                asked.all(those[i], expected, filter);
                results += expected.size();
                ASSERT_EQ(std::vector<Id>(lists[i].begin(), lists[i].end()), expected) << i;
                ASSERT_EQ(any[i], !expected.empty()) << i;
                ASSERT_EQ(count[i], expected.size()) << i;
                ASSERT_EQ(few.more(i), expected.size() > 2) << i;
            });
    };
    regions(scene.asked);
    regions(scene.spheres);
    const auto same = [&](std::span<const HitOf> found, const std::vector<HitOf>& expected) {
        ASSERT_EQ(found.size(), expected.size());
        for (std::size_t k = 0; k < found.size(); ++k) {
            ASSERT_EQ(found[k].id, expected[k].id);
            ASSERT_EQ(found[k].at, expected[k].at);
        }
        results += found.size();
    };
    ResultLists<HitOf> along, nearest, nearest_to_boxes;
    std::vector<HitOf> first(questions);
    asked.all(std::span(scene.rays), along, filters);
    asked.first(std::span(scene.rays), first, filters);
    asked.nearest(scene.near, nearest, filters);
    asked.nearest(scene.near_boxes, nearest_to_boxes, filters);
    for (std::size_t i = 0; i < questions; ++i)
        alone(i, [&](const Filter& filter) {
            std::vector<HitOf> expected;
            asked.all(scene.rays[i], expected, filter);
            same(along[i], expected);
            const auto hit = asked.first(scene.rays[i], filter);
            ASSERT_EQ(first[i].id, hit ? hit->id : HitOf{}.id) << i;
            asked.nearest(scene.near[i], expected, filter);
            same(nearest[i], expected);
            asked.nearest(scene.near_boxes[i], expected, filter);
            same(nearest_to_boxes[i], expected);
        });
    EXPECT_GT(results, 700u);
    const auto one_less = std::span(filters).first(questions - 1);
    ResultLists<Id> lists;
    const Error error = error_of([&] { asked.all(std::span(scene.asked), lists, one_less); });
    EXPECT_EQ(error.code(), ErrorCode::size_mismatch);
    EXPECT_NE(std::string(error.what()).find("90 queries and 89 filters"), std::string::npos) << error.what();
}

TEST(FilterOfEach, IndexAnswersAsOneByOne)
{
    for (const std::uint32_t threads : {1u, 3u}) {
        Scene scene(threads);
        const auto executor = make_thread_executor(threads);
        BoxIndex3f index({.executor = executor.get()});
        index.build(scene.boxes);
        const auto accept = [](std::uint32_t question, std::uint32_t id) { return (question + id) % 3 != 0; };
        std::vector<QueryFilter> filters(questions);
        for (std::size_t i = 0; i < questions; ++i) {
            if (i % 2 == 0) filters[i].exclude = scene.random.below(objects);
            if (i % 3 == 0) {
                filters[i].category = scene.category;
                filters[i].mask = scene.mask;
                filters[i].asker_mask = scene.random.below(16);
            }
            if (i % 5 == 0) {
                filters[i].owner = scene.owner;
                filters[i].asker_owner = scene.random.below(20);
            }
            if (i % 7 == 0) filters[i].accept = accept;
        }
        agree(index, scene, filters);
        // Of wrong filters the first is named by what is wrong with it.
        filters[50].category = std::span(scene.category).first(3);
        filters[50].mask = std::span(scene.mask).first(3);
        ResultLists<std::uint32_t> lists;
        EXPECT_EQ(error_of([&] { index.all(std::span<const Aabb3f>(scene.asked), lists, filters); }).code(),
                  ErrorCode::size_mismatch);
    }
}

TEST(FilterOfEach, WorldAnswersAsOneByOne)
{
    for (const std::uint32_t threads : {1u, 3u}) {
        Scene scene(threads + 10);
        const auto executor = make_thread_executor(threads);
        World3f world({.executor = executor.get()});
        std::vector<ObjectId> ids;
        for (std::uint32_t i = 0; i < objects; ++i)
            ids.push_back(world.add(
                scene.boxes[i],
                {.filter = {.category = scene.category[i], .mask = scene.mask[i], .owner = scene.owner[i]}}));
        world.update();
        world.update(); // they rest
        for (std::uint32_t i = 0; i < objects; i += 9)
            world.move(ids[i], scene.boxes[i] = scene.box(1));
        world.update();
        const auto accept = [](std::uint32_t question, ObjectId id) {
            return (question + id.index) % 3 != 0;
        };
        std::vector<ObjectQueryFilter> filters(questions);
        for (std::size_t i = 0; i < questions; ++i) {
            if (i % 2 == 0) filters[i].exclude = ids[scene.random.below(objects)];
            if (i % 3 == 0) filters[i].mask = scene.random.below(16);
            if (i % 4 == 1) filters[i].category = 1u << scene.random.below(4);
            if (i % 5 == 0) filters[i].owner = scene.random.below(20);
            if (i % 7 == 0) filters[i].accept = accept;
        }
        agree(world, scene, filters);
        world.move(ids[3], scene.box(1));
        world.apply();
        agree(world, scene, filters);
    }
}

/// Four threads of its own, and how often its tasks have run others on it, which not every executor can.
class Unnested final : public Executor
{
  public:
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return threads_->concurrency(); }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        nested += is_inside_ ? 1 : 0;
        threads_->run(count, [&](std::uint32_t i) {
            is_inside_ = true;
            task(i);
            is_inside_ = false;
        });
    }
    std::atomic<int> nested{0};

  private:
    static inline thread_local bool is_inside_ = false;
    const std::unique_ptr<Executor> threads_ = make_thread_executor(4);
};

TEST(FilterOfEach, TasksOfABatchRunNoOthers)
{
    constexpr std::uint32_t many = 12'000, asked = 900;
    Unnested executor;
    World3f world({.executor = &executor, .layers = {{.mask = 1}, {.mask = 2}, {.mask = 1u << 19}}});
    std::vector<Aabb3f> boxes;
    std::vector<ObjectId> ids;
    for (std::uint32_t i = 0; i < many; ++i) {
        const float x = static_cast<float>(2 * (i % 110)), y = static_cast<float>(2 * (i / 110));
        boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
        ids.push_back(world.add(boxes[i], {.filter = {.category = 1u << i % 20}}));
    }
    const std::vector<Ray3f> rays(asked, Ray3f{{0.5f, -1, 0.5f}, {0, 1, 0}});
    std::vector<Hit<float, ObjectId>> first(asked);
    std::vector<std::uint64_t> count(asked);
    for (const std::uint32_t kinds : {1u, 3u, 20u}) {
        world.update();
        world.update();
        std::vector<ObjectQueryFilter> filters(asked);
        for (std::uint32_t i = 0; i < asked && kinds != 1; ++i)
            filters[i].mask = 1u << i % kinds;
        for (int round = 0; round < 3; ++round) {
            for (std::uint32_t i = 0; i < many / 2; ++i)
                boxes[i].hi[2] += 0.5f;
            world.update(std::span(ids).first(many / 2), std::span(boxes).first(many / 2));
            world.first(rays, first, filters);
            world.count(rays, count, filters);
            for (std::uint32_t i = 0; i < asked; ++i)
                ASSERT_EQ(count[i], world.count(rays[i], filters[i])) << kinds << ' ' << i;
        }
        EXPECT_EQ(executor.nested.exchange(0), 0) << kinds;
    }
}

} // namespace
