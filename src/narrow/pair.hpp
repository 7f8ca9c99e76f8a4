// SPDX-License-Identifier: MIT
// One pair of any two shapes: which test, and which way round.
#pragma once

#include <memory_resource>
#include <type_traits>
#include <vector>

#include "narrow/convex3.hpp"
#include "narrow/shape_data.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A pair as the tests see it: all positions counted from a's, so that nothing is lost far from the origin.
template <int Dim>
struct Placed
{
    const Shape<Dim>* a;
    const Shape<Dim>* b;
    M<Dim> ra, rb;
    V<Dim> d; ///< from a's position to b's
    const Kernels* kernels = &best_kernels();
};

/// Puts a pair into the order in which it is computed, whichever way round it came: by type, then by place,
/// turn and size. Returns whether a and b changed places.
template <int Dim>
bool arrange(Placed<Dim>& pair);

template <int Dim>
struct Found
{
    Found() {} // not = default, which would zero 200 bytes in emplace_back()
    Manifold<Dim> manifold;
    std::uint32_t part_a = 0, part_b = 0;
};
template <int Dim>
using FoundList = std::pmr::vector<Found<Dim>>;

/// What a surface does beyond the side or corner of its element that lies highest along some direction.
enum class Beyond : std::uint8_t
{
    nothing, ///< it ends there or falls: nothing of it lies higher, and a contact there is the surface's own
    onwards, ///< it goes on higher, or rises like the floor at the foot of a wall
    steeply  ///< it goes on higher, but not along this element: around an edge of more than 30 degrees
};

/// Whether `d` leads along unit vector `n` by more than rounding.
template <class Vector>
bool leads_along(const Vector& d, const Vector& n)
{
    const double along = dot(d, n);
    return along > 0 && along * along > 1e-12 * length2(d);
}

/// What two parts say of their contact. One part of a surface can't always know which of them has it.
enum class Answer : std::uint8_t
{
    none,
    contact,
    spare, ///< the body has come through, its end isn't over this part: one unless others push it out that way
    last   ///< a neighbour is nearer and should have it: one if the body has none at all
};

inline Answer answer_if(bool contact)
{
    return contact ? Answer::contact : Answer::none;
}

/// Takes the contacts of a pair's parts, and of those that aren't sure what each body needs: a body is the whole
/// of a shape or one child.
template <int Dim>
class Collector
{
  public:
    Collector(const Placed<Dim>& pair, FoundList<Dim>& found)
        : found_(found),
          before_(found.size()),
          a_is_body_(pair.b->type() == ShapeTypes::mesh || pair.b->type() == ShapeTypes::height_field)
    {
    }
    /// `gap` is how far apart the parts are.
    void add(Answer answer, const Found<Dim>& one, double gap)
    {
        if (answer == Answer::none) return;
        if (answer == Answer::contact) return found_.push_back(one);
        for (std::size_t i = 0; i < unsure_.size(); ++i) {
            Unsure& other = unsure_[i];
            if (other.answer != answer || body(other.one) != body(one)) continue;
            if (answer == Answer::spare && !same_way(other.one, one)) continue;
            if (gap < other.gap) other.one = one, other.gap = gap;
            return;
        }
        unsure_.push_back({one, gap, answer});
    }
    void finish()
    {
        for (const Answer answer : {Answer::spare, Answer::last})
            for (std::size_t i = 0; i < unsure_.size(); ++i)
                if (unsure_[i].answer == answer && is_needed(unsure_[i])) found_.push_back(unsure_[i].one);
    }

  private:
    struct Unsure
    {
        Found<Dim> one;
        double gap;
        Answer answer;
    };
    [[nodiscard]] std::uint32_t body(const Found<Dim>& one) const
    {
        return a_is_body_ ? one.part_a : one.part_b;
    }
    /// Within 25 degrees: what pushes one way pushes the other.
    [[nodiscard]] static bool same_way(const Found<Dim>& one, const Found<Dim>& other)
    {
        return dot(one.manifold.normal, other.manifold.normal) > 0.9;
    }
    [[nodiscard]] bool is_needed(const Unsure& unsure) const
    {
        for (std::size_t i = before_; i < found_.size(); ++i) {
            const Found<Dim>& other = found_[i];
            if (body(other) != body(unsure.one)) continue;
            if (unsure.answer == Answer::last) return false;
            if (same_way(other, unsure.one) && other.manifold.point[0].depth >= -0.99 * unsure.gap)
                return false;
        }
        return true;
    }

    FoundList<Dim>& found_;
    std::size_t before_;
    bool a_is_body_;
    SmallVector<Unsure, 4> unsure_;
};

/// Appends the contacts of an arranged pair, by ascending (part_a, part_b).
template <int Dim>
void find_contacts(const Placed<Dim>& pair, double margin, FoundList<Dim>& found);
/// The same without the short ways of simple3.hpp, for pairs within reach.
void find_contacts_generally(const Placed<3>& pair, double margin, FoundList<3>& found);
/// The least signed distance of an arranged pair. `gap.distance` is infinite if it is more than `enough`.
template <int Dim>
void find_gap(const Placed<Dim>& pair, double enough, Gap<Dim>& gap);

template <int Dim, class T>
Placed<Dim> place(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                  const Pose<Dim, T>& pose_b)
{
    return {&a, &b, rotation(pose_a), rotation(pose_b), load(pose_b.position) - load(pose_a.position)};
}

/// A pair on its way: at time t in [0, 1] b is at d + t * linear from a, each turned by t * angular.
template <int Dim>
struct Moving
{
    using Angular = std::conditional_t<Dim == 3, Vec3, double>;
    Placed<Dim> start;
    V<Dim> linear;
    Angular angular_a, angular_b;
};
template <int Dim>
struct Hit
{
    double time; ///< infinite where there is none
    V<Dim> d;    ///< from a's position to b's at that time
    Gap<Dim> gap;
};
/// The first time at which an arranged pair is within `tolerance`, or an earlier one after `impact_steps`.
template <int Dim>
Hit<Dim> find_impact(const Moving<Dim>& pair, double tolerance);
inline constexpr int impact_steps = 1000;

/// What lies ahead of a pair on its way.
template <int Dim>
struct Outlook
{
    Gap<Dim> gap;           ///< the least, of what may come within the tolerance; infinite if nothing may
    double safe = HUGE_VAL; ///< for how long nothing comes nearer than half the tolerance
};
/// `now` is the pair as it is at the moment. Looks ahead for `time`.
template <int Dim>
Outlook<Dim> look_ahead(const Moving<Dim>& pair, const Placed<Dim>& now, double tolerance, double time);

/// Whether any parts of an arranged pair touch.
template <int Dim>
bool find_touch(const Placed<Dim>& pair);

/// Shapes whose balls don't meet aren't looked at: differences that overflow end here.
template <int Dim>
bool within_reach(const Placed<Dim>& pair, double margin)
{
    const double reach = ShapeAccess::reach(*pair.a) + ShapeAccess::reach(*pair.b) + margin;
    double size = 0;
    for (int d = 0; d < Dim; ++d)
        size = std::max(size, std::abs(pair.d[d]));
    return size <= reach * (1 + 1e-14);
}

/// From the frame of an arranged pair to the user's.
template <int Dim, class T>
void finish(const Manifold<Dim>& manifold, const V<Dim>& d, bool swapped, Contact<Dim, T>& contact)
{
    store(manifold.normal * (swapped ? -1.0 : 1.0), contact.normal); // which is hard to predict: no branch
    contact.count = manifold.count;
    for (std::uint32_t i = 0; i < manifold.count; ++i) {
        const ManifoldPoint<Dim>& from = manifold.point[i];
        ContactPoint<Dim, T>& to = contact.point[i];
        store(from.p, swapped ? to.from_b : to.from_a);
        store(from.p - d, swapped ? to.from_a : to.from_b);
        to.depth = static_cast<T>(from.depth);
        const std::uint32_t fa = from.feature_a, fb = from.feature_b;
        to.feature = swapped ? fb | fa << 16 : fa | fb << 16;
    }
}
template <int Dim, class T>
void finish(const Found<Dim>& found, const V<Dim>& d, bool swapped, Contact<Dim, T>& contact)
{
    contact.part_a = swapped ? found.part_b : found.part_a;
    contact.part_b = swapped ? found.part_a : found.part_b;
    finish(found.manifold, d, swapped, contact);
}
/// By the user's (part_a, part_b), of which no two contacts have the same.
template <int Dim>
void sort_parts(FoundList<Dim>& found, bool swapped)
{
    if (found.size() < 2) return;
    std::sort(found.begin(), found.end(), [swapped](const Found<Dim>& x, const Found<Dim>& y) {
        const std::uint32_t xa = swapped ? x.part_b : x.part_a, ya = swapped ? y.part_b : y.part_a;
        return xa != ya ? xa < ya : (swapped ? x.part_a < y.part_a : x.part_b < y.part_b);
    });
}

} // namespace narrow
JOSTLE_NAMESPACE_END
