// SPDX-License-Identifier: MIT
#include "narrow/interface/batches.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Whether `rotation` in math.hpp reads a quaternion without scaling.
template <class T>
bool is_plain(const Pose<3, T>& pose)
{
    double big = 0;
    for (const T q : pose.rotation)
        big = std::max(big, std::abs(double{q}));
    return big > 0.25 && big < 4;
}

Mat3 lane(const double (&m)[9][batch], std::uint32_t k)
{
    return {{m[0][k], m[1][k], m[2][k]}, {m[3][k], m[4][k], m[5][k]}, {m[6][k], m[7][k], m[8][k]}};
}
Vec3 lane(const double (&v)[3][batch], std::uint32_t k)
{
    return {v[0][k], v[1][k], v[2][k]};
}
template <class T>
void put_turn(const Pose<3, T>& pose, double (&turn)[4][batch], std::uint32_t k)
{
    for (std::size_t i = 0; i < 4; ++i)
        turn[i][k] = double{pose.rotation[i]};
}
void put(const Vec3& v, double (&to)[3][batch], std::uint32_t k)
{
    to[0][k] = v.x;
    to[1][k] = v.y;
    to[2][k] = v.z;
}

/// Writes a capsule, or a sphere with one, which counts as along y, whatever its rotation.
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
/// The kernel's result for them.
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

bool is_zero(const Vec3& v)
{
    return v.x == 0 && v.y == 0 && v.z == 0;
}

} // namespace

/// `found` has one for it at the end.
template <class T>
inline void Batch<T>::keep(std::uint16_t i, const ArrangedPair<T>& pair, Verdict verdict)
{
    const bool touch = verdict == Verdict::touch;
    contacts[i] = {static_cast<std::uint32_t>(found.size() - 1), touch ? 1u : 0u, pair.swapped, pair.d};
    if (!touch) found.pop_back();
    if (verdict == Verdict::unclear) lists.add(Group::other, i);
}

template <class T>
void Batch<T>::run_spheres()
{
    std::uint16_t near[block_pairs];
    std::uint32_t count = 0;
    for (const std::uint16_t i : lists.of(Group::spheres)) {
        const Pair& pair = set.pairs[i];
        const Vec3 d = load(set.b.poses[pair.b].position) - load(set.a.poses[pair.a].position);
        near[count] = i;
        count +=
            spheres_near(set.a.shapes[pair.a].radius() + set.b.shapes[pair.b].radius() + margin, d) ? 1 : 0;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
        const ArrangedPair<T> s = set.take(near[k]);
        Manifold<3>& manifold = found.emplace_back().manifold;
        keep(near[k], s,
             is_zero(s.d) ? Verdict::unclear : spheres(s.a->radius(), s.b->radius(), s.d, margin, manifold));
    }
}

/// Passes the pairs of a group through a kernel, `batch` at a time. put_rest(rows, pair, k) writes what this
/// kernel needs in addition to rotations and distance into lane k; answer(rows, pair, k, manifold) continues
/// from the kernel's result.
template <class T>
template <class Rows, class Put, class Answer>
void Batch<T>::run_kernel(Group group, void (*kernel)(Rows&), const Put& put_rest, const Answer& answer)
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
        for (std::uint32_t k = count; k < batch; ++k) // something that raises no exceptions
            put_lane(arranged[0], k);
        kernel(rows);
        for (std::uint32_t k = 0; k < count; ++k) {
            Manifold<3>& manifold = found.emplace_back().manifold;
            keep(place[k], arranged[k], answer(rows, arranged[k], k, manifold));
        }
        count = 0;
    };
    for (const std::uint16_t i : lists.of(group)) {
        const ArrangedPair<T> s = set.take(i);
        if ((s.a->type() == s.b->type() && is_zero(s.d)) || !is_plain(*s.pose_a) || !is_plain(*s.pose_b)) {
            lists.add(Group::other, i);
            continue;
        }
        if (!within_reach(Placed<3>{s.a, s.b, {}, {}, s.d, nullptr}, margin)) continue;
        put_lane(s, count);
        arranged[count] = s;
        place[count++] = i;
        if (count == batch) flush();
    }
    flush();
}

template <class T>
void Batch<T>::run(const Kernels& kernels)
{
    run_spheres();
    run_kernel(
        Group::rounds, kernels.rounds, put_rounds<T>,
        [this](const RoundBatch& rows, const ArrangedPair<T>& s, std::uint32_t k, Manifold<3>& manifold) {
            Gap<3> gap;
            const Verdict verdict = gap_of(round_cores(rows, s, k), margin, gap);
            if (verdict != Verdict::touch) return verdict;
            rounds({lane(rows.axis_a, k), s.a->size()[1], s.a->radius()},
                   {lane(rows.axis_b, k), s.b->size()[1], s.b->radius()}, s.d, gap, margin, manifold);
            return verdict;
        });
    run_kernel(
        Group::boxes, kernels.boxes,
        [](BoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k) {
            put(load(s.a->size()), rows.half_a, k);
            put(load(s.b->size()), rows.half_b, k);
        },
        [this](const BoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k, Manifold<3>& manifold) {
            if (!(rows.separation[k] <= margin)) return Verdict::apart;
            return boxes(lane(rows.matrix_a, k), load(s.a->size()), lane(rows.matrix_b, k), load(s.b->size()),
                         s.d, {rows.separation[k], lane(rows.normal, k), static_cast<int>(rows.axis[k])},
                         margin, manifold);
        });
    run_kernel(
        Group::capsule_box, kernels.capsule_box,
        [](CapsuleBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k) {
            put(load(s.b->size()), rows.half, k);
            rows.half_length[k] = s.a->size()[1];
        },
        [this](const CapsuleBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k,
               Manifold<3>& manifold) {
            if (!(rows.distance[k] <= s.a->radius() + margin)) return Verdict::apart;
            return capsule_box(
                lane(rows.axis_a, k), rows.half_length[k], s.a->radius(), lane(rows.matrix_b, k),
                load(s.b->size()), s.d,
                {rows.distance[k], lane(rows.normal, k), lane(rows.on_a, k), lane(rows.on_b, k)}, margin,
                manifold);
        });
}

template struct Batch<float>;
template struct Batch<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
