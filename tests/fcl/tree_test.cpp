// SPDX-License-Identifier: MIT
// MendedTree against looking through all boxes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "jostle/fcl_tree.hpp"
#include "tool/scenes/random.hpp"

namespace {

using jostle_scenes::Random;

template <class S>
class MendedTrees : public testing::Test
{
  public:
    using Box = jostle::Aabb<3, S>;
    using Tree = jostle::fcl::MendedTree<S>;

    Box random_box()
    {
        const S most = std::numeric_limits<S>::max(), infinity = std::numeric_limits<S>::infinity();
        const S nan = std::numeric_limits<S>::quiet_NaN();
        switch (random.below(60)) {
        case 0:
            return {{most, most, most}, {-most, -most, -most}};
        case 1:
            return {{0, nan, 0}, {1, 1, 1}};
        case 2:
            return {{-infinity, -infinity, 3}, {infinity, infinity, 4}};
        case 3:
            return {{-most, 0, 0}, {most, 1, 1}};
        case 4:
            return {{infinity, 0, 0}, {infinity, 1, 1}};
        case 5:
            return {{S(1e9), S(1e9), S(1e9)}, {S(1e9), S(1e9), S(1e9)}};
        default:
            break;
        }
        Box box;
        const double size = random.below(10) == 0 ? 20 : 0.5;
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = S(random.uniform(0, 30));
            box.hi[d] = box.lo[d] + S(random.below(5) == 0 ? 0 : random.uniform(0, size));
        }
        return box;
    }
    static bool proper(const Box& box)
    {
        return box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2];
    }
    void expect_right()
    {
        ASSERT_EQ(tree.size(), boxes.size());
        for (int k = 0; k < 4; ++k) {
            Box question = random_box();
            while (!proper(question))
                question = random_box();
            std::vector<std::uint32_t> touching, expected;
            EXPECT_TRUE(tree.touching(question, [&](std::uint32_t place) {
                touching.push_back(place);
                return true;
            }));
            for (std::uint32_t place = 0; place < boxes.size(); ++place)
                if (proper(boxes[place]) && overlaps(question, boxes[place])) expected.push_back(place);
            std::sort(touching.begin(), touching.end());
            EXPECT_EQ(touching, expected);
            if (!expected.empty()) {
                int calls = 0;
                EXPECT_FALSE(tree.touching(question, [&](std::uint32_t) {
                    ++calls;
                    return false;
                }));
                EXPECT_EQ(calls, 1);
            }
            if (!std::isfinite(question.lo[0]) || !std::isfinite(question.hi[1])) continue;
            expect_near(question);
        }
        const auto [a, b] = tree.near_pair(boxes);
        if (a != Tree::none) {
            EXPECT_LT(a, b);
            EXPECT_LT(b, boxes.size());
        } else {
            EXPECT_FALSE(several_near());
        }
    }
    void expect_near(const Box& question)
    {
        const std::uint32_t remainder = random.below(3);
        const auto taken = [&](std::uint32_t place) { return place % 3 != remainder; };
        S least = std::numeric_limits<S>::infinity();
        for (std::uint32_t place = 0; place < boxes.size(); ++place)
            if (proper(boxes[place]) && taken(place))
                least = std::min(least, jostle::fcl::squared_gap(question, boxes[place]));
        const auto found = tree.nearest(question, [&](std::uint32_t place, S) { return taken(place); });
        EXPECT_EQ(found.squared, least);
        if (found.place != Tree::none) {
            ASSERT_LT(found.place, boxes.size());
            EXPECT_TRUE(taken(found.place));
            EXPECT_EQ(jostle::fcl::squared_gap(question, boxes[found.place]), least);
        }
        for (const S bound : {S(0), S(2), std::sqrt(least), std::numeric_limits<S>::max()}) {
            std::vector<std::uint32_t> near, expected;
            tree.nearer(question, bound, [&](std::uint32_t place, S squared) {
                near.push_back(place);
                EXPECT_EQ(squared, jostle::fcl::squared_gap(question, boxes[place]));
            });
            for (std::uint32_t place = 0; place < boxes.size(); ++place)
                if (proper(boxes[place]) &&
                    std::sqrt(jostle::fcl::squared_gap(question, boxes[place])) < bound)
                    expected.push_back(place);
            std::sort(near.begin(), near.end());
            EXPECT_EQ(near, expected);
        }
    }
    bool several_near()
    {
        for (std::size_t i = 0; i + 1 < boxes.size(); ++i)
            for (std::size_t j = i + 1; j < boxes.size(); ++j)
                if (!std::isinf(jostle::fcl::squared_gap(boxes[i], boxes[j]))) return true;
        return false;
    }

    Random random{7};
    Tree tree;
    std::vector<Box> boxes;
};

using Numbers = testing::Types<double, float>;
TYPED_TEST_SUITE(MendedTrees, Numbers);

TYPED_TEST(MendedTrees, AnswerAsLookingThroughAllBoxesWhateverHappens)
{
    for (int round = 0; round < 300; ++round) {
        const std::uint32_t kind = this->random.below(8);
        if (kind == 0) { // begun anew, sometimes with so many that there are four levels
            this->boxes.resize(this->random.below(round % 20 == 0 ? 6000 : 300));
            for (auto& box : this->boxes)
                box = this->random_box();
            if (this->random.below(2) == 0) this->tree.clear();
            this->tree.sort(this->boxes);
        } else if (kind == 1) {
            for (auto& box : this->boxes)
                box = this->random_box();
            this->tree.mend(this->boxes);
        } else if (kind == 2) { // more or fewer, and all different
            this->boxes.resize(this->random.below(400));
            for (auto& box : this->boxes)
                box = this->random_box();
            this->tree.mend(this->boxes);
        } else { // some, of which some are gone or new
            std::vector<std::uint32_t> changed;
            for (std::uint32_t n = this->random.below(20); n-- > 0;) {
                const std::size_t count = this->boxes.size();
                const std::uint32_t what = this->random.below(4);
                if (what == 0 && count > 0) {
                    this->boxes.pop_back();
                    changed.push_back(static_cast<std::uint32_t>(count - 1));
                } else if (what == 1) {
                    this->boxes.push_back(this->random_box());
                    changed.push_back(static_cast<std::uint32_t>(count));
                } else if (count > 0) {
                    changed.push_back(this->random.below(static_cast<std::uint32_t>(count)));
                    this->boxes[changed.back()] = this->random_box();
                }
            }
            this->tree.mend(this->boxes, changed);
        }
        this->expect_right();
        if (this->HasFailure()) FAIL() << "in round " << round;
    }
}

TYPED_TEST(MendedTrees, GrowAndShrinkOneByOne)
{
    for (std::uint32_t place = 0; place < 300; ++place) {
        this->boxes.push_back(this->random_box());
        this->tree.mend(this->boxes, {place});
        if (place % 16 < 2) this->expect_right();
    }
    while (!this->boxes.empty()) {
        this->boxes.pop_back();
        this->tree.mend(this->boxes, {static_cast<std::uint32_t>(this->boxes.size())});
        if (this->boxes.size() % 16 < 2) this->expect_right();
    }
}

TYPED_TEST(MendedTrees, AreWornByWhatMovesApartOrComesAndGoes)
{
    using S = TypeParam;
    const auto grid = [&](S scale) {
        for (std::size_t i = 0; i < this->boxes.size(); ++i) {
            const std::size_t at = scale == 1 ? i : i * 7919 % this->boxes.size();
            const S x = S(at % 16), y = S(at / 16 % 16), z = S(at / 256);
            this->boxes[i] = {{x, y, z}, {x + S(0.5), y + S(0.5), z + S(0.5)}};
        }
    };
    this->boxes.resize(4096);
    grid(1);
    this->tree.sort(this->boxes);
    EXPECT_EQ(this->tree.wear(), 1);
    for (auto& box : this->boxes) // all one way
        box.lo[0] += 5, box.hi[0] += 5;
    this->tree.mend(this->boxes);
    EXPECT_EQ(this->tree.wear(), 1);
    grid(2);
    this->tree.mend(this->boxes);
    EXPECT_GT(this->tree.wear(), 2);
    this->tree.sort(this->boxes);
    EXPECT_EQ(this->tree.wear(), 1);
    this->boxes.resize(2048);
    this->tree.mend(this->boxes);
    EXPECT_GT(this->tree.wear(), 4);
}

} // namespace
