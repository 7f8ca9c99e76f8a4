// SPDX-License-Identifier: MIT
#pragma once

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/box.hpp"
#include "tool/scenes/scenes.hpp"

/// What lies in tests/platforms/golden: made on one machine, and the same on all of them.
namespace platforms_test {

[[nodiscard]] inline std::string golden(const std::string& name)
{
    return JOSTLE_GOLDEN_FOLDER "/" + name;
}

/// Whether the golden files are to be written again: JOSTLE_REGENERATE_GOLDEN=1 ctest -R platforms_test
[[nodiscard]] inline bool regenerating()
{
    return std::getenv("JOSTLE_REGENERATE_GOLDEN") != nullptr;
}

[[nodiscard]] inline std::string read_file(const std::string& path)
{
    std::ifstream file(path, std::ios::binary);
    EXPECT_TRUE(file.is_open()) << path;
    return {std::istreambuf_iterator<char>(file), {}};
}

/// These bytes are what the golden file of the name has.
inline void expect_golden(const std::string& name, const std::string& bytes)
{
    if (regenerating()) {
        std::ofstream file(golden(name), std::ios::binary);
        file << bytes;
        ASSERT_TRUE(file.flush()) << golden(name);
    }
    ASSERT_FALSE(bytes.empty());
    EXPECT_TRUE(read_file(golden(name)) == bytes) << name << ": " << bytes.size() << " bytes here";
}

[[nodiscard]] inline bool same(const jostle::Aabb3f& a, const jostle::Aabb3f& b)
{
    return a.lo == b.lo && a.hi == b.hi;
}

/// Small enough for a file in the source.
inline jostle_scenes::Scene<3, float> small_scene()
{
    return {"mixed", 60, 7};
}

} // namespace platforms_test
