// SPDX-License-Identifier: MIT
// Linked with jostle::contacts alone.
#include <jostle/contact.hpp>
#include <jostle/shape_query.hpp>

#include <cstdio>
#include <vector>

int main()
{
    const std::vector<jostle::Shape3> shapes = {jostle::Shape3::sphere(1), jostle::Shape3::box({1, 1, 1})};
    std::vector<jostle::Pose3d> poses(2);
    poses[1].position = {1.5, 0, 0};
    const std::vector<jostle::Pair> pairs = {{0, 1}};
    jostle::ContactFinder3d finder;
    const auto& contacts = finder.find({shapes, poses}, pairs);
    if (contacts.size() != 1) {
        std::fprintf(stderr, "%zu contacts; 1 expected\n", static_cast<std::size_t>(contacts.size()));
        return 1;
    }
    return 0;
}
