// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "jostle/find_pairs.hpp"

namespace tool_test {

inline std::string read_file(const std::filesystem::path& path)
{
    std::ifstream file(path, std::ios::binary);
    EXPECT_TRUE(file) << path;
    return {std::istreambuf_iterator<char>(file), {}};
}

struct Result
{
    int exit_code = -1; ///< 1000 + the signal if one ended it
    std::string out, err;
    long peak_kb = 0; ///< the most memory that it, or a process that it waited for, had at a time
};

/// A folder of its own for each test, where the command runs and files have short names.
class ToolTest : public testing::Test
{
  protected:
    ToolTest()
    {
        std::string name = (std::filesystem::temp_directory_path() / "jostle-tool-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("mkdtemp failed");
        folder = name;
    }
    ~ToolTest() override
    {
        std::error_code ignored;
        std::filesystem::remove_all(folder, ignored);
    }

    void write(const std::string& name, const std::string& bytes) const
    {
        std::ofstream file(folder / name, std::ios::binary);
        file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
        ASSERT_TRUE(file.flush()) << name;
    }
    [[nodiscard]] std::string read(const std::string& name) const { return read_file(folder / name); }
    [[nodiscard]] bool exists(const std::string& name) const
    {
        return std::filesystem::exists(folder / name);
    }
    /// The names of all files in the folder, sorted; what run() itself needs lies elsewhere.
    [[nodiscard]] std::vector<std::string> files() const
    {
        std::vector<std::string> names;
        for (const auto& entry : std::filesystem::directory_iterator(folder))
            names.push_back(entry.path().filename().string());
        std::sort(names.begin(), names.end());
        return names;
    }

    /// Starts `jostle` with these arguments; `input` is its stdin.
    struct Running
    {
        pid_t pid;
        int input, out, err; // files, so that nothing waits for a reader
    };
    [[nodiscard]] Running start(const std::vector<std::string>& arguments, const std::string& input = "",
                                rlim_t largest_file = RLIM_INFINITY, rlim_t cpu_seconds = 60,
                                const char* program = JOSTLE_TOOL_PATH) const
    {
        const Running running{-1, temporary(), temporary(), temporary()};
        if (::write(running.input, input.data(), input.size()) != static_cast<ssize_t>(input.size()))
            throw std::runtime_error("can't write the input");
        lseek(running.input, 0, SEEK_SET);
        std::vector<char*> argv{const_cast<char*>("jostle")};
        for (const std::string& argument : arguments)
            argv.push_back(const_cast<char*>(argument.c_str()));
        argv.push_back(nullptr);
        const pid_t pid = fork();
        if (pid == 0) {
            dup2(running.input, STDIN_FILENO);
            dup2(running.out, STDOUT_FILENO);
            dup2(running.err, STDERR_FILENO);
            const rlimit file_size{largest_file, largest_file}, seconds{cpu_seconds, cpu_seconds};
            setrlimit(RLIMIT_FSIZE, &file_size);
            setrlimit(RLIMIT_CPU, &seconds); // a test that hangs ends
            const rlimit no_core{0, 0};
            setrlimit(RLIMIT_CORE, &no_core); // which would lie in the folder
            if (chdir(folder.c_str()) != 0) _exit(126);
            execv(program, argv.data());
            _exit(127);
        }
        return {pid, running.input, running.out, running.err};
    }
    static Result wait(const Running& running)
    {
        int status = 0;
        rusage usage{};
        while (wait4(running.pid, &status, 0, &usage) < 0 && errno == EINTR)
            ;
        Result result{WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status), take(running.out),
                      take(running.err), usage.ru_maxrss};
        close(running.input);
        return result;
    }
    [[nodiscard]] Result run(const std::vector<std::string>& arguments, const std::string& input = "") const
    {
        return wait(start(arguments, input));
    }

    /// Runs a script of bash's, in which `jostle` is the command.
    [[nodiscard]] Result shell(const std::string& script) const
    {
        return wait(start({"-c", "jostle() { '" JOSTLE_TOOL_PATH "' \"$@\"; }\n" + script}, "", RLIM_INFINITY,
                          60, "/bin/bash"));
    }

    std::filesystem::path folder;

  private:
    static int temporary()
    {
        std::string name = (std::filesystem::temp_directory_path() / "jostle-stream-XXXXXX").string();
        const int fd = mkostemp(name.data(), O_CLOEXEC);
        if (fd < 0) throw std::runtime_error("mkostemp failed");
        unlink(name.c_str());
        return fd;
    }
    static std::string take(int fd)
    {
        std::string text;
        char buffer[65536];
        lseek(fd, 0, SEEK_SET);
        for (ssize_t got; (got = ::read(fd, buffer, sizeof buffer)) > 0;)
            text.append(buffer, static_cast<std::size_t>(got));
        close(fd);
        return text;
    }
};

/// Boxes of mixed sizes on a lattice, so that many touch exactly, with a few unbounded ones.
template <int Dim, class T>
std::vector<jostle::Aabb<Dim, T>> lattice_boxes(std::uint64_t seed, std::size_t count)
{
    std::uint64_t state = seed;
    const auto below = [&state](std::uint64_t n) { // xorshift64*; the same everywhere
        state ^= state >> 12;
        state ^= state << 25;
        state ^= state >> 27;
        return (state * 0x2545f4914f6cdd1d >> 33) % n;
    };
    state += 0x9e3779b97f4a7c15;
    std::vector<jostle::Aabb<Dim, T>> boxes(count);
    for (auto& box : boxes) {
        const std::uint64_t largest = below(16) == 0 ? 12 : 3;
        for (int d = 0; d < Dim; ++d) {
            box.lo[d] = static_cast<T>(static_cast<double>(below(160)) / 8 - 10);
            box.hi[d] = box.lo[d] + static_cast<T>(static_cast<double>(below(8 * largest)) / 8);
        }
        if (below(100) == 0) box.hi[below(Dim)] = std::numeric_limits<T>::infinity();
        if (below(100) == 0) box.lo[below(Dim)] = -std::numeric_limits<T>::infinity();
    }
    return boxes;
}

/// As numpy.save writes it. `values` in the order of the file.
template <class T>
std::string npy(const std::vector<T>& values, const std::string& descr, bool fortran_order,
                const std::string& shape, int version = 1)
{
    std::string header = "{'descr': '" + descr + "', 'fortran_order': " + (fortran_order ? "True" : "False") +
                         ", 'shape': " + shape + ", }";
    const std::size_t before = version == 1 ? 10 : 12;
    header.resize((header.size() + before + 64) / 64 * 64 - before - 1, ' ');
    header += '\n';
    std::string file = "\x93NUMPY";
    file += static_cast<char>(version);
    file += '\0';
    for (std::size_t i = 0; i < before - 8; ++i)
        file += static_cast<char>(header.size() >> (8 * i) & 0xff);
    file += header;
    for (T value : values) {
        char bytes[sizeof value];
        std::memcpy(bytes, &value, sizeof value);
        if (descr[0] == '>')
            std::reverse(bytes, bytes + sizeof bytes); // the tests run on little-endian machines
        file.append(bytes, sizeof bytes);
    }
    return file;
}

/// The boxes' numbers in the order that NumPy's memory has them.
template <int Dim, class T>
std::vector<T> npy_values(const std::vector<jostle::Aabb<Dim, T>>& boxes, bool fortran_order, bool nested)
{
    std::vector<T> values;
    if (!fortran_order) {
        for (const auto& box : boxes) {
            values.insert(values.end(), box.lo.begin(), box.lo.end());
            values.insert(values.end(), box.hi.begin(), box.hi.end());
        }
    } else if (nested) { // a[i][side][axis]: i fastest, axis slowest
        for (int d = 0; d < Dim; ++d)
            for (const bool high : {false, true})
                for (const auto& box : boxes)
                    values.push_back(high ? box.hi[d] : box.lo[d]);
    } else {
        for (const bool high : {false, true})
            for (int d = 0; d < Dim; ++d)
                for (const auto& box : boxes)
                    values.push_back(high ? box.hi[d] : box.lo[d]);
    }
    return values;
}

} // namespace tool_test
