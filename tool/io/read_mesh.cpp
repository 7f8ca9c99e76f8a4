// SPDX-License-Identifier: MIT
// Meshes through Assimp. Its importers weren't made for files that wish them ill, so they run in a process of
// their own, which may crash, with bounds on its time and its memory, which opens nothing but what lies in
// the mesh's folder, and which dies with its parent.
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <new>
#include <set>
#include <system_error>
#include <type_traits>
#include <utility>

#include <assimp/IOSystem.hpp>
#include <assimp/Importer.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include "boxes.hpp"
#include "input_file.hpp"
#include "tool/commands.hpp"
#include "tool/progress.hpp"
#include "tool/system/system.hpp"
#include "tool/text.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;

/// What is wanted of a scene: its triangles, their boxes, or those of its parts. A part is a mesh as one node
/// of the scene places it.
enum class Wanted
{
    triangles,
    boxes,
    boxes_of_parts
};

/// An `Item` is a MeshTriangle or an Aabb3f.
template <class Item>
class SceneItems
{
  public:
    SceneItems(const aiScene& scene, Wanted wanted) : scene_(scene), parts_(wanted == Wanted::boxes_of_parts)
    {
        if (scene.mRootNode == nullptr) return;
        // Nodes share meshes, so that few bytes can stand for many triangles: all the memory is asked for at
        // once, and refused at once.
        const std::uint64_t count = count_items(*scene.mRootNode);
        if (count > items.max_size()) throw std::bad_alloc();
        items.reserve(count);
        add_node(*scene.mRootNode, aiMatrix4x4());
    }
    std::vector<Item> items;

  private:
    static constexpr float infinity = std::numeric_limits<float>::infinity();
    static constexpr Aabb3f nothing = {{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};

    /// At least as many as there are.
    [[nodiscard]] std::uint64_t count_items(const aiNode& node) const
    {
        std::uint64_t count = 0;
        for (unsigned i = 0; i < node.mNumMeshes; ++i)
            count += parts_ ? 1 : mesh_of(node, i).mNumFaces;
        for (unsigned i = 0; i < node.mNumChildren; ++i)
            count += count_items(*node.mChildren[i]);
        return count;
    }

    [[nodiscard]] const aiMesh& mesh_of(const aiNode& node, unsigned i) const
    {
        if (node.mMeshes[i] >= scene_.mNumMeshes)
            throw UsageError("names a part that isn't there; export the mesh again");
        return *scene_.mMeshes[node.mMeshes[i]];
    }

    void add_node(const aiNode& node, const aiMatrix4x4& parent)
    {
        const aiMatrix4x4 placed = parent * node.mTransformation;
        for (unsigned i = 0; i < node.mNumMeshes; ++i)
            add_mesh(mesh_of(node, i), placed);
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
            MeshTriangle corners;
            for (unsigned corner = 0; corner < 3; ++corner) {
                if (face.mIndices[corner] >= mesh.mNumVertices)
                    throw UsageError("triangle " + std::to_string(triangles_) +
                                     " has a corner that isn't there; export the mesh again");
                const aiVector3D at = placed * mesh.mVertices[face.mIndices[corner]];
                if (!std::isfinite(at.x) || !std::isfinite(at.y) || !std::isfinite(at.z))
                    throw UsageError("triangle " + std::to_string(triangles_) +
                                     " has a corner that isn't finite; fix or drop the triangle");
                corners[corner] = {at.x, at.y, at.z};
            }
            any = true;
            ++triangles_;
            if constexpr (std::is_same_v<Item, MeshTriangle>) {
                items.push_back(corners);
            } else {
                Aabb3f box = parts_ ? part : nothing;
                for (const jostle::Vec3f& at : corners)
                    box = {jostle::min(box.lo, at), jostle::max(box.hi, at)};
                if (parts_)
                    part = box;
                else
                    items.push_back(box);
            }
        }
        if constexpr (std::is_same_v<Item, Aabb3f>)
            if (parts_ && any) items.push_back(part);
    }

    const aiScene& scene_;
    bool parts_;
    std::uint64_t triangles_ = 0;
};

// How much memory an importer may take: what Assimp needs for sound files, with a margin. Text takes it up to
// 25 times a file's size, and files that are compressed inside take more.
constexpr std::uint64_t least_memory = std::uint64_t{512} << 20;
constexpr std::uint64_t memory_per_byte = 128;

/// Bounds the memory of this process: to what it had at first, and to the rest for the files that it reads.
class MemoryBound
{
  public:
    MemoryBound() : at_first_(present()) { set(); }
    void add_file(std::uint64_t size)
    {
        read_ += std::min(size, std::uint64_t{1} << 48);
        set();
    }

  private:
    /// What RLIMIT_DATA counts: all memory that is this process's own to write to.
    static std::uint64_t present()
    {
        std::uint64_t pages = 0;
        if (std::FILE* const file = std::fopen("/proc/self/statm", "r")) {
            if (std::fscanf(file, "%*u %*u %*u %*u %*u %lu", &pages) != 1) pages = 0;
            std::fclose(file);
        }
        return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
    }
    void set() const
    {
        rlimit limit;
        if (getrlimit(RLIMIT_DATA, &limit) != 0) return;
        limit.rlim_cur = std::min<rlim_t>(limit.rlim_max, at_first_ + least_memory + memory_per_byte * read_);
        setrlimit(RLIMIT_DATA, &limit);
    }
    std::uint64_t at_first_, read_ = 0;
};

/// A file in memory, which the operating system reads as it is looked at.
class MappedFile : public Assimp::MemoryIOStream
{
  public:
    MappedFile(const void* bytes, std::size_t size)
        : MemoryIOStream(static_cast<const std::uint8_t*>(bytes), size), bytes_(bytes), size_(size)
    {
    }
    ~MappedFile() override { munmap(const_cast<void*>(bytes_), size_); }

  private:
    const void* bytes_;
    std::size_t size_;
};

/// The mesh's file, and those in its folder and below that it names: their names may lead nowhere else, not
/// by "..", nor by a link.
class MeshFolder : public Assimp::IOSystem
{
  public:
    MeshFolder(const std::string& mesh, MemoryBound& memory) : mesh_(mesh), memory_(memory)
    {
        std::error_code error;
        folder_ = std::filesystem::canonical(std::filesystem::absolute(mesh).parent_path(), error);
    }

    /// Of the files that were asked for, the first that lies elsewhere; empty if there was none.
    [[nodiscard]] const std::string& refused() const { return refused_; }

    [[nodiscard]] bool Exists(const char* name) const override { return !place(name).empty(); }
    [[nodiscard]] char getOsSeparator() const override { return '/'; }
    Assimp::IOStream* Open(const char* name, const char* mode) override
    {
        const std::filesystem::path path = place(name);
        if (path.empty() || std::strpbrk(mode, "wa+") != nullptr) return nullptr;
        const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
        if (fd < 0) return nullptr;
        struct stat status;
        void* bytes = MAP_FAILED;
        std::size_t size = 0;
        if (fstat(fd, &status) == 0 && S_ISREG(status.st_mode) && status.st_size > 0) {
            size = static_cast<std::size_t>(status.st_size);
            bytes = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, fd, 0);
        }
        close(fd);
        if (bytes == MAP_FAILED) return nullptr;
        if (counted_.insert({status.st_dev, status.st_ino}).second) memory_.add_file(size);
        return new MappedFile(bytes, size);
    }
    void Close(Assimp::IOStream* file) override { delete file; }
    bool CreateDirectory(const std::string&) override { return false; }
    bool DeleteFile(const std::string&) override { return false; }

  private:
    /// Where the file really lies; empty if there is none, or none that may be read.
    [[nodiscard]] std::filesystem::path place(const char* name) const
    {
        std::error_code error;
        const std::filesystem::path path = std::filesystem::canonical(name, error);
        if (error || name == mesh_) return path;
        const auto [end, rest] = std::mismatch(folder_.begin(), folder_.end(), path.begin(), path.end());
        if (end == folder_.end() && !folder_.empty()) return path;
        if (refused_.empty()) refused_ = name;
        return {};
    }

    const std::string& mesh_;
    MemoryBound& memory_;
    std::filesystem::path folder_;
    std::set<std::pair<dev_t, ino_t>> counted_;
    mutable std::string refused_;
};

bool out_of_memory = false; // Assimp makes text of exceptions

template <class Item>
std::vector<Item> import_scene(const std::string& path, Wanted wanted)
{
    std::set_new_handler([] {
        out_of_memory = true;
        throw std::bad_alloc();
    });
    MemoryBound memory;
    Assimp::Importer importer;
    auto* const folder = new MeshFolder(path, memory);
    importer.SetIOHandler(folder); // which takes it
    const aiScene* scene = importer.ReadFile(path, aiProcess_Triangulate);
    if (out_of_memory) throw std::bad_alloc();
    if (scene == nullptr && !folder->refused().empty())
        throw UsageError(
            "names the file " + quote(folder->refused()) +
            ", which is outside of its folder; put all that belongs to the mesh into one folder");
    if (scene == nullptr)
        throw UsageError("can't be read as a mesh (" + shortened(importer.GetErrorString(), 200) +
                         "); check or export it again");
    SceneItems<Item> found(*scene, wanted);
    if (found.items.empty()) throw UsageError("has no triangles; give a mesh with faces");
    return std::move(found.items);
}

/// Whether all of it could be sent.
bool send(int to, const void* data, std::size_t size)
{
    try {
        jostle_system::write_all(to, {static_cast<const char*>(data), size});
        return true;
    } catch (const std::system_error&) {
        return false; // the parent is gone
    }
}

constexpr char tag_items = 'B', tag_error = 'E';

/// The child's whole life: sends a tag and then the items or the message.
template <class Item>
[[noreturn]] void import_and_send(int to, const std::string& path, Wanted wanted, std::uint64_t size)
{
    // Importers print warnings of their own; the parent's one line says it all.
    if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
        dup2(nowhere, STDOUT_FILENO);
        dup2(nowhere, STDERR_FILENO);
    }
    // On some damaged files an importer never ends. Sound ones take well under a second per megabyte.
    const rlim_t seconds = 60 + (size >> 16);
    rlimit limit;
    if (getrlimit(RLIMIT_CPU, &limit) == 0 && limit.rlim_cur > seconds) {
        limit.rlim_cur = seconds;
        setrlimit(RLIMIT_CPU, &limit);
    }
    const rlimit no_core{0, 0};
    setrlimit(RLIMIT_CORE, &no_core);
    std::string message;
    try {
        const std::vector<Item> items = import_scene<Item>(path, wanted);
        const bool sent = send(to, &tag_items, 1) && send(to, items.data(), items.size() * sizeof(Item));
        _exit(sent ? 0 : 1);
    } catch (const std::bad_alloc&) {
        message = "needs more memory than a valid mesh of its size; check it, or export it again";
    } catch (const std::exception& error) {
        message = error.what();
    }
    _exit(send(to, &tag_error, 1) && send(to, message.data(), message.size()) ? 0 : 1);
}

struct Descriptor
{
    int fd;
    ~Descriptor() { close(fd); }
};

/// What the child sends.
template <class Item>
std::vector<Item> read_items(const std::string& path, Wanted wanted)
{
    const std::optional<std::uint64_t> size = InputFile(path).size();
    if (!size)
        throw UsageError(path + ": is no regular file, and a mesh is read more than once; save it to a file");
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), "pipe");
    const Descriptor from{ends[0]};
    const pid_t parent = getpid();
    const pid_t child = fork();
    if (child == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (getppid() != parent) _exit(1); // it was gone before
        close(ends[0]);
        import_and_send<Item>(ends[1], path, wanted, *size);
    }
    const int fork_error = errno;
    close(ends[1]);
    if (child < 0) throw std::system_error(fork_error, std::generic_category(), "fork");

    const Progress progress("reading " + path, 0);
    char tag = 0;
    std::string message;
    std::vector<Item> items;
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
            items.resize((received + bytes.size() + sizeof(Item) - 1) / sizeof(Item));
            if (!bytes.empty())
                std::memcpy(reinterpret_cast<char*>(items.data()) + received, bytes.data(), bytes.size());
            received += bytes.size();
        }
    }
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR)
        ;
    if (tag == tag_error) throw UsageError(path + ": " + message);
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || tag != tag_items || received % sizeof(Item) != 0)
        throw UsageError(
            path + ": is damaged: the mesh importer (Assimp) crashed on it or found no end; export it again");
    if (items.size() > ~std::uint32_t{0})
        throw UsageError(path + ": has more triangles than 32 bits can number; split it");
    return items;
}

} // namespace

bool is_mesh_extension(const std::string& extension)
{
    return extension.size() > 1 && Assimp::Importer().IsExtensionSupported(extension);
}

BoxSet read_mesh(const std::string& path, bool parts)
{
    BoxSet set;
    set.boxes = read_items<Aabb3f>(path, parts ? Wanted::boxes_of_parts : Wanted::boxes);
    return set;
}

std::vector<MeshTriangle> read_triangles(const std::string& path)
{
    return read_items<MeshTriangle>(path, Wanted::triangles);
}

} // namespace jostle_tool
