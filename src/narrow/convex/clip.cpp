// SPDX-License-Identifier: MIT
#include "narrow/convex/clip.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// The number of the face whose normal is nearest to direction d, in local axes; `alignment` is the cosine of
/// the angle between the two. A cylinder has two faces, the upper disc (0) and the lower one (1); a cone has
/// the lower one, and at zero height the upper one as well. A core without faces, or with discs of zero size,
/// gets an alignment of minus infinity.
std::uint32_t best_face(const Core3& core, const Vec3& d, double& alignment)
{
    const Polytope& hull = core.polytope;
    alignment = -HUGE_VAL;
    switch (core.smooth) {
    case Smooth::cylinder:
        if (core.lengths.x > 0) alignment = std::abs(d.y);
        return d.y > 0 ? 0 : 1;
    case Smooth::cone: {
        const bool up = core.lengths.y == 0 && d.y > 0;
        if (core.lengths.x > 0) alignment = up ? d.y : -d.y;
        return up ? 0 : 1;
    }
    case Smooth::ellipsoid:
    case Smooth::custom:
        return 0;
    case Smooth::none:
        break;
    }
    std::uint32_t best = 0;
    if (hull.faces > 2) {
        best = core.kernels->furthest(hull.nx, hull.face_stride, d.x, d.y, d.z);
        alignment = dot(d, hull.normal(best));
        return best;
    }
    for (std::uint32_t f = 0; f < hull.faces; ++f) {
        const double along = dot(d, hull.normal(f));
        if (along > alignment) {
            alignment = along;
            best = f;
        }
    }
    return best;
}

/// A disc is clipped as a polygon of this many corners, the first of which is the disc's furthest point along
/// d.
constexpr std::uint32_t rim_corners = 8;
/// If the sine of the angle between d and the disc's axis is less than this, that point would jump about from
/// frame to frame. Then the corners have fixed places, which suits solvers that match points.
constexpr double leaning = 0.02;

void take_disc(const Core3& core, std::uint32_t f, const Vec3& d, Feature& feature)
{
    const bool up = f == 0;
    feature.kind = face_feature;
    feature.id = f;
    feature.normal = up ? core.frame.r.y : -core.frame.r.y;
    feature.top = dot(feature.normal, core.frame.p) + core.lengths.y;
    Vec3 spoke = d.x * d.x + d.z * d.z > leaning * leaning ? across_axis(d) : Vec3{1, 0, 0};
    const double turn = std::sqrt(0.5);
    for (std::uint32_t k = 0; k < rim_corners; ++k) {
        feature.vertex.push_back(f * rim_corners + k);
        feature.point.push_back(core.frame * Vec3{spoke.x * core.lengths.x,
                                                  up ? core.lengths.y : -core.lengths.y,
                                                  spoke.z * core.lengths.x});
        // By an eighth of a turn, counterclockwise seen from outside.
        const double sine = up ? turn : -turn;
        spoke = {spoke.x * turn + spoke.z * sine, 0, spoke.z * turn - spoke.x * sine};
    }
}

} // namespace

void take_face(const Core3& core, std::uint32_t f, Feature& feature)
{
    const Polytope& hull = core.polytope;
    feature.kind = face_feature;
    feature.id = f;
    feature.normal = core.frame.r * hull.normal(f);
    for (std::uint32_t k = hull.outline_begin[f]; k < hull.outline_begin[f + 1]; ++k) {
        feature.vertex.push_back(hull.outline[k]);
        feature.point.push_back(core.frame * hull.vertex(hull.outline[k]));
    }
    // A hull's highest corner may not be in the outline; a flat hull has corners on both sides of its plane.
    if (hull.offset != nullptr) {
        feature.top = dot(feature.normal, core.frame.p) + hull.offset[f];
        return;
    }
    feature.top = dot(feature.normal, feature.point[0]);
    for (std::size_t k = 1; k < feature.point.size() && hull.vertices > 3; ++k)
        feature.top = std::max(feature.top, dot(feature.normal, feature.point[k]));
}

namespace {

void take_face_towards(const Core3& core, std::uint32_t f, const Vec3& d, Feature& feature)
{
    core.is_smooth() ? take_disc(core, f, d, feature) : take_face(core, f, feature);
}

/// The line on the side of a cylinder or cone, from its lower rim to the top, that contains the point
/// furthest along d. Returns false if there is no such line.
bool find_side_line(const Core3& core, const Vec3& d, Vec3& low, Vec3& high)
{
    bool to_tip = false;
    switch (core.smooth) {
    case Smooth::cylinder:
        break;
    case Smooth::cone:
        to_tip = true;
        break;
    case Smooth::ellipsoid:
    case Smooth::custom:
    case Smooth::none:
        return false;
    }
    if (d.x == 0 && d.z == 0) return false;
    const Vec3 rim = across_axis(d) * core.lengths.x;
    low = {rim.x, -core.lengths.y, rim.z};
    high = {to_tip ? 0 : rim.x, core.lengths.y, to_tip ? 0 : rim.z};
    return true;
}

/// That line if it is level within `slope`, otherwise the point furthest along d.
void take_line_or_point(const Core3& core, const Vec3& d, double slope, Feature& feature)
{
    Vec3 low, high;
    if (find_side_line(core, d, low, high)) {
        const Vec3 along = high - low;
        const double rise = dot(d, along), extent = length2(along);
        if (extent > 0 && rise * rise <= slope * slope * extent) {
            feature.kind = edge_feature;
            for (const Vec3& p : {low, high}) {
                feature.vertex.push_back(static_cast<std::uint32_t>(feature.vertex.size()));
                feature.point.push_back(core.frame * p);
            }
            return;
        }
    }
    feature.vertex.push_back(0);
    feature.point.push_back(core.frame * smooth_support(core, d));
}

/// Takes an edge if one is level within `slope`, or the highest edge at any slope if that is 1.
void take_edge_or_vertex(const Core3& core, const Vec3& d, double slope, Feature& feature)
{
    if (core.is_smooth()) return take_line_or_point(core, d, slope, feature);
    const Polytope& hull = core.polytope;
    SmallVector<double, 128> depth;
    depth.resize(hull.stride);
    const double near =
        core.kernels->heights(hull.x, hull.stride, -d.x, -d.y, -d.z, depth.data()) + 1e-9 * core.reach;
    // It must have a highest vertex, otherwise it is the edge of another region. Which ones do is hard to
    // predict, so they are found without branches.
    SmallVector<std::uint32_t, 192> carrying;
    carrying.resize(hull.edges + std::size_t{1});
    std::size_t count = 0;
    for (std::uint32_t e = 0; e < hull.edges; ++e) {
        carrying[count] = e;
        count += std::min(depth[hull.edge[e].v[0]], depth[hull.edge[e].v[1]]) <= near ? 1 : 0;
    }
    // Of these, the one with the highest other end.
    double least = HUGE_VAL;
    std::uint32_t best = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const std::uint32_t* const v = hull.edge[carrying[k]].v;
        const double p = depth[v[0]], q = depth[v[1]], low = std::max(p, q);
        if (low < least &&
            (p - q) * (p - q) <= slope * slope * length2(hull.vertex(v[1]) - hull.vertex(v[0]))) {
            least = low;
            best = carrying[k];
        }
    }
    if (least != HUGE_VAL) {
        feature.kind = edge_feature;
        feature.id = best;
        for (const std::uint32_t v : hull.edge[best].v) {
            feature.vertex.push_back(v);
            feature.point.push_back(core.frame * hull.vertex(v));
        }
        return;
    }
    const Support top = support(core, core.frame.r * d);
    feature.kind = vertex_feature;
    feature.id = top.vertex;
    feature.vertex.push_back(top.vertex);
    feature.point.push_back(top.p);
}

} // namespace

void take_features(const Core3& a, const Core3& b, const Vec3& n, Feature& fa, Feature& fb)
{
    const Vec3 da = a.frame.r.back(n), db = b.frame.r.back(-n);
    double along_a = -1, along_b = -1;
    const std::uint32_t face_a = best_face(a, da, along_a);
    const std::uint32_t face_b = best_face(b, db, along_b);
    const bool exact_a = along_a > squarely_face, exact_b = along_b > squarely_face;
    // Against a face the other shape contributes a whole feature, and points that are too high drop out by
    // their depth, so points appear and vanish continuously. If no face is hit squarely, only nearly level
    // features count.
    const double threshold_a = exact_b ? other_face : nearly_face;
    const double threshold_b = exact_a ? other_face : nearly_face;
    if (along_a > threshold_a)
        take_face_towards(a, face_a, da, fa);
    else
        take_edge_or_vertex(a, da, exact_b ? 1 : nearly_level, fa);
    if (along_b > threshold_b)
        take_face_towards(b, face_b, db, fb);
    else
        take_edge_or_vertex(b, db, exact_a ? 1 : nearly_level, fb);
}

void take_against_face(const Core3& core, const Vec3& n, Feature& feature)
{
    double along = -1;
    const Vec3 local = core.frame.r.back(n);
    const std::uint32_t face = best_face(core, local, along);
    if (along > other_face) return take_face_towards(core, face, local, feature);
    take_edge_or_vertex(core, local, 1, feature);
}

std::uint16_t feature_against_vertex(const Core3& core, const Vec3& n)
{
    double along = -1;
    const Vec3 local = core.frame.r.back(n);
    const std::uint32_t face = best_face(core, local, along);
    if (along > nearly_face) return feature_id(face_feature, face);
    Feature feature;
    take_edge_or_vertex(core, local, nearly_level, feature);
    return feature_id(feature.kind, feature.id);
}

namespace {

/// The height along n of a face's plane over a lateral point.
struct Slope
{
    double base, du, dv;
    Slope(const Lateral& lateral, const Feature& face)
    {
        const double up = 1 / dot(face.normal, lateral.n);
        base = face.top * up;
        du = -dot(face.normal, lateral.u) * up;
        dv = -dot(face.normal, lateral.v) * up;
    }
    [[nodiscard]] double at(const Vec2& p) const { return base + du * p.x + dv * p.y; }
};

std::uint16_t edge_of(const Feature& face, std::uint32_t i)
{
    return feature_id(edge_feature, face.vertex[i]);
}

/// b's polygon cut by a's sides. Each corner knows the features it comes from, whichever of the two polygons
/// is cut.
void clip_faces(Clip& clip, const Feature& a, const Feature& b)
{
    struct Corner
    {
        Vec2 p;
        std::uint16_t feature_a, feature_b;
        std::uint32_t side; // that leads to the next corner: of b, or of a with the top bit set
    };
    constexpr std::uint32_t of_a = 0x80000000u;
    SmallVector<Corner, 24> room[2];
    SmallVector<Corner, 24>* now = &room[0];
    SmallVector<Corner, 24>* later = &room[1];
    SmallVector<double, 24> inside; // how far each corner is inside, times the side's length
    const std::uint16_t face_a = feature_id(face_feature, a.id), face_b = feature_id(face_feature, b.id);
    // b's loop runs clockwise as a sees it: backwards, side i - 1 leads from corner i.
    const std::size_t sides_a = a.point.size(), sides_b = b.point.size();
    for (std::size_t k = sides_b; k-- > 0;)
        now->push_back({clip.lateral.flat(b.point[k]), face_a, feature_id(vertex_feature, b.vertex[k]),
                        static_cast<std::uint32_t>((k + sides_b - 1) % sides_b)});
    Vec2 from = clip.lateral.flat(a.point[0]);
    for (std::size_t i = 0; i < sides_a && !now->empty(); ++i) {
        const SmallVector<Corner, 24>& polygon = *now;
        SmallVector<Corner, 24>& next = *later;
        const std::size_t after = i + 1 == sides_a ? 0 : i + 1;
        const Vec2 to = clip.lateral.flat(a.point[after]);
        const Vec2 side = to - from;
        const std::size_t size = polygon.size();
        inside.resize(size);
        bool cuts = false;
        for (std::size_t k = 0; k < size; ++k) {
            inside[k] = cross(side, polygon[k].p - from);
            cuts |= !(inside[k] >= 0);
        }
        from = to;
        if (!cuts) continue;
        next.clear();
        for (std::size_t k = 0; k < size; ++k) {
            const std::size_t k_after = k + 1 == size ? 0 : k + 1;
            const Corner &corner = polygon[k], &other = polygon[k_after];
            const double here = inside[k], there = inside[k_after];
            if (here >= 0) next.push_back(corner);
            if ((here >= 0) != (there >= 0)) {
                const double t = here / (here - there);
                Corner made;
                made.p = corner.p + (other.p - corner.p) * t;
                if ((corner.side & of_a) != 0) {
                    const bool previous = (corner.side & ~of_a) == i - 1;
                    made.feature_a = feature_id(vertex_feature, a.vertex[previous ? i : after]);
                    made.feature_b = face_b;
                } else {
                    made.feature_a = edge_of(a, static_cast<std::uint32_t>(i));
                    made.feature_b = edge_of(b, corner.side);
                }
                // Where it leaves, the next side is a's; where it enters, the polygon's own.
                made.side = here >= 0 ? static_cast<std::uint32_t>(i) | of_a : corner.side;
                next.push_back(made);
            }
        }
        std::swap(now, later);
    }
    const SmallVector<Corner, 24>& polygon = *now;
    const Slope height_a(clip.lateral, a), height_b(clip.lateral, b);
    for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Corner& corner = polygon[k];
        clip.add(corner.p, height_a.at(corner.p), height_b.at(corner.p), corner.feature_a, corner.feature_b);
    }
}

/// The part of `edge` over the polygon of `face`. `swapped`: the face is a's.
void clip_edge(Clip& clip, const Feature& edge, const Feature& face, bool swapped)
{
    const Vec2 e0 = clip.lateral.flat(edge.point[0]), e1 = clip.lateral.flat(edge.point[1]);
    const double h0 = dot(clip.lateral.n, edge.point[0]), h1 = dot(clip.lateral.n, edge.point[1]);
    const std::uint16_t whole_face = feature_id(face_feature, face.id);
    double begin = 0, end = 1;
    std::uint16_t edge_begin = feature_id(vertex_feature, edge.vertex[0]),
                  edge_end = feature_id(vertex_feature, edge.vertex[1]);
    std::uint16_t face_begin = whole_face, face_end = whole_face;
    const std::size_t sides = face.point.size();
    const double turn = swapped ? 1 : -1; // b's loop runs clockwise
    Vec2 from = clip.lateral.flat(face.point[0]);
    for (std::size_t i = 0; i < sides; ++i) {
        const Vec2 to = clip.lateral.flat(face.point[i + 1 == sides ? 0 : i + 1]);
        const double d0 = turn * cross(to - from, e0 - from), d1 = turn * cross(to - from, e1 - from);
        // An edge along the side is entirely inside, whatever the rounding of its ends.
        const double slack = -1e-9 * clip.size * (std::abs(to.x - from.x) + std::abs(to.y - from.y));
        from = to;
        if (d0 >= slack && d1 >= slack) continue;
        if (d0 < 0 && d1 < 0) return;
        const double t = d0 / (d0 - d1);
        if (d0 < 0) {
            if (t > begin) {
                begin = t;
                edge_begin = feature_id(edge_feature, edge.id);
                face_begin = edge_of(face, static_cast<std::uint32_t>(i));
            }
        } else if (t < end) {
            end = t;
            edge_end = feature_id(edge_feature, edge.id);
            face_end = edge_of(face, static_cast<std::uint32_t>(i));
        }
    }
    if (begin > end) return;
    const Slope slope(clip.lateral, face);
    const auto add = [&](double t, std::uint16_t on_edge, std::uint16_t on_face) {
        const Vec2 p = e0 + (e1 - e0) * t;
        const double height_edge = h0 + (h1 - h0) * t, height_face = slope.at(p);
        if (swapped)
            clip.add(p, height_face, height_edge, on_face, on_edge);
        else
            clip.add(p, height_edge, height_face, on_edge, on_face);
    };
    add(begin, edge_begin, face_begin);
    if (end > begin) add(end, edge_end, face_end);
}

/// Relative to the size: edges that pass each other by more share no point.
constexpr double elsewhere = 1e-6;

void clip_edges(Clip& clip, const Feature& a, const Feature& b)
{
    const Vec2 a0 = clip.lateral.flat(a.point[0]), a1 = clip.lateral.flat(a.point[1]);
    const Vec2 b0 = clip.lateral.flat(b.point[0]), b1 = clip.lateral.flat(b.point[1]);
    const Vec2 da = a1 - a0, db = b1 - b0;
    const double size_a = length2(da), size_b = length2(db);
    const double turn = cross(da, db);
    const auto height = [&](const Feature& f, double t) {
        return dot(clip.lateral.n, f.point[0] + (f.point[1] - f.point[0]) * t);
    };
    const std::uint16_t edge_a = feature_id(edge_feature, a.id), edge_b = feature_id(edge_feature, b.id);
    if (size_a > 0 && size_b > 0 && turn * turn < side_by_side * side_by_side * size_a * size_b) {
        // Side by side: the ends of the part that they share along a.
        double t0 = dot(b0 - a0, da) / size_a, t1 = dot(b1 - a0, da) / size_a;
        const bool backwards = t0 > t1;
        if (backwards) std::swap(t0, t1);
        const double begin = std::max(0.0, t0), end = std::min(1.0, t1);
        if (begin <= end) {
            const auto add = [&](double t, bool of_a, std::uint32_t end_a, std::uint32_t end_b) {
                const Vec2 p = a0 + da * t;
                const double s = std::clamp(dot(p - b0, db) / size_b, 0.0, 1.0);
                const Vec2 q = b0 + db * s;
                // The gap is the distance of the points, also sideways.
                const double height_a = height(a, t), rise = height(b, s) - height_a;
                const double aside = length2(q - p);
                const double gap = rise > 0 ? std::sqrt(rise * rise + aside) : rise + std::sqrt(aside);
                clip.add((p + q) * 0.5, height_a, height_a + gap,
                         of_a ? feature_id(vertex_feature, a.vertex[end_a]) : edge_a,
                         of_a ? edge_b : feature_id(vertex_feature, b.vertex[end_b]));
            };
            add(begin, t0 <= 0, 0, backwards ? 1 : 0);
            if (end > begin) add(end, t1 >= 1, 1, backwards ? 0 : 1);
        }
        return;
    }
    if (turn == 0) return;
    const double t = std::clamp(cross(b0 - a0, db) / turn, 0.0, 1.0);
    const double s = std::clamp(cross(b0 - a0, da) / turn, 0.0, 1.0);
    const Vec2 on_a = a0 + da * t, on_b = b0 + db * s;
    // Of many collinear edges, the two that were chosen may not be where they cross.
    if (length2(on_b - on_a) > elsewhere * elsewhere * clip.size * clip.size) return;
    clip.add((on_a + on_b) * 0.5, height(a, t), height(b, s), edge_a, edge_b);
}

} // namespace

void clip_features(Clip& clip, const Feature& a, const Feature& b)
{
    if (a.kind == face_feature && b.kind == face_feature)
        clip_faces(clip, a, b);
    else if (a.kind == edge_feature && b.kind == face_feature)
        clip_edge(clip, a, b, false);
    else if (a.kind == face_feature && b.kind == edge_feature)
        clip_edge(clip, b, a, true);
    else if (a.kind == edge_feature && b.kind == edge_feature)
        clip_edges(clip, a, b);
}

void clip_point(Clip& clip, const Feature& a, const Feature& b)
{
    const Vec2 p = clip.lateral.flat(a.point[0]);
    const std::size_t sides = b.point.size();
    for (std::size_t i = 0; i < sides; ++i) {
        const Vec2 from = clip.lateral.flat(b.point[i]),
                   to = clip.lateral.flat(b.point[i + 1 == sides ? 0 : i + 1]);
        if (cross(to - from, p - from) > 0) return; // b's loop runs clockwise
    }
    const Slope slope(clip.lateral, b);
    clip.add(p, dot(clip.lateral.n, a.point[0]), slope.at(p), feature_id(vertex_feature, a.vertex[0]),
             feature_id(face_feature, b.id));
}

} // namespace narrow
JOSTLE_NAMESPACE_END
