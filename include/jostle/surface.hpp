// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

#include "jostle/block_buffer.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/vec.hpp"
#include "jostle/version.hpp"

// Surfaces that bend, such as cloth, soft bodies and hair: what of them is near itself or each other, when
// moving vertices meet, and which edges pass through triangles.
//
//     const jostle::Surface cloth(triangles);
//     jostle::SurfaceFinder3d finder;
//     for (const auto& pair : finder.near(cloth, positions, 2e-3).vertex_triangle) ...
//     const double part = finder.moving(cloth, positions, next, 1e-3).safe_step;
//
// A pair is a vertex and a triangle, or two edges, that have no vertex in common. Its four vertices are the
// vertex and the triangle's corners, or the ends of the first edge and those of the second.

JOSTLE_NAMESPACE_BEGIN

/// Where the two parts of a pair are nearest to each other.
struct PartDistance
{
    double distance;
    /// The nearest points: the sums of these times the pair's vertices. Of a vertex and a triangle the first
    /// is 1 and the others add up to 1; of two edges the first two add up to 1, and so do the others. Exactly
    /// 0 for vertices of which the nearest feature has none: three 0s at most.
    std::array<double, 4> weights;
    /// Unit, from the vertex or first edge to the other part. Where they touch, the triangle's normal or a
    /// vector at right angles to both edges; zero where there is none.
    Vec3d normal;
};

/// The distance of positions[0] and the triangle of the other three, which may be flat or a point.
/// Exact    but for rounding: some 1e-15 of the size. Numbers up to 1e60.
[[nodiscard]] JOSTLE_API PartDistance
vertex_triangle_distance(const std::array<Vec3d, 4>& positions) noexcept;
/// The distance of the edge of the first two positions and that of the other two; ends may be equal.
[[nodiscard]] JOSTLE_API PartDistance edge_edge_distance(const std::array<Vec3d, 4>& positions) noexcept;

/// The first time in [0, 1] at which a vertex comes within `distance` of a triangle, or nothing. Each of the
/// four moves straight from its place in `from` to that in `to`; the vertex comes first.
///
/// Never late   rounding included: until the time returned they are further apart. Where nothing is returned
///              they never come within `distance`.
/// Early        by rounding only, as a rule: at the time returned they are within `distance` plus some 1e-14
///              of the size, which is the greatest coordinate of the motion as seen from the vertex. Where
///              that takes more than 1000 steps, plus at most `tolerance` times the greater of the longest
///              edge and the relative motion.
/// Errors       `Error` for a number that isn't finite or is beyond 1e60, a distance below 0, a tolerance
///              that isn't above 0.
/// Source       conservative advancement along separating directions: Mirtich, Impulse-based Dynamic
///              Simulation (1996), sec. 2.3; here the direction's bound is exact, as motions are straight.
[[nodiscard]] JOSTLE_API std::optional<double> vertex_triangle_impact(const std::array<Vec3d, 4>& from,
                                                                      const std::array<Vec3d, 4>& to,
                                                                      double distance = 0,
                                                                      double tolerance = 1e-6);
/// The same for two edges: the ends of one, then those of the other.
[[nodiscard]] JOSTLE_API std::optional<double> edge_edge_impact(const std::array<Vec3d, 4>& from,
                                                                const std::array<Vec3d, 4>& to,
                                                                double distance = 0, double tolerance = 1e-6);

/// The same for many pairs in one call, on this thread, several times as fast: found[i] is what the functions
/// above return for positions[i], and times[i] for from[i] and to[i], infinity if they return nothing.
/// Errors   as above, and `Error` for spans of different sizes. Error::index is the pair at fault; times
///          before it are written.
JOSTLE_API void vertex_triangle_distances(std::span<const std::array<Vec3d, 4>> positions,
                                          std::span<PartDistance> found);
JOSTLE_API void edge_edge_distances(std::span<const std::array<Vec3d, 4>> positions,
                                    std::span<PartDistance> found);
JOSTLE_API void vertex_triangle_impacts(std::span<const std::array<Vec3d, 4>> from,
                                        std::span<const std::array<Vec3d, 4>> to, std::span<double> times,
                                        double distance = 0, double tolerance = 1e-6);
JOSTLE_API void edge_edge_impacts(std::span<const std::array<Vec3d, 4>> from,
                                  std::span<const std::array<Vec3d, 4>> to, std::span<double> times,
                                  double distance = 0, double tolerance = 1e-6);

/// Which vertices make triangles and edges: what stays the same while a surface bends.
///
/// Triangles may be given in any orientation, share edges in any number, and need not be connected: several
/// bodies are one surface. `edges` and `points` are for what belongs to no triangle, such as hair and grains.
/// Errors   `Error` for an index that isn't below `vertices`, and for a triangle or edge that has a vertex
///          twice; it names the triangle, edge or point.
class JOSTLE_API Surface
{
  public:
    using Triangle = std::array<std::uint32_t, 3>;
    using Edge = std::array<std::uint32_t, 2>;

    Surface() = default;
    /// For `vertices` 0 there are as many as are named.
    explicit Surface(std::span<const Triangle> triangles, std::span<const Edge> edges = {},
                     std::span<const std::uint32_t> points = {}, std::size_t vertices = 0);

    /// How many positions a call takes.
    [[nodiscard]] std::size_t vertices() const noexcept { return vertices_; }
    /// As given.
    [[nodiscard]] std::span<const Triangle> triangles() const noexcept { return triangles_; }
    /// Each once, the triangles' sides included: ascending, the lower vertex first.
    [[nodiscard]] std::span<const Edge> edges() const noexcept { return edges_; }
    /// The vertices that some triangle, edge or point names, ascending. Others meet nothing.
    [[nodiscard]] std::span<const std::uint32_t> points() const noexcept { return points_; }

  private:
    std::size_t vertices_ = 0;
    std::vector<Triangle> triangles_;
    std::vector<Edge> edges_;
    std::vector<std::uint32_t> points_;
};

/// What is left out of a search, and what is added to its distance.
template <Coordinate T>
struct SurfaceOptions
{
    /// One for each vertex, or none. A part's thickness is the greatest of its vertices', and a pair is near
    /// if it is within the distance and the sum of its parts' thicknesses.
    std::span<const T> thickness = {};
    /// One for each vertex, or none: the surface at rest. Pairs that are near there are left out.
    std::span<const Vec<3, T>> rest = {};
    /// One for each vertex, or none: the number of its body. A part has that of its first vertex, and parts
    /// of one body make no pair. So two surfaces meet as one, with two bodies.
    std::span<const std::uint32_t> bodies = {};
    /// Asked last about a vertex, or the first edge, and a triangle, or the second edge, by their numbers. It
    /// is called from several threads at a time.
    StoredFunctionRef<bool(std::uint32_t vertex, std::uint32_t triangle)> accept_vertex_triangle = {};
    StoredFunctionRef<bool(std::uint32_t edge_a, std::uint32_t edge_b)> accept_edge_edge = {};
    /// Of impacts, as vertex_triangle_impact() has it.
    double tolerance = 1e-6;
};

/// A pair that is near.
template <Coordinate T>
struct NearParts
{
    std::uint32_t a;                       ///< the vertex, or the number of the edge
    std::uint32_t b;                       ///< the number of the triangle, or that of the edge, above a
    std::array<std::uint32_t, 4> vertices; ///< of both, in their order
    std::array<T, 4> weights;              ///< as in PartDistance
    Vec<3, T> normal;                      ///< as in PartDistance
    T distance;                            ///< without thickness
};
/// A pair that meets.
template <Coordinate T>
struct PartImpact
{
    std::uint32_t a, b;                    ///< as in NearParts
    std::array<std::uint32_t, 4> vertices; ///< as in NearParts
    T time;                                ///< in [0, 1], never late
};
/// An edge that passes through a triangle, or touches it.
struct Crossing
{
    std::uint32_t edge, triangle;
    friend constexpr auto operator<=>(const Crossing&, const Crossing&) = default;
};

template <Coordinate T>
struct NearSurface
{
    BlockBuffer<NearParts<T>> vertex_triangle, edge_edge;
};
template <Coordinate T>
struct MovingSurface
{
    BlockBuffer<PartImpact<T>> vertex_triangle, edge_edge;
    /// The least time of all pairs, and 1 if there are none: until then nothing comes within the distance.
    T safe_step = 1;
};

/// Finds what of a surface is near itself. Positions are read in place, one for each vertex; everything is
/// decided in double.
///
/// Pairs    those whose parts have no vertex in common, each once.
/// Order    that of the broad phase: by place, the same for any number of threads and instruction set.
/// Results  lie in the finder and are valid until the next call of the same function.
/// Threads  one call at a time per finder; it uses those of options.executor.
/// Memory   stays as large as the largest call needed: a steady step allocates nothing.
/// Cost     expected linear in the vertices and in the pairs whose boxes are within the distance.
/// Errors   `Error` that names the vertex whose position isn't finite or is beyond 1e30; for arrays that
///          don't have one element per vertex; for a negative or infinite distance or thickness.
///          `std::bad_alloc`, and what a callback throws. The result is then empty.
template <Coordinate T>
class JOSTLE_API SurfaceFinder
{
  public:
    using Positions = std::span<const Vec<3, T>>;
    using Options = SurfaceOptions<T>;

    explicit SurfaceFinder(const FinderOptions& options = {});
    SurfaceFinder(SurfaceFinder&&) noexcept;
    SurfaceFinder& operator=(SurfaceFinder&&) noexcept;
    ~SurfaceFinder();

    /// All pairs within `distance` of each other.
    const NearSurface<T>& near(const Surface& surface, Positions positions, T distance,
                               const Options& options = {}) &;
    /// All pairs that come within `distance` while each vertex moves straight from its place in `from` to
    /// that in `to`, with the first time. Never late, as vertex_triangle_impact().
    const MovingSurface<T>& moving(const Surface& surface, Positions from, Positions to, T distance = 0,
                                   const Options& options = {}) &;
    /// The edges that have a point in common with a triangle but no vertex, decided exactly for numbers that
    /// differ by up to 2^200. None: the surface doesn't cross itself. Of the options only `bodies` counts.
    /// Source   Shewchuk, Adaptive Precision Floating-Point Arithmetic, 1997.
    const BlockBuffer<Crossing>& crossings(const Surface& surface, Positions positions,
                                           const Options& options = {}) &;
    /// Not for a finder without a name, which takes its result with it.
    template <class... Arguments>
    void near(Arguments&&... result_would_be_gone) && = delete;
    template <class... Arguments>
    void moving(Arguments&&... result_would_be_gone) && = delete;
    template <class... Arguments>
    void crossings(Arguments&&... result_would_be_gone) && = delete;

    /// Gives working memory back, the results included.
    void release_memory() noexcept;

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using SurfaceFinder3f = SurfaceFinder<float>;
using SurfaceFinder3d = SurfaceFinder<double>;

JOSTLE_NAMESPACE_END
