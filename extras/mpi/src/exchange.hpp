// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "agreement.hpp"
#include "jostle/mpi.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// Messages to whom they concern, from ranks that don't know who will write to them. No rank hears of those
/// that have nothing to say to it, and no list of all ranks goes round.
///
/// Source   Hoefler, Siebert, Lumsdaine: Scalable communication protocols for dynamic sparse data exchange
///          (2010), "NBX": synchronous sends, and a barrier that a rank enters when its own have arrived.
class Exchange
{
  public:
    using Bytes = std::pmr::vector<std::byte>;
    struct Message
    {
        int source;
        Bytes bytes;
    };

    Exchange(MPI_Comm comm, std::pmr::memory_resource* memory);

    /// What will be sent to that rank, this one included, which gets it without MPI.
    [[nodiscard]] Bytes& to(int rank)
    {
        Bytes& bytes = out_[static_cast<std::size_t>(rank)];
        if (bytes.empty()) note(rank);
        return bytes;
    }
    /// The last id that was written there; 0 in an empty message.
    [[nodiscard]] std::uint64_t& last_id(int rank) noexcept
    {
        return last_ids_[static_cast<std::size_t>(rank)];
    }
    [[nodiscard]] std::span<const std::byte> to_myself() const noexcept;
    /// Gets ready to send; after it start() needs no memory.
    void seal();
    /// Begins to send. A rank that failed sends nothing, so that none gets its half-written messages.
    void start(const Agreement& agreement) noexcept;
    /// Collective with start(). Waits until all messages of all ranks have arrived. If there is no memory for
    /// one it is dropped, and the agreement hears of it.
    void finish(Agreement& agreement) noexcept;
    /// What came from others, by ascending source. Valid until the next start().
    [[nodiscard]] std::span<const Message> received() const noexcept { return received_; }
    /// Forgets what was written.
    void clear() noexcept;

    [[nodiscard]] std::uint64_t messages_sent() const noexcept { return messages_sent_; }
    [[nodiscard]] std::uint64_t bytes_sent() const noexcept { return bytes_sent_; }

  private:
    void note(int rank);
    bool receive_one(Agreement& agreement) noexcept;
    void receive(Agreement& agreement, MPI_Message message, const MPI_Status& status) noexcept;

    MPI_Comm comm_;
    int rank_ = 0;
    int tag_ = 0;
    std::pmr::vector<Bytes> out_; // by rank
    std::pmr::vector<std::uint64_t> last_ids_;
    std::pmr::vector<int> written_; // ranks with a message
    std::pmr::vector<MPI_Request> sent_;
    std::pmr::vector<Message> received_;
    std::uint64_t messages_sent_ = 0, bytes_sent_ = 0;
};

} // namespace mpi
JOSTLE_NAMESPACE_END
