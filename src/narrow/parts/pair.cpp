// SPDX-License-Identifier: MIT
#include "narrow/parts/pair.hpp"

#include "narrow/convex/convex2.hpp"
#include "narrow/convex/convex3.hpp"
#include "narrow/convex/simple3.hpp"
#include "narrow/parts/compare.hpp"
#include "narrow/parts/each_part.hpp"
#include "narrow/parts/nearest.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// Positions are within `longest`, so their distances are within this, or one is infinite.
constexpr double farthest = 10 * longest;
/// Contacts whose normals are within 25 degrees of each other push the same way.
constexpr double same_direction = 0.9;
/// ... as far, within 1 percent, as the overlap.
constexpr double as_far = 0.99;
/// Contacts whose normals are within 75 degrees of each other push to the same side of a surface.
constexpr double same_side = 0.25;

/// Collects the contacts of a pair's parts, and of the uncertain ones those that each body needs. A body is a
/// whole shape or one child.
template <int Dim>
class Collector
{
  public:
    Collector(const Placed<Dim>& pair, double margin, FoundList<Dim>& found)
        : pair_(pair), margin_(margin), found_(found), before_(found.size()), a_is_body_(is_surface(*pair.b))
    {
    }
    void add(const Found<Dim>& one)
    {
        if (one.answer == Answer::none) return;
        found_.push_back(one);
        all_sure_ = all_sure_ && one.answer == Answer::contact;
    }
    void finish()
    {
        if (all_sure_) return;
        choose_sides();
        std::size_t kept = before_;
        for (std::size_t i = before_; i < found_.size(); ++i)
            if (found_[i].answer == Answer::contact || found_[i].answer == Answer::over)
                found_[kept++] = found_[i];
            else if (found_[i].answer != Answer::none)
                keep_nearest(found_[i]);
        found_.resize(kept);
        for (const Answer answer : {Answer::spare, Answer::last})
            for (std::size_t i = 0; i < unsure_.size(); ++i)
                if (unsure_[i].answer == answer && is_needed(unsure_[i])) found_.push_back(unsure_[i]);
    }

  private:
    /// The directions in which certain contacts push a body.
    struct Push
    {
        V<Dim> normal;
        std::uint32_t body;
    };
    [[nodiscard]] std::uint32_t body(const Found<Dim>& one) const
    {
        return a_is_body_ ? one.part_a : one.part_b;
    }
    /// A body is on one side of what it touches. Where the surface continues, a part of it can't tell which:
    /// certain contacts decide, otherwise the side of most of the body.
    void choose_sides()
    {
        SmallVector<Push, 8> pushes;
        for (std::size_t i = before_; i < found_.size(); ++i)
            if (found_[i].answer == Answer::contact) note(found_[i], pushes);
        for (std::size_t i = before_; i < found_.size(); ++i)
            if (found_[i].answer == Answer::over || found_[i].answer == Answer::spare)
                choose_side(found_[i], pushes);
    }
    void note(const Found<Dim>& one, SmallVector<Push, 8>& pushes) const
    {
        const V<Dim>& normal = one.manifold.normal;
        for (std::size_t i = 0; i < pushes.size(); ++i)
            if (pushes[i].body == body(one) && dot(pushes[i].normal, normal) > same_direction) return;
        pushes.push_back({normal, body(one)});
    }
    void choose_side(Found<Dim>& one, const SmallVector<Push, 8>& pushes) const
    {
        bool here = false, behind = false;
        for (std::size_t i = 0; i < pushes.size(); ++i) {
            if (pushes[i].body != body(one)) continue;
            const double along = dot(pushes[i].normal, one.manifold.normal);
            here = here || along > same_side;
            behind = behind || along < -same_side;
        }
        if (here && !behind) return;
        const Frame<Dim> frame_a{pair_.ra, {}}, frame_b{pair_.rb, pair_.d};
        with_part(*pair_.a, one.part_a, *pair_.kernels, frame_a, [&](const Part<Dim>& a) {
            with_part(*pair_.b, one.part_b, *pair_.kernels, frame_b, [&](const Part<Dim>& b) {
                one.answer = part_contact_behind(a, b, behind && !here, margin_, one.manifold, one.answer);
            });
        });
    }
    void keep_nearest(const Found<Dim>& one)
    {
        for (std::size_t i = 0; i < unsure_.size(); ++i) {
            Found<Dim>& other = unsure_[i];
            if (other.answer != one.answer || body(other) != body(one)) continue;
            if (one.answer == Answer::spare && !same_way(other, one)) continue;
            if (one.gap < other.gap) other = one;
            return;
        }
        unsure_.push_back(one);
    }
    [[nodiscard]] static bool same_way(const Found<Dim>& one, const Found<Dim>& other)
    {
        return dot(one.manifold.normal, other.manifold.normal) > same_direction;
    }
    [[nodiscard]] bool is_needed(const Found<Dim>& unsure) const
    {
        for (std::size_t i = before_; i < found_.size(); ++i) {
            const Found<Dim>& other = found_[i];
            if (body(other) != body(unsure)) continue;
            if (unsure.answer == Answer::last) return false;
            if (same_way(other, unsure) && other.manifold.point[0].depth >= -as_far * unsure.gap)
                return false;
        }
        return true;
    }

    const Placed<Dim>& pair_;
    double margin_;
    FoundList<Dim>& found_;
    std::size_t before_;
    bool a_is_body_, all_sure_ = true;
    SmallVector<Found<Dim>, 4> unsure_;
};

/// A capsule, or a sphere, whose rotation doesn't matter.
Round round_of(const Shape<3>& shape, const Mat3& turn)
{
    return {shape.type() == ShapeTypes::capsule ? turn.y : Vec3{0, 1, 0}, shape.size()[1], shape.radius()};
}

bool is_ball_on_round(const Placed<3>& pair)
{
    const ShapeType b = pair.b->type();
    return pair.a->type() == ShapeTypes::sphere && (b == ShapeTypes::cylinder || b == ShapeTypes::cone);
}
bool has_short_way(const Placed<3>& pair)
{
    return is_simple(pair.b->type()) || is_ball_on_round(pair);
}
/// A polygon, segment or point, perhaps with a radius: a shape of one part that isn't smooth.
bool is_polygon(const Shape<2>& shape)
{
    const Kind kind = kind_of(shape);
    return !consists_of_parts(kind) && kind != Kind::half_space && kind != Kind::ellipsoid &&
           kind != Kind::custom;
}
bool has_short_way(const Placed<2>& pair)
{
    return is_polygon(*pair.a) && is_polygon(*pair.b);
}
struct Polygons
{
    Core2 a, b;
    explicit Polygons(const Placed<2>& pair) : a(*pair.a, {pair.ra, {}}), b(*pair.b, {pair.rb, pair.d}) {}
};
/// The same for touching: a ball on a cylinder or cone has no special case.
bool has_short_touch(const Placed<3>& pair)
{
    return is_simple(pair.b->type());
}
bool has_short_touch(const Placed<2>& pair)
{
    return has_short_way(pair);
}
/// The special cases, for the shapes that have one.
Verdict simple_contact(const Placed<3>& pair, double margin, Manifold<3>& manifold)
{
    const Shape<3>&a = *pair.a, &b = *pair.b;
    if (b.type() == ShapeTypes::sphere) return spheres(a.radius(), b.radius(), pair.d, margin, manifold);
    if (b.type() == ShapeTypes::capsule) {
        const Round round_a = round_of(a, pair.ra), round_b = round_of(b, pair.rb);
        Gap<3> gap;
        const Verdict verdict = round_gap(round_a, round_b, pair.d, margin, gap);
        if (verdict == Verdict::touch) rounds(round_a, round_b, pair.d, gap, margin, manifold);
        return verdict;
    }
    if (is_ball_on_round(pair))
        return ball_contact(a.radius(), Core3(b, {pair.rb, pair.d}), margin, manifold);
    if (b.type() != ShapeTypes::box || !is_simple(a.type())) return Verdict::unclear;
    const Vec3 half = load(b.size());
    if (a.type() == ShapeTypes::box) {
        const Vec3 half_a = load(a.size());
        return boxes(pair.ra, half_a, pair.rb, half, pair.d, box_axis(pair.ra, half_a, pair.rb, half, pair.d),
                     margin, manifold);
    }
    const double half_length = a.size()[1];
    return capsule_box(pair.ra.y, half_length, a.radius(), pair.rb, half, pair.d,
                       capsule_box_gap(pair.ra.y, half_length, pair.rb, half, pair.d), margin, manifold);
}

Verdict simple_contact(const Placed<2>& pair, double margin, Manifold<2>& manifold)
{
    if (pair.b->type() == ShapeTypes::sphere)
        return spheres(pair.a->radius(), pair.b->radius(), pair.d, margin, manifold);
    const Polygons polygons(pair);
    return convex_contact(polygons.a, polygons.b, margin, manifold) ? Verdict::touch : Verdict::apart;
}
/// Whether there would be a contact without a margin; unclear if that requires finding it.
Verdict simple_touch(const Placed<3>& pair)
{
    const Shape<3>&a = *pair.a, &b = *pair.b;
    if (b.type() == ShapeTypes::capsule) {
        Gap<3> gap;
        return round_gap(round_of(a, pair.ra), round_of(b, pair.rb), pair.d, 0, gap);
    }
    if (b.type() != ShapeTypes::box || !is_simple(a.type())) return Verdict::unclear;
    const Vec3 half = load(b.size());
    if (a.type() == ShapeTypes::box) return boxes_touch(pair.ra, load(a.size()), pair.rb, half, pair.d);
    if (a.type() == ShapeTypes::sphere) return sphere_box_touch(a.radius(), pair.rb, half, pair.d);
    return capsule_box_touch(pair.ra.y, a.size()[1], a.radius(), pair.rb, half, pair.d);
}
Verdict simple_touch(const Placed<2>& pair)
{
    const auto [a, b] = Polygons(pair);
    Gap<2> cores;
    core_gap(a, b, a.radius + b.radius, cores);
    return cores.distance <= a.radius + b.radius ? Verdict::touch : Verdict::apart;
}

} // namespace

template <int Dim>
bool arrange(Placed<Dim>& pair, ShapeType first)
{
    bool swap = pair.a->type() != first;
    if (pair.a->type() == pair.b->type()) {
        int order = compare(V<Dim>{}, pair.d);
        if (order == 0) order = compare(pair.ra, pair.rb);
        if (order == 0) order = compare(*pair.a, *pair.b);
        swap = order > 0;
    }
    if (swap) pair.exchange();
    return swap;
}
template <int Dim>
bool arrange(Placed<Dim>& pair)
{
    return arrange(pair, std::min(pair.a->type(), pair.b->type()));
}

template <int Dim>
void find_contacts(const Placed<Dim>& pair, double margin, FoundList<Dim>& found)
{
    if (!within_reach(pair, margin)) return;
    if (has_short_way(pair)) {
        Found<Dim> one;
        const Verdict verdict = simple_contact(pair, margin, one.manifold);
        if (verdict == Verdict::touch) found.push_back(one);
        if (verdict != Verdict::unclear) return;
    }
    find_contacts_generally(pair, margin, found);
}

template <int Dim>
void find_contacts_generally(const Placed<Dim>& pair, double margin, FoundList<Dim>& found)
{
    Collector<Dim> collector(pair, margin, found);
    const auto meet = [&](std::uint32_t number_a, const Part<Dim>& a, std::uint32_t number_b,
                          const Part<Dim>& b) {
        Found<Dim> one;
        one.answer = part_contact(a, b, margin, one.manifold, one.gap);
        one.part_a = number_a;
        one.part_b = number_b;
        collector.add(one);
    };
    if constexpr (Dim == 3)
        if (has_mesh_tree(pair)) {
            for_each_near(pair, margin, meet);
            return collector.finish();
        }
    for_each_part_pair(pair, Range<Dim>{margin}, meet);
    collector.finish();
}

template <int Dim>
bool find_touch(const Placed<Dim>& pair)
{
    if (!within_reach(pair, 0)) return false;
    if (has_short_touch(pair)) {
        Verdict verdict = simple_touch(pair);
        if (verdict == Verdict::unclear) {
            Manifold<Dim> manifold;
            verdict = simple_contact(pair, 0, manifold);
        }
        if (verdict != Verdict::unclear) return verdict == Verdict::touch;
    }
    if constexpr (Dim == 3)
        if (has_mesh_tree(pair)) return any_parts_touch(pair);
    bool touch = false;
    Range<Dim> range{0};
    for_each_part_pair(pair, range,
                       [&](std::uint32_t, const Part<Dim>& a, std::uint32_t, const Part<Dim>& b) {
                           touch = touch || part_touch(a, b);
                           if (touch) range.reach = -HUGE_VAL; // nothing is within that, so the search ends
                       });
    return touch;
}

template <int Dim>
void find_gap(const Placed<Dim>& pair, double enough, Gap<Dim>& best)
{
    best.distance = HUGE_VAL;
    for (int d = 0; d < Dim; ++d)
        if (!(std::abs(pair.d[d]) <= farthest)) return;
    if constexpr (Dim == 3)
        if (has_mesh_tree(pair)) return nearest_parts(pair, enough, best);
    if constexpr (Dim == 2)
        if (has_short_way(pair)) {
            const Polygons polygons(pair);
            convex_gap(polygons.a, polygons.b, enough, best);
            if (!(best.distance <= enough)) best.distance = HUGE_VAL;
            return;
        }
    Range<Dim> range{enough};
    range.nearest_first = true;
    const bool by_a = pair.a->type() == ShapeTypes::compound, by_b = pair.b->type() == ShapeTypes::compound;
    std::uint32_t best_a = 0, best_b = 0;
    for_each_part_pair(
        pair, range,
        [&](std::uint32_t number_a, const Part<Dim>& a, std::uint32_t number_b, const Part<Dim>& b) {
            Gap<Dim> gap;
            part_gap(a, b, range.reach * (1 + 1e-9), gap); // so as not to lose an equally near one
            if (!(gap.distance <= range.reach && gap.distance <= best.distance)) return;
            // Of equally near children the first ones count, whatever the order of visits.
            const bool earlier = number_a != best_a ? by_a && number_a < best_a : by_b && number_b < best_b;
            if (gap.distance == best.distance && !earlier) return;
            best = gap;
            best_a = number_a;
            best_b = number_b;
            range.reach = std::max(0.0, std::min(range.reach, gap.distance));
        });
}

#define JOSTLE_PAIR(Dim)                                                                                     \
    template bool arrange(Placed<Dim>&);                                                                     \
    template bool arrange(Placed<Dim>&, ShapeType);                                                          \
    template void find_contacts(const Placed<Dim>&, double, FoundList<Dim>&);                                \
    template void find_contacts_generally(const Placed<Dim>&, double, FoundList<Dim>&);                      \
    template bool find_touch(const Placed<Dim>&);                                                            \
    template void find_gap(const Placed<Dim>&, double, Gap<Dim>&)
JOSTLE_PAIR(2);
JOSTLE_PAIR(3);

} // namespace narrow
JOSTLE_NAMESPACE_END
