// SPDX-License-Identifier: MIT
// Contacts, distances and impacts of any two shapes: of rounded hulls against the tests' slow
// definition, of all shapes against each other form of the question, and of moving ones against many
// moments of their motion.
#include "choices.hpp"
#include "tests/narrow/moments.hpp"
#include "tests/narrow/rounded_hulls.hpp"

namespace {

using namespace jostle;

/// Each answer of the finder, on every instruction set, is the one that is asked for alone.
template <int Dim>
void compare_forms(const Shape<Dim>& a, const Pose<Dim, double>& pose_a, const Shape<Dim>& b,
                   const Pose<Dim, double>& pose_b, double margin)
{
    const Shape<Dim> shapes[] = {a, b};
    const Pose<Dim, double> poses[] = {pose_a, pose_b};
    const Pair pairs[] = {{0, 1}};
    const auto gap = distance(a, pose_a, b, pose_b, HUGE_VAL);
    const auto turned = distance(b, pose_b, a, pose_a, HUGE_VAL);
    fuzz::demand(gap.has_value() == turned.has_value() && (!gap || gap->distance == turned->distance),
                 "another distance the other way round");
    std::optional<std::vector<Contact<Dim, double>>> first;
    for (const InstructionSet set : supported_instruction_sets()) {
        ContactOptions options{.executor = &serial_executor()};
        options.instruction_set = set;
        ContactFinder<Dim, double> finder(options);
        std::uint8_t touch[1];
        Distance<Dim, double> between[1];
        finder.touching({shapes, poses}, pairs, touch);
        fuzz::demand((touch[0] != 0) == touching(a, pose_a, b, pose_b), "touching() says otherwise alone");
        finder.distances({shapes, poses}, pairs, HUGE_VAL, between);
        fuzz::demand(!gap || between[0].distance == gap->distance, "distances() says otherwise alone");
        const auto found = finder.find({shapes, poses}, pairs, margin).to_vector();
        if (!first) first = found;
        bool same = found.size() == first->size();
        for (std::size_t k = 0; same && k < found.size(); ++k) {
            same = found[k].normal == (*first)[k].normal && found[k].count == (*first)[k].count;
            for (std::uint32_t i = 0; same && i < found[k].count; ++i)
                same = found[k].point[i].depth == (*first)[k].point[i].depth &&
                       found[k].point[i].from_a == (*first)[k].point[i].from_a;
        }
        fuzz::demand(same, "other contacts on another instruction set");
        fuzz::count_boxes(2);
    }
}

void compare_with_definition(Random& random)
{
    const rounded_hulls::Sample a = rounded_hulls::make_sample(random.below(6), random),
                                b = rounded_hulls::make_sample(random.below(6), random);
    const double spread = random.chance(0.5) ? 1 : 0.5;
    const Pose3d pose_a = random.pose<double>(spread), pose_b = random.pose<double>(spread);
    const double margin = random.chance(0.5) ? 0 : 0.2;
    compare_forms<3>(a.shape, pose_a, b.shape, pose_b, margin);
    if (a.points.size() * b.points.size() > 24) return; // the definition is slow
    const double expected =
        oracle::signed_distance(rounded_hulls::placed(a, pose_a), rounded_hulls::placed(b, pose_b)) -
        a.radius - b.radius;
    const auto gap = distance(a.shape, pose_a, b.shape, pose_b, HUGE_VAL);
    fuzz::demand(gap && std::abs(gap->distance - expected) < 1e-7, "another distance than the definition's");
    fuzz::count_boxes(2);
    if (std::abs(expected - margin) < 1e-9) return;
    const Shape3 shapes[] = {a.shape, b.shape};
    const Pose3d poses[] = {pose_a, pose_b};
    const Pair pairs[] = {{0, 1}};
    ContactFinder3d finder({.executor = &serial_executor()});
    const auto contacts = finder.find({shapes, poses}, pairs, margin).to_vector();
    fuzz::demand(contacts.size() == (expected <= margin ? 1u : 0u), "a contact where none is, or none");
    if (contacts.empty()) return;
    double deepest = -HUGE_VAL;
    for (std::uint32_t i = 0; i < contacts[0].count; ++i)
        deepest = std::max(deepest, contacts[0].point[i].depth);
    // Of nearly parallel segments only the ends are told: up to 1e-7 of what both cores reach less deep.
    fuzz::demand(std::abs(deepest + expected) < 5e-7, "another depth than the definition's");
}

template <int Dim>
void compare_zoo(Random& random)
{
    const Zoo<Dim> zoo(random, 1);
    const Shape<Dim>&a = zoo.any(random), &b = zoo.any(random);
    compare_forms<Dim>(a, random_pose<Dim, double>(random, 1), b, random_pose<Dim, double>(random, 1),
                       random.chance(0.5) ? 0 : 0.2);
}

/// Never later than the first of many moments at which they overlap, and no earlier than the tolerance
/// lets it.
void compare_impact(Random& random)
{
    const rounded_hulls::Sample a = rounded_hulls::make_sample(random.below(6), random),
                                b = rounded_hulls::make_sample(random.below(6), random);
    Motion<3, double> moving_a{random.pose<double>(0.5), {}, {}}, moving_b{random.pose<double>(4), {}, {}};
    const double turn = random.chance(0.5) ? 0 : 3;
    for (std::size_t d = 0; d < 3; ++d) {
        moving_b.linear[d] = random.uniform(0, 1.6) * (moving_a.pose.position[d] - moving_b.pose.position[d]);
        moving_a.angular[d] = random.uniform(-turn, turn);
        moving_b.angular[d] = random.uniform(-turn, turn);
    }
    const double tolerance = random.chance(0.5) ? 1e-2 : 1e-4;
    const auto impact = time_of_impact(a.shape, moving_a, b.shape, moving_b, tolerance);
    const auto overlap = moments::first_overlap(a.shape, moving_a, b.shape, moving_b, 60);
    fuzz::count_boxes(2);
    if (!impact) return fuzz::demand(!overlap, "an impact is missed");
    fuzz::demand(!overlap || impact->time <= *overlap, "an impact comes late");
    const double gap = moments::gap_at(a.shape, moving_a, b.shape, moving_b, impact->time);
    fuzz::demand(gap <= tolerance * 1.001 + 1e-9, "an impact comes early");
}

} // namespace

JOSTLE_FUZZ_TARGET(contacts)
{
    Random random{fuzz::Choices(in)};
    switch (in.below(4)) {
    case 0:
        return compare_zoo<3>(random);
    case 1:
        return compare_zoo<2>(random);
    case 2:
        return compare_impact(random);
    default:
        return compare_with_definition(random);
    }
}
