// SPDX-License-Identifier: MIT
// The points of a contact of two polygons.
#include "narrow/convex/convex2.hpp"

#include <algorithm>

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

struct Clip2
{
    /// Along `normal`, unit, from a to b.
    Clip2(const Core2& a, const Core2& b, const Vec2& normal, double contact_margin)
        : n(normal),
          t(right(normal)),
          radius_a(a.radius),
          radius_b(b.radius),
          margin(contact_margin),
          rounding(1e-14 * (a.reach + b.reach + a.radius + b.radius))
    {
    }
    Vec2 n, t;
    double radius_a, radius_b, margin;
    double rounding; ///< points apart by less than this beyond the margin count, as in keeps()
    ManifoldPoint<2> found[3];
    std::uint32_t count = 0;

    void add(double along, double height_a, double height_b, std::uint16_t feature_a, std::uint16_t feature_b)
    {
        const double top = height_a + radius_a, bottom = height_b - radius_b;
        if (!(top - bottom >= -margin - rounding)) return;
        const double depth = std::max(top - bottom, -margin);
        found[count++] = {t * along + n * (0.5 * (top + bottom)), depth, feature_a, feature_b};
    }
};

/// A side seen along the normal: its range across it, and its heights.
struct Span2
{
    double low, high, height_low, height_high;
    std::uint32_t number_low, number_high;
    std::uint16_t feature;
    Span2(const Clip2& clip, const Side2& side)
        : low(dot(clip.t, side.from)),
          high(dot(clip.t, side.to)),
          height_low(dot(clip.n, side.from)),
          height_high(dot(clip.n, side.to)),
          number_low(side.number_from),
          number_high(side.number_to),
          feature(feature_id(edge_feature, side.number_from))
    {
        if (!(low > high)) return;
        std::swap(low, high);
        std::swap(height_low, height_high);
        std::swap(number_low, number_high);
    }
    [[nodiscard]] double height(double at) const
    {
        if (at == low) return height_low;
        if (at == high) return height_high;
        return height_low + (height_high - height_low) * ((at - low) / (high - low));
    }
};

void clip_sides(Clip2& clip, const Side2& side_a, const Side2& side_b)
{
    const Span2 a(clip, side_a), b(clip, side_b);
    const double begin = std::max(a.low, b.low), end = std::min(a.high, b.high);
    if (begin > end) return;
    const auto add = [&](double at, bool corner_of_a, std::uint32_t number_a, std::uint32_t number_b) {
        clip.add(at, a.height(at), b.height(at),
                 corner_of_a ? feature_id(vertex_feature, number_a) : a.feature,
                 corner_of_a ? b.feature : feature_id(vertex_feature, number_b));
    };
    add(begin, a.low >= b.low, a.number_low, b.number_low);
    if (end > begin) add(end, a.high <= b.high, a.number_high, b.number_high);
}

/// The corner of a furthest along the normal, against the height at which b's side begins.
void clip_corner(Clip2& clip, const Core2& a, const Side2& b)
{
    const std::size_t corner = furthest_corner(a, clip.n);
    const Vec2 p = a.corner[corner];
    clip.add(dot(clip.t, p), dot(clip.n, p), dot(clip.n, b.from),
             feature_id(vertex_feature, a.number(corner)), feature_id(edge_feature, b.number_from));
}

void keep_two(Clip2& clip, Manifold<2>& manifold)
{
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < clip.count; ++i)
        if (clip.found[i].depth > clip.found[best].depth) best = i;
    std::swap(clip.found[0], clip.found[best]);
    if (clip.count == 3 &&
        length2(clip.found[2].p - clip.found[0].p) > length2(clip.found[1].p - clip.found[0].p))
        std::swap(clip.found[1], clip.found[2]);
    manifold.normal = clip.n;
    manifold.count = std::min(clip.count, 2u);
    for (std::uint32_t i = 0; i < manifold.count; ++i)
        manifold.point[i] = clip.found[i];
}

} // namespace

void make_manifold(const Core2& a, const Core2& b, const Gap<2>& cores, double margin, Manifold<2>& manifold)
{
    Clip2 clip(a, b, cores.normal, margin);
    if (cores.distance == 0) clip.rounding = core_touch * (a.reach + b.reach); // which may have been a gap
    const double depth = a.radius + b.radius - cores.distance;
    const Side2 side_a = best_side(a, clip.n), side_b = best_side(b, -clip.n);
    // As in 3D: against a side that is hit squarely the other shape contributes a side at up to 60 degrees.
    const bool exact = side_a.alignment > squarely_face || side_b.alignment > squarely_face;
    const double threshold = exact ? other_face : nearly_face;
    std::uint16_t feature_a, feature_b;
    if (side_a.alignment > threshold && side_b.alignment > threshold) clip_sides(clip, side_a, side_b);
    double deepest = -HUGE_VAL;
    for (std::uint32_t i = 0; i < clip.count; ++i)
        deepest = std::max(deepest, clip.found[i].depth);
    const double slack = 1e-7 * (a.reach + b.reach + std::abs(depth));
    if (deepest > depth + slack) clip.count = 0;
    if (clip.count == 0 || !(deepest >= depth - slack)) {
        feature_a = side_a.alignment > nearly_face
                        ? feature_id(edge_feature, side_a.number_from)
                        : feature_id(vertex_feature, a.number(furthest_corner(a, clip.n)));
        feature_b = side_b.alignment > nearly_face
                        ? feature_id(edge_feature, side_b.number_from)
                        : feature_id(vertex_feature, b.number(furthest_corner(b, -clip.n)));
        clip.found[clip.count++] = {(cores.on_a + clip.n * a.radius + cores.on_b - clip.n * b.radius) * 0.5,
                                    depth, feature_a, feature_b};
    }
    keep_two(clip, manifold);
}

namespace {

Clip2 clip_over(const Core2& a, const Core2& segment, const Vec2& n, double margin)
{
    Clip2 clip(a, segment, n, margin);
    clip.rounding = core_touch * (a.reach + segment.reach); // which may have been a gap
    return clip;
}

} // namespace

bool face_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold)
{
    Clip2 clip = clip_over(a, segment, n, margin);
    const Side2 side_a = best_side(a, n), side_b = best_side(segment, -n);
    if (side_a.alignment > other_face) {
        clip_sides(clip, side_a, side_b);
    } else {
        const double at = dot(clip.t, furthest(a, n));
        const double s0 = dot(clip.t, side_b.from), s1 = dot(clip.t, side_b.to);
        if (at >= std::min(s0, s1) && at <= std::max(s0, s1)) clip_corner(clip, a, side_b);
    }
    if (clip.count == 0) return false;
    keep_two(clip, manifold);
    return true;
}

bool line_contact(const Core2& a, const Core2& segment, const Vec2& n, double margin, Manifold<2>& manifold)
{
    Clip2 clip = clip_over(a, segment, n, margin);
    clip_corner(clip, a, best_side(segment, -n));
    if (clip.count == 0) return false;
    keep_two(clip, manifold);
    return true;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
