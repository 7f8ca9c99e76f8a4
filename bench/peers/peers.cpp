// SPDX-License-Identifier: MIT
#include "bench/peers.hpp"

#include <cassert>

#include "peer_parts.hpp"

namespace jostle_bench {

PeerResult summarise(std::span<const jostle::Pair> pairs)
{
    PeerResult result;
    for (const jostle::Pair& pair : pairs) {
        const jostle::Pair ordered{std::min(pair.a, pair.b), std::max(pair.a, pair.b)};
        result.checksum += jostle::pair_checksum(std::span(&ordered, 1));
    }
    result.pairs = pairs.size();
    return result;
}

template <int Dim>
std::span<const std::uint32_t> ChangedBoxes<Dim>::since_last(Boxes<Dim> boxes)
{
    assert(boxes.size() == last_.size());
    moved_.clear();
    for (std::uint32_t i = 0; i < boxes.size(); ++i) {
        bool same = true;
        for (int d = 0; d < Dim; ++d)
            same &= boxes[i].lo[d] == last_[i].lo[d] && boxes[i].hi[d] == last_[i].hi[d];
        if (same) continue;
        moved_.push_back(i);
        last_[i] = boxes[i];
    }
    return moved_;
}
template class ChangedBoxes<2>;
template class ChangedBoxes<3>;

template <>
std::vector<std::unique_ptr<Peer<3>>> make_peers<3>()
{
    std::vector<std::unique_ptr<Peer<3>>> peers;
    peers.push_back(make_embree<3>());
    peers.push_back(make_bullet());
    peers.push_back(make_bullet_sap());
    peers.push_back(make_fcl());
    peers.push_back(make_cgal<3>());
    peers.push_back(make_ode());
    peers.push_back(make_boost<3>());
    peers.push_back(make_floor<3>());
    return peers;
}

template <>
std::vector<std::unique_ptr<Peer<2>>> make_peers<2>()
{
    std::vector<std::unique_ptr<Peer<2>>> peers;
    peers.push_back(make_box2d());
    peers.push_back(make_embree<2>());
    peers.push_back(make_cgal<2>());
    peers.push_back(make_boost<2>());
    peers.push_back(make_floor<2>());
    return peers;
}

} // namespace jostle_bench
