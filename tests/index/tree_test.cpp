// SPDX-License-Identifier: MIT
// The structure itself: valid after every change, as good after long use as when rebuilt, and as before
// where memory runs out.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <numeric>
#include <span>
#include <tuple>
#include <vector>

#include "index/box_index_access.hpp"
#include "index/tree/tree.hpp"
#include "jostle/executor.hpp"
#include "tests/contract/counting_memory.hpp"
#include "tests/index/twin.hpp"

namespace {

using namespace jostle;
using twin::Kind;
using twin::Random;
using twin::random_box;

using Tree = index::Tree<3, float>;
using View = BoxView<3, float>;

/// Nodes and leaves that a search for each of some boxes opens.
double visits(const Tree& tree, std::span<const Aabb3f> questions)
{
    std::uint64_t opened = 0;
    for (const Aabb3f& box : questions) {
        std::vector<index::Child<3, float>> way;
        if (tree.root()) way.push_back(tree.root());
        while (!way.empty()) {
            const index::Child<3, float> child = way.back();
            way.pop_back();
            ++opened;
            if (child.is_leaf()) continue;
            for (std::uint32_t lane = 0; lane < index::lanes; ++lane)
                if (child.node()->child[lane] && overlaps(child.node()->bounds.get(lane), box))
                    way.push_back(child.node()->child[lane]);
        }
    }
    return static_cast<double>(opened) / static_cast<double>(questions.size());
}

struct TreeObjects
{
    std::vector<std::uint32_t> ids;
    std::vector<Aabb3f> boxes;

    TreeObjects(Kind kind, std::uint32_t count, std::uint64_t seed)
    {
        Random random(seed);
        for (std::uint32_t i = 0; i < count; ++i) {
            ids.push_back(i);
            boxes.push_back(random_box<3, float>(random, kind));
        }
    }
    /// A rebuilt tree opens `fresh` nodes and leaves for the boxes; how many more does this one?
    double compare(const Tree& tree) const
    {
        Tree fresh{IndexOptions{}};
        fresh.put(ids, View(boxes));
        EXPECT_EQ(fresh.validate(), nullptr);
        std::vector<Aabb3f> questions;
        for (std::size_t i = 0; i < boxes.size(); i += 7)
            questions.push_back(boxes[i]);
        return visits(tree, questions) / visits(fresh, questions);
    }
};

class Churn : public ::testing::TestWithParam<int>
{
};

TEST_P(Churn, LeavesTheTreeAsGoodAsNew)
{
    const Kind kind = static_cast<Kind>(GetParam());
    TreeObjects objects(kind, 12000, 3);
    Random random(5);
    Tree tree{IndexOptions{}};
    tree.put(objects.ids, View(objects.boxes));
    for (int round = 0; round < 60; ++round) {
        std::vector<std::uint32_t> gone, moved;
        std::vector<Aabb3f> back, to;
        for (const std::uint32_t id : objects.ids) {
            if (random.below(20) == 0) {
                gone.push_back(id);
                back.push_back(objects.boxes[id] = random_box<3, float>(random, kind));
            } else if (random.below(10) == 0) {
                moved.push_back(id);
                Aabb3f& box = objects.boxes[id];
                for (int d = 0; d < 3; ++d) {
                    const float by = static_cast<float>(random.number(-0.1, 0.1));
                    box.lo[d] += by;
                    box.hi[d] += by;
                }
                to.push_back(box);
            }
        }
        tree.erase(gone);
        ASSERT_EQ(tree.validate(), nullptr);
        tree.put(gone, View(back));
        ASSERT_EQ(tree.validate(), nullptr);
        tree.put(moved, View(to));
        ASSERT_EQ(tree.validate(), nullptr);
    }
    const double ratio = objects.compare(tree);
    RecordProperty("visits", std::to_string(ratio));
    EXPECT_LE(ratio, 1.07);
    std::vector<std::uint32_t> order = objects.ids;
    tree.erase(order);
    EXPECT_EQ(tree.validate(), nullptr);
    EXPECT_EQ(tree.stats().leaves + tree.stats().pages + tree.stats().nodes, 0u);
}

// Where distances grow from box to box, or half of all boxes are so far away that the others seem to lie in
// one place.
TEST(Order, SearchesStayShortWhereverBoxesLie)
{
    for (const Kind kind : {Kind::uniform, Kind::growing, Kind::outliers}) {
        const auto opened = [&](std::uint32_t count) {
            const TreeObjects objects(kind, count, 3);
            Tree tree{IndexOptions{}};
            tree.put(objects.ids, View(objects.boxes));
            EXPECT_EQ(tree.validate(), nullptr);
            return visits(tree, std::span(objects.boxes).first(500));
        };
        const double few = opened(2000), many = opened(64'000);
        EXPECT_LT(many, 5 * few) << name(kind) << ' ' << few;
        EXPECT_LT(many, 60) << name(kind);
    }
}

// As moving one by one, too, for which pages are split.
TEST(Order, OfBoxesFarApartIsThatOfInsertingThemOneByOne)
{
    for (const Kind kind : {Kind::growing, Kind::outliers}) {
        const TreeObjects objects(kind, 3000, 5);
        Tree built{IndexOptions{}}, grown{IndexOptions{}};
        built.put(objects.ids, View(objects.boxes));
        for (std::size_t i = 0; i < objects.ids.size(); ++i) {
            // The frame is that of all boxes.
            if (i == 0) grown.build({}, View(objects.boxes)), grown.erase(std::span(objects.ids).subspan(1));
            if (i > 0) grown.put({&objects.ids[i], 1}, View(std::span(&objects.boxes[i], 1)));
        }
        ASSERT_EQ(grown.validate(), nullptr);
        EXPECT_LE(visits(grown, objects.boxes), 1.5 * visits(built, objects.boxes)) << name(kind);
    }
}

TEST(Hull, OfThoseThatCountIsFoundWithoutTheOthers)
{
    Random random(9);
    for (int kind = 0; kind <= static_cast<int>(Kind::last); ++kind)
        for (const std::uint32_t count : {0u, 1u, 2u, 15u, 16u, 17u, 255u, 256u, 257u, 5000u}) {
            const TreeObjects objects(static_cast<Kind>(kind), count, 3 + count);
            Tree tree{IndexOptions{}};
            tree.put(objects.ids, View(objects.boxes));
            for (const std::uint32_t share : {0u, 1u, 2u, 50u, 1000u}) { // one of so many doesn't count
                std::vector<bool> counts(count);
                for (std::uint32_t id = 0; id < count; ++id)
                    counts[id] = share == 0 || random.below(share) != 0;
                std::size_t asked = 0, gone = 0;
                const Aabb3f hull = tree.hull_of([&](std::uint32_t id) { return ++asked, counts[id]; });
                constexpr float end = std::numeric_limits<float>::infinity();
                Aabb3f expected{{end, end, end}, {-end, -end, -end}};
                for (std::uint32_t id = 0; id < count; ++id) {
                    gone += !counts[id];
                    for (int d = 0; d < 3 && counts[id]; ++d) {
                        expected.lo[d] = std::min(expected.lo[d], objects.boxes[id].lo[d]);
                        expected.hi[d] = std::max(expected.hi[d], objects.boxes[id].hi[d]);
                    }
                }
                ASSERT_TRUE(hull.lo == expected.lo && hull.hi == expected.hi)
                    << name(static_cast<Kind>(kind)) << ' ' << count << ' ' << share;
                EXPECT_TRUE(share == 1 || asked <= 6 * (gone + 200)) << asked;
            }
        }
}

/// Nodes on the longest way from here to a page, whose node has leaves for children.
std::uint64_t depth_below(index::Child<3, float> child)
{
    if (!child || child.node()->child[0].is_leaf()) return 0;
    std::uint64_t deepest = 0;
    for (std::uint32_t lane = 0; lane < index::lanes; ++lane)
        if (child.node()->child[lane]) deepest = std::max(deepest, depth_below(child.node()->child[lane]));
    return deepest + 1;
}

/// Objects in leaves, as an instruction set puts them there.
template <int Dim, class T>
struct Arranged
{
    std::vector<index::Leaf<Dim, T>> leaves;
    index::Bounds<Dim, T> hulls;

    Arranged(InstructionSet set, const index::Gathered<Dim, T>& objects)
        : leaves((objects.count + index::lanes - 1) / index::lanes)
    {
        std::vector<index::Leaf<Dim, T>*> to;
        for (index::Leaf<Dim, T>& leaf : leaves)
            to.push_back(&leaf);
        index::kernels_for<Dim, T>(set).arrange(objects, to.data(), hulls);
    }
};

/// Objects on a line along an axis come in the order of their places, in whichever they were given.
TEST(Order, NeighboursComeTogether)
{
    for (int axis = 0; axis < 3; ++axis)
        for (const std::uint32_t count : {17u, 40u, 256u}) {
            SCOPED_TRACE(testing::Message() << "axis " << axis << ", " << count << " objects");
            index::Gathered<3, float> objects;
            for (std::uint32_t k = 0; k < count; ++k) {
                const std::uint32_t place = k * 77 % count; // no count has 7 or 11 for a factor
                Aabb3f box;
                for (int d = 0; d < 3; ++d) {
                    box.lo[d] = d == axis ? static_cast<float>(place) - 100 : static_cast<float>(k % 2);
                    box.hi[d] = box.lo[d] + 0.25f;
                }
                objects.add(box, place);
            }
            for (const InstructionSet set : supported_instruction_sets()) {
                const Arranged<3, float> arranged(set, objects);
                for (std::uint32_t k = 0; k < count; ++k) {
                    const std::uint32_t id = arranged.leaves[k / 16].id[k % 16];
                    ASSERT_EQ(id / 16, k / 16) << name(set);
                    ASSERT_EQ(arranged.leaves[k / 16].bounds.lo[axis][k % 16], static_cast<float>(id) - 100);
                }
            }
        }
}

/// Where nine heaps of 16 objects lie apart, each becomes a leaf.
TEST(Order, LeavesAreFullAndSmall)
{
    constexpr std::uint32_t count = 9 * 16 + 3;
    index::Gathered<2, double> objects;
    for (std::uint32_t k = 0; k < count; ++k) {
        const std::uint32_t heap = k < 9 * 16 ? k % 9 : 50; // the last three are far off
        const double at = 1000.0 * heap + 0.01 * (k / 9);
        objects.add({{at, 0}, {at, 1}}, k);
    }
    const Arranged<2, double> arranged(supported_instruction_sets().front(), objects);
    std::vector<bool> there(count);
    double edges = 0;
    for (std::uint32_t k = 0; k < count; ++k)
        there[arranged.leaves[k / 16].id[k % 16]] = true;
    EXPECT_EQ(std::count(there.begin(), there.end(), true), count);
    for (std::uint32_t leaf = 0; leaf < 9; ++leaf)
        edges += arranged.hulls.hi[0][leaf] - arranged.hulls.lo[0][leaf];
    EXPECT_LT(edges, 9 * 0.16);
    for (std::uint32_t lane = 3; lane < 16; ++lane)
        EXPECT_EQ(arranged.leaves[9].id[lane], index::no_id);
}

/// Of a lattice every leaf is a square: both halves are cut along the other axis, and again.
TEST(Order, LeavesOfALatticeAreSquares)
{
    constexpr std::uint32_t side = 16;
    index::Gathered<2, float> objects;
    for (std::uint32_t k = 0; k < side * side; ++k) {
        const std::uint32_t place = k * 77 % (side * side);
        const float x = static_cast<float>(place % side), y = static_cast<float>(place / side);
        objects.add({{x, y}, {x, y}}, k);
    }
    for (const InstructionSet set : supported_instruction_sets()) {
        const Arranged<2, float> arranged(set, objects);
        for (std::uint32_t leaf = 0; leaf < side; ++leaf)
            for (int d = 0; d < 2; ++d)
                ASSERT_EQ(arranged.hulls.hi[d][leaf] - arranged.hulls.lo[d][leaf], 3)
                    << name(set) << ", leaf " << leaf << ", axis " << d;
    }
}

/// Any number of objects, also some in one place, at zeros of both signs, or without an end, are in the same
/// lanes on every instruction set.
TEST(Order, IsTheSameOnEveryInstructionSet)
{
    Random random(77);
    for (std::uint32_t count = 1; count <= index::page_capacity; count += 1 + count / 16) {
        index::Gathered<3, float> objects;
        for (std::uint32_t k = 0; k < count; ++k) {
            Aabb3f box = random_box<3, float>(random, Kind::uniform);
            for (int d = 0; d < 3; ++d) {
                if (count % 3 == 0) box.lo[d] = box.hi[d] = k % 2 == 0 ? 0.0f : -0.0f;
                if (count % 3 == 1 && k % 5 == 0) box.lo[d] = box.hi[d] = 0.5f;
                if (count % 3 == 2 && k % 50 == 7) box.hi[d] = std::numeric_limits<float>::infinity();
            }
            objects.add(box, 1000 + k);
        }
        const Arranged<3, float> expected(InstructionSet::scalar, objects);
        for (const InstructionSet set : supported_instruction_sets()) {
            const Arranged<3, float> found(set, objects);
            for (std::size_t b = 0; b < found.leaves.size(); ++b) {
                ASSERT_EQ(std::memcmp(&found.leaves[b], &expected.leaves[b], sizeof(found.leaves[b])), 0)
                    << name(set) << ", " << count << " objects, leaf " << b;
            }
            ASSERT_EQ(std::memcmp(&found.hulls, &expected.hulls, sizeof(found.hulls)), 0)
                << name(set) << ", " << count << " objects";
        }
    }
}

TEST(Stats, DepthIsTheLongestWayToAPage)
{
    Tree tree{{}};
    EXPECT_EQ(tree.stats().depth, 0u);
    std::uint32_t done = 0;
    for (const auto& [count, least, most] : {std::tuple(10u, 0u, 0u), std::tuple(300u, 1u, 1u),
                                             std::tuple(2000u, 1u, 2u), std::tuple(20000u, 2u, 5u)}) {
        const TreeObjects objects(Kind::uniform, count, 11);
        tree.put(std::span(objects.ids).subspan(done), View(std::span(objects.boxes).subspan(done)));
        done = count;
        EXPECT_EQ(tree.stats().depth, depth_below(tree.root())) << count;
        EXPECT_GE(tree.stats().depth, least) << count;
        EXPECT_LE(tree.stats().depth, most) << count;
    }
    EXPECT_EQ(tree.stats().nodes > 1, tree.stats().depth > 1);
    tree.clear();
    EXPECT_EQ(tree.stats().depth, 0u);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Churn, ::testing::Range(0, static_cast<int>(Kind::last) + 1),
                         [](const auto& each) {
                             return std::string(twin::name(static_cast<Kind>(each.param)));
                         });

class Following : public ::testing::TestWithParam<int>
{
};

TEST_P(Following, IsAsGoodAsMovingOneByOne)
{
    const Kind kind = static_cast<Kind>(GetParam());
    TreeObjects objects(kind, 6000, 3);
    Random random(5);
    IndexOptions options, on_three;
    const auto three = make_thread_executor(3);
    on_three.executor = three.get();
    Tree tree(options), same(on_three);
    tree.put(objects.ids, View(objects.boxes));
    same.put(objects.ids, View(objects.boxes));
    const auto where = [&](std::span<const std::uint32_t> ids, Aabb3f* boxes) {
        for (std::size_t k = 0; k < ids.size(); ++k)
            boxes[k] = objects.boxes[ids[k]];
    };
    for (int round = 0; round < 40; ++round) {
        std::vector<std::uint32_t> back;
        std::vector<Aabb3f> there;
        constexpr float nan = std::numeric_limits<float>::quiet_NaN();
        for (const std::uint32_t id : objects.ids) {
            Aabb3f& box = objects.boxes[id];
            const bool leaps = random.below(50) == 0, goes = random.below(50) == 0;
            for (int d = 0; d < 3; ++d) {
                const float by = static_cast<float>(random.number(-0.1, 0.1));
                box.lo[d] += by;
                box.hi[d] += by;
            }
            if (leaps) box = random_box<3, float>(random, kind);
            if (!goes) continue;
            back.push_back(id);
            there.push_back(box);
            box = {{nan, nan, nan}, {nan, nan, nan}};
        }
        const bool followed = tree.follow(where);
        ASSERT_EQ(same.follow(where), followed);
        // Where keys begin with the digits of nothing but the id, whoever moves at all leaves.
        if (kind != Kind::identical && kind != Kind::stretched) {
            ASSERT_TRUE(followed) << round;
        }
        if (!followed) {
            ASSERT_EQ(tree.size(), 0u);
            back = objects.ids;
            for (std::size_t k = 0, gone = 0; k < back.size(); ++k)
                if (std::isnan(objects.boxes[k].lo[0])) objects.boxes[k] = there[gone++];
            there = objects.boxes;
        }
        ASSERT_EQ(tree.validate(), nullptr);
        ASSERT_EQ(tree.size(), objects.ids.size() - back.size());
        for (std::size_t k = 0; k < back.size(); ++k) {
            ASSERT_FALSE(tree.contains(back[k]));
            objects.boxes[back[k]] = there[k];
        }
        tree.put(back, View(there));
        same.put(back, View(there));
        ASSERT_EQ(tree.validate(), nullptr);
        for (const std::uint32_t id : objects.ids) {
            const Aabb3f found = tree.box(id), &box = objects.boxes[id];
            ASSERT_TRUE(found.lo == box.lo && found.hi == box.hi) << id;
        }
    }
    const double ratio = objects.compare(tree);
    RecordProperty("visits", std::to_string(ratio));
    EXPECT_LE(ratio, 1.3);
    EXPECT_EQ(objects.compare(same), ratio) << "whatever the threads do";

    // Twice as far from each other, and then all in one place: nothing stays where it was.
    for (Aabb3f& box : objects.boxes)
        for (int d = 0; d < 3; ++d) {
            const float by = std::isinf(box.lo[d]) ? 0 : box.lo[d] + 1000;
            box.lo[d] += by;
            box.hi[d] += by;
        }
    if (!tree.follow(where)) tree.put(objects.ids, View(objects.boxes));
    ASSERT_EQ(tree.validate(), nullptr);
    ASSERT_EQ(tree.size(), objects.ids.size());
    std::fill(objects.boxes.begin(), objects.boxes.end(), Aabb3f{{5, 5, 5}, {6, 6, 6}});
    if (!tree.follow(where)) {
        EXPECT_EQ(tree.size(), 0u);
        tree.put(objects.ids, View(objects.boxes));
    }
    ASSERT_EQ(tree.validate(), nullptr);
    EXPECT_LE(objects.compare(tree), 1.3);
}
INSTANTIATE_TEST_SUITE_P(Scenes, Following, ::testing::Range(0, static_cast<int>(Kind::last) + 1),
                         [](const auto& each) {
                             return std::string(twin::name(static_cast<Kind>(each.param)));
                         });

TEST(Order, OfInsertionDoesNotMatter)
{
    TreeObjects objects(Kind::uniform, 12000, 3);
    std::vector<std::uint32_t> order = objects.ids;
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        return objects.boxes[a].lo[0] < objects.boxes[b].lo[0];
    });
    for (const std::size_t batch : {1u, 100u}) {
        Tree tree{IndexOptions{}};
        for (std::size_t i = 0; i < order.size(); i += batch) {
            const std::vector<std::uint32_t> ids(
                order.begin() + static_cast<std::ptrdiff_t>(i),
                order.begin() + static_cast<std::ptrdiff_t>(std::min(order.size(), i + batch)));
            std::vector<Aabb3f> boxes;
            for (const std::uint32_t id : ids)
                boxes.push_back(objects.boxes[id]);
            tree.put(ids, View(boxes));
        }
        ASSERT_EQ(tree.validate(), nullptr);
        EXPECT_LE(objects.compare(tree), 1.07) << "batches of " << batch;
    }
}

TEST(Moving, ManyIsBuildingAnew)
{
    Random random(8);
    for (int kind = 0; kind <= static_cast<int>(Kind::last); ++kind)
        for (const std::size_t moving : {257u, 299u, 300u, 1500u, 2999u, 3000u}) {
            SCOPED_TRACE(testing::Message() << twin::name(static_cast<Kind>(kind)) << ", " << moving);
            TreeObjects objects(static_cast<Kind>(kind), 3000, 9);
            for (std::uint32_t& id : objects.ids)
                id = 3 * id + 1; // some ids are nobody's
            Tree tree{IndexOptions{}};
            tree.put(objects.ids, View(objects.boxes));
            const IndexStats before = tree.stats();
            std::vector<std::uint32_t> ids, positions(3000);
            std::iota(positions.begin(), positions.end(), 0u);
            for (std::uint32_t k = 3000; k > 1; --k)
                std::swap(positions[k - 1], positions[random.below(k)]);
            std::vector<Aabb3f> boxes;
            for (std::size_t k = 0; k < moving; ++k) {
                ids.push_back(objects.ids[positions[k]]);
                boxes.push_back(random_box<3, float>(random, static_cast<Kind>(kind)));
                objects.boxes[positions[k]] = boxes.back();
            }
            tree.put(ids, View(boxes));
            ASSERT_EQ(tree.validate(), nullptr);
            ASSERT_EQ(tree.size(), 3000u);
            EXPECT_EQ(tree.contains(0), false);
            for (std::size_t k = 0; k < 3000; ++k) {
                const Aabb3f found = tree.box(objects.ids[k]), &box = objects.boxes[k];
                ASSERT_TRUE(found.lo == box.lo && found.hi == box.hi) << k;
            }
            const IndexStats after = tree.stats();
            EXPECT_GE(after.sorts, before.sorts);
            EXPECT_GE(after.splits, before.splits);
            // Each page has been put in order once, as when an index is built.
            if (moving >= 300) {
                EXPECT_EQ(after.sorts, before.sorts + after.pages);
            }
        }
}

TEST(LookAround, FindsNothingInAnIndexThatIsEmptyByNow)
{
    const TreeObjects objects(Kind::uniform, 1000, 6);
    BoxIndex3f index;
    index.insert(objects.ids, View(objects.boxes));
    BoxIndexAccess::look_around(index, View(objects.boxes));
    for (std::size_t k = 0; k < objects.boxes.size(); ++k)
        ASSERT_FALSE(BoxIndexAccess::around(index, k).empty()) << "itself at least, " << k;
    index.erase(objects.ids);
    BoxIndexAccess::look_around(index, View(objects.boxes));
    for (std::size_t k = 0; k < objects.boxes.size(); ++k)
        ASSERT_TRUE(BoxIndexAccess::around(index, k).empty()) << k;
}

/// Who builds again and again gets the memory of the last but one.
TEST(Memory, BuildingAgainTakesNone)
{
    const TreeObjects objects(Kind::uniform, 20000, 4), others(Kind::clusters, 20000, 5);
    contract::CountingMemory memory;
    IndexOptions options;
    options.memory = &memory;
    BoxIndex3f index(options);
    index.build(View(objects.boxes));
    const std::uint64_t once = memory.bytes;
    for (int round = 0; round < 4; ++round) {
        const std::uint64_t before = memory.allocations;
        index.build(View(objects.boxes));
        index.move(objects.ids, View(others.boxes));
        index.move(objects.ids, View(objects.boxes));
        EXPECT_TRUE(round < 2 || memory.allocations == before) << memory.allocations - before;
        EXPECT_EQ(index.size(), 20000u);
        for (const std::uint32_t id : {0u, 77u, 19999u})
            EXPECT_EQ(index.box(id).lo, objects.boxes[id].lo);
    }
    EXPECT_GT(index.stats().bytes, memory.bytes - memory.bytes / 50);
    index.release_memory();
    EXPECT_LE(memory.bytes, once + once / 8) << "what was built once keeps nothing for the next time";
    index.build({});
    EXPECT_EQ(index.size(), 0u);
    EXPECT_FALSE(index.contains(77));
    index.release_memory();
    EXPECT_EQ(memory.bytes, 0u);
}

TEST(Memory, RunningOutLeavesTheTreeAsItWas)
{
    const TreeObjects objects(Kind::clusters, 3000, 9), more(Kind::power_law, 3000, 10);
    std::vector<std::uint32_t> new_ids, many, few; // few are moved one by one, many by building anew
    for (const std::uint32_t id : more.ids) {
        new_ids.push_back(id + 3000);
        if (id % 2 == 0) many.push_back(id);
        if (id % 12 == 0) few.push_back(id); // 250
    }
    std::vector<Aabb3f> many_to, few_to;
    for (const std::uint32_t id : many)
        many_to.push_back(more.boxes[id]);
    for (const std::uint32_t id : few) { // to where nobody is, between the clusters
        const Aabb3f &one = objects.boxes[id], &other = objects.boxes[(7 * id + 1500) % 3000];
        Aabb3f& box = few_to.emplace_back();
        for (int d = 0; d < 3; ++d)
            box.lo[d] = box.hi[d] = one.lo[d] / 2 + other.lo[d] / 2;
    }
    std::uint64_t refusals = 0;
    for (int change = 0; change < 5; ++change)
        for (std::uint64_t allowed = 0;; ++allowed) {
            contract::CountingMemory memory;
            IndexOptions options;
            options.memory = &memory;
            Tree tree(options);
            if (change != 0) tree.put(objects.ids, View(objects.boxes));
            memory.failing_allocation = memory.allocations + allowed;
            bool failed = false;
            try {
                if (change == 0) tree.put(objects.ids, View(objects.boxes));
                if (change == 1) tree.put(new_ids, View(more.boxes));
                if (change == 2) tree.put(many, View(many_to));
                if (change == 3) tree.put(few, View(few_to));
                if (change == 4) tree.build(new_ids, View(more.boxes));
            } catch (const std::bad_alloc&) {
                failed = true;
            }
            ASSERT_EQ(tree.validate(), nullptr) << "change " << change << ", allocation " << allowed;
            if (!failed) break;
            ++refusals;
            ASSERT_EQ(tree.size(), change == 0 ? 0u : 3000u);
            for (const std::uint32_t id : objects.ids) {
                if (change == 0) break;
                ASSERT_TRUE(tree.contains(id));
                const Aabb3f box = tree.box(id);
                for (int d = 0; d < 3; ++d)
                    ASSERT_TRUE(box.lo[d] == objects.boxes[id].lo[d] && box.hi[d] == objects.boxes[id].hi[d]);
            }
        }
    EXPECT_GT(refusals, 30u);
}

// Objects leave a crowd, some far, some hardly: there are more and more pages, until the memory is out.
TEST(Memory, RunningOutInTheMidstOfAMoveUndoesIt)
{
    contract::CountingMemory memory;
    IndexOptions options;
    options.memory = &memory;
    Tree tree(options);
    Random random(8);
    std::vector<std::uint32_t> ids(8000);
    std::iota(ids.begin(), ids.end(), 0u);
    std::vector<Aabb3f> boxes;
    const auto box_within = [&](double extent) {
        Aabb3f box;
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = static_cast<float>(random.number(0, extent));
            box.hi[d] = box.lo[d] + 0.25f;
        }
        return box;
    };
    while (boxes.size() < ids.size())
        boxes.push_back(box_within(4));
    tree.put(ids, View(boxes));
    std::uint64_t in_the_midst = 0;
    for (std::uint32_t round = 0; round < 120; ++round) {
        std::vector<std::uint32_t> moved;
        std::vector<Aabb3f> to;
        for (std::uint32_t k = 0; k < 200; ++k) {
            moved.push_back((round * 200 + k) % 8000);
            to.push_back(boxes[moved.back()]);
            if (k % 4 != 0)
                to.back() = box_within(4 * (1 + round / 10));
            else
                to.back().hi[k % 3] += 0.001f;
        }
        for (std::uint64_t allowed = 0;; ++allowed) {
            memory.failing_allocation = memory.allocations + allowed;
            try {
                tree.put(moved, View(to));
                break;
            } catch (const std::bad_alloc&) {
                in_the_midst += allowed > 0 || round > 0; // the first makes room for the boxes before
            }
            ASSERT_EQ(tree.validate(), nullptr) << "round " << round << ", allocation " << allowed;
            for (const std::uint32_t id : ids) {
                const Aabb3f box = tree.box(id);
                ASSERT_TRUE(box.lo == boxes[id].lo && box.hi == boxes[id].hi) << id << " in round " << round;
            }
        }
        for (std::size_t k = 0; k < moved.size(); ++k)
            boxes[moved[k]] = to[k];
    }
    EXPECT_GT(in_the_midst, 3u);
}

TEST(Memory, ComesBackWhenReleased)
{
    contract::CountingMemory memory;
    IndexOptions options;
    options.memory = &memory;
    const TreeObjects objects(Kind::uniform, 3000, 4);
    BoxIndex3f index(options);
    std::pmr::vector<Pair> pairs, again;
    index.insert(objects.ids, View(objects.boxes));
    index.join(View(objects.boxes), pairs);
    const std::uint64_t dense = memory.bytes;
    constexpr std::uint32_t far = 5'000'000;
    const std::vector<std::uint32_t> one{far};
    const std::vector<Aabb3f> its_box{objects.boxes[0]};
    index.insert(one, View(its_box));
    EXPECT_LT(memory.bytes, dense + 4 * far + 1000) << "nothing in reserve beyond an id far away";
    index.erase(one);
    index.release_memory();
    EXPECT_LT(memory.bytes, dense) << "of ids no longer in use, and what join worked in";
    index.join(View(objects.boxes), again);
    EXPECT_TRUE(again == pairs);
    for (int round = 0; round < 2; ++round) {
        index.clear();
        EXPECT_GT(memory.bytes, 0u);
        index.release_memory();
        EXPECT_EQ(memory.bytes, 0u);
        EXPECT_EQ(index.stats().bytes, 0u);
        EXPECT_EQ(index.size(), 0u);
        EXPECT_FALSE(index.any(objects.boxes[0]));
        index.insert(objects.ids, View(objects.boxes));
        index.join(View(objects.boxes), again);
        EXPECT_TRUE(again == pairs);
    }
}

TEST(Memory, ASteadyWorldTakesNoMore)
{
    contract::CountingMemory memory;
    IndexOptions options;
    options.memory = &memory;
    TreeObjects objects(Kind::uniform, 5000, 4);
    Tree tree(options);
    tree.put(objects.ids, View(objects.boxes));
    Random random(1);
    std::uint64_t after_warm_up = 0;
    for (int round = 0; round < 300; ++round) {
        if (round == 200) after_warm_up = memory.bytes;
        std::vector<std::uint32_t> ids;
        std::vector<Aabb3f> boxes;
        for (std::uint32_t id = random.below(20); id < 5000; id += 20) {
            ids.push_back(id);
            boxes.push_back(random_box<3, float>(random, Kind::uniform));
        }
        tree.erase(ids);
        tree.put(ids, View(boxes));
    }
    EXPECT_LE(memory.bytes, after_warm_up + after_warm_up / 20);
}

} // namespace
