// SPDX-License-Identifier: MIT
// What the C interface refuses, and what it says then; and what has names.
#include <algorithm>
#include <atomic>
#include <functional>
#include <initializer_list>
#include <string>
#include <thread>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

class CRefusals : public CTwin
{
  protected:
    void refused(jostle_status status, const std::string& words, jostle_status with = JOSTLE_INVALID_ARGUMENT)
    {
        EXPECT_EQ(status, with);
        EXPECT_NE(std::string(error.message).find(words), std::string::npos)
            << error.message << " doesn't say: " << words;
    }
};

TEST_F(CRefusals, StatusesAreCalledAsInCpp)
{
    const std::pair<jostle_status, const char*> names[] = {
        {JOSTLE_OK, "ok"},
        {JOSTLE_NAN_COORDINATE, "nan_coordinate"},
        {JOSTLE_INVERTED_BOX, "inverted_box"},
        {JOSTLE_TOO_MANY_OBJECTS, "too_many_objects"},
        {JOSTLE_SIZE_MISMATCH, "size_mismatch"},
        {JOSTLE_INVALID_ARGUMENT, "invalid_argument"},
        {JOSTLE_STALE_ID, "stale_id"},
        {JOSTLE_BAD_SNAPSHOT, "bad_snapshot"},
        {JOSTLE_FILE_ERROR, "file_error"},
        {JOSTLE_OUT_OF_MEMORY, "out_of_memory"},
        {JOSTLE_BAD_HANDLE, "bad_handle"},
        {JOSTLE_CALLBACK_FAILED, "callback_failed"},
        {JOSTLE_INTERNAL_ERROR, "internal_error"},
    };
    for (const auto& [status, expected] : names) {
        const char* name = nullptr;
        OK(jostle_status_name(status, &name, &error));
        EXPECT_STREQ(name, expected);
    }
    const char* name = nullptr;
    refused(jostle_status_name(9999, &name, &error), "9999");
    refused(jostle_instruction_set_name(-1, &name, &error), "-1");
    refused(jostle_instruction_set_name(99, &name, &error), "99");
}

TEST_F(CRefusals, ExecutorsHaveThreads)
{
    OK(jostle_executor_threads(3, &executor, &error));
    std::uint32_t threads = 0;
    OK(jostle_executor_concurrency(executor, &threads, &error));
    EXPECT_EQ(threads, 3u);
    std::vector<int> ran(100);
    const auto task = [](void* context, std::uint64_t i, std::uint64_t, jostle_work work) -> std::int32_t {
        EXPECT_LT(work.slot, 3u);
        ++(*static_cast<std::vector<int>*>(context))[i];
        return 0;
    };
    auto process = options_of<jostle_process_options>();
    process.executor = executor;
    process.block_items = 1;
    OK(jostle_process_items(100, task, &ran, &process, &error));
    EXPECT_EQ(ran, std::vector<int>(100, 1));
    const auto run = [](void*, std::uint32_t, void (*)(void*, std::uint32_t), void*) -> std::int32_t {
        return 1;
    };
    jostle_executor* none = nullptr;
    refused(jostle_executor_callback(0, run, nullptr, &none, &error), "at least 1");
    EXPECT_EQ(none, nullptr);
    // One that is freed is no executor any more.
    OK(jostle_free(executor, &error));
    jostle_executor* const freed = executor;
    executor = nullptr;
    refused(jostle_executor_concurrency(freed, &threads, &error), "freed", JOSTLE_BAD_HANDLE);
    refused(jostle_free(freed, &error), "freed", JOSTLE_BAD_HANDLE);
}

TEST_F(CRefusals, BoxesAndBlocks)
{
    // No boxes at all: then there need be no numbers, either.
    jostle_boxes given = jostle_boxes_strided(JOSTLE_2D, nullptr, nullptr, 0, 32);
    EXPECT_EQ(given.count, 0u);
    OK(jostle_boxes_check(JOSTLE_2D, &given, &error));
    given = jostle_boxes_strided(JOSTLE_2D, nullptr, nullptr, 1, 32);
    refused(jostle_boxes_check(JOSTLE_2D, &given, &error), "lo[0] is NULL");
    const double rows[2][6] = {{0, 0, 0, 1, 1, 1}, {2, 2, 2, 3, 3, 3}};
    for (const jostle_space space : {JOSTLE_2F, JOSTLE_2D, JOSTLE_3F, JOSTLE_3D}) {
        given = jostle_boxes_strided(space, rows[0], rows[0] + 3, 2, sizeof rows[0]);
        const bool wide = space == JOSTLE_2D || space == JOSTLE_3D;
        const char* const at = reinterpret_cast<const char*>(rows);
        EXPECT_EQ(given.lo[1], at + (wide ? 8 : 4));
        EXPECT_EQ(given.hi[0], at + 24);
        EXPECT_EQ(given.lo[2], space == JOSTLE_3F ? at + 8 : space == JOSTLE_3D ? at + 16 : nullptr);
    }
    given = jostle_boxes_strided(JOSTLE_3D, rows[0], rows[0] + 3, 2, 3);
    refused(jostle_boxes_check(JOSTLE_3D, &given, &error), "stride");
    const Pairs pairs{{0, 1}};
    const jostle_block block{pairs.data(), 1};
    const jostle_blocks blocks{&block, 1, 1, 12};
    std::uint64_t sum = 0;
    refused(jostle_pair_checksum(&blocks, &sum, &error), "item_size is 12");
}

TEST_F(CRefusals, QueriesOfIndexAndWorld)
{
    Random random(4);
    const std::vector<Aabb3f> boxes = random_boxes(random, 9);
    const jostle_queries one_box = queries_of(JOSTLE_BOX, boxes.data(), 1);
    const jostle_queries two_boxes = queries_of(JOSTLE_BOX, boxes.data(), 2);
    const jostle_boxes given = view(boxes);
    OK(jostle_index_new(JOSTLE_3F, nullptr, &index, &error));
    const std::vector<std::uint32_t> ids{4, 40, 400, 5, 50, 500, 6, 60, 600};
    jostle_boxes without = given;
    without.hi[1] = nullptr;
    refused(jostle_index_build(index, ids.data(), &without, &error), "boxes::hi[1] is NULL");
    OK(jostle_index_build(index, ids.data(), &given, &error));
    std::vector<std::uint64_t> counts(2);
    OK(jostle_query_count(index, &one_box, nullptr, nullptr, counts.data(), &error));
    EXPECT_GE(counts[0], 1u);
    auto filter = options_of<jostle_query_filter>();
    std::uint64_t exclude = std::uint64_t{1} << 32;
    filter.exclude = &exclude;
    refused(jostle_query_count(index, &one_box, nullptr, &filter, counts.data(), &error),
            "exclude is 4294967296");
    filter.exclude = nullptr;
    for (const jostle_query_kind kind :
         {jostle_query_kind{-1}, jostle_query_kind{99}, jostle_query_kind{JOSTLE_NEAREST}}) {
        jostle_queries odd = one_box;
        odd.kind = kind;
        refused(jostle_query_count(index, &odd, nullptr, &filter, counts.data(), &error),
                "kind is " + std::to_string(kind) +
                    "; this call takes JOSTLE_RAY, JOSTLE_SWEEP, JOSTLE_BOX, JOSTLE_SPHERE, JOSTLE_FRUSTUM");
    }
    jostle_hit hit;
    refused(jostle_query_first(index, &one_box, nullptr, nullptr, &hit, nullptr, &error),
            "kind is 3; this call takes JOSTLE_RAY, JOSTLE_SWEEP");
    jostle_query_filter filters[2] = {options_of<jostle_query_filter>(), options_of<jostle_query_filter>()};
    filters[0].count = filters[1].count = 2;
    filters[0].struct_size = sizeof filter - 4;
    refused(jostle_query_count(index, &two_boxes, nullptr, filters, counts.data(), &error), "struct_size");

    OK(jostle_world_new(JOSTLE_3F, nullptr, &world, &error));
    std::vector<jostle_id> objects(boxes.size());
    OK(jostle_world_add(world, &given, nullptr, objects.data(), &error));
    OK(jostle_world_update(world, &error));
    const std::uint32_t column[9] = {};
    for (jostle_values jostle_query_filter::* const member :
         {&jostle_query_filter::category, &jostle_query_filter::mask, &jostle_query_filter::owner}) {
        filter = options_of<jostle_query_filter>();
        filter.*member = {column, 9, sizeof column[0]};
        refused(jostle_query_count(world, &one_box, nullptr, &filter, counts.data(), &error),
                "no category, mask or owner");
    }
    // The asker's own count: nobody has category 2, which is all that it wants.
    filter = options_of<jostle_query_filter>();
    const jostle_asker asker{1, 2, UINT32_MAX};
    filter.asker = &asker;
    OK(jostle_query_count(world, &one_box, nullptr, &filter, counts.data(), &error));
    EXPECT_EQ(counts[0], 0u);
    OK(jostle_query_count(world, &one_box, nullptr, nullptr, counts.data(), &error));
    EXPECT_GE(counts[0], 1u);
    std::uint8_t any = 7;
    OK(jostle_query_any(world, &one_box, nullptr, nullptr, &any, &error));
    EXPECT_EQ(any, 1);
    refused(jostle_query_join(world, &given, filters + 1, results, &error), "one filter");
    jostle_world* other = nullptr;
    OK(jostle_world_new(JOSTLE_3D, nullptr, &other, &error));
    std::int32_t finished = 0;
    const auto visit = [](void*, std::uint64_t, std::uint64_t, double, double*) -> std::int32_t { return 1; };
    refused(jostle_query_closest_pairs(world, other, 1, visit, nullptr, &finished, &error),
            "different spaces");
    OK(jostle_free(other, &error));
    auto stats = options_of<jostle_world_stats>();
    stats.struct_size = 4;
    refused(jostle_world_stats_read(world, &stats, &error), "struct_size is 4");
    stats.struct_size = 5000;
    refused(jostle_world_stats_read(world, &stats, &error), "struct_size is 5000");
}

TEST_F(CRefusals, DrawsEveryKind)
{
    OK(jostle_world_new(JOSTLE_3F, nullptr, &world, &error));
    // 0 and 1 rest and touch, 2 is disabled, 3 comes to touch 1 while 4 goes, 5 moves within 1.
    std::vector<Aabb3f> boxes;
    for (const float x : {0.0f, 1.0f, 20.0f, 30.0f, 0.5f, 1.2f})
        boxes.push_back({{x, 0, 0}, {x + 1, 1, 1}});
    const jostle_boxes given = view(boxes);
    std::vector<jostle_id> ids(boxes.size());
    OK(jostle_world_add(world, &given, nullptr, ids.data(), &error));
    const std::uint8_t off = 0;
    OK(jostle_world_set_enabled(world, &ids[2], 1, &off, 0, &error));
    for (int k = 0; k < 8; ++k)
        OK(jostle_world_update(world, &error));
    const jostle_id movers[] = {ids[3], ids[5]};
    for (int k = 0; k < 3; ++k) {
        const float by = 0.01f * static_cast<float>(k);
        const std::vector<Aabb3f> moved{{{1.5f + by, 0, 0}, {2.5f, 1, 1}}, {{1.3f + by, 0, 0}, {2.3f, 1, 1}}};
        const jostle_boxes now = view(moved);
        OK(jostle_world_move(world, movers, &now, nullptr, 0, &error));
        if (k == 2) {
            OK(jostle_world_remove(world, &ids[4], 1, &error));
        }
        OK(jostle_world_update(world, &error));
        if (k == 1) continue;
        std::vector<int> kinds(6);
        const auto count = [](void* context, const void*, jostle_draw_kind kind) -> std::int32_t {
            ++(*static_cast<std::vector<int>*>(context)).at(static_cast<std::size_t>(kind));
            return 1;
        };
        OK(jostle_world_draw(world, count, count, &kinds, &error));
        EXPECT_EQ(kinds[JOSTLE_DRAW_ACTIVE] + kinds[JOSTLE_DRAW_RESTING], k == 0 ? 5 : 4);
        EXPECT_GT(kinds[JOSTLE_DRAW_RESTING], 0);
        EXPECT_EQ(kinds[JOSTLE_DRAW_DISABLED], 1);
        EXPECT_EQ(kinds[JOSTLE_DRAW_BEGAN] > 0, k == 0);
        EXPECT_GT(kinds[JOSTLE_DRAW_PERSISTED], 0);
    }
}

// The call around a callback goes on with its handles.
TEST_F(CRefusals, HandlesAreNotFreedInTheirOwnCallbacks)
{
    Random random(5);
    const std::vector<Aabb3f> boxes = random_boxes(random, 30, 3);
    const jostle_queries one_box = queries_of(JOSTLE_BOX, boxes.data(), 1);
    const jostle_boxes given = view(boxes);
    static jostle_error inner;
    static jostle_status (*free_it)(void*) = nullptr;
    static int calls = 0, frees = 0;
    const auto accept = [](void* context, std::uint32_t, std::uint32_t) -> std::int32_t {
        ++calls;
        frees += free_it(context) == JOSTLE_OK ? 1 : 0;
        return 1;
    };
    const auto accept_object = [](void* context, jostle_id, jostle_id) -> std::int32_t {
        ++calls;
        frees += free_it(context) == JOSTLE_OK ? 1 : 0;
        return 1;
    };
    const auto visit = [](void* context, std::uint64_t, double, const void*, double*) -> std::int32_t {
        ++calls;
        frees += free_it(context) == JOSTLE_OK ? 1 : 0;
        return 1;
    };
    OK(jostle_executor_serial(&executor, &error));
    auto options = options_of<jostle_options>();
    options.executor = executor;

    OK(jostle_finder_new(&options, &finder, &error));
    free_it = [](void* handle) { return jostle_free(handle, &inner); };
    auto filter = options_of<jostle_filter>();
    filter.accept = accept;
    filter.context = finder;
    jostle_blocks pairs{};
    OK(jostle_finder_find(finder, JOSTLE_3F, &given, nullptr, &filter, JOSTLE_CANONICAL, &pairs, &error));
    EXPECT_GT(pairs.count, 5u);
    EXPECT_GT(calls, 5);
    EXPECT_EQ(frees, 0);
    EXPECT_NE(std::string(inner.message).find("jostle_finder is in use"), std::string::npos) << inner.message;

    OK(jostle_index_new(JOSTLE_3F, &options, &index, &error));
    OK(jostle_index_build(index, nullptr, &given, &error));
    free_it = [](void* handle) { return jostle_free(handle, &inner); };
    std::int32_t finished = 0;
    calls = 0;
    OK(jostle_query_visit(index, &one_box, nullptr, nullptr, visit, index, &finished, &error));
    EXPECT_GT(calls, 0);

    auto world_options = options_of<jostle_world_options>();
    world_options.common = &options;
    world_options.accept = accept_object;
    static jostle_world* its = nullptr;
    free_it = [](void*) { return jostle_free(its, &inner); };
    OK(jostle_world_new(JOSTLE_3F, &world_options, &world, &error));
    its = world;
    std::vector<jostle_id> ids(boxes.size());
    OK(jostle_world_add(world, &given, nullptr, ids.data(), &error));
    calls = 0;
    OK(jostle_world_update(world, &error));
    EXPECT_GT(calls, 5);
    calls = 0;
    OK(jostle_query_visit(world, &one_box, nullptr, nullptr, visit, nullptr, &finished, &error));
    EXPECT_GT(calls, 0);
    EXPECT_EQ(frees, 0);

    // What the call wasn't given may be freed, and everything once the calls are over.
    static jostle_results* other = nullptr;
    OK(jostle_results_new(nullptr, &other, &error));
    free_it = [](void*) {
        if (other != nullptr) {
            EXPECT_EQ(jostle_free(std::exchange(other, nullptr), &inner), JOSTLE_OK);
        }
        return jostle_status{JOSTLE_INVALID_ARGUMENT};
    };
    OK(jostle_query_visit(world, &one_box, nullptr, nullptr, visit, nullptr, &finished, &error));
    EXPECT_EQ(other, nullptr);
    OK(jostle_free(std::exchange(world, nullptr), &error));
    OK(jostle_free(std::exchange(index, nullptr), &error));
    OK(jostle_free(std::exchange(finder, nullptr), &error));
}

// Threads that aren't the caller's: those of the library, and one of a host's that does everything.
TEST_F(CRefusals, HandlesAreNotFreedInCallbacksOnOtherThreads)
{
    Random random(7);
    const std::vector<Aabb3f> boxes = random_boxes(random, 20'000, 60);
    const jostle_boxes given = view(boxes);
    const jostle_queries queries = queries_of(JOSTLE_BOX, boxes.data(), boxes.size());
    static std::atomic<int> calls, elsewhere, frees;
    static std::thread::id here;
    static std::function<jostle_status()> free_it;
    here = std::this_thread::get_id();
    const auto try_it = [] {
        ++calls;
        elsewhere += std::this_thread::get_id() == here ? 0 : 1;
        frees += free_it() == JOSTLE_OK ? 1 : 0;
    };
    static const auto do_it = try_it;
    const auto one_thread = [](void*, std::uint32_t count, void (*task)(void*, std::uint32_t),
                               void* tasks) -> std::int32_t {
        std::thread([=] {
            for (std::uint32_t i = 0; i < count; ++i)
                task(tasks, i);
        }).join();
        return 0;
    };
    auto options = options_of<jostle_options>();
    for (const int kind : {0, 1, 2}) { // the default executor, threads, a host
        if (kind == 1) {
            OK(jostle_executor_threads(4, &executor, &error));
        } else if (kind == 2) {
            OK(jostle_free(std::exchange(executor, nullptr), &error));
            OK(jostle_executor_callback(2, one_thread, nullptr, &executor, &error));
        }
        options.executor = executor;
        calls = elsewhere = 0;
        OK(jostle_finder_new(&options, &finder, &error));
        free_it = [&] { return jostle_free(finder, nullptr); };
        auto filter = options_of<jostle_filter>();
        filter.accept = [](void*, std::uint32_t, std::uint32_t) -> std::int32_t {
            do_it();
            return 1;
        };
        jostle_blocks pairs{};
        OK(jostle_finder_find(finder, JOSTLE_3F, &given, nullptr, &filter, JOSTLE_CANONICAL, &pairs, &error));
        EXPECT_GT(pairs.count, 1000u);
        OK(jostle_index_new(JOSTLE_3F, &options, &index, &error));
        OK(jostle_index_build(index, nullptr, &given, &error));
        free_it = [&] { return jostle_clear(index, nullptr); };
        auto query_filter = options_of<jostle_query_filter>();
        query_filter.accept = [](void*, std::uint32_t, std::uint64_t) -> std::int32_t {
            do_it();
            return 1;
        };
        OK(jostle_query_all(index, &queries, nullptr, &query_filter, UINT64_MAX, results, &error));
        EXPECT_GT(calls, 20'000);
        if (kind == 2) {
            EXPECT_EQ(elsewhere, calls);
        }
        EXPECT_EQ(frees, 0);
        OK(jostle_free(std::exchange(index, nullptr), &error));
        OK(jostle_free(std::exchange(finder, nullptr), &error));
    }
    free_it = nullptr;
}

// Memory that the call around a callback reads mustn't move, and its results aren't another call's.
TEST_F(CRefusals, HandlesAreNotChangedInTheirOwnCallbacks)
{
    Random random(6);
    const std::vector<Aabb3f> boxes = random_boxes(random, 300, 3);
    const jostle_queries one_box = queries_of(JOSTLE_BOX, boxes.data(), 1);
    const jostle_boxes given = view(boxes);
    static jostle_error inner;
    static std::function<jostle_status()> change;
    static int calls = 0;
    const auto try_it = [] { // lambdas without captures call it from C
        ++calls;
        EXPECT_EQ(change(), JOSTLE_INVALID_ARGUMENT);
        EXPECT_NE(std::string(inner.message).find("is in use by the call that runs this callback"),
                  std::string::npos)
            << inner.message;
    };
    static const auto do_it = try_it;
    const auto called = [&](const char* what) { EXPECT_GT(std::exchange(calls, 0), 0) << what; };
    OK(jostle_executor_serial(&executor, &error));
    auto options = options_of<jostle_options>();
    options.executor = executor;

    OK(jostle_finder_new(&options, &finder, &error));
    auto filter = options_of<jostle_filter>();
    filter.accept = [](void*, std::uint32_t, std::uint32_t) -> std::int32_t {
        do_it();
        return 1;
    };
    jostle_blocks pairs{};
    change = [&] { return jostle_release_memory(finder, &inner); };
    OK(jostle_finder_find(finder, JOSTLE_3F, &given, nullptr, &filter, JOSTLE_CANONICAL, &pairs, &error));
    EXPECT_EQ(pairs.count, static_cast<std::uint64_t>(calls));
    called("release_memory");

    OK(jostle_index_new(JOSTLE_3F, &options, &index, &error));
    OK(jostle_index_build(index, nullptr, &given, &error));
    const auto visit = [](void*, std::uint64_t, double, const void*, double*) -> std::int32_t {
        do_it();
        return 1;
    };
    std::int32_t finished = 0;
    const std::uint32_t id = 0;
    for (const auto& each : std::initializer_list<std::function<jostle_status()>>{
             [&] { return jostle_index_build(index, nullptr, &given, &inner); },
             [&] { return jostle_index_erase(index, &id, 1, &inner); },
             [&] { return jostle_clear(index, &inner); },
             [&] { return jostle_release_memory(index, &inner); }}) {
        change = each;
        OK(jostle_query_visit(index, &one_box, nullptr, nullptr, visit, nullptr, &finished, &error));
        called("a change of the index");
    }
    // It may be asked.
    const auto join = [](void* its, std::uint64_t, double, const void*, double*) -> std::int32_t {
        const auto& [joined, with, into] =
            *static_cast<std::tuple<jostle_index*, const jostle_boxes*, jostle_results*>*>(its);
        EXPECT_EQ(jostle_query_join(joined, with, nullptr, into, &inner), JOSTLE_OK) << inner.message;
        return 0;
    };
    std::tuple<jostle_index*, const jostle_boxes*, jostle_results*> joining{index, &given, results};
    OK(jostle_query_visit(index, &one_box, nullptr, nullptr, join, &joining, &finished, &error));
    EXPECT_EQ(finished, 0);
    // Two calls that fill one result: the outer one's answers alone.
    auto query_filter = options_of<jostle_query_filter>();
    query_filter.accept = [](void*, std::uint32_t, std::uint64_t) -> std::int32_t {
        do_it();
        return 1;
    };
    change = [&] { return jostle_query_all(index, &one_box, nullptr, nullptr, UINT64_MAX, results, &inner); };
    OK(jostle_query_all(index, &one_box, nullptr, &query_filter, UINT64_MAX, results, &error));
    jostle_lists lists{};
    OK(jostle_results_lists(results, &lists, &error));
    EXPECT_EQ(lists.queries, 1u);
    EXPECT_EQ(lists.count, static_cast<std::uint64_t>(calls));
    called("the same results");

    jostle_shape *own = nullptr, *ball = nullptr;
    jostle_shapes* shapes = nullptr;
    const auto support = [](void*, const double*, double* point) {
        do_it();
        std::fill_n(point, 3, 0.0);
    };
    OK(jostle_shape_custom(3, JOSTLE_SHAPE_FIRST_CUSTOM, 1, support, nullptr, &own, &error));
    OK(jostle_shape_sphere(3, 1, &ball, &error));
    OK(jostle_shapes_new(3, &shapes, &error));
    OK(jostle_shapes_add(shapes, own, 2, &error));
    const double poses[2][7] = {{0, 0, 0, 0, 0, 0, 1}, {1, 0, 0, 0, 0, 0, 1}};
    const jostle_objects objects{shapes, {poses, 2, sizeof poses[0]}};
    double bounds[12];
    for (const auto& each : std::initializer_list<std::function<jostle_status()>>{
             [&] { return jostle_shapes_add(shapes, ball, 1000, &inner); },
             [&] { return jostle_shapes_set(shapes, 0, ball, &inner); },
             [&] { return jostle_clear(shapes, &inner); }}) {
        change = each;
        OK(jostle_bounds(JOSTLE_3D, &objects, 0, executor, bounds, &error));
        called("a change of the shapes");
    }
    OK(jostle_shapes_add(shapes, ball, 1, &error)); // afterwards
    OK(jostle_free(shapes, &error));
    OK(jostle_free(ball, &error));
    OK(jostle_free(own, &error));
    change = nullptr;
}

TEST_F(CRefusals, PointsAreNamed)
{
    const double corners[4][3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
    const std::uint32_t sides[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
    jostle_shape* mesh = nullptr;
    jostle_closed_mesh* solid = nullptr;
    OK(jostle_shape_mesh(JOSTLE_3D, corners, 4, sides[0], 4, 0, &mesh, &error));
    OK(jostle_closed_mesh_new(mesh, &solid, &error));
    const double points[3][3] = {{1, 1, 1}, {9, 9, 9}, {0, 1e61, 0}};
    std::int32_t numbers[3] = {};
    refused(jostle_closed_mesh_winding_numbers(solid, points[0], 3, numbers, &error), "1e+61");
    EXPECT_EQ(error.index, 2u);
    EXPECT_EQ(numbers[0], 1);
    OK(jostle_free(solid, &error));
    OK(jostle_free(mesh, &error));
}

TEST_F(CRefusals, ShapesAndWork)
{
    jostle_shape* ball = nullptr;
    OK(jostle_shape_sphere(3, 1, &ball, &error));
    const double* corners = nullptr;
    const std::uint32_t* face = nullptr;
    std::uint64_t count = 0;
    refused(jostle_shape_vertices(ball, &corners, &count, &error), "neither a hull nor a mesh");
    refused(jostle_shape_face_count(ball, &count, &error), "neither a hull nor a mesh");
    refused(jostle_shape_face(ball, 0, &face, &count, &error), "neither a hull in 3D nor a mesh");
    OK(jostle_free(ball, &error));
    const double triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    const std::uint32_t element[3] = {0, 1, 2};
    jostle_shape* mesh = nullptr;
    OK(jostle_shape_mesh(JOSTLE_3D, triangle, 3, element, 1, 0, &mesh, &error));
    refused(jostle_shape_face(mesh, 1, &face, &count, &error), "the mesh has 1 faces, and none of number 1");
    OK(jostle_shape_face_count(mesh, &count, &error));
    EXPECT_EQ(count, 1u);
    OK(jostle_free(mesh, &error));
}

} // namespace
} // namespace c_twin
