// SPDX-License-Identifier: MIT
// Instead of read_mesh.cpp, in builds without Assimp: recognises meshes, and reports them.
#include <algorithm>
#include <iterator>
#include <string_view>

#include "boxes.hpp"
#include "tool/commands.hpp"

namespace jostle_tool {

bool is_mesh_extension(const std::string& extension)
{
    constexpr std::string_view usual[] = {".3ds",  ".3mf", ".blend", ".dae", ".dxf",  ".fbx", ".glb",
                                          ".gltf", ".lwo", ".md2",   ".md3", ".ms3d", ".obj", ".off",
                                          ".ply",  ".stl", ".usdz",  ".x",   ".x3d"};
    return std::find(std::begin(usual), std::end(usual), extension) != std::end(usual);
}

BoxSet read_mesh(const std::string& path, bool)
{
    throw UsageError(
        path + ": is a mesh, and this build of jostle reads none, as it has no Assimp; give the boxes as "
               ".csv or .npy");
}

std::vector<MeshTriangle> read_triangles(const std::string& path)
{
    throw UsageError(path + ": this build of jostle reads no mesh, as it has no Assimp");
}

} // namespace jostle_tool
