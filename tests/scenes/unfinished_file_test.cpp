// SPDX-License-Identifier: MIT
#include "scenes/unfinished_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <list>
#include <stdexcept>
#include <string>
#include <system_error>

using jostle_scenes::UnfinishedFile;
namespace fs = std::filesystem;

namespace {

class UnfinishedFiles : public testing::Test
{
  protected:
    UnfinishedFiles()
    {
        std::string name = (fs::temp_directory_path() / "jostle-unfinished-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
        folder = name;
    }
    ~UnfinishedFiles() override { fs::remove_all(folder); }

    std::string text(const std::string& name) const
    {
        std::ifstream file(folder / name, std::ios::binary);
        return {std::istreambuf_iterator<char>(file), {}};
    }
    std::size_t files() const
    {
        return static_cast<std::size_t>(
            std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
    }
    fs::path folder;
};

TEST_F(UnfinishedFiles, TakeTheirNameWhenTheyAreComplete)
{
    {
        UnfinishedFile file(folder / "a");
        file.write("header body");
        EXPECT_FALSE(fs::exists(folder / "a"));
        EXPECT_EQ(files(), 1u);
        file.write_over_start("HEAD");
        file.write(" end");
        file.commit();
        EXPECT_EQ(text("a"), "HEADer body end");
    }
    EXPECT_EQ(files(), 1u);
    {
        UnfinishedFile file(folder / "a");
        file.write("other");
        EXPECT_EQ(text("a"), "HEADer body end");
    }
    EXPECT_EQ(text("a"), "HEADer body end");
    EXPECT_EQ(files(), 1u);
}

TEST_F(UnfinishedFiles, ThereAreSixteenAtATime)
{
    std::list<UnfinishedFile> all;
    for (int i = 0; i < 16; ++i)
        all.emplace_back(folder / std::to_string(i));
    EXPECT_THROW(UnfinishedFile(folder / "more"), std::system_error);
    EXPECT_THROW(UnfinishedFile(folder / "more"), std::system_error);
    all.pop_front();
    all.emplace_back(folder / "more").commit();
    EXPECT_THROW(UnfinishedFile(folder / "again"), std::system_error); // it still lives
    all.clear();
    EXPECT_EQ(files(), 1u);
    // One that can't be made takes no place.
    for (int i = 0; i < 20; ++i)
        EXPECT_THROW(UnfinishedFile(folder / "gone" / "a"), std::system_error);
    UnfinishedFile(folder / "again").commit();
    EXPECT_EQ(files(), 2u);
}

TEST_F(UnfinishedFiles, SayWhyTheyCantBeMade)
{
    const auto error_of = [&](const fs::path& path) {
        try {
            UnfinishedFile file(path);
            return 0;
        } catch (const std::system_error& error) {
            return error.code().value();
        }
    };
    EXPECT_EQ(error_of(folder), EISDIR);
    EXPECT_EQ(error_of("/dev/null"), ESPIPE);
    EXPECT_EQ(error_of(folder / std::string(5000, 'x')), ENAMETOOLONG);
    EXPECT_EQ(error_of(folder / "gone" / "a"), ENOENT);
    EXPECT_EQ(files(), 0u);
}

/// Asked by somebody whom permissions stop, as they don't stop root.
TEST_F(UnfinishedFiles, DontReplaceWhatMayNotBeWrittenTo)
{
    std::ofstream(folder / "kept") << "old";
    ASSERT_EQ(chmod((folder / "kept").c_str(), 0444), 0);
    const uid_t nobody = 65534;
    if (geteuid() == 0) {
        ASSERT_EQ(chown(folder.c_str(), nobody, nobody), 0);
        ASSERT_EQ(chown((folder / "kept").c_str(), nobody, nobody), 0);
    }
    const pid_t child = fork();
    if (child == 0) {
        if (geteuid() == 0 && (setgid(nobody) != 0 || setuid(nobody) != 0)) _exit(100);
        try {
            UnfinishedFile file(folder / "kept");
            file.write("new");
            file.commit();
        } catch (const std::system_error& error) {
            _exit(error.code().value() == EACCES ? 7 : 101);
        }
        _exit(0);
    }
    ASSERT_GT(child, 0);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 7) << status;
    EXPECT_EQ(text("kept"), "old");
    EXPECT_EQ(files(), 1u);
}

} // namespace
