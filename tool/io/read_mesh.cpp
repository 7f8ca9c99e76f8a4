// SPDX-License-Identifier: MIT
// Meshes through Assimp, in a process of its own: a damaged file can crash an importer, and a message that
// names the file is worth more than a core dump.
#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>

#include <assimp/Importer.hpp>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "boxes.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;

/// The boxes of a scene's triangles, or of its parts: a part is a mesh as one node of the scene places it.
class SceneBoxes
{
  public:
    SceneBoxes(const aiScene& scene, bool parts) : scene_(scene), parts_(parts)
    {
        if (scene.mRootNode != nullptr) add_node(*scene.mRootNode, aiMatrix4x4());
    }
    std::vector<Aabb3f> boxes;

  private:
    static constexpr float infinity = std::numeric_limits<float>::infinity();
    static constexpr Aabb3f nothing = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};

    void add_node(const aiNode& node, const aiMatrix4x4& parent)
    {
        const aiMatrix4x4 placed = parent * node.mTransformation;
        for (unsigned i = 0; i < node.mNumMeshes; ++i)
            add_mesh(*scene_.mMeshes[node.mMeshes[i]], placed);
        for (unsigned i = 0; i < node.mNumChildren; ++i)
            add_node(*node.mChildren[i], placed);
    }

    void add_mesh(const aiMesh& mesh, const aiMatrix4x4& placed)
    {
        Aabb3f part = nothing;
        bool any = false;
        for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
            const aiFace& face = mesh.mFaces[f];
            if (face.mNumIndices != 3) continue; // points and lines stay what they are
            Aabb3f triangle = nothing;
            for (unsigned corner = 0; corner < 3; ++corner) {
                if (face.mIndices[corner] >= mesh.mNumVertices)
                    throw UsageError("triangle " + std::to_string(triangles_) +
                                     " has a corner that isn't there; export the mesh again");
                const aiVector3D at = placed * mesh.mVertices[face.mIndices[corner]];
                if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z))
                    throw UsageError("triangle " + std::to_string(triangles_) +
                                     " has a corner that isn't finite; mend or drop the triangle");
                include(triangle, at);
                include(part, at);
            }
            any = true;
            ++triangles_;
            if (!parts_) boxes.push_back(triangle);
        }
        if (parts_ && any) boxes.push_back(part);
    }

    static void include(Aabb3f& box, const aiVector3D& at)
    {
        for (unsigned d = 0; d < 3; ++d) {
            box.lo[d] = std::min(box.lo[d], at[d]);
            box.hi[d] = std::max(box.hi[d], at[d]);
        }
    }

    const aiScene& scene_;
    bool parts_;
    std::uint64_t triangles_ = 0;
};

std::vector<Aabb3f> import(const std::string& path, bool parts)
{
    Assimp::Importer importer;
    const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
    if (scene == nullptr)
        throw UsageError("can't be read as a mesh (" + std::string(importer.GetErrorString()) +
                         "); check or export it again");
    SceneBoxes found(*scene, parts);
    if (found.boxes.empty()) throw UsageError("has no triangles; give a mesh with faces");
    return std::move(found.boxes);
}

bool write_all(int to, const void* data, std::size_t size)
{
    for (const char* bytes = static_cast<const char*>(data); size != 0;) {
        const ssize_t written = write(to, bytes, size);
        if (written < 0) {
            if (errno == EINTR) continue;
            return false;
        }
        bytes += written;
        size -= static_cast<std::size_t>(written);
    }
    return true;
}

constexpr char tag_boxes = 'B', tag_error = 'E';

/// The child's whole life: sends a tag and then the boxes or the message.
[[noreturn]] void import_and_send(int to, const std::string& path, bool parts)
{
    // Importers print warnings of their own; the parent's one line says it all.
    if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
        dup2(nowhere, STDOUT_FILENO);
        dup2(nowhere, STDERR_FILENO);
    }
    // On some damaged files an importer never ends. Sound ones take well under a second per megabyte.
    std::error_code no_size;
    const std::uintmax_t size = std::filesystem::file_size(path, no_size);
    const rlim_t seconds = 60 + (no_size ? 0 : size >> 16);
    rlimit limit;
    if (getrlimit(RLIMIT_CPU, &limit) == 0 && limit.rlim_cur > seconds) {
        limit.rlim_cur = seconds;
        setrlimit(RLIMIT_CPU, &limit);
    }
    std::string message;
    try {
        const std::vector<Aabb3f> boxes = import(path, parts);
        const bool sent =
            write_all(to, &tag_boxes, 1) && write_all(to, boxes.data(), boxes.size() * sizeof(Aabb3f));
        _exit(sent ? 0 : 1);
    } catch (const std::bad_alloc&) {
        message = "needs more memory than there is; check or export it again";
    } catch (const std::exception& error) {
        message = error.what();
    }
    _exit(write_all(to, &tag_error, 1) && write_all(to, message.data(), message.size()) ? 0 : 1);
}

struct Descriptor
{
    int fd;
    ~Descriptor() { close(fd); }
};

} // namespace

bool is_mesh_extension(const std::string& extension)
{
    return extension.size() > 1 && Assimp::Importer().IsExtensionSupported(extension);
}

BoxSet read_mesh(const std::string& path, bool parts)
{
    int ends[2];
    if (pipe(ends) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
    const Descriptor from{ends[0]};
    const pid_t child = fork();
    if (child == 0) import_and_send(ends[1], path, parts);
    const int fork_error = errno;
    close(ends[1]);
    if (child < 0) throw std::system_error(fork_error, std::generic_category(), "fork");

    const Progress progress("reading " + path, 0);
    char tag = 0;
    std::string message;
    std::vector<Aabb3f> boxes;
    std::size_t received = 0; // bytes after the tag
    std::vector<char> buffer(std::size_t{1} << 18);
    for (;;) {
        const ssize_t got = read(from.fd, buffer.data(), buffer.size());
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) break;
        std::string_view bytes(buffer.data(), static_cast<std::size_t>(got));
        if (tag == 0) {
            tag = bytes.front();
            bytes.remove_prefix(1);
        }
        if (tag == tag_error) {
            message += bytes;
        } else {
            boxes.resize((received + bytes.size() + sizeof(Aabb3f) - 1) / sizeof(Aabb3f));
            if (!bytes.empty())
                std::memcpy(reinterpret_cast<char*>(boxes.data()) + received, bytes.data(), bytes.size());
            received += bytes.size();
        }
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    if (tag == tag_error) throw UsageError(path + ": " + message);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || tag != tag_boxes || received % sizeof(Aabb3f) != 0)
        throw UsageError(
            path + ": is damaged: the mesh importer (Assimp) crashed on it or found no end; export it again");
    if (boxes.size() > ~std::uint32_t{0})
        throw UsageError(path + ": has more triangles than 32 bits can number; split it");
    BoxSet set;
    set.boxes = std::move(boxes);
    return set;
}

} // namespace jostle_tool
