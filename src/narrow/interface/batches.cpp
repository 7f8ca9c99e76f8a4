// SPDX-License-Identifier: MIT
#include "narrow/interface/batches.hpp"

#include "narrow/interface/batch_rows.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
/// `found` has one for it at its end.
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
        const Vec3 d = load(set.poses_b[pair.b].position) - load(set.poses_a[pair.a].position);
        near[count] = i;
        count +=
            spheres_near(set.shapes_a[pair.a].radius() + set.shapes_b[pair.b].radius() + margin, d) ? 1 : 0;
    }
    for (std::uint32_t k = 0; k < count; ++k) {
        const ArrangedPair<T> s = set.take(near[k]);
        Manifold<3>& manifold = found.emplace_back().manifold;
        keep(near[k], s,
             is_zero(s.d) ? Verdict::unclear : spheres(s.a->radius(), s.b->radius(), s.d, margin, manifold));
    }
}

/// answer(rows, pair, k, manifold) goes on from what the kernel has found.
template <class T>
template <class Rows, class Put, class Answer>
void Batch<T>::run_kernel(Group group, void (*kernel)(Rows&), const Put& put_rest, const Answer& answer)
{
    through_kernel(
        set, lists.of(group), kernel,
        [&](const ArrangedPair<T>& s) {
            return within_reach(Placed<3>{s.a, s.b, {}, {}, s.d, nullptr}, margin);
        },
        put_rest,
        [&](const Rows& rows, const ArrangedPair<T>& s, std::uint32_t k, std::uint16_t i) {
            Manifold<3>& manifold = found.emplace_back().manifold;
            keep(i, s, answer(rows, s, k, manifold));
        },
        [&](std::uint16_t i) { lists.add(Group::other, i); });
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
