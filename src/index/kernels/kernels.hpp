// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <span>

#include "base/buffer.hpp"
#include "base/prefetch.hpp"
#include "index/nodes/groups.hpp"
#include "index/nodes/key.hpp"
#include "index/nodes/listing.hpp"
#include "index/nodes/queue.hpp"
#include "index/nodes/two.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/query.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {

/// Tells whether an object counts; null if all do.
using Wanted = FunctionRef<bool(std::uint32_t id)>;
// Visitors, as in Queries.
using IdVisitor = FunctionRef<bool(std::uint32_t id)>;
template <class T>
using HitVisitor = FunctionRef<bool(const Hit<T>& hit, T& bound)>;
using PairVisitor = FunctionRef<bool(std::uint32_t a, std::uint32_t b)>;
template <class T>
using PairHitVisitor = FunctionRef<bool(const PairHit<T>& hit, T& bound)>;

/// Where a search stores its results, in any order.
template <class Item>
struct Found
{
    static constexpr std::uint32_t capacity = 256;
    Item* next = items;
    bool one_will_do = false;
    /// Called when fewer than 16 more fit. Makes room.
    void (*full)(Found& self) = nullptr;
    union
    {
        Item items[capacity]; // not worth initialising
    };

    Found() noexcept {}
    [[nodiscard]] bool has_room() const noexcept
    {
        return static_cast<std::size_t>(items + capacity - next) >= lanes;
    }
};

/// A ray or a sweep in the form for the kernels.
template <int Dim, class T>
struct Line
{
    T lo[Dim], hi[Dim]; // the moving box at the start
    T inverse[Dim];     // 0 on an axis without motion
    T max_fraction;

    explicit Line(const Sweep<Dim, T>& sweep) noexcept : max_fraction(sweep.max_fraction)
    {
        for (int d = 0; d < Dim; ++d) {
            lo[d] = sweep.box.lo[d];
            hi[d] = sweep.box.hi[d];
            inverse[d] = T(1) / sweep.motion[d];
            if (!(inverse[d] >= -std::numeric_limits<T>::max() &&
                  inverse[d] <= std::numeric_limits<T>::max()))
                inverse[d] = 0;
        }
    }
    explicit Line(const Ray<Dim, T>& ray) noexcept
        : Line(Sweep<Dim, T>{{ray.origin, ray.origin}, ray.direction, ray.max_fraction})
    {
    }
};

/// One box of a batch, by its number, and an object that it touches.
struct Touch
{
    std::uint32_t asker;
    std::uint32_t id;
};
/// The same by the object's place.
template <int Dim, class T>
struct TouchAt
{
    std::uint32_t asker, lane;
    const Leaf<Dim, T>* leaf;
};

/// An object that a box touches.
template <int Dim, class T>
struct Seen
{
    Aabb<Dim, T> box;
    std::uint32_t id;
};

/// Working memory and results of a batch of boxes.
template <int Dim, class T>
struct JoinWork
{
    static constexpr std::uint32_t most_askers = 128;
    struct Visit
    {
        Child<Dim, T> child;
        std::uint32_t asker;
    };
    Buffer<Visit> nodes, next, leaves;
    Buffer<Touch> touches;
    Buffer<TouchAt<Dim, T>> touches_at;
    Buffer<Seen<Dim, T>> seen;        // by asker
    Buffer<std::uint32_t> ids;        // those of the first asker, ascending, then those of the second, ...
    std::size_t touched = 0;          // how many
    std::uint32_t count[most_askers]; // of each asker

    explicit JoinWork(std::pmr::memory_resource* memory)
        : nodes(memory),
          next(memory),
          leaves(memory),
          touches(memory),
          touches_at(memory),
          seen(memory),
          ids(memory)
    {
    }
    [[nodiscard]] std::uint64_t bytes() const noexcept
    {
        return nodes.bytes() + next.bytes() + leaves.bytes() + touches.bytes() + touches_at.bytes() +
               seen.bytes() + ids.bytes();
    }
};

/// The k best results of a search so far: a heap with the worst on top.
template <class T>
struct Best
{
    Hit<T>* heap;
    std::uint32_t size, wanted;
    T limit;
};

/// How many numbers sort_few takes. It pays for up to half as many ids.
inline constexpr std::uint32_t most_sorted = lanes * lanes;

/// The searches of one instruction set. All sets find the same results.
template <int Dim, class T>
struct Kernels
{
    using Root = Child<Dim, T>;
    void (*box)(Root root, const Aabb<Dim, T>& region, Wanted wanted, Found<std::uint32_t>& out);
    void (*sphere)(Root root, const Sphere<Dim, T>& region, Wanted wanted, Found<std::uint32_t>& out);
    void (*frustum)(Root root, const Frustum<Dim, T>& region, Wanted wanted, Found<std::uint32_t>& out);
    /// For at most JoinWork::most_askers boxes.
    void (*join)(Root root, const Aabb<Dim, T>* askers, std::uint32_t count, JoinWork<Dim, T>& work);
    /// The same, with the objects' boxes, unordered for each asker, in `seen` instead of `ids`.
    void (*around)(Root root, const Aabb<Dim, T>* askers, std::uint32_t count, JoinWork<Dim, T>& work);
    /// Writes (asker, id) for everything that the boxes touch, by lookup, then in the order of the listings,
    /// and returns their number. If measures are equal, `decide` decides. Needs room for `lanes` pairs per
    /// listing.
    std::size_t (*look_up)(const Lookup<Dim>* lookups, std::size_t count,
                           FunctionRef<bool(std::uint32_t asker, std::uint32_t id)> decide, Pair* out);
    Hit<T> (*first)(Root root, const Line<Dim, T>& line, Wanted wanted);
    void (*all)(Root root, const Line<Dim, T>& line, Wanted wanted, Found<Hit<T>>& out);
    void (*nearest)(Root root, const Aabb<Dim, T>& from, Wanted wanted, Best<T>& best);
    // Visit what is found below all the roots, ascending by (at, id), no further than `limit`, which the
    // visitor may lower. Return false if the visitor stopped them.
    bool (*visit_line)(std::span<const Root> roots, const Line<Dim, T>& line, Wanted wanted,
                       HitVisitor<T> visit, QueueShelf<Dim, T>& shelf);
    bool (*visit_near)(std::span<const Root> roots, const Aabb<Dim, T>& from, T limit, Wanted wanted,
                       HitVisitor<T> visit, QueueShelf<Dim, T>& shelf);
    // Pairs between the two of each of `roots`. The first two visit those that touch, and those whose squared
    // distance is 0, and return false if the visitor stopped them.
    bool (*pairs)(std::span<const Roots<Dim, T>> roots, PairVisitor visit);
    bool (*pairs_at_zero)(std::span<const Roots<Dim, T>> roots, PairVisitor visit);
    /// Finds the closest pairs that are apart.
    void (*closest)(std::span<const Roots<Dim, T>> roots, ClosestAsked<T> asked, ClosestWork<Dim, T>& work);
    /// Sorts at most `few` distinct numbers, ascending.
    void (*sort_few)(std::uint32_t* numbers, std::uint32_t count);
    /// Puts objects into leaves of nearby objects, and the leaves' bounds into `hulls`. Objects are halved by
    /// the median along the axis on which their centres are spread the widest, and so on, so that all leaves
    /// except the last are full.
    void (*arrange)(const Gathered<Dim, T>& objects, Leaf<Dim, T>* const* leaves, Bounds<Dim, T>& hulls);
    /// Makes the entries of the boxes [first, last), with the digits in which they differ if all are about
    /// where they were expected, within twice `Frame::world_quanta`. Returns whether they are; otherwise the
    /// entries are useless.
    bool (*make_entries)(const Frame<Dim>& frame, const BoxView<Dim, T>& boxes, std::size_t first,
                         std::size_t last, KeyEntry* entries);
};

/// For one of supported_instruction_sets().
template <int Dim, class T>
const Kernels<Dim, T>& kernels_for(InstructionSet set) noexcept;

} // namespace index
JOSTLE_NAMESPACE_END
