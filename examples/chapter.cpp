// SPDX-License-Identifier: MIT
// The thesis chapter in one program: objects in a hierarchical hash grid (Alg. 6 to 10), collisions tested by
// all threads (Alg. 11), responses kept per processor and merged (Alg. 15 and 16). Then today's engine on the
// same boxes.
// Usage: chapter [OBJECTS]
#include <jostle/chapter.hpp>
#include <jostle/jostle.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

int main(int count, char** arguments)
{
    namespace chapter = jostle::chapter;
    const auto objects =
        static_cast<std::uint32_t>(count > 1 ? std::max(1, std::atoi(arguments[1])) : 20'000);
    std::mt19937 random(1);
    const auto uniform = [&](float least, float most) {
        return least + (most - least) * static_cast<float>(random() >> 8) * 0x1p-24f;
    };
    const float world = 2 * std::cbrt(static_cast<float>(objects));
    std::vector<jostle::Aabb3f> boxes(objects);
    for (jostle::Aabb3f& box : boxes) {
        const float edge = uniform(0, 1) < 0.01f ? uniform(2, 8) : uniform(0.5f, 1);
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = uniform(-world / 2, world / 2);
            box.hi[d] = box.lo[d] + edge;
        }
    }
    const auto begin = std::chrono::steady_clock::now();
    const auto ms = [&] {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    };

    jostle::Executor& executor = jostle::default_executor();
    chapter::Grid<3, float> grid({.cell_sizes = {1, 2, 4, 8}, .buckets = objects});
    // Alg. 6: the level whose cells hold it, the cell of its lower corner, a bucket by hash.
    for (const jostle::Aabb3f& box : boxes)
        grid.add(box);
    chapter::DenseResponses<int> responses(objects, executor.concurrency());
    grid.process_collision_detection(executor, [&](std::uint32_t processor, const jostle::Pair& pair) {
        responses.add(processor, pair.a, pair.b, 1); // no lock: each processor has a row of its own
        responses.add(processor, pair.b, pair.a, 1);
    });
    const auto collisions = responses.merge(executor);
    const double ms_grid = ms();
    std::printf("the chapter: %zu pairs, %.1f cells probed and %.1f boxes compared per object, in %.2f ms\n",
                grid.close_pairs().size(), static_cast<double>(grid.stats().cells) / objects,
                static_cast<double>(grid.stats().tests) / objects, ms_grid);
    std::printf("the busiest object has %d collisions\n",
                *std::max_element(collisions.begin(), collisions.end()));

    jostle::PairFinder finder;
    const std::size_t pairs = finder.find(boxes).size();
    std::printf("the engine: %zu pairs in %.2f ms\n", pairs, finder.stats().ms_total);
    return pairs == grid.close_pairs().size() ? 0 : 1;
}
