// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "engine/kernels/kernels.hpp"
#include "engine/record.hpp"
#include "engine/slot.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// A brick of two sets in which windows hold mostly records of the row's own set, as where a few boxes meet a
/// crowd. It has the records a second time, set by set, so that a row is tested only against the other set.
///
///     records    a a a b a a a a b a b a     sorted along the sweep axis, as any brick's
///     columns    a a a a a a a a a - - b b b     `-` padding
///     before     0 0 0 0 1 1 1 1 1 2 2 3 3   how many b lie before each record, and before the end
///
/// The pairs come in the order in which Kernels::sweep finds them in the records, ties included: rows in
/// couples, step by step of the records, not of the columns. So the way in which a brick is swept affects
/// only time.
class Apart
{
  public:
    /// From sorted and padded records and their windows, in working memory of `slot`. Returns false, and must
    /// not be used, if sweeping the brick directly costs less than about twice as much.
    bool make(const Record* records, const std::uint32_t* window_end, std::uint32_t count,
              const Kernels& kernels, Slot& slot);
    /// The total number of candidates that it tests.
    [[nodiscard]] std::uint64_t candidates() const noexcept { return candidates_; }
    /// Sweeps the rows first <= i < last, as Kernels::sweep does and with the same conditions. Returns about
    /// how many steps with two rows it took. May be called from several threads at a time, each with its own
    /// slot.
    template <int Dim>
    std::uint64_t sweep(const Kernels& kernels, std::uint32_t first, std::uint32_t last, Slot& mine,
                        PairOutput& out) const;

  private:
    std::uint32_t count_ = 0;
    std::uint64_t candidates_ = 0;
    SortedBrick columns_{};
    std::uint32_t begin_b_ = 0; // of the second set in the columns
    const Record* records_ = nullptr;
    const std::uint32_t* window_end_ = nullptr;
    const std::uint32_t* before_ = nullptr;
    const std::uint32_t* place_ = nullptr; // of each column: the number of its record
};

} // namespace engine
JOSTLE_NAMESPACE_END
