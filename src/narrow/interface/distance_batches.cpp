// SPDX-License-Identifier: MIT
// Distances of many pairs: what has a closed form goes through its kernel, `batch` pairs at a time.
#include "narrow/interface/answers.hpp"
#include "narrow/interface/batch_rows.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

enum class Form : std::uint8_t
{
    rounds, ///< capsules, and spheres with capsules
    sphere_box,
    capsule_box,
    other
};
constexpr std::size_t forms = 4;

Form form_of(ShapeType a, ShapeType b)
{
    // Two spheres take no longer one by one.
    constexpr Form form[3][3] = {{Form::other, Form::rounds, Form::sphere_box},
                                 {Form::rounds, Form::rounds, Form::capsule_box},
                                 {Form::sphere_box, Form::capsule_box, Form::other}};
    return is_simple(a) && is_simple(b) ? form[a][b] : Form::other;
}

} // namespace

template <class T>
void DistanceBatch<T>::run(const Kernels& kernels)
{
    std::uint16_t list[forms][block_pairs];
    std::size_t listed[forms] = {};
    for (std::size_t i = 0; i < set.pairs.size(); ++i) {
        const Pair& pair = set.pairs[i];
        const auto form =
            static_cast<std::size_t>(form_of(set.shapes_a[pair.a].type(), set.shapes_b[pair.b].type()));
        list[form][listed[form]++] = static_cast<std::uint16_t>(i);
    }
    const auto of = [&](Form form) {
        const auto f = static_cast<std::size_t>(form);
        return std::span<const std::uint16_t>(list[f], listed[f]);
    };
    const auto all = [](const ArrangedPair<T>&) { return true; };
    const auto general = [&](std::uint16_t i) {
        const Pair& pair = set.pairs[i];
        out[i] = distance_of(set.shapes_a[pair.a], set.poses_a[pair.a], set.shapes_b[pair.b],
                             set.poses_b[pair.b], enough, kernels);
    };
    const auto answer = [&](const Cores& cores, const ArrangedPair<T>& s, std::uint16_t i) {
        Gap<3> gap;
        const Verdict verdict = gap_of(cores, double{enough}, gap);
        if (verdict == Verdict::unclear) return general(i);
        if (verdict == Verdict::apart) gap.distance = HUGE_VAL;
        out[i] = finish<3, T>(gap, s.d, s.swapped);
    };
    through_kernel(
        set, of(Form::rounds), kernels.rounds, all, put_rounds<T>,
        [&](const RoundBatch& rows, const ArrangedPair<T>& s, std::uint32_t k, std::uint16_t i) {
            answer(round_cores(rows, s, k), s, i);
        },
        general);
    through_kernel(
        set, of(Form::sphere_box), kernels.point_box, all,
        [](PointBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k) {
            put(load(s.b->size()), rows.half, k);
        },
        [&](const PointBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k, std::uint16_t i) {
            const double size = extent(s.d) + extent(load(s.b->size()));
            answer({rows.distance[k], lane(rows.normal, k), {}, lane(rows.on_b, k), size, s.a->radius(), 0},
                   s, i);
        },
        general);
    through_kernel(
        set, of(Form::capsule_box), kernels.capsule_box, all,
        [](CapsuleBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k) {
            put(load(s.b->size()), rows.half, k);
            rows.half_length[k] = s.a->size()[1];
        },
        [&](const CapsuleBoxBatch& rows, const ArrangedPair<T>& s, std::uint32_t k, std::uint16_t i) {
            answer({rows.distance[k], lane(rows.normal, k), lane(rows.on_a, k), lane(rows.on_b, k), 0,
                    s.a->radius(), 0},
                   s, i);
        },
        general);
    for (const std::uint16_t i : of(Form::other))
        general(i);
}

template struct DistanceBatch<float>;
template struct DistanceBatch<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
