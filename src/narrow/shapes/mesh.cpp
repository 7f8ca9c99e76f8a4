// SPDX-License-Identifier: MIT
// Meshes, height fields and compounds: data and its checks.
#include <algorithm>
#include <limits>
#include <string>

#include "narrow/shapes/extent.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Parts, and the corners of elements, are counted in 32 bits.
constexpr std::uint64_t most_parts = std::numeric_limits<std::uint32_t>::max();

namespace {

using Index = std::uint32_t;
constexpr Index leaf_size = 4;

struct Item
{
    double lo[3], hi[3], middle[3];
    Index element;
};

/// Splits at the median of the longest axis of the middles: depth at most 32 for 2^32 elements.
void build_node(std::vector<Item>& items, Index first, Index last, std::vector<TreeNode>& nodes,
                std::vector<Index>& order)
{
    TreeNode node;
    double from[3], to[3];
    for (int d = 0; d < 3; ++d) {
        node.lo[d] = from[d] = HUGE_VAL;
        node.hi[d] = to[d] = -HUGE_VAL;
    }
    for (Index i = first; i < last; ++i)
        for (int d = 0; d < 3; ++d) {
            node.lo[d] = std::min(node.lo[d], items[i].lo[d]);
            node.hi[d] = std::max(node.hi[d], items[i].hi[d]);
            from[d] = std::min(from[d], items[i].middle[d]);
            to[d] = std::max(to[d], items[i].middle[d]);
        }
    node.first = static_cast<Index>(order.size());
    node.count = last - first <= leaf_size ? last - first : 0;
    const std::size_t here = nodes.size();
    nodes.push_back(node);
    if (node.count != 0) {
        for (Index i = first; i < last; ++i)
            order.push_back(items[i].element);
    } else {
        int axis = 0;
        for (int d = 1; d < 3; ++d)
            if (to[d] - from[d] > to[axis] - from[axis]) axis = d;
        const Index middle = first + (last - first) / 2;
        std::nth_element(items.begin() + first, items.begin() + middle, items.begin() + last,
                         [axis](const Item& p, const Item& q) {
                             return p.middle[axis] != q.middle[axis] ? p.middle[axis] < q.middle[axis]
                                                                     : p.element < q.element;
                         });
        build_node(items, first, middle, nodes, order);
        build_node(items, middle, last, nodes, order);
    }
    nodes[here].skip = static_cast<Index>(nodes.size());
}

template <int Dim>
void build_tree(MeshData<Dim>& data)
{
    std::vector<Item> items(data.elements.size());
    for (Index e = 0; e < items.size(); ++e) {
        Item& item = items[e];
        item.element = e;
        for (int d = 0; d < 3; ++d) {
            item.lo[d] = d < Dim ? HUGE_VAL : 0;
            item.hi[d] = d < Dim ? -HUGE_VAL : 0;
            for (const Index v : data.elements[e])
                if (d < Dim) {
                    item.lo[d] = std::min(item.lo[d], data.vertices[v][d]);
                    item.hi[d] = std::max(item.hi[d], data.vertices[v][d]);
                }
            item.middle[d] = 0.5 * item.lo[d] + 0.5 * item.hi[d];
        }
    }
    build_node(items, 0, static_cast<Index>(items.size()), data.nodes, data.order);
}
template <int Dim>
void build_tree(CompoundData<Dim>& data)
{
    std::vector<Item> items(data.children.size());
    for (Index i = 0; i < items.size(); ++i) {
        const auto& [shape, frame] = data.children[i];
        Item& item = items[i];
        item.element = i;
        Extent<Dim> box = nothing<Dim>();
        const double reach = ShapeAccess::reach(shape);
        // Only the ball of a custom shape is known already.
        add_shape(shape.custom() == nullptr ? shape : Shape<Dim>::sphere(reach), frame.r, frame.p, box);
        const double rounding = reach < HUGE_VAL ? 1e-14 * (length(frame.p) + reach) : 0;
        for (int d = 0; d < 3; ++d) {
            item.lo[d] = d < Dim ? box.lo[d] - rounding : 0;
            item.hi[d] = d < Dim ? box.hi[d] + rounding : 0;
            item.middle[d] = d < Dim ? frame.p[d] : 0;
            if (reach < HUGE_VAL) item.middle[d] = 0.5 * item.lo[d] + 0.5 * item.hi[d];
        }
    }
    build_node(items, 0, static_cast<Index>(items.size()), data.nodes, data.order);
}

template <int Dim>
struct Place
{
    V<Dim> cell;
    Index vertex;
};
template <int Dim>
bool is_before(const V<Dim>& a, const V<Dim>& b)
{
    for (int d = 0; d < Dim; ++d)
        if (a[d] != b[d]) return a[d] < b[d];
    return false;
}
/// Sorted by cell, and in each by number.
template <int Dim, class Cell>
std::vector<Place<Dim>> sorted_places(const std::vector<V<Dim>>& vertices, const Cell& cell_of)
{
    std::vector<Place<Dim>> places;
    places.reserve(vertices.size());
    for (Index v = 0; v < vertices.size(); ++v)
        places.push_back({cell_of(vertices[v]), v});
    std::sort(places.begin(), places.end(), [](const Place<Dim>& a, const Place<Dim>& b) {
        return is_before<Dim>(a.cell, b.cell) || (!is_before<Dim>(b.cell, a.cell) && a.vertex < b.vertex);
    });
    return places;
}

/// The first of the vertices at the same place.
template <int Dim>
std::vector<Index> first_there(const std::vector<V<Dim>>& vertices)
{
    const auto places = sorted_places<Dim>(vertices, [](const V<Dim>& p) { return p; });
    std::vector<Index> first(vertices.size());
    for (std::size_t k = 0; k < places.size(); ++k) {
        const bool same = k > 0 && !is_before<Dim>(places[k - 1].cell, places[k].cell);
        first[places[k].vertex] = same ? first[places[k - 1].vertex] : places[k].vertex;
    }
    return first;
}

/// For each vertex the first representative within `reach`: in order, each vertex is a representative unless
/// an earlier one is that near. With cells of twice the reach, near ones are in one of 2^Dim cells.
template <int Dim>
std::vector<Index> first_within(const std::vector<V<Dim>>& vertices, double reach)
{
    double most = 0;
    for (const V<Dim>& p : vertices)
        for (int d = 0; d < Dim; ++d)
            most = std::max(most, std::abs(p[d]));
    const double width = std::max(2 * reach, 1e-300 * most);
    const auto cell_of = [width](const V<Dim>& p) {
        V<Dim> cell;
        for (int d = 0; d < Dim; ++d)
            cell[d] = std::floor(p[d] / width);
        return cell;
    };
    const auto places = sorted_places<Dim>(vertices, cell_of);
    std::vector<Index> first(vertices.size());
    std::vector<Index> own(places.size()), count(places.size(), 0); // of a cell from its first place on
    for (Index v = 0; v < vertices.size(); ++v) {
        const V<Dim>& p = vertices[v];
        const V<Dim> cell = cell_of(p);
        std::size_t home = 0;
        Index best = v;
        for (int k = 0; k < 1 << Dim; ++k) {
            V<Dim> there = cell;
            for (int d = 0; d < Dim; ++d)
                if ((k >> d & 1) != 0) there[d] += p[d] / width - cell[d] < 0.5 ? -1 : 1;
            const auto begin = std::lower_bound(
                places.begin(), places.end(), there,
                [](const Place<Dim>& a, const V<Dim>& b) { return is_before<Dim>(a.cell, b); });
            const auto at = static_cast<std::size_t>(begin - places.begin());
            if (k == 0) home = at;
            if (begin == places.end() || is_before<Dim>(there, begin->cell)) continue;
            for (Index i = 0; i < count[at]; ++i)
                if (own[at + i] < best && length(vertices[own[at + i]] - p) <= reach) best = own[at + i];
        }
        first[v] = best;
        if (best == v) own[home + count[home]++] = v;
    }
    return first;
}

template <int Dim>
void weld(MeshData<Dim>& data, double reach)
{
    const std::vector<Index> first =
        reach > 0 ? first_within<Dim>(data.vertices, reach) : first_there<Dim>(data.vertices);
    for (auto& element : data.elements)
        for (Index& v : element)
            v = first[v];
}

/// Lists the elements of each vertex; each once, also those that name it twice.
template <int Dim>
void list_elements(MeshData<Dim>& data)
{
    const auto for_each_corner = [&](auto&& visit) {
        for (Index e = 0; e < data.elements.size(); ++e) {
            const auto& corner = data.elements[e];
            for (std::size_t i = 0; i < corner.size(); ++i)
                if (std::find(corner.begin(), corner.begin() + i, corner[i]) == corner.begin() + i)
                    visit(corner[i], e);
        }
    };
    data.first_at.assign(data.vertices.size() + 1, 0);
    for_each_corner([&](Index v, Index) { ++data.first_at[v + 1]; });
    for (std::size_t v = 0; v < data.vertices.size(); ++v)
        data.first_at[v + 1] += data.first_at[v];
    data.at.resize(data.first_at.back());
    std::vector<Index> next(data.first_at);
    for_each_corner([&](Index v, Index e) { data.at[next[v]++] = e; });
}

template <class T>
std::shared_ptr<HeightData> make_heights(const HeightGrid<T>& grid)
{
    if (grid.columns < 2 || grid.rows < 2)
        throw Error(ErrorCode::invalid_argument, "a height field of " + std::to_string(grid.columns) + " x " +
                                                     std::to_string(grid.rows) +
                                                     " heights; give at least 2 x 2");
    if (std::uint64_t{grid.columns - 1} * (grid.rows - 1) > most_parts / 2)
        throw Error(ErrorCode::invalid_argument,
                    "a height field of " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                        " heights has more than 2^32 - 1 triangles; give several");
    const std::uint64_t count = std::uint64_t{grid.columns} * grid.rows;
    if (grid.heights.size() != count)
        throw Error(ErrorCode::size_mismatch, "a height field of " + std::to_string(grid.columns) + " x " +
                                                  std::to_string(grid.rows) + " was given " +
                                                  std::to_string(grid.heights.size()) + " heights");
    for (const T spacing : {grid.spacing_x, grid.spacing_z})
        if (!(spacing > 0) || !(spacing <= longest))
            throw Error(ErrorCode::invalid_argument, "a height field's spacing is " + text(double{spacing}) +
                                                         "; give a finite length above 0");
    if (!(grid.thickness >= 0) || !(grid.thickness <= longest))
        throw Error(ErrorCode::invalid_argument, "a height field's thickness is " +
                                                     text(double{grid.thickness}) +
                                                     "; give a finite length of 0 or more");
    auto data = std::make_shared<HeightData>();
    data->columns = grid.columns;
    data->rows = grid.rows;
    data->spacing_x = grid.spacing_x;
    data->spacing_z = grid.spacing_z;
    data->thickness = grid.thickness;
    data->heights.reserve(grid.heights.size());
    double lowest = HUGE_VAL;
    data->highest = -HUGE_VAL;
    for (std::size_t i = 0; i < count; ++i) {
        const double h = grid.heights[i];
        if (!(std::abs(h) <= longest))
            throw Error(ErrorCode::nan_coordinate,
                        "height " + std::to_string(i) + " is " + text(h) + "; give ones within 1e60", i);
        data->heights.push_back(h);
        lowest = std::min(lowest, h);
        data->highest = std::max(data->highest, h);
    }
    data->floor = lowest - std::max(double{grid.thickness}, std::max(data->spacing_x, data->spacing_z));
    const double y = std::max(std::abs(data->floor), std::abs(data->highest));
    data->reach = length(Vec3{(grid.columns - 1) * data->spacing_x, y, (grid.rows - 1) * data->spacing_z});
    return data;
}

} // namespace
} // namespace narrow

void detail::throw_not_whole(std::size_t numbers, std::size_t of_each)
{
    throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(numbers) + " numbers; give " +
                                              std::to_string(of_each) +
                                              " for each point or element, one after another");
}

template <int Dim>
template <Coordinate T>
void Mesh<Dim>::build(std::span<const Vec<Dim, T>> vertices, std::span<const Element> elements, double weld)
{
    if (!(weld >= 0) || !(weld <= narrow::longest))
        throw Error(ErrorCode::invalid_argument,
                    "the weld of a mesh is " + narrow::text(weld) + "; give a finite length of 0 or more");
    if (elements.empty())
        throw Error(ErrorCode::invalid_argument, "a mesh without elements; give at least one");
    if (elements.size() > narrow::most_parts / Dim)
        throw Error(ErrorCode::invalid_argument, "a mesh of " + std::to_string(elements.size()) +
                                                     " elements; give at most " +
                                                     std::to_string(narrow::most_parts / Dim) + " to each");
    auto data = std::make_shared<narrow::MeshData<Dim>>();
    data->vertices.reserve(vertices.size());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        for (const T x : vertices[i])
            if (!(std::abs(double{x}) <= narrow::longest))
                throw Error(ErrorCode::nan_coordinate,
                            "vertex " + std::to_string(i) + " of a mesh has the coordinate " +
                                narrow::text(double{x}) + "; give ones within 1e60",
                            i);
        data->vertices.push_back(narrow::load(vertices[i]));
    }
    for (std::size_t e = 0; e < elements.size(); ++e)
        for (const std::uint32_t v : elements[e])
            if (v >= vertices.size())
                throw Error(ErrorCode::invalid_argument,
                            "element " + std::to_string(e) + " of a mesh names vertex " + std::to_string(v) +
                                ", but there are " + std::to_string(vertices.size()),
                            e);
    data->elements.assign(elements.begin(), elements.end());
    narrow::weld(*data, weld);
    for (const Element& element : data->elements)
        for (const std::uint32_t v : element)
            data->reach = std::max(data->reach, narrow::length(data->vertices[v]));
    narrow::build_tree(*data);
    narrow::list_elements(*data);
    if constexpr (Dim == 3) data->tree = narrow::mesh_tree(data->vertices, data->elements, data->order);
    data_ = std::move(data);
}

template <int Dim>
std::size_t Mesh<Dim>::size() const noexcept
{
    return data_->elements.size();
}
template <int Dim>
std::vector<Vec<Dim, double>> Mesh<Dim>::vertices() const
{
    std::vector<Vec<Dim, double>> all(data_->vertices.size());
    for (std::size_t v = 0; v < all.size(); ++v)
        narrow::store(data_->vertices[v], all[v]);
    return all;
}
template <int Dim>
std::span<const typename Mesh<Dim>::Element> Mesh<Dim>::elements() const noexcept
{
    return data_->elements;
}

HeightField::HeightField(const HeightGrid<float>& grid) : data_(narrow::make_heights(grid)) {}
HeightField::HeightField(const HeightGrid<double>& grid) : data_(narrow::make_heights(grid)) {}
HeightGrid<double> HeightField::grid() const noexcept
{
    return {data_->heights,   data_->columns,   data_->rows,
            data_->spacing_x, data_->spacing_z, data_->thickness};
}

template <int Dim>
Compound<Dim>::Compound(std::span<const Child> children)
{
    if (children.empty())
        throw Error(ErrorCode::invalid_argument, "a compound without children; give at least one");
    auto data = std::make_shared<narrow::CompoundData<Dim>>();
    for (std::size_t i = 0; i < children.size(); ++i) {
        const Child& child = children[i];
        const ShapeType type = child.shape.type();
        const std::string name = "child " + std::to_string(i) + " of a compound ";
        if (type == ShapeTypes::mesh || type == ShapeTypes::height_field || type == ShapeTypes::compound)
            throw Error(ErrorCode::invalid_argument,
                        name + "is a mesh, height field or compound; give those bodies of their own, or add "
                               "the inner compound's children themselves",
                        i);
        bool good = false;
        for (const double q : child.pose.rotation)
            good = good || q != 0;
        for (const double x : child.pose.rotation)
            good = good && std::abs(x) <= std::numeric_limits<double>::max();
        for (const double x : child.pose.position)
            good = good && std::abs(x) <= narrow::longest;
        if (!good)
            throw Error(ErrorCode::invalid_argument,
                        name + "has no pose: numbers must be finite and the rotation not zero", i);
        narrow::Frame<Dim> frame{narrow::rotation(child.pose), narrow::load(child.pose.position)};
        const double reach = narrow::ShapeAccess::reach(child.shape);
        data->reach = std::max(data->reach, narrow::length(frame.p) + reach);
        if (reach < HUGE_VAL) data->extent = std::max(data->extent, narrow::length(frame.p) + reach);
        data->children.push_back({child.shape, frame});
    }
    data->given.assign(children.begin(), children.end());
    narrow::build_tree(*data);
    data_ = std::move(data);
}
template <int Dim>
std::span<const typename Compound<Dim>::Child> Compound<Dim>::children() const noexcept
{
    return data_->given;
}

template <int Dim>
Shape<Dim>::Shape(const Mesh<Dim>& mesh) noexcept
{
    const auto& data = narrow::ShapeAccess::data_of(mesh);
    narrow::ShapeAccess::fill(*this, ShapeTypes::mesh, data.reach, &data);
}
template <int Dim>
Shape<Dim>::Shape(const HeightField& field) noexcept
    requires(Dim == 3)
{
    const auto& data = narrow::ShapeAccess::data_of(field);
    narrow::ShapeAccess::fill(*this, ShapeTypes::height_field, data.reach, &data);
}
template <int Dim>
Shape<Dim>::Shape(const Compound<Dim>& compound) noexcept
{
    const auto& data = narrow::ShapeAccess::data_of(compound);
    narrow::ShapeAccess::fill(*this, ShapeTypes::compound, data.reach, &data);
}
template <int Dim>
std::optional<Mesh<Dim>> Shape<Dim>::mesh() const
{
    return narrow::ShapeAccess::value_of<Mesh<Dim>>(*this, {ShapeTypes::mesh});
}
template <int Dim>
std::optional<HeightField> Shape<Dim>::height_field() const
    requires(Dim == 3)
{
    return narrow::ShapeAccess::value_of<HeightField>(*this, {ShapeTypes::height_field});
}
template <int Dim>
std::optional<Compound<Dim>> Shape<Dim>::compound() const
{
    return narrow::ShapeAccess::value_of<Compound<Dim>>(*this, {ShapeTypes::compound});
}

template class Mesh<2>;
template class Mesh<3>;
template class Compound<2>;
template class Compound<3>;
template JOSTLE_API void Mesh<2>::build(std::span<const Vec<2, float>>, std::span<const Element>, double);
template JOSTLE_API void Mesh<2>::build(std::span<const Vec<2, double>>, std::span<const Element>, double);
template JOSTLE_API void Mesh<3>::build(std::span<const Vec<3, float>>, std::span<const Element>, double);
template JOSTLE_API void Mesh<3>::build(std::span<const Vec<3, double>>, std::span<const Element>, double);
template JOSTLE_API Shape<2>::Shape(const Mesh<2>&) noexcept;
template JOSTLE_API Shape<3>::Shape(const Mesh<3>&) noexcept;
template JOSTLE_API Shape<3>::Shape(const HeightField&) noexcept;
template JOSTLE_API Shape<2>::Shape(const Compound<2>&) noexcept;
template JOSTLE_API Shape<3>::Shape(const Compound<3>&) noexcept;
template JOSTLE_API std::optional<Mesh<2>> Shape<2>::mesh() const;
template JOSTLE_API std::optional<Mesh<3>> Shape<3>::mesh() const;
template JOSTLE_API std::optional<HeightField> Shape<3>::height_field() const;
template JOSTLE_API std::optional<Compound<2>> Shape<2>::compound() const;
template JOSTLE_API std::optional<Compound<3>> Shape<3>::compound() const;

JOSTLE_NAMESPACE_END
