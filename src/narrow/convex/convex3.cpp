// SPDX-License-Identifier: MIT
#include "narrow/convex/convex3.hpp"

#include "narrow/convex/axes.hpp"
#include "narrow/convex/descent.hpp"
#include "narrow/convex/epa.hpp"
#include "narrow/convex/manifold3.hpp"
#include "narrow/convex/simple3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// The number of projections of vertices from which the expanding polytope is faster than testing all axes.
constexpr double most_axes_cost = 1500;

/// The separation of two cores along unit direction n; negative for an overlap.
double parted_by(const Core3& a, const Core3& b, const Vec3& n)
{
    return dot(n, furthest(b, -n) - furthest(a, n));
}

/// Makes the signed distance of smooth cores exact, which the expanding polytope and GJK find less precisely:
/// moved apart along the normal found so far until they are `clear` of each other, the cores are nearest
/// along a better one. The less they overlap, the fewer steps it takes.
void polish(const Core3& a, const Core3& b, double clear, Gap<3>& gap)
{
    const double size = a.reach + b.reach;
    for (int step = 0; step < 20; ++step) {
        Simplex simplex;
        Gap<3> parted;
        const Vec3 shift = gap.normal * (clear * size - gap.distance);
        if (gjk(a, b, shift, HUGE_VAL, {}, simplex, parted) != Verdict::apart) return;
        const double distance = parted_by(a, b, parted.normal);
        if (!(distance > gap.distance + 1e-14 * size)) return;
        gap.normal = parted.normal;
        gap.distance = distance;
        gap.located = false;
    }
}

/// Relative to the size: cores that overlap by less nearly touch.
constexpr double nearly = 1e-6;
/// Relative to the size: a plane with this much room certainly separates two polytopes, rounding included.
constexpr double parts_polytopes = 1e-14;

/// Whether the result of gjk() for two cores must be checked. If they nearly touch, rounding leaves few
/// digits of the direction between them; it may then choose a wrong face, and get stuck among the points of
/// smooth ones.
bool is_doubtful(const Core3& a, const Core3& b, Verdict verdict, const Simplex& simplex, const Gap<3>& gap)
{
    if (verdict == Verdict::unclear) return false;
    const double size = a.reach + b.reach;
    if (verdict == Verdict::touch) return simplex.parted > -nearly * size;
    return gap.distance != HUGE_VAL && gap.distance - simplex.parted > 1e-10 * size;
}
/// Has that look: of two cores that are apart or overlap a little, the signed distance is the most by which
/// any direction parts them. What one search leaves over another one finds, as they get stuck elsewhere.
Verdict look_closer(const Core3& a, const Core3& b, Verdict verdict, const Simplex& simplex, Gap<3>& gap)
{
    const Gap<3> known = gap;
    const double size = a.reach + b.reach;
    bool is_certain = false;
    if (descends(a, b)) {
        is_certain = descend(a, b, HUGE_VAL, gap);
    } else {
        gap.distance = parted_by(a, b, gap.normal);
        gap.located = false;
    }
    if (!is_certain)
        for (const double clear : {1e-3, 1e-1})
            polish(a, b, clear, gap);
    const bool is_smooth = a.is_smooth() || b.is_smooth();
    const double parted = is_smooth ? gap.distance : std::max(gap.distance, simplex.parted);
    if (!(parted > (is_smooth ? 0 : parts_polytopes * size))) return Verdict::touch;
    if (!gap.located) nearest_when_parted(a, b, gap, gap.on_a, gap.on_b);
    if (is_smooth) return Verdict::apart;
    // A plane between them says what the distance is at least, two points what it is at most. Where corners
    // or edges lie side by side and not over each other, the points know it better.
    const Vec3 way = gap.on_b - gap.on_a;
    const double far = length(way), most = verdict == Verdict::apart ? known.distance : uncertain(a, b);
    if (!(far > gap.distance + 1e-11 * size)) return Verdict::apart;
    if (far <= most) {
        gap.distance = far;
        gap.normal = way * (1 / far);
    } else if (verdict == Verdict::apart) {
        gap = known;
    }
    return Verdict::apart;
}
/// These have closed forms.
bool is_point_on_round(const Core3& a, const Core3& b)
{
    return !a.is_smooth() && a.polytope.vertices == 1 &&
           (b.smooth == Smooth::cylinder || b.smooth == Smooth::cone);
}

/// The gap of cores that touch according to GJK.
void overlap(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap)
{
    const double axes_cost = static_cast<double>(a.polytope.directions) * b.polytope.directions *
                             (a.polytope.vertices + b.polytope.vertices);
    if (!a.is_smooth() && !b.is_smooth() && axes_cost < most_axes_cost) return gap_by_axes(a, b, gap);
    if (is_point_on_round(a, b)) return point_depth(a.frame * a.polytope.vertex(0), b, gap);
    if (descends(a, b)) return least_overlap(a, b, simplex, gap);
    expand(a, b, simplex, gap);
    if (a.is_smooth() || b.is_smooth()) polish(a, b, 1e-3, gap);
    gap.distance = std::min(0.0, gap.distance);
}
/// Whether two cores are apart, and their gap if so.
Verdict gap_if_apart(const Core3& a, const Core3& b, double enough, Simplex& simplex, Gap<3>& gap)
{
    if (is_point_on_round(a, b)) {
        const Verdict verdict = point_gap(a.frame * a.polytope.vertex(0), b, enough, gap);
        return verdict == Verdict::apart ? verdict : Verdict::touch;
    }
    Verdict verdict = Verdict::unclear;
    if (descends(a, b)) { // on smooth surfaces GJK takes many steps, and Newton's method a few
        verdict = gjk(a, b, {}, enough, {.parted = 4, .unparted = 16}, simplex, gap);
        // An overlap that no small turn reduces isn't proven to be the least if it is deep: then GJK decides.
        if (verdict == Verdict::unclear && descend(a, b, enough, gap) &&
            gap.distance > -nearly * (a.reach + b.reach))
            return gap.distance > 0 ? Verdict::apart : Verdict::touch;
    }
    if (verdict == Verdict::unclear) verdict = gjk(a, b, {}, enough, {}, simplex, gap);
    return is_doubtful(a, b, verdict, simplex, gap) ? look_closer(a, b, verdict, simplex, gap) : verdict;
}
bool are_sharp_boxes(const Core3& a, const Core3& b)
{
    return a.is_box && b.is_box && a.radius == 0 && b.radius == 0;
}
/// The gap of two sharp boxes that overlap, from their contact. Returns false if they overlap by no more than
/// rounding.
bool gap_of_boxes(const Core3& a, const Core3& b, Gap<3>& gap)
{
    const Vec3 half_a = a.polytope.vertex(7), half_b = b.polytope.vertex(7), d = b.frame.p - a.frame.p;
    const BoxAxis axis = box_axis(a.frame.r, half_a, b.frame.r, half_b, d);
    Manifold<3> manifold;
    if (!(axis.separation < 0)) return false;
    if (boxes(a.frame.r, half_a, b.frame.r, half_b, d, axis, 0, manifold) != Verdict::touch) return false;
    const Vec3 middle = a.frame.p + manifold.point[0].p, half = axis.normal * (0.5 * axis.separation);
    gap = {axis.separation, axis.normal, middle - half, middle + half, true};
    return true;
}

} // namespace

void core_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Simplex simplex;
    if (are_small_polyhedra(a, b)) {
        // A few steps recognise most cores that are apart; the rest mostly overlap.
        const Verdict verdict = gjk(a, b, {}, enough, {.steps = 2}, simplex, gap);
        const bool is_sure = !is_doubtful(a, b, verdict, simplex, gap);
        if (verdict == Verdict::apart && is_sure) return;
        const bool is_parted = !is_sure && simplex.parted > parts_polytopes * (a.reach + b.reach);
        if (!is_parted && polyhedra_gap(a, b, enough, gap)) {
            if (verdict == Verdict::touch && is_sure) gap.distance = std::min(0.0, gap.distance);
            if (gap.distance > enough + uncertain(a, b)) gap.distance = HUGE_VAL;
            if (gap.distance <= 0 || gap.distance == HUGE_VAL) return;
        }
    }
    if (gap_if_apart(a, b, enough, simplex, gap) != Verdict::apart) overlap(a, b, simplex, gap);
}

Verdict gap_if_apart(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Simplex simplex;
    return gap_if_apart(a, b, enough, simplex, gap);
}

void convex_gap(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Simplex simplex;
    Gap<3> cores;
    const double cores_enough = enough + a.radius + b.radius;
    Verdict verdict = Verdict::unclear;
    bool overlaps = false;
    if (are_small_polyhedra(a, b)) { // without a plane between them after two steps, most overlap
        verdict = gjk(a, b, {}, cores_enough, {.unparted = 2}, simplex, cores);
        if (is_doubtful(a, b, verdict, simplex, cores)) verdict = Verdict::unclear;
        if (verdict != Verdict::apart) {
            const bool are_boxes = are_sharp_boxes(a, b);
            if (are_boxes && gap_of_boxes(a, b, gap)) return;
            overlaps = !are_boxes && polyhedra_gap(a, b, cores_enough, cores) && cores.distance <= 0;
        }
    }
    if (!overlaps && verdict != Verdict::apart) {
        verdict = gap_if_apart(a, b, cores_enough, simplex, cores);
        if (verdict != Verdict::apart) overlap(a, b, simplex, cores);
    }
    gap.distance = cores.distance - a.radius - b.radius;
    gap.normal = cores.normal;
    if (cores.distance == HUGE_VAL) return;
    if (cores.distance > 0 || cores.located) {
        gap.on_a = cores.on_a + cores.normal * a.radius;
        gap.on_b = cores.on_b - cores.normal * b.radius;
        return;
    }
    Manifold<3> manifold;
    make_manifold(a, b, cores, 0, manifold);
    const Vec3 half = gap.normal * (0.5 * gap.distance);
    gap.on_a = manifold.point[0].p - half;
    gap.on_b = manifold.point[0].p + half;
}

bool convex_contact(const Core3& a, const Core3& b, double margin, Manifold<3>& manifold)
{
    Gap<3> cores;
    const double enough = a.radius + b.radius + margin;
    // For smooth cores GJK may report a touch where Newton's method finds a gap.
    const double doubt = a.is_smooth() || b.is_smooth() ? uncertain(a, b) : 0;
    core_gap(a, b, enough + doubt, cores);
    if (!(cores.distance <= enough)) {
        if (!(cores.distance <= enough + doubt && convex_touch(a, b))) return false;
        cores.distance = enough;
    }
    make_manifold(a, b, cores, margin, manifold);
    return true;
}

Verdict ball_contact(double radius, const Core3& b, double margin, Manifold<3>& manifold)
{
    Gap<3> cores;
    const double enough = radius + b.radius + margin;
    if (point_gap({}, b, enough, cores) != Verdict::apart) return Verdict::unclear;
    if (!(cores.distance <= enough)) return Verdict::apart;
    make_ball_manifold(radius, b, cores, manifold);
    return Verdict::touch;
}

bool convex_touch(const Core3& a, const Core3& b)
{
    Simplex simplex;
    Gap<3> gap;
    const double enough = a.radius + b.radius;
    if (!is_point_on_round(a, b)) {
        const Verdict verdict = gjk(a, b, {}, enough, {}, simplex, gap);
        const bool is_close = (a.is_smooth() || b.is_smooth()) && verdict == Verdict::apart &&
                              std::abs(gap.distance - enough) <= uncertain(a, b);
        if (!is_close && !is_doubtful(a, b, verdict, simplex, gap))
            return verdict == Verdict::touch || gap.distance <= enough;
    }
    core_gap(a, b, enough, gap); // so that there is a contact whenever this reports a touch
    return gap.distance <= enough;
}

void half_space_gap(const Core3& a, const Vec3& normal, double offset, Gap<3>& gap)
{
    const Support lowest = support(a, -normal);
    gap.distance = dot(normal, lowest.p) - offset - a.radius;
    gap.normal = -normal;
    gap.on_a = lowest.p - normal * a.radius;
    gap.on_b = gap.on_a - normal * gap.distance;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
