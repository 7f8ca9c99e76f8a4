// SPDX-License-Identifier: MIT
#include "simulation/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "jostle/contact.hpp"
#include "jostle/process.hpp"
#include "jostle/responses.hpp"
#include "simulation/scenes.hpp"

namespace jostle_simulation {

namespace {

using jostle::Work;
using Contact = jostle::Contact<3, float>;

constexpr float frame_time = 1.0f / 60;
constexpr int fewest_iterations = 4, most_iterations = 24;
constexpr double settled = 0.02; ///< metres a second; see iterate
constexpr float friction = 0.5f;
constexpr float slop = 0.005f;       ///< overlap that is left alone, in metres
constexpr float pushed_out = 0.2f;   ///< of the rest, per frame
constexpr float near_enough = 0.01f; ///< a gap that will be this small is kept in mind
constexpr std::uint64_t contacts_per_block = 128;
constexpr std::uint64_t bodies_per_block = 1024;

Vec3 vec(const jostle::Vec<3, float>& v)
{
    return {v[0], v[1], v[2]};
}

/// One point of contact.
struct Row
{
    std::uint32_t a, b;
    Vec3 normal; ///< from a to b
    Vec3 from_a, from_b;
    float gap;
    float mass_along, mass_across; ///< what resists an impulse along the normal and across it
};
/// What it carries: the impulse on b.
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

Impulse impulse_at(Vec3 from_centre, Vec3 impulse)
{
    return {impulse, cross(from_centre, impulse)};
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
          points_of(world.moving, 1),
          carried_of(world.shapes.size() + 1, 0)
    {
    }

    void step();

    // The stages.
    void make_boxes();
    void find_contacts();
    void prepare_rows();
    void apply_first_impulses();
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
    /// Calls work_on(first row, the row after the last, work) for each block.
    template <class F>
    void each_block_of_rows(F&& work_on)
    {
        jostle::process_items(
            plan.blocks,
            [&](std::uint64_t block, std::uint64_t, Work work) {
                const std::size_t first = block * rows_per_block();
                work_on(first, first + row_count[block], work);
            },
            by(1));
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
    /// Room for the rows of a block of contacts.
    std::size_t rows_per_block() const { return contacts_per_block * world.most_points; }
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

    jostle::WorkPlan plan;                    ///< of the contacts; rows have the same blocks
    std::vector<std::uint32_t> row_count;     ///< by block
    std::vector<float> deepest_of;            ///< by block
    std::vector<double> wrong_of;             ///< by block: squares, summed up
    std::vector<Row> rows;                    ///< each block's from its contacts_per_block * max_points-th on
    std::vector<Load> loads;                  ///< as rows
    std::vector<std::uint32_t> features;      ///< as rows
    std::vector<float> points_of;             ///< by body: at least 1
    std::vector<std::uint64_t> row_before;    ///< by block: rows in the blocks before
    std::vector<std::uint32_t> last_a_before; ///< by block: the last row's a in the blocks before, plus 1
    std::vector<Carried> carried;             ///< ascending by a, as the pairs are
    std::vector<std::uint64_t> carried_of;    ///< by a: its first
    std::vector<float> fastest_of;            ///< by block of bodies
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
    jostle::bounds<3, float>(std::span<const jostle::Shape3>(world.shapes),
                             std::span<const jostle::Pose3f>(world.poses), boxes, slop, executor);
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
void Simulation::Implementation::prepare_rows()
{
    plan = jostle::plan_work(contacts->size(), by(contacts_per_block));
    row_count.assign(plan.blocks, 0);
    deepest_of.assign(plan.blocks, 0);
    const std::size_t most_rows = plan.blocks * rows_per_block();
    if (rows.size() < most_rows) {
        rows.resize(most_rows + most_rows / 4);
        loads.resize(rows.size());
        features.resize(rows.size());
    }
    first_impulses.start(world.moving, plan);
    jostle::process_contacts(
        *contacts,
        [&](const jostle::Batch<Contact>& batch) {
            const std::uint32_t block = batch.work.block;
            const std::size_t first = block * rows_per_block();
            for (const Contact& contact : batch.items) {
                const std::uint32_t a = contact.pair.a, b = contact.pair.b;
                if (!moves(a)) continue; // nor does b: what moves comes first
                const Body &body_a = world.bodies[a], &body_b = world.bodies[b];
                for (std::uint32_t k = 0; k < contact.count; ++k) {
                    const auto& point = contact.point[k];
                    Row row{a, b, vec(contact.normal), vec(point.from_a), vec(point.from_b), -point.depth,
                            0, 0};
                    Load load;
                    for (std::uint64_t c = carried_of[a]; c < carried_of[a + 1]; ++c)
                        if (carried[c].b == b && carried[c].feature == point.feature) {
                            load = carried[c].load;
                            load.across = load.across - dot(load.across, row.normal) * row.normal;
                            break;
                        }
                    const float closing =
                        dot(row.normal, velocity_at(body_b, row.from_b) - velocity_at(body_a, row.from_a));
                    if (load.along == 0 && row.gap + frame_time * closing > near_enough) continue;
                    deepest_of[block] = std::max(deepest_of[block], point.depth);
                    const std::size_t at = first + row_count[block]++;
                    rows[at] = row;
                    loads[at] = load;
                    features[at] = point.feature;
                    const Vec3 impulse = load.along * row.normal + load.across;
                    first_impulses.add(batch.work, a, {impulse_at(row.from_a, -1.0f * impulse), 1});
                    if (moves(b)) first_impulses.add(batch.work, b, {impulse_at(row.from_b, impulse), 1});
                }
            }
        },
        by(contacts_per_block));
    points = 0;
    deepest = 0;
    for (std::uint32_t block = 0; block < plan.blocks; ++block) {
        points += row_count[block];
        deepest = std::max(deepest, deepest_of[block]);
    }
    pushing = deepest > slop;
}

void Simulation::Implementation::apply_first_impulses()
{
    const auto first = first_impulses.merge();
    each_body([&](std::uint32_t i) {
        Body& body = world.bodies[i];
        body.linear = body.linear + body.inverse_mass * first[i].impulse.linear;
        body.angular = body.angular + body.inverse_inertia * first[i].impulse.angular;
        points_of[i] = std::max(1.0f, first[i].points);
    });
}

/// One Jacobi iteration: every point as if it had its share of both bodies to itself. Returns the root mean
/// square of the velocities at which surfaces would have gone into each other before.
double Simulation::Implementation::iterate(bool first)
{
    wrong_of.assign(plan.blocks, 0);
    impulses.start(world.moving, plan);
    each_block_of_rows([&](std::size_t begin, std::size_t end, Work work) {
        constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
        std::uint32_t a = none; // of the rows before, which lie together
        Impulse on_a;
        double wrong = 0;
        for (std::size_t k = begin; k < end; ++k) {
            Row& row = rows[k];
            const Body &body_a = world.bodies[row.a], &body_b = world.bodies[row.b];
            if (first) {
                const Vec3 lever_a = cross(row.from_a, row.normal), lever_b = cross(row.from_b, row.normal);
                const float share_a = points_of[row.a], share_b = moves(row.b) ? points_of[row.b] : 0;
                row.mass_along =
                    1 / (share_a * (body_a.inverse_mass + body_a.inverse_inertia * dot(lever_a, lever_a)) +
                         share_b * (body_b.inverse_mass + body_b.inverse_inertia * dot(lever_b, lever_b)));
                // At most this, whatever the direction: no iteration overshoots.
                row.mass_across =
                    1 /
                    (share_a * (body_a.inverse_mass + body_a.inverse_inertia * dot(row.from_a, row.from_a)) +
                     share_b * (body_b.inverse_mass + body_b.inverse_inertia * dot(row.from_b, row.from_b)));
            }
            const Vec3 velocity = velocity_at(body_b, row.from_b) - velocity_at(body_a, row.from_a);
            const float along = dot(row.normal, velocity);
            Load& load = loads[k];
            const float wanted = along + std::max(row.gap, 0.0f) * (1 / frame_time);
            if (wanted < 0) wrong += wanted * wanted;
            const float new_along = std::max(0.0f, load.along - row.mass_along * wanted);
            Vec3 new_across = load.across - row.mass_across * (velocity - along * row.normal);
            const float most = friction * new_along, size = dot(new_across, new_across);
            if (size > most * most) new_across = (most / std::sqrt(size)) * new_across;
            const Vec3 impulse = (new_along - load.along) * row.normal + (new_across - load.across);
            load = {new_along, new_across};
            if (row.a != a) {
                if (a != none) impulses.add(work, a, on_a);
                a = row.a;
                on_a = {};
            }
            on_a += impulse_at(row.from_a, -1.0f * impulse);
            if (moves(row.b)) impulses.add(work, row.b, impulse_at(row.from_b, impulse));
        }
        if (a != none) impulses.add(work, a, on_a);
        wrong_of[work.block] = wrong;
    });
    const auto merged = impulses.merge();
    each_body([&](std::uint32_t i) {
        Body& body = world.bodies[i];
        body.linear = body.linear + body.inverse_mass * merged[i].linear;
        body.angular = body.angular + body.inverse_inertia * merged[i].angular;
    });
    double wrong = 0;
    for (const double of_block : wrong_of)
        wrong += of_block;
    return points == 0 ? 0 : std::sqrt(wrong / static_cast<double>(points));
}

/// Undoes overlap in positions rather than by velocities, which would keep it as energy. Lifting bodies takes
/// some, too: no more than the frame has lost.
void Simulation::Implementation::push_out(double lost)
{
    pushes.start(world.moving, plan);
    each_block_of_rows([&](std::size_t begin, std::size_t end, Work work) {
        if (deepest_of[work.block] <= slop) return;
        for (std::size_t k = begin; k < end; ++k) {
            const Row& row = rows[k];
            const float overlap = -row.gap - slop;
            if (overlap <= 0) continue;
            const float weight_a = world.bodies[row.a].inverse_mass,
                        weight_b = world.bodies[row.b].inverse_mass;
            const float size =
                pushed_out * overlap /
                (weight_a * points_of[row.a] + (moves(row.b) ? weight_b * points_of[row.b] : 0));
            pushes.add(work, row.a, {-size * weight_a * row.normal});
            if (moves(row.b)) pushes.add(work, row.b, {size * weight_b * row.normal});
        }
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
    row_before.resize(plan.blocks);
    last_a_before.resize(plan.blocks);
    std::uint64_t before = 0;
    std::uint32_t last_a = 0;
    for (std::uint32_t block = 0; block < plan.blocks; ++block) {
        row_before[block] = before;
        last_a_before[block] = last_a;
        before += row_count[block];
        if (row_count[block] != 0) last_a = rows[block * rows_per_block() + row_count[block] - 1].a + 1;
    }
    if (carried.size() < before) carried.resize(before + before / 4);
    each_block_of_rows([&](std::size_t begin, std::size_t end, Work work) {
        const auto block = static_cast<std::size_t>(begin / rows_per_block());
        std::uint64_t at = row_before[block];
        std::uint32_t next_a = last_a_before[block]; // the lowest without a first point so far
        for (std::size_t k = begin; k < end; ++k, ++at) {
            for (; next_a <= rows[k].a; ++next_a)
                carried_of[next_a] = at;
            carried[at] = {rows[k].b, features[k], loads[k]};
        }
        (void)work;
    });
    std::fill(carried_of.begin() + last_a, carried_of.end(), before);
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
        prepare_rows();
        apply_first_impulses();
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

std::array<double, 3> Simulation::momentum() const
{
    const World& world = implementation_->world;
    std::array<double, 3> sum = {};
    for (std::uint32_t i = 0; i < world.moving; ++i) {
        const Body& body = world.bodies[i];
        sum[0] += double{body.linear.x} / body.inverse_mass;
        sum[1] += double{body.linear.y} / body.inverse_mass;
        sum[2] += double{body.linear.z} / body.inverse_mass;
    }
    return sum;
}

std::array<float, 3> Simulation::position(std::uint32_t body) const noexcept
{
    return implementation_->world.poses[body].position;
}

std::array<float, 3> Simulation::velocity(std::uint32_t body) const noexcept
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
    jostle::bounds<3, float>(std::span<const jostle::Shape3>(all.world.shapes),
                             std::span<const jostle::Pose3f>(all.world.poses), all.boxes, 0, all.executor);
    return std::span(all.boxes).first(all.world.moving);
}

} // namespace jostle_simulation
