// SPDX-License-Identifier: MIT
// How deep two cores of any kind overlap: the expanding polytope algorithm.
// Source: van den Bergen, Proximity Queries and Penetration Depth Computation on 3D Game Objects, GDC 2001.
#pragma once

#include "narrow/convex/gjk.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A polytope inside the difference of two cores that holds the origin and grows. Two bounds say how deep the
/// cores overlap: it is no less than the offset of the nearest face, and no more than the difference reaches
/// along any direction.
class Expansion
{
  public:
    Expansion(const Core3& a, const Core3& b) : a_(a), b_(b), size_(a.reach + b.reach) {}

    /// Begins with a tetrahedron, from gjk()'s last simplex. Returns false where the difference of the two
    /// cores has no volume: they overlap by nothing along `flat_normal` then.
    bool start(const Simplex& simplex);

    struct Nearest
    {
        std::uint32_t face;
        double offset; ///< infinite if no face is left
    };
    [[nodiscard]] Nearest nearest() const
    {
        Nearest found{0, HUGE_VAL};
        for (std::uint32_t f = 0; f < offsets_.size(); ++f)
            if (offsets_[f] < found.offset) found = {f, offsets_[f]};
        return found;
    }
    [[nodiscard]] const Vec3& normal(std::uint32_t face) const { return faces_[face].normal; }

    /// The point of the difference that is furthest along a direction.
    [[nodiscard]] SimplexPoint furthest(const Vec3& direction) const
    {
        const Support pa = support(a_, direction), pb = support(b_, -direction);
        return {pa.p - pb.p, pa.p, pb.p, pa.vertex, pb.vertex};
    }

    /// Takes in a point beyond a face. Returns false where rounding has left no closed surface.
    bool grow(std::uint32_t from, const SimplexPoint& beyond);
    /// Takes in a point if it is outside.
    void take_in(const SimplexPoint& point);

    Vec3 flat_normal{0, 1, 0};

  private:
    struct Face
    {
        std::uint32_t v[3], beside[3]; // beside[i] across the side from v[i] to v[i + 1]
        std::uint32_t round;
        Vec3 normal;
    };
    struct Side
    {
        std::uint32_t a, b, beyond;
    };
    std::uint32_t add(std::uint32_t i, std::uint32_t j, std::uint32_t k);
    bool flat(const Vec3& n)
    {
        flat_normal = n;
        return false;
    }

    const Core3& a_;
    const Core3& b_;
    double size_;
    SmallVector<SimplexPoint, 64> points_;
    SmallVector<Face, 128> faces_;
    SmallVector<double, 128> offsets_; ///< of each face's plane; infinite where a place is empty
    SmallVector<std::uint32_t, 64> patch_, made_;
    std::size_t free_ = 0; ///< of patch_, how many places have new faces
    SmallVector<Side, 64> horizon_;
    std::uint32_t round_ = 0;
};

/// The least overlap of two cores of which gjk() said that they overlap, from its last simplex: gap.distance
/// is minus the depth, and 0 where the difference of the two has no volume. The gap's points are not set.
void expand(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap);

} // namespace narrow
JOSTLE_NAMESPACE_END
