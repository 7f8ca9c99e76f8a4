// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"

namespace jostle_tool {

class Command;

/// Whose pairs: they are the same, found in different ways.
enum class Engine
{
    fast,    ///< find_pairs.hpp; "default"
    chapter, ///< the chapter's parallel hierarchical grid
    brute    ///< every box against every other, on all threads
};

/// The option --engine, the same in all commands.
void add_engine_option(const Command& command, Engine& engine);

/// The option --isa.
void add_isa_option(const Command& command, jostle::InstructionSet& set, const std::string& help);

/// All pairs by the definition (jostle::find_pairs_brute_force), the work cut into blocks for the executor.
/// Ascending by (a, b). Shows its progress. Errors as there.
template <int Dim, jostle::Coordinate T>
[[nodiscard]] std::vector<jostle::Pair> find_pairs_brute(const jostle::BoxView<Dim, T>& boxes,
                                                         jostle::Executor& executor);

} // namespace jostle_tool
