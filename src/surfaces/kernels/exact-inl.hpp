// SPDX-License-Identifier: MIT
// Distances and impacts, in doubles: decision 71. No include guard: kernels.cpp includes it once per set.

using Real = Vec<double>;
using Real3 = Point<double>;

/// What a corner's place along a direction, and a time, may be wrong by, as a part of the greatest
/// coordinate, in units of 2^-53: two for the differences, six for a corner's product with a unit vector,
/// eleven for a time, which is three roundings at a speed of up to 3.5 coordinates. It has 32 of them. A
/// bound may be less by six units of the distance itself, to which `wide` adds eight.
constexpr double rounding = 0x1p-48, wide = 1 + 0x1p-50;
/// Steps in which almost all impacts are found to the last bits. Most take 4 to 20; where parts nearly touch
/// at first, each step may only double their gap.
constexpr double exact_steps = 1000;

/// Numbers up to this are made larger, so that their fourth powers don't vanish; up to 1e60 these are finite.
constexpr double tiny = 0x1p-100, enlarging = 0x1p300, reducing = 0x1p-300;

/// Where numbers up to `greatest` are to be enlarged; up to four times.
HWY_ATTR HWY_INLINE Mask<double> too_small(Real greatest)
{
    return (greatest > Real(0)) & (greatest < Real(tiny));
}

template <int corners>
HWY_ATTR HWY_INLINE Polygon<double, corners> load_polygon(const double (&columns)[12][PlaceBatch::size],
                                                          std::uint32_t k)
{
    Real3 at[4];
    for (int i = 0; i < 4; ++i)
        at[i] = {Real::load(columns[3 * i] + k), Real::load(columns[3 * i + 1] + k),
                 Real::load(columns[3 * i + 2] + k)};
    if constexpr (corners == 3)
        return {{at[1] - at[0], at[2] - at[0], at[3] - at[0]}};
    else
        return {{at[2] - at[0], at[2] - at[1], at[3] - at[1], at[3] - at[0]}};
}
template <int corners>
HWY_ATTR HWY_INLINE Real greatest_of(const Polygon<double, corners>& polygon)
{
    Real most = Real(0);
    for (const Real3& corner : polygon.corner)
        most = max(most, greatest_of(corner));
    return most;
}
template <int corners>
HWY_ATTR HWY_INLINE Polygon<double, corners> operator*(Polygon<double, corners> polygon, Real factor)
{
    for (Real3& corner : polygon.corner)
        corner = corner * factor;
    return polygon;
}

/// `v` without what of it goes along `side`, which has a length; twice, since the first time leaves its own
/// rounding.
HWY_ATTR HWY_INLINE Real3 without(const Real3& v, const Real3& side)
{
    const Real by_size = Real(1) / dot(side, side);
    const Real3 once = v - side * (dot(v, side) * by_size);
    return once - side * (dot(once, side) * by_size);
}
/// Zero for zero.
HWY_ATTR HWY_INLINE Real3 unit(Real3 v)
{
    for (;;) { // until squares have all their digits
        const Real most = greatest_of(v);
        const Mask<double> small = (most > Real(0)) & (most < Real(0x1p-400));
        if (!any(small)) break;
        v = v * choose(small, Real(0x1p600), Real(1));
    }
    const Real size = sqrt(dot(v, v));
    return v * choose(size > Real(0), Real(1) / size, Real(0));
}
/// From the origin to the nearest point, not of unit length. Near the polygon the difference has lost most of
/// its digits; what counts is that it is at right angles to the side.
template <int corners>
HWY_ATTR HWY_INLINE Real3 toward(const Polygon<double, corners>& polygon, const Nearest<double>& nearest)
{
    const Mask<double> at_corner = (nearest.part <= Real(0)) | (nearest.part >= Real(1));
    return choose(nearest.side < Real(0), toward_face(polygon),
                  choose(at_corner, nearest.point, without(nearest.point, nearest.way)));
}

/// What is so inside, and on each of the sides.
HWY_ATTR HWY_INLINE Real by_side(const Nearest<double>& nearest, Real inside, Real of0, Real of1, Real of2,
                                 Real of3)
{
    const Real later = choose(nearest.side < Real(3), of2, of3);
    const Real on_side = choose(nearest.side < Real(1), of0, choose(nearest.side < Real(2), of1, later));
    return choose(nearest.side < Real(0), inside, on_side);
}
/// Where a point of a polygon is: how much of the sides that span it.
struct InFace
{
    Real across, along;
};
template <int corners>
HWY_ATTR HWY_INLINE InFace in_face(const Nearest<double>& nearest)
{
    const Real zero = Real(0), one = Real(1), part = nearest.part, rest = one - part;
    if constexpr (corners == 3)
        return {by_side(nearest, nearest.across, part, rest, zero, zero),
                by_side(nearest, nearest.along, zero, part, rest, zero)};
    else
        return {by_side(nearest, nearest.across, part, one, rest, zero),
                by_side(nearest, nearest.along, zero, part, one, rest)};
}

template <int corners>
HWY_ATTR void distances(const PlaceBatch& pairs, std::uint32_t count, PartDistances& found)
{
    const Real zero = Real(0), one = Real(1);
    for (std::uint32_t k = 0; k < count; k += Real::size) {
        Polygon<double, corners> polygon = load_polygon<corners>(pairs.from, k);
        Real enlarged = zero;
        for (;;) {
            const Mask<double> small = too_small(greatest_of(polygon));
            if (!any(small)) break;
            polygon = polygon * choose(small, Real(enlarging), one);
            enlarged = enlarged + choose(small, one, zero);
        }
        const Nearest<double> nearest = nearest_of(polygon);
        Real distance = sqrt(nearest.distance2);
        for (; any(enlarged > zero); enlarged = enlarged - one)
            distance = distance * choose(enlarged > zero, Real(reducing), one);
        distance.store(found.distance + k);

        const Real3 normal =
            unit(choose(nearest.distance2 > zero, toward(polygon, nearest), toward_face(polygon)));
        normal.x.store(found.normal[0] + k);
        normal.y.store(found.normal[1] + k);
        normal.z.store(found.normal[2] + k);

        const InFace at = in_face<corners>(nearest);
        if constexpr (corners == 3) {
            one.store(found.weight[0] + k);
            by_side(nearest, one - at.across - at.along, one - nearest.part, zero, nearest.part, zero)
                .store(found.weight[1] + k);
            at.across.store(found.weight[2] + k);
            at.along.store(found.weight[3] + k);
        } else {
            (one - at.across).store(found.weight[0] + k);
            at.across.store(found.weight[1] + k);
            (one - at.along).store(found.weight[2] + k);
            at.along.store(found.weight[3] + k);
        }
    }
}

/// The polygon's normal, towards it, when the nearest points will have met if they go on as they do now, or
/// now's if they don't come nearer. Along now's the fastest corner is there first, and only a part of the
/// time that is left is gained. Along this one all corners arrive together, if none goes the other way.
template <int corners>
HWY_ATTR HWY_INLINE Real3 face_ahead(const Motion<double, corners>& motion, const Nearest<double>& nearest,
                                     Real time, Real apart)
{
    const Real zero = Real(0), one = Real(1);
    Real3 speed[3];
    for (int i = 0; i < 3; ++i) {
        const int k = i == 2 ? corners - 1 : i;
        speed[i] = motion.to.corner[k] - motion.from.corner[k];
    }
    const InFace at = in_face<corners>(nearest);
    const Real nears = zero - dot(nearest.point, speed[0] + (speed[1] - speed[0]) * at.across +
                                                     (speed[2] - speed[0]) * at.along);
    const Real ahead = time + (nearest.distance2 - sqrt(nearest.distance2) * apart) / nears;
    const Polygon<double, corners> then =
        motion.at(choose((nears > zero) & (ahead > time) & (ahead < one), ahead, time));
    const Real3 normal = cross(then.across(), then.along());
    return choose(dot(normal, nearest.point) < zero, normal * Real(-1), normal);
}

/// The latest of clear_until() for all directions that could be the right one, and no earlier than `time`.
template <int corners>
HWY_ATTR HWY_INLINE Real clear_by_any(const Motion<double, corners>& motion, Real time, Real apart)
{
    const Polygon<double, corners> polygon = motion.at(time);
    Real until = max(time, motion.clear_until(toward_face(polygon), time, apart));
    for (int k = 0; k < corners; ++k) {
        const Real3 side = polygon.side(k), &corner = polygon.corner[k];
        const Real3 beside = choose(dot(side, side) > Real(0), without(corner, side), corner);
        until = max(until, motion.clear_until(beside, time, apart));
        until = max(until, motion.clear_until(corner, time, apart));
    }
    return until;
}

/// The greater of the longest side and of how far a corner moves.
template <int corners>
HWY_ATTR HWY_INLINE Real extent_of(const Motion<double, corners>& motion)
{
    Real most2 = Real(0);
    for (int k = 0; k < corners; ++k) {
        const Real3 side = motion.from.side(k), moves = motion.to.corner[k] - motion.from.corner[k];
        most2 = max(most2, max(dot(side, side), dot(moves, moves)));
    }
    return sqrt(most2);
}

/// Pairs that are on their way to their impacts, one in each lane.
template <int corners>
struct OnTheirWay
{
    static constexpr int numbers = 6 * corners + 3;

    /// Corners at the beginning, corners at the end, `apart`, the time, the steps taken.
    alignas(64) double column[numbers][Real::size];
    std::uint32_t pair[Real::size];

    [[nodiscard]] HWY_ATTR HWY_INLINE Polygon<double, corners> polygon(int first) const
    {
        Polygon<double, corners> polygon;
        for (int i = 0; i < corners; ++i)
            polygon.corner[i] = {Real::load(column[first + 3 * i]), Real::load(column[first + 3 * i + 1]),
                                 Real::load(column[first + 3 * i + 2])};
        return polygon;
    }
    [[nodiscard]] HWY_ATTR HWY_INLINE Motion<double, corners> motion() const
    {
        return {polygon(0), polygon(3 * corners)};
    }
    [[nodiscard]] HWY_ATTR HWY_INLINE Real number(int which) const
    {
        return Real::load(column[6 * corners + which]);
    }
};
constexpr int apart_number = 0, time_number = 1, steps_number = 2;

/// What is known of the pairs of a batch.
struct Pending
{
    alignas(64) double apart[PlaceBatch::size];
    double steps[PlaceBatch::size];
};

/// Puts a pair into a lane.
template <int corners>
HWY_ATTR void start(OnTheirWay<corners>& lanes, std::uint32_t lane, const PlaceBatch& pairs,
                    const Pending& pending, std::uint32_t pair, double time)
{
    for (int i = 0; i < 3 * corners; ++i) {
        lanes.column[i][lane] = pairs.from[i][pair];
        lanes.column[3 * corners + i][lane] = pairs.to[i][pair];
    }
    lanes.column[6 * corners + apart_number][lane] = pending.apart[pair];
    lanes.column[6 * corners + time_number][lane] = time;
    lanes.column[6 * corners + steps_number][lane] = pending.steps[pair];
    lanes.pair[lane] = pair;
}

/// Makes polygons of the pairs' places, in the same columns, so large that they can be computed with.
template <int corners>
HWY_ATTR HWY_INLINE void prepare(PlaceBatch& pairs, std::uint32_t count, Pending& pending)
{
    for (std::uint32_t k = 0; k < count; k += Real::size) {
        Motion<double, corners> motion{load_polygon<corners>(pairs.from, k),
                                       load_polygon<corners>(pairs.to, k)};
        Real reach = Real::load(pairs.reach + k), greatest;
        for (;;) {
            greatest = max(greatest_of(motion.from), greatest_of(motion.to));
            const Mask<double> small = too_small(greatest);
            if (!any(small)) break;
            const Real factor = choose(small, Real(enlarging), Real(1));
            motion = {motion.from * factor, motion.to * factor};
            reach = reach * factor;
        }
        (reach * Real(wide) + greatest * Real(rounding)).store(pending.apart + k);
        const auto put = [&](const Polygon<double, corners>& polygon, double(&columns)[12][PlaceBatch::size])
                             HWY_ATTR {
                                 for (int i = 0; i < corners; ++i) {
                                     polygon.corner[i].x.store(columns[3 * i] + k);
                                     polygon.corner[i].y.store(columns[3 * i + 1] + k);
                                     polygon.corner[i].z.store(columns[3 * i + 2] + k);
                                 }
                             };
        put(motion.from, pairs.from);
        put(motion.to, pairs.to);
    }
}

/// The nearest points' direction and the polygon's normal are mostly enough. Pairs that neither helps are put
/// aside, so that all directions are tried for as many of them at once as there are lanes; a pair that has
/// arrived makes room for the next one.
template <int corners>
HWY_ATTR void impacts(PlaceBatch& pairs, std::uint32_t count, double tolerance,
                      double (&times)[PlaceBatch::size])
{
    Pending pending;
    prepare<corners>(pairs, count, pending);
    const Real one = Real(1);
    std::uint32_t waiting[PlaceBatch::size], held[PlaceBatch::size];
    for (std::uint32_t k = 0; k < count; ++k) {
        waiting[k] = k;
        pending.steps[k] = 0;
        times[k] = 0;
    }
    OnTheirWay<corners> lanes;
    for (std::uint32_t waits = count; waits != 0;) {
        unsigned live = 0;
        for (std::uint32_t lane = 0; lane < Real::size; ++lane) { // with more lanes than pairs, some twice
            const std::uint32_t pair = waiting[waits == 0 ? 0 : waits - 1];
            start(lanes, lane, pairs, pending, pair, times[pair]);
            if (waits == 0) continue;
            --waits;
            live |= 1u << lane;
        }
        std::uint32_t holds = 0;
        while (live != 0) {
            const Motion<double, corners> motion = lanes.motion();
            const Real apart = lanes.number(apart_number), time = lanes.number(time_number),
                       steps = lanes.number(steps_number);
            const Polygon<double, corners> polygon = motion.at(time);
            const Nearest<double> nearest = nearest_of(polygon);
            Real until = max(time, motion.clear_until(toward(polygon, nearest), time, apart));
            if (any(until <= one))
                until = max(until, motion.clear_until(face_ahead(motion, nearest, time, apart), time, apart));
            Mask<double> arrived = nearest.distance2 <= Real(0);
            const Mask<double> many = (steps >= Real(exact_steps)) & (until <= one);
            if (any(many))
                arrived = arrived |
                          (many & (sqrt(nearest.distance2) - apart <= Real(tolerance) * extent_of(motion)));
            until = choose(arrived, time, until);
            until.store(lanes.column[6 * corners + time_number]);
            (steps + one).store(lanes.column[6 * corners + steps_number]);
            const unsigned arrives = mask_bits(arrived), stays = mask_bits(until <= time) & ~arrives,
                           passes = mask_bits(until > one);
            for (unsigned done = (arrives | stays | passes) & live; done != 0; done &= done - 1) {
                const auto lane = static_cast<std::uint32_t>(std::countr_zero(done));
                const std::uint32_t pair = lanes.pair[lane];
                times[pair] = lanes.column[6 * corners + time_number][lane];
                pending.steps[pair] = lanes.column[6 * corners + steps_number][lane];
                if ((stays >> lane & 1) != 0) held[holds++] = pair;
                if (waits != 0) {
                    const std::uint32_t next = waiting[--waits];
                    start(lanes, lane, pairs, pending, next, times[next]);
                } else {
                    live &= ~(1u << lane);
                }
            }
        }
        for (std::uint32_t k = 0; k < holds; k += Real::size) {
            for (std::uint32_t lane = 0; lane < Real::size; ++lane) {
                const std::uint32_t pair = held[std::min(k + lane, holds - 1)];
                start(lanes, lane, pairs, pending, pair, times[pair]);
            }
            clear_by_any(lanes.motion(), lanes.number(time_number), lanes.number(apart_number))
                .store(lanes.column[6 * corners + time_number]);
            for (std::uint32_t lane = 0; lane < std::min<std::uint32_t>(Real::size, holds - k); ++lane) {
                const std::uint32_t pair = lanes.pair[lane];
                const double until = lanes.column[6 * corners + time_number][lane];
                if (until > times[pair] && until <= 1) waiting[waits++] = pair;
                times[pair] = until;
            }
        }
    }
}
