// SPDX-License-Identifier: MIT
// Linked with jostle::chapter alone.
#include <jostle/chapter.hpp>

#include <vector>

int main()
{
    const std::vector<jostle::Aabb2f> boxes = {{{0, 0}, {1, 1}}, {{1, 0}, {2, 1}}, {{3, 0}, {4, 1}}};
    return jostle::chapter::find_pairs(jostle::BoxView<2, float>(boxes)).size() == 1 ? 0 : 1;
}
