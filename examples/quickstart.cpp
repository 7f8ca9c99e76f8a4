// SPDX-License-Identifier: MIT
#include <jostle/jostle.hpp>

#include <cstdio>
#include <vector>

int main()
{
    const std::vector<jostle::Aabb3f> boxes = {
        {{0, 0, 0}, {2, 2, 2}}, {{1, 1, 1}, {3, 3, 3}}, {{5, 0, 0}, {6, 1, 1}}, {{3, 3, 3}, {5, 5, 5}}};
    const jostle::PairBuffer pairs = jostle::find_pairs(boxes);
    for (jostle::Pair pair : pairs)
        std::printf("box %u touches box %u\n", pair.a, pair.b);
    return pairs.size() == 2 ? 0 : 1; // 0 and 1 overlap, 1 and 3 share a corner
}
