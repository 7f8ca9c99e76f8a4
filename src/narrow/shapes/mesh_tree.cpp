// SPDX-License-Identifier: MIT
#include "narrow/shapes/mesh_tree.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

void BoxRows::set(std::uint32_t i, const OrientedBox& box)
{
    const Vec3* const columns[] = {&box.axes.x, &box.axes.y, &box.axes.z};
    for (int d = 0; d < 3; ++d) {
        centre[d][i] = box.centre[d];
        half[d][i] = box.half[d];
        for (int k = 0; k < 3; ++k)
            axes[3 * d + k][i] = (*columns[d])[k];
    }
}

namespace {

using Index = std::uint32_t;
using Element = std::array<Index, 3>;

/// The axes in which a symmetric matrix is diagonal. Source: Jacobi's method; Golub and Van Loan, Matrix
/// Computations (2013), sec. 8.5.
Mat3 principal_axes(double (&m)[3][3])
{
    Vec3 axis[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int sweep = 0; sweep < 12; ++sweep) {
        const double size = std::abs(m[0][0]) + std::abs(m[1][1]) + std::abs(m[2][2]);
        const double off = std::abs(m[0][1]) + std::abs(m[0][2]) + std::abs(m[1][2]);
        if (!(off > 1e-15 * size)) break;
        for (int p = 0; p < 2; ++p)
            for (int q = p + 1; q < 3; ++q) {
                if (m[p][q] == 0) continue;
                const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
                const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
                const double c = 1 / std::sqrt(t * t + 1), s = t * c;
                const int r = 3 - p - q;
                const double pr = m[p][r], qr = m[q][r];
                m[p][p] -= t * m[p][q];
                m[q][q] += t * m[p][q];
                m[p][q] = m[q][p] = 0;
                m[p][r] = m[r][p] = c * pr - s * qr;
                m[q][r] = m[r][q] = s * pr + c * qr;
                const Vec3 from = axis[p];
                axis[p] = from * c - axis[q] * s;
                axis[q] = from * s + axis[q] * c;
            }
    }
    return {axis[0], axis[1], axis[2]};
}

/// With one side along the triangle's longest; for a triangle without area, any box around it.
Mat3 triangle_axes(const Vec3 (&corner)[3])
{
    const Vec3 side[3] = {corner[1] - corner[0], corner[2] - corner[1], corner[0] - corner[2]};
    int longest_side = 0;
    for (int i = 1; i < 3; ++i)
        if (length2(side[i]) > length2(side[longest_side])) longest_side = i;
    const double size = length(side[longest_side]);
    if (!(size > 1e-100)) return {};
    const Vec3 u = side[longest_side] * (1 / size);
    const Vec3 other = side[(longest_side + 1) % 3];
    const Vec3 across = other - u * dot(u, other);
    const double width = length(across);
    if (width > 1e-9 * size) {
        const Vec3 v = across * (1 / width);
        return {u, v, cross(u, v)};
    }
    Vec3 v, w;
    basis(u, v, w);
    return {u, v, w};
}

class Builder
{
  public:
    Builder(std::span<const Vec3> vertices, std::span<const Element> elements, std::span<const Index> order,
            MeshTree& tree)
        : vertices_(vertices), elements_(elements), order_(order), tree_(tree)
    {
    }
    void build()
    {
        tree_.nodes.reserve(order_.size() / 4 + 2);
        const Run all{0, static_cast<Index>(order_.size())};
        tree_.nodes.emplace_back();
        const Index child = add(all);
        put(0, std::span(&all, 1), &child);
    }

  private:
    struct Run
    {
        Index first, last;
        [[nodiscard]] Index size() const { return last - first; }
    };

    /// A run as a child of some node.
    Index add(const Run& run)
    {
        if (run.size() == 1) return order_[run.first] | MeshTree::leaf;
        Run runs[BoxRows::size] = {run};
        Index count = 1;
        for (int level = 0; level < 3; ++level) {
            Run halves[BoxRows::size];
            Index made = 0;
            for (Index i = 0; i < count; ++i) {
                const Index middle = runs[i].first + runs[i].size() / 2;
                if (runs[i].size() > 1) halves[made++] = {runs[i].first, middle};
                halves[made++] = {runs[i].size() > 1 ? middle : runs[i].first, runs[i].last};
            }
            std::copy(halves, halves + made, runs);
            count = made;
        }
        const auto here = static_cast<Index>(tree_.nodes.size());
        tree_.nodes.emplace_back();
        Index child[BoxRows::size];
        for (Index i = 0; i < count; ++i)
            child[i] = add(runs[i]);
        put(here, std::span(runs, count), child);
        return here;
    }
    void put(Index at, std::span<const Run> runs, const Index* child)
    {
        MeshTree::Node& node = tree_.nodes[at];
        node.count = static_cast<Index>(runs.size());
        for (Index i = 0; i < BoxRows::size; ++i) {
            const Index from = i < node.count ? i : 0;
            node.child[i] = child[from];
            node.boxes.set(i, i < node.count ? box_around(runs[i]) : node.boxes.box(0));
        }
    }

    template <class Visit>
    void for_each_corner(const Run& run, const Visit& visit) const
    {
        for (Index i = run.first; i < run.last; ++i)
            for (const Index v : elements_[order_[i]])
                visit(vertices_[v]);
    }
    [[nodiscard]] OrientedBox box_around(const Run& run) const
    {
        if (run.size() == 1) {
            const Element& e = elements_[order_[run.first]];
            return box_along(run, triangle_axes({vertices_[e[0]], vertices_[e[1]], vertices_[e[2]]}));
        }
        const OrientedBox straight = box_along(run, {});
        const Vec3 centre = straight.centre;
        double m[3][3] = {};
        for_each_corner(run, [&](const Vec3& p) {
            const Vec3 q = p - centre;
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    m[i][j] += q[i] * q[j];
        });
        Vec3 mean;
        for_each_corner(run, [&](const Vec3& p) { mean += p - centre; });
        const double count = 3.0 * run.size();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j)
                m[i][j] -= mean[i] * mean[j] / count;
        const OrientedBox turned = box_along(run, principal_axes(m));
        const auto surface = [](const Vec3& h) { return h.x * h.y + h.y * h.z + h.z * h.x; };
        return surface(turned.half) < surface(straight.half) ? turned : straight;
    }
    [[nodiscard]] OrientedBox box_along(const Run& run, const Mat3& axes) const
    {
        Vec3 lo{HUGE_VAL, HUGE_VAL, HUGE_VAL}, hi = -lo;
        for_each_corner(run, [&](const Vec3& p) {
            const Vec3 q = axes.back(p);
            for (int d = 0; d < 3; ++d) {
                lo[d] = std::min(lo[d], q[d]);
                hi[d] = std::max(hi[d], q[d]);
            }
        });
        return {axes * ((lo + hi) * 0.5), (hi - lo) * 0.5, axes};
    }

    std::span<const Vec3> vertices_;
    std::span<const Element> elements_;
    std::span<const Index> order_;
    MeshTree& tree_;
};

} // namespace

MeshTree mesh_tree(std::span<const Vec3> vertices, std::span<const Element> elements,
                   std::span<const Index> order)
{
    MeshTree tree;
    Builder(vertices, elements, order, tree).build();
    tree.nodes.shrink_to_fit();
    return tree;
}

} // namespace narrow
JOSTLE_NAMESPACE_END
