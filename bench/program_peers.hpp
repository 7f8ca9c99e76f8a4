// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/query.hpp"

/// What users would write instead for the programs of `jostle bench programs`: a game server and a search for
/// neighbours on another system's trees, and the linked cells that particle codes begin with. The planner's
/// peers are in distance_peers.hpp. All on one thread.
namespace jostle_bench {

/// Players who move among each other, among zones and among props, which don't. Objects are numbered: players
/// first, then zones, then props.
class ServerPeer
{
  public:
    virtual ~ServerPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// False for a system that has no rays: `shots` does nothing then.
    [[nodiscard]] virtual bool has_shots() const noexcept = 0;
    /// Not timed.
    virtual void start(std::span<const jostle::Aabb3f> players, std::span<const jostle::Aabb3f> zones,
                       std::span<const jostle::Aabb3f> props) = 0;
    /// Players `moved` have the boxes `boxes` now; `began` and `ended` become the pairs, one of them a
    /// player, that touch now and didn't, or did and don't. In any order, a < b.
    virtual void move(std::span<const std::uint32_t> moved, std::span<const jostle::Aabb3f> boxes,
                      std::vector<jostle::Pair>& began, std::vector<jostle::Pair>& ended) = 0;
    /// The players in each sphere: out[first[i]] to out[first[i + 1]] for sphere i.
    virtual void sight(std::span<const jostle::Sphere3f> spheres, std::vector<std::size_t>& first,
                       std::vector<std::uint32_t>& out) = 0;
    /// The first player of another team (the number's last bit) or prop that each player's ray hits.
    virtual void shots(std::span<const jostle::Ray3f> rays, std::span<const std::uint32_t> shooters,
                       std::span<jostle::Hit<float>> out) = 0;
};
[[nodiscard]] std::unique_ptr<ServerPeer> make_bullet_server();
[[nodiscard]] std::unique_ptr<ServerPeer> make_fcl_server();

/// Balls in space that is periodic along x and y.
class NeighboursPeer
{
  public:
    virtual ~NeighboursPeer() = default;
    [[nodiscard]] virtual const char* name() const noexcept = 0;
    /// All pairs of balls whose gap is no more than `skin`, in any order; shift[i] is what b is moved by.
    /// Called again and again: each time counts as if all balls had moved since.
    virtual void find(std::span<const jostle::Vec3f> centers, std::span<const float> radii, float period,
                      float skin, std::vector<jostle::Pair>& pairs, std::vector<jostle::Vec3f>& shift) = 0;
};
[[nodiscard]] std::unique_ptr<NeighboursPeer> make_linked_cells();
[[nodiscard]] std::unique_ptr<NeighboursPeer> make_bullet_grains();
[[nodiscard]] std::unique_ptr<NeighboursPeer> make_fcl_grains();

} // namespace jostle_bench
