// SPDX-License-Identifier: MIT
#include "target.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdio>
#include <exception>

namespace fuzz {
namespace {

const Target* running = nullptr;
std::span<const std::uint8_t> input;
bool telling_now = false;

struct Counts
{
    std::uint64_t executions, boxes;
};

/// In the file that JOSTLE_FUZZ_COUNTS names, if any: they are there however the program ends.
Counts& counts()
{
    static Counts* const counts = [] {
        static Counts own{};
        const char* const name = std::getenv("JOSTLE_FUZZ_COUNTS");
        if (name == nullptr) return &own;
        const int fd = open(name, O_RDWR | O_CREAT | O_CLOEXEC, 0644);
        void* const memory = fd >= 0 && ftruncate(fd, sizeof(Counts)) == 0
                                 ? mmap(nullptr, sizeof(Counts), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)
                                 : MAP_FAILED;
        if (memory == MAP_FAILED) {
            std::perror(name);
            std::exit(2);
        }
        close(fd);
        return static_cast<Counts*>(memory);
    }();
    return *counts;
}

} // namespace

std::vector<Target>& targets()
{
    static std::vector<Target> all;
    return all;
}

void count_boxes(std::uint64_t boxes)
{
    counts().boxes += boxes;
}

bool telling()
{
    return telling_now;
}

void tell(const std::string& line)
{
    std::fprintf(stderr, "    %s\n", line.c_str());
}

void fail(const std::string& what)
{
    if (!telling_now) { // the same again, which ends here with the line below
        telling_now = true;
        std::fprintf(stderr, "The input, for the target %s:\n", running->name);
        Input again(input);
        running->run(again);
    }
    std::fprintf(stderr, "FOUND by the target %s: %s\n", running->name, what.c_str());
    std::abort();
}

void execute(const Target& target, std::span<const std::uint8_t> bytes)
{
    running = &target;
    input = bytes;
    telling_now = std::getenv("JOSTLE_FUZZ_TELL") != nullptr;
    ++counts().executions;
    try {
        Input in(bytes);
        target.run(in);
    } catch (const std::exception& error) {
        fail(std::string("an exception that isn't documented: ") + error.what());
    }
}

} // namespace fuzz

/// What the tests' slow twins find ends the run as well.
extern "C" int LLVMFuzzerInitialize(int*, char***)
{
    GTEST_FLAG_SET(throw_on_failure, true);
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    fuzz::execute(fuzz::targets().front(), {data, size});
    return 0;
}
