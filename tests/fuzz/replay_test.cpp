// SPDX-License-Identifier: MIT
// What the fuzzers have in their corpora, those inputs among them that once were found, through the same
// targets. A target that finds something prints the input as a piece of C++ and aborts.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "tests/fuzz/target.hpp"

namespace {

class Corpora : public testing::TestWithParam<fuzz::Target>
{
};

TEST_P(Corpora, FindNothing)
{
    std::size_t inputs = 0;
    for (const auto& entry :
         std::filesystem::directory_iterator(std::filesystem::path(JOSTLE_FUZZ_CORPUS) / GetParam().name)) {
        std::ifstream file(entry.path(), std::ios::binary);
        const std::vector<char> bytes((std::istreambuf_iterator<char>(file)), {});
        ASSERT_TRUE(file) << entry.path();
        fuzz::execute(GetParam(), {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
        ++inputs;
    }
    EXPECT_GT(inputs, 1u);
}

INSTANTIATE_TEST_SUITE_P(Every, Corpora, testing::ValuesIn(fuzz::targets()),
                         [](const auto& each) { return std::string(each.param.name); });

} // namespace
