// SPDX-License-Identifier: MIT
// Distances of many pairs: pairs with a closed form go through a kernel, `batch` at a time.
#include "narrow/interface/answers.hpp"
#include "narrow/interface/batches.hpp"

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
    // Two spheres are as fast one by one.
    constexpr Form form[3][3] = {{Form::other, Form::rounds, Form::sphere_box},
                                 {Form::rounds, Form::rounds, Form::capsule_box},
                                 {Form::sphere_box, Form::capsule_box, Form::other}};
    return is_simple(a) && is_simple(b) ? form[a][b] : Form::other;
}

template <class Numbers, std::size_t n>
void put(const Numbers& from, double (&columns)[n][batch], std::uint32_t k)
{
    for (std::size_t i = 0; i < n; ++i)
        columns[i][k] = double{from[i]};
}
template <class T, std::size_t n>
void take(const double (&columns)[n][batch], std::uint32_t k, Vec<int{n}, T>& to)
{
    for (std::size_t i = 0; i < n; ++i)
        to[i] = static_cast<T>(columns[i][k]);
}

} // namespace

template <class T>
void Distances<T>::run(const Kernels& kernels) const
{
    std::uint16_t list[forms][block_pairs];
    std::size_t listed[forms] = {};
    bool checked = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Pair& pair = pairs[i];
        if ((pair.a >= a.shapes.size() || pair.b >= b.shapes.size() || pair.a == pair.b) && !checked) {
            check();
            checked = true;
        }
        const auto form = static_cast<std::size_t>(form_of(a.shapes[pair.a].type(), b.shapes[pair.b].type()));
        list[form][listed[form]++] = static_cast<std::uint16_t>(i);
    }
    const auto of = [&](Form form) {
        const auto f = static_cast<std::size_t>(form);
        return std::span<const std::uint16_t>(list[f], listed[f]);
    };
    run_kernel(of(Form::rounds), kernels.round_distances, kernels);
    run_kernel(of(Form::sphere_box), kernels.sphere_box_distances, kernels);
    run_kernel(of(Form::capsule_box), kernels.capsule_box_distances, kernels);
    for (const std::uint16_t i : of(Form::other))
        answer_generally(i, kernels);
}

template <class T>
void Distances<T>::run_kernel(std::span<const std::uint16_t> list, void (*kernel)(DistanceBatch&),
                              const Kernels& kernels) const
{
    DistanceBatch rows;
    rows.enough = double{enough};
    for (; !list.empty(); list = list.subspan(std::min<std::size_t>(list.size(), batch))) {
        const auto count = static_cast<std::uint32_t>(std::min<std::size_t>(list.size(), batch));
        for (std::uint32_t k = 0; k < batch; ++k)
            put_pair(pairs[list[std::min(k, count - 1)]], rows, k);
        kernel(rows);
        for (std::uint32_t k = 0; k < count; ++k) {
            if ((rows.clear >> k & 1) == 0) {
                answer_generally(list[k], kernels);
                continue;
            }
            Distance<3, T>& answer = out[list[k]];
            answer.distance = static_cast<T>(rows.distance[k]);
            take(rows.normal, k, answer.normal);
            take(rows.from_a, k, answer.from_a);
            take(rows.from_b, k, answer.from_b);
        }
    }
}

template <class T>
void Distances<T>::put_pair(const Pair& pair, DistanceBatch& rows, std::uint32_t k) const
{
    const Shape<3>* const shape[2] = {&a.shapes[pair.a], &b.shapes[pair.b]};
    const Pose<3, T>* const pose[2] = {&a.poses[pair.a], &b.poses[pair.b]};
    // Which type comes first is hard to predict, so there are no branches.
    const int type_a = shape[0]->type(), type_b = shape[1]->type();
    const std::size_t before = type_a > type_b ? 1 : 0, behind = 1 - before;
    constexpr double order[3] = {-1, 0, 1};
    put(pose[0]->position, rows.place_a, k);
    put(pose[1]->position, rows.place_b, k);
    put(pose[before]->rotation, rows.turn_a, k);
    put(pose[behind]->rotation, rows.turn_b, k);
    put(shape[before]->size(), rows.half_a, k);
    put(shape[behind]->size(), rows.half_b, k);
    rows.radius_a[k] = shape[before]->radius();
    rows.radius_b[k] = shape[behind]->radius();
    rows.order[k] = order[1 + (type_a < type_b ? 1 : 0) - before];
}

template <class T>
void Distances<T>::answer_generally(std::uint16_t i, const Kernels& kernels) const
{
    const Pair& pair = pairs[i];
    const Pose<3, T>&pose_a = a.poses[pair.a], &pose_b = b.poses[pair.b];
    if (!valid(pose_a) || !valid(pose_b)) check();
    out[i] = distance_of(a.shapes[pair.a], pose_a, b.shapes[pair.b], pose_b, enough, kernels);
}

template <class T>
void Distances<T>::check() const
{
    for (std::size_t i = 0; i < pairs.size(); ++i)
        check_pair(a, b, pairs[i], first + i);
}

template struct Distances<float>;
template struct Distances<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
