// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

class JOSTLE_API PairFinderAccess
{
  public:
    /// Takes a run of pairs, moves the accepted ones to its front and returns their end. Called from
    /// several threads at a time.
    using Selection = FunctionRef<Pair*(Pair* first, Pair* last)>;
    /// PairFinder::find with a selection as the filter, and the caller's result. The selection may rewrite
    /// pairs. Valid boxes only.
    template <int Dim, Coordinate T>
    static void find(PairFinder& finder, const BoxView<Dim, T>& boxes, Selection select, PairBuffer& result);
    template <int Dim, Coordinate T>
    static void find(PairFinder& finder, const BoxView<Dim, T>& a, const BoxView<Dim, T>& b, Selection select,
                     PairBuffer& result);

    /// For tests: what happens beyond 2^27 objects, without needing that many.
    static void search_in_slices_of(PairFinder& finder, std::size_t objects);
};

JOSTLE_NAMESPACE_END
