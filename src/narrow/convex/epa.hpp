// SPDX-License-Identifier: MIT
// The overlap of two cores of any kind, by the expanding polytope algorithm.
// Source: van den Bergen, Proximity Queries and Penetration Depth Computation on 3D Game Objects, GDC 2001.
#pragma once

#include "narrow/convex/gjk.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A growing polytope inside the difference of two cores that contains the origin. The depth has two bounds:
/// it is at least the offset of the nearest face, and at most the extent of the difference along any
/// direction.
class Expansion
{
  public:
    Expansion(const Core3& a, const Core3& b)
        : a_(a), b_(b), least_out_(1e-14 * (a.reach + b.reach)), size_(a.reach + b.reach)
    {
    }

    /// Begins with a tetrahedron, from gjk()'s last simplex. Returns false if the difference of the two cores
    /// has no volume: then their overlap along `flat_normal` is zero.
    bool start(const Simplex& simplex);

    struct Nearest
    {
        std::uint32_t face;
        double offset; ///< infinite if none is left
    };
    /// The nearest of the faces whose offset is less than `limit`, which may only decrease from call to call.
    [[nodiscard]] Nearest nearest(double limit)
    {
        // Which faces these are is unpredictable, so there is no branch.
        std::uint32_t face = 0;
        double least = limit;
        std::size_t kept = 0;
        for (std::size_t k = 0; k < waiting_.size(); ++k) {
            const std::uint32_t f = waiting_[k];
            const double offset = offsets_[f];
            faces_[f].waits = offset < limit;
            waiting_[kept] = f;
            kept += offset < limit ? 1 : 0;
            face = offset < least ? f : face;
            least = offset < least ? offset : least;
        }
        waiting_.resize(kept);
        limit_ = limit;
        return {face, least < limit ? least : HUGE_VAL};
    }
    [[nodiscard]] const Vec3& normal(std::uint32_t face) const { return faces_[face].normal; }

    /// The point of the difference that is furthest along a direction.
    [[nodiscard]] Vec3 furthest(const Vec3& direction) const
    {
        return support(a_, direction).p - support(b_, -direction).p;
    }

    /// Adds a point beyond a face. Returns false if rounding has left no closed surface.
    bool grow(std::uint32_t from, const Vec3& beyond);
    /// Adds a point if it is outside. Returns false as grow() does.
    bool take_in(const Vec3& point);

    Vec3 flat_normal{0, 1, 0};

  private:
    /// Counterclockwise from outside: side i goes from v[i] to v[i + 1].
    struct Face
    {
        std::uint32_t v[3];
        std::uint32_t beside[3];    ///< the face across a side
        std::uint8_t beside_its[3]; ///< which side of that face it is
        bool waits;                 ///< is among the waiting faces
        std::uint32_t round;        ///< in which it was removed, if it was
        Vec3 normal;
    };
    /// A side of a remaining face, beyond which faces are removed.
    struct Side
    {
        std::uint32_t face, from, to; ///< the points as the new face there has them
        std::uint8_t of;
    };
    void visit(std::uint32_t face, std::uint8_t side, const Vec3& beyond);
    std::uint32_t add(std::uint32_t i, std::uint32_t j, std::uint32_t k);
    void join(std::uint32_t face, int side, std::uint32_t other, int its);
    bool flat(const Vec3& n)
    {
        flat_normal = n;
        return false;
    }

    const Core3& a_;
    const Core3& b_;
    double least_out_; ///< a point beyond a face by less counts as on it
    double size_;
    SmallVector<Vec3, 64> points_;
    SmallVector<Face, 128> faces_;
    SmallVector<double, 128> offsets_;        ///< of each face's plane; infinite where a place is empty
    SmallVector<std::uint32_t, 64> places_;   ///< of removed faces
    SmallVector<std::uint32_t, 128> waiting_; ///< faces among which is the nearest
    double limit_ = HUGE_VAL;
    SmallVector<Side, 64> horizon_;
    std::uint32_t round_ = 0;
};

/// The least overlap of two cores that overlap according to gjk(), from its last simplex: gap.distance is
/// minus the depth, and 0 if the difference of the two has no volume. The gap's points are not set.
void expand(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
