// SPDX-License-Identifier: MIT
// Moving shapes: conservative advancement.
// Source: Mirtich, Impulse-based Dynamic Simulation (1996), sec. 2.3.
#pragma once

#include "narrow/parts/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// A moving pair: at time t in [0, 1] b is at d + t * linear from a, each turned by t * angular.
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
    double time; ///< infinite if there is none
    V<Dim> d;    ///< from a's position to b's at that time
    Gap<Dim> gap;
};
/// The first time at which an arranged pair is within `tolerance`, or an earlier one after `impact_steps`.
template <int Dim>
Hit<Dim> find_impact(const Moving<Dim>& pair, double tolerance);
inline constexpr int impact_steps = 1000;

/// Sine and cosine from sums and products only, because those of C libraries differ.
inline void sine_cosine(double angle, double& s, double& c)
{
    constexpr double turn = 6.283185307179586;
    double x = angle - std::floor(angle * (1 / turn) + 0.5) * turn;
    x *= 0.125; // at most 0.4: the series below are exact to the last bits
    const double x2 = x * x;
    s = x * (1 - x2 / 6 * (1 - x2 / 20 * (1 - x2 / 42 * (1 - x2 / 72 * (1 - x2 / 110 * (1 - x2 / 156))))));
    c = 1 - x2 / 2 * (1 - x2 / 12 * (1 - x2 / 30 * (1 - x2 / 56 * (1 - x2 / 90 * (1 - x2 / 132)))));
    for (int i = 0; i < 3; ++i) {
        const double s2 = 2 * s * c;
        c = c * c - s * s;
        s = s2;
    }
}

/// Continues a rotation: from the start by `angular` (radians times axis).
inline Mat3 turned(const Mat3& start, const Vec3& angular)
{
    const double angle = length(angular);
    if (!(angle > 0)) return start;
    double s, c;
    sine_cosine(0.5 * angle, s, c);
    const Vec3 axis = angular * (s / angle);
    return rotation(axis.x, axis.y, axis.z, c) * start;
}
inline Mat2 turned(const Mat2& start, double angle)
{
    double s, c;
    sine_cosine(angle, s, c);
    return rotation(c, s) * start;
}

/// The turning of an object: by `speed` radians about `axis` (unit; implicit in 2D) through `centre`.
struct Turning3
{
    Vec3 centre, axis;
    double speed = 0;
    Turning3(const Vec3& at, const Vec3& angular) : centre(at), speed(length(angular))
    {
        if (speed > 0) axis = angular * (1 / speed);
    }
};
struct Turning2
{
    Vec2 centre;
    double speed = 0;
    Turning2(const Vec2& at, double angular) : centre(at), speed(std::abs(angular)) {}
};
template <int Dim>
using Turning = std::conditional_t<Dim == 3, Turning3, Turning2>;

/// The extent of points along a direction n: now, until a time `horizon`, and under any rotation. A turn by t
/// moves a point at a distance of `arm` from the axis by at most t * arm, at right angles to the axis.
template <int Dim>
class Spread
{
  public:
    double top = -HUGE_VAL, later = -HUGE_VAL, swept = -HUGE_VAL;
    double spin = 0; ///< the greatest advance per radian

    Spread(const Turning<Dim>& turning, const V<Dim>& n, double horizon)
        : turning_(turning), n_(n), angle_(turning.speed * horizon)
    {
        if constexpr (Dim == 3) lever_ = length(cross(n, turning.axis));
    }
    /// All points within `radius` of a point. Turning doesn't change a ball.
    void add(const V<Dim>& p, double radius = 0)
    {
        if (turning_.speed == 0) return add_height(dot(n_, p) + radius);
        const double height = dot(n_, p) + radius;
        top = std::max(top, height);
        const V<Dim> q = p - turning_.centre;
        double arm, level = dot(n_, turning_.centre);
        if constexpr (Dim == 3) {
            arm = length(cross(q, turning_.axis)) * lever_;
            level += dot(q, turning_.axis) * dot(n_, turning_.axis);
        } else {
            arm = length(q);
        }
        spin = std::max(spin, arm);
        later = std::max(later, height + angle_ * arm);
        swept = std::max(swept, level + arm + radius);
    }
    /// Points no higher than this that don't turn.
    void add_height(double height)
    {
        top = std::max(top, height);
        later = std::max(later, height);
        swept = std::max(swept, height);
    }
    /// Points no higher than this and within `reach` of a point.
    void add_somewhere(double height, const V<Dim>& p, double reach)
    {
        add(p, reach);
        top = height;
        spin += reach;
        later = height + angle_ * spin;
    }

  private:
    const Turning<Dim>& turning_;
    V<Dim> n_;
    double angle_; // by which they have turned at the horizon
    double lever_ = 1;
};

/// Two moving objects, from a given time on.
template <int Dim>
struct Flight
{
    V<Dim> linear; ///< of b relative to a
    Turning<Dim> a, b;
    double reach_a, reach_b; ///< the greatest distance from the centre of points that turning moves
    double tolerance;

    Flight(const Moving<Dim>& pair, const Placed<Dim>& now, double near)
        : linear(pair.linear),
          a({}, pair.angular_a),
          b(now.d, pair.angular_b),
          reach_a(turned_reach(*now.a, a)),
          reach_b(turned_reach(*now.b, b)),
          tolerance(near)
    {
    }
    /// How much nearer turning can bring them within that time.
    [[nodiscard]] double turn(double time) const
    {
        return std::min(a.speed * time, 2.0) * reach_a + std::min(b.speed * time, 2.0) * reach_b;
    }
    /// The time for which two convex parts separated along n (from a to b) certainly stay further apart than
    /// half the tolerance.
    [[nodiscard]] double safe_time(const Spread<Dim>& part_a, const Spread<Dim>& part_b,
                                   const V<Dim>& n) const
    {
        const double closing = std::max(0.0, -dot(linear, n));
        const auto time = [](double room, double speed) { return room > 0 ? room / speed : 0; };
        return std::max(time(-part_a.top - part_b.top - 0.5 * tolerance,
                             closing + a.speed * part_a.spin + b.speed * part_b.spin),
                        time(-part_a.swept - part_b.swept - 0.5 * tolerance, closing));
    }
    /// The same, but no longer than the horizon of both. Each point advances at a constant pace, so until
    /// then the extent is at most interpolated between the present one and the bound at the horizon.
    [[nodiscard]] double safe_time(const Spread<Dim>& part_a, const Spread<Dim>& part_b, const V<Dim>& n,
                                   double horizon) const
    {
        const double closing = std::max(0.0, -dot(linear, n)) * horizon;
        const double rise = part_a.later - part_a.top + (part_b.later - part_b.top);
        const double room = -part_a.top - part_b.top - 0.5 * tolerance;
        return room > 0 ? horizon * std::min(1.0, room / (closing + rise)) : 0;
    }

  private:
    static double turned_reach(const Shape<Dim>& shape, const Turning<Dim>& turning)
    {
        // Turning doesn't change a ball; a half-space, which is infinite, doesn't turn.
        return shape.type() == ShapeTypes::sphere || turning.speed == 0 ? 0 : ShapeAccess::reach(shape);
    }
};

} // namespace narrow
JOSTLE_NAMESPACE_END
