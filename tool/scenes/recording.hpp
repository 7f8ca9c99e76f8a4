// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "jostle/box.hpp"
#include "tool/system/unfinished_file.hpp"

struct ZSTD_DCtx_s;

/// Recordings of moving boxes: files `.jrec`, exact to the last bit, compact, the same on every platform.
///
/// A file is a header (with a checksum) and one block per frame, each compressed by zstd with a checksum of
/// its own, so that a reader holds one frame at a time and never hands out an altered one. A frame holds, for
/// each coordinate, the difference between what was recorded and what the two frames before let expect, as
/// byte planes: things that lie still or fly straight cost next to nothing. In a build without zstd a file is
/// one of jostle::Recorder's instead, uncompressed, and a compressed one can't be read, which the error says.
namespace jostle_scenes {

struct RecordingInfo
{
    int dim = 3;              ///< 2 or 3
    int coordinate_bytes = 4; ///< 4: float, 8: double
    /// In every frame; the most in any frame of a file that jostle::Recorder wrote.
    std::uint32_t objects = 0;
    std::uint64_t frames = 0;
    double frames_per_second = 0; ///< of the recorded motion; 0 if it has no time
    std::string description;      ///< UTF-8, where the boxes come from
};

/// Writes a recording, frame by frame, to an UnfinishedFile: nothing lies at `path` before `finish` has
/// returned, and a writer that is destroyed without leaves a file that was there as it was.
///
/// Errors   std::runtime_error naming the file and the reason.
/// Threads  one call at a time.
template <int Dim, jostle::Coordinate T>
class RecordingWriter
{
  public:
    RecordingWriter(std::filesystem::path path, std::uint32_t objects, double frames_per_second,
                    std::string description);
    RecordingWriter(const RecordingWriter&) = delete;
    RecordingWriter& operator=(const RecordingWriter&) = delete;
    ~RecordingWriter();

    /// Throws std::invalid_argument unless there is one box per object.
    void add_frame(std::span<const jostle::Aabb<Dim, T>> boxes);
    void finish();

  private:
    template <class Work>
    void attempt(const Work& work) const;
    std::string pack(std::span<const jostle::Aabb<Dim, T>> boxes); // a frame, as the file has it

    std::filesystem::path path_;
    RecordingInfo info_;
    std::optional<jostle_system::UnfinishedFile> file_;
    std::vector<jostle::Aabb<Dim, T>> last_, before_last_;
    std::vector<unsigned char> planes_, packed_;
};

/// Reads a recording, frame by frame, from a file or a pipe: what RecordingWriter wrote, or jostle::Recorder.
/// The constructor reads the header only. Memory grows with what a file holds, whatever sizes it claims.
///
/// Errors   std::runtime_error naming the file, what is wrong with it and what to do: it can't be read, is no
///          recording, is of a newer version, is truncated or was altered.
/// Threads  one call at a time.
class RecordingReader
{
  public:
    explicit RecordingReader(std::filesystem::path path);
    /// What a file of this name would hold.
    RecordingReader(std::filesystem::path name, std::unique_ptr<std::istream> bytes);

    [[nodiscard]] const RecordingInfo& info() const noexcept { return info_; }

    /// The next frame's boxes into `boxes`, whose memory is reused; false, and `boxes` empty, after the last.
    /// Dim and T must be those of `info`, else std::logic_error.
    template <int Dim, jostle::Coordinate T>
    bool next(std::vector<jostle::Aabb<Dim, T>>& boxes);
    /// Back to before the first frame; not of a pipe.
    void rewind();

  private:
    void read(void* bytes, std::size_t size, const char* where);
    [[noreturn]] void fail_truncated(const char* where) const;
    [[noreturn]] void fail(const std::string& problem) const;
    [[noreturn]] void fail_altered() const;
    void read_block(std::size_t size);
    void unpack(std::size_t unpacked_size);
    void count_frames();
    template <int Dim, jostle::Coordinate T>
    void read_plain(std::vector<jostle::Aabb<Dim, T>>& boxes, std::uint32_t count);

    std::filesystem::path path_;
    std::unique_ptr<std::istream> file_;
    RecordingInfo info_;
    bool plain_ = false;                            // of a jostle::Recorder
    bool unfinished_ = false;                       // it wasn't closed: its last frame may be cut off
    std::uint64_t frames_ = 0;                      // where they begin
    std::uint64_t next_ = 0;                        // frame
    std::vector<unsigned char> last_, before_last_; // of whatever type
    std::vector<unsigned char> planes_, packed_;
    std::shared_ptr<ZSTD_DCtx_s> unpacker_; // zstd's, once there is something to unpack
};

} // namespace jostle_scenes
