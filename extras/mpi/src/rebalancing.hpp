// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "agreement.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// Says when to repartition space: once imbalance and ghosts have wasted, since the last time, as much time
/// as that time took. Whatever happens next, the two together then cost at most twice what the best choice
/// of the moment would have, as where one rents until the rents have reached the price.
///
/// Waste of an update: the time by which the slowest rank works longer than all do on average; and, for each
/// ghost that there is more than just after the last division, an average object's share of the work.
class Rebalancing
{
  public:
    void request() noexcept { requested_ = true; }

    /// Collective; settles the agreement. Says whether this update divides space.
    [[nodiscard]] bool agree(Agreement& agreement, bool undivided, std::uint64_t objects,
                             std::uint64_t ghosts)
    {
        double greatest[] = {requested_ ? 1.0 : 0.0, work_, price_};
        double sums[] = {work_, static_cast<double>(objects), static_cast<double>(ghosts), 1};
        agreement.settle(greatest, sums);
        const double average = sums[0] / sums[3], all_objects = sums[1], all_ghosts = sums[2];
        if (fresh_) {
            ghosts_then_ = all_ghosts;
            waste_ = 0;
            fresh_ = false;
        } else if (automatic_ && all_objects > 0)
            waste_ +=
                greatest[1] - average + average * std::max(0.0, all_ghosts - ghosts_then_) / all_objects;
        return all_objects > 0 && (undivided || greatest[0] != 0 || (automatic_ && waste_ > greatest[2]));
    }
    /// After an update that was kept. Takes the microseconds that this rank worked, and what dividing took.
    void learn(bool automatic, double worked, bool divided) noexcept
    {
        automatic_ = automatic;
        work_ = worked;
        if (!divided) return;
        price_ = worked;
        fresh_ = true;
        requested_ = false;
    }
    /// What an object of this rank weighs, which searches `members`.
    [[nodiscard]] float weight(std::size_t members) const noexcept
    {
        const double share = members == 0 ? 1 : work_ / static_cast<double>(members);
        return static_cast<float>(std::max(share, 1e-3));
    }

  private:
    bool automatic_ = false, requested_ = false;
    bool fresh_ = false; ///< the last update divided space
    double work_ = 0, price_ = 0, waste_ = 0, ghosts_then_ = 0;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
