// SPDX-License-Identifier: MIT
// Errors, blocks and recordings of the C interface.
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "jostle/recorder.hpp"
#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

using CBlocks = CTwin;

TEST_F(CBlocks, AreCopiedAndSummedUpOneAfterAnother)
{
    const Pairs pairs{{0, 1}, {0, 2}, {3, 4}, {5, 6}, {1, 9}};
    const jostle_block pieces[] = {{pairs.data(), 2}, {nullptr, 0}, {&pairs[2], 1}, {&pairs[3], 2}};
    const jostle_blocks blocks{pieces, 4, 5, sizeof(jostle_pair)};
    Pairs copied(5);
    OK(jostle_blocks_copy(&blocks, 5, copied.data(), &error));
    EXPECT_EQ(copied, pairs);
    std::uint64_t sum = 0;
    OK(jostle_pair_checksum(&blocks, &sum, &error));
    EXPECT_EQ(sum, jostle::pair_checksum(pairs));
}

using CErrors = CTwin;

TEST_F(CErrors, MessagesEndWhereACharacterDoes)
{
    for (const std::size_t before : {0u, 1u}) {
        const std::string path = "no such folder/" + std::string(before, 'x') + [] {
            std::string name;
            for (int i = 0; i < 400; ++i)
                name += "\xc3\xa4";
            return name;
        }();
        jostle_recorder* recorder = nullptr;
        EXPECT_EQ(jostle_recorder_new(JOSTLE_3F, path.c_str(), 0, nullptr, &recorder, &error),
                  JOSTLE_FILE_ERROR);
        const std::string message = error.message;
        EXPECT_TRUE(path.starts_with(message)) << message;
        EXPECT_GE(message.size(), sizeof error.message - 2);
        EXPECT_EQ((message.size() - 15 - before) % 2, 0u) << message;
    }
    // What the call before said is gone.
    OK(jostle_free(nullptr, &error));
    EXPECT_EQ(error.index, UINT64_MAX);
    EXPECT_EQ(error.callback_result, 0);
    EXPECT_STREQ(error.message, "");
}

using CRecorder = CTwin;

TEST_F(CRecorder, WritesTheFileThatCppWrites)
{
    const std::string folder = testing::TempDir() + "/jostle-c-twin-" +
                               std::to_string(testing::UnitTest::GetInstance()->random_seed());
    std::filesystem::create_directories(folder);
    Random random(9);
    const std::vector<Aabb3f> first = random_boxes(random, 20), second = random_boxes(random, 30);
    const jostle_boxes one = view(first), two = view(second);
    {
        jostle_recorder* recorder = nullptr;
        OK(jostle_recorder_new(JOSTLE_3F, (folder + "/c.jrec").c_str(), 59.5, "where from", &recorder,
                               &error));
        OK(jostle_recorder_frame(recorder, &one, &error));
        OK(jostle_recorder_frame(recorder, &two, &error));
        OK(jostle_free(recorder, &error));
        jostle::Recorder<3, float> twin(folder + "/cpp.jrec", 59.5, "where from");
        ASSERT_TRUE(twin.frame(first));
        ASSERT_TRUE(twin.frame(second));
        ASSERT_TRUE(twin.close());
    }
    const auto read = [&](const char* name) {
        std::ifstream file(folder + name, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(file), {});
    };
    EXPECT_EQ(read("/c.jrec"), read("/cpp.jrec"));
    EXPECT_GT(read("/c.jrec").size(), 50u * 24);
    std::filesystem::remove_all(folder);
}

} // namespace
} // namespace c_twin
