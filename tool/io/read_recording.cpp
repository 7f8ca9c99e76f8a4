// SPDX-License-Identifier: MIT
#include <stdexcept>

#include "boxes.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"
#include "tool/scenes/recording.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

template <int Dim, class T>
BoxSet read_frame(jostle_scenes::RecordingReader& recording, const std::string& path, std::uint32_t frame)
{
    // A frame is stored as its difference from those before it, so all of them are read.
    Progress progress("reading " + path, std::uint64_t{frame} + 1);
    std::vector<jostle::Aabb<Dim, T>> boxes;
    for (std::uint64_t i = 0; i <= frame; ++i) {
        recording.next(boxes);
        progress.step();
    }
    BoxSet set;
    set.boxes = std::move(boxes);
    return set;
}

} // namespace

BoxSet read_recording(const std::string& path, std::uint32_t frame)
{
    try {
        jostle_scenes::RecordingReader recording(jostle_system::path_of(path));
        const jostle_scenes::RecordingInfo& info = recording.info();
        if (frame >= info.frames)
            throw UsageError(path + ": has " +
                             (info.frames == 0
                                  ? "no frames; record it again"
                                  : "frames 0 to " + std::to_string(info.frames - 1) + " and no frame " +
                                        std::to_string(frame) + "; choose one of them with --frame"));
        const bool floats = info.coordinate_bytes == 4;
        if (info.dim == 2)
            return floats ? read_frame<2, float>(recording, path, frame)
                          : read_frame<2, double>(recording, path, frame);
        return floats ? read_frame<3, float>(recording, path, frame)
                      : read_frame<3, double>(recording, path, frame);
    } catch (const UsageError&) {
        throw;
    } catch (const std::runtime_error& error) {
        throw UsageError(error.what()); // the reader's messages name the file and say what to do
    }
}

} // namespace jostle_tool
