// SPDX-License-Identifier: MIT
#include "narrow/nearest.hpp"

#include "narrow/convex3.hpp"
#include "narrow/each_part.hpp"
#include "narrow/small_vector.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {
namespace {

/// One of the two that a search goes through: a mesh, whose boxes are numbered node * 8 + place, or a single
/// part, which is box 0.
class Side
{
  public:
    Side(const MeshData<3>& mesh, const Frame<3>& where) : frame(where), mesh_(&mesh) {}
    Side(const Part<3>& part, std::uint32_t number)
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
    [[nodiscard]] bool is_half_space() const { return part_ != nullptr && part_->half_space; }
    [[nodiscard]] const Part<3>& half_space() const { return *part_; }
    /// Calls visit(number, part) with the part of a leaf.
    template <class Visit>
    void with_part(std::uint32_t at, const Kernels& kernels, const Visit& visit) const
    {
        if (mesh_ == nullptr) return visit(number_, *part_);
        const std::uint32_t e = child(at) & ~MeshTree::leaf;
        visit(e, Part<3>(*mesh_, mesh_->elements[e], frame, kernels));
    }

    Frame<3> frame;
    double radius = 0; ///< around the box

  private:
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

/// Where a frame lies, seen from another.
Frame<3> seen_from(const Frame<3>& other, const Frame<3>& frame)
{
    return {{other.r.back(frame.r.x), other.r.back(frame.r.y), other.r.back(frame.r.z)},
            other.r.back(frame.p - other.p)};
}

/// The boxes of a half-space and of rows.
void half_space_bounds(const BoxRows& rows, const Vec3& normal, double offset, BoxBounds& out)
{
    for (std::uint32_t i = 0; i < BoxRows::size; ++i) {
        const OrientedBox box = rows.box(i);
        out.distance[i] = dot(normal, box.centre) - offset - box.half.x * std::abs(dot(normal, box.axes.x)) -
                          box.half.y * std::abs(dot(normal, box.axes.y)) -
                          box.half.z * std::abs(dot(normal, box.axes.z));
    }
}

/// Looks at pairs of leaves, the most promising ones of a neighbourhood first. `judge` says what is promising:
///   excludes(key): nothing with this key, or a greater one, is wanted any more;
///   key(bound): of two boxes that are no nearer to each other than that;
///   visit(at_a, at_b): two leaves.
template <class Judge>
void search(const Side& a, const Side& b, const Kernels& kernels, Judge& judge)
{
    struct Item
    {
        double key;
        std::uint32_t at_a, at_b;
    };
    const Frame<3> a_from_b = seen_from(b.frame, a.frame), b_from_a = seen_from(a.frame, b.frame);
    const double radius = a.radius + b.radius;
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
        const Side &open = open_b ? b : a, &other = open_b ? a : b;
        const std::uint32_t at_open = open_b ? item.at_b : item.at_a,
                            at_other = open_b ? item.at_a : item.at_b;
        const MeshTree::Node& node = open.node_below(at_open);
        BoxBounds bounds;
        if (other.is_half_space()) {
            const Part<3>& part = other.half_space();
            half_space_bounds(node.boxes, open.frame.r.back(part.normal),
                              part.offset - dot(part.normal, open.frame.p), bounds);
        } else {
            const Frame<3>& there = open_b ? a_from_b : b_from_a;
            OrientedBox box = other.box(at_other);
            box.centre = there * box.centre;
            box.axes = there.r * box.axes;
            kernels.bounds(node.boxes, box, bounds);
        }
        const std::uint32_t first = open.first_below(at_open);
        Item found[BoxRows::size];
        std::uint32_t count = 0;
        for (std::uint32_t i = 0; i < node.count; ++i) {
            const double key = judge.key(bounds.distance[i] - radius);
            if (judge.excludes(key)) continue;
            std::uint32_t at = count++; // the least key last
            for (; at > 0 && found[at - 1].key < key; --at)
                found[at] = found[at - 1];
            found[at] = open_b ? Item{key, item.at_a, first + i} : Item{key, first + i, item.at_b};
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
    if (mesh_a && mesh_b) return visit(Side(mesh_of(*pair.a), frame_a), Side(mesh_of(*pair.b), frame_b));
    const Shape<3>&mesh = mesh_a ? *pair.a : *pair.b, &other = mesh_a ? *pair.b : *pair.a;
    const Frame<3>&frame = mesh_a ? frame_a : frame_b, &other_frame = mesh_a ? frame_b : frame_a;
    const Region<3> region = region_of(mesh, frame.p, other_frame);
    for_each_part(other, *pair.kernels, other_frame, region, range,
                  [&](std::uint32_t number, const Part<3>& part) {
                      const Side side(mesh_of(mesh), frame), one(part, number);
                      mesh_a ? visit(side, one) : visit(one, side);
                  });
}

/// Where the tests of parts and the bounds of boxes may differ by rounding: the tests call a gap of less than
/// a billionth of the parts' size a touch.
double rounding_of(const Placed<3>& pair)
{
    double size = 1e-90; // the squares of lengths below that are lost
    size += length(pair.d);
    for (const Shape<3>* shape : {pair.a, pair.b})
        if (const double reach = ShapeAccess::reach(*shape); reach < HUGE_VAL) size += reach;
    return 4e-9 * size;
}
/// A user's shape, known by its support points, overlaps by a little more than what is found.
constexpr double deeper = 1.02;

struct Nearest
{
    const Side &a, &b;
    const Kernels& kernels;
    double rounding;
    double& limit; ///< what is further away doesn't count
    Gap<3>& best;
    std::uint32_t& best_a;
    std::uint32_t& best_b;

    [[nodiscard]] bool excludes(double key) const { return key > limit; }
    [[nodiscard]] double key(double bound) const { return (bound < 0 ? deeper * bound : bound) - rounding; }
    void visit(std::uint32_t at_a, std::uint32_t at_b)
    {
        a.with_part(at_a, kernels, [&](std::uint32_t number_a, const Part<3>& part_a) {
            b.with_part(at_b, kernels, [&](std::uint32_t number_b, const Part<3>& part_b) {
                Gap<3> gap;
                part_gap(part_a, part_b, std::max(0.0, limit + rounding), gap);
                if (!(gap.distance <= limit)) return;
                if (gap.distance == best.distance &&
                    (number_a != best_a ? number_a > best_a : number_b > best_b))
                    return;
                best = gap;
                best_a = number_a;
                best_b = number_b;
                limit = gap.distance;
            });
        });
    }
};

struct Touch
{
    const Side &a, &b;
    const Kernels& kernels;
    double rounding;
    bool& touch;

    [[nodiscard]] bool excludes(double key) const { return touch || key > 0; }
    [[nodiscard]] double key(double bound) const { return bound - rounding; }
    void visit(std::uint32_t at_a, std::uint32_t at_b)
    {
        a.with_part(at_a, kernels, [&](std::uint32_t, const Part<3>& part_a) {
            b.with_part(at_b, kernels,
                        [&](std::uint32_t, const Part<3>& part_b) { touch = part_touch(part_a, part_b); });
        });
    }
};

} // namespace

void nearest_parts(const Placed<3>& pair, double enough, Gap<3>& best)
{
    best.distance = HUGE_VAL;
    const double rounding = rounding_of(pair);
    std::uint32_t best_a = 0, best_b = 0;
    double limit = enough;
    Range<3> range{enough};
    for_each_side_pair(pair, range, [&](const Side& a, const Side& b) {
        Nearest judge{a, b, *pair.kernels, rounding, limit, best, best_a, best_b};
        search(a, b, *pair.kernels, judge);
        range.reach = std::max(0.0, limit + rounding);
    });
}

bool any_parts_touch(const Placed<3>& pair)
{
    bool touch = false;
    Range<3> range{0};
    for_each_side_pair(pair, range, [&](const Side& a, const Side& b) {
        Touch judge{a, b, *pair.kernels, rounding_of(pair), touch};
        search(a, b, *pair.kernels, judge);
        if (touch) range.reach = -HUGE_VAL;
    });
    return touch;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
