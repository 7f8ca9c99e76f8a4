// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
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
    std::size_t ghosts = 0; ///< so many at the end of `a`, where it is the only set
    std::vector<std::array<std::uint32_t, 3>> vertices{}; ///< of `a`, where it is the only set; or none
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
    if (std::min(a, b) + question.ghosts >= question.a.size() && !question.cross) return true;
    const Columns& of_a = question.columns_a;
    const Columns& of_b = question.cross ? question.columns_b : question.columns_a;
    if (!of_a.category.empty()) {
        if ((of_a.category[a] & of_b.mask[b]) == 0) return true;
        if ((of_b.category[b] & of_a.mask[a]) == 0) return true;
    }
    if (!of_a.owner.empty() && of_a.owner[a] == of_b.owner[b] && of_a.owner[a] != 0xffffffffu) return true;
    if (!question.cross && !question.vertices.empty())
        for (const std::uint32_t vertex : question.vertices[a])
            if (vertex != 0xffffffffu &&
                std::count(question.vertices[b].begin(), question.vertices[b].end(), vertex) > 0)
                return true;
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

/// Boxes as points of 2 * Dim numbers, their bounds, in a balanced tree that is split at the median of the
/// bound that differs most. Boxes of all sizes separate, since a large box has another upper bound than the
/// small ones it holds. Nothing is computed with the bounds but which of them to split by, so that no answer
/// can depend on rounding.
template <int Dim, class T>
class BoundsTree
{
  public:
    explicit BoundsTree(const Boxes<Dim, T>& boxes) : boxes_(boxes), order_(boxes.size())
    {
        std::iota(order_.begin(), order_.end(), 0u);
        if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
    }
    /// The boxes in an order in which neighbours lie close together.
    const std::vector<std::uint32_t>& order() const { return order_; }

    /// Calls visit(i) for each box i that isn't apart from `box`.
    template <class Visit>
    void each_touching(const Aabb<Dim, T>& box, const Visit& visit, std::uint32_t at = 0) const
    {
        if (nodes_.empty() || apart(nodes_[at].around, box)) return;
        const Node& node = nodes_[at];
        if (node.second_child != 0) {
            each_touching(box, visit, at + 1);
            each_touching(box, visit, node.second_child);
            return;
        }
        for (std::uint32_t k = node.first; k < node.last; ++k)
            if (!apart(boxes_[order_[k]], box)) visit(order_[k]);
    }

  private:
    struct Node
    {
        Aabb<Dim, T> around;
        std::uint32_t first, last;
        std::uint32_t second_child = 0; // the first one is the next node; 0: a leaf
    };
    static T bound(const Aabb<Dim, T>& box, int which)
    {
        return which < Dim ? box.lo[which] : box.hi[which - Dim];
    }

    void build(std::uint32_t first, std::uint32_t last)
    {
        const std::size_t at = nodes_.size();
        nodes_.push_back({boxes_[order_[first]], first, last});
        double widest = -1;
        int split_by = 0;
        for (int which = 0; which < 2 * Dim; ++which) {
            const auto [least, greatest] =
                std::minmax_element(order_.begin() + first, order_.begin() + last, before(which));
            const T low = bound(boxes_[*least], which), high = bound(boxes_[*greatest], which);
            (which < Dim ? nodes_[at].around.lo[which] : nodes_[at].around.hi[which - Dim]) =
                which < Dim ? low : high;
            const double width = within_1e300(high) - within_1e300(low);
            if (width > widest) widest = width, split_by = which;
        }
        if (last - first <= 8) return;
        const std::uint32_t middle = first + (last - first) / 2;
        std::nth_element(order_.begin() + first, order_.begin() + middle, order_.begin() + last,
                         before(split_by));
        build(first, middle);
        nodes_[at].second_child = static_cast<std::uint32_t>(nodes_.size());
        build(middle, last);
    }
    auto before(int which) const
    {
        return [this, which](std::uint32_t i, std::uint32_t j) {
            return bound(boxes_[i], which) < bound(boxes_[j], which);
        };
    }
    static double within_1e300(T value) { return std::clamp(static_cast<double>(value), -1e300, 1e300); }

    const Boxes<Dim, T>& boxes_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

/// The same answer as oracle(), near-linear in boxes and pairs: for scenes that are too large for the
/// definition.
template <int Dim, class T>
std::vector<Pair> large_oracle(const Question<Dim, T>& question)
{
    std::vector<Pair> pairs;
    const BoundsTree<Dim, T> tree(question.a);
    const auto ask_for = [&](std::uint32_t b, const Aabb<Dim, T>& box) {
        tree.each_touching(box, [&](std::uint32_t a) {
            if ((question.cross || a < b) && !forbidden(question, a, b)) pairs.push_back({a, b});
        });
    };
    if (question.cross)
        for (std::uint32_t b = 0; b < question.b.size(); ++b)
            ask_for(b, question.b[b]);
    else
        for (const std::uint32_t b : tree.order())
            ask_for(b, question.a[b]);
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

} // namespace contract
