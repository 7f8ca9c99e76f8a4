// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/pair_buffer.hpp"

/// Other systems' broad phases, behind one interface, so that they can be timed beside Jostle in one process
/// and asked for their answer.
namespace jostle_bench {

template <int Dim>
using Boxes = std::span<const jostle::Aabb<Dim, float>>;

/// What the last frame found: comparable with `PairBuffer::size()` and `jostle::pair_checksum`.
struct PeerResult
{
    std::uint64_t pairs = 0;
    std::uint64_t checksum = 0;
    friend bool operator==(const PeerResult&, const PeerResult&) = default;
};

struct PeerInfo
{
    /// As in the results: "bullet", "embree", ..., "floor".
    const char* name;
    /// One line for a report: which class, driven how, and what is in its favour or against it.
    const char* how;
    /// With more objects than this the system takes minutes or the machine's memory: don't start it.
    std::uint32_t max_objects;
    /// False: it runs on one thread, whatever `start` is given; its row belongs to threads = 1 only.
    bool uses_threads;
    /// False for "floor", which is a lower bound on anybody's time and not a system: nothing to compare.
    bool finds_pairs;
};

/// One system, driven the way its own engine drives it.
///
///     peer.start(boxes, threads);             // not timed: builds, allocates
///     for each frame:
///         moved = changes.since_last(boxes);  // not timed: a physics engine knows what it moved
///         clock; peer.frame(boxes, moved); clock
///         peer.result();                      // not timed
///
/// Inside the timed part, systems that report pairs as they find them have each pair tested with
/// `jostle::overlaps` and stored, which any user of theirs must do; systems that keep a pair set with a
/// margin (bullet, box2d) only bring it up to date, and `result` takes the margin off.
///
/// Lifetime  `boxes` of `start` and `frame` must live until the next call.
/// Threads   one call at a time; at most one peer of a process started at a time.
/// Errors    std::runtime_error with the system's own message.
template <int Dim>
class Peer
{
  public:
    virtual ~Peer() = default;
    [[nodiscard]] virtual const PeerInfo& info() const noexcept = 0;
    /// A new scene of at least one box; forgets any former one. The first `frame` may be given the same
    /// boxes.
    virtual void start(Boxes<Dim> boxes, std::uint32_t threads) = 0;
    /// Brings everything to `boxes` (as many as in `start`) and finds all touching pairs. `moved`: the
    /// objects whose boxes differ from the last frame's (from `start`'s in the first), ascending.
    virtual void frame(Boxes<Dim> boxes, std::span<const std::uint32_t> moved) = 0;
    [[nodiscard]] virtual PeerResult result() const = 0;
    /// Gives the scene's memory and threads back.
    virtual void stop() = 0;
};

/// All peers for 3D: embree, bullet, bullet-sap, fcl, cgal, ode, boost, floor; for 2D: box2d, embree, cgal,
/// boost, floor.
template <int Dim>
[[nodiscard]] std::vector<std::unique_ptr<Peer<Dim>>> make_peers();

/// Tells which boxes changed from one frame to the next.
template <int Dim>
class ChangedBoxes
{
  public:
    explicit ChangedBoxes(Boxes<Dim> boxes) : last_(boxes.begin(), boxes.end()) {}

    /// The objects that differ from the last call's (or the constructor's) boxes, ascending. Valid until the
    /// next call.
    [[nodiscard]] std::span<const std::uint32_t> since_last(Boxes<Dim> boxes);

  private:
    std::vector<jostle::Aabb<Dim, float>> last_;
    std::vector<std::uint32_t> moved_;
};

} // namespace jostle_bench
