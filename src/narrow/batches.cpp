// SPDX-License-Identifier: MIT
#include "narrow/batches.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Quaternions that `rotation` in math.hpp reads without scaling.
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
    to[0][k] = v.x, to[1][k] = v.y, to[2][k] = v.z;
}
/// Lanes of a batch that has fewer pairs hold something that makes no exceptions.
template <class Rows>
void fill_up(Rows& rows, std::uint32_t count)
{
    for (auto& row : rows)
        for (std::uint32_t k = count; k < batch; ++k)
            row[k] = row[0];
}

} // namespace

/// Reads a pair and puts it in order as `arrange` would. Returns false for what only `arrange` can decide.
template <class T>
bool Batch<T>::take(std::uint16_t i, Sides& s)
{
    const Pair& pair = pairs[i];
    s = {&shapes_a[pair.a], &shapes_b[pair.b], &poses_a[pair.a], &poses_b[pair.b], {}, false};
    s.d = load(s.pose_b->position) - load(s.pose_a->position);
    if (s.a->type() == s.b->type()) {
        if (s.d.x == 0 && s.d.y == 0 && s.d.z == 0) return false;
        s.swapped = s.d.x != 0 ? s.d.x < 0 : s.d.y != 0 ? s.d.y < 0 : s.d.z < 0;
    } else {
        s.swapped = s.a->type() > s.b->type();
    }
    if (s.swapped) {
        std::swap(s.a, s.b);
        std::swap(s.pose_a, s.pose_b);
        s.d = -s.d;
    }
    return true;
}

template <class T>
void Batch<T>::keep(std::uint16_t i, const Sides& sides, Outcome outcome, const Found<3>& one)
{
    if (outcome == Outcome::unclear) {
        lists.add(Group::other, i);
        return;
    }
    slot[i] = {static_cast<std::uint32_t>(found.size()), outcome == Outcome::touch ? 1u : 0u, sides.swapped,
               sides.d};
    if (outcome == Outcome::touch) found.push_back(one);
}

template <class T>
void Batch<T>::run_spheres()
{
    Found<3> one;
    Sides s;
    for (const std::uint16_t i : lists.of(Group::spheres)) {
        const bool taken = take(i, s);
        keep(i, s,
             taken ? spheres(s.a->radius(), s.b->radius(), s.d, margin, one.manifold) : Outcome::unclear,
             one);
    }
}

template <class T>
void Batch<T>::run_boxes(const Kernels& kernels)
{
    BoxBatch work;
    Sides sides[batch];
    std::uint16_t place[batch];
    std::uint32_t count = 0;
    const auto flush = [&] {
        if (count == 0) return;
        fill_up(work.turn_a, count);
        fill_up(work.turn_b, count);
        fill_up(work.d, count);
        fill_up(work.half_a, count);
        fill_up(work.half_b, count);
        kernels.boxes(work);
        Found<3> one;
        for (std::uint32_t k = 0; k < count; ++k) {
            Outcome outcome = Outcome::apart;
            if (work.separation[k] <= margin)
                outcome = boxes(lane(work.matrix_a, k), load(sides[k].a->size()), lane(work.matrix_b, k),
                                load(sides[k].b->size()), sides[k].d,
                                {work.separation[k], lane(work.normal, k), static_cast<int>(work.axis[k])},
                                margin, one.manifold);
            keep(place[k], sides[k], outcome, one);
        }
        count = 0;
    };
    for (const std::uint16_t i : lists.of(Group::boxes)) {
        Sides& s = sides[count];
        if (!take(i, s) || !is_plain(*s.pose_a) || !is_plain(*s.pose_b)) {
            lists.add(Group::other, i);
            continue;
        }
        const Placed<3> pair{s.a, s.b, {}, {}, s.d};
        if (!within_reach(pair, margin)) {
            keep(i, s, Outcome::apart, {});
            continue;
        }
        put_turn(*s.pose_a, work.turn_a, count);
        put_turn(*s.pose_b, work.turn_b, count);
        put(s.d, work.d, count);
        put(load(s.a->size()), work.half_a, count);
        put(load(s.b->size()), work.half_b, count);
        place[count++] = i;
        if (count == batch) flush();
    }
    flush();
}

template <class T>
void Batch<T>::run_capsules(const Kernels& kernels)
{
    CapsuleBoxBatch work;
    Sides sides[batch];
    std::uint16_t place[batch];
    std::uint32_t count = 0;
    const auto flush = [&] {
        if (count == 0) return;
        fill_up(work.turn_a, count);
        fill_up(work.turn_b, count);
        fill_up(work.d, count);
        fill_up(work.half, count);
        for (std::uint32_t k = count; k < batch; ++k)
            work.half_length[k] = work.half_length[0];
        kernels.capsule_box(work);
        Found<3> one;
        for (std::uint32_t k = 0; k < count; ++k) {
            const double radius = sides[k].a->radius();
            Outcome outcome = Outcome::apart;
            if (work.distance[k] <= radius + margin)
                outcome = capsule_box(
                    lane(work.axis_a, k), work.half_length[k], radius, lane(work.matrix_b, k),
                    load(sides[k].b->size()), sides[k].d,
                    {work.distance[k], lane(work.normal, k), lane(work.on_a, k), lane(work.on_b, k)}, margin,
                    one.manifold);
            keep(place[k], sides[k], outcome, one);
        }
        count = 0;
    };
    for (const std::uint16_t i : lists.of(Group::capsule_box)) {
        Sides& s = sides[count];
        if (!take(i, s) || !is_plain(*s.pose_a) || !is_plain(*s.pose_b)) {
            lists.add(Group::other, i);
            continue;
        }
        const Placed<3> pair{s.a, s.b, {}, {}, s.d};
        if (!within_reach(pair, margin)) {
            keep(i, s, Outcome::apart, {});
            continue;
        }
        put_turn(*s.pose_a, work.turn_a, count);
        put_turn(*s.pose_b, work.turn_b, count);
        put(s.d, work.d, count);
        put(load(s.b->size()), work.half, count);
        work.half_length[count] = s.a->size()[1];
        place[count++] = i;
        if (count == batch) flush();
    }
    flush();
}

template <class T>
void Batch<T>::run(const Kernels& kernels)
{
    run_spheres();
    run_boxes(kernels);
    run_capsules(kernels);
}

template struct Batch<float>;
template struct Batch<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
