// SPDX-License-Identifier: MIT
#include "snapshot.hpp"

#include <algorithm>
#include <string>

#include "object.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace mpi {
namespace {

constexpr std::uint32_t magic = 0x49504d4a, format = 1; // "JMPI"
constexpr std::size_t head_bytes = 4 + 4 + 1 + 1 + 8 + 4 + 4 + 8, tail_bytes = 8 + 8;

[[noreturn]] void refuse(const std::string& why)
{
    throw Error(ErrorCode::bad_snapshot, "part of a snapshot: " + why);
}

} // namespace

std::uint64_t checksum(std::span<const std::byte> bytes) noexcept
{
    std::uint64_t sum = bytes.size();
    for (const std::byte each : bytes)
        sum = (sum ^ std::to_integer<std::uint64_t>(each)) * 0x100000001b3u; // FNV-1a
    return mixed(sum);
}

void SnapshotPart::write_head(std::vector<std::byte>& bytes) const
{
    put(bytes, magic);
    put(bytes, format);
    put(bytes, dimensions);
    put(bytes, coordinate_bytes);
    put(bytes, margin);
    put(bytes, part);
    put(bytes, parts);
    put(bytes, objects);
}

SnapshotPart SnapshotPart::read(std::span<const std::byte> bytes, Reader& from, int dimensions,
                                std::size_t coordinate_bytes)
{
    if (bytes.size() < head_bytes + tail_bytes) refuse("it is cut short, or something else");
    if (from.take<std::uint32_t>() != magic) refuse("it is something else");
    if (const auto version = from.take<std::uint32_t>(); version != format)
        refuse("it has format " + std::to_string(version) + ", and this Jostle reads " +
               std::to_string(format));
    Reader tail(bytes.last(tail_bytes));
    const auto stamp = tail.take<std::uint64_t>();
    if (tail.take<std::uint64_t>() != checksum(bytes.first(bytes.size() - 8)))
        refuse("it is cut short or altered");
    SnapshotPart part{};
    part.dimensions = from.take<std::uint8_t>();
    part.coordinate_bytes = from.take<std::uint8_t>();
    if (part.dimensions != dimensions || part.coordinate_bytes != coordinate_bytes)
        refuse("it is of a world of " + std::to_string(part.dimensions) + " dimensions and coordinates of " +
               std::to_string(part.coordinate_bytes) + " bytes, and this one has " +
               std::to_string(dimensions) + " and " + std::to_string(coordinate_bytes));
    part.margin = from.take<double>();
    part.part = from.take<std::uint32_t>();
    part.parts = from.take<std::uint32_t>();
    part.objects = from.take<std::uint64_t>();
    part.stamp = stamp;
    if (part.part >= part.parts) refuse("it is altered: there is no such part");
    return part;
}

void SnapshotPart::check_rest(const Reader& from)
{
    if (from.failed() || from.left() < tail_bytes) refuse("it is altered: it has fewer objects than it says");
}
void SnapshotPart::check_end(const Reader& from)
{
    if (from.left() != tail_bytes) refuse("it is altered: it has more objects than it says");
}
void SnapshotPart::refuse_twice(std::uint64_t id)
{
    refuse("it has object " + std::to_string(id) + ", and so has another part");
}

void check_parts(Agreement& agreement, MPI_Comm comm, std::span<const SnapshotPart> parts)
{
    // The greatest, and by its complement the least, of what should be one.
    std::uint64_t extremes[] = {0, 0, 0, 0};
    for (const SnapshotPart& part : parts) {
        const std::uint64_t values[] = {part.parts, ~std::uint64_t{part.parts}, part.stamp, ~part.stamp};
        for (std::size_t i = 0; i < 4; ++i)
            extremes[i] = std::max(extremes[i], values[i]);
    }
    MPI_Allreduce(MPI_IN_PLACE, extremes, 4, MPI_UINT64_T, MPI_MAX, comm);
    const std::uint64_t count = extremes[0];
    std::vector<std::uint64_t> given;
    agreement.attempt([&] {
        if (count == 0) refuse("no rank was given any");
        if (extremes[0] != ~extremes[1] || extremes[2] != ~extremes[3])
            refuse("there are parts of different snapshots");
        given.resize(static_cast<std::size_t>(count));
        for (const SnapshotPart& part : parts)
            ++given[part.part];
    });
    agreement.settle();
    MPI_Allreduce(MPI_IN_PLACE, given.data(), static_cast<int>(count), MPI_UINT64_T, MPI_SUM, comm);
    agreement.attempt([&] {
        for (std::size_t i = 0; i < given.size(); ++i)
            if (given[i] != 1)
                refuse("number " + std::to_string(i) + " of " + std::to_string(count) +
                       (given[i] == 0 ? " is missing; give each part to some rank"
                                      : " is given " + std::to_string(given[i]) +
                                            " times; give each part to one rank"));
    });
    agreement.settle();
}

} // namespace mpi
JOSTLE_NAMESPACE_END
