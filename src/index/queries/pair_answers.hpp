// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <span>

#include "index/kernels/kernels.hpp"
#include "index/nodes/queue.hpp"
#include "index/queries/answers.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Visits pairs no further apart than the root of `limit`, the closest first: those at 0 as they are found,
/// then a few of the others, then four times as many, and so on, each time by a search with the visitor's
/// present bound. Returns false if the visitor stopped it.
template <int Dim, class T>
bool visit_closest(const Kernels<Dim, T>& kernels, std::span<const Roots<Dim, T>> roots, T limit,
                   PairHitVisitor<T> visit, Shelf<ClosestWork<Dim, T>>& shelf)
{
    constexpr std::size_t at_first = 16, at_most = std::size_t{1} << 16;
    bool goes_on = true;
    const auto hand_over = [&](const PairHit<T>& hit) {
        T wish = limit;
        goes_on = visit(hit, wish);
        shrink(limit, wish, hit.a);
        return goes_on && limit >= 0;
    };
    const auto at_zero = [&](std::uint32_t a, std::uint32_t b) { return hand_over({a, b, T(0)}); };
    if (!kernels.pairs_at_zero(roots, at_zero)) return goes_on;

    /// Given back also if something throws.
    struct Borrowed
    {
        Shelf<ClosestWork<Dim, T>>& from;
        std::unique_ptr<ClosestWork<Dim, T>> work = from.take();
        ~Borrowed() { from.give(std::move(work)); }
    };
    const Borrowed borrowed{shelf};
    ClosestWork<Dim, T>& work = *borrowed.work;
    PairHit<T> after; // those at 0
    for (std::size_t count = at_first; limit > 0; count = std::min(4 * count, at_most)) {
        kernels.closest(roots, {count, limit, after}, work);
        for (std::size_t k = 0; k < work.found; ++k) {
            after = work.best[k];
            if (after.at > limit) return true;
            if (!hand_over(after)) return goes_on;
        }
        if (work.found < count) return true;
    }
    return true;
}

} // namespace index
JOSTLE_NAMESPACE_END
