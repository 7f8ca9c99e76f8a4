// SPDX-License-Identifier: MIT
// Every question against its definition, while objects come, go and move.
#include <gtest/gtest.h>

#include "twin.hpp"

namespace {

using namespace jostle;
using twin::Kind;
using twin::Twin;

template <int Dim, class T>
void churn(Kind kind, std::uint64_t seed, std::uint32_t size, InstructionSet set, std::uint32_t threads)
{
    SCOPED_TRACE(std::string(twin::name(kind)) + " " + std::to_string(Dim) + (sizeof(T) == 4 ? "f " : "d ") +
                 name(set) + ", threads " + std::to_string(threads));
    const auto executor = make_thread_executor(threads);
    IndexOptions options;
    options.executor = executor.get();
    options.instruction_set = set;
    Twin<Dim, T> pair(kind, seed, options);
    std::uint64_t results = pair.compare(2); // of nothing
    pair.insert(3);
    results += pair.compare(4);
    pair.insert(size);
    results += pair.compare(10);
    for (int round = 0; round < 3; ++round) {
        pair.erase(size / 3);
        pair.insert(size / 4);
        pair.move(size / 5);
        pair.insert(5);
        pair.erase(7);
        results += pair.compare(6);
    }
    pair.build();
    results += pair.compare(6);
    pair.erase(size);
    results += pair.compare(3);
    pair.insert(50);
    results += pair.compare(3);
    EXPECT_GT(results, 100u);
}

class Questions : public ::testing::TestWithParam<int>
{
};

TEST_P(Questions, AnswerAsDefined)
{
    const Kind kind = static_cast<Kind>(GetParam());
    std::uint64_t seed = 1;
    for (const InstructionSet set : supported_instruction_sets())
        for (const std::uint32_t threads : {1u, 7u}) {
            if (threads == 7 && set != supported_instruction_sets().front()) continue;
            churn<3, float>(kind, ++seed, 700, set, threads);
            churn<2, float>(kind, ++seed, 400, set, threads);
            churn<3, double>(kind, ++seed, 400, set, threads);
            churn<2, double>(kind, ++seed, 300, set, threads);
        }
    churn<3, float>(kind, ++seed, 6000, supported_instruction_sets().front(), 2);
}
INSTANTIATE_TEST_SUITE_P(Scenes, Questions, ::testing::Range(0, static_cast<int>(Kind::last) + 1),
                         [](const auto& each) {
                             return std::string(twin::name(static_cast<Kind>(each.param)));
                         });

} // namespace
