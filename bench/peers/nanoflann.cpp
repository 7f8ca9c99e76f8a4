// SPDX-License-Identifier: MIT
// nanoflann: a k-d tree, asked for all points within a radius of each point.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include <nanoflann.hpp>

#include "bench/neighbor_peers.hpp"

namespace jostle_bench {

namespace {

struct Cloud
{
    std::span<const jostle::Vec3f> points;

    [[nodiscard]] std::size_t kdtree_get_point_count() const { return points.size(); }
    [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t d) const
    {
        return points[i][static_cast<int>(d)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const
    {
        return false;
    }
};

/// Takes what the tree finds, without the vector of pairs that it fills by itself.
struct Row
{
    using DistanceType = float;
    std::vector<std::uint32_t>& found;
    std::uint32_t own;
    float square;

    [[nodiscard]] float worstDist() const { return square; }
    [[nodiscard]] bool full() const { return true; }
    [[nodiscard]] std::size_t size() const { return found.size(); }
    bool addPoint(float distance, std::uint32_t index)
    {
        if (distance < square && index != own) found.push_back(index);
        return true;
    }
};

class Nanoflann : public NeighborPeer
{
  public:
    [[nodiscard]] const char* name() const noexcept override { return "nanoflann"; }
    [[nodiscard]] bool is_periodic() const noexcept override { return false; }
    void start(std::span<const jostle::Vec3f> points, float cutoff, double) override
    {
        points_ = points;
        // It takes points nearer than its radius, which is a square.
        square_ = std::nextafter(cutoff * cutoff, std::numeric_limits<float>::infinity());
    }
    void find() override
    {
        using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Cloud>, Cloud, 3,
                                                         std::uint32_t>;
        const Cloud cloud{points_};
        const Tree tree(3, cloud); // builds it
        offsets_.assign(1, 0);
        found_.clear();
        for (std::size_t i = 0; i < points_.size(); ++i) {
            Row row{found_, static_cast<std::uint32_t>(i), square_};
            tree.findNeighbors(row, &points_[i][0], nanoflann::SearchParams());
            offsets_.push_back(found_.size());
        }
    }
    [[nodiscard]] std::uint64_t found() const override { return found_.size(); }

  private:
    std::span<const jostle::Vec3f> points_;
    float square_ = 0;
    std::vector<std::uint64_t> offsets_;
    std::vector<std::uint32_t> found_;
};

} // namespace

std::unique_ptr<NeighborPeer> make_nanoflann()
{
    return std::make_unique<Nanoflann>();
}

} // namespace jostle_bench
