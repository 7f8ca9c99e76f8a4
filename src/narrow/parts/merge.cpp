// SPDX-License-Identifier: MIT
#include "narrow/parts/merge.hpp"

#include <algorithm>

#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Relative to the smaller shape's reach: depths and places that differ by less count as equal.
constexpr double rounding = 1e-9;
/// Relative to the distance of the first two points: a point nearer to their line, or to their triangle, adds
/// no support.
constexpr double in_line = 1e-4;

/// Features are numbered within an element; this renumbers them within the surface. There are many elements,
/// so the numbers are scattered over the 14 bits: those of neighbours differ for any length of a surface's
/// rows.
std::uint16_t feature_of_surface(std::uint16_t feature, std::uint32_t part)
{
    const std::uint32_t number = (4 * part + (feature & 3u)) * 2654435761u; // Knuth, The Art III, 6.4
    return feature_id(feature & 0xc000, number >> 18);
}

template <int Dim>
class Merger
{
  public:
    Merger(const Placed<Dim>& pair, FoundList<Dim>& found)
        : found_(found),
          surface_is_a_(is_surface(*pair.a)),
          slack_(rounding * std::min(ShapeAccess::reach(*pair.a), ShapeAccess::reach(*pair.b)))
    {
    }
    void merge()
    {
        std::sort(found_.begin(), found_.end(), [this](const Found<Dim>& x, const Found<Dim>& y) {
            const std::uint32_t bx = body(x), by = body(y);
            if (bx != by) return bx < by;
            return x.part_a != y.part_a ? x.part_a < y.part_a : x.part_b < y.part_b;
        });
        is_left_.resize(found_.size());
        std::fill_n(is_left_.data(), found_.size(), true);
        for (std::size_t begin = 0; begin < found_.size();) {
            std::size_t end = begin + 1;
            while (end < found_.size() && body(found_[end]) == body(found_[begin]))
                ++end;
            while (merge_deepest(begin, end)) {
            }
            begin = end;
        }
        const auto is_merged = [](const Found<Dim>& one) { return one.manifold.count == 0; };
        found_.erase(std::remove_if(found_.begin(), found_.end(), is_merged), found_.end());
    }

  private:
    using Point = ManifoldPoint<Dim>;

    [[nodiscard]] std::uint32_t body(const Found<Dim>& one) const
    {
        return surface_is_a_ ? one.part_b : one.part_a;
    }

    /// Merges the deepest of the contacts of one body. Returns false if none is left.
    bool merge_deepest(std::size_t begin, std::size_t end)
    {
        double most = -HUGE_VAL;
        for (std::size_t i = begin; i < end; ++i)
            if (is_left_[i]) most = std::max(most, found_[i].manifold.point[0].depth);
        if (most == -HUGE_VAL) return false;
        std::size_t deepest = begin;
        while (!is_left_[deepest] || found_[deepest].manifold.point[0].depth < most - slack_)
            ++deepest;
        Manifold<Dim>& into = found_[deepest].manifold;
        points_.clear();
        for (std::size_t i = begin; i < end; ++i) {
            Manifold<Dim>& other = found_[i].manifold;
            if (!is_left_[i] || dot(into.normal, other.normal) < nearly_face) continue;
            for (std::uint32_t p = 0; p < other.count; ++p)
                add_candidate(found_[i], other.point[p]);
            other.count = 0;
            is_left_[i] = false;
        }
        spread(into);
        return true;
    }
    void add_candidate(const Found<Dim>& of, Point point)
    {
        std::uint16_t& feature = surface_is_a_ ? point.feature_a : point.feature_b;
        feature = feature_of_surface(feature, surface_is_a_ ? of.part_a : of.part_b);
        points_.push_back(point);
    }
    /// The first of the points with the greatest measure, up to rounding.
    template <class Measure>
    std::size_t greatest(const Measure& measure)
    {
        measured_.resize(points_.size());
        double most = -HUGE_VAL;
        for (std::size_t i = 0; i < points_.size(); ++i) {
            measured_[i] = measure(points_[i]);
            most = std::max(most, measured_[i]);
        }
        std::size_t i = 0;
        while (measured_[i] < most - slack_)
            ++i;
        return i;
    }
    [[nodiscard]] std::size_t furthest_from(std::size_t from)
    {
        const V<Dim> p = points_[from].p;
        return greatest([&](const Point& point) { return length(point.p - p); });
    }
    /// Fills in the points of a contact.
    void spread(Manifold<Dim>& into)
    {
        std::size_t first = greatest([](const Point& point) { return point.depth; });
        std::size_t second = furthest_from(first);
        if (points_[second].depth >= points_[first].depth - slack_) {
            first = second;
            second = furthest_from(first);
        }
        keep(points_[first], into);
        const double span = length(points_[second].p - points_[first].p);
        if (!(span > slack_)) return;
        keep(points_[second], into);
        if constexpr (Dim == 3) spread_aside(points_[first].p, points_[second].p, span * in_line, into);
        for (std::uint32_t i = 1; i < into.count; ++i)
            if (into.point[i].depth > into.point[0].depth) std::swap(into.point[i], into.point[0]);
    }
    /// Adds the points beside the line of two, if they are further from it than `near`.
    void spread_aside(const V<Dim>& first, const V<Dim>& second, double near, Manifold<Dim>& into)
    {
        const V<Dim> across = cross(into.normal, second - first);
        const double size = length(across);
        if (!(size > near)) return;
        const auto aside = [&](const Point& point) {
            return std::abs(dot(across, point.p - first)) * (1 / size);
        };
        const Point third = points_[greatest(aside)];
        if (!(aside(third) > near)) return;
        keep(third, into);
        // The sides with the triangle on their left.
        const bool left = dot(across, third.p - first) >= 0;
        const V<Dim> corner[3] = {first, left ? second : third.p, left ? third.p : second};
        V<Dim> out[3];
        for (int side = 0; side < 3; ++side) {
            const V<Dim> right = cross(corner[(side + 1) % 3] - corner[side], into.normal);
            out[side] = right * (1 / length(right));
        }
        const auto outside = [&](const Point& point) {
            double most = 0;
            for (int side = 0; side < 3; ++side)
                most = std::max(most, dot(out[side], point.p - corner[side]));
            return most;
        };
        const Point fourth = points_[greatest(outside)];
        if (outside(fourth) > near) keep(fourth, into);
    }
    /// No two points of a contact get the same features.
    void keep(Point point, Manifold<Dim>& into) const
    {
        std::uint16_t& on_surface = surface_is_a_ ? point.feature_a : point.feature_b;
        for (std::uint32_t i = 0; i < into.count;) {
            const bool same =
                into.point[i].feature_a == point.feature_a && into.point[i].feature_b == point.feature_b;
            i = same ? 0 : i + 1;
            if (same) on_surface = feature_id(on_surface & 0xc000, on_surface + 1u);
        }
        into.point[into.count++] = point;
    }

    FoundList<Dim>& found_;
    bool surface_is_a_;
    double slack_;
    SmallVector<bool, 64> is_left_;
    SmallVector<Point, 64> points_; // of contacts with similar normals
    SmallVector<double, 64> measured_;
};

} // namespace

template <int Dim>
void merge_contacts(const Placed<Dim>& pair, FoundList<Dim>& found)
{
    if (is_surface(*pair.a) != is_surface(*pair.b)) Merger<Dim>(pair, found).merge();
}
template void merge_contacts(const Placed<2>&, FoundList<2>&);
template void merge_contacts(const Placed<3>&, FoundList<3>&);

} // namespace narrow
JOSTLE_NAMESPACE_END
