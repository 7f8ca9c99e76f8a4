// SPDX-License-Identifier: MIT
#include "agreement.hpp"

#include <algorithm>
#include <array>
#include <exception>
#include <new>
#include <string>

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

Failure::Failure(int rank, FailureCause cause, ErrorCode code, const std::string& message,
                 std::uint64_t index)
    : Error(code, "rank " + std::to_string(rank) + ": " + message, index), rank_(rank), cause_(cause)
{
}
Failure::~Failure() = default;

Agreement::Agreement(MPI_Comm comm) noexcept : comm_(comm) {}

void Agreement::keep(FailureCause cause, ErrorCode code, std::string_view message,
                     std::uint64_t index) noexcept
{
    failed_ = true;
    report_ = {index, static_cast<std::uint32_t>(code), static_cast<std::uint32_t>(cause), {}};
    std::copy_n(message.data(), std::min(message.size(), sizeof report_.message - 1), report_.message);
}

void Agreement::keep_current_exception() noexcept
{
    try {
        throw;
    } catch (const Error& error) {
        keep(FailureCause::data, error.code(), error.what(), error.index());
    } catch (const std::bad_alloc&) {
        keep(FailureCause::memory, ErrorCode::invalid_argument,
             "no memory left; give it less, or the job more ranks", Error::no_index);
    } catch (const std::exception& error) {
        keep(FailureCause::callback, ErrorCode::invalid_argument, error.what(), Error::no_index);
    } catch (...) {
        keep(FailureCause::callback, ErrorCode::invalid_argument,
             "something was thrown that isn't a std::exception", Error::no_index);
    }
}

void Agreement::settle(std::span<double> greatest, std::span<double> sums)
{
    int rank = 0, ranks = 1;
    MPI_Comm_rank(comm_, &rank);
    MPI_Comm_size(comm_, &ranks);
    std::array<double, 16> numbers{};
    // The lowest rank that failed has the greatest of these.
    numbers[0] = failed_ ? ranks - rank : 0;
    std::copy(greatest.begin(), greatest.end(), numbers.begin() + 1);
    MPI_Request both[2] = {MPI_REQUEST_NULL, MPI_REQUEST_NULL};
    MPI_Iallreduce(MPI_IN_PLACE, numbers.data(), static_cast<int>(1 + greatest.size()), MPI_DOUBLE, MPI_MAX,
                   comm_, &both[0]);
    if (!sums.empty())
        MPI_Iallreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, comm_,
                       &both[1]);
    MPI_Waitall(2, both, MPI_STATUSES_IGNORE);
    if (numbers[0] == 0) {
        std::copy_n(numbers.begin() + 1, greatest.size(), greatest.begin());
        return;
    }
    const int first = ranks - static_cast<int>(numbers[0]);
    MPI_Bcast(&report_, sizeof report_, MPI_BYTE, first, comm_);
    throw Failure(first, static_cast<FailureCause>(report_.cause), static_cast<ErrorCode>(report_.code),
                  report_.message, report_.index);
}

} // namespace mpi
JOSTLE_NAMESPACE_END
