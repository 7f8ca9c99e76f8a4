// SPDX-License-Identifier: MIT
// fuzz_random TARGET SECONDS [SEED]: runs a target on random bytes, which are structured input for most of
// them. Nothing watches what an input reaches, so that it needs no clang and runs at full speed.
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "target.hpp"
#include "tool/scenes/random.hpp"

int main(int argc, char** argv)
{
    const fuzz::Target* target = nullptr;
    for (const fuzz::Target& each : fuzz::targets())
        if (argc >= 3 && std::string_view(each.name) == argv[1]) target = &each;
    if (target == nullptr) {
        std::fputs("fuzz_random TARGET SECONDS [SEED]; targets:", stderr);
        for (const fuzz::Target& each : fuzz::targets())
            std::fprintf(stderr, " %s", each.name);
        std::fputs("\n", stderr);
        return 2;
    }
    using Clock = std::chrono::steady_clock;
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double>(std::atof(argv[2])));
    jostle_scenes::Random random(argc > 3 ? std::strtoull(argv[3], nullptr, 10) : 1);
    std::vector<std::uint8_t> bytes;
    std::uint64_t executions = 0;
    do {
        bytes.resize(random.below(257));
        for (std::uint8_t& byte : bytes)
            byte = static_cast<std::uint8_t>(random.next() >> 32);
        fuzz::execute(*target, bytes);
        ++executions;
    } while (Clock::now() < end);
    std::printf("%s: %llu executions\n", target->name, static_cast<unsigned long long>(executions));
}
