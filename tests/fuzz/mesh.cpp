// SPDX-License-Identifier: MIT
// Meshes, as the tool reads them: in a process of their own. Any bytes under the names of several
// formats, and triangles that are written down as OBJ, OFF or STL, whose boxes are known.
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "read_file.hpp"

namespace {

/// Without PLY, on which the importer often finds no end: each time a minute until it is cut off.
const char* const extensions[] = {"obj", "off", "stl", "gltf", "glb", "dae",
                                  "3ds", "x3d", "dxf", "lwo",  "ms3d"};

/// A folder for the file, because importers go by its name. It is gone when the program ends.
class Folder
{
  public:
    Folder()
    {
        std::string made = (std::filesystem::temp_directory_path() / "jostle-fuzz-XXXXXX").string();
        if (mkdtemp(made.data()) == nullptr) std::perror("mkdtemp"), std::exit(2);
        path_ = made;
    }
    ~Folder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    [[nodiscard]] std::string write(const std::string& extension, const std::string& bytes) const
    {
        const std::filesystem::path name = path_ / ("mesh." + extension);
        std::ofstream file(name, std::ios::binary);
        file << bytes;
        if (!file.flush()) std::perror("mesh"), std::exit(2);
        return name.string();
    }

  private:
    std::filesystem::path path_;
};

using Triangle = std::array<jostle::Vec<3, float>, 3>;

/// Quarters, which every importer reads exactly. No two corners of a triangle are in one place.
std::vector<Triangle> some_triangles(fuzz::Input& in)
{
    std::vector<Triangle> triangles(1 + in.below(6));
    for (Triangle& triangle : triangles)
        for (std::size_t k = 0; k < 3; ++k)
            for (std::size_t d = 0; d < 3; ++d)
                triangle[k][d] = static_cast<float>(in.number<std::int8_t>()) / 4 + (d == k ? 100.0f : 0.0f);
    return triangles;
}

std::string text(const jostle::Vec<3, float>& at)
{
    char line[80];
    std::snprintf(line, sizeof line, "%.2f %.2f %.2f", static_cast<double>(at[0]), static_cast<double>(at[1]),
                  static_cast<double>(at[2]));
    return line;
}

std::string written(const std::vector<Triangle>& triangles, std::uint32_t format)
{
    std::string file, faces;
    if (format == 1)
        file =
            "OFF\n" + std::to_string(3 * triangles.size()) + " " + std::to_string(triangles.size()) + " 0\n";
    if (format == 2) file = "solid s\n";
    std::size_t next = 0;
    for (const Triangle& triangle : triangles) {
        if (format == 2) file += "facet normal 0 0 1\nouter loop\n";
        for (const auto& corner : triangle)
            file += (format == 0 ? "v " : format == 1 ? "" : "vertex ") + text(corner) + "\n";
        if (format == 2) file += "endloop\nendfacet\n";
        faces += format == 0 ? "f" : "3";
        for (std::size_t k = 0; k < 3; ++k)
            faces += " " + std::to_string(next++ + (format == 0 ? 1 : 0));
        faces += "\n";
    }
    return format == 2 ? file + "endsolid s\n" : file + faces;
}

} // namespace

JOSTLE_FUZZ_TARGET(mesh)
{
    static const Folder folder;
    const bool made = in.below(2) == 0;
    std::vector<Triangle> triangles;
    std::string bytes;
    const std::uint32_t format = in.below(made ? 3 : static_cast<std::uint32_t>(std::size(extensions)));
    if (made) {
        triangles = some_triangles(in);
        bytes = written(triangles, format);
    } else {
        const std::vector<std::uint8_t> rest = in.rest();
        bytes.assign(rest.begin(), rest.end());
    }
    if (fuzz::telling() && made) fuzz::tell("R\"(" + bytes + ")\"");
    const std::string name = folder.write(extensions[format], bytes);
    jostle_tool::BoxSet set;
    try {
        set = jostle_tool::read_mesh(name, !made && bytes.size() % 2 == 0);
    } catch (const jostle_tool::UsageError& error) {
        fuzz::demand(std::string(error.what()).starts_with(name), "a refusal that doesn't name the file");
        fuzz::demand(!made, "a mesh of good triangles is refused");
        return;
    }
    const auto* const boxes = std::get_if<std::vector<jostle::Aabb3f>>(&set.boxes);
    fuzz::demand(boxes != nullptr && !boxes->empty(), "neither boxes nor a refusal");
    for (const jostle::Aabb3f& box : *boxes)
        for (int d = 0; d < 3; ++d)
            fuzz::demand(box.lo[d] <= box.hi[d] && std::isfinite(box.lo[d]) && std::isfinite(box.hi[d]),
                         "a box that isn't valid was read");
    fuzz::count_boxes(boxes->size());
    if (!made) return;
    fuzz::demand(boxes->size() == triangles.size(), "another number of triangles");
    for (std::size_t i = 0; i < triangles.size(); ++i)
        for (std::size_t d = 0; d < 3; ++d) {
            const auto& [a, b, c] = triangles[i];
            fuzz::demand((*boxes)[i].lo[static_cast<int>(d)] == std::min({a[d], b[d], c[d]}) &&
                             (*boxes)[i].hi[static_cast<int>(d)] == std::max({a[d], b[d], c[d]}),
                         "another box than that of the triangle");
        }
}
