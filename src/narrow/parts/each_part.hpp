// SPDX-License-Identifier: MIT
// Finds the parts of two shapes that are near enough to each other to be tested.
#pragma once

#include "narrow/parts/pair.hpp"
#include "narrow/parts/part.hpp"
#include "narrow/parts/tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// The box of any shape: that of its ball.
template <int Dim>
Region<Dim> region_of(const Shape<Dim>& shape, const V<Dim>& at, const Frame<Dim>& frame)
{
    const double reach = ShapeAccess::reach(shape) * (1 + 1e-14);
    const V<Dim> p = frame.r.back(at - frame.p);
    Region<Dim> region;
    for (int d = 0; d < Dim; ++d) {
        region.lo[d] = p[d] - reach;
        region.hi[d] = p[d] + reach;
    }
    region.middle = p;
    region.ball = with_rounding(reach, p);
    return region;
}

template <int Dim, class Visit>
void for_each_element(const MeshData<Dim>& mesh, const Kernels& kernels, const Frame<Dim>& frame,
                      const Region<Dim>& region, const Range<Dim>& range, Visit&& visit)
{
    for_each_leaf(mesh.nodes, region, range, [&](const TreeNode& node) {
        for (std::uint32_t i = 0; i < node.count; ++i) {
            const std::uint32_t e = mesh.order[node.first + i];
            const auto& corners = mesh.elements[e];
            double lo[Dim], hi[Dim];
            for (int d = 0; d < Dim; ++d) {
                lo[d] = hi[d] = mesh.vertices[corners[0]][d];
                for (std::size_t c = 1; c < corners.size(); ++c) {
                    lo[d] = std::min(lo[d], mesh.vertices[corners[c]][d]);
                    hi[d] = std::max(hi[d], mesh.vertices[corners[c]][d]);
                }
            }
            if (region.meets(lo, hi, range)) visit(e, Part<Dim>(mesh, corners, frame, kernels));
        }
    });
}

/// Calls visit(number, corners) for the triangles of a height field.
template <class Visit>
void for_each_triangle(const HeightData& field, const Region<3>& region, const Range<3>& range, Visit&& visit)
{
    const Region<3> all = region.swept(range.time);
    if (all.lo[1] > field.highest + range.reach) return;
    // Cells under the region; numbers beyond any grid are clamped before they become integers.
    const auto cell = [](double x, double spacing, std::uint32_t count) {
        const double c = std::floor(x / spacing);
        return c > 0 ? static_cast<std::uint32_t>(std::min(c, static_cast<double>(count))) : 0;
    };
    const double width = (field.columns - 1) * field.spacing_x, depth = (field.rows - 1) * field.spacing_z;
    if (all.hi[0] + range.reach < 0 || all.lo[0] - range.reach > width || all.hi[2] + range.reach < 0 ||
        all.lo[2] - range.reach > depth)
        return;
    const std::uint32_t z0 = cell(all.lo[2] - range.reach, field.spacing_z, field.rows - 2);
    const std::uint32_t z1 = cell(all.hi[2] + range.reach, field.spacing_z, field.rows - 2);
    for (std::uint32_t z = z0; z <= z1; ++z) {
        if (range.reach == -HUGE_VAL) return; // it may end the search; infinity minus it is NaN
        double lo = region.lo[0], hi = region.hi[0];
        if (range.time > 0) { // the part of the region that passes this row
            double enter = 0, leave = range.time;
            region.clip(2, z * field.spacing_z, (z + 1) * field.spacing_z, range.reach, enter, leave);
            if (enter > leave + 1e-12 * range.time) continue;
            lo += std::min(region.way.x * enter, region.way.x * leave) - 1e-12 * (all.hi[0] - all.lo[0]);
            hi += std::max(region.way.x * enter, region.way.x * leave) + 1e-12 * (all.hi[0] - all.lo[0]);
        }
        const std::uint32_t x0 = cell(lo - range.reach, field.spacing_x, field.columns - 2);
        const std::uint32_t x1 = cell(hi + range.reach, field.spacing_x, field.columns - 2);
        for (std::uint32_t x = x0; x <= x1; ++x) {
            const std::uint32_t number = 2 * (z * (field.columns - 1) + x);
            for (const bool second : {false, true}) {
                const auto corners = field.triangle(x, z, second);
                double high = -HUGE_VAL;
                for (const std::uint32_t v : corners)
                    high = std::max(high, field.heights[v]);
                const double low[3] = {x * field.spacing_x, field.floor, z * field.spacing_z};
                const double top[3] = {low[0] + field.spacing_x, high, low[2] + field.spacing_z};
                if (range.time > 0
                        ? region.meets(low, top, range)
                        : region.lo[1] <= high + range.reach && region.ball_meets(low, top, range.reach))
                    visit(number + (second ? 1u : 0u), corners);
            }
        }
    }
}

template <class Visit>
void for_each_cell(const HeightData& field, const Kernels& kernels, const Frame<3>& frame,
                   const Region<3>& region, const Range<3>& range, Visit&& visit)
{
    for_each_triangle(field, region, range, [&](std::uint32_t number, const Mesh<3>::Element& corners) {
        visit(number, Part<3>(field, corners, frame, kernels));
    });
}

/// A custom shape without a support function has no part that anything could meet.
template <int Dim>
bool has_part(const Shape<Dim>& shape)
{
    return shape.custom() == nullptr || shape.custom()->has_support();
}

/// In ascending order of their numbers, unless the range requests nearest first.
template <int Dim, class Visit>
void for_each_child(const CompoundData<Dim>& compound, const Kernels& kernels, const Frame<Dim>& frame,
                    const Region<Dim>& region, const Range<Dim>& range, Visit&& visit)
{
    const auto look_at = [&](std::uint32_t number) {
        const auto& child = compound.children[number];
        const double ball = ShapeAccess::reach(child.shape) * (1 + 1e-14);
        double lo[Dim], hi[Dim];
        for (int d = 0; d < Dim; ++d) {
            lo[d] = child.frame.p[d] - ball;
            hi[d] = child.frame.p[d] + ball;
        }
        if (has_part(child.shape) && region.meets(lo, hi, range))
            visit(number, Part<Dim>(child.shape, {frame.r * child.frame.r, frame * child.frame.p}, kernels));
    };
    // The tests of parts call a gap of less than a billionth of their size a touch.
    double size = compound.extent;
    for (int d = 0; d < Dim; ++d)
        size += std::max(std::abs(region.lo[d]), std::abs(region.hi[d]));
    const double rounding = 4e-9 * size;
    if (range.nearest_first)
        return for_each_leaf_by([&](const TreeNode& node) { return region.gap(node.lo, node.hi); },
                                [&] { return range.reach + rounding; }, compound.nodes,
                                [&](const TreeNode& node) {
                                    for (std::uint32_t i = 0; i < node.count; ++i)
                                        look_at(compound.order[node.first + i]);
                                });
    Range<Dim> wide = range;
    wide.reach += rounding;
    constexpr std::size_t most = 1024; // for more, testing all adds little
    std::uint32_t found[most];
    std::size_t count = 0;
    for_each_leaf(compound.nodes, region, wide, [&](const TreeNode& node) {
        for (std::uint32_t i = 0; i < node.count; ++i, ++count)
            if (count < most) found[count] = compound.order[node.first + i];
    });
    if (count <= most) {
        std::sort(found, found + count);
        for (std::size_t i = 0; i < count; ++i)
            look_at(found[i]);
    } else {
        for (std::uint32_t number = 0; number < compound.children.size(); ++number)
            look_at(number);
    }
}

/// Calls visit(number, part) for each part that may be within range of the region. The range may shrink
/// meanwhile.
template <int Dim, class Visit>
void for_each_part(const Shape<Dim>& shape, const Kernels& kernels, const Frame<Dim>& frame,
                   const Region<Dim>& region, const Range<Dim>& range, Visit&& visit)
{
    const Kind kind = kind_of(shape);
    if (!consists_of_parts(kind)) {
        if (has_part(shape)) visit(0u, Part<Dim>(shape, frame, kernels));
    } else if (kind == Kind::mesh) {
        for_each_element(ShapeAccess::data<MeshData<Dim>>(shape), kernels, frame, region, range, visit);
    } else if (kind == Kind::compound) {
        for_each_child(ShapeAccess::data<CompoundData<Dim>>(shape), kernels, frame, region, range, visit);
    } else if constexpr (Dim == 3) {
        for_each_cell(ShapeAccess::data<HeightData>(shape), kernels, frame, region, range, visit);
    }
}

/// Calls visit(part) with one part by its number, as for_each_part has numbered it.
template <int Dim, class Visit>
void with_part(const Shape<Dim>& shape, std::uint32_t number, const Kernels& kernels, const Frame<Dim>& frame,
               Visit&& visit)
{
    const Kind kind = kind_of(shape);
    if (!consists_of_parts(kind)) {
        visit(Part<Dim>(shape, frame, kernels));
    } else if (kind == Kind::mesh) {
        const auto& mesh = ShapeAccess::data<MeshData<Dim>>(shape);
        visit(Part<Dim>(mesh, mesh.elements[number], frame, kernels));
    } else if (kind == Kind::compound) {
        const auto& child = ShapeAccess::data<CompoundData<Dim>>(shape).children[number];
        visit(Part<Dim>(child.shape, {frame.r * child.frame.r, frame * child.frame.p}, kernels));
    } else if constexpr (Dim == 3) {
        const auto& field = ShapeAccess::data<HeightData>(shape);
        visit(Part<3>(field, field.triangle(number), frame, kernels));
    }
}

/// Calls visit(number_a, a, number_b, b) for all pairs of parts that may be within range of each other.
template <int Dim, class Visit>
void for_each_part_pair(const Placed<Dim>& pair, const Range<Dim>& range, Visit&& visit)
{
    const Frame<Dim> frame_a{pair.ra, {}}, frame_b{pair.rb, pair.d};
    const bool many_a = has_parts(*pair.a), many_b = has_parts(*pair.b);
    Region<Dim> around = many_a ? region_of(*pair.b, pair.d, frame_a) : everywhere<Dim>();
    if (many_a) around.way = frame_a.r.back(range.linear);
    const auto visit_a = [&](std::uint32_t number_a, const Part<Dim>& a) {
        Region<Dim> region = many_b ? region_of(a, frame_b) : everywhere<Dim>();
        if (many_b) region.way = frame_b.r.back(-range.linear);
        for_each_part(*pair.b, *pair.kernels, frame_b, region, range,
                      [&](std::uint32_t number_b, const Part<Dim>& b) { visit(number_a, a, number_b, b); });
    };
    for_each_part(*pair.a, *pair.kernels, frame_a, around, range, visit_a);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
