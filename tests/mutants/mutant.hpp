// SPDX-License-Identifier: MIT
// Included before anything else by every file of the mutated copy; nothing of it is in the library that
// ships.
#pragma once

#include <cstdlib>
#include <type_traits>

/// The number of the one mutant that is on, 0 for none. It is 0 before the program's variables are made, too.
inline const int jostle_mutant = std::getenv("JOSTLE_MUTANT") ? std::atoi(std::getenv("JOSTLE_MUTANT")) : 0;

#define JOSTLE_MUTANT(number) (!std::is_constant_evaluated() && jostle_mutant == (number))
