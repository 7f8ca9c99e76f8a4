// SPDX-License-Identifier: MIT
#include "simulation/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "base/prefetch.hpp"
#include "jostle/contact.hpp"
#include "jostle/process.hpp"
#include "jostle/responses.hpp"
#include "simulation/scenes.hpp"
#include "simulation/solve.hpp"

namespace jostle_simulation {

namespace {

using jostle::Work;
using Contact = jostle::Contact<3, float>;

constexpr int fewest_iterations = 4, most_iterations = 24;
constexpr double settled = 0.02;     ///< metres a second; see iterate
constexpr float slop = 0.005f;       ///< overlap that is left alone, in metres
constexpr float pushed_out = 0.8f;   ///< of the rest, per frame, by all points of a body together
constexpr float near_enough = 0.01f; ///< a gap that will be this small is kept in mind
constexpr std::uint64_t bodies_per_block = 1024;

/// How many contacts a block has: whole strips. The more, the fewer bodies have points in several blocks; the
/// fewer, the more threads find something to do. What a block needs fits the second-level cache.
std::uint64_t contacts_per_block_of(std::uint64_t contacts)
{
    return std::clamp<std::uint64_t>(contacts / 64, 2 * strip, 32 * strip) / strip * strip;
}

Vec3 vec(const jostle::Vec<3, float>& v)
{
    return {v[0], v[1], v[2]};
}

/// What a point carries: the impulse on b.
struct Load
{
    float along = 0;
    Vec3 across;
};
/// A point of the frame before.
struct Carried
{
    std::uint32_t b, feature;
    Load load;
};

struct Impulse
{
    Vec3 linear, angular;
    Impulse& operator+=(const Impulse& other)
    {
        linear = linear + other.linear;
        angular = angular + other.angular;
        return *this;
    }
};
/// Of a frame's first round: what was carried before, and how many points there are.
struct FirstImpulse
{
    Impulse impulse;
    float points = 0;
    FirstImpulse& operator+=(const FirstImpulse& other)
    {
        impulse += other.impulse;
        points += other.points;
        return *this;
    }
};
struct Push
{
    Vec3 way;
    Push& operator+=(const Push& other)
    {
        way = way + other.way;
        return *this;
    }
};

/// What a task has at hand while it works on a block: the block's bodies, each with a number of its own.
struct alignas(128) Scratch
{
    std::vector<std::uint32_t> number_of; ///< by body; of those that have one
    std::vector<Body> bodies;
    std::vector<Sum> sums;
};
/// Some contacts and their points.
struct Block
{
    std::uint32_t points = 0, bodies = 0;
    float deepest = 0;
    double wrong = 0;                ///< sum of squares
    std::uint64_t points_before = 0; ///< in the blocks before
    std::uint32_t last_a_before = 0; ///< the last point's a in the blocks before, plus 1
};

/// Of energy, in joule.
struct Sums
{
    double motion = 0; ///< kinetic
    double fall = 0;   ///< what gravity adds
};

double motion_of(const Body& body)
{
    return 0.5 * dot(body.linear, body.linear) / body.inverse_mass +
           0.5 * dot(body.angular, body.angular) / body.inverse_inertia;
}

Vec3 velocity_at(const Body& body, Vec3 from_centre)
{
    return body.linear + cross(body.angular, from_centre);
}

} // namespace

struct Simulation::Implementation
{
    explicit Implementation(const Options& given)
        : world(make_world(given.scene, given.bodies, given.seed)),
          executor(given.executor == nullptr ? jostle::default_executor() : *given.executor),
          finder(finder_options(given)),
          contact_finder(contact_options(given)),
          first_impulses(responses_options()),
          impulses(responses_options()),
          pushes(responses_options()),
          boxes(world.shapes.size()),
          solver(solver_for(given.instruction_set)),
          points_of(world.shapes.size(), 1),
          carried_of(world.shapes.size() + 1, 0)
    {
    }

    void step();

    // The stages.
    void make_boxes();
    void find_contacts();
    void prepare_points();
    void prepare_batch(const jostle::Batch<Contact>& batch);
    template <class Add>
    void add_to_bodies(Work work, Add&& add);
    void apply(std::size_t to, const Impulse& impulse);
    double iterate(bool first);
    void push_out(double lost);
    void carry_over();
    void move();

    jostle::FinderOptions finder_options(const Options& given) const
    {
        jostle::FinderOptions options;
        options.executor = &executor;
        options.instruction_set = given.instruction_set;
        return options;
    }
    jostle::ContactOptions contact_options(const Options& given) const
    {
        jostle::ContactOptions options;
        options.executor = &executor;
        options.instruction_set = given.instruction_set;
        return options;
    }
    jostle::ResponsesOptions responses_options() const
    {
        jostle::ResponsesOptions options;
        options.executor = &executor;
        return options;
    }
    jostle::ProcessOptions by(std::uint64_t block_items) const
    {
        jostle::ProcessOptions options;
        options.executor = &executor;
        options.block_items = block_items;
        return options;
    }
    /// Calls work_on(work) for each block of points.
    template <class F>
    void each_block(F&& work_on)
    {
        jostle::process_items(
            plan.blocks, [&](std::uint64_t, std::uint64_t, Work work) { work_on(work); }, by(1));
    }
    /// Where the points of a block begin, and its bodies.
    std::size_t first_point(std::uint32_t block) const
    {
        return block * plan.block_items * world.most_points;
    }
    std::uint32_t* bodies_of(std::uint32_t block)
    {
        return block_bodies.data() + 2 * block * plan.block_items;
    }
    /// A strip of a block's points.
    Points strip_of(std::uint32_t block, std::size_t number)
    {
        float* column = columns.data() + (first_point(block) + number * strip) * columns_count;
        const auto next = [&] { return std::exchange(column, column + strip); };
        const auto next3 = [&]() -> Columns3 {
            float *const x = next(), *const y = next(), *const z = next();
            return {x, y, z};
        };
        Points p{};
        p.normal = next3();
        p.from_a = next3();
        p.from_b = next3();
        p.across = next3();
        p.gap = next();
        p.along = next();
        p.mass_along = next();
        p.mass_across = next();
        return p;
    }
    template <class F>
    void each_body(F&& work_on)
    {
        jostle::process_items(
            world.moving,
            [&](std::uint64_t begin, std::uint64_t end, Work) {
                for (std::uint64_t i = begin; i < end; ++i)
                    work_on(static_cast<std::uint32_t>(i));
            },
            by(bodies_per_block));
    }
    /// The sums over all bodies of what add(sums, body's number) adds, in a fixed order.
    template <class F>
    Sums sum_over_bodies(F&& add)
    {
        sums.assign(world.moving / bodies_per_block + 1, {});
        jostle::process_items(
            world.moving,
            [&](std::uint64_t begin, std::uint64_t end, Work work) {
                Sums sum;
                for (std::uint64_t i = begin; i < end; ++i)
                    add(sum, static_cast<std::uint32_t>(i));
                sums[work.block] = sum;
            },
            by(bodies_per_block));
        Sums total;
        for (const Sums& sum : sums) {
            total.motion += sum.motion;
            total.fall += sum.fall;
        }
        return total;
    }
    bool moves(std::uint32_t body) const { return body < world.moving; }

    World world;
    jostle::Executor& executor;
    jostle::PairFinder finder;
    jostle::ContactFinder3f contact_finder;
    jostle::Responses<FirstImpulse> first_impulses;
    jostle::Responses<Impulse> impulses;
    jostle::Responses<Push> pushes;

    std::vector<jostle::Aabb3f> boxes;
    const jostle::PairBuffer* pairs = nullptr;
    const jostle::ContactBuffer<3, float>* contacts = nullptr;
    float reach = 0; ///< the widest gap that can close in this frame

    // Points of contact, those of a block of contacts together; of each strip a column for each number.
    static constexpr std::size_t columns_count = 16;
    jostle::WorkPlan plan; ///< of the contacts
    std::vector<Block> blocks;
    std::vector<float> columns;                ///< strip_of says which
    std::vector<std::uint16_t> body_a, body_b; ///< by number in the block
    std::vector<std::uint32_t> feature;
    std::vector<std::uint32_t> block_bodies; ///< bodies_of says which
    std::vector<Scratch> scratches;          ///< by slot
    const Solver& solver;

    std::vector<float> points_of;          ///< by body: at least 1
    std::vector<Carried> carried;          ///< ascending by a, as the pairs are
    std::vector<std::uint64_t> carried_of; ///< by a: its first
    std::uint32_t last_a = 0;              ///< of all points, plus 1
    std::vector<float> fastest_of;         ///< by block of bodies
    bool pushing = false;
    double motion_before = 0; ///< kinetic energy at the start of the frame
    std::vector<Sums> sums;   ///< by block of bodies

    StageTimes times;
    std::uint64_t points = 0;
    float deepest = 0;
    int iterations = 0;
};

/// Gravity, and boxes that hold all that a body can reach within the frame.
void Simulation::Implementation::make_boxes()
{
    motion_before =
        sum_over_bodies([&](Sums& sum, std::uint32_t i) { sum.motion += motion_of(world.bodies[i]); }).motion;
    fastest_of.assign(world.moving / bodies_per_block + 1, 0);
    jostle::bounds(world.shapes, world.poses, boxes, slop, executor);
    jostle::process_items(
        world.moving,
        [&](std::uint64_t begin, std::uint64_t end, Work work) {
            float fastest = 0;
            for (std::uint64_t i = begin; i < end; ++i) {
                Body& body = world.bodies[i];
                body.linear = body.linear + frame_time * world.gravity;
                jostle::Aabb3f& box = boxes[i];
                // A surface turns about the centre, no further away than half the box's diagonal.
                const Vec3 half =
                    0.5f * Vec3{box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]};
                const float turning = std::sqrt(dot(body.angular, body.angular) * dot(half, half));
                const float way[3] = {frame_time * body.linear.x, frame_time * body.linear.y,
                                      frame_time * body.linear.z};
                const float turned = world.shapes[i].type() == jostle::ShapeTypes::sphere
                                         ? 0
                                         : std::min(frame_time * turning, 0.2f);
                for (int d = 0; d < 3; ++d) {
                    box.lo[d] += std::min(way[d], 0.0f) - turned;
                    box.hi[d] += std::max(way[d], 0.0f) + turned;
                }
                fastest = std::max(fastest, std::sqrt(dot(body.linear, body.linear)) * frame_time + turned);
            }
            fastest_of[work.block] = fastest;
        },
        by(bodies_per_block));
    reach = 2 * (slop + *std::max_element(fastest_of.begin(), fastest_of.end()));
}

void Simulation::Implementation::find_contacts()
{
    contacts = &contact_finder.find(world.shapes, world.poses, *pairs, reach);
}

/// The points that will matter, with what they carried in the frame before.
void Simulation::Implementation::prepare_points()
{
    const jostle::ProcessOptions in_blocks = by(contacts_per_block_of(contacts->size()));
    plan = jostle::plan_work(contacts->size(), in_blocks);
    blocks.assign(plan.blocks, {});
    if (body_a.size() < first_point(plan.blocks)) {
        const std::size_t room = first_point(plan.blocks) + first_point(plan.blocks) / 4;
        columns.resize(room * columns_count);
        body_a.resize(room);
        body_b.resize(room);
        feature.resize(room);
        block_bodies.resize(2 * room);
    }
    if (scratches.size() < plan.slots) scratches.resize(plan.slots);
    for (Scratch& scratch : scratches) {
        scratch.number_of.resize(world.shapes.size());
        scratch.bodies.resize(std::max<std::size_t>(scratch.bodies.size(), 2 * plan.block_items));
        scratch.sums.resize(scratch.bodies.size());
    }
    first_impulses.start(world.moving, plan);
    jostle::process_contacts(
        *contacts,
        [&](const jostle::Batch<Contact>& batch) {
            prepare_batch(batch);
            if (batch.first + batch.items.size() ==
                std::min(plan.items, (batch.work.block + 1) * plan.block_items))
                add_to_bodies(batch.work, [&](std::uint32_t body, const Sum& sum) {
                    first_impulses.add(batch.work, body, {{sum.linear, sum.angular}, sum.points});
                });
        },
        in_blocks);
    first_impulses.merge([&](std::uint32_t first, std::span<const FirstImpulse> of) {
        for (std::size_t i = 0; i < of.size(); ++i) {
            apply(first + i, of[i].impulse);
            points_of[first + i] = std::max(1.0f, of[i].points);
        }
    });
    points = 0;
    deepest = 0;
    last_a = 0;
    for (std::uint32_t b = 0; b < plan.blocks; ++b) {
        Block& block = blocks[b];
        block.points_before = points;
        block.last_a_before = last_a;
        points += block.points;
        deepest = std::max(deepest, block.deepest);
        if (block.points != 0) last_a = bodies_of(b)[body_a[first_point(b) + block.points - 1]] + 1;
    }
    pushing = deepest > slop;
}

void Simulation::Implementation::prepare_batch(const jostle::Batch<Contact>& batch)
{
    Block& block = blocks[batch.work.block];
    Scratch& scratch = scratches[batch.work.slot];
    std::uint32_t* const bodies = bodies_of(batch.work.block);
    const auto number = [&](std::uint32_t body) {
        // Numbers of other blocks may be left over: only what the block's list confirms is one.
        std::uint32_t& known = scratch.number_of[body];
        if (known >= block.bodies || bodies[known] != body) {
            known = block.bodies++;
            bodies[known] = body;
            scratch.sums[known] = {};
        }
        return known;
    };
    const std::size_t first = first_point(batch.work.block);
    Points p = strip_of(batch.work.block, block.points / strip);
    std::uint32_t last_seen = world.moving;
    const Carried *carried_now = nullptr, *carried_end = nullptr; // what a has from b on
    for (const Contact& contact : batch.items) {
        const std::uint32_t a = contact.pair.a, b = contact.pair.b;
        if (!moves(a)) continue; // nor does b: what moves comes first
        if (a != last_seen) {
            last_seen = a;
            carried_now = carried.data() + carried_of[a];
            carried_end = carried.data() + carried_of[a + 1];
        }
        while (carried_now != carried_end && carried_now->b < b)
            ++carried_now;
        const Vec3 normal = vec(contact.normal);
        for (std::uint32_t i = 0; i < contact.count; ++i) {
            const auto& point = contact.point[i];
            const Vec3 from_a = vec(point.from_a), from_b = vec(point.from_b);
            Load load;
            for (const Carried* c = carried_now; c != carried_end && c->b == b; ++c)
                if (c->feature == point.feature) {
                    load = c->load;
                    load.across = load.across - dot(load.across, normal) * normal;
                    break;
                }
            const float closing =
                dot(normal, velocity_at(world.bodies[b], from_b) - velocity_at(world.bodies[a], from_a));
            if (load.along == 0 && frame_time * closing - point.depth > near_enough) continue;
            block.deepest = std::max(block.deepest, point.depth);
            const std::size_t k = block.points % strip;
            if (k == 0) p = strip_of(batch.work.block, block.points / strip);
            put(p.normal, k, normal);
            put(p.from_a, k, from_a);
            put(p.from_b, k, from_b);
            put(p.across, k, load.across);
            p.gap[k] = -point.depth;
            p.along[k] = load.along;
            const std::uint32_t number_a = number(a), number_b = number(b);
            body_a[first + block.points] = static_cast<std::uint16_t>(number_a);
            body_b[first + block.points] = static_cast<std::uint16_t>(number_b);
            feature[first + block.points] = point.feature;
            ++block.points;
            Sum &on_a = scratch.sums[number_a], &on_b = scratch.sums[number_b];
            const Vec3 impulse = load.along * normal + load.across;
            on_a.add(-1.0f * impulse, cross(from_a, -1.0f * impulse));
            on_b.add(impulse, cross(from_b, impulse));
            ++on_a.points;
            ++on_b.points;
        }
    }
}

/// Calls add(body, sum) for the bodies of a block that move.
template <class Add>
void Simulation::Implementation::add_to_bodies(Work work, Add&& add)
{
    const std::uint32_t* const bodies = bodies_of(work.block);
    const std::vector<Sum>& on = scratches[work.slot].sums;
    for (std::uint32_t i = 0; i < blocks[work.block].bodies; ++i)
        if (moves(bodies[i])) add(bodies[i], on[i]);
}

void Simulation::Implementation::apply(std::size_t to, const Impulse& impulse)
{
    Body& body = world.bodies[to];
    body.linear = body.linear + body.inverse_mass * impulse.linear;
    body.angular = body.angular + body.inverse_inertia * impulse.angular;
}

/// One Jacobi iteration: every point as if it had its share of both bodies to itself. Returns the root mean
/// square of the velocities at which surfaces would have gone into each other before.
double Simulation::Implementation::iterate(bool first)
{
    impulses.start(world.moving, plan);
    each_block([&](Work work) {
        Block& block = blocks[work.block];
        Scratch& scratch = scratches[work.slot];
        const std::uint32_t* const bodies = bodies_of(work.block);
        for (std::uint32_t i = 0; i < block.bodies; ++i) {
            scratch.bodies[i] = world.bodies[bodies[i]];
            scratch.sums[i] = {};
        }
        block.wrong = 0;
        for (std::size_t begin = 0; begin < block.points; begin += strip) {
            const std::size_t count = std::min<std::size_t>(strip, block.points - begin);
            const std::size_t at = first_point(work.block) + begin;
            const std::uint16_t *const a = body_a.data() + at, *const b = body_b.data() + at;
            const Points p = strip_of(work.block, begin / strip);
            if (begin + strip < block.points)
                jostle::prefetch(strip_of(work.block, begin / strip + 1).normal.x,
                                 strip * columns_count * sizeof(float));
            if (first) {
                StripMobility mobility;
                for (std::size_t k = 0; k < count; ++k) {
                    const Body &on_a = scratch.bodies[a[k]], &on_b = scratch.bodies[b[k]];
                    const float share_a = points_of[bodies[a[k]]], share_b = points_of[bodies[b[k]]];
                    mobility.linear_a[k] = share_a * on_a.inverse_mass;
                    mobility.angular_a[k] = share_a * on_a.inverse_inertia;
                    mobility.linear_b[k] = share_b * on_b.inverse_mass;
                    mobility.angular_b[k] = share_b * on_b.inverse_inertia;
                }
                solver.resist(p, mobility, count);
            }
            StripBodies strip_bodies;
            solver.gather(scratch.bodies.data(), a, count, strip_bodies.linear_a, strip_bodies.angular_a);
            solver.gather(scratch.bodies.data(), b, count, strip_bodies.linear_b, strip_bodies.angular_b);
            StripImpulses out;
            solver.solve(p, strip_bodies, count, out);
            solver.scatter(out, a, b, count, scratch.sums.data());
            for (std::size_t k = 0; k < count; ++k)
                block.wrong += out.wrong[k];
        }
        add_to_bodies(work, [&](std::uint32_t body, const Sum& sum) {
            impulses.add(work, body, {sum.linear, sum.angular});
        });
    });
    impulses.merge([&](std::uint32_t first_body, std::span<const Impulse> of) {
        for (std::size_t i = 0; i < of.size(); ++i)
            apply(first_body + i, of[i]);
    });
    double wrong = 0;
    for (const Block& block : blocks)
        wrong += block.wrong;
    return points == 0 ? 0 : std::sqrt(wrong / static_cast<double>(points));
}

/// Undoes overlap in positions rather than by velocities, which would keep it as energy. Lifting bodies takes
/// some, too: no more than the frame has lost.
void Simulation::Implementation::push_out(double lost)
{
    pushes.start(world.moving, plan);
    each_block([&](Work work) {
        const Block& block = blocks[work.block];
        if (block.deepest <= slop) return;
        const std::uint32_t* const bodies = bodies_of(work.block);
        std::vector<Sum>& on = scratches[work.slot].sums;
        std::fill_n(on.begin(), block.bodies, Sum{});
        const std::size_t first = first_point(work.block);
        for (std::size_t i = 0; i < block.points; ++i) {
            const Points p = strip_of(work.block, i / strip);
            const std::size_t k = i % strip;
            const float overlap = -p.gap[k] - slop;
            if (overlap <= 0) continue;
            const std::uint32_t number_a = body_a[first + i], number_b = body_b[first + i];
            const std::uint32_t a = bodies[number_a], b = bodies[number_b];
            const float ease_a = world.bodies[a].inverse_mass, ease_b = world.bodies[b].inverse_mass;
            const float size = pushed_out * overlap / (ease_a * points_of[a] + ease_b * points_of[b]);
            on[number_a].add(-size * ease_a * get(p.normal, k), {});
            on[number_b].add(size * ease_b * get(p.normal, k), {});
        }
        add_to_bodies(work,
                      [&](std::uint32_t body, const Sum& sum) { pushes.add(work, body, {sum.linear}); });
    });
    const auto merged = pushes.merge();
    const double lifting = -sum_over_bodies([&](Sums& sum, std::uint32_t i) {
                                sum.fall += dot(world.gravity, merged[i].way) / world.bodies[i].inverse_mass;
                            }).fall;
    const auto part = static_cast<float>(lifting > lost ? lost / lifting : 1);
    each_body([&](std::uint32_t i) {
        jostle::Vec<3, float>& position = world.poses[i].position;
        position[0] += part * merged[i].way.x;
        position[1] += part * merged[i].way.y;
        position[2] += part * merged[i].way.z;
    });
}

/// Keeps what points carry, by body, for the next frame.
void Simulation::Implementation::carry_over()
{
    if (carried.size() < points) carried.resize(points + points / 4);
    each_block([&](Work work) {
        const Block& block = blocks[work.block];
        const std::uint32_t* const bodies = bodies_of(work.block);
        const std::size_t first = first_point(work.block);
        std::uint64_t at = block.points_before;
        std::uint32_t next_a = block.last_a_before; // the lowest without a first point so far
        for (std::size_t i = 0; i < block.points; ++i, ++at) {
            for (; next_a <= bodies[body_a[first + i]]; ++next_a)
                carried_of[next_a] = at;
            const Points p = strip_of(work.block, i / strip);
            carried[at] = {bodies[body_b[first + i]],
                           feature[first + i],
                           {p.along[i % strip], get(p.across, i % strip)}};
        }
    });
    std::fill(carried_of.begin() + last_a, carried_of.end(), points);
}

void Simulation::Implementation::move()
{
    // What iterations haven't settled can push too much. Then everything is slowed down until the frame gains
    // no energy: the larger root of slowed^2 motion - slowed fall - motion_before = 0. Without gravity there
    // is nothing to settle, and momentum to keep.
    const Sums sum = sum_over_bodies([&](Sums& s, std::uint32_t i) {
        const Body& body = world.bodies[i];
        s.motion += motion_of(body);
        s.fall += frame_time * dot(world.gravity, body.linear) / body.inverse_mass;
    });
    double slowed = 1, lost = motion_before + sum.fall - sum.motion;
    if (lost < 0 && dot(world.gravity, world.gravity) > 0) {
        slowed =
            (sum.fall + std::sqrt(sum.fall * sum.fall + 4 * sum.motion * motion_before)) / (2 * sum.motion);
        lost = 0;
    }
    if (pushing && lost > 0) push_out(lost);
    each_body([&](std::uint32_t i) {
        Body& body = world.bodies[i];
        body.linear = static_cast<float>(slowed) * body.linear;
        body.angular = static_cast<float>(slowed) * body.angular;
        jostle::Pose3f& pose = world.poses[i];
        pose.position[0] += frame_time * body.linear.x;
        pose.position[1] += frame_time * body.linear.y;
        pose.position[2] += frame_time * body.linear.z;
        // Half the product of the angular velocity, as a quaternion, and the rotation.
        const Vec3 w = (0.5f * frame_time) * body.angular;
        const auto [x, y, z, s] = pose.rotation;
        const float turned[4] = {x + w.x * s + w.y * z - w.z * y, y + w.y * s + w.z * x - w.x * z,
                                 z + w.z * s + w.x * y - w.y * x, s - w.x * x - w.y * y - w.z * z};
        const float length = std::sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2] +
                                       turned[3] * turned[3]);
        for (std::size_t k = 0; k < 4; ++k)
            pose.rotation[k] = turned[k] / length;
    });
}

void Simulation::Implementation::step()
{
    using Clock = std::chrono::steady_clock;
    Clock::time_point before = Clock::now();
    const auto timed = [&](std::size_t stage, auto&& work) {
        work();
        const Clock::time_point now = Clock::now();
        times.ms[stage] = std::chrono::duration<double, std::milli>(now - before).count();
        before = now;
    };
    timed(0, [&] { make_boxes(); });
    timed(1, [&] { pairs = &finder.find(boxes, {}, jostle::Order::sorted); });
    timed(2, [&] { find_contacts(); });
    timed(3, [&] {
        prepare_points();
        iterations = 0;
        for (bool more = true; more; ++iterations) {
            const double wrong = iterate(iterations == 0);
            more =
                iterations + 1 < fewest_iterations || (wrong > settled && iterations + 1 < most_iterations);
        }
        carry_over();
    });
    timed(4, [&] { move(); });
}

Simulation::Simulation(const Options& options) : implementation_(std::make_unique<Implementation>(options)) {}

Simulation::~Simulation() = default;

void Simulation::step()
{
    implementation_->step();
}

std::uint32_t Simulation::bodies() const noexcept
{
    return implementation_->world.moving;
}

std::uint64_t Simulation::pairs() const noexcept
{
    return implementation_->pairs == nullptr ? 0 : implementation_->pairs->size();
}

std::uint64_t Simulation::contacts() const noexcept
{
    return implementation_->points;
}

const StageTimes& Simulation::times() const noexcept
{
    return implementation_->times;
}

int Simulation::iterations() const noexcept
{
    return implementation_->iterations;
}

double Simulation::deepest() const noexcept
{
    return implementation_->deepest;
}

double Simulation::energy() const
{
    const World& world = implementation_->world;
    double sum = 0;
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        const Body& body = world.bodies[i];
        sum += motion_of(body) - double{world.gravity.y} * world.poses[i].position[1] / body.inverse_mass;
    }
    return sum;
}

jostle::Vec3d Simulation::momentum() const
{
    const World& world = implementation_->world;
    jostle::Vec3d sum = {};
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        const Body& body = world.bodies[i];
        sum[0] += double{body.linear.x} / body.inverse_mass;
        sum[1] += double{body.linear.y} / body.inverse_mass;
        sum[2] += double{body.linear.z} / body.inverse_mass;
    }
    return sum;
}

jostle::Vec3f Simulation::position(std::uint32_t body) const noexcept
{
    return implementation_->world.poses[body].position;
}

jostle::Vec3f Simulation::velocity(std::uint32_t body) const noexcept
{
    const Vec3 v = implementation_->world.bodies[body].linear;
    return {v.x, v.y, v.z};
}

std::uint64_t Simulation::hash() const
{
    // FNV-1a: Fowler, Noll, Vo; over 32 bits at a time.
    std::uint64_t hash = 0xcbf29ce484222325u;
    const auto add = [&hash](float value) {
        std::uint32_t bits;
        std::memcpy(&bits, &value, sizeof bits);
        hash = (hash ^ bits) * 0x100000001b3u;
    };
    const World& world = implementation_->world;
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        for (const float value : world.poses[i].position)
            add(value);
        for (const float value : world.poses[i].rotation)
            add(value);
        for (const Vec3& v : {world.bodies[i].linear, world.bodies[i].angular}) {
            add(v.x);
            add(v.y);
            add(v.z);
        }
    }
    return hash;
}

std::span<const jostle::Aabb3f> Simulation::boxes()
{
    Implementation& all = *implementation_;
    jostle::bounds(all.world.shapes, all.world.poses, all.boxes, 0, all.executor);
    return std::span(all.boxes).first(all.world.moving);
}

} // namespace jostle_simulation
