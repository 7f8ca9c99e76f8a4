// SPDX-License-Identifier: MIT
// One pair of any two shapes: the order in which it is computed, and its results.
#pragma once

#include <memory_resource>
#include <type_traits>
#include <vector>

#include "narrow/convex/manifold.hpp"
#include "narrow/kernels/kernels.hpp"
#include "narrow/shapes/shape_data.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A pair in the form for tests: all positions are relative to a's, so that nothing is lost far from the
/// origin.
template <int Dim>
struct Placed
{
    const Shape<Dim>* a;
    const Shape<Dim>* b;
    M<Dim> ra, rb;
    V<Dim> d; ///< from a's position to b's
    const Kernels* kernels;

    void exchange()
    {
        std::swap(a, b);
        std::swap(ra, rb);
        d = V<Dim>{} - d; // never -0, see from_to()
    }
};

/// Arranges a pair in the order in which it is computed, independent of the order given: by type, then by
/// position, rotation and size. Returns whether a and b were swapped.
template <int Dim>
bool arrange(Placed<Dim>& pair);
/// The same, but if the types differ, the type `first` comes first.
template <int Dim>
bool arrange(Placed<Dim>& pair, ShapeType first);

/// The answer of two parts about their contact. A part of a surface can't always know which part has it.
enum class Answer : std::uint8_t
{
    none,
    contact,
    /// The surface continues beyond this part towards the body: a contact along the part's own normal, on a
    /// side that other contacts may know better.
    over,
    /// The body has passed through the surface and its end isn't over this part: a contact unless others push
    /// it out that way.
    spare,
    /// A neighbour is nearer and should have the contact; this one counts if the body has none.
    last
};

template <int Dim>
struct Found
{
    Found() {} // not = default, which would zero 200 bytes in emplace_back()
    Manifold<Dim> manifold;
    std::uint32_t part_a = 0, part_b = 0;
    Answer answer = Answer::contact; ///< another value only until all parts have been tested
    double gap = 0;                  ///< the distance of the parts, if the answer isn't certain
};
template <int Dim>
using FoundList = std::pmr::vector<Found<Dim>>;

/// Appends the contacts of an arranged pair, by ascending (part_a, part_b).
template <int Dim>
void find_contacts(const Placed<Dim>& pair, double margin, FoundList<Dim>& found);
/// The same without the special cases of simple3.hpp, for pairs within reach.
template <int Dim>
void find_contacts_generally(const Placed<Dim>& pair, double margin, FoundList<Dim>& found);
/// The least signed distance of an arranged pair. `gap.distance` is infinite if it is more than `enough`.
template <int Dim>
void find_gap(const Placed<Dim>& pair, double enough, Gap<Dim>& gap);

/// The vector from one position to another. No coordinate is -0: that would depend on which comes first, and
/// the sign of a zero decides which of two sides or corners is tested.
template <int Dim, class T>
V<Dim> from_to(const Pose<Dim, T>& a, const Pose<Dim, T>& b)
{
    return load(b.position) - load(a.position) + V<Dim>{};
}
template <int Dim, class T>
Placed<Dim> place(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                  const Pose<Dim, T>& pose_b, const Kernels& kernels = best_kernels())
{
    return {&a, &b, rotation(pose_a), rotation(pose_b), from_to(pose_a, pose_b), &kernels};
}

/// Whether any parts of an arranged pair touch.
template <int Dim>
bool find_touch(const Placed<Dim>& pair);

/// Shapes whose balls don't meet aren't tested; differences that overflow end here.
template <int Dim>
bool within_reach(const Placed<Dim>& pair, double margin)
{
    const double reach = ShapeAccess::reach(*pair.a) + ShapeAccess::reach(*pair.b) + margin;
    return length2(pair.d) <= reach * reach * (1 + 1e-14);
}

/// Converts from the frame of an arranged pair to the user's.
template <int Dim, class T>
void finish(const Manifold<Dim>& manifold, const V<Dim>& d, bool swapped, Contact<Dim, T>& contact)
{
    store(manifold.normal * (swapped ? -1.0 : 1.0), contact.normal); // hard to predict, so no branch
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
/// Only its deepest point, which is the first.
template <int Dim, class T>
void finish(const Manifold<Dim>& manifold, const V<Dim>& d, bool swapped, PointContact<Dim, T>& contact)
{
    store(manifold.normal * (swapped ? -1.0 : 1.0), contact.normal);
    const ManifoldPoint<Dim>& from = manifold.point[0];
    store(from.p, swapped ? contact.from_b : contact.from_a);
    store(from.p - d, swapped ? contact.from_a : contact.from_b);
    contact.depth = static_cast<T>(from.depth);
    const std::uint32_t fa = from.feature_a, fb = from.feature_b;
    contact.feature = swapped ? fb | fa << 16 : fa | fb << 16;
}
template <int Dim, class Made>
void finish(const Found<Dim>& found, const V<Dim>& d, bool swapped, Made& contact)
{
    contact.part_a = swapped ? found.part_b : found.part_a;
    contact.part_b = swapped ? found.part_a : found.part_b;
    finish(found.manifold, d, swapped, contact);
}
/// Ordered by the user's (part_a, part_b), which are unique for each contact.
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
