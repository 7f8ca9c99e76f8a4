// SPDX-License-Identifier: MIT
// Surfaces that bend in C.
#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "c_api/handles.hpp"
#include "jostle/surface.hpp"

namespace jostle::c_api {
namespace {

template <class C, class Cpp>
constexpr bool near_as_documented =
    sizeof(C) == sizeof(Cpp) && offsetof(C, b) == offsetof(Cpp, b) &&
    offsetof(C, vertices) == offsetof(Cpp, vertices) && offsetof(C, weights) == offsetof(Cpp, weights) &&
    offsetof(C, normal) == offsetof(Cpp, normal) && offsetof(C, distance) == offsetof(Cpp, distance);
template <class C, class Cpp>
constexpr bool part_impact_as_documented =
    sizeof(C) == sizeof(Cpp) && offsetof(C, b) == offsetof(Cpp, b) &&
    offsetof(C, vertices) == offsetof(Cpp, vertices) && offsetof(C, time) == offsetof(Cpp, time);
static_assert(near_as_documented<jostle_near_parts_3f, NearParts<float>> &&
              near_as_documented<jostle_near_parts_3d, NearParts<double>> &&
              part_impact_as_documented<jostle_part_impact_3f, PartImpact<float>> &&
              part_impact_as_documented<jostle_part_impact_3d, PartImpact<double>> &&
              sizeof(jostle_crossing) == sizeof(Crossing) &&
              offsetof(jostle_crossing, triangle) == offsetof(Crossing, triangle));

class SurfaceContent final : public Content
{
  public:
    explicit SurfaceContent(const jostle_surface_parts& parts)
        : surface(parts_of<Surface::Triangle>(parts.triangles, parts.triangle_count, "triangles"),
                  parts_of<Surface::Edge>(parts.edges, parts.edge_count, "edges"),
                  parts_of<std::uint32_t>(parts.points, parts.point_count, "points"),
                  static_cast<std::size_t>(parts.vertices))
    {
    }
    Surface surface;

  private:
    template <class Part>
    static std::span<const Part> parts_of(const std::uint32_t* vertices, std::uint64_t count,
                                          const char* name)
    {
        return {wanted_array_of<Part>(vertices, count, name), static_cast<std::size_t>(count)};
    }
};

class SurfaceFinderContent final : public Content
{
  public:
    SurfaceFinderContent(jostle_space space, const Kept& with) : kept(with)
    {
        if (space == JOSTLE_3F)
            finder.emplace<SurfaceFinder3f>(kept.options<FinderOptions>());
        else if (space == JOSTLE_3D)
            finder.emplace<SurfaceFinder3d>(kept.options<FinderOptions>());
        else
            refuse("the space is " + std::to_string(space) +
                   ": surfaces bend in JOSTLE_3F (2) or JOSTLE_3D (4)");
    }
    bool release_memory() override
    {
        on_held(finder, [](auto& typed) { typed.release_memory(); });
        return true;
    }

    Kept kept;
    std::variant<std::monostate, SurfaceFinder3f, SurfaceFinder3d> finder;
    /// Where blocks are listed: of vertices and triangles, and of edges.
    std::array<std::vector<jostle_block>, 2> near, moving;
    std::vector<jostle_block> crossings;
};

} // namespace

template <>
struct Behind<jostle_surface> : Kind<SurfaceContent, 0x14>
{
    static constexpr const char* name = "jostle_surface";
};
template <>
struct Behind<jostle_surface_finder> : Kind<SurfaceFinderContent, 0x15>
{
    static constexpr const char* name = "jostle_surface_finder";
};

namespace {

/// Positions, thicknesses or bodies, one for each vertex.
template <class Value>
std::span<const Value> for_each_vertex(const void* data, std::uint64_t count, const char* name)
{
    return {wanted_array_of<Value>(data, count, name), static_cast<std::size_t>(count)};
}

/// Options as C++ has them, and what they refer to.
template <class T>
class SurfaceWish
{
  public:
    SurfaceWish(const jostle_surface_options& given, std::size_t vertices)
        : vertex_triangle_{given.accept_vertex_triangle, given.context},
          edge_edge_{given.accept_edge_edge, given.context}
    {
        const auto if_given = [&]<class Value>(std::span<const Value>& into, const void* data,
                                               const char* name) {
            if (data != nullptr) into = for_each_vertex<Value>(data, vertices, name);
        };
        if_given(options.thickness, given.thickness, "thickness");
        if_given(options.rest, given.rest, "rest");
        if_given(options.bodies, given.bodies, "bodies");
        if (vertex_triangle_.function != nullptr) options.accept_vertex_triangle = vertex_triangle_;
        if (edge_edge_.function != nullptr) options.accept_edge_edge = edge_edge_;
        if (given.tolerance != 0) options.tolerance = given.tolerance;
    }
    SurfaceWish(const SurfaceWish&) = delete;

    SurfaceOptions<T> options;

  private:
    struct Accept
    {
        jostle_accept_pair_function function;
        void* context;
        bool operator()(std::uint32_t a, std::uint32_t b) const { return agreed(function(context, a, b)); }
    };
    Accept vertex_triangle_, edge_edge_;
};

template <class Item>
jostle_blocks blocks_of(const BlockBuffer<Item>& found, std::vector<jostle_block>& table)
{
    return list_blocks<Item>(found.blocks(), found.size(), table);
}

void check_part_kind(jostle_part_kind kind)
{
    if (kind != JOSTLE_VERTEX_TRIANGLE && kind != JOSTLE_EDGE_EDGE)
        refuse("there is no kind " + std::to_string(kind) + " of parts");
}

/// Four vertices of each pair.
std::span<const std::array<Vec3d, 4>> corners_of(const double* positions, std::uint64_t count,
                                                 const char* name)
{
    static_assert(sizeof(std::array<Vec3d, 4>) == 12 * sizeof(double));
    return {wanted_array_of<std::array<Vec3d, 4>>(positions, count, name), static_cast<std::size_t>(count)};
}

/// A search: inside(typed finder, surface, options).
template <class Inside>
void search_surface(SurfaceFinderContent& content, const jostle_surface* surface,
                    const jostle_surface_options* options, const Inside& inside)
{
    const Surface& of = open(surface).surface;
    const jostle_surface_options given = read_options(options, "jostle_surface_options");
    on_held(content.finder, [&]<class T>(SurfaceFinder<T>& finder) {
        const SurfaceWish<T> wish(given, of.vertices());
        inside(finder, of, wish.options);
    });
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_surface_new(const jostle_surface_parts* parts, jostle_surface** out, jostle_error* error)
{
    return guarded(error, [&] {
        const jostle_surface_parts& given = wanted(parts, "parts");
        wanted(out, "out");
        hand_out(out, std::make_unique<SurfaceContent>(given));
    });
}
jostle_status jostle_surface_parts_read(const jostle_surface* surface, jostle_surface_parts* parts,
                                        jostle_error* error)
{
    return guarded(error, [&] {
        const Surface& of = open(surface).surface;
        const auto vertices_of = [](const auto& each) {
            return reinterpret_cast<const std::uint32_t*>(each.data());
        };
        wanted(parts, "parts") = {vertices_of(of.triangles()),
                                  of.triangles().size(),
                                  vertices_of(of.edges()),
                                  of.edges().size(),
                                  of.points().data(),
                                  of.points().size(),
                                  of.vertices()};
    });
}

jostle_status jostle_surface_finder_new(jostle_space space, const jostle_options* options,
                                        jostle_surface_finder** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<SurfaceFinderContent>(space, keep(options)));
    });
}
jostle_status jostle_surface_finder_near(jostle_surface_finder* finder, const jostle_surface* surface,
                                         const void* positions, uint64_t count, double distance,
                                         const jostle_surface_options* options, jostle_near_surface* found,
                                         jostle_error* error)
{
    return guarded(error, [&] {
        SurfaceFinderContent& content = open(finder);
        wanted(found, "found");
        search_surface(
            content, surface, options, [&]<class T>(SurfaceFinder<T>& typed, auto& of, auto& wish) {
                const auto& all = typed.near(of, for_each_vertex<Vec<3, T>>(positions, count, "positions"),
                                             static_cast<T>(distance), wish);
                *found = {blocks_of(all.vertex_triangle, content.near[0]),
                          blocks_of(all.edge_edge, content.near[1])};
            });
    });
}
jostle_status jostle_surface_finder_moving(jostle_surface_finder* finder, const jostle_surface* surface,
                                           const void* from, const void* to, uint64_t count, double distance,
                                           const jostle_surface_options* options,
                                           jostle_moving_surface* found, jostle_error* error)
{
    return guarded(error, [&] {
        SurfaceFinderContent& content = open(finder);
        wanted(found, "found");
        search_surface(content, surface, options,
                       [&]<class T>(SurfaceFinder<T>& typed, auto& of, auto& wish) {
                           const auto& all = typed.moving(of, for_each_vertex<Vec<3, T>>(from, count, "from"),
                                                          for_each_vertex<Vec<3, T>>(to, count, "to"),
                                                          static_cast<T>(distance), wish);
                           *found = {blocks_of(all.vertex_triangle, content.moving[0]),
                                     blocks_of(all.edge_edge, content.moving[1]), double{all.safe_step}};
                       });
    });
}
jostle_status jostle_surface_finder_crossings(jostle_surface_finder* finder, const jostle_surface* surface,
                                              const void* positions, uint64_t count,
                                              const jostle_surface_options* options, jostle_blocks* crossings,
                                              jostle_error* error)
{
    return guarded(error, [&] {
        SurfaceFinderContent& content = open(finder);
        wanted(crossings, "crossings");
        search_surface(
            content, surface, options, [&]<class T>(SurfaceFinder<T>& typed, auto& of, auto& wish) {
                *crossings = blocks_of(
                    typed.crossings(of, for_each_vertex<Vec<3, T>>(positions, count, "positions"), wish),
                    content.crossings);
            });
    });
}

jostle_status jostle_part_impacts(jostle_part_kind kind, const double* from, const double* to, uint64_t count,
                                  double distance, double tolerance, double* times, jostle_error* error)
{
    return guarded(error, [&] {
        const auto begin = corners_of(from, count, "from"), end = corners_of(to, count, "to");
        wanted_array(times, count, "times");
        check_part_kind(kind);
        (kind == JOSTLE_EDGE_EDGE ? edge_edge_impacts : vertex_triangle_impacts)(
            begin, end, {times, begin.size()}, distance, tolerance == 0 ? 1e-6 : tolerance);
    });
}
jostle_status jostle_part_distances(jostle_part_kind kind, const double* positions, uint64_t count,
                                    double* distances, jostle_error* error)
{
    static_assert(sizeof(PartDistance) == 8 * sizeof(double));
    return guarded(error, [&] {
        const auto corners = corners_of(positions, count, "positions");
        auto* const found = wanted_array_of<PartDistance>(static_cast<void*>(distances), count, "distances");
        check_part_kind(kind);
        (kind == JOSTLE_EDGE_EDGE ? edge_edge_distances : vertex_triangle_distances)(corners,
                                                                                     {found, corners.size()});
    });
}

} // extern "C"
