// SPDX-License-Identifier: MIT
#include "tool/scenes/recording.hpp"

#ifdef JOSTLE_WITH_ZSTD
#include <zstd.h>
#endif

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <stdexcept>
#include <system_error>
#include <type_traits>
#include <utility>

#include "jostle/recorder.hpp"
#include "tool/system/system.hpp"

using jostle::Aabb;
using jostle::Coordinate;

namespace jostle_scenes {

namespace {

// The header, all numbers little-endian:
//   8 bytes  magic; its last byte is the version of the format
//   u32 dim, u32 coordinate bytes, u32 objects, u32 bytes of the description, u64 frames, f64 frames per
//   second the description u64      FNV-1a of all before
// Then each frame: u32 size of the packed block, and the block; unpacked it is the u32 number of the frame
// and the planes.
//
// Version 2 is what jostle::Recorder writes. Its u32 objects is the greatest number of boxes in a frame, its
// u64 frames 2^64 - 1 if the recorder was not closed. A frame: u32 boxes, their bounds (lo, then hi, of one
// box after another), u64 checksum as detail::start_of_sum says (recorder.hpp). Without zstd RecordingWriter
// writes it, too.
constexpr char magic[8] = {'J', 'O', 'S', 'T', 'L', 'R', 'E', 1};
constexpr std::size_t fixed_header = 8 + 4 * 4 + 8 + 8;
constexpr std::uint32_t longest_description = 1 << 16;
#ifdef JOSTLE_WITH_ZSTD
// Higher levels gain little: what is left of the numbers is noise.
constexpr int compression_level = 12;
constexpr char written_version = 1;
#else
constexpr char written_version = 2;
#endif

std::uint64_t fnv1a(const std::string& bytes)
{
    std::uint64_t hash = 0xcbf29ce484222325u;
    for (const char c : bytes)
        hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    return hash;
}

template <class Unsigned>
void append(std::string& bytes, Unsigned value)
{
    for (std::size_t i = 0; i < sizeof value; ++i)
        bytes += static_cast<char>(static_cast<unsigned char>(value >> (8 * i)));
}

template <class Unsigned>
Unsigned number_at(const std::string& bytes, std::size_t offset)
{
    Unsigned value = 0;
    for (std::size_t i = 0; i < sizeof value; ++i)
        value |= static_cast<Unsigned>(Unsigned{static_cast<unsigned char>(bytes[offset + i])} << (8 * i));
    return value;
}

std::string header_of(const RecordingInfo& info)
{
    std::string bytes(magic, sizeof magic);
    bytes.back() = written_version;
    append(bytes, static_cast<std::uint32_t>(info.dim));
    append(bytes, static_cast<std::uint32_t>(info.coordinate_bytes));
    append(bytes, info.objects);
    append(bytes, static_cast<std::uint32_t>(info.description.size()));
    append(bytes, info.frames);
    append(bytes, std::bit_cast<std::uint64_t>(info.frames_per_second));
    bytes += info.description;
    append(bytes, fnv1a(bytes));
    return bytes;
}

std::size_t planes_size(int dim, std::size_t coordinate_bytes, std::uint32_t objects)
{
    return 4 + 2 * static_cast<std::size_t>(dim) * coordinate_bytes * objects;
}

template <class T>
using Bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;

/// Integers in the order of the numbers, so that near numbers have a small difference.
template <class T>
Bits<T> to_ordered(T value)
{
    const auto bits = std::bit_cast<Bits<T>>(value);
    constexpr Bits<T> sign = Bits<T>{1} << (8 * sizeof(T) - 1);
    return (bits & sign) != 0 ? ~bits : bits | sign;
}
template <class T>
T from_ordered(Bits<T> ordered)
{
    constexpr Bits<T> sign = Bits<T>{1} << (8 * sizeof(T) - 1);
    return std::bit_cast<T>((ordered & sign) != 0 ? ordered & ~sign : ~ordered);
}

/// Goes through the coordinates in the order they are stored in, with what is expected of each from what a
/// reader knows by then. Plain sums of numbers of type T, which every machine rounds alike.
/// visit(coordinate, object, expected) returns the true value.
template <int Dim, class T, class Visit>
void with_expected(const Aabb<Dim, T>* last, const Aabb<Dim, T>* before_last, std::uint64_t frame,
                   std::uint32_t objects, Visit visit)
{
    const auto finite_or = [](T expected, T otherwise) {
        return std::isfinite(expected) ? expected : otherwise;
    };
    for (int d = 0; d < Dim; ++d)
        for (std::uint32_t i = 0; i < objects; ++i) {
            T expected = 0;
            if (frame == 1) expected = last[i].lo[d];
            if (frame >= 2)
                expected = finite_or(last[i].lo[d] + (last[i].lo[d] - before_last[i].lo[d]), last[i].lo[d]);
            const T lo = visit(2 * d, i, expected);
            // An upper bound moves like the lower one, except for rotation.
            expected = frame == 0 ? lo : finite_or(last[i].hi[d] + (lo - last[i].lo[d]), last[i].hi[d]);
            visit(2 * d + 1, i, expected);
        }
}

std::string system_message()
{
    return std::error_code(errno, std::generic_category()).message();
}

} // namespace

template <int Dim, Coordinate T>
RecordingWriter<Dim, T>::RecordingWriter(std::filesystem::path path, std::uint32_t objects,
                                         double frames_per_second, std::string description)
    : path_(std::move(path)), info_{Dim, sizeof(T), objects, 0, frames_per_second, std::move(description)}
{
    if (info_.description.size() > longest_description)
        throw std::invalid_argument("the description of a recording has at most 65536 bytes");
    attempt([&] {
        file_.emplace(path_);
        file_->write(header_of(info_)); // once more at the end, with the number of frames
    });
}

template <int Dim, Coordinate T>
RecordingWriter<Dim, T>::~RecordingWriter() = default;

template <int Dim, Coordinate T>
template <class Work>
void RecordingWriter<Dim, T>::attempt(const Work& work) const
{
    try {
        work();
    } catch (const std::system_error& error) {
        throw std::runtime_error(jostle_system::text_of(path_) +
                                 ": can't be written: " + error.code().message());
    }
}

template <int Dim, Coordinate T>
void RecordingWriter<Dim, T>::add_frame(std::span<const Aabb<Dim, T>> boxes)
{
    if (boxes.size() != info_.objects)
        throw std::invalid_argument("a frame of " + std::to_string(boxes.size()) +
                                    " boxes in a recording of " + std::to_string(info_.objects) + " objects");
    const std::string block = pack(boxes);
    attempt([&] { file_->write(block); });
    ++info_.frames;
}

#ifdef JOSTLE_WITH_ZSTD
template <int Dim, Coordinate T>
std::string RecordingWriter<Dim, T>::pack(std::span<const Aabb<Dim, T>> boxes)
{
    planes_.resize(planes_size(Dim, sizeof(T), info_.objects));
    for (std::size_t i = 0; i < 4; ++i)
        planes_[i] = static_cast<unsigned char>(info_.frames >> (8 * i));
    with_expected<Dim, T>(
        last_.data(), before_last_.data(), info_.frames, info_.objects,
        [&](int coordinate, std::uint32_t i, T expected) {
            const T value = coordinate % 2 == 0 ? boxes[i].lo[coordinate / 2] : boxes[i].hi[coordinate / 2];
            const Bits<T> difference = to_ordered(value) - to_ordered(expected);
            // Small differences of either sign to small numbers.
            const Bits<T> folded =
                static_cast<Bits<T>>(difference << 1) ^ (Bits<T>{0} - (difference >> (8 * sizeof(T) - 1)));
            const std::size_t plane = 4 + static_cast<std::size_t>(coordinate) * sizeof(T) * info_.objects;
            for (std::size_t b = 0; b < sizeof(T); ++b)
                planes_[plane + b * info_.objects + i] = static_cast<unsigned char>(folded >> (8 * b));
            return value;
        });
    before_last_.swap(last_);
    last_.assign(boxes.begin(), boxes.end());

    const std::unique_ptr<ZSTD_CCtx, std::size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
    if (!context) throw std::bad_alloc();
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, compression_level);
    ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
    packed_.resize(ZSTD_compressBound(planes_.size()));
    const std::size_t size =
        ZSTD_compress2(context.get(), packed_.data(), packed_.size(), planes_.data(), planes_.size());
    if (ZSTD_isError(size) != 0 || size > std::numeric_limits<std::uint32_t>::max())
        throw std::runtime_error(jostle_system::text_of(path_) + ": a frame of " +
                                 std::to_string(planes_.size()) + " bytes is too big for a recording");
    std::string block;
    append(block, static_cast<std::uint32_t>(size));
    block.append(reinterpret_cast<const char*>(packed_.data()), size);
    return block;
}
#else
template <int Dim, Coordinate T>
std::string RecordingWriter<Dim, T>::pack(std::span<const Aabb<Dim, T>> boxes)
{
    std::string block;
    append(block, static_cast<std::uint32_t>(boxes.size()));
    std::uint64_t sum = jostle::detail::start_of_sum(boxes.size());
    for (const Aabb<Dim, T>& box : boxes)
        for (const jostle::Vec<Dim, T>* const side : {&box.lo, &box.hi})
            for (const T bound : *side) {
                const auto bits = std::bit_cast<Bits<T>>(bound);
                sum = jostle::detail::add_to_sum(sum, bits);
                append(block, bits);
            }
    append(block, sum);
    return block;
}
#endif

template <int Dim, Coordinate T>
void RecordingWriter<Dim, T>::finish()
{
    attempt([&] {
        file_->write_over_start(header_of(info_));
        file_->commit();
    });
}

RecordingReader::RecordingReader(std::filesystem::path path)
    : RecordingReader(path, std::make_unique<std::ifstream>(path, std::ios::binary))
{
}

RecordingReader::RecordingReader(std::filesystem::path name, std::unique_ptr<std::istream> bytes)
    : path_(std::move(name)), file_(std::move(bytes))
{
    if (!*file_) fail("can't be read: " + system_message() + "; check the name and its permissions");

    std::string header(fixed_header, '\0');
    file_->read(header.data(), static_cast<std::streamsize>(header.size()));
    if (file_->bad()) fail("can't be read: " + system_message());
    if (!*file_ || std::memcmp(header.data(), magic, 7) != 0)
        fail("is no recording of moving boxes (.jrec); give one");
    plain_ = header[7] == 2;
    if (header[7] != magic[7] && !plain_)
        fail("is a recording of version " + std::to_string(static_cast<unsigned char>(header[7])) +
             " and this program reads versions 1 and 2; use a newer one");
    const auto description_size = number_at<std::uint32_t>(header, 20);
    if (description_size > longest_description) fail("was altered in its header; copy or record it again");
    header.resize(fixed_header + description_size + 8);
    read(header.data() + fixed_header, description_size + 8, "the header");
    const auto checksum = number_at<std::uint64_t>(header, header.size() - 8);
    header.resize(header.size() - 8);
    info_.dim = static_cast<int>(number_at<std::uint32_t>(header, 8));
    info_.coordinate_bytes = static_cast<int>(number_at<std::uint32_t>(header, 12));
    info_.objects = number_at<std::uint32_t>(header, 16);
    info_.frames = number_at<std::uint64_t>(header, 24);
    info_.frames_per_second = std::bit_cast<double>(number_at<std::uint64_t>(header, 32));
    info_.description = header.substr(fixed_header);
    if (checksum != fnv1a(header) || (info_.dim != 2 && info_.dim != 3) ||
        (info_.coordinate_bytes != 4 && info_.coordinate_bytes != 8))
        fail("was altered in its header; copy or record it again");
    frames_ = header.size() + 8;
    if (plain_ && info_.frames == ~std::uint64_t{0}) count_frames();
}

/// Of a recorder that wasn't closed: the frames that are complete.
void RecordingReader::count_frames()
{
    info_.frames = 0;
    file_->seekg(0, std::ios::end);
    const std::streamoff end = file_->tellg();
    if (!*file_ || end < 0) fail("wasn't closed by its recorder, and is a pipe; give a file");
    const std::uint64_t box_size = 2 * static_cast<std::uint64_t>(info_.dim * info_.coordinate_bytes);
    for (std::uint64_t at = frames_; at + 12 <= static_cast<std::uint64_t>(end);) {
        file_->seekg(static_cast<std::streamoff>(at));
        std::string size_bytes(4, '\0');
        read(size_bytes.data(), 4, "frame");
        const auto boxes = number_at<std::uint32_t>(size_bytes, 0);
        at += 12 + boxes * box_size;
        if (at > static_cast<std::uint64_t>(end)) break;
        info_.objects = std::max(info_.objects, boxes);
        ++info_.frames;
    }
    unfinished_ = true;
    file_->seekg(static_cast<std::streamoff>(frames_));
}

void RecordingReader::fail(const std::string& problem) const
{
    throw std::runtime_error(jostle_system::text_of(path_) + ": " + problem);
}

void RecordingReader::read(void* bytes, std::size_t size, const char* where)
{
    if (file_->read(static_cast<char*>(bytes), static_cast<std::streamsize>(size))) return;
    if (file_->bad()) fail("can't be read: " + system_message());
    fail_truncated(where);
}

void RecordingReader::fail_truncated(const char* where) const
{
    fail("is truncated: it ends inside " + std::string(where) +
         (frames_ > 0 ? " " + std::to_string(next_ + 1) + " of " + std::to_string(info_.frames) : "") +
         "; copy or record it again");
}

void RecordingReader::fail_altered() const
{
    fail("was altered in frame " + std::to_string(next_ + 1) + " of " + std::to_string(info_.frames) +
         "; copy or record it again");
}

/// The packed bytes of a frame, in steps: the size may be a lie.
void RecordingReader::read_block(std::size_t size)
{
    constexpr std::size_t step = std::size_t{1} << 20;
    for (std::size_t done = 0; done < size;) {
        const std::size_t count = std::min(step, size - done);
        packed_.resize(done + count);
        read(packed_.data() + done, count, "frame");
        done += count;
    }
    packed_.resize(size);
}

/// The planes of a frame, which are to have this many bytes. Memory is asked for as they come out, at most
/// twice as much as did: a few bytes can claim to hold gigabytes. All frames have the same size, so that the
/// second one finds its memory there.
void RecordingReader::unpack(std::size_t unpacked_size)
{
#ifndef JOSTLE_WITH_ZSTD
    (void)unpacked_size;
    fail("is compressed, which this program was built without (it has no zstd); give one that "
         "jostle::Recorder wrote");
#else
    if (ZSTD_getFrameContentSize(packed_.data(), packed_.size()) != unpacked_size) fail_altered();
    if (!unpacker_) unpacker_ = {ZSTD_createDCtx(), [](ZSTD_DCtx* context) { ZSTD_freeDCtx(context); }};
    if (!unpacker_) throw std::bad_alloc();
    ZSTD_DCtx_reset(unpacker_.get(), ZSTD_reset_session_only); // the frame before may have been a damaged one
    ZSTD_inBuffer in{packed_.data(), packed_.size(), 0};
    ZSTD_outBuffer out{nullptr, 0, 0};
    constexpr std::size_t first_step = std::size_t{1} << 16;
    for (std::size_t left = 1; left != 0;) { // 0 says that the frame is complete, its checksum right
        if (planes_.size() < unpacked_size && out.pos == planes_.size())
            planes_.resize(std::min(unpacked_size, std::max(first_step, 2 * planes_.size())));
        out.dst = planes_.data();
        out.size = std::min(unpacked_size, planes_.size());
        const std::size_t in_before = in.pos, out_before = out.pos;
        left = ZSTD_decompressStream(unpacker_.get(), &out, &in);
        const bool stuck = left != 0 && in.pos == in_before && out.pos == out_before;
        if (ZSTD_isError(left) != 0 || stuck) fail_altered();
    }
    if (out.pos != unpacked_size || in.pos != in.size) fail_altered();
#endif
}

template <int Dim, Coordinate T>
void RecordingReader::read_plain(std::vector<Aabb<Dim, T>>& boxes, std::uint32_t count)
{
    if (count > info_.objects) fail_altered();
    read_block(count * std::size_t{2 * Dim} * sizeof(T)); // first, as the number may be a lie
    std::string sum_bytes(8, '\0');
    read(sum_bytes.data(), 8, "frame");
    boxes.resize(count);
    std::uint64_t sum = jostle::detail::start_of_sum(count);
    const unsigned char* from = packed_.data();
    for (Aabb<Dim, T>& box : boxes)
        for (jostle::Vec<Dim, T>* const side : {&box.lo, &box.hi})
            for (T& bound : *side) {
                Bits<T> bits = 0;
                for (std::size_t b = 0; b < sizeof(T); ++b)
                    bits |= static_cast<Bits<T>>(Bits<T>{*from++} << (8 * b));
                sum = jostle::detail::add_to_sum(sum, bits);
                bound = std::bit_cast<T>(bits);
            }
    if (sum != number_at<std::uint64_t>(sum_bytes, 0)) fail_altered();
}

template <int Dim, Coordinate T>
bool RecordingReader::next(std::vector<Aabb<Dim, T>>& boxes)
{
    if (Dim != info_.dim || static_cast<int>(sizeof(T)) != info_.coordinate_bytes)
        throw std::logic_error("RecordingReader::next: not the dimension and type of the recording");
    if (next_ == info_.frames) {
        boxes.clear();
        if (!unfinished_ && file_->peek() != std::ifstream::traits_type::eof())
            fail("was altered: something follows its last frame; copy or record it again");
        return false;
    }
    std::string size_bytes(4, '\0');
    read(size_bytes.data(), 4, "frame");
    const auto size = number_at<std::uint32_t>(size_bytes, 0);
    if (plain_) {
        read_plain(boxes, size);
        ++next_;
        return true;
    }
    const std::size_t unpacked_size = planes_size(Dim, sizeof(T), info_.objects);
#ifdef JOSTLE_WITH_ZSTD
    if (size > ZSTD_compressBound(unpacked_size)) fail_altered();
#endif
    read_block(size);
    unpack(unpacked_size);
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < 4; ++i)
        number |= static_cast<std::uint32_t>(planes_[i]) << (8 * i);
    if (number != static_cast<std::uint32_t>(next_)) fail_altered();

    using Box = Aabb<Dim, T>;
    boxes.resize(info_.objects);
    with_expected<Dim, T>(
        reinterpret_cast<const Box*>(last_.data()), reinterpret_cast<const Box*>(before_last_.data()), next_,
        info_.objects, [&](int coordinate, std::uint32_t i, T expected) {
            const std::size_t plane = 4 + static_cast<std::size_t>(coordinate) * sizeof(T) * info_.objects;
            Bits<T> folded = 0;
            for (std::size_t b = 0; b < sizeof(T); ++b)
                folded |= static_cast<Bits<T>>(Bits<T>{planes_[plane + b * info_.objects + i]} << (8 * b));
            const Bits<T> difference = (folded >> 1) ^ (Bits<T>{0} - (folded & 1));
            const T value = from_ordered<T>(to_ordered(expected) + difference);
            jostle::Vec<Dim, T>& side = coordinate % 2 == 0 ? boxes[i].lo : boxes[i].hi;
            side[coordinate / 2] = value;
            return value;
        });
    before_last_.swap(last_);
    const auto* bytes = reinterpret_cast<const unsigned char*>(boxes.data());
    last_.assign(bytes, bytes + boxes.size() * sizeof(Box));
    ++next_;
    return true;
}

void RecordingReader::rewind()
{
    file_->clear();
    if (!file_->seekg(static_cast<std::streamoff>(frames_)))
        fail("is a pipe, which can't be read again; give a file");
    next_ = 0;
}

template class RecordingWriter<2, float>;
template class RecordingWriter<2, double>;
template class RecordingWriter<3, float>;
template class RecordingWriter<3, double>;
#define JOSTLE_INSTANTIATE(Dim, T) template bool RecordingReader::next(std::vector<Aabb<Dim, T>>&);
JOSTLE_INSTANTIATE(2, float)
JOSTLE_INSTANTIATE(2, double)
JOSTLE_INSTANTIATE(3, float)
JOSTLE_INSTANTIATE(3, double)
#undef JOSTLE_INSTANTIATE

} // namespace jostle_scenes
