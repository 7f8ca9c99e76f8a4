// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"

namespace chapter_test {

/// Numbers that are the same everywhere: mt19937_64 is fixed by the standard, its distributions aren't.
class Random
{
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform(double low, double high)
    {
        return low + (high - low) * static_cast<double>(engine_() >> 11) * 0x1p-53;
    }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }

  private:
    std::mt19937_64 engine_;
};

template <int Dim, class T>
using Boxes = std::vector<jostle::Aabb<Dim, T>>;

/// A box with its min corner in [low, high) and edges of `size` times 0.5 to 1.
template <int Dim, class T>
jostle::Aabb<Dim, T> random_box(Random& random, double low, double high, double size)
{
    jostle::Aabb<Dim, T> box;
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] = static_cast<T>(random.uniform(low, high));
        box.hi[d] = box.lo[d] + static_cast<T>(random.uniform(0.5, 1) * size);
    }
    return box;
}

/// n boxes of sizes 1 to `ratio`, as many of one octave as of another, around the origin.
template <int Dim, class T>
Boxes<Dim, T> mixed_sizes(std::uint32_t n, double ratio, double half_extent, std::uint64_t seed)
{
    Random random(seed);
    Boxes<Dim, T> boxes;
    for (std::uint32_t i = 0; i < n; ++i)
        boxes.push_back(random_box<Dim, T>(random, -half_extent, half_extent,
                                           std::exp2(random.uniform(0, std::log2(ratio)))));
    return boxes;
}

/// The oracle's answer, ascending.
template <int Dim, class T>
std::vector<jostle::Pair> brute(const Boxes<Dim, T>& boxes)
{
    return jostle::find_pairs_brute_force(jostle::BoxView<Dim, T>(boxes));
}

/// Ascending, with pairs that came twice kept twice: a comparison with the oracle notices them.
template <class Pairs>
std::vector<jostle::Pair> sorted(const Pairs& pairs)
{
    std::vector<jostle::Pair> all(pairs.begin(), pairs.end());
    std::sort(all.begin(), all.end());
    return all;
}

template <int Dim, class T>
jostle::chapter::Grid<Dim, T> grid_of(const Boxes<Dim, T>& boxes, jostle::chapter::GridOptions<T> options)
{
    jostle::chapter::Grid<Dim, T> grid(std::move(options));
    for (const auto& box : boxes)
        grid.add(box);
    return grid;
}

} // namespace chapter_test
