// SPDX-License-Identifier: MIT
// What a World refuses, and how it is left.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <vector>

#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "tests/contract/error_of.hpp"
#include "tests/world/events.hpp"

namespace world_tests {
namespace {

using contract::error_of;
using jostle::Error;
using jostle::ErrorCode;
using jostle::ObjectId;
using jostle::World3d;
using jostle::World3f;

TEST(World, BoxesBehindNullPointersAreRefused)
{
    const auto nothing = jostle::BoxView<3, float>::strided(nullptr, nullptr, 2, 24);
    const std::string expected = "a view of 2 boxes with a null pointer",
                      joined = "a view of 2 boxes to be joined with a null pointer";
    World3f world;
    std::vector<ObjectId> ids = {world.add(cube(0)), world.add(cube(0))};
    world.update();
    std::pmr::vector<jostle::Pair> pairs;
    const auto none = [](std::uint32_t, ObjectId) { return true; };
    EXPECT_EQ(error_of([&] { world.add(nothing, ids); }).what(), expected);
    EXPECT_EQ(error_of([&] { world.move(ids, nothing); }).what(), expected);
    EXPECT_EQ(error_of([&] { world.update(ids, nothing); }).what(), expected);
    EXPECT_EQ(error_of([&] { world.join(nothing, pairs); }).what(), joined);
    EXPECT_EQ(error_of([&] { world.join(nothing, none); }).what(), joined);
    EXPECT_EQ(world.size(), 2u);
}

TEST(World, AJoinOfMoreBoxesThanNumbersReachIsRefused)
{
    World3f world;
    world.add(cube(0));
    world.update();
    const jostle::Aabb3f box = cube(0);
    const auto many = jostle::BoxView<3, float>::strided(box.lo.data(), box.hi.data(), ~std::uint32_t{0}, 0);
    const std::string expected = "4294967295 boxes in one call; give at most 4294967294";
    std::pmr::vector<jostle::Pair> pairs;
    const auto none = [](std::uint32_t, ObjectId) { return false; };
    EXPECT_EQ(error_of([&] { world.join(many, pairs); }).what(), expected);
    EXPECT_EQ(error_of([&] { world.join(many, none); }).what(), expected);
}

TEST(World, LayersThatSelectAllOrAreManyAreRefused)
{
    const auto made = [](std::vector<jostle::QueryLayer> layers) {
        return [layers = std::move(layers)] { World3f world({.layers = layers}); };
    };
    const Error all = error_of(made({{.mask = 2}, {}}));
    EXPECT_EQ(all.index(), 1u);
    EXPECT_STREQ(all.what(),
                 "layer 1 has all bits in category and mask, as queries about all objects have; drop it");
    EXPECT_STREQ(error_of(made(std::vector<jostle::QueryLayer>(9, {.mask = 2}))).what(),
                 "9 layers; each has indexes to keep, give at most 8");
    made(std::vector<jostle::QueryLayer>(8, {.mask = 2}))();
}

TEST(World, BadBoxesAreRefusedByName)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(0));
    world.update();
    jostle::Aabb3f nan = cube(0), inverted = cube(0);
    nan.hi[1] = std::nanf("");
    inverted.lo[2] = 2;
    EXPECT_STREQ(error_of([&] { world.move(b, nan); }).what(),
                 "box of object 1: hi.y is NaN; every bound must be a number (infinite is allowed)");
    EXPECT_STREQ(error_of([&] { world.move(b, inverted); }).what(),
                 "box of object 1: lo.z = 2 is greater than hi.z = 1; swap them or drop the box");
    EXPECT_EQ(error_of([&] { (void)world.add(nan); }).code(), ErrorCode::nan_coordinate);
    const std::vector<ObjectId> ids = {a, b};
    const std::vector<jostle::Aabb3f> boxes = {cube(5), nan};
    EXPECT_EQ(error_of([&] { world.move(ids, boxes); }).index(), b.index);
    EXPECT_EQ(error_of([&] { world.update(ids, boxes); }).index(), b.index);
    EXPECT_EQ(error_of([&] { world.update(ids, std::vector<jostle::Aabb3f>(1)); }).code(),
              ErrorCode::size_mismatch);
    world.update();
    EXPECT_EQ(world.box(a).lo[0], 0) << "a batch with a bad box does nothing";
    EXPECT_EQ(world.stats().commands, 0u);
    const float nowhere[3] = {0, std::nanf(""), 0}, negative[3] = {1, -1, 1};
    const Error displaced = error_of([&] { world.move(b, cube(0), nowhere); });
    EXPECT_EQ(displaced.code(), ErrorCode::nan_coordinate);
    EXPECT_STREQ(displaced.what(), "displacement of object 1: displacement[1] is NaN; give a number");
    const float endless[3] = {-HUGE_VALF, 0, 0};
    EXPECT_STREQ(
        error_of([&] { world.move(b, {{HUGE_VALF, 0, 0}, {HUGE_VALF, 1, 1}}, endless); }).what(),
        "displacement of object 1: displacement[0] = -inf moves a bound to NaN; give a finite number");
    EXPECT_STREQ(error_of([&] { world.move(ObjectId{}, cube(0)); }).what(),
                 "an empty ObjectId names no object; use ids that add() returned");
    EXPECT_STREQ(error_of([&] { world.resize(a, negative); }).what(),
                 "size of object 0: size[1] = -1 is not a number >= 0");
    EXPECT_EQ(error_of([&] { world.set_margin(a, -1); }).code(), ErrorCode::invalid_argument);
    EXPECT_EQ(error_of([&] { world.set_margin(a, HUGE_VALF); }).code(), ErrorCode::invalid_argument);
    jostle::WorldOptions huge;
    huge.margin = 1e300;
    EXPECT_STREQ(error_of([&] { (void)World3f(huge); }).what(),
                 "margin 1e+300 of the world; give a number from 0 to 3.40282e+38");
    EXPECT_NO_THROW((void)World3d(huge)); // doubles hold it
}

// What can't be asked doesn't compile.
template <class Asked, class Question>
concept HasFirst = requires(const Asked& asked, const Question& question) { asked.first(question); };
template <class Asked, class Question>
concept HasAny = requires(const Asked& asked, const Question& question) { asked.any(question); };
static_assert(HasFirst<World3f, jostle::Ray3f> && HasFirst<World3f, jostle::Sweep3f>);
static_assert(!HasFirst<World3f, jostle::Sphere3f> && !HasFirst<World3f, jostle::Ray3d>);
static_assert(HasAny<World3f, jostle::Ray3f> && HasAny<World3f, jostle::Sphere3f>);
static_assert(!HasAny<World3f, jostle::Nearest3f> && !HasAny<World3f, jostle::Sphere<2, float>>);
static_assert(HasAny<jostle::BoxIndex3f, jostle::Frustum3f> &&
              !HasAny<jostle::BoxIndex3f, jostle::Nearest3f>);

TEST(World, IdsMayBeKeysOfHashTables)
{
    World3f world;
    std::unordered_map<ObjectId, int> number;
    std::vector<ObjectId> ids;
    for (int i = 0; i < 100; ++i)
        number[ids.emplace_back(world.add(cube(0)))] = i;
    world.remove(ids[7]);
    world.update();
    number[world.add(cube(0))] = 100; // an index that was used before, and another id
    EXPECT_EQ(number.size(), 101u);
    EXPECT_EQ(number.at(ids[7]), 7);
    EXPECT_EQ(std::hash<ObjectId>()(ids[3]), std::hash<ObjectId>()(world.id(ids[3].index)));
}

TEST(World, AFailedUpdateInPlaceChangesNothingAndKeepsWhatWasQueued)
{
    World3f world;
    const ObjectId a = world.add(cube(0)), b = world.add(cube(9));
    world.update();
    world.move(a, cube(8.5f));
    jostle::Aabb3f nan = cube(0);
    nan.lo[0] = std::nanf("");
    const std::vector<ObjectId> ids = {b};
    EXPECT_THROW(world.update(ids, std::vector<jostle::Aabb3f>{nan}), Error);
    EXPECT_EQ(world.box(a).lo[0], 0);
    world.update();
    EXPECT_EQ(world.box(a).lo[0], 8.5f);
    EXPECT_EQ(began(world), (Began{{a, b}}));
}

TEST(World, AMoveInPlaceOfAnObjectThatIsGoneIsAnError)
{
    World3f world;
    const ObjectId gone = world.add(cube(0)), other = world.add(cube(9));
    world.update();
    world.remove(gone);
    world.update();
    const ObjectId heir = world.add(cube(3));
    world.update();
    ASSERT_EQ(heir.index, gone.index);
    const std::vector<ObjectId> ids{gone};
    const std::vector<jostle::Aabb3f> boxes{cube(20)};
    for (const bool among_commands : {false, true}) {
        if (among_commands) world.move(other, cube(10));
        const Error error = error_of([&] { world.update(ids, boxes); });
        EXPECT_EQ(error.code(), ErrorCode::stale_id);
        EXPECT_EQ(error.index(), gone.index);
        EXPECT_EQ(world.box(heir).lo[0], 3);
    }
    world.update();
    EXPECT_EQ(world.box(other).lo[0], 10);
}

TEST(World, MarginsTogetherAreFinite)
{
    constexpr float inf = std::numeric_limits<float>::infinity(), huge = 3e38f;
    jostle::WorldOptions options;
    options.margin = huge;
    World3f world(options);
    const jostle::Aabb3f box{{inf, 0, 0}, {inf, 1, 1}};
    const Error refused = error_of([&] { world.add(box, {.margin = huge}); });
    EXPECT_EQ(refused.code(), ErrorCode::invalid_argument);
    EXPECT_STREQ(refused.what(), "margin 3e+38 of new objects and the world's margin 3e+38 are together more "
                                 "than 3.40282e+38; give less");
    const ObjectId id = world.add(box, {.margin = 4e37f});
    const Error later = error_of([&] { world.set_margin(id, huge); });
    EXPECT_EQ(later.index(), id.index);
    EXPECT_NE(std::string(later.what()).find("margin 3e+38 of object 0 and the world's"), std::string::npos);
    world.update();
    EXPECT_EQ(world.bounds(id).lo[0], inf);
    EXPECT_EQ(world.margin(id), huge + 4e37f);
    EXPECT_EQ(world.fork().bounds(id).lo[0], inf);
}

/// Runs tasks one after another, and breaks down when it has run so often.
class BreakingExecutor final : public jostle::Executor
{
  public:
    std::uint32_t concurrency() const noexcept override { return 4; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        if (left == 0) {
            ++broken;
            throw std::runtime_error("the host's job system is down");
        }
        --left;
        for (std::uint32_t i = 0; i < count; ++i)
            task(i);
    }
    static constexpr std::uint64_t plenty = 1'000'000;
    std::uint64_t left = plenty, broken = 0;
};

TEST(World, AnExecutorThatFailsFailsTheUpdateWhereverItIs)
{
    BreakingExecutor executor;
    World3f world(jostle::WorldOptions{.executor = &executor});
    std::vector<ObjectId> ids(9000);
    std::vector<jostle::Aabb3f> boxes;
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const auto x = static_cast<float>(i % 100), y = static_cast<float>(i / 100);
        boxes.push_back({{x, y, 0}, {x + 1, y + 1, 1}});
    }
    world.add(boxes, ids);
    for (int update = 0; update < 9; ++update) { // added, at rest, moving on, at rest again
        if (update == 4)
            for (std::size_t i = 0; i < ids.size(); i += 3)
                world.move(ids[i], boxes[i + 1]);
        const std::vector<std::byte> before = world.save();
        for (std::uint64_t runs = 0;; ++runs) {
            executor.left = runs;
            executor.broken = 0;
            bool failed = false;
            try {
                world.update();
            } catch (const std::runtime_error&) {
                failed = true;
            }
            executor.left = BreakingExecutor::plenty;
            ASSERT_EQ(failed, executor.broken != 0) << "update " << update << ", after " << runs << " runs";
            if (!failed) break;
            ASSERT_EQ(world.save(), before) << "update " << update << ", after " << runs << " runs";
        }
    }
    for (int k = 0; k < 300; ++k) // bit by bit
        world.update();
    EXPECT_EQ(world.stats().resting, ids.size());
    EXPECT_EQ(world.count(jostle::Aabb3f{{-1, -1, -1}, {101, 101, 2}}), ids.size());
}

} // namespace
} // namespace world_tests
