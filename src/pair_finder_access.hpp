// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// For tests: what happens beyond 2^27 objects, without needing so many.
class JOSTLE_API PairFinderAccess
{
  public:
    static void search_in_slices_of(PairFinder& finder, std::size_t objects);
};

JOSTLE_NAMESPACE_END
