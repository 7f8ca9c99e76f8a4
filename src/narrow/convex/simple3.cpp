// SPDX-License-Identifier: MIT
#include "narrow/convex/simple3.hpp"

#include "narrow/convex/clip.hpp"
#include "narrow/convex/manifold3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A box's edge along `axis`, by the signs of its other two coordinates in turn.
std::uint32_t edge_number(int axis, bool first, bool second)
{
    return static_cast<std::uint32_t>(axis * 4 + (first ? 1 : 0) + (second ? 2 : 0));
}
std::uint32_t face_number(int axis, bool positive)
{
    return static_cast<std::uint32_t>(2 * axis + (positive ? 1 : 0));
}
std::uint32_t vertex_number(int i, bool sign_i, int j, bool sign_j, int k, bool sign_k)
{
    return static_cast<std::uint32_t>((sign_i ? 1 : 0) << i | (sign_j ? 1 : 0) << j | (sign_k ? 1 : 0) << k);
}

/// A box's axes and half edges, selected by number without branches, since the number is hard to predict.
struct Axes
{
    Vec3 axis[3];
    double half[3];
    Axes(const Mat3& m, const Vec3& size) : axis{m.x, m.y, m.z}, half{size.x, size.y, size.z} {}
};

/// A corner of the face being cut: lateral place and height in the reference face's frame.
struct Corner
{
    double u, v, w;
    std::uint16_t feature_x, feature_y;
    std::uint8_t side; ///< that leads to the next: 0-3 of the cut face, 4-7 of the reference face
};

struct FaceCut
{
    Corner corner[8];
    int count = 4;
};

/// Sutherland and Hodgman's step for the side `sign * coordinate <= limit`.
template <double Corner::* coordinate>
void cut(FaceCut& polygon, double sign, double limit, std::uint8_t side, std::uint16_t edge_x,
         std::uint16_t vertex_before, std::uint16_t vertex_after, const std::uint16_t (&edge_y)[4],
         std::uint16_t face_y)
{
    double inside[8];
    bool all = true;
    for (int k = 0; k < polygon.count; ++k) {
        inside[k] = limit - sign * polygon.corner[k].*coordinate;
        all = all && inside[k] >= 0;
    }
    if (all) return;
    FaceCut result;
    result.count = 0;
    for (int k = 0; k < polygon.count; ++k) {
        const int next = k + 1 == polygon.count ? 0 : k + 1;
        const Corner& from = polygon.corner[k];
        if (inside[k] >= 0) result.corner[result.count++] = from;
        if ((inside[k] >= 0) == (inside[next] >= 0)) continue;
        const Corner& to = polygon.corner[next];
        const double t = inside[k] / (inside[k] - inside[next]);
        Corner made;
        made.u = from.u + (to.u - from.u) * t;
        made.v = from.v + (to.v - from.v) * t;
        made.w = from.w + (to.w - from.w) * t;
        if (from.side >= 4) {
            // The cut is along a side of the reference face, so this is a corner of that: where the polygon
            // leaves, the one after that side; sides are cut in turn.
            made.feature_x = from.side == ((side - 4 + 3) % 4) + 4 ? vertex_before : vertex_after;
            made.feature_y = face_y;
        } else {
            made.feature_x = edge_x;
            made.feature_y = edge_y[from.side];
        }
        made.side = inside[k] >= 0 ? side : from.side;
        // A convex polygon gains one corner per cut: at most 8 in total. Rounding can't make it cross twice.
        if (result.count < 8) result.corner[result.count++] = made;
    }
    polygon = result;
}

/// Face i of a box, on its positive or negative side.
struct Reference
{
    int i;
    bool positive;
};

/// The reference face of box x and the box y on it, with their places relative to a's position.
struct Meeting
{
    const Axes& x;
    Vec3 place_x;
    const Axes& y;
    Vec3 place_y;
    Reference reference;
    bool x_is_a;
    double margin, size; ///< of both boxes
};

/// At most 8: a rectangle cut by four sides.
struct Points
{
    ManifoldPoint<3> point[8];
    std::uint32_t count = 0;
};

/// The face of y that faces the reference face most, cut to it.
class FaceMeeting
{
  public:
    explicit FaceMeeting(const Meeting& given) : meeting_(given)
    {
        const Axes &x = given.x, &y = given.y;
        i_ = given.reference.i;
        iu_ = (i_ + 1) % 3;
        iv_ = (i_ + 2) % 3;
        out_ = x.axis[i_] * (given.reference.positive ? 1.0 : -1.0);
        xu_ = x.axis[iu_];
        xv_ = x.axis[iv_];
        hu_ = x.half[iu_];
        hv_ = x.half[iv_];
        top_ = x.half[i_];
        const Vec3 t = given.place_y - given.place_x;
        const double facing[3] = {dot(out_, y.axis[0]), dot(out_, y.axis[1]), dot(out_, y.axis[2])};
        int j = 0;
        for (int k = 1; k < 3; ++k)
            if (std::abs(facing[k]) > std::abs(facing[j])) j = k;
        const bool positive_y = facing[j] < 0;
        const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        const Vec3 centre = t + y.axis[j] * std::copysign(y.half[j], -facing[j]);
        const double cu = dot(xu_, centre), cv = dot(xv_, centre), cw = dot(out_, centre);
        const Vec3 y1 = y.axis[j1], y2 = y.axis[j2];
        const double u1 = dot(xu_, y1) * y.half[j1], v1 = dot(xv_, y1) * y.half[j1],
                     w1 = facing[j1] * y.half[j1];
        const double u2 = dot(xu_, y2) * y.half[j2], v2 = dot(xv_, y2) * y.half[j2],
                     w2 = facing[j2] * y.half[j2];

        const std::uint16_t face_x = feature_id(face_feature, face_number(i_, given.reference.positive));
        face_y_ = feature_id(face_feature, face_number(j, positive_y));
        constexpr bool sign1[4] = {false, true, true, false}, sign2[4] = {false, false, true, true};
        for (int k = 0; k < 4; ++k) {
            const double s1 = sign1[k] ? 1 : -1, s2 = sign2[k] ? 1 : -1;
            Corner& corner = polygon_.corner[k];
            corner.u = cu + s1 * u1 + s2 * u2;
            corner.v = cv + s1 * v1 + s2 * v2;
            corner.w = cw + s1 * w1 + s2 * w2;
            corner.feature_x = face_x;
            corner.feature_y =
                feature_id(vertex_feature, vertex_number(j, positive_y, j1, sign1[k], j2, sign2[k]));
            corner.side = static_cast<std::uint8_t>(k);
        }
        // Side k leads from corner k: along y1, y2, y1, y2. The two other axes in turn after y1 are j2, j.
        edge_y_[0] = feature_id(edge_feature, edge_number(j1, false, positive_y));
        edge_y_[1] = feature_id(edge_feature, edge_number(j2, positive_y, true));
        edge_y_[2] = feature_id(edge_feature, edge_number(j1, true, positive_y));
        edge_y_[3] = feature_id(edge_feature, edge_number(j2, positive_y, false));
    }

    /// The points along the reference face's own normal.
    void meet(Points& points)
    {
        cut_to_sides();
        for (int k = 0; k < polygon_.count; ++k) {
            const Corner& corner = polygon_.corner[k];
            double depth = top_ - corner.w;
            if (keeps(depth, meeting_.margin, meeting_.size))
                add(points, corner, depth, out_ * (corner.w + 0.5 * depth));
        }
    }
    /// The points along another normal, which points out of x: corners are shifted along it into the face's
    /// plane.
    void meet_along(const Vec3& normal, Points& points)
    {
        const double steep = dot(normal, out_);
        const double shift_u = dot(normal, xu_) / steep, shift_v = dot(normal, xv_) / steep;
        for (int k = 0; k < 4; ++k) {
            Corner& corner = polygon_.corner[k];
            corner.u += shift_u * (top_ - corner.w);
            corner.v += shift_v * (top_ - corner.w);
        }
        cut_to_sides();
        for (int k = 0; k < polygon_.count; ++k) {
            const Corner& corner = polygon_.corner[k];
            double depth = (top_ - corner.w) / steep;
            if (keeps(depth, meeting_.margin, meeting_.size))
                add(points, corner, depth, out_ * top_ - normal * (0.5 * depth));
        }
    }

  private:
    /// Mostly a corner or two are below the reference face well within its sides; what the sides would cut is
    /// too high to count.
    [[nodiscard]] bool is_within_sides() const
    {
        bool within = true;
        for (int k = 0; k < 4; ++k) {
            const Corner &from = polygon_.corner[k], &to = polygon_.corner[(k + 1) % 4];
            const double depth = top_ - from.w + meeting_.margin, other = top_ - to.w + meeting_.margin;
            if (depth >= 0) within = within && std::abs(from.u) <= hu_ && std::abs(from.v) <= hv_;
            if ((depth >= 0) == (other >= 0)) continue;
            const double at = depth / (depth - other);
            within = within && std::abs(from.u + (to.u - from.u) * at) <= hu_ &&
                     std::abs(from.v + (to.v - from.v) * at) <= hv_;
        }
        return within;
    }
    void cut_to_sides()
    {
        if (is_within_sides()) return;
        // The reference face's sides in turn: u+, v+, u-, v-; vertices between them.
        const bool positive = meeting_.reference.positive;
        const auto vertex_x = [&](bool su, bool sv) {
            return feature_id(vertex_feature, vertex_number(i_, positive, iu_, su, iv_, sv));
        };
        const auto edge_x = [](int axis, bool first, bool second) {
            return feature_id(edge_feature, edge_number(axis, first, second));
        };
        const std::uint16_t pp = vertex_x(true, true), mp = vertex_x(false, true),
                            mm = vertex_x(false, false), pm = vertex_x(true, false);
        cut<&Corner::u>(polygon_, 1, hu_, 4, edge_x(iv_, positive, true), pm, pp, edge_y_, face_y_);
        cut<&Corner::v>(polygon_, 1, hv_, 5, edge_x(iu_, true, positive), pp, mp, edge_y_, face_y_);
        cut<&Corner::u>(polygon_, -1, hu_, 6, edge_x(iv_, positive, false), mp, mm, edge_y_, face_y_);
        cut<&Corner::v>(polygon_, -1, hv_, 7, edge_x(iu_, false, positive), mm, pm, edge_y_, face_y_);
    }
    /// `inner`: the point relative to x's position, without its lateral place.
    void add(Points& points, const Corner& corner, double depth, const Vec3& inner) const
    {
        const Vec3 p = meeting_.place_x + xu_ * corner.u + xv_ * corner.v + inner;
        points.point[points.count++] = meeting_.x_is_a
                                           ? ManifoldPoint<3>{p, depth, corner.feature_x, corner.feature_y}
                                           : ManifoldPoint<3>{p, depth, corner.feature_y, corner.feature_x};
    }

    const Meeting& meeting_;
    int i_, iu_, iv_;
    Vec3 out_, xu_, xv_; ///< the reference face's normal and its sides' directions: w, u and v
    double hu_, hv_, top_;
    FaceCut polygon_;
    std::uint16_t face_y_, edge_y_[4];
};

/// The feature of a capsule or sphere that meets a normal, whose sine with its axis is `rise`: the segment if
/// that is level, otherwise the higher end.
std::uint16_t round_feature(const Round& round, double rise)
{
    if (round.half_length > 0 && std::abs(rise) <= nearly_level) return feature_id(edge_feature, 0);
    return feature_id(vertex_feature, round.half_length > 0 && rise > 0 ? 1 : 0);
}
Feature segment_of(const Round& round, const Vec3& place)
{
    Feature feature;
    feature.kind = edge_feature;
    for (const std::uint32_t end : {0u, 1u}) {
        feature.vertex.push_back(end);
        feature.point.push_back(place + round.axis * (end == 0 ? -round.half_length : round.half_length));
    }
    return feature;
}

/// The verdict from the distance of a core with a radius from a box.
Verdict core_touches(double distance, double radius, double size)
{
    if (distance > 1e-9 * size) return distance <= radius ? Verdict::touch : Verdict::apart;
    return radius > 1e-8 * size ? Verdict::touch : Verdict::unclear;
}

} // namespace

void rounds(const Round& a, const Round& b, const Vec3& d, const Gap<3>& gap, double margin,
            Manifold<3>& manifold)
{
    const Vec3& n = gap.normal;
    const std::uint16_t feature_a = round_feature(a, dot(n, a.axis)),
                        feature_b = round_feature(b, -dot(n, b.axis));
    const ManifoldPoint<3> nearest{(gap.on_a + gap.on_b) * 0.5, -gap.distance, feature_a, feature_b};
    // The clipping determines exactly which segments are side by side seen along the normal.
    if (feature_a == edge_feature && feature_b == edge_feature &&
        std::abs(dot(n, cross(a.axis, b.axis))) < 2 * side_by_side) {
        Clip clip(a.radius, b.radius, a.half_length + b.half_length, n, margin);
        clip_features(clip, segment_of(a, {}), segment_of(b, d));
        clip.complete(nearest.depth, [&] { return nearest; });
        return reduce(n, clip.found.data(), static_cast<std::uint32_t>(clip.found.size()), manifold);
    }
    manifold.normal = n;
    manifold.count = 1;
    manifold.point[0] = nearest;
}

Verdict boxes(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b, const Vec3& d,
              const BoxAxis& axis, double margin, Manifold<3>& manifold)
{
    if (!(axis.separation <= margin)) return Verdict::apart;
    const Vec3& n = axis.normal;
    const Axes box_a(a, half_a), box_b(b, half_b);
    const double size = half_a.x + half_a.y + half_a.z + half_b.x + half_b.y + half_b.z, slack = 1e-9 * size;
    // Face k of a, or k - 3 of b, and what it meets, along the face's own normal or along n.
    const auto faces = [&](int k, bool along_own) {
        const Meeting meeting =
            k < 3 ? Meeting{box_a, {}, box_b, d, {k, dot(n, box_a.axis[k]) > 0}, true, margin, size}
                  : Meeting{box_b, d, box_a, {}, {k - 3, dot(n, box_b.axis[k - 3]) < 0}, false, margin, size};
        Points points;
        if (along_own)
            FaceMeeting(meeting).meet(points);
        else
            FaceMeeting(meeting).meet_along(k < 3 ? n : -n, points);
        double deepest = -HUGE_VAL;
        for (std::uint32_t at = 0; at < points.count; ++at)
            deepest = std::max(deepest, points.point[at].depth);
        if (!(std::abs(deepest + axis.separation) <= slack)) return Verdict::unclear;
        reduce(n, points.point, points.count, manifold);
        return Verdict::touch;
    };
    if (axis.axis >= 6) {
        const int i = (axis.axis - 6) / 3, j = (axis.axis - 6) % 3;
        // The opposing edges, and their nearest points.
        bool sign_a[3], sign_b[3];
        Vec3 pa, pb = d;
        // Faces that are opposed within a few degrees are often separated best across two of their edges, but
        // they still meet over an area.
        double squarest = nearly_face;
        int facing = -1;
        for (int k = 0; k < 3; ++k) {
            const double up_a = dot(n, box_a.axis[k]), up_b = -dot(n, box_b.axis[k]);
            sign_a[k] = up_a > 0;
            sign_b[k] = up_b > 0;
            pa += box_a.axis[k] * (k != i ? std::copysign(box_a.half[k], up_a) : 0);
            pb += box_b.axis[k] * (k != j ? std::copysign(box_b.half[k], up_b) : 0);
            if (std::abs(up_a) > squarest) {
                squarest = std::abs(up_a);
                facing = k;
            }
            if (std::abs(up_b) > squarest) {
                squarest = std::abs(up_b);
                facing = 3 + k;
            }
        }
        const Vec3 da = box_a.axis[i], db = box_b.axis[j], r = pb - pa;
        const double c = dot(da, db), ra = dot(da, r), rb = dot(db, r), denominator = 1 - c * c;
        const double s = (ra - c * rb) / denominator, t = (c * ra - rb) / denominator;
        if (std::abs(s) > box_a.half[i] + slack || std::abs(t) > box_b.half[j] + slack)
            return Verdict::unclear;
        if (facing >= 0) return faces(facing, false);
        const Vec3 middle = (pa + da * s + pb + db * t) * 0.5;
        manifold.normal = n;
        manifold.count = 1;
        manifold.point[0] = {
            middle, -axis.separation,
            feature_id(edge_feature, edge_number(i, sign_a[(i + 1) % 3], sign_a[(i + 2) % 3])),
            feature_id(edge_feature, edge_number(j, sign_b[(j + 1) % 3], sign_b[(j + 2) % 3]))};
        return Verdict::touch;
    }
    return faces(axis.axis, true);
}

Verdict boxes_touch(const Mat3& a, const Vec3& half_a, const Mat3& b, const Vec3& half_b, const Vec3& d)
{
    const Axes box_a(a, half_a), box_b(b, half_b);
    const double *ha = box_a.half, *hb = box_b.half;
    const double clearly = 1e-8 * (ha[0] + ha[1] + ha[2] + hb[0] + hb[1] + hb[2]);
    double ta[3], cosine[3][3], size[3][3], most = -HUGE_VAL;
    for (int i = 0; i < 3; ++i) {
        ta[i] = dot(box_a.axis[i], d);
        for (int j = 0; j < 3; ++j) {
            cosine[i][j] = dot(box_a.axis[i], box_b.axis[j]);
            size[i][j] = std::abs(cosine[i][j]);
        }
        const double reach = ha[i] + hb[0] * size[i][0] + hb[1] * size[i][1] + hb[2] * size[i][2];
        const double separation = std::abs(ta[i]) - reach;
        if (separation > 0) return Verdict::apart;
        most = std::max(most, separation);
    }
    for (int j = 0; j < 3; ++j) {
        const double reach = hb[j] + ha[0] * size[0][j] + ha[1] * size[1][j] + ha[2] * size[2][j];
        const double separation = std::abs(dot(box_b.axis[j], d)) - reach;
        if (separation > 0) return Verdict::apart;
        most = std::max(most, separation);
    }
    // The direction across two edges needn't be known, as long as none separates the boxes.
    bool parted = false;
    for (int i = 0; i < 3; ++i) {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3;
        for (int j = 0; j < 3; ++j) {
            const int j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            const double t = ta[i2] * cosine[i1][j] - ta[i1] * cosine[i2][j];
            const double reach =
                ha[i1] * size[i2][j] + ha[i2] * size[i1][j] + hb[j1] * size[i][j2] + hb[j2] * size[i][j1];
            parted = parted || std::abs(t) - reach > 0;
        }
    }
    if (parted && box_axis(a, half_a, b, half_b, d).separation > 0) return Verdict::apart;
    return !parted && most < -clearly ? Verdict::touch : Verdict::unclear;
}

Verdict sphere_box_touch(double radius, const Mat3& b, const Vec3& half, const Vec3& d)
{
    double square = 0;
    for (int i = 0; i < 3; ++i) {
        const double centre = 0 - dot(i == 0 ? b.x : i == 1 ? b.y : b.z, d);
        const double gap = clamped(centre, half[i]) - centre;
        square = i == 0 ? gap * gap : square + gap * gap;
    }
    return core_touches(std::sqrt(square), radius, half.x + half.y + half.z);
}

Verdict capsule_box_touch(const Vec3& axis, double half_length, double radius, const Mat3& b,
                          const Vec3& half, const Vec3& d)
{
    return core_touches(capsule_box_gap(axis, half_length, b, half, d).distance, radius,
                        half_length + half.x + half.y + half.z);
}

Verdict capsule_box(const Vec3& axis, double half_length, double radius, const Mat3& b, const Vec3& half,
                    const Vec3& d, const CapsuleBoxGap& gap, double margin, Manifold<3>& manifold)
{
    if (!(gap.distance <= radius + margin)) return Verdict::apart;
    const Vec3& n = gap.normal;
    const Vec3 up = b.back(-n); // from the box to the capsule, in its frame
    const Vec3 centre = b.back(-d), along = b.back(axis);
    int i = 0;
    for (int k = 1; k < 3; ++k)
        if (std::abs(up[k]) > std::abs(up[i])) i = k;
    const bool positive = up[i] > 0;
    const double size = half_length + half.x + half.y + half.z, slack = 1e-9 * size;
    manifold.normal = n;
    manifold.count = 0;
    if (std::abs(up[i]) > 1 - 1e-12) {
        // Over a face: the part of the segment that is over it, by its ends.
        const int axes[2] = {(i + 1) % 3, (i + 2) % 3};
        double begin = -half_length, end = half_length;
        std::uint16_t end_a[2] = {feature_id(vertex_feature, 0), feature_id(vertex_feature, 1)};
        const std::uint16_t face = feature_id(face_feature, face_number(i, positive));
        std::uint16_t end_b[2] = {face, face};
        const std::uint16_t middle = feature_id(edge_feature, 0);
        bool over = true;
        for (const int k : axes) {
            const int other = axes[0] == k ? axes[1] : axes[0];
            for (const bool side : {false, true}) {
                const double sign = side ? 1 : -1;
                // sign * (centre + t * along) <= half
                const double room = half[k] - sign * centre[k], speed = sign * along[k];
                const std::uint16_t edge =
                    feature_id(edge_feature, other == (i + 1) % 3 ? edge_number(other, side, positive)
                                                                  : edge_number(other, positive, side));
                if (speed > 0) {
                    if (room / speed < end) {
                        end = room / speed;
                        end_a[1] = middle;
                        end_b[1] = edge;
                    }
                } else if (speed < 0) {
                    if (room / speed > begin) {
                        begin = room / speed;
                        end_a[0] = middle;
                        end_b[0] = edge;
                    }
                } else if (room < 0) {
                    over = false;
                }
            }
        }
        if (over && begin <= end) {
            const double rise = dot(n, axis);
            const double top = dot(n, d) - std::abs(up[i]) * half[i]; // the face's height along n
            for (int which = 0; which < (end > begin ? 2 : 1); ++which) {
                const double t = which == 0 ? begin : end;
                const double height = rise * t + radius;
                double depth = height - top;
                if (!keeps(depth, margin, size)) continue;
                const Vec3 p = axis * t + n * (radius - 0.5 * depth);
                manifold.point[manifold.count++] = {p, depth, end_a[which], end_b[which]};
            }
            if (manifold.count == 2 && manifold.point[1].depth > manifold.point[0].depth)
                std::swap(manifold.point[0], manifold.point[1]);
        }
        if (manifold.count > 0 && std::abs(manifold.point[0].depth - (radius - gap.distance)) <= slack)
            return Verdict::touch;
    }
    if (gap.distance <= 0) return Verdict::unclear;
    const double at = dot(axis, gap.on_a);
    const std::uint16_t feature_a = at <= -half_length  ? feature_id(vertex_feature, 0)
                                    : at >= half_length ? feature_id(vertex_feature, 1)
                                                        : feature_id(edge_feature, 0);
    const Vec3 q = b.back(gap.on_b - d);
    bool sign[3], free[3];
    int frees = 0, last = 0;
    for (int k = 0; k < 3; ++k) {
        sign[k] = q[k] > 0;
        free[k] = std::abs(q[k]) < half[k] - slack;
        if (free[k]) ++frees, last = k;
    }
    std::uint16_t feature_b = feature_id(vertex_feature, vertex_number(0, sign[0], 1, sign[1], 2, sign[2]));
    if (frees == 1)
        feature_b = feature_id(edge_feature, edge_number(last, sign[(last + 1) % 3], sign[(last + 2) % 3]));
    else if (frees >= 2)
        feature_b = feature_id(face_feature, face_number(i, positive));
    manifold.count = 1;
    manifold.point[0] = {(gap.on_a + n * radius + gap.on_b) * 0.5, radius - gap.distance, feature_a,
                         feature_b};
    return Verdict::touch;
}

double box_triangle(const Vec3& half, const Vec3 (&corner)[3], double enough, Vec3& normal)
{
    double best = -HUGE_VAL;
    for (int i = 0; i < 3; ++i) {
        const double lo = std::min(corner[0][i], std::min(corner[1][i], corner[2][i]));
        const double hi = std::max(corner[0][i], std::max(corner[1][i], corner[2][i]));
        const double separation = std::max(lo, -hi) - half[i];
        if (separation > enough) return separation;
        if (separation > best) {
            best = separation;
            normal = {};
            normal[i] = lo >= -hi ? 1 : -1;
        }
    }
    const Vec3 edge[3] = {corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]};
    const Vec3 n = cross(edge[0], edge[1]);
    {
        const double size = length(n), offset = dot(n, corner[0]);
        const double reach = half.x * std::abs(n.x) + half.y * std::abs(n.y) + half.z * std::abs(n.z);
        const double separation = (std::abs(offset) - reach) / size;
        if (separation > enough) return separation;
        if (separation > best) {
            best = separation;
            normal = n * ((offset >= 0 ? 1 : -1) / size);
        }
    }
    const double by = 1e-10 * (half.x + half.y + half.z + std::sqrt(length2(edge[0]) + length2(edge[1])));
    const double size2[3] = {length2(edge[0]), length2(edge[1]), length2(edge[2])};
    for (int i = 0; i < 3; ++i) {
        const int j = i == 2 ? 0 : i + 1, k = i == 0 ? 2 : i - 1;
        const double half_j = half[j], half_k = half[k];
        const double at_j[3] = {corner[0][j], corner[1][j], corner[2][j]};
        const double at_k[3] = {corner[0][k], corner[1][k], corner[2][k]};
        for (int e = 0; e < 3; ++e) {
            // Axis i x edge e; both its ends are equally far along.
            const int after = e == 2 ? 0 : e + 1, before = e == 0 ? 2 : e - 1;
            const double u = at_k[e] - at_k[after], v = at_j[after] - at_j[e];
            const double square = u * u + v * v;
            if (!(square > 1e-14 * size2[e])) continue;
            const double one = at_j[e] * u + at_k[e] * v, other = at_j[before] * u + at_k[before] * v;
            const double lo = std::min(one, other), hi = std::max(one, other);
            const double inverse = 1 / std::sqrt(square);
            const double separation =
                (std::max(lo, -hi) - (half_j * std::abs(u) + half_k * std::abs(v))) * inverse;
            if (separation > enough) return separation;
            if (separation > best + by) {
                best = separation;
                const double sign = lo >= -hi ? inverse : -inverse;
                normal = {};
                normal[j] = u * sign;
                normal[k] = v * sign;
            }
        }
    }
    return best;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
