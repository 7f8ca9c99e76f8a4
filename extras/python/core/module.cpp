// SPDX-License-Identifier: MIT
// What the package's Python code stands on: jostle.h with arrays of NumPy for pointers.
#include "core/module.hpp"

#include <pybind11/stl.h>

#include <string>
#include <vector>

#include "core/calls.hpp"

PYBIND11_MODULE(_core, m)
{
    using namespace jostle_python;

    m.doc() = "jostle.h with NumPy's arrays; use the package jostle";
    m.def(
        "version",
        [] {
            std::uint32_t major = 0, minor = 0, patch = 0;
            call([&](jostle_error* error) { return jostle_version(&major, &minor, &patch, error); });
            return std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(patch);
        },
        "The version of the library.");
    m.def(
        "instruction_sets",
        [] {
            const jostle_instruction_set* sets = nullptr;
            std::uint64_t count = 0;
            call([&](jostle_error* error) { return jostle_instruction_sets(&sets, &count, error); });
            std::vector<std::string> names;
            for (std::uint64_t i = 0; i < count; ++i) {
                const char* name = "";
                call([&](jostle_error* error) { return jostle_instruction_set_name(sets[i], &name, error); });
                names.emplace_back(name);
            }
            return names;
        },
        "The instruction sets that this build and this machine have, fastest first.");

    define_pairs(m);
    define_spheres(m);
    define_neighbors(m);
    define_surfaces(m);
    define_pair_stream(m);
    define_queries(m);
    define_index(m);
    define_world(m);
    define_pair_slots(m);
    define_shapes(m);
    define_closed_mesh(m);
    define_contacts(m);
    define_responses(m);
    guard_functions(m);
}
