// SPDX-License-Identifier: MIT
#include "bench/peers.hpp"

#include <ostream>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "jostle/find_pairs.hpp"
#include "tool/scenes/scenes.hpp"

namespace {

using namespace jostle_bench;

} // namespace

namespace jostle_bench {
// What a failing test prints.
void PrintTo(const PeerResult& result, std::ostream* out)
{
    *out << result.pairs << " pairs, checksum " << result.checksum;
}
} // namespace jostle_bench

namespace {

template <int Dim>
PeerResult definition(Boxes<Dim> boxes)
{
    const std::vector<jostle::Pair> pairs =
        jostle::find_pairs_brute_force(jostle::BoxView<Dim, float>(boxes));
    return {pairs.size(), jostle::pair_checksum(pairs)};
}

/// Every peer on a scene, over some frames; also started a second time, on what the frames left.
template <int Dim>
void check_peers(const std::string& scene_name, std::size_t n)
{
    SCOPED_TRACE(scene_name + ", " + std::to_string(Dim) + "D, n = " + std::to_string(n));
    constexpr int frame_count = 5;
    for (const std::unique_ptr<Peer<Dim>>& peer : make_peers<Dim>())
        for (const std::uint32_t threads : {1u, 2u}) {
            if (threads > 1 && !peer->info().uses_threads) continue;
            SCOPED_TRACE(std::string(peer->info().name) + ", threads: " + std::to_string(threads));
            ASSERT_LE(n, peer->info().max_objects);
            jostle_scenes::Scene<Dim, float> scene(scene_name, n);
            for (int start = 0; start < 2; ++start) {
                ChangedBoxes<Dim> changes(scene.boxes());
                peer->start(scene.boxes(), threads);
                for (int frame = 0; frame < frame_count; ++frame) {
                    if (frame != 0) scene.step(); // the first frame may be that of `start`
                    peer->frame(scene.boxes(), changes.since_last(scene.boxes()));
                    const PeerResult expected = definition<Dim>(scene.boxes());
                    if (peer->info().finds_pairs) {
                        EXPECT_EQ(peer->result(), expected) << "frame " << frame;
                    } else if (frame == 0) { // the floor writes as many pairs as there were at the start
                        EXPECT_EQ(peer->result().pairs, expected.pairs);
                    }
                }
                peer->stop();
            }
        }
}

/// Jostle itself, on the same scenes: the row that peers are compared with.
template <int Dim>
void check_ours(const std::string& scene_name, std::size_t n)
{
    const jostle_scenes::Scene<Dim, float> scene(scene_name, n);
    const jostle::PairBuffer pairs = jostle::find_pairs(jostle::BoxView<Dim, float>(scene.boxes()));
    EXPECT_EQ((PeerResult{pairs.size(), jostle::pair_checksum(pairs)}), definition<Dim>(scene.boxes()))
        << scene_name;
}

TEST(Peers, FindTheSamePairsAsTheDefinition3D)
{
    for (const jostle_scenes::SceneInfo& info : jostle_scenes::scene_list()) {
        check_ours<3>(std::string(info.name), 1000);
        check_peers<3>(std::string(info.name), 1000);
    }
}

TEST(Peers, FindTheSamePairsAsTheDefinition2D)
{
    for (const jostle_scenes::SceneInfo& info : jostle_scenes::scene_list()) {
        check_ours<2>(std::string(info.name), 1000);
        check_peers<2>(std::string(info.name), 1000);
    }
}

TEST(Peers, TakeOneObject)
{
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}}) {
        check_peers<3>("uniform", n);
        check_peers<2>("uniform", n);
    }
}

TEST(Peers, HaveTheNamesOfTheResults)
{
    std::set<std::string> names_3d, names_2d;
    for (const auto& peer : make_peers<3>())
        EXPECT_TRUE(names_3d.insert(peer->info().name).second) << peer->info().name;
    for (const auto& peer : make_peers<2>())
        EXPECT_TRUE(names_2d.insert(peer->info().name).second) << peer->info().name;
    EXPECT_EQ(names_3d, (std::set<std::string>{"boost", "bullet", "bullet-sap", "cgal", "embree", "fcl",
                                               "floor", "ode"}));
    EXPECT_EQ(names_2d, (std::set<std::string>{"boost", "box2d", "cgal", "embree", "floor"}));
}

TEST(ChangedBoxes, NamesWhatMovedSinceTheLastCall)
{
    std::vector<jostle::Aabb2f> boxes(5, {{0, 0}, {1, 1}});
    ChangedBoxes<2> changes(boxes);
    EXPECT_TRUE(changes.since_last(boxes).empty());
    boxes[1].hi[1] = 2;
    boxes[4].lo[0] = -1;
    const auto moved = changes.since_last(boxes);
    EXPECT_EQ(std::vector<std::uint32_t>(moved.begin(), moved.end()), (std::vector<std::uint32_t>{1, 4}));
    EXPECT_TRUE(changes.since_last(boxes).empty());
}

} // namespace
