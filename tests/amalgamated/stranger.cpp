// SPDX-License-Identifier: MIT
// A program that was given Jostle as two files. It compares pairs with brute force and prints what
// tests/platforms/golden/table.txt has about this part of the library, once it has found the same with every
// instruction set.
#include JOSTLE_HEADER // the header that was generated

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>

#include "hash_of_pairs.hpp"
#ifndef JOSTLE_PAIRS_HPP
#include "hash_of_events.hpp"
#endif
#ifdef JOSTLE_ALL_HPP
#include "hash_of_bodies.hpp"
#endif

namespace {

void require(bool good, const std::string& what)
{
    if (good) return;
    std::fprintf(stderr, "not so: %s\n", what.c_str());
    std::exit(1);
}

void compare_with_brute_force(std::string_view name, const jostle::FinderOptions& options)
{
    jostle_scenes::Scene<3, float> scene(name, 700);
    const jostle::BoxView<3, float> boxes(scene.boxes());
    jostle::PairFinder finder(options);
    require(finder.find(boxes, {}, jostle::Order::sorted).to_vector() ==
                jostle::find_pairs_brute_force(boxes),
            "the pairs of " + std::string(name) + " are those of brute force");
}

platforms_test::Table table(jostle::InstructionSet set, jostle::Executor& executor)
{
    platforms_test::Table table;
    jostle::FinderOptions finding;
    finding.executor = &executor;
    finding.instruction_set = set;
    jostle::PairFinder finder(finding);
#ifndef JOSTLE_PAIRS_HPP
    jostle::WorldOptions of_world;
    of_world.executor = &executor;
    of_world.instruction_set = set;
#endif
    for (const jostle_scenes::SceneInfo& scene : jostle_scenes::scene_list()) {
        compare_with_brute_force(scene.name, finding);
        platforms_test::add_pairs(table, scene.name, finder);
#ifndef JOSTLE_PAIRS_HPP
        if (!scene.hostile) platforms_test::add_events(table, scene.name, of_world);
#endif
    }
#ifdef JOSTLE_ALL_HPP
    platforms_test::add_bodies(table, executor, set);
#endif
    return table;
}

#ifdef __cpp_exceptions
void catch_an_error()
{
    const jostle::Aabb2d boxes[] = {{{0, 0}, {1, 1}},
                                    {{0, std::numeric_limits<double>::quiet_NaN()}, {1, 1}}};
    try {
        (void)jostle::find_pairs(boxes);
    } catch (const jostle::Error& error) {
        require(error.index() == 1, "the error names box 1");
        return;
    }
    require(false, "a NaN is an error");
}
#endif

} // namespace

int main()
{
    const auto sets = jostle::supported_instruction_sets();
    const platforms_test::Table expected = table(sets.front(), jostle::serial_executor());
    for (const jostle::InstructionSet set : sets)
        require(table(set, jostle::default_executor()) == expected,
                std::string("the answers are the same with ") + jostle::name(set));
#ifdef __cpp_exceptions
    catch_an_error();
#endif
    for (const auto& [what, hash] : expected)
        std::printf("%s %llx\n", what.c_str(), static_cast<unsigned long long>(hash));
    for (const jostle::InstructionSet set : sets)
        std::fprintf(stderr, "%s ", jostle::name(set));
}
