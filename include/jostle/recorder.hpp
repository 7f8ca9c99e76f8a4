// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace detail {
/// The checksum of a recording's frame: of the number of its boxes, then of their bounds in the file's order.
[[nodiscard]] constexpr std::uint64_t add_to_sum(std::uint64_t sum, std::uint64_t bits) noexcept
{
    return (sum ^ bits) * 0x100000001b3u; // FNV-1a's step, a number at a time
}
[[nodiscard]] constexpr std::uint64_t start_of_sum(std::uint64_t boxes) noexcept
{
    return add_to_sum(0xcbf29ce484222325u, boxes);
}
} // namespace detail

/// Writes a program's boxes to a file, frame by frame, for `jostle compare`, which times every competitor on
/// them, and for `jostle demo --recording`. It takes three lines and needs no library:
///
///     jostle::Recorder<3, float> recorder("mine.jrec"); // once
///     recorder.frame(boxes);                            // in each frame: any BoxView or container of boxes
///     recorder.close();                                 // at the end
///
/// then:
///
///     jostle compare mine.jrec
///
/// Frames    may have different numbers of boxes. Box i of a frame and box i of the next one count as the
///           same object.
/// Exact     bounds are stored to the last bit. They aren't checked, so invalid ones are recorded too.
/// File      uncompressed: 24 bytes a box of 3D floats. It has all frames written so far, however the program
///           ends. An existing file is replaced.
/// Errors    never disturb the recorded program: only std::bad_alloc is thrown. After the first error calls
///           return false, nothing more is written, and problem() says what went wrong.
/// Threads   one call at a time.
/// Cost      about that of copying the boxes.
template <int Dim, Coordinate T>
class Recorder
{
  public:
    /// `frames_per_second` is the frame rate of the recorded motion, finite, or 0 if it has none.
    /// `description` says where the boxes come from: at most 65,536 bytes of UTF-8.
    explicit Recorder(std::string path, double frames_per_second = 0, std::string description = {})
        : path_(std::move(path)), frames_per_second_(frames_per_second), description_(std::move(description))
    {
        if (description_.size() > 65'536) {
            problem_ = "the description of a recording has at most 65536 bytes";
            return;
        }
        if (!(frames_per_second_ >= 0 && frames_per_second_ <= std::numeric_limits<double>::max())) {
            problem_ = "frames_per_second must be 0 or more and finite, and is " +
                       std::to_string(frames_per_second_);
            return;
        }
        file_ = std::fopen(path_.c_str(), "wb");
        if (file_ == nullptr)
            fail();
        else
            write_header(~std::uint64_t{0}); // "until the end", until close() knows better
    }
    Recorder(Recorder&& other) noexcept
        : path_(std::move(other.path_)),
          frames_per_second_(other.frames_per_second_),
          description_(std::move(other.description_)),
          problem_(std::move(other.problem_)),
          file_(std::exchange(other.file_, nullptr)),
          frames_(other.frames_),
          most_(other.most_),
          bytes_(std::move(other.bytes_))
    {
    }
    Recorder& operator=(Recorder&&) = delete;
    ~Recorder() { close(); }

    /// Writes a frame of at most 2^32 - 1 boxes.
    bool frame(const BoxView<Dim, T>& boxes)
    {
        if (problem_.empty() && file_ == nullptr)
            problem_ = path_ + ": is closed; frames come before close()";
        if (problem_.empty() && boxes.size() > 0xffffffffu)
            problem_ = path_ + ": a frame has at most 4294967295 boxes";
        if (!problem_.empty()) return false;
        bytes_.resize(4 + boxes.size() * 2 * Dim * sizeof(T) + 8);
        unsigned char* to = bytes_.data();
        put(to, static_cast<std::uint32_t>(boxes.size()));
        std::uint64_t sum = detail::start_of_sum(boxes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            for (int side = 0; side < 2; ++side)
                for (int d = 0; d < Dim; ++d) {
                    const auto bits = bits_of(side == 0 ? boxes.lo(d, i) : boxes.hi(d, i));
                    sum = detail::add_to_sum(sum, bits);
                    put(to, bits);
                }
        put(to, sum);
        if (!write()) return false;
        most_ = std::max(most_, static_cast<std::uint32_t>(boxes.size()));
        ++frames_;
        return true;
    }

    /// Completes the file. No frame may follow. The destructor does the same.
    bool close()
    {
        if (file_ == nullptr) return problem_.empty();
        if (problem_.empty()) {
            if (std::fseek(file_, 0, SEEK_SET) == 0)
                write_header(frames_);
            else
                fail();
        }
        // Some file systems find out only now that the disk is full.
        if (std::fclose(std::exchange(file_, nullptr)) != 0 && problem_.empty()) fail();
        return problem_.empty();
    }

    /// The first error, with the file's name and the system's reason; empty if there was none.
    [[nodiscard]] const std::string& problem() const noexcept { return problem_; }
    /// The number of frames so far.
    [[nodiscard]] std::uint64_t frames() const noexcept { return frames_; }

  private:
    template <class Number>
    static auto bits_of(Number number) noexcept
    {
        std::conditional_t<sizeof(Number) == 4, std::uint32_t, std::uint64_t> bits;
        std::memcpy(&bits, &number, sizeof bits);
        return bits;
    }
    /// Little-endian, whatever the machine.
    template <class Unsigned>
    static void put(unsigned char*& to, Unsigned value) noexcept
    {
        for (std::size_t i = 0; i < sizeof value; ++i)
            *to++ = static_cast<unsigned char>(value >> (8 * i));
    }
    /// docs/guide/tool.md describes the format.
    void write_header(std::uint64_t frames)
    {
        bytes_.resize(40 + description_.size() + 8);
        unsigned char* to = bytes_.data();
        for (const char c : {'J', 'O', 'S', 'T', 'L', 'R', 'E', '\2'})
            *to++ = static_cast<unsigned char>(c);
        put(to, static_cast<std::uint32_t>(Dim));
        put(to, static_cast<std::uint32_t>(sizeof(T)));
        put(to, most_);
        put(to, static_cast<std::uint32_t>(description_.size()));
        put(to, frames);
        put(to, bits_of(frames_per_second_));
        to = std::copy(description_.begin(), description_.end(), to);
        std::uint64_t sum = 0xcbf29ce484222325u;
        for (const unsigned char* byte = bytes_.data(); byte != to; ++byte)
            sum = detail::add_to_sum(sum, *byte);
        put(to, sum);
        write();
    }
    bool write()
    {
        // Flushed at once: what is still in a buffer is lost if the program is killed.
        if (std::fwrite(bytes_.data(), 1, bytes_.size(), file_) == bytes_.size() && std::fflush(file_) == 0)
            return true;
        fail();
        return false;
    }
    void fail()
    {
        const int reason = errno;
        problem_ =
            path_ + ": can't be written: " + std::error_code(reason, std::generic_category()).message();
    }

    std::string path_;
    double frames_per_second_;
    std::string description_;
    std::string problem_;
    std::FILE* file_ = nullptr;
    std::uint64_t frames_ = 0;
    std::uint32_t most_ = 0; // boxes in a frame
    std::vector<unsigned char> bytes_;
};

JOSTLE_NAMESPACE_END
