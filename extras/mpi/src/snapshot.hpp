// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "agreement.hpp"
#include "bytes.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// What one rank wrote of a snapshot. Its bytes: what is here; objects; the stamp; a checksum of all that.
struct SnapshotPart
{
    std::uint8_t dimensions, coordinate_bytes;
    double margin;
    std::uint32_t part, parts; ///< part < parts
    std::uint64_t objects;
    std::uint64_t stamp = 0; ///< the same in all parts, and in no other snapshot

    void write_head(std::vector<std::byte>& bytes) const;
    /// Checks all but the objects, which `from` is left at. Throws an `Error` that says what is wrong.
    [[nodiscard]] static SnapshotPart read(std::span<const std::byte> bytes, Reader& from, int dimensions,
                                           std::size_t coordinate_bytes);
    // Correct checksums alone aren't trusted.

    /// The objects end before what comes behind them.
    static void check_rest(const Reader& from);
    static void check_end(const Reader& from);
    [[noreturn]] static void refuse_twice(std::uint64_t id);
};

/// Of all of the bytes; different for any two that differ in few of them.
[[nodiscard]] std::uint64_t checksum(std::span<const std::byte> bytes) noexcept;

/// Collective. Throws a Failure unless the parts that all ranks have are those of one snapshot, each once.
void check_parts(Agreement& agreement, MPI_Comm comm, std::span<const SnapshotPart> parts);

} // namespace mpi
JOSTLE_NAMESPACE_END
