// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "jostle/mpi.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// Work that may fail on some ranks, and a place where all of them hear of it. Between the two, ranks go on
/// with what others wait for.
class Agreement
{
  public:
    explicit Agreement(MPI_Comm comm) noexcept;

    /// Calls work() unless something failed here already, and keeps what it throws. Says whether nothing did.
    template <class Work>
    bool attempt(const Work& work) noexcept
    {
        if (failed_) return false;
        try {
            work();
        } catch (...) {
            keep_current_exception();
        }
        return !failed_;
    }
    [[nodiscard]] bool failed() const noexcept { return failed_; }

    /// Collective. If any rank failed, throws the Failure of the lowest one on all. Else each of `greatest`
    /// becomes the greatest, each of `sums` the sum, of what the ranks gave.
    void settle(std::span<double> greatest = {}, std::span<double> sums = {});

  private:
    /// Needs no memory: there may be none.
    struct Report
    {
        std::uint64_t index;
        std::uint32_t code, cause;
        char message[1008];
    };
    void keep_current_exception() noexcept;
    void keep(FailureCause cause, ErrorCode code, std::string_view message, std::uint64_t index) noexcept;

    MPI_Comm comm_;
    bool failed_ = false;
    Report report_{};
};

} // namespace mpi
JOSTLE_NAMESPACE_END
