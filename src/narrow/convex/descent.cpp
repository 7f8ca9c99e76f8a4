// SPDX-License-Identifier: MIT
#include "narrow/convex/descent.hpp"

#include "narrow/convex/epa.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// A symmetric matrix: the second derivatives of an overlap along two axes across the direction.
struct Bend
{
    double uu = 0, uv = 0, vv = 0;
    void add(double much, double along_u, double along_v)
    {
        uu += much * along_u * along_u;
        uv += much * along_u * along_v;
        vv += much * along_v * along_v;
    }
    void add(double much) { uu += much, vv += much; }
    /// The lower eigenvalue.
    [[nodiscard]] double least() const
    {
        const double half = 0.5 * (uu - vv);
        return 0.5 * (uu + vv) - std::sqrt(half * half + uv * uv);
    }
    [[nodiscard]] Bend inverse() const
    {
        const double scale = 1 / (uu * vv - uv * uv);
        return {vv * scale, -uv * scale, uu * scale};
    }
    friend Vec2 operator*(const Bend& m, const Vec2& d)
    {
        return {m.uu * d.x + m.uv * d.y, m.uv * d.x + m.vv * d.y};
    }
};

/// Adds the curvature of a core's piece at unit direction n: the second derivative of its support function
/// across n, along u and v.
void add_bend(const Core3& core, std::uint32_t piece, const Vec3& n, const Vec3& u, const Vec3& v,
              double much, Bend& bend)
{
    const Vec3& size = core.lengths;
    switch (core.smooth) {
    case Smooth::cone:
        if (piece == 0) return;
        [[fallthrough]];
    case Smooth::cylinder: { // only turns about the axis bend; those along u are about v, and vice versa
        const double on_u = dot(core.frame.r.y, u), on_v = dot(core.frame.r.y, v);
        const double across = on_u * on_u + on_v * on_v; // squared sine of the angle of n and the axis
        if (across < 1e-20) return;
        const double inverse = 1 / std::sqrt(across);
        bend.add(much * size.x * inverse * inverse * inverse, on_v, -on_u);
        return;
    }
    case Smooth::ellipsoid: {
        const Vec3 d = core.frame.r.back(n), du = core.frame.r.back(u), dv = core.frame.r.back(v);
        const Vec3 p = smooth_support(core, d);
        const double height = dot(p, d);
        if (!(height > 1e-10 * core.reach)) return;
        const double scale = much / height;
        const auto scaled = [&](const Vec3& e) { return Vec3{e.x * size.x, e.y * size.y, e.z * size.z}; };
        const Vec3 su = scaled(du), sv = scaled(dv);
        const double pu = dot(p, du), pv = dot(p, dv);
        bend.uu += scale * (dot(su, su) - pu * pu);
        bend.uv += scale * (dot(su, sv) - pu * pv);
        bend.vv += scale * (dot(sv, sv) - pv * pv);
        return;
    }
    case Smooth::custom:
    case Smooth::none:
        return;
    }
}

/// A point of a core's piece furthest along d.
Vec3 point_of(const Core3& core, std::uint32_t piece, const Vec3& direction)
{
    if (!core.is_smooth()) return core.frame * core.polytope.vertex(piece);
    return core.frame * smooth_point(core, piece, core.frame.r.back(direction));
}

/// Two pieces, one of each core, and their overlap if there were no others.
struct Piece
{
    std::uint32_t of_a, of_b;
    Vec3 a, b;      ///< their points
    double overlap; ///< along the present direction
    Vec2 slope;     ///< how it grows from there
    double weight;
    double excess = 0; ///< of the overlap over the model's, if the last step was too long
};

/// A search for the direction along which two cores overlap least. The overlap is the maximum of those of its
/// pieces, which are smooth. Its minimum is within a piece, or where two or three of them are equal: a face
/// that meets an edge, two edges. So each step minimises the maximum of the pieces' quadratic models, and a
/// piece gets a model once it is met. This is Newton's method for minimax. Source: Fletcher, Practical
/// Methods of Optimization (1987), sec. 14.
class Descent
{
  public:
    Descent(const Core3& a, const Core3& b) : a_(a), b_(b), size_(a.reach + b.reach) {}

    /// Descends, and keeps the result if it is the least so far.
    void from(const Vec3& start)
    {
        left_disc_ = false;
        jump(start);
        double trust = longest_turn;
        for (int step = 0; step < most_steps; ++step) {
            if (settles_on_disc()) break;
            if (!(now_ - propose(trust) > 1e-15 * size_)) {
                take_last_step();
                break;
            }
            if (!advance(trust)) break;
        }
        keep();
    }

    /// Returns the result; the points are located if they are known.
    void tell(Gap<3>& gap) const { gap = {-depth, normal, on_a, on_b, off() < 1e-7 * size_}; }

    double depth = HUGE_VAL; ///< negative: they are apart
    Vec3 normal, on_a, on_b; ///< the points, as determined by the pieces' weights
    /// The distance of the points from where depth and normal put them.
    [[nodiscard]] double off() const { return length(on_a - on_b - normal * depth); }

  private:
    static constexpr int most_pieces = 4, most_steps = 40;
    static constexpr double longest_turn = 0.2; ///< radians: further away the models are useless

    [[nodiscard]] Piece top(const Vec3& n) const
    {
        const Support a = support(a_, n), b = support(b_, -n);
        return {a.vertex, b.vertex, a.p, b.p, dot(n, a.p - b.p), {}, 0, 0};
    }

    [[nodiscard]] Piece* known(const Piece& piece)
    {
        for (int i = 0; i < count_; ++i)
            if (piece_[i].of_a == piece.of_a && piece_[i].of_b == piece.of_b) return &piece_[i];
        return nullptr;
    }
    /// Sets the points of a piece for the present direction.
    void look(Piece& piece) const
    {
        piece.a = point_of(a_, piece.of_a, n_);
        piece.b = point_of(b_, piece.of_b, -n_);
    }
    /// Sets the rest from the points.
    void measure(Piece& piece) const
    {
        const Vec3 w = piece.a - piece.b;
        piece.overlap = dot(n_, w);
        piece.slope = {dot(u_, w), dot(v_, w)};
    }
    Piece& add(const Piece& piece)
    {
        if (count_ == most_pieces) { // the lightest is dropped
            int lightest = 0;
            for (int i = 1; i < count_; ++i)
                if (piece_[i].weight < piece_[lightest].weight) lightest = i;
            piece_[lightest] = piece_[--count_];
        }
        return piece_[count_++] = piece;
    }
    void move(const Vec3& to, const Piece& there)
    {
        n_ = to;
        now_ = there.overlap;
        basis(n_, u_, v_);
        int kept = 0;
        for (int i = 0; i < count_; ++i)
            if (piece_[i].weight > 0) piece_[kept++] = piece_[i];
        count_ = kept;
        Piece* highest = known(there);
        if (highest == nullptr) highest = &add(there);
        for (int i = 0; i < count_; ++i)
            if (&piece_[i] != highest) look(piece_[i]);
        highest->a = there.a;
        highest->b = there.b;
        for (int i = 0; i < count_; ++i)
            measure(piece_[i]);
    }
    void jump(const Vec3& to)
    {
        count_ = 0;
        move(to, top(to));
        piece_[0].weight = 1;
    }
    [[nodiscard]] Vec3 turned(const Vec2& turn) const
    {
        const Vec3 to = n_ + u_ * turn.x + v_ * turn.y;
        return to * (1 / length(to));
    }
    void keep()
    {
        if (!(now_ < depth)) return;
        depth = now_;
        normal = n_;
        on_a = on_b = {};
        for (int i = 0; i < count_; ++i) {
            on_a += piece_[i].a * piece_[i].weight;
            on_b += piece_[i].b * piece_[i].weight;
        }
    }

    /// Takes a step too short to change the overlap, since it doubles the digits of the points.
    void take_last_step()
    {
        if (length(turn_) < 1e-11) return;
        const Vec3 to = turned(turn_);
        const Piece there = top(to);
        if (!(there.overlap <= now_ + 1e-14 * size_) || known(there) == nullptr) return;
        move(to, there);
        propose(longest_turn);
    }
    /// Takes the proposed step, or a shorter one, or meets a new piece. Returns false if no step improves.
    bool advance(double& trust)
    {
        for (bool corrected = false;;) {
            double far = length(turn_);
            if (far > trust) {
                turn_ = turn_ * (trust / far);
                far = trust;
            }
            if (!(far >= 1e-9)) return false; // or is NaN
            const Vec3 to = turned(turn_);
            const Piece there = top(to);
            if (there.overlap < now_) {
                move(to, there);
                trust = std::min(longest_turn, 3 * far);
                return true;
            }
            if (known(there) == nullptr) {
                Piece& met = add(there);
                look(met);
                measure(met);
                return true;
            }
            if (!corrected && count_ > 1)
                correct(to);
            else
                trust = 0.25 * far;
            corrected = true;
        }
    }

    /// A rim bends ever more sharply towards the normal of its disc, where the overlap has a pit or a peak
    /// that no model shows. If that is near and downhill, goes there and either stays, which returns true, or
    /// leaves by the steepest descent.
    bool settles_on_disc()
    {
        if (left_disc_) return false;
        for (const Core3* core : {&a_, &b_}) {
            const double sign = core == &a_ ? 1 : -1;
            const double along = dot(core->frame.r.y, n_);
            if (!(along * along > 0.96)) continue; // the disc's normal is more than 0.2 away
            const Vec3 d = core->frame.r.back(n_ * sign);
            const double across = d.x * d.x + d.z * d.z;
            if (disc(*core, d) == 0) continue;
            const Vec3 to = core->frame.r.y * (d.y > 0 ? sign : -sign);
            if (across > right_angle) {
                const Piece here = top(n_);
                const bool downhill = dot(here.a - here.b, to - n_ * dot(n_, to)) <= 0;
                if (!downhill || !(top(to).overlap < now_)) continue;
            }
            jump(to);
            Piece& here = piece_[0];
            const double radius_a = take_middle(a_, n_, here.a), radius_b = take_middle(b_, -n_, here.b);
            const Vec3 w = here.a - here.b, aside = w - n_ * dot(n_, w);
            const double far = length(aside), radius = radius_a + radius_b;
            if (far <= radius) {
                here.a = here.a - aside * (radius_a / radius);
                here.b += aside * (radius_b / radius);
                return true;
            }
            keep();
            const Vec2 down{dot(u_, aside) / -far, dot(v_, aside) / -far};
            double angle = 0.1;
            while (angle > 1e-9 && !(top(turned(down * angle)).overlap < now_))
                angle *= 0.25;
            // If another edge bars the way, the search continues beside it.
            jump(turned(down * (angle > 1e-9 ? angle : 0.05)));
            left_disc_ = true;
            return false;
        }
        return false;
    }
    /// The radius of the disc on the side of a core that local direction d faces, or 0.
    static double disc(const Core3& core, const Vec3& d)
    {
        const bool has = core.smooth == Smooth::cylinder || (core.smooth == Smooth::cone && d.y < 0);
        return has ? core.lengths.x : 0;
    }
    /// The same for a disc that n meets at right angles: then p, a point of it, is set to its centre.
    static double take_middle(const Core3& core, const Vec3& n, Vec3& p)
    {
        const Vec3 d = core.frame.r.back(n);
        const double radius = d.x * d.x + d.z * d.z <= right_angle ? disc(core, d) : 0;
        if (radius > 0) p = core.frame * Vec3{0, d.y > 0 ? core.lengths.y : -core.lengths.y, 0};
        return radius;
    }
    static constexpr double right_angle = 1e-18; ///< for the square of a sine, up to rounding

    /// Sets the next step and the pieces' weights there. Returns the overlap there by the models.
    double propose(double trust)
    {
        bend_ = {};
        const Piece* heavy = nullptr;
        const Piece* other = nullptr;
        for (int i = 0; i < count_; ++i) {
            Piece& p = piece_[i];
            p.excess = 0;
            if (p.weight == 0) continue;
            add_bend(a_, p.of_a, n_, u_, v_, p.weight, bend_);
            add_bend(b_, p.of_b, -n_, u_, v_, p.weight, bend_);
            (heavy == nullptr ? heavy : other) = &p;
        }
        bend_.add(-now_); // the sphere of directions is curved, too
        // Across the edge of two pieces there is no freedom: the curvature there doesn't matter, but mustn't
        // be negative.
        if (other != nullptr) {
            const Vec2 k = other->slope - heavy->slope;
            if (const double far = length2(k); far > 0) bend_.add(2 * size_ / far, k.x, k.y);
        }
        if (const double least = bend_.least(); least < 1e-6 * size_)
            bend_.add(0.1 * std::max(now_, std::abs(least)) + 1e-3 * size_ - least);
        // A step that is too long is computed again with more curvature, so that it follows the steepest
        // descent. The same step cut short would follow the flattest direction, out of the valley.
        double value = solve();
        for (int i = 0; i < 4 && length(turn_) > 1.2 * trust; ++i) {
            bend_.add(bend_.least() * (length(turn_) / trust - 1));
            value = solve();
        }
        return value;
    }
    /// Proposes a corrected step where the edge between pieces bends away from their models, by their errors
    /// at `to`, the previous step. Source: Fletcher, sec. 14.4.
    void correct(const Vec3& to)
    {
        for (int i = 0; i < count_; ++i) {
            Piece& p = piece_[i];
            const Vec3 w = point_of(a_, p.of_a, to) - point_of(b_, p.of_b, -to);
            p.excess = dot(to, w) - p.overlap - dot(p.slope, turn_) - 0.5 * dot(turn_, bend_ * turn_);
        }
        solve();
    }
    double solve()
    {
        const Bend inverse = bend_.inverse();
        double best = HUGE_VAL, weight[most_pieces] = {};
        for (int i = 0; i < count_; ++i) {
            attempt(inverse, i, -1, -1, best, weight);
            for (int j = i + 1; j < count_; ++j) {
                attempt(inverse, i, j, -1, best, weight);
                for (int k = j + 1; k < count_; ++k)
                    attempt(inverse, i, j, k, best, weight);
            }
        }
        for (int i = 0; i < count_; ++i)
            piece_[i].weight = weight[i];
        return best;
    }
    /// Finds the step to where the models of pieces i, j and k (those that aren't -1) are equal and minimal,
    /// and keeps it if it is the best so far. The weights make the pieces' slopes cancel out there: the dual
    /// problem.
    void attempt(const Bend& inverse, int i, int j, int k, double& best, double* weight)
    {
        const Piece& p = piece_[i];
        const auto height = [&](int l) { return piece_[l].overlap + piece_[l].excess; };
        double s = 0, t = 0;
        Vec2 slope = p.slope;
        if (j >= 0) {
            const Vec2 bent = inverse * p.slope, e = piece_[j].slope - p.slope, be = inverse * e;
            const double ee = dot(e, be), re = height(j) - height(i) - dot(e, bent);
            if (!(ee > 0)) return;
            if (k < 0) {
                s = re / ee;
            } else {
                const Vec2 f = piece_[k].slope - p.slope, bf = inverse * f;
                const double ff = dot(f, bf), ef = dot(e, bf), rf = height(k) - height(i) - dot(f, bent);
                const double size = ee * ff - ef * ef;
                if (!(size > 1e-12 * ee * ff)) return;
                s = (re * ff - rf * ef) / size;
                t = (rf * ee - re * ef) / size;
                if (!(t > 0)) return;
                slope += f * t;
            }
            if (!(s > 0 && s + t < 1)) return;
            slope += e * s;
        }
        const Vec2 turn = -(inverse * slope);
        double highest = -HUGE_VAL;
        for (int l = 0; l < count_; ++l)
            highest = std::max(highest, height(l) + dot(piece_[l].slope, turn));
        const double value = highest + 0.5 * dot(turn, bend_ * turn);
        if (!(value < best)) return;
        best = value;
        turn_ = turn;
        for (int l = 0; l < count_; ++l)
            weight[l] = l == i ? 1 - s - t : l == j ? s : l == k ? t : 0;
    }

    const Core3& a_;
    const Core3& b_;
    double size_;
    Vec3 n_, u_, v_; ///< the present direction, and the axes across it
    double now_ = 0; ///< the overlap there
    Piece piece_[most_pieces];
    int count_ = 0;
    Bend bend_;
    Vec2 turn_; ///< the proposed step
    bool left_disc_ = false;
};

/// The relative error allowed for the depth.
constexpr double close_enough = 1e-3;
/// A lower bound of the depth from which on the result is good enough.
double enough_depth(const Core3& a, const Core3& b, const Descent& descent)
{
    return (1 - close_enough) * descent.depth - 1e-12 * (a.reach + b.reach);
}

/// Whether balls inside the cores overlap by the known depth, so that the cores overlap by at least that. If
/// not, this proves nothing.
bool is_as_deep(const Core3& a, const Core3& b, const Descent& descent)
{
    const Ball in_a = ball_inside(a, descent.on_a, descent.normal);
    const Ball in_b = ball_inside(b, descent.on_b, -descent.normal);
    const double depth = in_a.radius + in_b.radius - length(in_a.middle - in_b.middle);
    return depth >= enough_depth(a, b, descent);
}

/// Grows a polytope inside the difference of the cores, which gives a lower bound of the depth, and descends
/// from each of its faces whose direction is better than the best so far.
void search_all(const Core3& a, const Core3& b, const Simplex& simplex, Descent& descent)
{
    constexpr int most_steps = 64;
    Expansion expansion(a, b);
    if (!expansion.start(simplex)) {
        descent.depth = 0;
        descent.normal = expansion.flat_normal;
        return;
    }
    const Vec3 normal = descent.normal;
    if (!expansion.take_in(expansion.furthest(normal))) return;
    if (a.is_smooth() && b.is_smooth()) {
        // The faces around this point are close enough if they lean by less than 0.045: on a round surface,
        // those between points whose directions lean by a little more.
        constexpr double lean = 0.05;
        Vec3 u, v;
        basis(normal, u, v);
        for (const Vec3& aside : {u, v, -u, -v})
            if (!expansion.take_in(expansion.furthest(normal + aside * lean))) return;
    }
    for (int step = 0; step < most_steps; ++step) {
        const auto [face, offset] = expansion.nearest(enough_depth(a, b, descent));
        if (offset == HUGE_VAL) return;
        const Vec3 n = expansion.normal(face);
        const Vec3 w = expansion.furthest(n);
        // Around a sharp tip, whose own direction can be a maximum, all extend too far until there are many
        // faces; but descending from the nearest leads to the minimum.
        const bool is_late = step == 16 || step == 32 || step == most_steps - 1;
        if (is_late || dot(n, w) < descent.depth) descent.from(n);
        if (!expansion.grow(face, w)) return;
    }
}

} // namespace

bool descends(const Core3& a, const Core3& b)
{
    const auto has_pieces = [](const Core3& core) {
        const Vec3& size = core.lengths;
        switch (core.smooth) {
        case Smooth::cylinder:
            return true;
        case Smooth::cone: // the tip of a flat cone is nearly a disc
            return size.y > 0.02 * size.x;
        case Smooth::ellipsoid: // the rim of a flat ellipsoid is nearly an edge
            return std::min({size.x, size.y, size.z}) > 0.01 * std::max({size.x, size.y, size.z});
        case Smooth::custom:
            return false;
        case Smooth::none:
            break;
        }
        return true;
    };
    return (a.is_smooth() || b.is_smooth()) && has_pieces(a) && has_pieces(b);
}

void least_overlap(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap)
{
    Descent descent(a, b);
    descent.from(gap.normal);
    if (!is_as_deep(a, b, descent)) search_all(a, b, simplex, descent);
    descent.tell(gap);
    gap.distance = std::min(0.0, gap.distance);
}

bool descend(const Core3& a, const Core3& b, double enough, Gap<3>& gap)
{
    Descent descent(a, b);
    descent.from(gap.normal);
    descent.tell(gap);
    if (gap.distance > enough) {
        gap.distance = HUGE_VAL;
        return true;
    }
    return descent.off() <= std::max(1e-7 * gap.distance, 1e-10 * (a.reach + b.reach));
}

} // namespace narrow
JOSTLE_NAMESPACE_END
