// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <type_traits>
#include <vector>

#include "jostle/box.hpp"

/// Small seeded scenes that try to break an engine. Same boxes from every compiler and standard library: only
/// operations that IEEE 754 rounds exactly are used, no std:: distributions.
namespace contract {

using jostle::Aabb;

/// splitmix64: Steele, Lea, Flood, Fast splittable pseudorandom number generators (2014).
class Random
{
  public:
    explicit Random(std::uint64_t seed) : state_(seed) {}
    std::uint64_t next()
    {
        std::uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    /// In [0, n).
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>((next() >> 32) * n >> 32); }
    bool one_in(std::uint32_t n) { return below(n) == 0; }
    /// In [0, 1), exact in float and double.
    template <class T>
    T unit()
    {
        return static_cast<T>(next() >> 40) * static_cast<T>(0x1p-24);
    }
    template <class T>
    T between(T low, T high)
    {
        return low + unit<T>() * (high - low);
    }
    template <class T>
    T integer(std::uint32_t n)
    {
        return static_cast<T>(below(n));
    }

  private:
    std::uint64_t state_;
};

template <int Dim, class T>
using Boxes = std::vector<Aabb<Dim, T>>;

enum class Scene
{
    uniform,           // edges around 1, about 2 pairs per box
    dense,             // the same, about 9 pairs per box
    lattice,           // whole numbers: most pairs just touch, many boxes are equal
    touching_voxels,   // unit cells that fill a block: every pair a tie
    cell_borders,      // bounds on multiples of powers of two, where grids have their borders
    almost_touching,   // neighbours one representable number apart, either way
    zero_size,         // points and rectangles on a lattice, many in one place
    identical,         // one box n times
    half_identical,    // one box n/2 times among uniform ones
    line,              // along one axis
    diagonal,          // along the diagonal: sparse in every grid
    flat,              // no extent on the last axis
    plates,            // each one spans all axes but one
    rods,              // each one spans one axis
    sizes_to_million,  // edges from 1 to 10^6, as many of each magnitude
    giant_among_dust,  // one box around all others
    nested_clusters,   // clumps of clumps of clumps: grids within grids
    piles_among_large, // small dense piles inside sparse big boxes
    far_from_origin,   // uniform, 10^6 (float) or 10^9 (double) away
    outliers,          // uniform with a few boxes very far away
    heavy_tail,        // centres spread like Cauchy's distribution
    infinite,          // uniform with half-spaces, slabs, and boxes at infinity
    huge,              // up to the largest finite number, extents that overflow
    denormal,          // around the smallest numbers
    special,           // bounds picked from the numbers that go wrong
    count
};

inline const char* name(Scene scene)
{
    static constexpr const char* names[] = {"uniform",
                                            "dense",
                                            "lattice",
                                            "touching_voxels",
                                            "cell_borders",
                                            "almost_touching",
                                            "zero_size",
                                            "identical",
                                            "half_identical",
                                            "line",
                                            "diagonal",
                                            "flat",
                                            "plates",
                                            "rods",
                                            "sizes_to_million",
                                            "giant_among_dust",
                                            "nested_clusters",
                                            "piles_among_large",
                                            "far_from_origin",
                                            "outliers",
                                            "heavy_tail",
                                            "infinite",
                                            "huge",
                                            "denormal",
                                            "special"};
    static_assert(std::size(names) == static_cast<std::size_t>(Scene::count));
    return names[static_cast<std::size_t>(scene)];
}

inline std::vector<Scene> all_scenes()
{
    std::vector<Scene> all;
    for (int i = 0; i < static_cast<int>(Scene::count); ++i)
        all.push_back(static_cast<Scene>(i));
    return all;
}

/// Scenes where nearly all boxes meet: keep n small, or n^2 pairs come out.
inline bool everything_touches(Scene scene)
{
    return scene == Scene::identical || scene == Scene::half_identical || scene == Scene::special ||
           scene == Scene::huge || scene == Scene::infinite || scene == Scene::rods ||
           scene == Scene::plates || scene == Scene::denormal;
}

/// The edge of a cube that holds n unit cells `sparseness` times over.
template <int Dim, class T>
T world_edge(std::size_t n, T sparseness)
{
    T edge = 1;
    const T volume = static_cast<T>(n) * sparseness;
    while ((Dim == 2 ? edge * edge : edge * edge * edge) < volume)
        edge *= static_cast<T>(1.0625);
    return edge;
}

/// Numbers that go wrong, ascending, but for -0 and 0 which are equal.
template <class T>
std::span<const T> special_numbers()
{
    using limits = std::numeric_limits<T>;
    static const std::array<T, 22> numbers = {-limits::infinity(),
                                              -limits::max(),
                                              -limits::max() / 2,
                                              T(-1e9),
                                              T(-1) - limits::epsilon(),
                                              T(-1),
                                              T(-0.5),
                                              -limits::min(),
                                              -limits::denorm_min(),
                                              T(-0.0),
                                              T(0),
                                              limits::denorm_min(),
                                              limits::min(),
                                              T(0.5),
                                              T(1),
                                              T(1) + limits::epsilon(),
                                              T(1.5),
                                              T(16777216),
                                              T(1e9),
                                              limits::max() / 2,
                                              limits::max(),
                                              limits::infinity()};
    return numbers;
}

template <int Dim, class T>
Aabb<Dim, T> box_between(Random& random, T low, T high, T smallest_edge, T largest_edge)
{
    Aabb<Dim, T> box;
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] = random.between(low, high);
        box.hi[d] = box.lo[d] + random.between(smallest_edge, largest_edge);
    }
    return box;
}

template <int Dim, class T>
Boxes<Dim, T> make_uniform(Random& random, std::size_t n, T sparseness)
{
    const T edge = world_edge<Dim, T>(n, sparseness);
    Boxes<Dim, T> boxes(n);
    for (auto& box : boxes)
        box = box_between<Dim, T>(random, 0, edge, T(0.75), T(1.125));
    return boxes;
}

/// Box number i of a block of unit cells, `side` cells along every axis but the last.
template <int Dim, class T>
Aabb<Dim, T> cell(std::size_t i, std::size_t side)
{
    Aabb<Dim, T> box;
    for (int d = 0; d < Dim; ++d) {
        box.lo[d] = static_cast<T>(d + 1 < Dim ? i % side : i);
        box.hi[d] = box.lo[d] + 1;
        i /= side;
    }
    return box;
}

template <int Dim, class T>
Boxes<Dim, T> make_scene(Scene scene, std::size_t n, std::uint64_t seed)
{
    using limits = std::numeric_limits<T>;
    using Box = Aabb<Dim, T>;
    Random random(seed * 1000003 + static_cast<std::uint64_t>(scene));
    const T edge = world_edge<Dim, T>(n, 4);
    const auto whole_edge = static_cast<std::uint32_t>(edge) + 1;
    const int one_axis = static_cast<int>(random.below(Dim));
    Boxes<Dim, T> boxes(n);
    // `make(i, box)` overwrites the box of a sparse uniform scene.
    const auto each = [&](auto&& make) {
        boxes = make_uniform<Dim, T>(random, n, 4);
        for (std::size_t i = 0; i < n; ++i)
            make(i, boxes[i]);
    };
    switch (scene) {
    case Scene::uniform:
    case Scene::count:
        boxes = make_uniform<Dim, T>(random, n, 4);
        break;
    case Scene::dense:
        boxes = make_uniform<Dim, T>(random, n, 1);
        break;
    case Scene::lattice:
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = random.integer<T>(whole_edge) - random.integer<T>(2);
                box.hi[d] = box.lo[d] + random.integer<T>(3);
            }
        break;
    case Scene::touching_voxels:
        for (std::size_t i = 0; i < n; ++i)
            boxes[i] = cell<Dim, T>(i, static_cast<std::size_t>(world_edge<Dim, T>(n, 1)));
        for (std::size_t i = n; i > 1; --i) // cells come in no order
            std::swap(boxes[i - 1], boxes[random.below(static_cast<std::uint32_t>(i))]);
        break;
    case Scene::cell_borders:
        for (Box& box : boxes) {
            const T unit = std::ldexp(T(1), static_cast<int>(random.below(7)) - 3);
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = unit * std::floor(random.between(-edge, edge) / unit);
                box.hi[d] = box.lo[d] + (random.one_in(4) ? 0 : unit);
            }
        }
        break;
    case Scene::almost_touching:
        for (std::size_t i = 0; i < n; ++i) {
            boxes[i] = cell<Dim, T>(i, static_cast<std::size_t>(world_edge<Dim, T>(n, 1)));
            for (int d = 0; d < Dim; ++d) {
                T& lo = boxes[i].lo[d];
                T& hi = boxes[i].hi[d];
                lo += T(0.1), hi += T(0.1);
                if (random.one_in(2)) lo = std::nextafter(lo, random.one_in(2) ? T(-1) : hi);
                if (random.one_in(2)) hi = std::nextafter(hi, random.one_in(2) ? lo : limits::max());
            }
        }
        break;
    case Scene::zero_size:
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d)
                box.lo[d] = box.hi[d] = random.integer<T>(whole_edge / 2 + 1) / 4;
        break;
    case Scene::identical:
        boxes.assign(n, box_between<Dim, T>(random, -10, 10, 0, 3));
        break;
    case Scene::half_identical:
        each([&](std::size_t i, Box& box) {
            if (i % 2 == 1) box = boxes[0];
        });
        break;
    case Scene::line:
        each([&](std::size_t i, Box& box) {
            for (int d = 0; d < Dim; ++d)
                if (d != one_axis) box.lo[d] = 0, box.hi[d] = 1;
            box.lo[one_axis] = static_cast<T>(i) / 2 + random.unit<T>();
            box.hi[one_axis] = box.lo[one_axis] + random.unit<T>();
        });
        break;
    case Scene::diagonal:
        for (Box& box : boxes) {
            const T at = random.unit<T>() * static_cast<T>(n);
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = at + random.unit<T>();
                box.hi[d] = box.lo[d] + random.unit<T>();
            }
        }
        break;
    case Scene::flat:
        boxes = make_uniform<Dim, T>(random, n, 1);
        for (Box& box : boxes)
            box.lo[Dim - 1] = box.hi[Dim - 1] = T(3.7);
        break;
    case Scene::plates:
        each([&](std::size_t, Box& box) {
            const int thin = static_cast<int>(random.below(Dim));
            for (int d = 0; d < Dim; ++d)
                if (d != thin) box.lo[d] = -1, box.hi[d] = edge + 1;
            box.hi[thin] = box.lo[thin] + T(0.01);
        });
        break;
    case Scene::rods:
        each([&](std::size_t, Box& box) {
            const auto d = random.below(Dim);
            box.lo[d] = -1, box.hi[d] = edge + 1;
        });
        break;
    case Scene::sizes_to_million:
        for (Box& box : boxes) {
            const int magnitude = static_cast<int>(random.below(20)); // drawn first: arguments have no order
            const T size = std::ldexp(random.between(T(1), T(2)), magnitude);
            box = box_between<Dim, T>(random, 0, world_edge<Dim, T>(n / 8, 4) * 0x1p19f, size / 2, size);
        }
        break;
    case Scene::giant_among_dust:
        for (Box& box : boxes)
            box = box_between<Dim, T>(random, 0, edge * 1000, 0, 1);
        if (n > 0)
            for (int d = 0; d < Dim; ++d)
                boxes[n / 2].lo[d] = -1, boxes[n / 2].hi[d] = edge * 1001;
        break;
    case Scene::nested_clusters:
        for (Box& box : boxes) {
            const int depth = 1 + static_cast<int>(random.below(5)); // a tenth of the size at each level
            T scale = edge;
            for (int d = 0; d < Dim; ++d)
                box.lo[d] = 0;
            for (int level = 0; level < depth; ++level, scale /= 16)
                for (int d = 0; d < Dim; ++d)
                    box.lo[d] += random.integer<T>(level + 1 < depth ? 2 : 16) * scale / 4;
            for (int d = 0; d < Dim; ++d)
                box.hi[d] = (box.lo[d] += random.unit<T>() * scale) + random.unit<T>() * scale * 4;
        }
        break;
    case Scene::piles_among_large:
        each([&](std::size_t i, Box& box) {
            if (i % 8 == 0) {
                for (int d = 0; d < Dim; ++d)
                    box.hi[d] += random.unit<T>() * 8;
                return;
            }
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = random.integer<T>(3) * edge / 3 + random.unit<T>() * edge / 32;
                box.hi[d] = box.lo[d] + random.unit<T>() / 32;
            }
        });
        break;
    case Scene::far_from_origin: {
        const T offset = std::is_same_v<T, float> ? T(1e6) : T(1e9);
        each([&](std::size_t, Box& box) {
            for (int d = 0; d < Dim; ++d)
                box.lo[d] += offset, box.hi[d] += offset;
        });
        break;
    }
    case Scene::outliers:
        each([&](std::size_t i, Box& box) {
            if (i % 64 != 7) return;
            const int d = static_cast<int>(random.below(Dim));
            const T away = std::ldexp(T(1), static_cast<int>(random.below(100)));
            if (random.one_in(2)) box.hi[d] = std::max(box.hi[d], away);
            if (random.one_in(2)) box.lo[d] = -away;
        });
        break;
    case Scene::heavy_tail:
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                const T side = random.one_in(2) ? T(-1) : T(1);
                box.lo[d] = side * edge / 2 * random.unit<T>() / (random.unit<T>() + T(0x1p-20));
                box.hi[d] = box.lo[d] + random.unit<T>() * 2;
            }
        break;
    case Scene::infinite:
        each([&](std::size_t, Box& box) {
            if (!random.one_in(16)) return;
            for (int d = 0; d < Dim; ++d) {
                const std::uint32_t kind = random.below(8);
                if (kind < 2) box.hi[d] = limits::infinity();
                if (kind > 0 && kind < 4) box.lo[d] = -limits::infinity();
                if (kind == 4) box.lo[d] = box.hi[d] = limits::infinity();
                if (kind == 5) box.lo[d] = box.hi[d] = -limits::infinity();
            }
        });
        break;
    case Scene::huge:
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                const T x = random.between(T(-1), T(1)) * limits::max();
                const T y = random.between(T(-1), T(1)) * limits::max();
                const bool small = random.one_in(2);
                box.lo[d] = small ? x : std::min(x, y);
                box.hi[d] = small ? std::nextafter(x, limits::max()) : std::max(x, y);
            }
        break;
    case Scene::denormal:
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                box.lo[d] = (random.integer<T>(64) - 32) * limits::denorm_min();
                box.hi[d] = box.lo[d] + random.integer<T>(8) * limits::denorm_min();
            }
        break;
    case Scene::special: {
        const std::span<const T> numbers = special_numbers<T>();
        const auto choices = static_cast<std::uint32_t>(numbers.size());
        for (Box& box : boxes)
            for (int d = 0; d < Dim; ++d) {
                const std::uint32_t x = random.below(choices);
                const std::uint32_t y = random.one_in(2) ? x : random.below(choices);
                box.lo[d] = numbers[std::min(x, y)];
                box.hi[d] = numbers[std::max(x, y)];
                // 0 to -0 is a valid box as well.
                if (box.lo[d] == box.hi[d] && random.one_in(2)) std::swap(box.lo[d], box.hi[d]);
            }
        break;
    }
    }
    return boxes;
}

} // namespace contract
