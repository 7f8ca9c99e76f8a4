// SPDX-License-Identifier: MIT
// jostle surface: what of a mesh is near itself, crosses itself, and meets on its way to another place.
#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bench_options.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "io/boxes.hpp"
#include "io/output_file.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/surface.hpp"
#include "numbers.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "rows.hpp"
#include "text.hpp"
#include "threads.hpp"
#include "tool/system/system.hpp"

namespace jostle_tool {

namespace {

using jostle::Surface;
using jostle::Vec3f;
using Vertices = std::array<std::uint32_t, 4>;

struct Options
{
    std::string before, after; // after: empty if nothing moves
    std::string json, pairs;   // empty: not wanted
    double distance = 0;
    std::uint32_t threads = 0;
};

/// A mesh, and where it moves to: corners at the same place, in both files, are one vertex.
class Mesh
{
  public:
    Mesh(const std::vector<MeshTriangle>& before, const std::vector<MeshTriangle>& after)
    {
        std::vector<Corner> corners;
        corners.reserve(3 * before.size());
        for (std::size_t k = 0; k < 3 * before.size(); ++k)
            corners.push_back({{place(before, k), after.empty() ? Vec3f{} : place(after, k)}, k});
        std::sort(corners.begin(), corners.end());
        std::vector<std::size_t> first(corners.size()); // the first corner at the same place
        for (std::size_t k = 0; k < corners.size(); ++k)
            first[corners[k].number] = k > 0 && corners[k].at == corners[k - 1].at
                                           ? first[corners[k - 1].number]
                                           : corners[k].number;
        std::vector<std::uint32_t> vertex_of(corners.size());
        for (std::size_t k = 0; k < corners.size(); ++k) {
            if (first[k] == k) {
                vertex_of[k] = static_cast<std::uint32_t>(from.size());
                from.push_back(place(before, k));
                if (!after.empty()) to.push_back(place(after, k));
            } else {
                vertex_of[k] = vertex_of[first[k]];
            }
        }
        for (std::size_t k = 0; k < before.size(); ++k) {
            const Surface::Triangle triangle{vertex_of[3 * k], vertex_of[3 * k + 1], vertex_of[3 * k + 2]};
            if (triangle[0] == triangle[1] || triangle[1] == triangle[2] || triangle[2] == triangle[0])
                continue;
            triangles.push_back(triangle);
            number_in_file.push_back(k);
        }
        surface = Surface(triangles, {}, {}, from.size());
        triangle_of_vertex_.resize(from.size());
        triangle_of_edge_.resize(surface.edges().size());
        for (std::size_t k = triangles.size(); k-- > 0;)
            for (std::size_t side = 0; side < 3; ++side) {
                triangle_of_vertex_[triangles[k][side]] = static_cast<std::uint32_t>(k);
                triangle_of_edge_[edge_between(triangles[k][side], triangles[k][(side + 1) % 3])] =
                    static_cast<std::uint32_t>(k);
            }
    }

    std::vector<Vec3f> from, to;
    std::vector<Surface::Triangle> triangles; ///< without those that are an edge or a point
    std::vector<std::size_t> number_in_file;  ///< of each triangle
    Surface surface;

    /// The first triangles of the file that have the vertex, or the edge.
    [[nodiscard]] std::size_t of_vertex(std::uint32_t vertex) const
    {
        return number_in_file[triangle_of_vertex_[vertex]];
    }
    [[nodiscard]] std::size_t of_edge(std::uint32_t edge) const
    {
        return number_in_file[triangle_of_edge_[edge]];
    }

  private:
    struct Corner
    {
        std::array<Vec3f, 2> at;
        std::size_t number;
        bool operator<(const Corner& other) const
        {
            for (std::size_t k = 0; k < 2; ++k)
                for (int d = 0; d < 3; ++d)
                    if (at[k][d] != other.at[k][d]) return at[k][d] < other.at[k][d];
            return number < other.number;
        }
    };
    static Vec3f place(const std::vector<MeshTriangle>& of, std::size_t corner)
    {
        return of[corner / 3][corner % 3];
    }
    [[nodiscard]] std::size_t edge_between(std::uint32_t a, std::uint32_t b) const
    {
        const Surface::Edge edge{std::min(a, b), std::max(a, b)};
        const auto edges = surface.edges();
        return static_cast<std::size_t>(std::lower_bound(edges.begin(), edges.end(), edge) - edges.begin());
    }
    std::vector<std::uint32_t> triangle_of_vertex_, triangle_of_edge_;
};

/// The file of --pairs.
class PairsFile
{
  public:
    explicit PairsFile(const std::string& name) : file_(name)
    {
        file_.write("found,kind,triangle_a,triangle_b,x,y,z,value\n");
    }
    void add(const char* found, const char* kind, std::size_t a, std::size_t b, const Vec3f& at, float value)
    {
        char line[200];
        std::snprintf(line, sizeof line, "%s,%s,%zu,%zu,%.9g,%.9g,%.9g,%.9g\n", found, kind, a, b,
                      double{at[0]}, double{at[1]}, double{at[2]}, double{value});
        file_.write(line);
    }
    void commit() { file_.commit(); }

  private:
    OutputFile file_;
};

constexpr const char* kinds[] = {"vertex_triangle", "edge_edge"};

void check_pairs_name(const Options& options)
{
    if (options.pairs.empty()) return;
    if (options.pairs == "-") {
        if (options.json == "-")
            throw UsageError("--json - and --pairs - would both write to stdout; give one of them a file");
        return;
    }
    if (extension_of(options.pairs) != ".csv")
        throw UsageError(options.pairs + ": pairs are written as CSV; choose a name that ends in .csv");
    keep_input(options.before, options.pairs);
    if (!options.after.empty()) keep_input(options.after, options.pairs);
}

std::vector<MeshTriangle> read(const std::string& path)
{
    if (!is_mesh_extension(extension_of(path)))
        throw UsageError(path + ": is no mesh; give .obj, .stl, .ply, .glb, ...");
    return read_triangles(path);
}

/// The middle of the points that are nearest to each other.
Vec3f middle_of(const jostle::NearParts<float>& pair, const std::vector<Vec3f>& at)
{
    Vec3f middle{};
    for (std::size_t k = 0; k < 4; ++k)
        middle = middle + (pair.weights[k] / 2) * at[pair.vertices[k]];
    return middle;
}

/// The file's triangles, and those of the file a step later.
struct Input
{
    std::vector<MeshTriangle> before, after;
};
Input read_both(const Options& options)
{
    Input input{read(options.before), {}};
    if (options.after.empty()) return input;
    input.after = read(options.after);
    if (input.after.size() != input.before.size())
        throw UsageError(options.after + ": has " + grouped(input.after.size()) + " triangles, and " +
                         options.before + " has " + grouped(input.before.size()) +
                         "; give the same mesh at two times");
    return input;
}

/// How much was found of a vertex and a triangle, and of two edges.
using Counts = std::array<std::size_t, 2>;

/// Asks about a mesh, writes each pair that is found, and keeps how many there are and how long it took.
class Inspection
{
    template <class Step>
    decltype(auto) timed(const char* name, const Step& step)
    {
        const Clock::time_point start = Clock::now();
        decltype(auto) result = step();
        ms_.set(name, rounded(ms_since(start)));
        return result;
    }
    void write(const char* found, std::size_t kind, std::uint32_t a, std::uint32_t b, const Vec3f& at,
               float value)
    {
        if (pairs_ == nullptr) return;
        pairs_->add(found, kinds[kind], kind == 0 ? mesh_.of_vertex(a) : mesh_.of_edge(a),
                    kind == 0 ? mesh_.number_in_file[b] : mesh_.of_edge(b), at, value);
    }

  public:
    Inspection(const Mesh& mesh, jostle::Executor& executor, float distance, PairsFile* pairs, JsonRow& ms)
        : mesh_(mesh), finder_({.executor = &executor}), distance_(distance), pairs_(pairs), ms_(ms)
    {
    }

    void find_near()
    {
        const auto& found =
            timed("near", [&]() -> auto& { return finder_.near(mesh_.surface, mesh_.from, distance_); });
        near = {found.vertex_triangle.size(), found.edge_edge.size()};
        for (const std::size_t kind : {0u, 1u})
            for (const auto& pair : kind == 0 ? found.vertex_triangle : found.edge_edge) {
                least_distance = std::min(least_distance, pair.distance);
                write("near", kind, pair.a, pair.b, middle_of(pair, mesh_.from), pair.distance);
            }
    }
    void find_impacts()
    {
        const auto& found = timed("moving", [&]() -> auto& {
            return finder_.moving(mesh_.surface, mesh_.from, mesh_.to, distance_);
        });
        safe_step = found.safe_step;
        impacts = {found.vertex_triangle.size(), found.edge_edge.size()};
        for (const std::size_t kind : {0u, 1u})
            for (const auto& pair : kind == 0 ? found.vertex_triangle : found.edge_edge) {
                const std::uint32_t vertex = pair.vertices[0];
                write("impact", kind, pair.a, pair.b,
                      jostle::lerp(mesh_.from[vertex], mesh_.to[vertex], pair.time), pair.time);
            }
    }
    std::size_t find_crossings(const std::vector<Vec3f>& at, const char* name)
    {
        const auto& found = timed(name, [&]() -> auto& { return finder_.crossings(mesh_.surface, at); });
        for (const jostle::Crossing& crossing : found) {
            const auto& [a, b] = mesh_.surface.edges()[crossing.edge];
            if (pairs_ != nullptr)
                pairs_->add(name, "edge_triangle", mesh_.of_edge(crossing.edge),
                            mesh_.number_in_file[crossing.triangle], jostle::lerp(at[a], at[b], .5f), 0);
        }
        return found.size();
    }

    Counts near{}, impacts{};
    float least_distance = std::numeric_limits<float>::infinity();
    float safe_step = 1;

  private:
    const Mesh& mesh_;
    jostle::SurfaceFinder3f finder_;
    const float distance_;
    PairsFile* const pairs_; // null: not wanted
    JsonRow& ms_;
};

void run(const Options& options)
{
    check_pairs_name(options);
    RowsFile rows(options.json);
    JsonRow ms;
    Clock::time_point start = Clock::now();
    const Input input = read_both(options);
    ms.set("read", rounded(ms_since(start)));
    start = Clock::now();
    const Mesh mesh(input.before, input.after);
    ms.set("join", rounded(ms_since(start)));
    const std::size_t left_out = input.before.size() - mesh.triangles.size();
    if (mesh.triangles.empty())
        throw UsageError(options.before +
                         ": each of its triangles is an edge or a point; give a mesh with faces");

    std::optional<PairsFile> pairs;
    if (!options.pairs.empty()) pairs.emplace(options.pairs);
    const Threads threads(options.threads);
    const auto distance = static_cast<float>(options.distance);
    const bool moves = !options.after.empty();
    Inspection found(mesh, threads.executor(), distance, pairs ? &*pairs : nullptr, ms);
    found.find_near();
    if (moves) found.find_impacts();
    const std::size_t crossings = found.find_crossings(mesh.from, "crossings");
    const std::size_t crossings_after = moves ? found.find_crossings(mesh.to, "crossings_after") : 0;
    if (pairs) pairs->commit();

    const Counts &near = found.near, &impacts = found.impacts;
    const bool any = near[0] + near[1] > 0;
    JsonRow row{{"file", options.before},
                {"vertices", mesh.surface.points().size()},
                {"triangles", mesh.triangles.size()},
                {"edges", mesh.surface.edges().size()},
                {"left_out", left_out},
                {"distance", distance},
                {"near", JsonRow{{kinds[0], near[0]}, {kinds[1], near[1]}}},
                {"least_distance", any ? JsonRow::Value(found.least_distance) : JsonRow::Value(nullptr)},
                {"crossings", crossings}};
    if (moves) {
        row.set("after", options.after);
        row.set("impacts", JsonRow{{kinds[0], impacts[0]}, {kinds[1], impacts[1]}});
        row.set("safe_step", found.safe_step);
        row.set("crossings_after", crossings_after);
    }
    row.set("threads", threads.count());
    row.set("ms", ms);
    rows.add(row);
    if (rows.beside_table() && options.pairs != "-") {
        std::printf("%s: %s vertices, %s triangles, %s edges\n", options.before.c_str(),
                    grouped(mesh.surface.points().size()).c_str(), grouped(mesh.triangles.size()).c_str(),
                    grouped(mesh.surface.edges().size()).c_str());
        if (left_out > 0)
            std::printf("left out: %s triangles that are an edge or a point\n", grouped(left_out).c_str());
        std::printf("within %g: %s of a vertex and a triangle, %s of two edges", double{distance},
                    grouped(near[0]).c_str(), grouped(near[1]).c_str());
        std::printf(any ? "; least distance %g\n" : "\n", double{found.least_distance});
        if (moves)
            std::printf("moving: %s and %s come within it; %.9g of the step is safe\n",
                        grouped(impacts[0]).c_str(), grouped(impacts[1]).c_str(), double{found.safe_step});
        std::printf("crossings: %s", grouped(crossings).c_str());
        if (moves) std::printf(", after the step %s", grouped(crossings_after).c_str());
        std::printf("\n");
    }
    rows.write();
}

constexpr const char* help =
    R"(Reads   mesh.obj      .stl, .ply, .glb, .dae, ...: cloth, a soft body, or a scene of several
Writes  the number of pairs (vertex and triangle, or two edges, without a common vertex) within --distance;
        their least distance; edges that pass through triangles. With a second file, the same mesh a step
        later: pairs that come within the distance on the straight way there, the part of the step that is
        safe, and the crossings after it.

Corners at the same place, in both files, are one vertex. Triangles that are an edge or a point are left out.

Examples:
  jostle surface shirt.obj                                   whether it crosses itself
  jostle surface shirt.obj --distance 0.002 --json -         counts, least distance and times
  jostle surface before.ply after.ply --distance 0.001       the safe part of the step
  jostle surface shirt.obj --distance 0.002 --pairs near.csv each pair: triangles, place, distance)";

} // namespace

void add_surface_command(const Command& app)
{
    const Command command =
        app.add("surface", "Finds where a mesh is near itself, meets or crosses itself", help);
    const auto options = std::make_shared<Options>();
    command.required("FILE", options->before, "", "A mesh");
    command.text("FILE2", options->after, "", "The same mesh a step later");
    command.number_between("--distance", options->distance, 0, 1e30, "D",
                           "How near counts, in the mesh's units (0: what touches)");
    command.text("--pairs", options->pairs, "OUT",
                 "Write what was found as CSV, by triangles of the file; - is stdout");
    command.threads(options->threads);
    add_rows_file_option(command, options->json);
    command.on_run([options] {
        try {
            run(*options);
        } catch (const jostle::Error& error) {
            throw UsageError(options->before + ": " + error.what());
        }
    });
}

} // namespace jostle_tool
