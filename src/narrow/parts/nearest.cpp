// SPDX-License-Identifier: MIT
#include "narrow/parts/nearest.hpp"

#include <algorithm>
#include <bit>

#include "narrow/parts/each_part.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// One side of a search: a mesh, whose boxes are numbered node * 8 + place, or a single part, which is box 0.
class SearchSide
{
  public:
    SearchSide(const MeshData<3>& mesh, const Frame<3>& where) : frame(where), mesh_(&mesh) {}
    SearchSide(const Part<3>& part, std::uint32_t number)
        : frame(part.core.frame), radius(part.core.radius), part_(&part), number_(number)
    {
        if (part.half_space) return;
        const Core3& core = part.core;
        const Vec3 axes[] = {frame.r.x, frame.r.y, frame.r.z};
        for (int d = 0; d < 3; ++d) {
            const double shift = dot(axes[d], frame.p);
            const double lo = dot(axes[d], furthest(core, -axes[d])) - shift,
                         hi = dot(axes[d], furthest(core, axes[d])) - shift;
            own_.centre[d] = 0.5 * (lo + hi);
            own_.half[d] = 0.5 * (hi - lo);
        }
        if (core.reach < round * length(own_.half)) { // its ball is smaller than the box
            own_.centre = own_.half = {};
            radius += core.reach;
        }
    }

    [[nodiscard]] bool is_leaf(std::uint32_t at) const
    {
        return mesh_ == nullptr || (child(at) & MeshTree::leaf) != 0;
    }
    [[nodiscard]] const MeshTree::Node& node_below(std::uint32_t at) const
    {
        return mesh_->tree.nodes[child(at)];
    }
    [[nodiscard]] std::uint32_t first_below(std::uint32_t at) const { return child(at) * BoxRows::size; }
    [[nodiscard]] OrientedBox box(std::uint32_t at) const
    {
        return mesh_ == nullptr ? own_ : node(at).boxes.box(at % BoxRows::size);
    }
    [[nodiscard]] double size(std::uint32_t at) const
    {
        const BoxRows& rows = node(at).boxes;
        const std::uint32_t i = at % BoxRows::size;
        return rows.half[0][i] + rows.half[1][i] + rows.half[2][i];
    }
    [[nodiscard]] bool is_part() const { return part_ != nullptr; }
    [[nodiscard]] bool is_half_space() const { return part_ != nullptr && part_->half_space; }
    [[nodiscard]] const Part<3>& half_space() const { return *part_; }
    /// The number of a leaf's part.
    [[nodiscard]] std::uint32_t number(std::uint32_t at) const
    {
        return mesh_ == nullptr ? number_ : child(at) & ~MeshTree::leaf;
    }
    /// Calls visit(number, part) with the part of a leaf.
    template <class Visit>
    void with_part(std::uint32_t at, const Kernels& kernels, const Visit& visit) const
    {
        if (mesh_ == nullptr) return visit(number_, *part_);
        const std::uint32_t e = number(at);
        visit(e, Part<3>(*mesh_, mesh_->elements[e], frame, kernels));
    }

    Frame<3> frame;
    double radius = 0; ///< around the box

  private:
    /// If a core's reach is at most this fraction of its box's half diagonal, its ball is smaller.
    static constexpr double round = 0.75;

    [[nodiscard]] const MeshTree::Node& node(std::uint32_t at) const
    {
        return mesh_->tree.nodes[at / BoxRows::size];
    }
    [[nodiscard]] std::uint32_t child(std::uint32_t at) const { return node(at).child[at % BoxRows::size]; }

    const MeshData<3>* mesh_ = nullptr;
    const Part<3>* part_ = nullptr;
    std::uint32_t number_ = 0;
    OrientedBox own_;
};

/// A frame relative to another.
Frame<3> seen_from(const Frame<3>& other, const Frame<3>& frame)
{
    return {{other.r.back(frame.r.x), other.r.back(frame.r.y), other.r.back(frame.r.z)},
            other.r.back(frame.p - other.p)};
}

OrientedBox box_from(OrientedBox box, const Frame<3>& there)
{
    box.centre = there * box.centre;
    box.axes = there.r * box.axes;
    return box;
}

/// Two boxes, one of which is about to be opened: its children are tested against the other.
struct Opening
{
    const SearchSide &open, &other;
    bool open_b; ///< the box to be opened is b's
    std::uint32_t at_open, at_other;
    const Frame<3>& there;       ///< the other's frame, relative to that of the box to be opened
    const OrientedBox& part_box; ///< of a single part, in the mesh's frame

    [[nodiscard]] const BoxRows& rows() const { return open.node_below(at_open).boxes; }
    /// Calls use(box) with the other box in the frame of the opened one.
    template <class Use>
    auto with_other_box(const Use& use) const
    {
        return other.is_part() ? use(part_box) : use(box_from(other.box(at_other), there));
    }
    /// Like the kernel `bounds`.
    std::uint32_t bounds(const Kernels& kernels, double limit, double (&key)[BoxRows::size]) const
    {
        if (!other.is_half_space())
            return with_other_box(
                [&](const OrientedBox& box) { return kernels.bounds(rows(), box, limit, key); });
        half_space_bounds(key);
        std::uint32_t within = 0;
        for (std::uint32_t i = 0; i < BoxRows::size; ++i) {
            key[i] = key_of(key[i]);
            within |= key[i] > limit ? 0u : 1u << i;
        }
        return within;
    }
    void approaches(const Kernels& kernels, BoxApproaches& out) const
    {
        if (!other.is_half_space())
            return with_other_box([&](const OrientedBox& box) { kernels.approaches(rows(), box, out); });
        half_space_bounds(out.distance);
        const Vec3 normal = open.frame.r.back(other.half_space().normal);
        for (std::uint32_t i = 0; i < BoxRows::size; ++i)
            for (int d = 0; d < 3; ++d)
                out.normal[d][i] = normal[d];
    }

  private:
    void half_space_bounds(double (&bound)[BoxRows::size]) const
    {
        const Part<3>& part = other.half_space();
        const Vec3 normal = open.frame.r.back(part.normal);
        const double offset = part.offset - dot(part.normal, open.frame.p);
        for (std::uint32_t i = 0; i < BoxRows::size; ++i) {
            const OrientedBox box = rows().box(i);
            const double reach = box.half.x * std::abs(dot(normal, box.axes.x)) +
                                 box.half.y * std::abs(dot(normal, box.axes.y)) +
                                 box.half.z * std::abs(dot(normal, box.axes.z));
            bound[i] = dot(normal, box.centre) - offset - reach;
        }
    }
};

/// Visits pairs of leaves, the most promising ones of a neighbourhood first. `judge` decides what is
/// promising:
///   keys(opening, key): of the other box and each of those within the opened one; returns the bits of those
///     that aren't excluded;
///   excludes(key): nothing with this key, or a greater one, is wanted any more;
///   visit(at_a, at_b): two leaves.
template <class Judge>
void search(const SearchSide& a, const SearchSide& b, Judge& judge)
{
    struct Item
    {
        double key;
        std::uint32_t at_a, at_b;
    };
    const Frame<3> a_from_b = seen_from(b.frame, a.frame), b_from_a = seen_from(a.frame, b.frame);
    const OrientedBox part_box = a.is_part()   ? box_from(a.box(0), a_from_b)
                                 : b.is_part() ? box_from(b.box(0), b_from_a)
                                               : OrientedBox{};
    SmallVector<Item, 256> waiting;
    waiting.push_back({-HUGE_VAL, 0, 0});
    while (!waiting.empty()) {
        const Item item = waiting[waiting.size() - 1];
        waiting.resize(waiting.size() - 1);
        if (judge.excludes(item.key)) continue;
        const bool leaf_a = a.is_leaf(item.at_a), leaf_b = b.is_leaf(item.at_b);
        if (leaf_a && leaf_b) {
            judge.visit(item.at_a, item.at_b);
            continue;
        }
        const bool open_b = leaf_a || (!leaf_b && b.size(item.at_b) >= a.size(item.at_a));
        const Opening opening = open_b ? Opening{b, a, true, item.at_b, item.at_a, a_from_b, part_box}
                                       : Opening{a, b, false, item.at_a, item.at_b, b_from_a, part_box};
        double keys[BoxRows::size];
        std::uint32_t wanted = judge.keys(opening, keys);
        wanted &= (1u << opening.open.node_below(opening.at_open).count) - 1;
        const std::uint32_t first = opening.open.first_below(opening.at_open);
        Item found[BoxRows::size];
        std::uint32_t count = 0;
        for (; wanted != 0; wanted &= wanted - 1) {
            const auto i = static_cast<std::uint32_t>(std::countr_zero(wanted));
            std::uint32_t at = count++; // the least key last
            for (; at > 0 && found[at - 1].key < keys[i]; --at)
                found[at] = found[at - 1];
            found[at] = open_b ? Item{keys[i], item.at_a, first + i} : Item{keys[i], first + i, item.at_b};
        }
        for (std::uint32_t i = 0; i < count; ++i)
            waiting.push_back(found[i]);
    }
}

/// Calls visit(side_a, side_b) for the two meshes, or the mesh and each part of the other shape. `range` may
/// shrink meanwhile.
template <class Visit>
void for_each_side_pair(const Placed<3>& pair, const Range<3>& range, const Visit& visit)
{
    const Frame<3> frame_a{pair.ra, {}}, frame_b{pair.rb, pair.d};
    const bool mesh_a = pair.a->type() == ShapeTypes::mesh, mesh_b = pair.b->type() == ShapeTypes::mesh;
    const auto mesh_of = [](const Shape<3>& shape) -> const MeshData<3>& {
        return ShapeAccess::data<MeshData<3>>(shape);
    };
    if (mesh_a && mesh_b)
        return visit(SearchSide(mesh_of(*pair.a), frame_a), SearchSide(mesh_of(*pair.b), frame_b));
    const Shape<3>&mesh = mesh_a ? *pair.a : *pair.b, &other = mesh_a ? *pair.b : *pair.a;
    const Frame<3>&frame = mesh_a ? frame_a : frame_b, &other_frame = mesh_a ? frame_b : frame_a;
    Region<3> region = region_of(mesh, frame.p, other_frame);
    region.way = other_frame.r.back(range.linear * (mesh_a ? -1.0 : 1.0));
    for_each_part(other, *pair.kernels, other_frame, region, range,
                  [&](std::uint32_t number, const Part<3>& part) {
                      const SearchSide side(mesh_of(mesh), frame), one(part, number);
                      mesh_a ? visit(side, one) : visit(one, side);
                  });
}

/// How much the tests of parts and the bounds of boxes may differ: the tests call a gap of less than a
/// billionth of the parts' size a touch.
double rounding_of(const Placed<3>& pair)
{
    double size = 1e-90; // the squares of smaller lengths underflow
    size += length(pair.d);
    for (const Shape<3>* shape : {pair.a, pair.b})
        if (const double reach = ShapeAccess::reach(*shape); reach < HUGE_VAL) size += reach;
    return 4e-9 * size;
}
/// A custom shape, known by its support points, overlaps by a little more than what is found.
constexpr double deeper = 1.02;

/// Two sides and the query about them.
struct Judge
{
    const SearchSide &a, &b;
    const Kernels& kernels;
    double rounding;

    template <class Visit>
    void with_parts(std::uint32_t at_a, std::uint32_t at_b, const Visit& visit) const
    {
        a.with_part(at_a, kernels, [&](std::uint32_t number_a, const Part<3>& part_a) {
            b.with_part(at_b, kernels, [&](std::uint32_t number_b, const Part<3>& part_b) {
                visit(number_a, part_a, number_b, part_b);
            });
        });
    }
    /// Parts in boxes with a greater key are further apart than `limit`.
    [[nodiscard]] double key_within(double limit) const
    {
        const double more = limit + rounding;
        return key_of((more < 0 ? more / deeper : more) + a.radius + b.radius);
    }
};

/// Two leaves, and the numbers of their parts.
struct Leaves
{
    std::uint32_t number_a, number_b, at_a, at_b;
};
struct Near : Judge
{
    double limit;
    SmallVector<Leaves, most_near>& found;

    Near(const Judge& judge, double margin, SmallVector<Leaves, most_near>& found_ones)
        : Judge(judge), limit(key_within(margin)), found(found_ones)
    {
    }
    [[nodiscard]] bool excludes(double key) const { return key > limit; }
    std::uint32_t keys(const Opening& opening, double (&key)[BoxRows::size]) const
    {
        return opening.bounds(kernels, limit, key);
    }
    void visit(std::uint32_t at_a, std::uint32_t at_b)
    {
        found.push_back({a.number(at_a), b.number(at_b), at_a, at_b});
    }
};

/// The nearest parts so far; parts further apart than `limit` don't count.
struct Least
{
    double limit;
    Gap<3>& gap;
    std::uint32_t a = 0, b = 0;
};

struct NearestParts : Judge
{
    Least& least;
    double limit;

    NearestParts(const Judge& judge, Least& so_far)
        : Judge(judge), least(so_far), limit(key_within(so_far.limit))
    {
    }
    [[nodiscard]] bool excludes(double key) const { return key > limit; }
    std::uint32_t keys(const Opening& opening, double (&key)[BoxRows::size]) const
    {
        return opening.bounds(kernels, limit, key);
    }
    void visit(std::uint32_t at_a, std::uint32_t at_b)
    {
        with_parts(at_a, at_b,
                   [&](std::uint32_t number_a, const Part<3>& part_a, std::uint32_t number_b,
                       const Part<3>& part_b) {
                       Gap<3> gap;
                       part_gap(part_a, part_b, std::max(0.0, least.limit + rounding), gap);
                       if (!(gap.distance <= least.limit)) return;
                       const bool later = number_a != least.a ? number_a > least.a : number_b > least.b;
                       if (gap.distance == least.gap.distance && later) return;
                       least.limit = gap.distance;
                       limit = key_within(gap.distance);
                       least.gap = gap;
                       least.a = number_a;
                       least.b = number_b;
                   });
    }
};

struct AnyTouch : Judge
{
    bool& touch;
    double limit;

    AnyTouch(const Judge& judge, bool& found) : Judge(judge), touch(found), limit(key_within(0)) {}
    [[nodiscard]] bool excludes(double key) const { return touch || key > limit; }
    std::uint32_t keys(const Opening& opening, double (&key)[BoxRows::size]) const
    {
        return opening.bounds(kernels, limit, key);
    }
    void visit(std::uint32_t at_a, std::uint32_t at_b)
    {
        with_parts(at_a, at_b,
                   [&](std::uint32_t, const Part<3>& part_a, std::uint32_t, const Part<3>& part_b) {
                       touch = part_touch(part_a, part_b);
                   });
    }
};

/// A ball around the contents of a box, and how far turning moves it.
struct Turned
{
    Vec3 centre;
    double reach;     ///< of the ball
    double spin = 0;  ///< the greatest advance of its centre along n per radian
    double lever = 0; ///< the share of a turn's motion that can be along n
    double swept;     ///< the greatest extent along n under any turn

    Turned(const Vec3& middle, double ball, const Turning<3>& turning, const Vec3& n)
        : centre(middle), reach(ball), swept(dot(n, middle) + ball)
    {
        if (turning.speed == 0) return;
        const Vec3 arm = middle - turning.centre;
        lever = length(cross(n, turning.axis));
        spin = length(cross(arm, turning.axis)) * lever;
        swept = dot(n, turning.centre) + dot(arm, turning.axis) * dot(n, turning.axis) + spin + ball;
    }
};

/// Parts that may come nearer than half the tolerance within the range's time, soonest first according to the
/// boxes.
struct Approaching : Judge
{
    const Flight<3>& flight;
    const Range<3>& range;
    FunctionRef<VisitPartPair> visit_parts;

    [[nodiscard]] bool excludes(double key) const { return key >= range.time; }
    std::uint32_t keys(const Opening& opening, double (&key)[BoxRows::size]) const
    {
        BoxApproaches bounds;
        opening.approaches(kernels, bounds);
        const double less = a.radius + b.radius + rounding, sliding = length(flight.linear);
        for (std::uint32_t i = 0; i < BoxRows::size; ++i) {
            const double distance = bounds.distance[i] - less;
            if (distance <= flight.tolerance) {
                key[i] = distance - flight.tolerance; // now; those that overlap most first
                continue;
            }
            if (distance > range.reach + sliding * range.time) {
                key[i] = HUGE_VAL;
                continue;
            }
            const Vec3 n =
                opening.open.frame.r * Vec3{bounds.normal[0][i], bounds.normal[1][i], bounds.normal[2][i]};
            key[i] = safe_time(opening, i, distance, opening.open_b ? n : -n);
        }
        std::uint32_t wanted = 0;
        for (std::uint32_t i = 0; i < BoxRows::size; ++i)
            wanted |= excludes(key[i]) ? 0u : 1u << i;
        return wanted;
    }
    void visit(std::uint32_t at_a, std::uint32_t at_b) { with_parts(at_a, at_b, visit_parts); }

  private:
    /// The time for which the contents of two boxes, separated by `distance` along n from a to b, certainly
    /// stay apart.
    [[nodiscard]] double safe_time(const Opening& opening, std::uint32_t i, double distance,
                                   const Vec3& n) const
    {
        const OrientedBox opened = opening.rows().box(i);
        const auto ball = [](const SearchSide& side, const OrientedBox& box) {
            return length(box.half) + side.radius;
        };
        const Vec3 middle = opening.open.frame * opened.centre;
        Vec3 other_middle;
        double other_ball = 0;
        if (opening.other.is_half_space()) {
            const Part<3>& part = opening.other.half_space();
            other_middle = middle - part.normal * (dot(part.normal, middle) - part.offset);
        } else {
            const OrientedBox box = opening.other.box(opening.at_other);
            other_middle = opening.other.frame * box.centre;
            other_ball = ball(opening.other, box);
        }
        const double opened_ball = ball(opening.open, opened);
        const Turned in_a(opening.open_b ? other_middle : middle, opening.open_b ? other_ball : opened_ball,
                          flight.a, n);
        const Turned in_b(opening.open_b ? middle : other_middle, opening.open_b ? opened_ball : other_ball,
                          flight.b, -n);
        const double near = 0.5 * flight.tolerance, closing = std::max(0.0, -dot(flight.linear, n));
        const auto time_for = [](double room, double speed) { return room > 0 ? room / speed : 0; };
        const double spin = closing + flight.a.speed * in_a.spin + flight.b.speed * in_b.spin;
        const double with_boxes = time_for(distance - near, spin + flight.a.speed * in_a.reach * in_a.lever +
                                                                flight.b.speed * in_b.reach * in_b.lever);
        const double with_balls =
            time_for(dot(n, in_b.centre - in_a.centre) - in_a.reach - in_b.reach - near - rounding, spin);
        const double swept = time_for(-in_a.swept - in_b.swept - near - rounding, closing);
        return std::max(with_boxes, std::max(with_balls, swept));
    }
};

} // namespace

void for_each_near(const Placed<3>& pair, double margin, FunctionRef<VisitPartPair> visit)
{
    const double rounding = rounding_of(pair);
    for_each_side_pair(pair, Range<3>{margin}, [&](const SearchSide& a, const SearchSide& b) {
        SmallVector<Leaves, most_near> found;
        Near judge{{a, b, *pair.kernels, rounding}, margin, found};
        search(a, b, judge);
        std::sort(found.data(), found.data() + found.size(), [](const Leaves& x, const Leaves& y) {
            return x.number_a != y.number_a ? x.number_a < y.number_a : x.number_b < y.number_b;
        });
        for (std::size_t i = 0; i < found.size(); ++i)
            judge.with_parts(found[i].at_a, found[i].at_b, visit);
    });
}

void nearest_parts(const Placed<3>& pair, double enough, Gap<3>& best)
{
    best.distance = HUGE_VAL;
    const double rounding = rounding_of(pair);
    Least least{enough, best};
    Range<3> range{enough};
    range.nearest_first = true;
    for_each_side_pair(pair, range, [&](const SearchSide& a, const SearchSide& b) {
        NearestParts judge{{a, b, *pair.kernels, rounding}, least};
        search(a, b, judge);
        range.reach = std::max(0.0, least.limit + rounding);
    });
}

bool any_parts_touch(const Placed<3>& pair)
{
    bool touch = false;
    Range<3> range{0};
    for_each_side_pair(pair, range, [&](const SearchSide& a, const SearchSide& b) {
        AnyTouch judge{{a, b, *pair.kernels, rounding_of(pair)}, touch};
        search(a, b, judge);
        if (touch) range.reach = -HUGE_VAL;
    });
    return touch;
}

void for_each_approaching(const Placed<3>& pair, const Flight<3>& flight, const Range<3>& range,
                          FunctionRef<VisitPartPair> visit)
{
    for_each_side_pair(pair, range, [&](const SearchSide& a, const SearchSide& b) {
        Approaching judge{{a, b, *pair.kernels, rounding_of(pair)}, flight, range, visit};
        search(a, b, judge);
    });
}

} // namespace narrow
JOSTLE_NAMESPACE_END
