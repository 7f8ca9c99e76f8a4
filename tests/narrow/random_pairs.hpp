// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "jostle/contact.hpp"

/// Random numbers that are the same everywhere.
class Random
{
  public:
    explicit Random(std::uint64_t seed) : engine_(seed) {}
    double uniform(double lo, double hi)
    {
        return lo + (hi - lo) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
    }
    std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(engine_() % n); }
    bool chance(double p) { return uniform(0, 1) < p; }
    template <class T>
    std::array<T, 4> rotation()
    {
        std::array<double, 4> q{};
        double size = 0;
        while (size < 0.01 || size > 1) {
            size = 0;
            for (double& x : q)
                x = uniform(-1, 1), size += x * x;
        }
        std::array<T, 4> r{};
        for (std::size_t i = 0; i < 4; ++i)
            r[i] = static_cast<T>(q[i] / std::sqrt(size));
        return r;
    }
    /// Often one of the rotations that make faces and edges parallel.
    template <class T>
    jostle::Pose<3, T> pose(double spread)
    {
        jostle::Pose<3, T> p;
        for (T& x : p.position)
            x = static_cast<T>(uniform(-spread, spread));
        switch (below(4)) {
        case 0: // as it is
            break;
        case 1: { // about one axis
            const double angle = uniform(-3.2, 3.2);
            p.rotation = {};
            p.rotation[below(3)] = static_cast<T>(std::sin(angle / 2));
            p.rotation[3] = static_cast<T>(std::cos(angle / 2));
            break;
        }
        default:
            p.rotation = rotation<T>();
        }
        if (chance(0.2)) // on a lattice: touching, in one place
            for (T& x : p.position)
                x = static_cast<T>(std::round(static_cast<double>(x)));
        return p;
    }

  private:
    std::mt19937_64 engine_;
};
