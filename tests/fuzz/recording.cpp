// SPDX-License-Identifier: MIT
// Recordings. Checksums would refuse nearly all bytes, so that the file is put together here, with checksums
// that are right: as a writer makes it, or with lies. Without lies all frames are read; with them, frames or
// a refusal.
#include <zstd.h>

#include <cstring>
#include <sstream>

#include "jostle/recorder.hpp"
#include "read_file.hpp"
#include "tool/scenes/recording.hpp"

namespace {

using Bytes = std::vector<std::uint8_t>;

template <class N>
void put(Bytes& bytes, N number)
{
    for (std::size_t i = 0; i < sizeof number; ++i)
        bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
}

/// The file, and what its frames hold if there is no lie in it.
struct File
{
    Bytes bytes;
    std::vector<Bytes> frames;
    std::uint32_t dim, coordinate_bytes;
    bool honest = true;

    explicit File(fuzz::Input& in)
    {
        const auto lie = [&](auto truth) {
            if (!in.one_in(32)) return truth;
            honest = false;
            return in.number<decltype(truth)>();
        };
        const bool plain = in.below(2) == 0;
        const std::uint32_t objects = in.below(40), frame_count = in.below(5);
        dim = 2 + in.below(2);
        coordinate_bytes = 4 + 4 * in.below(2);
        const std::size_t box = 2 * std::size_t{dim} * coordinate_bytes;
        for (const char letter : {'J', 'O', 'S', 'T', 'L', 'R', 'E'})
            put(bytes, static_cast<std::uint8_t>(letter));
        put(bytes, lie(static_cast<std::uint8_t>(plain ? 2 : 1)));
        put(bytes, lie(dim));
        put(bytes, lie(coordinate_bytes));
        put(bytes, lie(objects));
        const std::uint32_t words = in.below(20);
        put(bytes, lie(words));
        const bool closed = !plain || in.below(4) != 0;
        put(bytes, lie(closed ? std::uint64_t{frame_count} : ~std::uint64_t{0}));
        put(bytes, in.number<std::uint64_t>()); // frames per second: any
        bytes.resize(bytes.size() + words, 'x');
        std::uint64_t sum = 0xcbf29ce484222325u;
        for (const std::uint8_t byte : bytes)
            sum = jostle::detail::add_to_sum(sum, byte);
        put(bytes, lie(sum));
        for (std::uint32_t k = 0; k < frame_count; ++k) {
            const std::uint32_t count = plain ? in.below(objects + 1) : objects;
            Bytes frame = in.some(count * box);
            frame.resize(count * box);
            plain ? put_plain(frame, lie(count), lie) : put_packed(frame, lie(k), lie);
            frames.push_back(std::move(frame));
        }
        if (in.one_in(16)) {
            honest = false;
            bytes.resize(in.below(static_cast<std::uint32_t>(bytes.size()) + 9));
        }
    }

  private:
    template <class Lie>
    void put_plain(const Bytes& frame, std::uint32_t count, const Lie& lie)
    {
        put(bytes, count);
        std::uint64_t sum = jostle::detail::start_of_sum(count);
        for (std::size_t at = 0; at < frame.size(); at += coordinate_bytes) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, frame.data() + at, coordinate_bytes); // little-endian, as who runs fuzzers is
            sum = jostle::detail::add_to_sum(sum, bits);
        }
        bytes.insert(bytes.end(), frame.begin(), frame.end());
        put(bytes, lie(sum));
    }
    template <class Lie>
    void put_packed(const Bytes& frame, std::uint32_t number, const Lie& lie)
    {
        Bytes planes;
        put(planes, number);
        planes.insert(planes.end(), frame.begin(), frame.end());
        Bytes packed(ZSTD_compressBound(planes.size()));
        static ZSTD_CCtx* const context = ZSTD_createCCtx();
        ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
        packed.resize(ZSTD_compress2(context, packed.data(), packed.size(), planes.data(), planes.size()));
        packed[packed.size() / 2] = lie(packed[packed.size() / 2]);
        put(bytes, lie(static_cast<std::uint32_t>(packed.size())));
        bytes.insert(bytes.end(), packed.begin(), packed.end());
    }
};

/// The bytes of the frames, in the order of a recorder's file.
template <int Dim, class T>
std::vector<Bytes> read_frames(jostle_scenes::RecordingReader& reader)
{
    std::vector<Bytes> frames;
    std::vector<jostle::Aabb<Dim, T>> boxes;
    while (reader.next(boxes)) {
        fuzz::demand(boxes.size() <= reader.info().objects, "a frame with more boxes than the header says");
        fuzz::count_boxes(boxes.size());
        const auto* const bytes = reinterpret_cast<const std::uint8_t*>(boxes.data());
        frames.emplace_back(bytes, bytes + boxes.size() * sizeof boxes[0]);
    }
    reader.rewind();
    fuzz::demand(frames.empty() || reader.next(boxes), "no frame after a rewind");
    return frames;
}

} // namespace

JOSTLE_FUZZ_TARGET(recording)
{
    const bool raw = in.one_in(8);
    std::optional<File> made;
    if (!raw) made.emplace(in);
    const Bytes bytes = raw ? in.rest() : made->bytes;
    std::vector<Bytes> frames;
    try {
        jostle_scenes::RecordingReader reader(
            fuzz::input_name, std::make_unique<std::istringstream>(std::string(bytes.begin(), bytes.end())));
        const bool floats = reader.info().coordinate_bytes == 4;
        if (reader.info().dim == 3)
            frames = floats ? read_frames<3, float>(reader) : read_frames<3, double>(reader);
        else
            frames = floats ? read_frames<2, float>(reader) : read_frames<2, double>(reader);
    } catch (const std::runtime_error& error) {
        const std::string what = error.what();
        fuzz::demand(what.starts_with(fuzz::input_name), "a refusal that doesn't name the file");
        if (made && made->honest) fuzz::fail("a recording without a lie is refused: " + what);
        return;
    }
    if (!made || !made->honest) return;
    fuzz::demand(frames.size() == made->frames.size(), "another number of frames");
    for (std::size_t k = 0; k < frames.size(); ++k)
        fuzz::demand(frames[k].size() == made->frames[k].size(), "a frame with another number of boxes");
    if (made->bytes[7] == 2) fuzz::demand(frames == made->frames, "other boxes than were recorded");
}
