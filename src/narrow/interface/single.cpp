// SPDX-License-Identifier: MIT
// One pair at a time.
#include "narrow/interface/answers.hpp"
#include "narrow/interface/input_checks.hpp"
#include "narrow/parts/merge.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

template <int Dim, class T>
[[gnu::always_inline]] inline void check_poses(const Pose<Dim, T>& pose_a, const Pose<Dim, T>& pose_b)
{
    for (const Pose<Dim, T>* pose : {&pose_a, &pose_b})
        if (!valid(*pose)) refuse_pose(*pose, Error::no_index);
}
template <int Dim, class T>
Placed<Dim> checked(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                    const Pose<Dim, T>& pose_b)
{
    check_poses(pose_a, pose_b);
    return place(a, pose_a, b, pose_b);
}

} // namespace
} // namespace narrow

template <int Dim, Coordinate T>
bool touching(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
              const Pose<Dim, T>& pose_b)
{
    narrow::check_poses(pose_a, pose_b);
    return narrow::touching_of(a, pose_a, b, pose_b, narrow::best_kernels());
}

template <int Dim, Coordinate T>
std::vector<Contact<Dim, T>> contacts(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                                      const Pose<Dim, T>& pose_b, std::type_identity_t<T> margin)
{
    narrow::check_length("margin", margin, true);
    narrow::Placed<Dim> pair = narrow::checked(a, pose_a, b, pose_b);
    const bool swapped = narrow::arrange(pair);
    narrow::FoundList<Dim> found;
    narrow::find_contacts(pair, double{margin}, found);
    narrow::merge_contacts(pair, found);
    narrow::sort_parts(found, swapped);
    std::vector<Contact<Dim, T>> result;
    for (const narrow::Found<Dim>& one : found) {
        Contact<Dim, T>& contact = result.emplace_back();
        contact.pair = {0, 1};
        narrow::finish(one, pair.d, swapped, contact);
    }
    return result;
}

template <int Dim, Coordinate T>
std::optional<Distance<Dim, T>> distance(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                                         const Pose<Dim, T>& pose_b, std::type_identity_t<T> max_distance)
{
    narrow::check_max_distance(max_distance);
    narrow::check_poses(pose_a, pose_b);
    const auto answer = narrow::distance_of(a, pose_a, b, pose_b, max_distance, narrow::best_kernels());
    if (answer.distance == std::numeric_limits<T>::infinity()) return {};
    return answer;
}

template <int Dim, Coordinate T>
std::optional<Impact<Dim, T>> time_of_impact(const Shape<Dim>& a, const Motion<Dim, T>& motion_a,
                                             const Shape<Dim>& b, const Motion<Dim, T>& motion_b,
                                             std::type_identity_t<T> tolerance)
{
    narrow::check_length("tolerance", tolerance, false);
    narrow::check_object(a, motion_a, Error::no_index);
    narrow::check_object(b, motion_b, Error::no_index);
    const Impact<Dim, T> answer = narrow::impact_of(a, motion_a, b, motion_b, tolerance);
    if (answer.time == std::numeric_limits<T>::infinity()) return {};
    return answer;
}

template <int Dim, Coordinate T>
std::optional<CastHit<Dim, T>> ray_cast(const Shape<Dim>& shape, const Pose<Dim, T>& pose,
                                        const Ray<Dim, T>& ray)
{
    narrow::check_ray(ray, Error::no_index);
    if (!narrow::valid(pose)) narrow::refuse_pose(pose, Error::no_index);
    const CastHit<Dim, T> answer = narrow::ray_hit_of(shape, pose, ray, narrow::best_kernels());
    if (answer.fraction == std::numeric_limits<T>::infinity()) return {};
    return answer;
}

template <int Dim, Coordinate T>
std::optional<CastHit<Dim, T>> shape_cast(const Shape<Dim>& moving, const Pose<Dim, T>& pose,
                                          const Vec<Dim, T>& displacement, const Shape<Dim>& shape,
                                          const Pose<Dim, T>& shape_pose)
{
    narrow::check_poses(pose, shape_pose);
    narrow::check_displacement(displacement, Error::no_index);
    const CastHit<Dim, T> answer =
        narrow::shape_hit_of(moving, pose, displacement, shape, shape_pose, narrow::best_kernels());
    if (answer.fraction == std::numeric_limits<T>::infinity()) return {};
    return answer;
}

#define JOSTLE_SINGLE(Dim, T)                                                                                \
    template JOSTLE_API bool touching(const Shape<Dim>&, const Pose<Dim, T>&, const Shape<Dim>&,             \
                                      const Pose<Dim, T>&);                                                  \
    template JOSTLE_API std::vector<Contact<Dim, T>> contacts(const Shape<Dim>&, const Pose<Dim, T>&,        \
                                                              const Shape<Dim>&, const Pose<Dim, T>&, T);    \
    template JOSTLE_API std::optional<Distance<Dim, T>> distance(const Shape<Dim>&, const Pose<Dim, T>&,     \
                                                                 const Shape<Dim>&, const Pose<Dim, T>&, T); \
    template JOSTLE_API std::optional<Impact<Dim, T>> time_of_impact(                                        \
        const Shape<Dim>&, const Motion<Dim, T>&, const Shape<Dim>&, const Motion<Dim, T>&, T);              \
    template JOSTLE_API std::optional<CastHit<Dim, T>> ray_cast(const Shape<Dim>&, const Pose<Dim, T>&,      \
                                                                const Ray<Dim, T>&);                         \
    template JOSTLE_API std::optional<CastHit<Dim, T>> shape_cast(                                           \
        const Shape<Dim>&, const Pose<Dim, T>&, const Vec<Dim, T>&, const Shape<Dim>&, const Pose<Dim, T>&)
JOSTLE_SINGLE(2, float);
JOSTLE_SINGLE(2, double);
JOSTLE_SINGLE(3, float);
JOSTLE_SINGLE(3, double);

JOSTLE_NAMESPACE_END
