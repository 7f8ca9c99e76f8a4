// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <iterator>
#include <memory>
#include <memory_resource>
#include <new>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "jostle/block_buffer.hpp"
#include "jostle/box.hpp"
#include "jostle/cast.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/objects.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/shapes.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

/// One point of a contact: the middle between the two surfaces, seen from both objects.
template <int Dim, Coordinate T>
struct ContactPoint
{
    /// From the position of a's pose to the point, in world axes: what a solver calls r. In world coordinates
    /// the point is pose_a.position + from_a. Relative, so that nothing is lost far from the origin.
    Vec<Dim, T> from_a;
    Vec<Dim, T> from_b;
    /// How far the surfaces overlap along the normal; below 0 is a gap, no wider than the margin asked for.
    T depth;
    /// Which features meet: a's in the low 16 bits, b's in the high 16. The same from frame to frame while
    /// the same vertices, edges and faces meet; a solver matches points by pair, child of a compound and
    /// feature (with ContactOptions::all_points by pair, parts and feature). Of a hull of more than about
    /// 5000 corners two features may have the same number, and of a surface two that don't touch.
    std::uint32_t feature;
};

/// Where two objects touch: a normal and up to 4 points (2 in 2D) that span the region. No two points are the
/// same but by rounding, which may bring two very close to each other, or together.
///
/// Convex shapes have one contact a pair; with a compound a pair has one for each pair of parts that touch.
/// Two meshes, or a mesh and a height field, have one for each two triangles that touch. Any other body (a
/// shape, or one child of a compound) has with a mesh or height field one for each direction: the deepest
/// gives its normal to all that differ from it by up to 5 degrees (the cosine is at least 0.996), then the
/// deepest of the others, and so on. Of their points it has the deepest, the one furthest from it, and those
/// furthest from the line and outside of the triangle of these; each with the depth along its own triangle's
/// normal. ContactOptions::all_points gives a contact for each triangle instead.
template <int Dim, Coordinate T>
struct Contact
{
    static constexpr std::uint32_t max_points = Dim == 3 ? 4 : 2;

    Pair pair;                ///< as given
    std::uint32_t part_a = 0; ///< triangle, segment or child; 0 for shapes without parts
    std::uint32_t part_b = 0; ///< of several triangles the deepest, which may be another one a frame later
    Vec<Dim, T> normal;       ///< unit, from a to b: the direction to move b out of a
    std::uint32_t count = 0;
    std::array<ContactPoint<Dim, T>, max_points> point; ///< the first `count` are filled; deepest first
};

/// All contacts of one call, in the order of the pairs given; contacts of one pair by ascending
/// (part_a, part_b).
template <int Dim, Coordinate T>
using ContactBuffer = BlockBuffer<Contact<Dim, T>>;

/// The deepest point of a contact, without the others. With floats in 3D it takes 60 bytes, a Contact 160. It
/// is for balls, which have only one point, and for programs that need no more.
template <int Dim, Coordinate T>
struct PointContact
{
    Pair pair;                ///< as given
    std::uint32_t part_a = 0; ///< as in Contact
    std::uint32_t part_b = 0;
    Vec<Dim, T> normal; ///< unit, from a to b
    Vec<Dim, T> from_a; ///< as in ContactPoint
    Vec<Dim, T> from_b;
    T depth;
    std::uint32_t feature;
};

/// In the order of the pairs given, as a ContactBuffer.
template <int Dim, Coordinate T>
using PointContactBuffer = BlockBuffer<PointContact<Dim, T>>;

/// The signed distance of two objects and the points that have it.
template <int Dim, Coordinate T>
struct Distance
{
    T distance;         ///< below 0 where they overlap: by the least motion that separates them
    Vec<Dim, T> normal; ///< unit, from a to b
    Vec<Dim, T> from_a; ///< to the point on a's surface, from the position of a's pose, in world axes
    Vec<Dim, T> from_b; ///< to the point on b's surface, from the position of b's pose
};

/// Stands for no pair where a pair's number is given.
inline constexpr std::uint64_t no_pair = ~std::uint64_t{0};

/// When and where two moving objects first touch.
template <int Dim, Coordinate T>
struct Impact
{
    T time;             ///< 0: they touch at the start
    Vec<Dim, T> normal; ///< unit, from a to b, at that time
    Vec<Dim, T> from_a; ///< from a's position at that time
    Vec<Dim, T> from_b;
};

/// What a user's own test is given; everything in double, whatever the poses are stored in.
template <int Dim>
struct PairTestInput
{
    const Shape<Dim>& shape_a;
    const Pose<Dim, double>& pose_a; ///< position counted from a's: zero
    const Shape<Dim>& shape_b;
    const Pose<Dim, double>& pose_b; ///< position counted from a's
    double margin;                   ///< contacts with a gap of up to this much are wanted
};

/// A user's own test for the shapes of two types, built-in ones included. It replaces the library's.
///
/// `test` gets a of type_a and b of type_b, whichever way round the pair is, and calls `emit` for each
/// contact (its `pair` is filled in by the library).
/// Threads  called from several threads at a time; must not throw. Its answer must depend on the input alone.
template <int Dim>
struct PairTest
{
    using Emit = FunctionRef<void(const Contact<Dim, double>&)>;
    ShapeType type_a, type_b;
    void (*test)(void* context, const PairTestInput<Dim>& input, Emit emit);
    void* context = nullptr;
};

using Contact2f = Contact<2, float>;
using Contact3f = Contact<3, float>;
using Distance3f = Distance<3, float>;
using Impact3f = Impact<3, float>;

struct ContactOptions
{
    /// Null means default_executor(). It must outlive the finder.
    Executor* executor = nullptr;
    /// Where working memory and results come from. Used from several threads at a time: give a synchronised
    /// resource.
    std::pmr::memory_resource* memory = std::pmr::get_default_resource();
    /// One of supported_instruction_sets(), or the constructor refuses it; for tests and measurements.
    InstructionSet instruction_set = supported_instruction_sets().front();
    /// A body has with a mesh or height field a contact for each triangle or segment that touches, with all
    /// of its points: for programs that need each triangle's own. Otherwise those whose normals are within 5
    /// degrees are one, see Contact.
    bool all_points = false;
};

/// Finds where the objects of pairs touch: the detailed test behind a broad phase.
///
/// Objects come as {shapes, poses}, with one element per object. Pairs name objects by position and may come
/// in any order, also with b < a; no object may be paired with itself. Each search has a form for pairs
/// between two sets: a is of the first, b of the second.
///
/// Touching  shapes are closed: those that share a point touch, with depth >= 0 up to rounding. Everything is
///           computed in double, relative to one of the two objects.
/// Order     results are in the order of the pairs. They are the same bits for any number of threads,
///           instruction set and compiler. Giving a pair the other way round swaps a and b and negates the
///           normal (but for two objects in the same pose that can't be told apart: by their shapes, or as
///           custom shapes of one type and radius).
/// Threads   one call at a time per finder; a second one, also one out of a callback, is an `Error`.
/// Cost      grows with the pairs, however many objects there are; see docs/guide/contacts.md. Working memory
///           is kept; steady frames allocate nothing, but for pairs of which hundreds of parts or corners are
///           near each other.
/// Errors    `Error` for a pair that names no object, or one object twice; for an object in a pair whose pose
///           has a number that is not finite or beyond 1e60, or a rotation of zero (objects in no pair aren't
///           looked at). Of several such pairs the error names the first. size_mismatch where shapes and
///           poses differ in number; invalid_argument for a negative or infinite margin. `std::bad_alloc`.
///           After an error the result is empty, and some elements of `out` may have been set.
/// Source    docs/guide/contacts.md.
template <int Dim, Coordinate T>
class JOSTLE_API ContactFinder
{
  public:
    explicit ContactFinder(const ContactOptions& options = {});
    ContactFinder(ContactFinder&&) noexcept;
    ContactFinder& operator=(ContactFinder&&) noexcept;
    ~ContactFinder();

    /// Adds a user's own test, for find() and touching() from now on. It replaces one for the same types.
    /// distances() and impacts() go by the shapes, which for custom ones are their support functions.
    /// Pairs of other types are tested as fast as before.
    void add_test(const PairTest<Dim>& test);

    /// All contacts of the pairs whose shapes touch or have a gap of up to `margin`. The result lies in the
    /// finder and is valid until its next call.
    ///
    /// Cost  of a pair, half of which touch, on a Zen 5: spheres 25 ns, capsules and spheres 50 to 70, boxes
    ///       and spheres or capsules with boxes 70 to 140, hulls of 32 corners 0.8 us, ellipsoids 0.7,
    ///       cylinders and cones 2.3, a sphere, capsule or box with a mesh of 20,000 triangles 2 to 3.
    const ContactBuffer<Dim, T>& find(const Objects<Dim, T>& objects, PairView pairs, T margin = 0) &
    {
        return find(objects, objects, pairs, margin);
    }
    const ContactBuffer<Dim, T>& find(const Objects<Dim, T>& a, const Objects<Dim, T>& b, PairView pairs,
                                      T margin = 0) &;
    /// Not for a finder without a name, which takes its result with it.
    template <class... More>
    void find(const Objects<Dim, T>& result_would_be_gone, More&&...) && = delete;
    /// Finds the same contacts, but of each only the deepest point, which is the first one in find(). With
    /// floats in 3D the result takes 3/8 of the memory. It stays valid when find() is called.
    const PointContactBuffer<Dim, T>& find_points(const Objects<Dim, T>& objects, PairView pairs,
                                                  T margin = 0) &
    {
        return find_points(objects, objects, pairs, margin);
    }
    const PointContactBuffer<Dim, T>& find_points(const Objects<Dim, T>& a, const Objects<Dim, T>& b,
                                                  PairView pairs, T margin = 0) &;
    template <class... More>
    void find_points(const Objects<Dim, T>& result_would_be_gone, More&&...) && = delete;
    /// Exchanges the result of the last find() or find_points() for `buffer`: `buffer` then has the contacts,
    /// and the finder has the buffer's memory, to fill next time. So a program that keeps the last frame's
    /// contacts allocates nothing. The buffer's memory resource goes with it: it must suit the finder.
    void take(ContactBuffer<Dim, T>& buffer);
    void take(PointContactBuffer<Dim, T>& buffer);

    /// out[i] says whether the shapes of pair i touch: 1 or 0. `out` has one element per pair.
    void touching(const Objects<Dim, T>& objects, PairView pairs, std::span<std::uint8_t> out)
    {
        touching(objects, objects, pairs, out);
    }
    void touching(const Objects<Dim, T>& a, const Objects<Dim, T>& b, PairView pairs,
                  std::span<std::uint8_t> out);
    /// out[i] is the distance of pair i; where that is more than `max_distance`, out[i].distance is infinite.
    void distances(const Objects<Dim, T>& objects, PairView pairs, T max_distance,
                   std::span<Distance<Dim, T>> out)
    {
        distances(objects, objects, pairs, max_distance, out);
    }
    void distances(const Objects<Dim, T>& a, const Objects<Dim, T>& b, PairView pairs, T max_distance,
                   std::span<Distance<Dim, T>> out);
    /// Of each group of pairs the first that touches, such as what each configuration of a robot hits first.
    ///
    /// Group g is pairs[offsets[g]] to pairs[offsets[g + 1] - 1]: there is one offset more than groups, and a
    /// group may be empty. out[g] is the number of that pair among all pairs, or no_pair. What comes after it
    /// in the group is neither tested nor checked, but for pairs that are tested together with it: the first
    /// 16 of a group, then more and more at once, up to 512. One thread works on a group.
    /// Errors    also for offsets that don't begin with 0, descend, or don't end with pairs.size();
    ///           size_mismatch unless `out` has one element per group.
    void first_touching(const Objects<Dim, T>& objects, std::span<const Pair> pairs,
                        std::span<const std::uint64_t> offsets, std::span<std::uint64_t> out)
    {
        first_touching(objects, objects, pairs, offsets, out);
    }
    void first_touching(const Objects<Dim, T>& a, const Objects<Dim, T>& b, std::span<const Pair> pairs,
                        std::span<const std::uint64_t> offsets, std::span<std::uint64_t> out);
    /// Of each group of pairs the least distance, out[g], and which pair has it, nearest[g]; of several pairs
    /// that are equally near, the first. Groups and errors are as for first_touching, but all pairs are
    /// checked.
    ///
    /// out[g] has the bits that distances() gives for that pair. Where no distance is at most `max_distance`,
    /// it is infinite, and the pair is no_pair. Pairs that lie apart by more than that, as spheres around
    /// them tell, or by more than a nearer pair of their group, cost little.
    void least_distances(const Objects<Dim, T>& objects, std::span<const Pair> pairs,
                         std::span<const std::uint64_t> offsets, T max_distance,
                         std::span<Distance<Dim, T>> out, std::span<std::uint64_t> nearest)
    {
        least_distances(objects, objects, pairs, offsets, max_distance, out, nearest);
    }
    void least_distances(const Objects<Dim, T>& a, const Objects<Dim, T>& b, std::span<const Pair> pairs,
                         std::span<const std::uint64_t> offsets, T max_distance,
                         std::span<Distance<Dim, T>> out, std::span<std::uint64_t> nearest);
    /// out[i] is the first impact of pair i; where there is none its time is infinite. See time_of_impact.
    void impacts(const MovingObjects<Dim, T>& objects, PairView pairs, T tolerance,
                 std::span<Impact<Dim, T>> out)
    {
        impacts(objects, objects, pairs, tolerance, out);
    }
    void impacts(const MovingObjects<Dim, T>& a, const MovingObjects<Dim, T>& b, PairView pairs, T tolerance,
                 std::span<Impact<Dim, T>> out);
    /// out[i] is where ray pairs[i].a first meets object pairs[i].b; where it doesn't the fraction is
    /// infinite. See ray_cast. The pairs may be those of BoxIndex::join or of any other search.
    void ray_casts(StridedView<Ray<Dim, T>> rays, const Objects<Dim, T>& objects, PairView pairs,
                   std::span<CastHit<Dim, T>> out);
    /// out[i] is where object pairs[i].a, which moves by its displacement, first touches pairs[i].b, which
    /// rests; where it doesn't the fraction is infinite. See shape_cast.
    void shape_casts(const Objects<Dim, T>& moving, StridedView<Vec<Dim, T>> displacements,
                     const Objects<Dim, T>& objects, PairView pairs, std::span<CastHit<Dim, T>> out);

  private:
    struct Implementation;
    std::unique_ptr<Implementation> implementation_;
};

using ContactFinder2f = ContactFinder<2, float>;
using ContactFinder3f = ContactFinder<3, float>;
using ContactFinder2d = ContactFinder<2, double>;
using ContactFinder3d = ContactFinder<3, double>;

// The same for one pair at a time. Each gives the same bits as the ContactFinder's call for many. They keep
// no state, so that any number of threads may call them. They throw an `Error` that names the pose if one has
// a number that is not finite or beyond 1e60, or a rotation of zero. Of custom shapes they use the support
// function, never a PairTest.

/// Whether two shapes share a point.
///
/// If so, contacts() finds at least one contact, unless it lies beyond the rim of a height field. False for
/// two half-spaces.
/// Cost      see docs/guide/contacts.md. Two meshes of 50,000 triangles that touch, or nearly do, take about
///           10 us.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API bool touching(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                                       const Pose<Dim, T>& pose_b);

/// All contacts of two shapes that touch or have a gap of up to `margin`, with pair {0, 1}.
///
/// Order     by ascending (part_a, part_b).
/// Surfaces  as ContactOptions are by default; a finder gives all points.
/// Cost      that of touching(), or somewhat more, and of allocating a vector.
/// Errors    `Error` also for a margin that is negative or not finite. `std::bad_alloc`.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::vector<Contact<Dim, T>>
contacts(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b, const Pose<Dim, T>& pose_b,
         std::type_identity_t<T> margin = 0);

/// The signed distance of two shapes and the points that have it, or nothing if it is more than
/// `max_distance`.
///
/// For shapes with parts it is the distance of the two parts that are nearest, or where parts overlap, of the
/// two that overlap deepest.
/// Ties      of parts of a 3D mesh that are equally near or deep, those of the lowest numbers count.
/// Cost      10 to 200 ns for spheres, capsules and boxes, 350 for hulls of 24 corners. 3D meshes are
///           searched nearest first, and an open `max_distance` costs no more: a body and a mesh of 50,000
///           triangles take 4 to 40 us, two such meshes 0.2 to 2 ms, most where their gap is wide. Of a
///           compound's children the nearest are tested first, and those that may be as near; two compounds
///           cost that for each child of one. Height fields and chains cost a test of every part within
///           `max_distance`.
/// Errors    `Error` also for a `max_distance` that is negative or not a number.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<Distance<Dim, T>>
distance(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b, const Pose<Dim, T>& pose_b,
         std::type_identity_t<T> max_distance);

/// The first time in [0, 1] at which the distance is at most `tolerance` (> 0, a length), or nothing.
///
/// It is never later than the true first touch, so that nothing tunnels, and at the time given the shapes are
/// no further apart than the tolerance. Shapes that pass each other at more than half the tolerance and don't
/// touch may count as an impact or not. A tolerance of less than a hundred thousandth of the shapes' size may
/// be missed by some millionths of their size, always by being too early: rounding leaves no more digits of
/// the direction in which they are nearest.
/// Ground    a height field counts as the solid that it is, with sides and an underside, which contacts() and
///           distance() leave out.
/// Numbers   the time is rounded down to T; the shapes are then up to speed * time * epsilon further apart.
/// Limit     1000 steps, each of which tests what is near. Gentle motions take 3 to 15. A shape that turns
///           hundreds of times while something is within its reach, or turns and passes something for long at
///           little more than the tolerance, may need more: then the answer is the time reached so far, an
///           early impact at which the shapes are further apart than the tolerance.
/// Cost      that of a distance() for each step; 3D meshes take a few steps more. Two meshes of 50,000
///           triangles that turn by 1 radian take about 1 ms, and 0.3 ms if they only slide.
/// Errors    `Error` also for a motion with numbers that are not finite, beyond 1e60, or 1e9 radians; for a
///           half-space that turns; for a tolerance that isn't above 0.
/// Source    conservative advancement: Mirtich, Impulse-based Dynamic Simulation (1996), sec. 2.3.
template <int Dim, Coordinate T>
[[nodiscard]] JOSTLE_API std::optional<Impact<Dim, T>>
time_of_impact(const Shape<Dim>& a, const Motion<Dim, T>& motion_a, const Shape<Dim>& b,
               const Motion<Dim, T>& motion_b, std::type_identity_t<T> tolerance);

JOSTLE_NAMESPACE_END
