// SPDX-License-Identifier: MIT
// Distances of spheres, capsules and boxes, several pairs at a time, from users' input to their results. Each
// does the same as simple_distance in answers.hpp for one pair, operation by operation. Compiled once per
// instruction set, see kernels.cpp.

/// Pairs in the order in which they are computed.
struct RealPairs
{
    RealMask clear; ///< can be answered here
    RealMat turn_a, turn_b;
    Real3 d;           ///< from a to b
    RealMask swapped;  ///< b was given first
    RealMask exchange; ///< a and b of the batch must be exchanged, except in d
};

/// Whether a pose is certainly valid, with a quaternion that `rotation` in math.hpp reads without scaling.
HWY_ATTR HWY_INLINE RealMask is_plain(const Real3& place, const Real (&turn)[4])
{
    Real big = Real(0), sum = Real(0);
    for (const Real& q : turn) {
        big = greater_of(big, abs(q));
        sum = sum + abs(q);
    }
    // A sum with a NaN in it is NaN, which compares false.
    return (abs(place.x) + abs(place.y) + abs(place.z) <= Real(longest)) & (Real(0.25) < big) &
           (big < Real(4)) & (sum <= Real(16));
}

HWY_ATTR HWY_INLINE RealPairs load_pairs(const DistanceBatch& pairs, std::uint32_t k)
{
    const Real zero = Real(0), one = Real(1);
    const Real3 place_a = load3(pairs.place_a, k), place_b = load3(pairs.place_b, k);
    Real turn_a[4], turn_b[4];
    for (int i = 0; i < 4; ++i) {
        turn_a[i] = Real::loadu(pairs.turn_a[i] + k);
        turn_b[i] = Real::loadu(pairs.turn_b[i] + k);
    }
    // The order is that of `arrange`.
    const Real3 way = subtract3(place_b, place_a);
    const Real order = Real::loadu(pairs.order + k);
    const Real decides = choose(zero < abs(way.x), way.x, choose(zero < abs(way.y), way.y, way.z));
    const RealMask exchange = (abs(order) <= zero) & (decides < zero);
    const RealMask swapped = (order < zero) | exchange;
    const RealMask clear =
        is_plain(place_a, turn_a) & is_plain(place_b, turn_b) & (zero < abs(order) + abs(decides));
    for (int i = 0; i < 4; ++i) { // what can't be answered here raises no exceptions
        turn_a[i] = choose(clear, turn_a[i], i == 3 ? one : zero);
        turn_b[i] = choose(clear, turn_b[i], i == 3 ? one : zero);
    }
    return {
        clear,
        matrix(turn_a[0], turn_a[1], turn_a[2], turn_a[3]),
        matrix(turn_b[0], turn_b[1], turn_b[2], turn_b[3]),
        add3(scale3(way, choose(swapped, Real(-1), one)), {zero, zero, zero}), // never -0, as in from_to()
        swapped,
        exchange};
}

HWY_ATTR HWY_INLINE Real extent(const Real3& d)
{
    return abs(d.x) + abs(d.y) + abs(d.z);
}

/// Writes users' results, from two cores with a radius around each: like gap_of and `finish`.
HWY_ATTR HWY_INLINE void put_answers(DistanceBatch& pairs, std::uint32_t k, const RealPairs& pair,
                                     const RealGap& cores, const Real& size, const Real& radius_a,
                                     const Real& radius_b)
{
    const Real gap = cores.distance - radius_a - radius_b;
    const RealMask clear = pair.clear & (Real(core_touch) * size < cores.distance),
                   near = gap <= Real(pairs.enough);
    const Real3 none{Real(0), Real(0), Real(0)};
    const Real3 on_a = add3(cores.on_a, scale3(cores.normal, radius_a));
    const Real3 on_b = subtract3(subtract3(cores.on_b, scale3(cores.normal, radius_b)), pair.d);
    const Real3 normal = scale3(cores.normal, choose(pair.swapped, Real(-1), Real(1)));
    choose(near, gap, Real(HUGE_VAL)).storeu(pairs.distance + k);
    put(choose3(near, normal, none), pairs.normal, k);
    put(choose3(near, choose3(pair.swapped, on_b, on_a), none), pairs.from_a, k);
    put(choose3(near, choose3(pair.swapped, on_a, on_b), none), pairs.from_b, k);
    pairs.clear |= mask_bits(clear) << k;
}

/// Capsules, and spheres with capsules.
HWY_ATTR inline void round_distances(DistanceBatch& pairs)
{
    pairs.clear = 0;
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealPairs pair = load_pairs(pairs, k);
        const Real half_a = Real::loadu(pairs.half_a[1] + k), half_b = Real::loadu(pairs.half_b[1] + k);
        const Real radius_a = Real::loadu(pairs.radius_a + k), radius_b = Real::loadu(pairs.radius_b + k);
        // A sphere counts as along y, whatever its rotation.
        const RealMask is_sphere = Real(0) < abs(Real::loadu(pairs.order + k));
        const Real3 axis_a = choose3(is_sphere, {Real(0), Real(1), Real(0)}, pair.turn_a.y);
        const Real3& axis_b = pair.turn_b.y;
        const Real half_first = choose(pair.exchange, half_b, half_a),
                   half_second = choose(pair.exchange, half_a, half_b);
        const RealGap cores = segments(choose3(pair.exchange, axis_b, axis_a), half_first,
                                       choose3(pair.exchange, axis_a, axis_b), half_second, pair.d);
        put_answers(pairs, k, pair, cores, extent(pair.d) + half_first + half_second,
                    choose(pair.exchange, radius_b, radius_a), choose(pair.exchange, radius_a, radius_b));
    }
}

/// The point of a box nearest to a sphere's centre: in the box's axes it is the centre, with each coordinate
/// clamped to the box.
HWY_ATTR inline void sphere_box_distances(DistanceBatch& pairs)
{
    const Real zero = Real(0), one = Real(1);
    const Real3 none{zero, zero, zero};
    pairs.clear = 0;
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealPairs pair = load_pairs(pairs, k);
        const RealMat& turn = pair.turn_b;
        const Real3 half = load3(pairs.half_b, k), back = subtract3(none, pair.d);
        const Real3 centre{dot3(turn.x, back), dot3(turn.y, back), dot3(turn.z, back)};
        const Real3 nearest{clamped(centre.x, half.x), clamped(centre.y, half.y), clamped(centre.z, half.z)};
        const Real3 way = subtract3(nearest, centre);
        const Real distance = sqrt(dot3(way, way));
        const Real inverse = one / choose(zero < distance, distance, one);
        const RealGap cores{distance, turn3(turn, scale3(way, inverse)), none,
                            add3(pair.d, turn3(turn, nearest))};
        put_answers(pairs, k, pair, cores, extent(pair.d) + extent(half), Real::loadu(pairs.radius_a + k),
                    zero);
    }
}

HWY_ATTR inline void capsule_box_distances(DistanceBatch& pairs)
{
    pairs.clear = 0;
    for (std::uint32_t k = 0; k < batch; k += Real::size) {
        const RealPairs pair = load_pairs(pairs, k);
        const RealGap cores = segment_box(pair.turn_a.y, Real::loadu(pairs.half_a[1] + k), pair.turn_b,
                                          load3(pairs.half_b, k), pair.d);
        put_answers(pairs, k, pair, cores, Real(0), Real::loadu(pairs.radius_a + k), Real(0));
    }
}
