// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "jostle/contact.hpp"
#include "jostle/process.hpp"
#include "jostle/responses.hpp"
#include "tool/simulation/scenes.hpp"
#include "tool/simulation/simulation.hpp"
#include "tool/simulation/solve.hpp"

// What a simulation consists of, and the stages of a step. Contacts are shared out in blocks, and what
// concerns a block's points lies together:
//
//     block   | strip of 128 points                        | strip ...
//             | normal.x[128], normal.y[128], ... 16 in all | ...
//     bodies  | those that the block's points act on: a point names them by their places here
//
// A strip has one column for each number of a point, so that the solver reads and writes whole vectors.

namespace jostle_simulation {

using jostle::Work;
using Contact = jostle::Contact<3, float>;

inline constexpr float slop = 0.005f; ///< overlap that is left alone, in metres
inline constexpr std::uint64_t bodies_per_block = 1024;

/// The impulse that a point of contact carries: on b, and the opposite on a.
struct Load
{
    float along = 0;
    Vec3 across;
};
/// A point of the frame before, by which this frame's finds what it starts with.
struct Carried
{
    std::uint32_t b, feature;
    Load load;
};

/// The response of a body to its points in one iteration.
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
/// The response that begins a frame: what was carried before, and how many points the body has.
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
/// By how much a body has to move to get out of others.
struct Push
{
    Vec3 way;
    Push& operator+=(const Push& other)
    {
        way = way + other.way;
        return *this;
    }
};

/// The working memory of a task: the bodies of the block that it works on, each with a number of its own.
struct alignas(128) Scratch
{
    std::vector<std::uint32_t>
        number_of; ///< by body; of use only where the block's list has that body at that number
    std::vector<Body> bodies;
    std::vector<Sum> sums;
};
/// Contacts that are worked on together, and their points.
struct Block
{
    std::uint32_t points = 0, bodies = 0;
    float deepest = 0;
    double wrong = 0; ///< sum of the squares of velocities at which surfaces go into each other
    std::uint64_t points_before = 0; ///< how many points the blocks before have
    std::uint32_t last_a_before = 0; ///< the first body of their last point, plus 1
};

/// Energy, in joule.
struct Sums
{
    double motion = 0; ///< kinetic
    double fall = 0;   ///< what gravity adds
};

inline double motion_of(const Body& body)
{
    return 0.5 * dot(body.linear, body.linear) / body.inverse_mass +
           0.5 * dot(body.angular, body.angular) / body.inverse_inertia;
}

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

    // The stages of a step, in their order; the file that has each is in brackets.
    void make_boxes();          // [motion.cpp]
    void find_contacts();       // [simulation.cpp]
    void prepare_points();      // [points.cpp]
    double iterate(bool first); // [impulses.cpp]
    void carry_over();          // [points.cpp]
    void move();                // [motion.cpp]

    // What they are made of.
    void prepare_batch(const jostle::Batch<Contact>& batch);
    template <class Add>
    void add_to_bodies(Work work, Add&& add);
    void apply(std::size_t to, const Impulse& impulse);
    void push_out(double lost);

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

/// Calls add(body, sum) for the bodies of a block that move.
template <class Add>
void Simulation::Implementation::add_to_bodies(Work work, Add&& add)
{
    const std::uint32_t* const bodies = bodies_of(work.block);
    const std::vector<Sum>& on = scratches[work.slot].sums;
    for (std::uint32_t i = 0; i < blocks[work.block].bodies; ++i)
        if (moves(bodies[i])) add(bodies[i], on[i]);
}

} // namespace jostle_simulation
