// SPDX-License-Identifier: MIT
#include "exchange.hpp"

#include <algorithm>
#include <climits>
#include <string>
#include <thread>
#include <utility>

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
namespace {

// MPI counts in int: in words of this size messages may have 16 GiB.
constexpr std::size_t word = 8;

} // namespace

Exchange::Exchange(MPI_Comm comm, std::pmr::memory_resource* memory)
    : comm_(comm), out_(memory), last_ids_(memory), written_(memory), sent_(memory), received_(memory)
{
    int ranks = 1;
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &ranks);
    out_.resize(static_cast<std::size_t>(ranks));
    last_ids_.resize(static_cast<std::size_t>(ranks));
}

void Exchange::note(int rank)
{
    if (std::find(written_.begin(), written_.end(), rank) == written_.end()) written_.push_back(rank);
}

std::span<const std::byte> Exchange::to_myself() const noexcept
{
    return out_[static_cast<std::size_t>(rank_)];
}

void Exchange::seal()
{
    sent_.reserve(written_.size());
    for (const int rank : written_) {
        Bytes& bytes = out_[static_cast<std::size_t>(rank)];
        if (rank == rank_) continue;
        bytes.resize((bytes.size() + word - 1) / word * word); // zeros end a message, see Reader's users
        if (bytes.size() / word > INT_MAX)
            throw Error(ErrorCode::too_many_objects, "a message of " + std::to_string(bytes.size()) +
                                                         " bytes for rank " + std::to_string(rank) +
                                                         ", and MPI sends 16 GiB at most; use more ranks");
    }
}

void Exchange::start(const Agreement& agreement) noexcept
{
    tag_ = 1 - tag_; // a fast rank may be in the next exchange already, never in the one after it
    received_.clear();
    sent_.clear();
    messages_sent_ = bytes_sent_ = 0;
    if (agreement.failed()) return;
    for (const int rank : written_) {
        const Bytes& bytes = out_[static_cast<std::size_t>(rank)];
        if (rank == rank_ || bytes.empty()) continue;
        sent_.push_back(MPI_REQUEST_NULL);
        MPI_Issend(bytes.data(), static_cast<int>(bytes.size() / word), MPI_UINT64_T, rank, tag_, comm_,
                   &sent_.back());
        ++messages_sent_;
        bytes_sent_ += bytes.size();
    }
}

bool Exchange::receive_one(Agreement& agreement) noexcept
{
    int came = 0;
    MPI_Message message = MPI_MESSAGE_NULL;
    MPI_Status status;
    MPI_Improbe(MPI_ANY_SOURCE, tag_, comm_, &came, &message, &status);
    if (came != 0) receive(agreement, message, status);
    return came != 0;
}

void Exchange::finish(Agreement& agreement) noexcept
{
    MPI_Request barrier = MPI_REQUEST_NULL;
    for (bool entered = false;;) {
        if (receive_one(agreement)) continue;
        int done = 0;
        if (!entered) {
            MPI_Testall(static_cast<int>(sent_.size()), sent_.data(), &done, MPI_STATUSES_IGNORE);
            if (done != 0) {
                MPI_Ibarrier(comm_, &barrier);
                entered = true;
                continue;
            }
        } else {
            MPI_Test(&barrier, &done, MPI_STATUS_IGNORE);
            if (done != 0) break;
        }
        std::this_thread::yield(); // there may be more ranks than cores
    }
    std::sort(received_.begin(), received_.end(),
              [](const Message& a, const Message& b) { return a.source < b.source; });
}

void Exchange::receive(Agreement& agreement, MPI_Message message, const MPI_Status& status) noexcept
{
    int words = 0;
    MPI_Get_count(&status, MPI_UINT64_T, &words);
    const bool has_room = agreement.attempt([&] {
        Bytes bytes(static_cast<std::size_t>(words) * word, out_.get_allocator());
        received_.push_back({status.MPI_SOURCE, std::move(bytes)});
    });
    if (has_room) {
        MPI_Mrecv(received_.back().bytes.data(), words, MPI_UINT64_T, &message, MPI_STATUS_IGNORE);
        return;
    }
    // The sender waits until it is taken. To take less than there is is an error for MPI, here a wanted one.
    MPI_Comm_set_errhandler(comm_, MPI_ERRORS_RETURN);
    MPI_Mrecv(nullptr, 0, MPI_UINT64_T, &message, MPI_STATUS_IGNORE);
    MPI_Comm_set_errhandler(comm_, MPI_ERRORS_ARE_FATAL);
}

void Exchange::clear() noexcept
{
    for (const int rank : written_) {
        out_[static_cast<std::size_t>(rank)].clear();
        last_ids_[static_cast<std::size_t>(rank)] = 0;
    }
    written_.clear();
}

} // namespace mpi
JOSTLE_NAMESPACE_END
