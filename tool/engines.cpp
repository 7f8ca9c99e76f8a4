// SPDX-License-Identifier: MIT
#include "engines.hpp"

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>

#include "options.hpp"
#include "progress.hpp"

namespace jostle_tool {

void add_engine_option(const Command& command, Engine& engine)
{
    const auto choose = [&engine](const std::string& name) {
        if (name == "default")
            engine = Engine::fast;
        else if (name == "chapter")
            engine = Engine::chapter;
        else if (name == "brute")
            engine = Engine::brute;
        else
            refuse("--engine", name + " is not known; choose default, chapter or brute");
    };
    command.choice(
        "--engine", choose, "ENGINE",
        "What finds the pairs: default, chapter (the chapter's parallel hierarchical grid) or brute "
        "(every box against every other)");
}

void add_isa_option(const Command& command, jostle::InstructionSet& set, const std::string& help)
{
    const auto choose = [&set](const std::string& name) {
        std::string known;
        for (const jostle::InstructionSet supported : jostle::supported_instruction_sets()) {
            if (name == jostle::name(supported)) {
                set = supported;
                return;
            }
            known += (known.empty() ? "" : ", ") + std::string(jostle::name(supported));
        }
        refuse("--isa", name + " is not on this machine; choose from " + known);
    };
    command.choice("--isa", choose, "NAME", help);
}

template <int Dim, jostle::Coordinate T>
std::vector<jostle::Pair> find_pairs_brute(const jostle::BoxView<Dim, T>& boxes, jostle::Executor& executor)
{
    jostle::check_boxes(boxes);
    // A block of rows against itself and against all that follows: small enough to share out evenly.
    constexpr std::size_t rows = 256;
    const std::size_t blocks = (boxes.size() + rows - 1) / rows;
    std::vector<std::vector<jostle::Pair>> found(blocks);
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure; // an executor's tasks must not throw
    Progress progress("every box against every other", boxes.size() * boxes.size() / 2);
    executor.run(executor.concurrency(), [&](std::uint32_t) {
        try {
            for (std::size_t block; (block = next.fetch_add(1, std::memory_order_relaxed)) < blocks;) {
                const std::size_t first = block * rows, count = std::min(rows, boxes.size() - first);
                const std::size_t after = first + count;
                const auto mine = boxes.subview(first, count);
                std::vector<jostle::Pair>& pairs = found[block];
                pairs = jostle::find_pairs_brute_force(mine);
                const std::size_t among = pairs.size();
                for (jostle::Pair& pair : pairs)
                    pair.b += static_cast<std::uint32_t>(first);
                for (std::size_t to = after; to < boxes.size(); to += rows * rows) {
                    const std::size_t others = std::min(rows * rows, boxes.size() - to);
                    for (const jostle::Pair& pair :
                         jostle::find_pairs_brute_force(mine, boxes.subview(to, others)))
                        pairs.push_back({pair.a, pair.b + static_cast<std::uint32_t>(to)});
                    progress.step(count * others);
                }
                for (jostle::Pair& pair : pairs)
                    pair.a += static_cast<std::uint32_t>(first);
                if (among != pairs.size()) std::sort(pairs.begin(), pairs.end());
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            failure = std::current_exception();
            next = blocks;
        }
    });
    if (failure) std::rethrow_exception(failure);
    std::vector<jostle::Pair> all;
    std::size_t total = 0;
    for (const auto& pairs : found)
        total += pairs.size();
    all.reserve(total);
    for (auto& pairs : found) {
        all.insert(all.end(), pairs.begin(), pairs.end());
        std::vector<jostle::Pair>().swap(pairs);
    }
    return all;
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template std::vector<jostle::Pair> find_pairs_brute(const jostle::BoxView<Dim, T>&, jostle::Executor&);
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

} // namespace jostle_tool
