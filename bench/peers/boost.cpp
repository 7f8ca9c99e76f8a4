// SPDX-License-Identifier: MIT
// One of Boost's own headers includes a deprecated one.
#define BOOST_ALLOW_DEPRECATED_HEADERS
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <boost/iterator/function_output_iterator.hpp>

#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

namespace bg = boost::geometry;
namespace bgi = boost::geometry::index;

constexpr PeerInfo peer_info{
    "boost", "Boost.Geometry R-tree, 16 per node, packed anew each frame, one intersects query per box",
    10'000'000, false, true};

template <int Dim>
class Boost final : public Peer<Dim>
{
  public:
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<Dim> boxes, std::uint32_t) override
    {
        stop();
        values_.reserve(boxes.size());
    }

    void frame(Boxes<Dim> boxes, std::span<const std::uint32_t>) override
    {
        values_.clear();
        pairs_.clear();
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
            values_.push_back({{point(boxes[i].lo), point(boxes[i].hi)}, i});
        tree_ = Tree(values_.begin(), values_.end()); // packing reorders nothing but its own copies
        for (const Value& query : values_)
            tree_.query(bgi::intersects(query.first),
                        boost::make_function_output_iterator([&](const Value& hit) {
                            if (query.second < hit.second) pairs_.push_back({query.second, hit.second});
                        }));
    }

    PeerResult result() const override { return summarise(pairs_); }

    void stop() override
    {
        tree_ = Tree();
        values_ = {};
        pairs_ = {};
    }

  private:
    using Point = bg::model::point<float, Dim, bg::cs::cartesian>;
    using Value = std::pair<bg::model::box<Point>, std::uint32_t>;
    using Tree = bgi::rtree<Value, bgi::linear<16>>;

    static Point point(const jostle::Vec<Dim, float>& coordinates)
    {
        Point p;
        bg::set<0>(p, coordinates[0]);
        bg::set<1>(p, coordinates[1]);
        if constexpr (Dim == 3) bg::set<2>(p, coordinates[2]);
        return p;
    }

    std::vector<Value> values_;
    Tree tree_;
    std::vector<jostle::Pair> pairs_;
};

} // namespace

template <int Dim>
std::unique_ptr<Peer<Dim>> make_boost()
{
    return std::make_unique<Boost<Dim>>();
}
template std::unique_ptr<Peer<2>> make_boost<2>();
template std::unique_ptr<Peer<3>> make_boost<3>();

} // namespace jostle_bench
