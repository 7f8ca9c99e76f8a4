// SPDX-License-Identifier: MIT
// One of Boost's own headers includes a deprecated one.
#define BOOST_ALLOW_DEPRECATED_HEADERS
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>

#include "query_parts.hpp"

namespace jostle_bench {
namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;

/// Boost.Geometry's R-tree, 16 per node, packed. A sphere is asked for by the box around it.
class Boost final : public QueryPeer
{
  public:
    const char* name() const noexcept override { return "boost"; }
    bool answers(QueryKind kind) const noexcept override
    {
        return kind == QueryKind::box || kind == QueryKind::sphere || kind == QueryKind::nearest;
    }
    void build(Boxes3 boxes) override
    {
        boxes_ = boxes;
        std::vector<Value> values;
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
            values.push_back({area(boxes[i]), i});
        tree_ = Tree(values.begin(), values.end());
    }
    void ask(QueryKind kind, const Queries& queries, std::size_t i, Findings& found) const override
    {
        if (kind == QueryKind::nearest) {
            const jostle::Nearest<3, float>& query = queries.nearest[i];
            NearestSoFar nearest(query);
            tree_.query(bgi::nearest(Point(query.point[0], query.point[1], query.point[2]), query.count),
                        boost::make_function_output_iterator([&](const Value& value) {
                            nearest.offer(jostle::squared_distance(query.point, boxes_[value.second]));
                        }));
            nearest.give(found);
            return;
        }
        jostle::Aabb3f around{};
        if (kind == QueryKind::box) {
            around = queries.boxes[i];
        } else {
            const jostle::Sphere<3, float>& sphere = queries.spheres[i];
            for (int d = 0; d < 3; ++d) {
                around.lo[d] = sphere.center[d] - sphere.radius * 1.000001f;
                around.hi[d] = sphere.center[d] + sphere.radius * 1.000001f;
            }
        }
        tree_.query(bgi::intersects(area(around)),
                    boost::make_function_output_iterator([&](const Value& value) {
                        const jostle::Aabb3f& box = boxes_[value.second];
                        if (kind == QueryKind::box || jostle::overlaps(queries.spheres[i], box))
                            found.add(value.second);
                    }));
    }

  private:
    using Point = bg::model::point<float, 3, bg::cs::cartesian>;
    using Area = bg::model::box<Point>;
    using Value = std::pair<Area, std::uint32_t>;
    using Tree = bgi::rtree<Value, bgi::quadratic<16>>;
    static Area area(const jostle::Aabb3f& box)
    {
        return {Point(box.lo[0], box.lo[1], box.lo[2]), Point(box.hi[0], box.hi[1], box.hi[2])};
    }
    Boxes3 boxes_;
    Tree tree_;
};

} // namespace

std::unique_ptr<QueryPeer> make_boost_queries()
{
    return std::make_unique<Boost>();
}

} // namespace jostle_bench
