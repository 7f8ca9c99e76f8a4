// SPDX-License-Identifier: MIT
// Pairs on their way into kernels and back.
#pragma once

#include "narrow/interface/batches.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Quaternions that `rotation` in math.hpp reads without scaling.
template <class T>
bool is_plain(const Pose<3, T>& pose)
{
    double big = 0;
    for (const T q : pose.rotation)
        big = std::max(big, std::abs(double{q}));
    return big > 0.25 && big < 4;
}

inline Mat3 lane(const double (&m)[9][batch], std::uint32_t k)
{
    return {{m[0][k], m[1][k], m[2][k]}, {m[3][k], m[4][k], m[5][k]}, {m[6][k], m[7][k], m[8][k]}};
}
inline Vec3 lane(const double (&v)[3][batch], std::uint32_t k)
{
    return {v[0][k], v[1][k], v[2][k]};
}
template <class T>
void put_turn(const Pose<3, T>& pose, double (&turn)[4][batch], std::uint32_t k)
{
    for (std::size_t i = 0; i < 4; ++i)
        turn[i][k] = double{pose.rotation[i]};
}
inline void put(const Vec3& v, double (&to)[3][batch], std::uint32_t k)
{
    to[0][k] = v.x;
    to[1][k] = v.y;
    to[2][k] = v.z;
}

/// A capsule, or a sphere with one: that lies along y, whatever it turns.
template <class T>
void put_rounds(RoundBatch& rows, const ArrangedPair<T>& s, std::uint32_t k)
{
    if (s.a->type() == ShapeTypes::sphere) {
        for (std::size_t d = 0; d < 4; ++d)
            rows.turn_a[d][k] = d == 3 ? 1 : 0;
    }
    rows.half_a[k] = s.a->size()[1];
    rows.half_b[k] = s.b->size()[1];
}
/// What the kernel has found of them.
template <class T>
Cores round_cores(const RoundBatch& rows, const ArrangedPair<T>& s, std::uint32_t k)
{
    return {rows.distance[k],
            lane(rows.normal, k),
            lane(rows.on_a, k),
            lane(rows.on_b, k),
            extent(s.d) + s.a->size()[1] + s.b->size()[1],
            s.a->radius(),
            s.b->radius()};
}

inline bool is_zero(const Vec3& v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}

/// Passes the `wanted` pairs of a list through a kernel, `batch` at a time. put_rest(rows, pair, k) writes
/// what this kernel needs beside rotations and distance into lane k; answer(rows, pair, k, i) processes the
/// kernel's result for the i-th pair of the block; general(i) handles
/// the pairs that kernels can't.
template <class T, class Rows, class Wanted, class Put, class Answer, class General>
void through_kernel(const PairSet<T>& set, std::span<const std::uint16_t> list, void (*kernel)(Rows&),
                    const Wanted& wanted, const Put& put_rest, const Answer& answer, const General& general)
{
    Rows rows;
    ArrangedPair<T> arranged[batch];
    std::uint16_t place[batch];
    std::uint32_t count = 0;
    const auto put_lane = [&](const ArrangedPair<T>& s, std::uint32_t k) {
        put_turn(*s.pose_a, rows.turn_a, k);
        put_turn(*s.pose_b, rows.turn_b, k);
        put(s.d, rows.d, k);
        put_rest(rows, s, k);
    };
    const auto flush = [&] {
        if (count == 0) return;
        for (std::uint32_t k = count; k < batch; ++k) // something that makes no exceptions
            put_lane(arranged[0], k);
        kernel(rows);
        for (std::uint32_t k = 0; k < count; ++k)
            answer(rows, arranged[k], k, place[k]);
        count = 0;
    };
    for (const std::uint16_t i : list) {
        const ArrangedPair<T> s = set.take(i);
        if ((s.a->type() == s.b->type() && is_zero(s.d)) || !is_plain(*s.pose_a) || !is_plain(*s.pose_b)) {
            general(i);
            continue;
        }
        if (!wanted(s)) continue;
        put_lane(s, count);
        arranged[count] = s;
        place[count++] = i;
        if (count == batch) flush();
    }
    flush();
}

} // namespace narrow
JOSTLE_NAMESPACE_END
