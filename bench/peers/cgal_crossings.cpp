// SPDX-License-Identifier: MIT
// CGAL 5.5: self_intersections of a Surface_mesh, by box_self_intersection_d and exact predicates, on one
// thread.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>

#include <iterator>
#include <utility>

#include "bench/surface_peers.hpp"

namespace jostle_bench {
namespace {

using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

class CgalCrossings final : public CrossingPeer
{
  public:
    [[nodiscard]] const char* name() const noexcept override { return "cgal"; }

    void start(std::span<const jostle::Surface::Triangle> triangles,
               std::span<const jostle::Vec3d> positions) override
    {
        mesh_.clear();
        for (const jostle::Vec3d& at : positions)
            mesh_.add_vertex(Point(at[0], at[1], at[2]));
        for (const auto& [a, b, c] : triangles)
            mesh_.add_face(Mesh::Vertex_index(a), Mesh::Vertex_index(b), Mesh::Vertex_index(c));
    }
    std::uint64_t find() override
    {
        pairs_.clear();
        CGAL::Polygon_mesh_processing::self_intersections<CGAL::Sequential_tag>(faces(mesh_), mesh_,
                                                                                std::back_inserter(pairs_));
        return pairs_.size();
    }

  private:
    Mesh mesh_;
    std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs_;
};

} // namespace

std::unique_ptr<CrossingPeer> make_cgal_crossings()
{
    return std::make_unique<CgalCrossings>();
}

} // namespace jostle_bench
