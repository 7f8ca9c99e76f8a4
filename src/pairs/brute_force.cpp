// SPDX-License-Identifier: MIT
#include "base/checks.hpp"
#include "base/instantiate.hpp"
#include "jostle/find_pairs.hpp"
#include "pairs/filters.hpp"

JOSTLE_NAMESPACE_BEGIN

template <int Dim, Coordinate T>
std::vector<Pair> detail::brute_force(const BoxView<Dim, T>& boxes, const Filter& filter)
{
    check_boxes(boxes);
    check_filter(filter, boxes.size());
    std::vector<Pair> pairs;
    for (std::uint32_t a = 0; a < boxes.size() - filter.ghosts; ++a)
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
            if (overlaps(boxes[a], boxes[b]) && passes(filter, a, b) &&
                (!filter.accept || filter.accept(a, b)))
                pairs.push_back({a, b});
    return pairs;
}

template <int Dim, Coordinate T>
std::vector<Pair> detail::brute_force(const BoxView<Dim, T>& boxes_a, const BoxView<Dim, T>& boxes_b,
                                      const CrossFilter& filter)
{
    check_boxes_of(boxes_a, "a ");
    check_boxes_of(boxes_b, "b ");
    check_filter(filter, boxes_a.size(), boxes_b.size());
    std::vector<Pair> pairs;
    for (std::uint32_t a = 0; a < boxes_a.size(); ++a)
        for (std::uint32_t b = 0; b < boxes_b.size(); ++b)
            if (overlaps(boxes_a[a], boxes_b[b]) && passes(filter, a, b) &&
                (!filter.accept || filter.accept(a, b)))
                pairs.push_back({a, b});
    return pairs;
}

// JOSTLE_API again: g++ hides a function with a template argument that has none, as BoxView.
#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API std::vector<Pair> detail::brute_force(const BoxView<Dim, T>&, const Filter&);        \
    template JOSTLE_API std::vector<Pair> detail::brute_force(const BoxView<Dim, T>&,                        \
                                                              const BoxView<Dim, T>&, const CrossFilter&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
