// SPDX-License-Identifier: MIT
// Contacts and shapes without memory: whichever allocation fails, the call ends with std::bad_alloc, and
// what it was asked of answers the next call as if nothing had been.
#include <gtest/gtest.h>

#include <optional>

#include "starve.hpp"
#include "tests/global_new.hpp"
#include "tests/narrow/random_pairs.hpp"

namespace faults {

void fail_after(std::uint64_t allocations)
{
    global_new::fail_at = allocations == never ? global_new::never : global_new::calls + allocations;
}

bool can_fail()
{
    return JOSTLE_OWN_NEW != 0;
}

namespace {

using namespace jostle;

#if JOSTLE_OWN_NEW
template <class Call>
bool runs_out(const Call& call)
{
    try {
        call();
    } catch (const std::bad_alloc&) {
        return true;
    }
    return false;
}

template <int Dim, class T>
struct ZooObjects
{
    Random random{Dim};
    Zoo<Dim> zoo{random, 1};
    std::vector<Pose<Dim, T>> poses;
    std::vector<Motion<Dim, T>> motions;
    std::vector<Pair> pairs;

    ZooObjects()
    {
        for (std::uint32_t i = 0; i < zoo.shapes.size(); ++i) {
            poses.push_back(random_pose<Dim, T>(random, 2));
            motions.push_back({poses.back(), {}, {}});
            for (T& each : motions.back().linear)
                each = static_cast<T>(random.uniform(-1, 1));
            for (std::uint32_t k = 0; k < i; ++k)
                pairs.push_back({k, i});
        }
    }
};

/// All that a finder says, as bytes where there are some.
template <int Dim, class T>
struct Answers
{
    std::vector<Contact<Dim, T>> contacts;
    std::vector<std::uint8_t> touching;
    std::vector<Distance<Dim, T>> distances;
    std::vector<Impact<Dim, T>> impacts;

    explicit Answers(std::size_t pairs) : touching(pairs), distances(pairs), impacts(pairs) {}
    friend bool operator==(const Answers& a, const Answers& b)
    {
        bool same = a.contacts.size() == b.contacts.size() && a.touching == b.touching;
        for (std::size_t i = 0; same && i < a.contacts.size(); ++i)
            same = a.contacts[i].pair == b.contacts[i].pair && a.contacts[i].normal == b.contacts[i].normal &&
                   a.contacts[i].point[0].depth == b.contacts[i].point[0].depth;
        for (std::size_t i = 0; same && i < a.distances.size(); ++i)
            same =
                a.distances[i].distance == b.distances[i].distance && a.impacts[i].time == b.impacts[i].time;
        return same;
    }
};

template <int Dim, class T>
void starve_a_finder(Executor& executor)
{
    const ZooObjects<Dim, T> objects;
    const auto& [random, zoo, poses, motions, pairs] = objects;
    const auto ask = [&](ContactFinder<Dim, T>& finder, Answers<Dim, T>& out, int what) {
        if (what == 0) (void)finder.find({zoo.shapes, poses}, pairs, T(0.1));
        if (what == 1) finder.touching({zoo.shapes, poses}, pairs, out.touching);
        if (what == 2) finder.distances({zoo.shapes, poses}, pairs, T(3), out.distances);
        if (what == 3) finder.impacts({zoo.shapes, motions}, pairs, T(0.01), out.impacts);
    };
    const auto ask_all = [&](ContactFinder<Dim, T>& finder) {
        Answers<Dim, T> all(pairs.size());
        for (int what = 0; what < 4; ++what)
            ask(finder, all, what);
        all.contacts = finder.find({zoo.shapes, poses}, pairs, T(0.1)).to_vector();
        return all;
    };
    ContactFinder<Dim, T> sound({.executor = &executor});
    const Answers<Dim, T> expected = ask_all(sound);
    EXPECT_GT(expected.contacts.size(), 2u);
    for (int what = 0; what < 4; ++what) {
        std::optional<ContactFinder<Dim, T>> finder;
        Answers<Dim, T> out(pairs.size());
        const std::uint64_t failed = starve(
            [&] {
                finder.reset(); // else it would keep the memory that it had
                return runs_out([&] {
                    finder.emplace(ContactOptions{.executor = &executor});
                    ask(*finder, out, what);
                });
            },
            [&](std::uint64_t k) {
                if (finder) {
                    ASSERT_TRUE(ask_all(*finder) == expected) << "call " << what << ", allocation " << k;
                }
            });
        EXPECT_GT(failed, what == 0 ? 1u : 0u) << what;
        EXPECT_TRUE(ask_all(*finder) == expected) << what;
    }
}

TEST(Memory, AContactFinderThatRanOutOfItAnswersTheNextCall)
{
    const std::unique_ptr<Executor> threads = make_thread_executor(3);
    starve_a_finder<3, float>(serial_executor());
    starve_a_finder<2, double>(serial_executor());
    starve_a_finder<3, double>(*threads);
}

TEST(Memory, AShapeIsWholeOrNotThere)
{
    Random random(3);
    std::vector<Vec<3, double>> points(40);
    for (auto& point : points)
        for (double& each : point)
            each = random.uniform(-1, 1);
    std::vector<Mesh<3>::Element> elements;
    for (std::uint32_t i = 0; i + 2 < points.size(); ++i)
        elements.push_back({i, i + 1, i + 2});
    const std::vector<double> heights(20, 0.5);
    const auto nothing = [](std::uint64_t) {};
    std::optional<ConvexHull<3>> hull;
    EXPECT_GT(starve([&] { return runs_out([&] { hull.emplace(points); }); }, nothing), 2u);
    EXPECT_GT(hull->face_count(), 10u);
    std::optional<Mesh<3>> mesh;
    EXPECT_GT(starve([&] { return runs_out([&] { mesh.emplace(points, elements); }); }, nothing), 2u);
    std::optional<HeightField> field;
    EXPECT_GT(
        starve([&] { return runs_out([&] { field.emplace(HeightGrid<double>{heights, 5, 4, 1, 1}); }); },
               nothing),
        0u);
    const std::vector<Compound<3>::Child> children{{Shape3(*hull), {}}, {Shape3::box({1, 1, 1}), {}}};
    std::optional<Compound<3>> compound;
    EXPECT_GT(starve([&] { return runs_out([&] { compound.emplace(children); }); }, nothing), 0u);
    // What came of it is as good as any.
    const ConvexHull<3> again(points);
    const Pose3d here, there{{1.5, 0, 0}};
    EXPECT_EQ(distance(Shape3(*hull), here, Shape3(*compound), there, HUGE_VAL)->distance,
              distance(Shape3(again), here, Shape3(*compound), there, HUGE_VAL)->distance);
}
#endif

} // namespace
} // namespace faults
