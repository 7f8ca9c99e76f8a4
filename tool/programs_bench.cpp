// SPDX-License-Identifier: MIT
// jostle bench programs: what three whole programs take, part by part: the game server, the grains and the
// planner that examples/ has, and what their users would write instead.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "bench/distance_peers.hpp"
#include "bench/program_peers.hpp"
#include "bench_bodies.hpp"
#include "bench_run.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "jostle/box_index.hpp"
#include "jostle/contact.hpp"
#include "jostle/periodic.hpp"
#include "jostle/responses.hpp"
#include "jostle/world.hpp"
#include "numbers.hpp"
#include "threads.hpp"
#include "tool/scenes/random.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;
using jostle::Pair;
using jostle::Vec3f;

/// One part of a program, as one system does it.
struct Part
{
    const char* name;
    std::vector<double> ms;
    double answer = 0; ///< systems agree on it
    double tolerance = 0;
    bool ours_alone = false; ///< peers have no such part: it isn't in the total
    bool left_out = false;   ///< this peer has no such part: it isn't in its total, nor ours beside it
};
using Parts = std::vector<Part>;

template <class Work>
void timed(Part& part, const Work& work)
{
    const Clock::time_point before = Clock::now();
    work();
    part.ms.push_back(ms_since(before));
}

class Numbers
{
  public:
    explicit Numbers(std::uint64_t seed) : random_(seed) {}
    float uniform(float lo, float hi)
    {
        return lo + (hi - lo) * static_cast<float>(random_.next() >> 40) * 0x1p-24f;
    }
    std::uint32_t below(std::size_t n) { return static_cast<std::uint32_t>(random_.next() % n); }
    Vec3f heading(float speed)
    {
        const float angle = uniform(0, 6.2831853f);
        return {speed * std::cos(angle), speed * std::sin(angle), 0};
    }

  private:
    jostle_scenes::Random random_;
};

/// Sums of what was found, whatever its order; small enough to be exact as a double.
class Sum
{
  public:
    void add(std::uint64_t a, std::uint64_t b)
    {
        const Pair pair{static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)};
        sum_ += jostle::pair_checksum(std::span(&pair, 1));
    }
    [[nodiscard]] double value() const { return static_cast<double>(sum_ >> 12); }

  private:
    std::uint64_t sum_ = 0;
};

// --- The server ---

constexpr std::uint32_t player = 1, zone = 2, prop = 4;

/// What happens, the same for each system: one in twenty players moves in a tick, others each time.
struct Match
{
    Match(double size, std::uint64_t seed) : random(seed)
    {
        const auto players = static_cast<std::size_t>(20'000 * size) + 40;
        side = 20 * std::sqrt(static_cast<float>(players));
        const auto place = [&] {
            return Vec3f{random.uniform(0, side), random.uniform(0, side), random.uniform(0, 10)};
        };
        const auto scattered = [&](std::size_t number, const Vec3f& half) {
            std::vector<Aabb3f> all;
            while (all.size() < number) {
                const Vec3f at = place();
                all.push_back({at - half, at + half});
            }
            return all;
        };
        for (std::size_t i = 0; i < players; ++i) {
            places.push_back(place());
            speeds.push_back(random.heading(1));
            bodies.push_back(around(places[i]));
        }
        zones = scattered(static_cast<std::size_t>(300 * size) + 3, {15, 15, 15});
        props = scattered(10 * players, {0.5f, 0.5f, 1});
        rays.resize(players / 40);
        shooters.resize(rays.size());
    }
    static Aabb3f around(const Vec3f& at)
    {
        const Vec3f half{0.4f, 0.4f, 0.9f};
        return {at - half, at + half};
    }
    void tick()
    {
        moved.clear();
        boxes.clear();
        for (std::uint32_t i = random.below(20); i < places.size(); i += 20) {
            for (int d = 0; d < 2; ++d)
                if (places[i][d] < 0 || places[i][d] > side) speeds[i][d] *= -1;
            places[i] += speeds[i];
            moved.push_back(i);
            boxes.push_back(around(places[i]));
        }
        views.clear();
        for (const Vec3f& at : places)
            views.push_back({at, 50});
        for (std::size_t i = 0; i < rays.size(); ++i) {
            shooters[i] = random.below(places.size());
            rays[i] = {places[shooters[i]], random.heading(300), 1};
        }
    }
    Numbers random;
    float side = 0;
    std::vector<Vec3f> places, speeds;
    std::vector<Aabb3f> bodies, zones, props, boxes;
    std::vector<std::uint32_t> moved, shooters;
    std::vector<jostle::Sphere3f> views;
    std::vector<jostle::Ray3f> rays;
};

Parts run_server(const BenchOptions& options, jostle::Executor& executor)
{
    Match match(options.scale, options.seed);
    jostle::World3f world({.executor = &executor, .layers = {{.mask = player}}});
    std::vector<jostle::ObjectId> ids(match.bodies.size()), zone_ids(match.zones.size()),
        prop_ids(match.props.size());
    world.add(match.bodies, ids, {.filter = {.category = player}});
    world.add(match.zones, zone_ids, {.filter = {.category = zone, .mask = player, .is_static = true}});
    world.add(match.props, prop_ids, {.filter = {.category = prop, .mask = player, .is_static = true}});
    world.update();
    Parts parts{{"move", {}}, {"sight", {}}, {"shots", {}}, {"save", {}}, {"restore", {}}};
    parts[3].ours_alone = parts[4].ours_alone = true;
    Sum moves, sights, shots;
    std::vector<jostle::ObjectId> moved;
    jostle::ResultLists<jostle::ObjectId> seen;
    std::vector<jostle::Hit<float, jostle::ObjectId>> hits(match.rays.size());
    for (std::uint32_t k = 0; k < options.frames; ++k) {
        match.tick();
        moved.clear();
        for (const std::uint32_t i : match.moved)
            moved.push_back(ids[i]);
        timed(parts[0], [&] { world.update(moved, match.boxes); });
        for (const jostle::ObjectPair& pair : world.began())
            moves.add(pair.a.index, pair.b.index);
        for (const jostle::EndedPair& pair : world.ended())
            moves.add(pair.b.index, pair.a.index);
        timed(parts[1],
              [&] { world.all(std::span<const jostle::Sphere3f>(match.views), seen, {.mask = player}); });
        for (std::size_t i = 0; i < seen.size(); ++i)
            for (const jostle::ObjectId id : seen[i])
                sights.add(i, id.index);
        const auto can_hit = [&](std::uint32_t shot, jostle::ObjectId id) {
            return id.index >= ids.size() || id.index % 2 != match.shooters[shot] % 2;
        };
        timed(parts[2], [&] {
            world.first(std::span<const jostle::Ray3f>(match.rays), std::span(hits),
                        {.mask = player | prop, .accept = can_hit});
        });
        for (std::size_t i = 0; i < hits.size(); ++i)
            shots.add(i, hits[i].id.index);
        std::vector<std::byte> saved;
        timed(parts[3], [&] { saved = world.save(); });
        timed(parts[4], [&] { world.restore(saved); });
    }
    parts[0].answer = moves.value();
    parts[1].answer = sights.value();
    parts[2].answer = shots.value();
    return parts;
}

#ifdef JOSTLE_WITH_PEERS
Parts run_server_peer(const BenchOptions& options, jostle_bench::ServerPeer& peer)
{
    Match match(options.scale, options.seed);
    peer.start(match.bodies, match.zones, match.props);
    Parts parts{{"move", {}}, {"sight", {}}, {"shots", {}}};
    parts[2].left_out = !peer.has_shots();
    Sum moves, sights, shots;
    std::vector<Pair> began, ended;
    std::vector<std::size_t> first;
    std::vector<std::uint32_t> seen;
    std::vector<jostle::Hit<float>> hits(match.rays.size());
    for (std::uint32_t k = 0; k < options.frames; ++k) {
        match.tick();
        timed(parts[0], [&] { peer.move(match.moved, match.boxes, began, ended); });
        for (const Pair pair : began)
            moves.add(pair.a, pair.b);
        for (const Pair pair : ended)
            moves.add(pair.b, pair.a);
        timed(parts[1], [&] { peer.sight(match.views, first, seen); });
        for (std::size_t i = 0; i + 1 < first.size(); ++i)
            for (std::size_t j = first[i]; j < first[i + 1]; ++j)
                sights.add(i, seen[j]);
        if (parts[2].left_out) continue;
        timed(parts[2], [&] { peer.shots(match.rays, match.shooters, hits); });
        for (std::size_t i = 0; i < hits.size(); ++i)
            shots.add(i, hits[i].id);
    }
    parts[0].answer = moves.value();
    parts[1].answer = sights.value();
    parts[2].answer = shots.value();
    return parts;
}
#endif

// --- The grains ---

constexpr float skin = 0.3f;

/// Balls of sizes 1 to 20, larger by a tenth than the places that were found for them: many touch.
struct Grains
{
    Grains(double size, std::uint64_t seed)
    {
        Numbers random(seed);
        const auto count = static_cast<std::size_t>(50'000 * size) + 100;
        float volume = 0;
        for (std::size_t i = 0; i < count; ++i) {
            radii.push_back(1 / std::sqrt(1 - random.uniform(0, 1) * (1 - 1.0f / 400)));
            volume += 4.19f * radii[i] * radii[i] * radii[i];
        }
        std::sort(radii.rbegin(), radii.rend());
        period = std::max(160.0f, std::cbrt(4 * volume));
        jostle::BoxIndex3f placed;
        for (std::uint32_t i = 0; i < count; ++i) {
            const float r = radii[i], room = period - 2 * r;
            float top = room;
            Aabb3f box;
            do {
                const Vec3f at{r + random.uniform(0, room), r + random.uniform(0, room),
                               r + random.uniform(0, top *= 1.001f)};
                box = {at - Vec3f{r, r, r}, at + Vec3f{r, r, r}};
            } while (placed.any(box));
            placed.insert(i, box);
            centers.push_back((box.lo + box.hi) * 0.5f);
            velocities.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
        }
        for (float& r : radii)
            r *= 1.1f;
        for (std::size_t i = 0; i < count; ++i) {
            shapes.push_back(jostle::Shape3::sphere(double{radii[i]}));
            poses.push_back({centers[i]});
        }
    }
    std::vector<float> radii;
    std::vector<Vec3f> centers, velocities;
    std::vector<jostle::Shape3> shapes;
    std::vector<jostle::Pose3f> poses;
    float period = 0;
};

/// The force of a spring and a dashpot on ball a, and friction; zero where the two don't touch.
Vec3f push(const Grains& grains, const Pair& pair, const Vec3f& shift)
{
    const Vec3f way = grains.centers[pair.b] + shift - grains.centers[pair.a];
    const float reach = grains.radii[pair.a] + grains.radii[pair.b], squared = jostle::dot(way, way);
    if (squared >= reach * reach || squared == 0) return {};
    const float distance = std::sqrt(squared);
    const Vec3f normal = way * (1 / distance);
    const Vec3f slip = grains.velocities[pair.b] - grains.velocities[pair.a];
    const float approach = -jostle::dot(slip, normal);
    const float pressure = std::max(0.0f, 1e5f * (reach - distance) + 100 * approach);
    const Vec3f along = slip + normal * approach;
    return along * std::min(100.0f, 0.5f * pressure / (jostle::length(along) + 1e-9f)) - normal * pressure;
}

struct AddVectors
{
    void operator()(Vec3f& into, const Vec3f& value) const { into += value; }
};

void sum_up(const Grains& grains, const std::vector<Pair>& pairs, const std::vector<Vec3f>& shifts,
            std::span<const Vec3f> forces, Parts& parts)
{
    Sum touching;
    for (std::size_t i = 0; i < pairs.size(); ++i)
        if (push(grains, pairs[i], shifts[i]) != Vec3f{})
            touching.add(std::min(pairs[i].a, pairs[i].b), std::max(pairs[i].a, pairs[i].b));
    parts[0].answer = touching.value();
    for (const Vec3f& force : forces)
        parts[1].answer += double{jostle::length(force)};
    parts[1].tolerance = 1e-4; // sums in other orders
}

Parts run_grains(const BenchOptions& options, jostle::Executor& executor)
{
    const Grains grains(options.scale, options.seed);
    const std::size_t count = grains.centers.size();
    Parts parts{{"search", {}}, {"forces", {}}};
    jostle::PeriodicImages3f images({.executor = &executor});
    jostle::PairFinder finder({.executor = &executor});
    jostle::Responses<Vec3f, AddVectors> sums({.executor = &executor});
    std::vector<Aabb3f> boxes(count);
    std::vector<Pair> pairs;
    std::vector<Vec3f> shifts;
    std::span<const Vec3f> forces;
    const jostle::ProcessOptions process{.executor = &executor};
    for (std::uint32_t k = 0; k < options.frames; ++k) {
        timed(parts[0], [&] {
            jostle::bounds({grains.shapes, grains.poses}, boxes, skin / 2, executor);
            images.build(boxes, {grains.period, grains.period, 0});
            pairs.clear();
            shifts.clear();
            const auto origin = images.origin();
            const auto shift = images.shift();
            for (const std::span<const Pair> block : finder.find(images.boxes(), images.filter()).blocks())
                for (const auto [a, image] : block) {
                    const std::uint32_t b = origin[image];
                    const Vec3f way = grains.centers[b] + shift[image] - grains.centers[a];
                    const float near = grains.radii[a] + grains.radii[b] + skin;
                    if (jostle::dot(way, way) > near * near) continue; // only their boxes are
                    pairs.push_back({a, b});
                    shifts.push_back(shift[image]);
                }
        });
        timed(parts[1], [&] {
            sums.start(static_cast<std::uint32_t>(count), jostle::plan_work(pairs.size(), process));
            jostle::process_items(
                pairs.size(),
                [&](std::uint64_t begin, std::uint64_t end, jostle::Work work) {
                    for (std::uint64_t i = begin; i < end; ++i) {
                        const Vec3f force = push(grains, pairs[i], shifts[i]);
                        if (force == Vec3f{}) continue;
                        sums.add(work, pairs[i].a, force);
                        sums.add(work, pairs[i].b, -force);
                    }
                },
                process);
            forces = sums.merge();
        });
    }
    sum_up(grains, pairs, shifts, forces, parts);
    return parts;
}

#ifdef JOSTLE_WITH_PEERS
Parts run_grains_peer(const BenchOptions& options, jostle_bench::NeighboursPeer& peer)
{
    const Grains grains(options.scale, options.seed);
    Parts parts{{"search", {}}, {"forces", {}}};
    std::vector<Pair> pairs;
    std::vector<Vec3f> shifts, forces;
    for (std::uint32_t k = 0; k < options.frames; ++k) {
        timed(parts[0], [&] { peer.find(grains.centers, grains.radii, grains.period, skin, pairs, shifts); });
        timed(parts[1], [&] {
            forces.assign(grains.centers.size(), {});
            for (std::size_t i = 0; i < pairs.size(); ++i) {
                const Vec3f force = push(grains, pairs[i], shifts[i]);
                if (force == Vec3f{}) continue;
                forces[pairs[i].a] += force;
                forces[pairs[i].b] -= force;
            }
        });
    }
    sum_up(grains, pairs, shifts, forces, parts);
    return parts;
}
#endif

// --- The planner ---

using jostle::Pose3d;
using jostle::Vec3d;

constexpr std::uint32_t links = 6;
constexpr double half_length = 0.22, thickness = 0.06, farthest = 0.3;

/// A closed surface, 4 rings^2 triangles: a ball with waves, stretched.
struct Surface
{
    Surface(std::uint32_t rings, const Vec3d& size, double waves)
    {
        constexpr double pi = 3.14159265358979;
        const auto place = [&](std::uint32_t i, std::uint32_t j) -> Vec3d {
            const double t = pi * i / rings, p = pi * j / rings;
            const double r = 1 + waves * std::sin(5 * t) * std::cos(7 * p);
            return {size[0] * r * std::sin(t) * std::cos(p), size[1] * r * std::cos(t),
                    size[2] * r * std::sin(t) * std::sin(p)};
        };
        close_surface(rings, place, points, triangles);
    }
    std::vector<Vec3d> points;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

Vec3d turned(const std::array<double, 4>& q, const Vec3d& v)
{
    const Vec3d axis{q[0], q[1], q[2]}, across = jostle::cross(axis, v) * 2.0;
    return v + across * q[3] + jostle::cross(axis, across);
}

struct Arm
{
    Arm(double size, std::uint64_t seed)
        : rings(std::max(12u, static_cast<std::uint32_t>(112 * std::sqrt(std::min(1.0, size))))),
          rock(rings, {0.7, 1, 0.6}, 0.1),
          link(std::min(rings, 22u), {thickness, half_length + thickness, thickness}, 0.02)
    {
        Numbers random(seed);
        count = static_cast<std::uint32_t>(10'000 * size) + 50;
        for (std::uint32_t i = 0; i < count; ++i) {
            Vec3d base{0, 0, 0};
            std::array<double, 4> q{0, 0, 0, 1};
            for (std::uint32_t k = 0; k < links; ++k) {
                const double angle = double{random.uniform(-3, 3)} / 2;
                const double s = std::sin(angle), c = std::cos(angle);
                const auto [x, y, z, w] = q;
                q = k % 2 == 1 ? std::array{x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s}
                               : std::array{x * c - z * s, y * c + w * s, z * c + x * s, w * c - y * s};
                const Vec3d along = turned(q, {0, half_length, 0});
                poses.push_back({base + along, q});
                base += along * 2.0;
            }
            for (std::uint32_t a = 0; a < links; ++a)
                for (std::uint32_t b = a + 2; b < links; ++b)
                    forbidden.push_back({i * links + a, i * links + b});
        }
    }
    std::uint32_t rings, count = 0;
    Surface rock, link;
    std::vector<Pose3d> poses;
    std::vector<Pair> forbidden; ///< that links of one arm may not touch: all but neighbours
    Pose3d rock_pose{{1.4, 0.8, 0}, {0, 0, 0, 1}};
};

constexpr const char* arm_parts[2][4] = {
    {"capsules: rock", "capsules: self", "capsules: first", "capsules: distances"},
    {"meshes: rock", "meshes: self", "meshes: first", "meshes: distances"}};

Parts run_planner(const BenchOptions& options, jostle::Executor& executor)
{
    const Arm arm(options.scale, options.seed);
    const jostle::Mesh<3> rock(arm.rock.points, arm.rock.triangles),
        link(arm.link.points, arm.link.triangles);
    const std::vector<jostle::Shape3> rocks{rock};
    const std::vector<Pose3d> rock_poses{arm.rock_pose};
    const std::vector<jostle::Aabb3d> rock_boxes{jostle::bounds(rocks[0], rock_poses[0])};
    jostle::PairFinder pair_finder({.executor = &executor});
    jostle::ContactFinder3d finder({.executor = &executor});
    Parts all;
    for (const std::size_t kind : {std::size_t{0}, std::size_t{1}}) {
        Parts parts;
        for (const char* name : arm_parts[kind])
            parts.push_back({name, {}});
        const std::vector<jostle::Shape3> shapes(arm.poses.size(),
                                                 kind == 0 ? jostle::Shape3::capsule(half_length, thickness)
                                                           : jostle::Shape3(link));
        // Boxes come from a capsule around each link: those of meshes themselves take a look at every point.
        const std::vector<jostle::Shape3> around(
            arm.poses.size(), jostle::Shape3::capsule(half_length, (kind == 0 ? 1 : 1.1) * thickness));
        std::vector<jostle::Aabb3d> boxes(arm.poses.size());
        std::vector<Pair> near;
        std::vector<std::uint8_t> hit, bent(arm.forbidden.size());
        std::vector<std::uint32_t> first(arm.count);
        std::vector<jostle::Distance<3, double>> gaps(arm.count);
        std::vector<std::uint64_t> nearest(arm.count), offsets;
        std::vector<double> room(arm.count);
        for (std::uint32_t k = 0; k < options.frames; ++k) {
            timed(parts[0], [&] { // what of the arm touches the rock
                jostle::bounds({around, arm.poses}, boxes, 0, executor);
                near = pair_finder.find(boxes, rock_boxes, {}, jostle::Order::sorted).to_vector();
                hit.resize(near.size());
                finder.touching({shapes, arm.poses}, {rocks, rock_poses}, near, hit);
            });
            timed(parts[1],
                  [&] { finder.touching({shapes, arm.poses}, std::span<const Pair>(arm.forbidden), bent); });
            timed(parts[2], [&] { // the first link of each configuration that does
                first.assign(arm.count, links);
                for (std::size_t i = near.size(); i-- > 0;)
                    if (hit[i] != 0) first[near[i].a / links] = near[i].a % links;
            });
            timed(parts[3], [&] { // how much room those have that don't
                jostle::bounds({around, arm.poses}, boxes, farthest, executor);
                std::vector<Pair> close =
                    pair_finder.find(boxes, rock_boxes, {}, jostle::Order::sorted).to_vector();
                std::erase_if(close, [&](const Pair& pair) { return first[pair.a / links] != links; });
                offsets.assign(arm.count + 1, 0);
                for (const Pair& pair : close)
                    ++offsets[pair.a / links + 1];
                std::partial_sum(offsets.begin(), offsets.end(), offsets.begin());
                finder.least_distances({shapes, arm.poses}, {rocks, rock_poses}, close, offsets, farthest,
                                       gaps, nearest);
                for (std::size_t i = 0; i < arm.count; ++i)
                    room[i] = std::min(farthest, gaps[i].distance);
            });
        }
        parts[0].answer = static_cast<double>(std::count(hit.begin(), hit.end(), 1));
        parts[1].answer = static_cast<double>(std::count(bent.begin(), bent.end(), 1));
        for (const std::uint32_t number : first)
            parts[2].answer += number;
        for (const double gap : room)
            parts[3].answer += gap;
        all.insert(all.end(), parts.begin(), parts.end());
    }
    return all;
}

#ifdef JOSTLE_WITH_PEERS
/// Asked pair after pair: every link is tried against the rock, whose own tree tells that it is far.
Parts run_planner_peer(const BenchOptions& options,
                       const std::function<std::unique_ptr<jostle_bench::DistancePeer>()>& make)
{
    using jostle_bench::BodyKind;
    using jostle_bench::BodyShape;
    const Arm arm(options.scale, options.seed);
    Parts all;
    for (const std::size_t kind : {std::size_t{0}, std::size_t{1}}) {
        Parts parts;
        for (const char* name : arm_parts[kind])
            parts.push_back({name, {}});
        const BodyShape link{kind == 0 ? BodyKind::capsule : BodyKind::mesh,
                             thickness,
                             half_length,
                             {},
                             kind == 0 ? std::span<const Vec3d>{} : arm.link.points,
                             kind == 0 ? std::span<const std::array<std::uint32_t, 3>>{}
                                       : arm.link.triangles};
        std::vector<BodyShape> bodies(arm.poses.size(), link);
        std::vector<Pose3d> poses = arm.poses;
        const auto self = make();
        self->start(bodies, arm.forbidden, poses);
        bodies.push_back({BodyKind::mesh, 0, 0, {}, arm.rock.points, arm.rock.triangles});
        poses.push_back(arm.rock_pose);
        std::vector<Pair> with_rock;
        for (std::uint32_t i = 0; i < arm.poses.size(); ++i)
            with_rock.push_back({i, static_cast<std::uint32_t>(arm.poses.size())});
        const auto rock = make();
        const auto [link_kind, rock_kind] = std::pair(bodies.front().kind, bodies.back().kind);
        for (Part& part : parts)
            part.left_out = !rock->has_touching(link_kind, rock_kind);
        if (parts[0].left_out) {
            all.insert(all.end(), parts.begin(), parts.end());
            continue;
        }
        rock->start(bodies, with_rock, poses);
        // How far an arm's links can be from the rock's box for a distance to be asked.
        std::vector<Aabb3f> link_boxes;
        const Aabb3f rock_box{{0.5f, -0.4f, -0.8f}, {2.3f, 2.0f, 0.8f}};
        for (const Pose3d& pose : arm.poses) {
            const Vec3d along = turned(pose.rotation, {0, half_length, 0});
            Aabb3f box;
            for (int d = 0; d < 3; ++d) {
                const double reach = std::abs(along[d]) + 1.1 * thickness + farthest;
                box.lo[d] = static_cast<float>(pose.position[d] - reach);
                box.hi[d] = static_cast<float>(pose.position[d] + reach);
            }
            link_boxes.push_back(box);
        }
        std::vector<std::uint8_t> hit(arm.poses.size()), bent(arm.forbidden.size());
        std::vector<std::uint32_t> first(arm.count);
        std::vector<double> room;
        timed(parts[0], [&] {
            for (std::size_t i = 0; i < hit.size(); ++i)
                hit[i] = rock->touching(i) ? 1 : 0;
        });
        timed(parts[1], [&] {
            for (std::size_t i = 0; i < bent.size(); ++i)
                bent[i] = self->touching(i) ? 1 : 0;
        });
        timed(parts[2], [&] {
            first.assign(arm.count, links);
            for (std::size_t i = hit.size(); i-- > 0;)
                if (hit[i] != 0) first[i / links] = static_cast<std::uint32_t>(i % links);
        });
        parts[3].left_out = !rock->has_distance(link_kind, rock_kind, farthest);
        if (!parts[3].left_out)
            timed(parts[3], [&] {
                room.assign(arm.count, farthest);
                for (std::size_t i = 0; i < hit.size(); ++i) {
                    double& least = room[i / links];
                    if (first[i / links] == links && jostle::overlaps(link_boxes[i], rock_box))
                        least = std::min(least, rock->distance(i, least));
                }
            });
        parts[0].answer = static_cast<double>(std::count(hit.begin(), hit.end(), 1));
        parts[1].answer = static_cast<double>(std::count(bent.begin(), bent.end(), 1));
        for (const std::uint32_t number : first)
            parts[2].answer += number;
        for (const double gap : room)
            parts[3].answer += gap;
        for (Part& part : parts)
            part.tolerance = 1e-4; // how exact the solvers are; Bullet has floats
        all.insert(all.end(), parts.begin(), parts.end());
    }
    return all;
}
#endif

// --- What other programs have asked of boxes ---

/// The answers are numbers of pairs; `join`, `all` and `find` have the same.
Parts run_boxes(const BenchOptions& options, jostle::Executor& executor)
{
    Numbers random(options.seed);
    const auto cubes = [&](double count, float edge, float world) {
        std::vector<Aabb3f> boxes(static_cast<std::size_t>(count * options.scale) + 1);
        for (Aabb3f& box : boxes)
            for (int d = 0; d < 3; ++d) {
                box.lo[d] = random.uniform(0, world);
                box.hi[d] = box.lo[d] + edge;
            }
        return boxes;
    };
    const std::vector<Aabb3f> crowd = cubes(80'000, 0.4f, 2), one = {{{1, 1, 1}, {1.4f, 1.4f, 1.4f}}};
    const float world = 60 * std::cbrt(static_cast<float>(options.scale));
    const std::vector<Aabb3f> objects = cubes(220'000, 0.5f, world), queries = cubes(20'000, 4.7f, world);
    std::vector<Aabb3f> boxes = objects;
    std::vector<std::uint32_t> ids;
    for (std::uint32_t i = 0; i < boxes.size(); ++i)
        ids.push_back(i);
    Parts parts{{"find crowd, one", {}}, {"join one, crowd", {}},  {"build", {}},
                {"move all", {}},        {"move a hundredth", {}}, {"join 141 each", {}},
                {"all 141 each", {}},    {"find 141 each", {}}};
    jostle::PairFinder finder({.executor = &executor});
    jostle::BoxIndex3f crowded({.executor = &executor}), index({.executor = &executor});
    crowded.build(crowd);
    std::pmr::vector<Pair> joined;
    jostle::ResultLists<std::uint32_t> lists;
    for (std::uint32_t k = 0; k < options.frames; ++k) {
        timed(parts[0], [&] { parts[0].answer = static_cast<double>(finder.find(crowd, one).size()); });
        timed(parts[1], [&] { crowded.join(one, joined); });
        parts[1].answer = static_cast<double>(joined.size());
        timed(parts[2], [&] { index.build(objects); });
        for (Aabb3f& box : boxes)
            for (int d = 0; d < 3; ++d) {
                const float step = random.uniform(-0.1f, 0.1f);
                box.lo[d] += step;
                box.hi[d] += step;
            }
        timed(parts[3], [&] { index.move(ids, boxes); });
        const std::size_t few = boxes.size() / 100 + 1;
        timed(parts[4],
              [&] { index.move(std::span(ids).first(few), std::span<const Aabb3f>(objects).first(few)); });
        index.build(objects);
        timed(parts[5], [&] { index.join(queries, joined); });
        parts[5].answer = static_cast<double>(joined.size());
        timed(parts[6], [&] { index.all(std::span<const Aabb3f>(queries), lists); });
        parts[6].answer = static_cast<double>(lists.items().size());
        timed(parts[7], [&] { parts[7].answer = static_cast<double>(finder.find(queries, objects).size()); });
        boxes = objects;
    }
    if (parts[0].answer != parts[1].answer || parts[5].answer != parts[6].answer ||
        parts[5].answer != parts[7].answer)
        throw std::runtime_error("find, join and all differ");
    return parts;
}

// --- All of them ---

struct Program
{
    const char* name;
    const char* summary;
    Parts (*run)(const BenchOptions&, jostle::Executor&);
};
constexpr Program programs[] = {
    {"server", "20,000 players among 300 zones and 200,000 props", run_server},
    {"grains", "50,000 balls of sizes 1 to 20, periodic along two axes", run_grains},
    {"planner", "an arm in 10,000 places and a rock of 50,176 triangles", run_planner},
    {"boxes", "80,000 in one crowd, 220,000 that move, 141 results each", run_boxes},
};

#ifdef JOSTLE_WITH_PEERS
using NamedParts = std::pair<std::string, Parts>;
std::vector<NamedParts> run_peers(const BenchOptions& options, const std::string& program)
{
    std::vector<NamedParts> all;
    if (program == "server")
        for (const auto& make : {jostle_bench::make_bullet_server, jostle_bench::make_fcl_server}) {
            const auto peer = make();
            all.emplace_back(peer->name(), run_server_peer(options, *peer));
        }
    if (program == "grains")
        for (const auto& make : {jostle_bench::make_linked_cells, jostle_bench::make_bullet_grains,
                                 jostle_bench::make_fcl_grains}) {
            const auto peer = make();
            all.emplace_back(peer->name(), run_grains_peer(options, *peer));
        }
    if (program == "planner")
        for (const auto& make : {jostle_bench::make_bullet_distances, jostle_bench::make_fcl_distances})
            all.emplace_back(make()->name(), run_planner_peer(options, make));
    return all;
}
#endif

class Table : public BenchTable
{
  public:
    explicit Table(const BenchOptions& options) : BenchTable(options)
    {
        if (shown())
            std::printf("%-8s %8s  %-20s %-8s %12s %12s\n", "program", "threads", "part", "system",
                        "ms, median", "min");
    }
    /// `ours` is what it is compared with.
    void add_parts(const char* program, std::uint32_t threads, const std::string& system, const Parts& parts,
                   const Parts* ours = nullptr)
    {
        double total = 0, total_ours = 0;
        for (std::size_t i = 0; i < parts.size(); ++i) {
            const Part& part = parts[i];
            if (part.left_out) {
                if (shown())
                    std::printf("%-8s %8u  %-20s %-8s %12s %12s\n", program, threads, part.name,
                                system.c_str(), "-", "-");
                continue;
            }
            bool same = true;
            std::optional<double> times;
            if (ours != nullptr) {
                const Part& mine = (*ours)[i];
                const double allowed = part.tolerance * std::max(std::abs(mine.answer), 1e-9);
                same = std::abs(part.answer - mine.answer) <= allowed;
                if (!same)
                    differ(system + " and jostle differ: " + program + ", " + part.name + ", " +
                           std::to_string(part.answer) + " and " + std::to_string(mine.answer));
                times = median(part.ms) / median(mine.ms);
                total_ours += median(mine.ms);
            }
            if (!part.ours_alone) total += median(part.ms);
            print(program, threads, part.name, system, median(part.ms),
                  *std::min_element(part.ms.begin(), part.ms.end()), times, same, part.answer);
        }
        print(program, threads, "total", system, total, total,
              ours == nullptr ? std::nullopt : std::optional(total / total_ours), true, {});
    }

  private:
    void print(const char* program, std::uint32_t threads, const char* part, const std::string& system,
               double ms, double least, const std::optional<double>& times, bool same,
               const std::optional<double>& answer)
    {
        JsonRow row{{"system", system},   {"program", program},       {"part", part},
                    {"threads", threads}, {"median_ms", rounded(ms)}, {"min_ms", rounded(least)}};
        if (answer) row.set("answer", std::abs(*answer) < 1e9 ? rounded(*answer) : *answer);
        add(row);
        if (!shown()) return;
        std::printf("%-8s %8u  %-20s %-8s %12.3f %12.3f", program, threads, part, system.c_str(), ms, least);
        if (times) std::printf(" %6.1fx%s", *times, same ? "" : "  DIFFERENT");
        std::printf("\n");
        std::fflush(stdout);
    }
};

void run(const BenchOptions& options)
{
    const std::vector<const Program*> wanted = choose(options.names, programs, "program that is measured");
    Table table(options);
    for (const Program* program : wanted)
        for (const std::uint32_t count : options.threads) {
            const Threads threads(count);
            const Parts ours = program->run(options, threads.executor());
            table.add_parts(program->name, threads.count(), "jostle", ours);
#ifdef JOSTLE_WITH_PEERS
            if (!options.peers || threads.count() != 1 || program->run == run_boxes) continue;
            for (const auto& [name, theirs] : run_peers(options, program->name))
                table.add_parts(program->name, 1, name, theirs, &ours);
#endif
        }
    table.finish();
}

} // namespace

void add_bench_programs_command(const Command& bench)
{
    const auto [command, options] =
        add_bench_part(bench, "programs", "Times whole programs: a game server, grains, a planner",
                       listed("Programs", programs, 10) + R"(
Each row is one part of a program: a tick's moves with their events, what each player sees, shots; a search for a
Verlet list, sums of forces; contacts with the rock, the arm with itself, the first link that touches, distances. The
total is the sum of the parts that all systems may have, and its ratio to Jostle's time for the same parts. The boxes
are queries that once took far too long.

Peers, on one thread: Bullet's trees and FCL's (server); linked cells, Bullet's trees and FCL's with images of the
balls near the ends of an axis, and a plain loop (grains); Bullet and FCL pair after pair (planner; measured once).
A part that a system doesn't offer is "-", without a row of JSON: rays of FCL, two meshes of Bullet, which finds
some that don't touch. If answers differ, the exit status is 1.

Examples:
  jostle bench programs
  jostle bench programs server --peers
  jostle bench programs --size 0.1 --threads 1,2 --json -)",
                       run, {.threads = {1}, .frames = 7});
    command.texts("PROGRAM", options.names, "Which programs; all if none is given");
    command.number_between("--size", options.scale, 0.001, 100, "X",
                           "How many times as many objects as above (1)");
    add_thread_counts_option(command, options.threads);
    command.number("--repetitions", options.frames, 1, 100'000, "R", "How often each part is done (7)");
    command.seed(options.seed, "Other objects of the same kind (1)");
    command.flag("--peers", options.peers, "Other systems as well, where the build has them");
    add_rows_file_option(command, options.json);
}

} // namespace jostle_tool
