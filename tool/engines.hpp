// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/pair_buffer.hpp"

namespace jostle_tool {

/// Whose pairs: they are the same, found in different ways.
enum class Engine
{
    fast,    ///< find_pairs.hpp; "default"
    chapter, ///< the chapter's parallel hierarchical grid
    brute    ///< every box against every other, on all threads
};

/// The option --engine, the same in all commands.
inline void add_engine_option(CLI::App& command, Engine& engine)
{
    const auto choose = [&engine](const std::string& name) {
        if (name == "default")
            engine = Engine::fast;
        else if (name == "chapter")
            engine = Engine::chapter;
        else if (name == "brute")
            engine = Engine::brute;
        else
            throw CLI::ValidationError("--engine", name + " is not known; choose default, chapter or brute");
    };
    command
        .add_option_function<std::string>("--engine", choose,
                                          "What finds the pairs: default, chapter (the chapter's parallel "
                                          "hierarchical grid) or brute (every box against every other)")
        ->type_name("ENGINE");
}

/// All pairs by the definition (jostle::find_pairs_brute_force), the work cut into blocks for the executor.
/// Ascending by (a, b). Shows its progress. Errors as there.
template <int Dim, jostle::Coordinate T>
[[nodiscard]] std::vector<jostle::Pair> find_pairs_brute(const jostle::BoxView<Dim, T>& boxes,
                                                         jostle::Executor& executor);

} // namespace jostle_tool
