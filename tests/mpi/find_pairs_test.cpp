// SPDX-License-Identifier: MIT
// Pairs of boxes that lie on all ranks, against brute force; and the regions in which they are searched.
#include "partition.hpp"
#include "scene.hpp"

namespace mpi_tests {
namespace {

using jostle::Aabb3f;
using jostle::mpi::Partition;
using jostle::mpi::Ranks;
using jostle::mpi::WeightedPoints;

/// Boxes of which rank k has those with owner(i) == k.
template <int Dim, class T, class Owner>
void find(const std::vector<jostle::Aabb<Dim, T>>& boxes, const Owner& owner)
{
    const auto id_of = [](std::size_t i) { return (std::uint64_t{i} << 33) + 7; };
    std::vector<jostle::Aabb<Dim, T>> mine;
    std::vector<std::uint64_t> ids;
    for (std::size_t i = boxes.size(); i-- > 0;)
        if (owner(i) == rank()) {
            mine.push_back(boxes[i]);
            ids.push_back(id_of(i));
        }
    const auto found =
        jostle::mpi::find_pairs(MPI_COMM_WORLD, mine, ids, {.executor = &jostle::serial_executor()});
    std::vector<std::pair<std::uint64_t, std::uint64_t>> pairs, expected;
    bool bounds = true;
    for (const auto& pair : found) {
        const auto a = static_cast<std::size_t>(pair.a >> 33), b = static_cast<std::size_t>(pair.b >> 33);
        pairs.emplace_back(pair.a, pair.b);
        bounds = bounds && same(pair.bounds_a, boxes[a]) && same(pair.bounds_b, boxes[b]) &&
                 pair.rank_of_b == owner(b);
    }
    for (const jostle::Pair pair : jostle::find_pairs_brute_force(jostle::box_view(boxes)))
        if (owner(pair.a) == rank()) expected.emplace_back(id_of(pair.a), id_of(pair.b));
    EXPECT_EQ(pairs, expected);
    EXPECT_TRUE(bounds);
}

template <int Dim, class T>
std::vector<jostle::Aabb<Dim, T>> random_boxes(std::size_t count, double extent)
{
    Random random(count);
    std::vector<jostle::Aabb<Dim, T>> boxes;
    while (boxes.size() < count)
        boxes.push_back(world_tests::random_box<Dim, T>(random, extent));
    return boxes;
}
const auto by_turns = [](std::size_t i) { return static_cast<int>(i % static_cast<unsigned>(ranks())); };

TEST(FindPairs, RandomBoxes)
{
    find(random_boxes<3, float>(600, 9), by_turns);
    find(random_boxes<3, double>(600, 9), by_turns);
    find(random_boxes<2, float>(600, 30), by_turns);
    find(random_boxes<2, double>(600, 30), by_turns);
}
TEST(FindPairs, AllOnOneRank)
{
    for (const int owner : {0, ranks() - 1})
        find(random_boxes<3, float>(300, 9), [&](std::size_t) { return owner; });
}
TEST(FindPairs, NoneOneAndTwo)
{
    for (const std::size_t count : {0, 1, 2})
        find(std::vector<Aabb3f>(count, Aabb3f{{0, 0, 0}, {1, 1, 1}}), by_turns);
}
TEST(FindPairs, AllInOnePlace)
{
    find(std::vector<Aabb3f>(80, Aabb3f{{3, 3, 3}, {3, 3, 3}}), by_turns);
    find(std::vector<jostle::Aabb2d>(80, jostle::Aabb2d{{3, 3}, {4, 4}}), by_turns);
}
TEST(FindPairs, InOnePlaneOrLine)
{
    auto boxes = random_boxes<3, float>(300, 20);
    for (Aabb3f& box : boxes)
        box.lo[2] = box.hi[2] = 5;
    find(boxes, by_turns);
    for (Aabb3f& box : boxes)
        box.lo[0] = box.hi[0] = -1;
    find(boxes, by_turns);
}
TEST(FindPairs, SizesFromOneToTenThousandAndWithoutEnd)
{
    constexpr float infinity = std::numeric_limits<float>::infinity();
    auto boxes = random_boxes<3, float>(400, 200);
    for (std::size_t i = 0; i < 6; ++i) {
        boxes[i * 17] = {{-5000, float(i), -5000}, {5000, float(i) + 100, 5000}};
        boxes[i * 13 + 1] = {{-infinity, float(40 * i), -infinity}, {infinity, float(40 * i) + 1, infinity}};
    }
    boxes[9] = {{-infinity, -infinity, -infinity}, {infinity, infinity, infinity}};
    boxes[11] = {{infinity, 0, 0}, {infinity, 1, 1}};
    find(boxes, by_turns);
}

TEST(FindPairs, BadInputIsTheSameErrorOnAllRanks)
{
    const int last = ranks() - 1;
    std::vector<Aabb3f> boxes(3, Aabb3f{{0, 0, 0}, {1, 1, 1}});
    std::vector<std::uint64_t> ids;
    for (unsigned i = 0; i < 3; ++i)
        ids.push_back(10u * static_cast<unsigned>(rank()) + i);
    const auto call = [&] {
        (void)jostle::mpi::find_pairs(MPI_COMM_WORLD, boxes, ids, {.executor = &jostle::serial_executor()});
    };
    EXPECT_EQ(failure_of(call), "");
    if (rank() == last) boxes[1].hi[2] = -1;
    const std::string at = std::to_string(last), id = std::to_string(10 * last + 1);
    EXPECT_EQ(failure_of(call), at + " 0 2 " + id + " rank " + at + ": object " + id +
                                    ": lo.z = 0 is greater than hi.z = -1; swap them");
    if (rank() == last) boxes[1].lo[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_NE(failure_of(call).find("object " + id + ": lo.y is NaN"), std::string::npos);
    if (rank() == last) boxes.pop_back();
    EXPECT_NE(failure_of(call).find("3 ids for 2 boxes"), std::string::npos);
    if (rank() == last) {
        boxes = {{{0, 0, 0}, {1, 1, 1}}, {{9, 0, 0}, {10, 1, 1}}, {{90, 0, 0}, {91, 1, 1}}};
        ids[2] = ids[0];
    }
    EXPECT_NE(failure_of(call).find("object " + std::to_string(10 * last) + " is added"), std::string::npos);
    if (rank() == last) ids[2] = 0; // rank 0's
    EXPECT_NE(failure_of(call).find("object 0 is added"), std::string::npos);
}

/// What pairs rely on: which regions a box touches, and whose a point is.
template <int Dim, class T>
void check_regions(bool in_one_place)
{
    Random random(static_cast<std::uint64_t>(Dim));
    WeightedPoints points(std::pmr::get_default_resource());
    for (int i = 0; i < 500; ++i) {
        for (int d = 0; d < Dim; ++d)
            points.points.push_back(in_one_place ? 1 : random.below(30));
        points.weights.push_back(static_cast<float>(random.uniform(0.1, 2)));
    }
    const Partition partition(MPI_COMM_WORLD, Dim, points);
    Ranks of_a, of_b, of_both, shared;
    std::vector<std::uint64_t> owned(static_cast<std::size_t>(ranks()));
    std::vector<unsigned char> bits; // of each box, for each rank
    bool good = true;
    for (int i = 0; i < 3000 && good; ++i) {
        const auto a = world_tests::random_box<Dim, T>(random, 30),
                   b = world_tests::random_box<Dim, T>(random, 30);
        partition.touched(a, of_a);
        partition.touched(b, of_b);
        const int owner = partition.at_middle_of(a);
        ++owned[static_cast<std::size_t>(owner)];
        good = !of_a.empty() && std::is_sorted(of_a.begin(), of_a.end()) && of_a.front() >= 0 &&
               of_a.back() < ranks() && std::binary_search(of_a.begin(), of_a.end(), owner);
        for (int each = 0; each < ranks(); ++each)
            bits.push_back(std::binary_search(of_a.begin(), of_a.end(), each));
        if (overlaps(a, b)) {
            auto both = a;
            for (int d = 0; d < Dim; ++d) {
                both.lo[d] = std::max(a.lo[d], b.lo[d]);
                both.hi[d] = std::min(a.hi[d], b.hi[d]);
            }
            partition.touched(both, of_both);
            shared.clear();
            std::set_intersection(of_a.begin(), of_a.end(), of_b.begin(), of_b.end(),
                                  std::back_inserter(shared));
            good = good && shared == of_both;
        }
    }
    ASSERT_TRUE(everywhere(good));
    // The same on all ranks, also where one of them sees at once that the box lies inside its region.
    std::vector<unsigned char> least = bits;
    MPI_Allreduce(MPI_IN_PLACE, least.data(), static_cast<int>(least.size()), MPI_UNSIGNED_CHAR, MPI_MIN,
                  MPI_COMM_WORLD);
    EXPECT_EQ(bits, least);
    if (!in_one_place) {
        for (const std::uint64_t count : owned)
            EXPECT_GT(count, 0u) << "a rank without a region";
    }
}
TEST(Partition, BoxesThatTouchShareARegion)
{
    check_regions<3, float>(false);
    check_regions<2, double>(false);
}
TEST(Partition, OfPointsInOnePlace)
{
    check_regions<3, double>(true);
    check_regions<2, float>(true);
}
TEST(Partition, OfNothing)
{
    const Partition undivided;
    Ranks found;
    undivided.touched(jostle::Aabb2d{{0, 0}, {1, 1}}, found);
    EXPECT_EQ(found, Ranks{0});
    EXPECT_EQ(undivided.at_middle_of(jostle::Aabb2d{{0, 0}, {1, 1}}), 0);
}

} // namespace
} // namespace mpi_tests
