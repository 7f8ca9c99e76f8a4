// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "jostle/box.hpp"

namespace jostle_tool {

class InputFile;

/// The user's own names of the boxes, one text per box, all different.
class Ids
{
  public:
    [[nodiscard]] bool empty() const noexcept { return ends_.empty(); }
    [[nodiscard]] std::size_t size() const noexcept { return ends_.size(); }
    [[nodiscard]] std::string_view operator[](std::size_t i) const noexcept
    {
        const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
        return std::string_view(text_).substr(begin, ends_[i] - begin);
    }
    /// Every id is a number as JSON writes whole numbers (0, 17, -3; not 007 or -0) of at most 15 digits, so
    /// that it can stand in JSON unquoted and come back the same from every reader, also from those that
    /// take all numbers for doubles.
    [[nodiscard]] bool whole_numbers() const noexcept { return whole_numbers_; }

    /// Adds the id of the next box, unless an earlier box has it: then nothing is added and that box's
    /// position is returned.
    [[nodiscard]] std::optional<std::uint32_t> add(std::string_view id);

  private:
    void grow_table();

    std::string text_; // all ids, one after another: a string each would take several times the memory
    std::vector<std::size_t> ends_;
    std::vector<std::uint32_t> table_; // open addressing: position + 1, or 0 for a free slot
    bool whole_numbers_ = true;
};

/// Boxes of one file, in the file's own dimension and precision.
struct BoxSet
{
    std::variant<std::vector<jostle::Aabb2f>, std::vector<jostle::Aabb3f>, std::vector<jostle::Aabb2d>,
                 std::vector<jostle::Aabb3d>>
        boxes;
    Ids ids; ///< empty if the file names no ids: then positions stand for the boxes
};

struct ReadOptions
{
    bool parts = false;                 ///< meshes: one box per part rather than per triangle
    std::optional<std::uint32_t> frame; ///< recordings: which frame; the first if not given
};

/// Reads a file of boxes, once; its name's extension says what it is. "-" is CSV from stdin, as are a pipe
/// and /dev/stdin without an extension.
/// Throws UsageError for whatever is wrong with the file or doesn't fit the options.
/// Bounds that are NaN or inverted are found in CSV files, which have rows to name; elsewhere the search
/// finds them.
[[nodiscard]] BoxSet read_boxes(const std::string& path, const ReadOptions& options);

// One reader per format, called by read_boxes.
[[nodiscard]] BoxSet read_csv(InputFile& file);
[[nodiscard]] BoxSet read_npy(InputFile& file);
[[nodiscard]] BoxSet read_mesh(const std::string& path, bool parts);
using MeshTriangle = std::array<jostle::Vec3f, 3>; ///< its corners
/// The triangles of a mesh, in the order of their boxes.
[[nodiscard]] std::vector<MeshTriangle> read_triangles(const std::string& path);
[[nodiscard]] BoxSet read_recording(const std::string& path, std::uint32_t frame);
[[nodiscard]] bool is_mesh_extension(const std::string& extension);

/// The extension of a file name in lower case, with its dot; empty if it has none.
[[nodiscard]] std::string extension_of(const std::string& path);

} // namespace jostle_tool
