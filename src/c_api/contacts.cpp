// SPDX-License-Identifier: MIT
#include <cstring>
#include <limits>
#include <variant>

#include "c_api/results.hpp"
#include "c_api/shapes.hpp"
#include "jostle/contact.hpp"

namespace jostle::c_api {
namespace {

template <class C, class Cpp, class PointC, class PointCpp>
constexpr bool contact_as_documented =
    sizeof(C) == sizeof(Cpp) && sizeof(PointC) == sizeof(PointCpp) &&
    offsetof(C, part_a) == offsetof(Cpp, part_a) && offsetof(C, part_b) == offsetof(Cpp, part_b) &&
    offsetof(C, normal) == offsetof(Cpp, normal) && offsetof(C, count) == offsetof(Cpp, count) &&
    offsetof(C, point) == offsetof(Cpp, point) && offsetof(PointC, from_b) == offsetof(PointCpp, from_b) &&
    offsetof(PointC, depth) == offsetof(PointCpp, depth) &&
    offsetof(PointC, feature) == offsetof(PointCpp, feature);
static_assert(contact_as_documented<jostle_contact_2f, Contact<2, float>, jostle_contact_point_2f,
                                    ContactPoint<2, float>> &&
              contact_as_documented<jostle_contact_3f, Contact<3, float>, jostle_contact_point_3f,
                                    ContactPoint<3, float>> &&
              contact_as_documented<jostle_contact_2d, Contact<2, double>, jostle_contact_point_2d,
                                    ContactPoint<2, double>> &&
              contact_as_documented<jostle_contact_3d, Contact<3, double>, jostle_contact_point_3d,
                                    ContactPoint<3, double>>);

template <class C, class Cpp>
constexpr bool point_as_documented =
    sizeof(C) == sizeof(Cpp) && offsetof(C, part_a) == offsetof(Cpp, part_a) &&
    offsetof(C, part_b) == offsetof(Cpp, part_b) && offsetof(C, normal) == offsetof(Cpp, normal) &&
    offsetof(C, from_a) == offsetof(Cpp, from_a) && offsetof(C, from_b) == offsetof(Cpp, from_b) &&
    offsetof(C, depth) == offsetof(Cpp, depth) && offsetof(C, feature) == offsetof(Cpp, feature);
static_assert(point_as_documented<jostle_point_contact_2f, PointContact<2, float>> &&
              point_as_documented<jostle_point_contact_3f, PointContact<3, float>> &&
              point_as_documented<jostle_point_contact_2d, PointContact<2, double>> &&
              point_as_documented<jostle_point_contact_3d, PointContact<3, double>>);
template <class C, class Cpp>
constexpr bool hit_as_documented =
    sizeof(C) == sizeof(Cpp) && offsetof(C, normal) == offsetof(Cpp, normal) &&
    offsetof(C, point) == offsetof(Cpp, point) && offsetof(C, part) == offsetof(Cpp, part) &&
    offsetof(C, moving_part) == offsetof(Cpp, moving_part);
static_assert(hit_as_documented<jostle_cast_hit_2f, CastHit<2, float>> &&
              hit_as_documented<jostle_cast_hit_3f, CastHit<3, float>> &&
              hit_as_documented<jostle_cast_hit_2d, CastHit<2, double>> &&
              hit_as_documented<jostle_cast_hit_3d, CastHit<3, double>>);
static_assert(sizeof(Ray<2, float>) == 5 * sizeof(float) && sizeof(Ray<3, double>) == 7 * sizeof(double));

/// A user's own test, kept for as long as the finder lives.
struct Test
{
    jostle_pair_test_function test;
    void* context;
};

template <int Dim>
void call_test(void* context, const PairTestInput<Dim>& input, typename PairTest<Dim>::Emit emit)
{
    const Test& test = *static_cast<const Test*>(context);
    const jostle_pair_test_input given{info_of(input.shape_a), info_of(input.shape_b),
                                       input.pose_a.position.data(), input.pose_b.position.data(),
                                       input.margin};
    test.test(
        test.context, &given,
        [](void* emit_context, const void* contact) {
            Contact<Dim, double> found;
            std::memcpy(static_cast<void*>(&found), contact, sizeof found);
            (*static_cast<typename PairTest<Dim>::Emit*>(emit_context))(found);
        },
        &emit);
}

class ContactFinderContent final : public Content
{
  public:
    ContactFinderContent(jostle_space space, Kept given) : kept(std::move(given))
    {
        in_space(space, [&](auto of) {
            finder.emplace<ContactFinder<decltype(of)::dim, typename decltype(of)::T>>(
                kept.options<ContactOptions>());
        });
    }
    template <class F>
    void on(F&& inside)
    {
        on_held(finder, inside);
    }

    Kept kept;
    std::vector<std::unique_ptr<Test>> tests;
    InSomeSpace<ContactFinder2f, ContactFinder3f, ContactFinder2d, ContactFinder3d> finder;
    std::vector<jostle_block> table;
    std::vector<Pair> scratch;
};

} // namespace

template <>
struct Behind<jostle_contact_finder> : Kind<ContactFinderContent, 0x08>
{
    static constexpr const char* name = "jostle_contact_finder";
};

namespace {

/// Calls work(finder, a, b, pairs); without `b`, a is both. `Set` is Objects or MovingObjects.
template <template <int, Coordinate> class Set, class Work>
void work_on(jostle_contact_finder* finder, const jostle_objects* a, const jostle_objects* b,
             const jostle_blocks* pairs, Work&& work)
{
    ContactFinderContent& content = open(finder);
    content.on([&]<int Dim, Coordinate T>(ContactFinder<Dim, T>& typed) {
        const auto first = objects_of<Set, Dim, T>(a, "a");
        const std::span<const Pair> all = read_pairs(pairs, content.scratch);
        work(typed, first, b == nullptr ? first : objects_of<Set, Dim, T>(b, "b"), all);
    });
}

/// The pose, motion, ray or vector that the caller's numbers are.
template <class Placed>
Placed read_placed(const void* numbers, const char* name)
{
    Placed placed;
    std::memcpy(static_cast<void*>(&placed), wanted_array_of<Placed>(numbers, 1, name), sizeof placed);
    return placed;
}

/// find(typed, ...) is ContactFinder's find() or find_points().
template <class Find>
void find_contacts(jostle_contact_finder* finder, const jostle_objects* a, const jostle_objects* b,
                   const jostle_blocks* pairs, double margin, jostle_blocks* contacts, const Find& find)
{
    wanted(contacts, "contacts");
    const auto list = [&]<class Item>(const BlockBuffer<Item>& found) {
        *contacts = list_blocks<Item>(found.blocks(), found.size(), open(finder).table);
    };
    work_on<Objects>(
        finder, a, b, pairs,
        [&]<int Dim, class T>(ContactFinder<Dim, T>& typed, const auto& of, const auto& and_of, auto all) {
            list(find(typed, of, and_of, all, static_cast<T>(margin)));
        });
}

template <class F>
void with_two(jostle_space space, const jostle_shape* a, const jostle_shape* b, F&& inside)
{
    in_space(space, [&](auto in) {
        constexpr int dim = decltype(in)::dim;
        inside(in, shape_of<dim>(a, "a").shape, shape_of<dim>(b, "b").shape);
    });
}

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_contact_finder_new(jostle_space space, const jostle_options* options,
                                        jostle_contact_finder** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        hand_out(out, std::make_unique<ContactFinderContent>(space, keep(options)));
    });
}
jostle_status jostle_contact_finder_add_test(jostle_contact_finder* finder, jostle_shape_type type_a,
                                             jostle_shape_type type_b, jostle_pair_test_function test,
                                             void* context, jostle_error* error)
{
    return guarded(error, [&] {
        ContactFinderContent& content = open(finder);
        wanted_function(test, "test");
        for (const jostle_shape_type type : {type_a, type_b})
            if (type < 0 || type > UINT16_MAX)
                refuse("there is no type " + std::to_string(type) + " of shapes");
        content.tests.push_back(std::make_unique<Test>(Test{test, context}));
        content.on([&]<int Dim, Coordinate T>(ContactFinder<Dim, T>& typed) {
            typed.add_test({static_cast<ShapeType>(type_a), static_cast<ShapeType>(type_b), call_test<Dim>,
                            content.tests.back().get()});
        });
    });
}

jostle_status jostle_contact_finder_find(jostle_contact_finder* finder, const jostle_objects* a,
                                         const jostle_objects* b, const jostle_blocks* pairs, double margin,
                                         jostle_blocks* contacts, jostle_error* error)
{
    return guarded(error, [&] {
        const auto find = [](auto& typed, const auto&... given) -> auto& { return typed.find(given...); };
        find_contacts(finder, a, b, pairs, margin, contacts, find);
    });
}
jostle_status jostle_contact_finder_find_points(jostle_contact_finder* finder, const jostle_objects* a,
                                                const jostle_objects* b, const jostle_blocks* pairs,
                                                double margin, jostle_blocks* contacts, jostle_error* error)
{
    return guarded(error, [&] {
        const auto find = [](auto& typed, const auto&... given) -> auto& {
            return typed.find_points(given...);
        };
        find_contacts(finder, a, b, pairs, margin, contacts, find);
    });
}
jostle_status jostle_contact_finder_touching(jostle_contact_finder* finder, const jostle_objects* a,
                                             const jostle_objects* b, const jostle_blocks* pairs,
                                             uint8_t* touching, jostle_error* error)
{
    return guarded(error, [&] {
        work_on<Objects>(finder, a, b, pairs, [&](auto& typed, const auto& of, const auto& and_of, auto all) {
            typed.touching(of, and_of, all,
                           std::span(wanted_array(touching, all.size(), "touching"), all.size()));
        });
    });
}
jostle_status jostle_contact_finder_distances(jostle_contact_finder* finder, const jostle_objects* a,
                                              const jostle_objects* b, const jostle_blocks* pairs,
                                              double max_distance, void* distances, jostle_error* error)
{
    return guarded(error, [&] {
        work_on<Objects>(finder, a, b, pairs,
                         [&]<int Dim, class T>(ContactFinder<Dim, T>& typed, const auto& of,
                                               const auto& and_of, auto all) {
                             typed.distances(of, and_of, all, static_cast<T>(max_distance),
                                             std::span(wanted_array_of<Distance<Dim, T>>(
                                                           distances, all.size(), "distances"),
                                                       all.size()));
                         });
    });
}
jostle_status jostle_contact_finder_first_touching(jostle_contact_finder* finder, const jostle_objects* a,
                                                   const jostle_objects* b, const jostle_blocks* pairs,
                                                   const uint64_t* offsets, uint64_t groups, uint64_t* first,
                                                   jostle_error* error)
{
    return guarded(error, [&] {
        const std::span bounds = offsets_of(offsets, groups, "groups");
        const std::span out(wanted_array(first, groups, "first"), groups);
        work_on<Objects>(finder, a, b, pairs, [&](auto& typed, const auto& of, const auto& and_of, auto all) {
            typed.first_touching(of, and_of, all, bounds, out);
        });
    });
}
jostle_status jostle_contact_finder_least_distances(jostle_contact_finder* finder, const jostle_objects* a,
                                                    const jostle_objects* b, const jostle_blocks* pairs,
                                                    const uint64_t* offsets, uint64_t groups,
                                                    double max_distance, void* distances, uint64_t* nearest,
                                                    jostle_error* error)
{
    return guarded(error, [&] {
        const std::span bounds = offsets_of(offsets, groups, "groups");
        const std::span which(wanted_array(nearest, groups, "nearest"), groups);
        work_on<Objects>(
            finder, a, b, pairs,
            [&]<int Dim, class T>(ContactFinder<Dim, T>& typed, const auto& of, const auto& and_of,
                                  auto all) {
                typed.least_distances(
                    of, and_of, all, bounds, static_cast<T>(max_distance),
                    std::span(wanted_array_of<Distance<Dim, T>>(distances, groups, "distances"), groups),
                    which);
            });
    });
}
jostle_status jostle_contact_finder_impacts(jostle_contact_finder* finder, const jostle_objects* a,
                                            const jostle_objects* b, const jostle_blocks* pairs,
                                            double tolerance, void* impacts, jostle_error* error)
{
    return guarded(error, [&] {
        work_on<MovingObjects>(
            finder, a, b, pairs,
            [&]<int Dim, class T>(ContactFinder<Dim, T>& typed, const auto& of, const auto& and_of,
                                  auto all) {
                typed.impacts(
                    of, and_of, all, static_cast<T>(tolerance),
                    std::span(wanted_array_of<Impact<Dim, T>>(impacts, all.size(), "impacts"), all.size()));
            });
    });
}

jostle_status jostle_contact_finder_ray_casts(jostle_contact_finder* finder, const jostle_values* rays,
                                              const jostle_objects* objects, const jostle_blocks* pairs,
                                              void* hits, jostle_error* error)
{
    return guarded(error, [&] {
        ContactFinderContent& content = open(finder);
        content.on([&]<int Dim, Coordinate T>(ContactFinder<Dim, T>& typed) {
            const auto of = objects_of<Objects, Dim, T>(objects, "objects");
            const auto given = view<Ray<Dim, T>>(wanted(rays, "rays"), "rays");
            const std::span<const Pair> all = read_pairs(pairs, content.scratch);
            typed.ray_casts(
                given, of, all,
                std::span(wanted_array_of<CastHit<Dim, T>>(hits, all.size(), "hits"), all.size()));
        });
    });
}
jostle_status jostle_contact_finder_shape_casts(jostle_contact_finder* finder, const jostle_objects* moving,
                                                const jostle_values* displacements,
                                                const jostle_objects* objects, const jostle_blocks* pairs,
                                                void* hits, jostle_error* error)
{
    return guarded(error, [&] {
        ContactFinderContent& content = open(finder);
        content.on([&]<int Dim, Coordinate T>(ContactFinder<Dim, T>& typed) {
            const auto movers = objects_of<Objects, Dim, T>(moving, "moving");
            const auto of = objects_of<Objects, Dim, T>(objects, "objects");
            const auto ways = view<Vec<Dim, T>>(wanted(displacements, "displacements"), "displacements");
            const std::span<const Pair> all = read_pairs(pairs, content.scratch);
            typed.shape_casts(
                movers, ways, of, all,
                std::span(wanted_array_of<CastHit<Dim, T>>(hits, all.size(), "hits"), all.size()));
        });
    });
}

// --- One pair ---

jostle_status jostle_touching(jostle_space space, const jostle_shape* a, const void* pose_a,
                              const jostle_shape* b, const void* pose_b, int32_t* out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "touching");
        with_two(space, a, b, [&](auto in, const auto& shape_a, const auto& shape_b) {
            using Placed = Pose<decltype(in)::dim, typename decltype(in)::T>;
            *out = touching(shape_a, read_placed<Placed>(pose_a, "pose_a"), shape_b,
                            read_placed<Placed>(pose_b, "pose_b"))
                       ? 1
                       : 0;
        });
    });
}
jostle_status jostle_contacts(jostle_space space, const jostle_shape* a, const void* pose_a,
                              const jostle_shape* b, const void* pose_b, double margin,
                              jostle_results* results, jostle_error* error)
{
    return guarded(error, [&] {
        ResultsContent& into = open(results);
        with_two(space, a, b, [&](auto in, const auto& shape_a, const auto& shape_b) {
            using T = typename decltype(in)::T;
            using Placed = Pose<decltype(in)::dim, T>;
            using Found = Contact<decltype(in)::dim, T>;
            into.begin();
            const std::vector<Found> found =
                contacts(shape_a, read_placed<Placed>(pose_a, "pose_a"), shape_b,
                         read_placed<Placed>(pose_b, "pose_b"), static_cast<T>(margin));
            into.bytes.resize(found.size() * sizeof(Found));
            if (!found.empty()) std::memcpy(into.bytes.data(), found.data(), into.bytes.size());
            into.show(std::span(reinterpret_cast<const Found*>(into.bytes.data()), found.size()));
        });
    });
}
jostle_status jostle_distance(jostle_space space, const jostle_shape* a, const void* pose_a,
                              const jostle_shape* b, const void* pose_b, double max_distance, void* out,
                              jostle_error* error)
{
    return guarded(error, [&] {
        with_two(space, a, b, [&](auto in, const auto& shape_a, const auto& shape_b) {
            using T = typename decltype(in)::T;
            using Placed = Pose<decltype(in)::dim, T>;
            using Found = Distance<decltype(in)::dim, T>;
            auto* const into = wanted_array_of<Found>(out, 1, "distance");
            const auto found = distance(shape_a, read_placed<Placed>(pose_a, "pose_a"), shape_b,
                                        read_placed<Placed>(pose_b, "pose_b"), static_cast<T>(max_distance));
            *into = found ? *found : Found{std::numeric_limits<T>::infinity(), {}, {}, {}};
        });
    });
}
jostle_status jostle_time_of_impact(jostle_space space, const jostle_shape* a, const void* motion_a,
                                    const jostle_shape* b, const void* motion_b, double tolerance, void* out,
                                    jostle_error* error)
{
    return guarded(error, [&] {
        with_two(space, a, b, [&](auto in, const auto& shape_a, const auto& shape_b) {
            using T = typename decltype(in)::T;
            using Placed = Motion<decltype(in)::dim, T>;
            using Found = Impact<decltype(in)::dim, T>;
            auto* const into = wanted_array_of<Found>(out, 1, "impact");
            const auto found =
                time_of_impact(shape_a, read_placed<Placed>(motion_a, "motion_a"), shape_b,
                               read_placed<Placed>(motion_b, "motion_b"), static_cast<T>(tolerance));
            *into = found ? *found : Found{std::numeric_limits<T>::infinity(), {}, {}, {}};
        });
    });
}
jostle_status jostle_cast_ray(jostle_space space, const jostle_shape* shape, const void* pose,
                              const void* ray, void* hit, jostle_error* error)
{
    return guarded(error, [&] {
        in_space(space, [&](auto in) {
            constexpr int dim = decltype(in)::dim;
            using T = typename decltype(in)::T;
            auto* const into = wanted_array_of<CastHit<dim, T>>(hit, 1, "hit");
            const auto found =
                ray_cast(shape_of<dim>(shape, "shape").shape, read_placed<Pose<dim, T>>(pose, "pose"),
                         read_placed<Ray<dim, T>>(ray, "ray"));
            *into = found ? *found : CastHit<dim, T>{std::numeric_limits<T>::infinity(), {}, {}};
        });
    });
}
jostle_status jostle_cast_shape(jostle_space space, const jostle_shape* moving, const void* pose,
                                const void* displacement, const jostle_shape* shape, const void* shape_pose,
                                void* hit, jostle_error* error)
{
    return guarded(error, [&] {
        with_two(space, moving, shape, [&](auto in, const auto& mover, const auto& target) {
            constexpr int dim = decltype(in)::dim;
            using T = typename decltype(in)::T;
            auto* const into = wanted_array_of<CastHit<dim, T>>(hit, 1, "hit");
            const auto found = shape_cast(mover, read_placed<Pose<dim, T>>(pose, "pose"),
                                          read_placed<Vec<dim, T>>(displacement, "displacement"), target,
                                          read_placed<Pose<dim, T>>(shape_pose, "shape_pose"));
            *into = found ? *found : CastHit<dim, T>{std::numeric_limits<T>::infinity(), {}, {}};
        });
    });
}

} // extern "C"
