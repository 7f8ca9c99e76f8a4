// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>

#include "base/block_buffer_access.hpp"
#include "base/checks.hpp"
#include "base/in_use.hpp"
#include "base/number_text.hpp"
#include "jostle/process.hpp"
#include "jostle/surface.hpp"
#include "pairs/pair_finder_access.hpp"
#include "surfaces/kernels/kernels.hpp"
#include "surfaces/parts.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

using narrow::Vec3;
using surfaces::Kind;

/// What coordinates, distances and thicknesses may be: the greatest float leaves room for their sums.
constexpr double furthest = 1e30;

/// How many pairs kernels take at once.
constexpr std::uint32_t some_pairs = surfaces::PartBatch::size;
/// Of pairs that are decided in doubles: enough to keep the kernels' lanes filled, few enough to share out.
constexpr std::uint32_t pairs_in_block = 512;

template <class T>
Vec3 as_double(const Vec<3, T>& v)
{
    return {double{v[0]}, double{v[1]}, double{v[2]}};
}

/// The vertices of both parts of a pair, in their order.
using Vertices = std::array<std::uint32_t, 4>;
Vertices vertices_of(Kind kind, const Surface& surface, const Pair& pair)
{
    if (kind == Kind::vertex_triangle) {
        const Surface::Triangle& triangle = surface.triangles()[pair.b];
        return {pair.a, triangle[0], triangle[1], triangle[2]};
    }
    const Surface::Edge &a = surface.edges()[pair.a], &b = surface.edges()[pair.b];
    return {a[0], a[1], b[0], b[1]};
}
/// How many of these are the first part's.
std::size_t of_first(Kind kind)
{
    return kind == Kind::vertex_triangle ? 1 : 2;
}
bool share_a_vertex(Kind kind, const Vertices& v)
{
    bool some = v[0] == v[2];
    some |= v[0] == v[3];
    some |= kind == Kind::vertex_triangle ? v[0] == v[1] : v[1] == v[2];
    some |= kind == Kind::edge_edge && v[1] == v[3];
    return some;
}

/// Where a pair's vertices are, one by one.
template <class T, std::size_t N>
auto places_of(const std::array<std::uint32_t, N>& vertices, std::span<const Vec<3, T>> positions)
{
    return [&vertices, positions](std::size_t k) -> const Vec<3, T>& { return positions[vertices[k]]; };
}

/// The box around some vertices and, with `to`, around where they move to; grown on all sides by `grown` and
/// a part of its longest side, outwards where that rounds.
template <class T, std::size_t N>
Aabb<3, T> box_around(const std::array<std::uint32_t, N>& vertices, std::span<const Vec<3, T>> positions,
                      std::span<const Vec<3, T>> to, T grown, T part)
{
    Aabb<3, T> box{positions[vertices[0]], positions[vertices[0]]};
    for (const std::uint32_t vertex : vertices) {
        box = {min(box.lo, positions[vertex]), max(box.hi, positions[vertex])};
        if (!to.empty()) box = {min(box.lo, to[vertex]), max(box.hi, to[vertex])};
    }
    if (part != 0)
        grown += part * std::max({box.hi[0] - box.lo[0], box.hi[1] - box.lo[1], box.hi[2] - box.lo[2]});
    if (grown == 0) return box;
    for (int d = 0; d < 3; ++d) {
        const T spare = std::max({std::abs(box.lo[d]), std::abs(box.hi[d]), grown}) *
                        (4 * std::numeric_limits<T>::epsilon());
        box.lo[d] = box.lo[d] - grown - spare;
        box.hi[d] = box.hi[d] + grown + spare;
    }
    return box;
}

template <class T>
void check_positions(std::span<const Vec<3, T>> positions, std::size_t vertices, const char* name)
{
    if (positions.size() != vertices)
        throw Error(ErrorCode::size_mismatch, std::string("there are ") + std::to_string(positions.size()) +
                                                  " " + name + " and " + std::to_string(vertices) +
                                                  " vertices; give one for each");
    for (std::size_t k = 0; k < vertices; ++k)
        for (int d = 0; d < 3; ++d)
            if (!(std::abs(positions[k][d]) <= T(furthest)))
                throw Error(ErrorCode::invalid_argument,
                            std::string("vertex ") + std::to_string(k) + " of " + name + " has " +
                                number_text(double{positions[k][d]}) +
                                "; give finite coordinates within 1e30",
                            k);
}
template <class T>
void check_distance(T distance, const char* name, std::uint64_t index = Error::no_index)
{
    if (!(distance >= 0 && distance <= T(furthest)))
        throw Error(ErrorCode::invalid_argument,
                    std::string("the ") + name +
                        (index == Error::no_index ? "" : " of vertex " + std::to_string(index)) + " is " +
                        number_text(double{distance}) + "; give a length from 0 to 1e30",
                    index);
}

} // namespace

template <Coordinate T>
struct SurfaceFinder<T>::Implementation
{
    explicit Implementation(const FinderOptions& given)
        : options(given),
          finder(given),
          kernels(surfaces::kernels_for(given.instruction_set)),
          pairs(given.memory),
          made(given.memory),
          boxes_a(given.memory),
          boxes_b(given.memory),
          near{BlockBuffer<NearParts<T>>(given.memory), BlockBuffer<NearParts<T>>(given.memory)},
          moving{BlockBuffer<PartImpact<T>>(given.memory), BlockBuffer<PartImpact<T>>(given.memory), T(1)},
          crossings(given.memory)
    {
    }

    /// One call: what it searches, and where.
    struct Search
    {
        const Surface& surface;
        Positions positions, to; ///< `to` is empty where nothing moves
        T distance;
        const Options& options;

        [[nodiscard]] T thickness(std::span<const std::uint32_t> part) const
        {
            T most = 0;
            if (!options.thickness.empty())
                for (const std::uint32_t vertex : part)
                    most = std::max(most, options.thickness[vertex]);
            return most;
        }
        /// Within which a pair counts.
        [[nodiscard]] double reach(Kind kind, const Vertices& vertices) const
        {
            const std::span<const std::uint32_t> all(vertices);
            const std::size_t n = of_first(kind);
            return double{distance} + double{thickness(all.first(n))} + double{thickness(all.subspan(n))};
        }
        /// Whether vertices and bodies leave the pair in.
        [[nodiscard]] bool may_meet(Kind kind, const Vertices& vertices) const
        {
            bool may = !share_a_vertex(kind, vertices);
            if (!options.bodies.empty())
                may &= options.bodies[vertices[0]] != options.bodies[vertices[of_first(kind)]];
            return may;
        }
        [[nodiscard]] bool accepted(Kind kind, const Pair& pair) const
        {
            const auto& accept =
                kind == Kind::vertex_triangle ? options.accept_vertex_triangle : options.accept_edge_edge;
            return !accept || accept(pair.a, pair.b);
        }
    };

    void check(const Search& search) const
    {
        const std::size_t vertices = search.surface.vertices();
        check_positions(search.positions, vertices, "positions");
        check_distance(search.distance, "distance");
        const Options& given = search.options;
        if (!given.thickness.empty() && given.thickness.size() != vertices)
            refuse_size("thicknesses", given.thickness.size(), vertices);
        for (std::size_t k = 0; k < given.thickness.size(); ++k)
            check_distance(given.thickness[k], "thickness", k);
        if (!given.rest.empty()) check_positions(given.rest, vertices, "positions at rest");
        if (!given.bodies.empty() && given.bodies.size() != vertices)
            refuse_size("bodies", given.bodies.size(), vertices);
        if (!(given.tolerance > 0 && given.tolerance <= 1))
            throw Error(ErrorCode::invalid_argument,
                        "the tolerance is " + number_text(given.tolerance) + "; give one above 0, up to 1");
    }
    [[noreturn]] static void refuse_size(const char* what, std::size_t given, std::size_t vertices)
    {
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(given) + " " + what + " and " +
                                                  std::to_string(vertices) + " vertices; give one for each");
    }

    [[nodiscard]] ProcessOptions work() const { return {options.executor, 0}; }

    /// The boxes of some parts, each grown by `grown`, its thickness, and a part of its longest side.
    template <class Parts>
    void put_boxes(const Search& search, const Parts& parts, T grown, std::pmr::vector<Aabb<3, T>>& boxes,
                   T part = 0)
    {
        boxes.resize(parts.size());
        process_items(
            parts.size(),
            [&](std::uint64_t begin, std::uint64_t end, Work) {
                for (std::uint64_t k = begin; k < end; ++k) {
                    const auto vertices = vertices_of_part(parts[k]);
                    boxes[k] = box_around(vertices, search.positions, search.to,
                                          grown + search.thickness(vertices), part);
                }
            },
            work());
    }
    static std::array<std::uint32_t, 1> vertices_of_part(std::uint32_t vertex) { return {vertex}; }
    template <std::size_t N>
    static const std::array<std::uint32_t, N>& vertices_of_part(const std::array<std::uint32_t, N>& part)
    {
        return part;
    }

    /// Moves the pairs that are to stay to the front, and returns their end. put(k, pair) stores a pair as
    /// number k, or returns false if it doesn't count. leave_out(count) has a bit for each stored pair that
    /// goes. A branch that depends on a pair would be mispredicted half the time, so each pair is stored, and
    /// the next one overwrites it if it doesn't count.
    template <class Put, class LeaveOut>
    static Pair* keep(Pair* first, Pair* last, const Put& put, const LeaveOut& leave_out)
    {
        std::array<Pair, some_pairs> pair;
        Pair* kept = first;
        while (first != last) {
            std::uint32_t count = 0;
            for (; first != last && count < some_pairs; ++first) {
                Pair one = *first; // read back from its place, it would wait for the count of those before
                const bool counts = put(count, one);
                pair[count] = one;
                count += counts ? 1 : 0;
            }
            const std::uint64_t out = leave_out(count);
            for (std::uint32_t k = 0; k < count; ++k) {
                *kept = pair[k];
                kept += 1 - (out >> k & 1);
            }
        }
        return kept;
    }
    /// Those that vertices and bodies leave in and that may be near.
    template <Kind kind>
    Pair* keep_near(const Search& search, Pair* first, Pair* last) const
    {
        const Surface& surface = search.surface;
        const bool moves = !search.to.empty();
        surfaces::PartBatch batch{};
        std::array<Vertices, some_pairs> vertices;
        std::fill_n(batch.reach, some_pairs, static_cast<float>(search.distance));
        const auto put = [&](std::uint32_t k, Pair& pair) {
            if constexpr (kind == Kind::vertex_triangle) pair.a = surface.points()[pair.a];
            const Vertices of_pair = vertices_of(kind, surface, pair);
            vertices[k] = of_pair;
            return search.may_meet(kind, of_pair);
        };
        return keep(first, last, put, [&](std::uint32_t count) {
            for (std::uint32_t k = 0; k < count; ++k) {
                surfaces::put_legs(batch.from, k, places_of(vertices[k], search.positions));
                if (moves) surfaces::put_legs(batch.to, k, places_of(vertices[k], search.to));
            }
            if (!search.options.thickness.empty())
                for (std::uint32_t k = 0; k < count; ++k)
                    batch.reach[k] = static_cast<float>(search.reach(kind, vertices[k]));
            const surfaces::PartKernels::OfKind& tell = kernels.of(kind);
            return (moves ? tell.moving_apart : tell.apart)(batch, count);
        });
    }

    /// Into `pairs`: those whose boxes touch, that vertices and bodies leave in, and that may be near.
    void find(const Search& search, Kind kind)
    {
        const Surface& surface = search.surface;
        const auto select = [&](Pair* first, Pair* last) {
            return kind == Kind::vertex_triangle ? keep_near<Kind::vertex_triangle>(search, first, last)
                                                 : keep_near<Kind::edge_edge>(search, first, last);
        };
        if (kind == Kind::vertex_triangle) {
            put_boxes(search, surface.points(), search.distance, boxes_a);
            put_boxes(search, surface.triangles(), T(0), boxes_b);
            PairFinderAccess::find(finder, box_view(boxes_a), box_view(boxes_b), select, pairs);
        } else {
            put_boxes(search, surface.edges(), search.distance / 2, boxes_a);
            PairFinderAccess::find(finder, box_view(boxes_a), select, pairs);
        }
    }
    /// Puts the items of all pairs in their order: make(run, to) writes those of a run of pairs, none or one
    /// of each, and returns their end.
    template <class Item, class Make>
    void make_all(BlockBuffer<Item>& into, const Make& make)
    {
        BlockBufferAccess access(into);
        const std::size_t count = pairs.size();
        const ProcessOptions in_blocks{options.executor, pairs_in_block};
        const WorkPlan plan = plan_work(count, in_blocks);
        access.reserve_chunks(1);
        access.reserve_blocks(plan.blocks);
        const std::span<Item> items =
            access.chunk(0, count <= access.capacity(0) ? count : count + count / 4 + 64).first(count);
        made.assign(plan.blocks, 0);
        process_pairs(
            pairs,
            [&](const PairBatch& batch) {
                Item* const first = items.data() + batch.work.block * plan.block_items;
                std::uint64_t& of_block = made[batch.work.block];
                of_block = static_cast<std::uint64_t>(make(batch.items, first + of_block) - first);
            },
            in_blocks);
        for (std::uint32_t block = 0; block < plan.blocks; ++block)
            access.append(items.subspan(block * plan.block_items, made[block]));
    }

    /// Some pairs that may be near, and their places.
    struct Some
    {
        Some(const Search& of, Kind all) : search(of), kind(all) {}

        void put(std::span<const Pair> some)
        {
            given = some;
            for (std::uint32_t k = 0; k < given.size(); ++k) {
                vertices[k] = vertices_of(kind, search.surface, given[k]);
                surfaces::put_places(places.from, k, places_of(vertices[k], search.positions));
                if (!search.to.empty()) surfaces::put_places(places.to, k, places_of(vertices[k], search.to));
                places.reach[k] = search.reach(kind, vertices[k]);
            }
        }
        [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(given.size()); }
        /// Ends the use of their places: each pair is near at rest if its distance is within its reach.
        void put_at_rest(const surfaces::PartKernels& kernels)
        {
            if (search.options.rest.empty()) return;
            for (std::uint32_t k = 0; k < count(); ++k)
                surfaces::put_places(places.from, k, places_of(vertices[k], search.options.rest));
            kernels.of(kind).distances(places, count(), at_rest);
        }
        /// Of a pair that is near.
        [[nodiscard]] bool counts(std::uint32_t k) const
        {
            return (search.options.rest.empty() || !(at_rest.distance[k] <= places.reach[k])) &&
                   search.accepted(kind, given[k]);
        }

        const Search& search;
        Kind kind;
        std::span<const Pair> given;
        std::array<Vertices, surfaces::PlaceBatch::size> vertices;
        surfaces::PlaceBatch places{};
        surfaces::PartDistances at_rest;
    };
    /// Calls work(some) for some pairs of a run after others.
    template <class Work>
    static void each_some(const Search& search, Kind kind, std::span<const Pair> run, const Work& work)
    {
        for (Some some(search, kind); !run.empty(); run = run.subspan(some.given.size())) {
            some.put(run.first(std::min<std::size_t>(run.size(), surfaces::PlaceBatch::size)));
            work(some);
        }
    }

    void find_near(const Search& search, Kind kind, BlockBuffer<NearParts<T>>& into)
    {
        find(search, kind);
        make_all(into, [&](std::span<const Pair> run, NearParts<T>* to) {
            surfaces::PartDistances found;
            each_some(search, kind, run, [&](Some& some) {
                kernels.of(kind).distances(some.places, some.count(), found);
                some.put_at_rest(kernels);
                for (std::uint32_t k = 0; k < some.count(); ++k) {
                    if (!(found.distance[k] <= some.places.reach[k]) || !some.counts(k)) continue;
                    NearParts<T>& item = *to++;
                    item = {some.given[k].a, some.given[k].b, some.vertices[k], {}, {}, T(found.distance[k])};
                    for (std::size_t i = 0; i < 4; ++i)
                        item.weights[i] = T(found.weight[i][k]);
                    for (std::size_t d = 0; d < 3; ++d)
                        item.normal[d] = T(found.normal[d][k]);
                }
            });
            return to;
        });
    }
    void find_moving(const Search& search, Kind kind, BlockBuffer<PartImpact<T>>& into)
    {
        find(search, kind);
        make_all(into, [&](std::span<const Pair> run, PartImpact<T>* to) {
            double times[surfaces::PlaceBatch::size];
            each_some(search, kind, run, [&](Some& some) {
                kernels.of(kind).impacts(some.places, some.count(), search.options.tolerance, times);
                some.put_at_rest(kernels);
                for (std::uint32_t k = 0; k < some.count(); ++k) {
                    if (times[k] > 1 || !some.counts(k)) continue;
                    T rounded = T(times[k]);
                    if (double{rounded} > times[k]) rounded = std::nextafter(rounded, T(0));
                    *to++ = {some.given[k].a, some.given[k].b, some.vertices[k], rounded};
                }
            });
            return to;
        });
    }
    void find_crossings(const Search& search);

    FinderOptions options;
    PairFinder finder;
    const surfaces::PartKernels& kernels;
    PairBuffer pairs;
    std::pmr::vector<std::uint64_t> made; ///< how many items of each block of pairs
    std::pmr::vector<Aabb<3, T>> boxes_a, boxes_b;
    NearSurface<T> near;
    MovingSurface<T> moving;
    BlockBuffer<Crossing> crossings;
    std::atomic<bool> in_use{false};
};

/// Coordinates are first multiplied by a power of two, if need be, so that those of a part of a float's or
/// double's range are exact: see orientation.hpp.
template <Coordinate T>
void SurfaceFinder<T>::Implementation::find_crossings(const Search& search)
{
    double most = 0;
    for (const Vec<3, T>& position : search.positions)
        for (const T x : position)
            most = std::max(most, std::abs(double{x}));
    const int power = most >= 0x1p59 ? 58 - std::ilogb(most) : 0;
    const auto place = [&](std::uint32_t vertex) {
        const Vec3 v = as_double(search.positions[vertex]);
        return power == 0 ? v : Vec3{std::ldexp(v.x, power), std::ldexp(v.y, power), std::ldexp(v.z, power)};
    };
    const Surface& surface = search.surface;
    const std::span<const std::uint32_t> bodies = search.options.bodies;
    const auto select = [&](Pair* first, Pair* last) {
        surfaces::CrossingBatch batch{};
        std::array<std::array<std::uint32_t, 5>, some_pairs> vertices;
        const auto put = [&](std::uint32_t k, const Pair& pair) {
            const Surface::Edge& edge = surface.edges()[pair.a];
            const Surface::Triangle& corner = surface.triangles()[pair.b];
            vertices[k] = {edge[0], edge[1], corner[0], corner[1], corner[2]};
            bool may = bodies.empty() || bodies[edge[0]] != bodies[corner[0]];
            for (const std::uint32_t end : edge)
                for (const std::uint32_t other : corner)
                    may &= end != other;
            return may;
        };
        return keep(first, last, put, [&](std::uint32_t count) {
            for (std::uint32_t k = 0; k < count; ++k)
                surfaces::put_legs(batch.legs, k, places_of(vertices[k], search.positions));
            std::uint64_t out = kernels.uncrossed(batch, count);
            for (std::uint32_t k = 0; k < count; ++k) {
                if ((out >> k & 1) != 0) continue;
                const auto& [p, q, a, b, c] = vertices[k];
                if (!surfaces::crosses(place(p), place(q), {place(a), place(b), place(c)}))
                    out |= std::uint64_t{1} << k;
            }
            return out;
        });
    };
    // Neighbours' boxes have a vertex in common, at which they often do no more than touch. Whether boxes
    // touch or are just apart is the dearest question to the search; so they overlap a little, and it needn't
    // ask.
    put_boxes(search, surface.edges(), T(0), boxes_a, T(1) / 512);
    put_boxes(search, surface.triangles(), T(0), boxes_b);
    PairFinderAccess::find(finder, box_view(boxes_a), box_view(boxes_b), select, pairs);
    make_all(crossings, [](std::span<const Pair> run, Crossing* to) {
        for (const Pair& pair : run)
            *to++ = {pair.a, pair.b};
        return to;
    });
}

template <Coordinate T>
SurfaceFinder<T>::SurfaceFinder(const FinderOptions& options)
    : implementation_((check_memory(options.memory), std::make_unique<Implementation>(options)))
{
}
template <Coordinate T>
SurfaceFinder<T>::SurfaceFinder(SurfaceFinder&&) noexcept = default;
template <Coordinate T>
SurfaceFinder<T>& SurfaceFinder<T>::operator=(SurfaceFinder&&) noexcept = default;
template <Coordinate T>
SurfaceFinder<T>::~SurfaceFinder() = default;

namespace {

template <class T>
void clear(NearSurface<T>& result)
{
    result.vertex_triangle.clear();
    result.edge_edge.clear();
}
template <class T>
void clear(MovingSurface<T>& result)
{
    result.vertex_triangle.clear();
    result.edge_edge.clear();
    result.safe_step = 1;
}
void clear(BlockBuffer<Crossing>& result)
{
    result.clear();
}

/// Runs a search of `finder`, an Implementation, for `result`, which is empty after an exception.
template <class Implementation, class Result, class Search>
const Result& run_search(Implementation& finder, Result& result, const Search& search)
{
    const InUse call(finder.in_use, "SurfaceFinder");
    clear(result);
    try {
        search();
    } catch (...) {
        clear(result);
        throw;
    }
    return result;
}

} // namespace

template <Coordinate T>
const NearSurface<T>& SurfaceFinder<T>::near(const Surface& surface, Positions positions, T distance,
                                             const Options& options) &
{
    Implementation& my = *implementation_;
    return run_search(my, my.near, [&] {
        const typename Implementation::Search search{surface, positions, {}, distance, options};
        my.check(search);
        my.find_near(search, Kind::vertex_triangle, my.near.vertex_triangle);
        my.find_near(search, Kind::edge_edge, my.near.edge_edge);
    });
}

template <Coordinate T>
const MovingSurface<T>& SurfaceFinder<T>::moving(const Surface& surface, Positions from, Positions to,
                                                 T distance, const Options& options) &
{
    Implementation& my = *implementation_;
    return run_search(my, my.moving, [&] {
        const typename Implementation::Search search{surface, from, to, distance, options};
        my.check(search);
        check_positions(to, surface.vertices(), "positions to move to");
        my.find_moving(search, Kind::vertex_triangle, my.moving.vertex_triangle);
        my.find_moving(search, Kind::edge_edge, my.moving.edge_edge);
        for (const auto* found : {&my.moving.vertex_triangle, &my.moving.edge_edge})
            for (const PartImpact<T>& impact : *found)
                my.moving.safe_step = std::min(my.moving.safe_step, impact.time);
    });
}

template <Coordinate T>
const BlockBuffer<Crossing>& SurfaceFinder<T>::crossings(const Surface& surface, Positions positions,
                                                         const Options& options) &
{
    Implementation& my = *implementation_;
    return run_search(my, my.crossings, [&] {
        const typename Implementation::Search search{surface, positions, {}, T(0), options};
        my.check(search);
        my.find_crossings(search);
    });
}

template <Coordinate T>
void SurfaceFinder<T>::release_memory() noexcept
{
    Implementation& my = *implementation_;
    my.near.vertex_triangle.release();
    my.near.edge_edge.release();
    my.moving.vertex_triangle.release();
    my.moving.edge_edge.release();
    my.crossings.release();
    my.pairs.release();
    my.made.clear();
    my.made.shrink_to_fit();
    for (std::pmr::vector<Aabb<3, T>>* const boxes : {&my.boxes_a, &my.boxes_b}) {
        boxes->clear();
        boxes->shrink_to_fit();
    }
    my.finder.release_memory();
}

template class SurfaceFinder<float>;
template class SurfaceFinder<double>;

JOSTLE_NAMESPACE_END
