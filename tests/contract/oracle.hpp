// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/pair_buffer.hpp"
#include "scenes_for_tests.hpp"

/// What the library answers to, written again in the opposite form: boxes that are *not* apart, filters that
/// do *not* forbid. Nothing of the library is used but the types, so that a shared mistake is unlikely.
namespace contract {

using jostle::Pair;

template <int Dim, class T>
bool apart(const Aabb<Dim, T>& a, const Aabb<Dim, T>& b)
{
    for (int d = 0; d < Dim; ++d)
        if (a.hi[d] < b.lo[d] || b.hi[d] < a.lo[d]) return true;
    return false;
}

/// The filter columns of one set; an empty one doesn't filter.
struct Columns
{
    std::vector<std::uint32_t> category{}, mask{}, owner{};
};

/// One question to a finder: the pairs within `a`, or, if `cross`, between `a` and `b`.
template <int Dim, class T>
struct Question
{
    Boxes<Dim, T> a{}, b{};
    bool cross = false;
    Columns columns_a{}, columns_b{};
    std::uint64_t accept_salt = 0; ///< not 0: the callback refuses a quarter of all pairs, picked by this
};

/// Does the callback take the pair?
inline bool accepts(std::uint64_t salt, std::uint32_t a, std::uint32_t b)
{
    return salt == 0 || Random(salt ^ (std::uint64_t{a} << 32 | b)).next() % 4 != 0;
}

template <int Dim, class T>
bool forbidden(const Question<Dim, T>& question, std::uint32_t a, std::uint32_t b)
{
    const Columns& of_a = question.columns_a;
    const Columns& of_b = question.cross ? question.columns_b : question.columns_a;
    if (!of_a.category.empty()) {
        if ((of_a.category[a] & of_b.mask[b]) == 0) return true;
        if ((of_b.category[b] & of_a.mask[a]) == 0) return true;
    }
    if (!of_a.owner.empty() && of_a.owner[a] == of_b.owner[b] && of_a.owner[a] != 0xffffffffu) return true;
    return !accepts(question.accept_salt, a, b);
}

/// The answer, ascending by (a, b): every box against every other.
template <int Dim, class T>
std::vector<Pair> oracle(const Question<Dim, T>& question)
{
    std::vector<Pair> pairs;
    const Boxes<Dim, T>& second = question.cross ? question.b : question.a;
    for (std::uint32_t a = 0; a < question.a.size(); ++a)
        for (std::uint32_t b = question.cross ? 0 : a + 1; b < second.size(); ++b)
            if (!apart(question.a[a], second[b]) && !forbidden(question, a, b)) pairs.push_back({a, b});
    return pairs;
}

/// The axis along which the fewest boxes meet.
template <int Dim, class T>
int best_sweep_axis(const Boxes<Dim, T>& boxes)
{
    int best = 0;
    std::uint64_t most_apart = 0;
    for (int d = 0; d < Dim; ++d) {
        std::vector<T> lows, highs;
        for (const Aabb<Dim, T>& box : boxes) {
            lows.push_back(box.lo[d]);
            highs.push_back(box.hi[d]);
        }
        std::sort(lows.begin(), lows.end());
        std::sort(highs.begin(), highs.end());
        std::uint64_t pairs_apart = 0;
        std::size_t ended = 0;
        for (const T low : lows) {
            while (ended < highs.size() && highs[ended] < low)
                ++ended;
            pairs_apart += ended;
        }
        if (pairs_apart > most_apart) {
            most_apart = pairs_apart;
            best = d;
        }
    }
    return best;
}

/// The same answer in O(n log n + pairs that meet along one axis), for scenes too large for the definition.
template <int Dim, class T>
std::vector<Pair> sweep_oracle(const Question<Dim, T>& question)
{
    Boxes<Dim, T> boxes = question.a;
    if (question.cross) boxes.insert(boxes.end(), question.b.begin(), question.b.end());
    const auto first_b = static_cast<std::uint32_t>(question.a.size());
    const int axis = best_sweep_axis(boxes);
    std::vector<std::uint32_t> by_low(boxes.size());
    std::iota(by_low.begin(), by_low.end(), 0u);
    std::sort(by_low.begin(), by_low.end(),
              [&](std::uint32_t i, std::uint32_t j) { return boxes[i].lo[axis] < boxes[j].lo[axis]; });
    std::vector<Pair> pairs;
    for (std::size_t i = 0; i < by_low.size(); ++i)
        for (std::size_t j = i + 1; j < by_low.size(); ++j) {
            if (boxes[by_low[i]].hi[axis] < boxes[by_low[j]].lo[axis]) break;
            std::uint32_t a = std::min(by_low[i], by_low[j]), b = std::max(by_low[i], by_low[j]);
            if (question.cross) {
                if (a >= first_b || b < first_b) continue;
                b -= first_b;
            }
            if (!apart(boxes[by_low[i]], boxes[by_low[j]]) && !forbidden(question, a, b))
                pairs.push_back({a, b});
        }
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

} // namespace contract
