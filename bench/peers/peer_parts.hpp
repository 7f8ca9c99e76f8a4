// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bench/peers.hpp"

namespace jostle_bench {

/// Count and checksum of pairs in any order and either orientation. A pair given twice counts twice, so that
/// a system that repeats itself is found out.
[[nodiscard]] PeerResult summarise(std::span<const jostle::Pair> pairs);
[[nodiscard]] inline PeerResult operator+(const PeerResult& a, const PeerResult& b)
{
    return {a.pairs + b.pairs, a.checksum + b.checksum};
}

/// The smallest box around all; a unit box for none.
template <int Dim>
[[nodiscard]] jostle::Aabb<Dim, float> bounds_of(Boxes<Dim> boxes)
{
    if (boxes.empty()) return {{}, {}};
    jostle::Aabb<Dim, float> all = boxes.front();
    for (const auto& box : boxes)
        for (int d = 0; d < Dim; ++d) {
            all.lo[d] = std::min(all.lo[d], box.lo[d]);
            all.hi[d] = std::max(all.hi[d], box.hi[d]);
        }
    return all;
}

// Each in a file of its own, so that each system's headers meet no other's.
template <int Dim>
std::unique_ptr<Peer<Dim>> make_embree();
template <int Dim>
std::unique_ptr<Peer<Dim>> make_cgal();
template <int Dim>
std::unique_ptr<Peer<Dim>> make_boost();
template <int Dim>
std::unique_ptr<Peer<Dim>> make_floor();
std::unique_ptr<Peer<3>> make_bullet();
std::unique_ptr<Peer<3>> make_bullet_sap();
std::unique_ptr<Peer<3>> make_fcl();
std::unique_ptr<Peer<3>> make_ode();
std::unique_ptr<Peer<2>> make_box2d();

} // namespace jostle_bench
