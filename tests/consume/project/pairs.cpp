// SPDX-License-Identifier: MIT
// Linked with jostle::pairs alone.
#include <jostle/find_pairs.hpp>
#include <jostle/periodic.hpp>
#include <jostle/process.hpp>
#include <jostle/responses.hpp>

#include <cstdint>
#include <cstdio>
#include <span>
#include <vector>

int main()
{
    std::vector<jostle::Aabb3f> boxes; // a row in which each touches the next
    for (int i = 0; i < 100; ++i)
        boxes.push_back({{float(i), 0, 0}, {float(i + 1), 1, 1}});
    jostle::PairFinder finder;
    const jostle::PairBuffer& pairs = finder.find(boxes);
    jostle::Responses<double> touches;
    touches.start(100, jostle::plan_work(pairs.size()));
    jostle::process_pairs(pairs, [&](const jostle::Pair& pair, jostle::Work work) {
        touches.add(work, pair.a, 1);
        touches.add(work, pair.b, 1);
    });
    double sum = 0;
    touches.merge([&](std::uint32_t, std::span<const double> values) {
        for (const double value : values)
            sum += value;
    });
    if (pairs.size() != 99 || sum != 198) {
        std::fprintf(stderr, "%zu pairs and %g touches; 99 and 198 expected\n", pairs.size(), sum);
        return 1;
    }
    return 0;
}
