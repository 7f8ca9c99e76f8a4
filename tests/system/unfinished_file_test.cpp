// SPDX-License-Identifier: MIT
#include "tool/system/unfinished_file.hpp"

#include <gtest/gtest.h>
#ifndef _WIN32
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

#include <cerrno>
#include <fstream>
#include <iterator>
#include <list>
#include <string>
#include <system_error>

#include "temporary_folder.hpp"
#include "tool/system/system.hpp"

using jostle_system::UnfinishedFile;
namespace fs = std::filesystem;

namespace {

class UnfinishedFiles : public testing::Test
{
  protected:
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
    TemporaryFolder temporary;
    const fs::path& folder = temporary.path();
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

#ifndef _WIN32 // which needs no list of them, as the system removes them itself
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
#endif

TEST_F(UnfinishedFiles, HaveNamesInAnyLetters)
{
    const fs::path name = folder / jostle_system::path_of("K\xc3\xa4sten \xe2\x80\x93 \xe6\x9c\xa8.csv");
    for (const char* const bytes : {"one\r\n\x1atwo\n", "three"}) {
        UnfinishedFile file(name);
        file.write(bytes);
        file.commit();
        std::ifstream in(name, std::ios::binary);
        EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), bytes);
        EXPECT_EQ(files(), 1u);
    }
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
#ifdef _WIN32
    EXPECT_EQ(error_of("NUL"), ESPIPE);
    EXPECT_NE(error_of(folder / std::string(5000, 'x')), 0);
#else
    EXPECT_EQ(error_of("/dev/null"), ESPIPE);
    EXPECT_EQ(error_of(folder / std::string(5000, 'x')), ENAMETOOLONG);
#endif
    EXPECT_EQ(error_of(folder / "gone" / "a"), ENOENT);
    EXPECT_EQ(files(), 0u);
}

#ifdef _WIN32
TEST_F(UnfinishedFiles, DontReplaceWhatMayNotBeWrittenTo)
{
    std::ofstream(folder / "kept") << "old";
    fs::permissions(folder / "kept", fs::perms::owner_write, fs::perm_options::remove);
    try {
        UnfinishedFile file(folder / "kept");
        ADD_FAILURE() << "it would be replaced";
    } catch (const std::system_error& error) {
        EXPECT_EQ(error.code().value(), EACCES);
    }
    EXPECT_EQ(text("kept"), "old");
    EXPECT_EQ(files(), 1u);
    fs::permissions(folder / "kept", fs::perms::owner_write, fs::perm_options::add); // so that it can go
}
#else
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
#endif

} // namespace
