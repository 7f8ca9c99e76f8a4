/* SPDX-License-Identifier: MIT
   The C interface, by a C compiler: every function does what its C++ twin does, and says what is wrong with bad
   input. Prints what failed and returns how much. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "jostle/jostle.h"

static int failures = 0;
static jostle_error error;

#define CHECK(condition)                                                                                     \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            printf("%s:%d: %s\n", __FILE__, __LINE__, #condition);                                           \
            ++failures;                                                                                      \
        }                                                                                                    \
    } while (0)
#define OK(call)                                                                                             \
    do {                                                                                                     \
        if ((call) != JOSTLE_OK) {                                                                           \
            printf("%s:%d: %s: %s\n", __FILE__, __LINE__, #call, error.message);                             \
            ++failures;                                                                                      \
        }                                                                                                    \
    } while (0)
/* The call fails with this status, and its message has these words in it. */
#define FAILS(call, code, words)                                                                             \
    do {                                                                                                     \
        jostle_status got = (call);                                                                          \
        if (got != (code) || error.status != (code) || strstr(error.message, words) == NULL) {               \
            printf("%s:%d: %s: status %d, \"%s\"\n", __FILE__, __LINE__, #call, (int)got, error.message);    \
            ++failures;                                                                                      \
        }                                                                                                    \
    } while (0)

enum
{
    boxes_made = 300
};
typedef union numbers
{
    float f[boxes_made * 6];
    double d[boxes_made * 6];
} numbers;

static uint32_t random_state = 1;
static double next_random(void)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (random_state >> 8) / 16777216.0;
}
static int dim_of(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_2D ? 2 : 3;
}
static int is_float(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_3F;
}
static int64_t number_size(jostle_space space)
{
    return is_float(space) ? (int64_t)sizeof(float) : (int64_t)sizeof(double);
}
static void set_number(jostle_space space, numbers* all, int i, double value)
{
    if (is_float(space))
        all->f[i] = (float)value;
    else
        all->d[i] = value;
}

/* Random boxes, packed. */
static jostle_boxes make_boxes(jostle_space space, numbers* memory, int count)
{
    const int dim = dim_of(space);
    int i, d;
    for (i = 0; i < count; ++i)
        for (d = 0; d < dim; ++d) {
            const double lo = 10 * next_random();
            set_number(space, memory, i * 2 * dim + d, lo);
            set_number(space, memory, i * 2 * dim + dim + d, lo + 2 * next_random());
        }
    return jostle_boxes_strided(space, memory->f, (const char*)memory->f + dim * number_size(space),
                                (uint64_t)count, 2 * dim * number_size(space));
}

static int32_t accept_even(void* context, uint32_t a, uint32_t b)
{
    (void)context;
    return (a + b) % 2 == 0;
}
static int32_t fail_pair(void* context, uint32_t a, uint32_t b)
{
    (void)a;
    (void)b;
    return *(const int32_t*)context;
}
struct sums
{
    uint64_t pairs, calls;
    int32_t answer;
};
static int32_t count_pairs(void* context, const jostle_pair* pairs, uint64_t count, uint64_t block,
                           uint64_t part)
{
    struct sums* sums = context;
    (void)pairs;
    (void)block;
    (void)part;
    sums->pairs += count;
    ++sums->calls;
    return sums->answer;
}

static jostle_options serial_options(jostle_executor** executor)
{
    jostle_options options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    OK(jostle_executor_serial(executor, &error));
    options.executor = *executor;
    return options;
}

static void test_general(void)
{
    uint32_t major, minor, patch, threads;
    uint64_t count;
    const char* name;
    const jostle_instruction_set* sets;
    jostle_executor* executor;
    OK(jostle_version(&major, &minor, &patch, &error));
    CHECK(major + minor > 0);
    OK(jostle_status_name(JOSTLE_STALE_ID, &name, &error));
    CHECK(strcmp(name, "stale_id") == 0);
    FAILS(jostle_status_name(50, &name, &error), JOSTLE_INVALID_ARGUMENT, "50");
    OK(jostle_instruction_sets(&sets, &count, &error));
    CHECK(count >= 1 && sets[count - 1] == JOSTLE_SCALAR);
    OK(jostle_instruction_set_name(JOSTLE_SCALAR, &name, &error));
    CHECK(strcmp(name, "scalar") == 0);
    OK(jostle_executor_default(0, &executor, &error));
    OK(jostle_executor_concurrency(executor, &threads, &error));
    CHECK(threads >= 1);
    OK(jostle_free(executor, &error));
    OK(jostle_executor_default(2, &executor, &error));
    OK(jostle_free(executor, NULL));
    CHECK(jostle_version(NULL, &minor, &patch, NULL) == JOSTLE_INVALID_ARGUMENT);
}

static int32_t accept_scene_pair(void* context, uint64_t scene, uint32_t a, uint32_t b)
{
    if (context != NULL) return *(const int32_t*)context;
    return (scene + a + b) % 3 != 0;
}

/* Three scenes of 100 boxes, and an empty one in their midst: each against find() of its boxes. */
static void test_scenes(jostle_finder* finder, jostle_space space, const jostle_boxes* all,
                        jostle_results* expected)
{
    static const uint64_t offsets[] = {0, 100, 100, 200, 300}, descending[] = {0, 200, 100, 200, 300};
    uint32_t owners[boxes_made];
    jostle_scene_filter filter;
    jostle_blocks pairs, right;
    uint64_t k, i, sum = 0;
    int32_t code = -9;
    for (i = 0; i < boxes_made; ++i)
        owners[i] = (uint32_t)(i / 4);
    memset(&filter, 0, sizeof filter);
    filter.struct_size = sizeof filter;
    filter.owner.data = owners;
    filter.owner.count = boxes_made;
    filter.owner.stride = sizeof owners[0];
    filter.accept = accept_scene_pair;
    OK(jostle_finder_find_scenes(finder, space, all, offsets, 4, &filter, &pairs, &error));
    CHECK(pairs.block_count == 4 && pairs.blocks[1].count == 0 && pairs.item_size == sizeof(jostle_pair));
    for (k = 0; k < 4; ++k) {
        const jostle_pair* found = pairs.blocks[k].items;
        const jostle_pair* candidate;
        jostle_boxes scene = *all;
        uint64_t wanted = 0;
        int d;
        for (d = 0; d < dim_of(space); ++d) {
            scene.lo[d] = (const char*)all->lo[d] + (int64_t)offsets[k] * all->stride;
            scene.hi[d] = (const char*)all->hi[d] + (int64_t)offsets[k] * all->stride;
        }
        scene.count = offsets[k + 1] - offsets[k];
        OK(jostle_find_pairs(space, &scene, NULL, NULL, JOSTLE_CANONICAL, NULL, expected, &error));
        OK(jostle_results_blocks(expected, &right, &error));
        CHECK(right.block_count <= 1);
        candidate = right.count == 0 ? NULL : right.blocks[0].items;
        for (i = 0; i < right.count; ++i) {
            const uint64_t first = offsets[k];
            if (owners[first + candidate[i].a] == owners[first + candidate[i].b]) continue;
            if (!accept_scene_pair(NULL, k, candidate[i].a, candidate[i].b)) continue;
            CHECK(wanted < pairs.blocks[k].count && found[wanted].a == candidate[i].a &&
                  found[wanted].b == candidate[i].b);
            ++wanted;
        }
        CHECK(wanted == pairs.blocks[k].count);
        sum += wanted;
    }
    CHECK(sum == pairs.count && sum > 10);
    FAILS(jostle_finder_find_scenes(finder, space, all, descending, 4, NULL, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "offset 2 is 100");
    CHECK(error.index == 2);
    FAILS(jostle_finder_find_scenes(finder, space, all, offsets, 3, NULL, &pairs, &error),
          JOSTLE_SIZE_MISMATCH, "300 boxes");
    FAILS(jostle_finder_find_scenes(finder, space, all, NULL, 0, NULL, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "offsets");
    FAILS(jostle_finder_find_scenes(finder, space, all, offsets, UINT64_MAX, NULL, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "scene_count");
    filter.context = &code;
    FAILS(jostle_finder_find_scenes(finder, space, all, offsets, 4, &filter, &pairs, &error),
          JOSTLE_CALLBACK_FAILED, "-9");
    filter.struct_size = 1;
    FAILS(jostle_finder_find_scenes(finder, space, all, offsets, 4, &filter, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "struct_size");
}

static void test_pairs(jostle_space space)
{
    static numbers memory_a, memory_b;
    const jostle_boxes a = make_boxes(space, &memory_a, boxes_made),
                       b = make_boxes(space, &memory_b, boxes_made / 2);
    uint32_t owners[boxes_made];
    jostle_pair copied[boxes_made * boxes_made / 4];
    jostle_finder* finder;
    jostle_results *expected, *taken;
    jostle_blocks pairs, right;
    jostle_filter filter;
    jostle_stats stats;
    struct sums sums = {0, 0, 1};
    uint64_t sum, right_sum;
    int32_t finished, code = -7;
    int two, i;
    OK(jostle_finder_new(NULL, &finder, &error));
    OK(jostle_results_new(NULL, &expected, &error));
    OK(jostle_results_new(NULL, &taken, &error));
    memset(&filter, 0, sizeof filter);
    filter.struct_size = sizeof filter;
    filter.accept = accept_even;
    for (i = 0; i < boxes_made; ++i)
        owners[i] = (uint32_t)(i / 3);
    filter.owner.data = owners;
    filter.owner.count = boxes_made;
    filter.owner.stride = sizeof owners[0];
    for (two = 0; two < 2; ++two) {
        const jostle_boxes* second = two ? &b : NULL;
        if (two) { /* the second set needs owners, too */
            filter.owner_b = filter.owner;
            filter.owner_b.count = b.count;
        }
        OK(jostle_find_pairs_brute_force(space, &a, second, &filter, expected, &error));
        OK(jostle_results_blocks(expected, &right, &error));
        CHECK(right.count > 20 && right.item_size == sizeof(jostle_pair));
        OK(jostle_pair_checksum(&right, &right_sum, &error));

        OK(jostle_finder_find(finder, space, &a, second, &filter, JOSTLE_SORTED, &pairs, &error));
        CHECK(pairs.count == right.count);
        OK(jostle_blocks_copy(&pairs, pairs.count, copied, &error));
        CHECK(memcmp(copied, right.blocks[0].items, right.count * sizeof copied[0]) == 0);
        FAILS(jostle_blocks_copy(&pairs, pairs.count - 1, copied, &error), JOSTLE_SIZE_MISMATCH, "room");

        OK(jostle_finder_take(finder, space, &a, second, &filter, JOSTLE_CANONICAL, taken, &error));
        OK(jostle_results_blocks(taken, &pairs, &error));
        OK(jostle_pair_checksum(&pairs, &sum, &error));
        CHECK(sum == right_sum);
        OK(jostle_find_pairs(space, &a, second, &filter, JOSTLE_CANONICAL, NULL, taken, &error));
        OK(jostle_results_blocks(taken, &pairs, &error));
        OK(jostle_pair_checksum(&pairs, &sum, &error));
        CHECK(sum == right_sum);
    }
    stats.struct_size = sizeof stats;
    OK(jostle_finder_stats(finder, &stats, &error));
    CHECK(stats.objects == a.count + b.count && stats.ms_total >= 0);
    stats.struct_size = 2 * sizeof(uint64_t); /* a program that knows the first member alone */
    stats.pairs = 12345;
    OK(jostle_finder_stats(finder, &stats, &error));
    CHECK(stats.pairs == 12345);

    memset(&filter, 0, sizeof filter);
    filter.struct_size = sizeof filter;
    {
        jostle_executor* executor;
        const jostle_options options = serial_options(&executor);
        jostle_finder* serial;
        OK(jostle_finder_new(&options, &serial, &error));
        OK(jostle_free(executor, &error)); /* the finder keeps what it needs */
        OK(jostle_finder_stream(serial, space, &a, NULL, NULL, count_pairs, &sums, &finished, &error));
        OK(jostle_find_pairs_brute_force(space, &a, NULL, NULL, expected, &error));
        OK(jostle_results_blocks(expected, &right, &error));
        CHECK(finished == 1 && sums.pairs == right.count);
        sums.answer = 0;
        sums.calls = 0;
        OK(jostle_finder_stream(serial, space, &a, &b, NULL, count_pairs, &sums, &finished, &error));
        CHECK(finished == 0 && sums.calls == 1);
        sums.answer = -3;
        FAILS(jostle_finder_stream(serial, space, &a, NULL, NULL, count_pairs, &sums, &finished, &error),
              JOSTLE_CALLBACK_FAILED, "returned -3");
        CHECK(error.callback_result == -3);
        OK(jostle_free(serial, &error));
    }
    test_scenes(finder, space, &a, expected);
    filter.accept = fail_pair;
    filter.context = &code;
    FAILS(jostle_finder_find(finder, space, &a, NULL, &filter, JOSTLE_CANONICAL, &pairs, &error),
          JOSTLE_CALLBACK_FAILED, "-7");
    OK(jostle_finder_find(finder, space, &a, NULL, NULL, JOSTLE_CANONICAL, &pairs, &error));
    CHECK(pairs.count == right.count); /* as good as before */

    set_number(space, &memory_a, 2 * dim_of(space) * 5, NAN);
    FAILS(jostle_finder_find(finder, space, &a, NULL, NULL, JOSTLE_CANONICAL, &pairs, &error),
          JOSTLE_NAN_COORDINATE, "5");
    CHECK(error.index == 5);
    FAILS(jostle_boxes_check(space, &a, &error), JOSTLE_NAN_COORDINATE, "5");
    set_number(space, &memory_a, 2 * dim_of(space) * 5, 1e9);
    FAILS(jostle_boxes_check(space, &a, &error), JOSTLE_INVERTED_BOX, "5");
    OK(jostle_boxes_check(space, &b, &error));
    OK(jostle_release_memory(finder, &error));
    OK(jostle_free(finder, &error));
    OK(jostle_free(expected, &error));
    OK(jostle_free(taken, &error));
}

/* What a visitor should be handed: a list, or where there is no order something of it. */
typedef struct
{
    const jostle_lists* lists;
    const jostle_id* ids;
    uint64_t begin, end;
    int any_order, of_world;
    uint64_t calls;
    int good;
} visited;

/* The nearest shapes come as in the list. */
typedef struct closest_three
{
    const jostle_lists* lists;
    uint64_t next;
} closest_three;
static int32_t visit_closest(void* context, uint64_t id, double at, const void* details, double* bound)
{
    closest_three* seen = context;
    CHECK(id == seen->lists->ids[seen->next] && at == seen->lists->at[seen->next] && *bound >= at);
    CHECK(*(const float*)details == (float)at);
    ++seen->next;
    return 1;
}

static int32_t count_visit(void* context, uint64_t id, double at, const void* details, double* bound)
{
    visited* const seen = context;
    uint64_t k = seen->begin + seen->calls++;
    if (seen->any_order)
        for (k = seen->begin; k < seen->end; ++k)
            if ((seen->of_world ? seen->ids[seen->lists->ids[k]] : seen->lists->ids[k]) == id) break;
    seen->good += k < seen->end &&
                  (seen->of_world ? seen->ids[seen->lists->ids[k]] : seen->lists->ids[k]) == id &&
                  (seen->lists->at == NULL ? bound == NULL : seen->lists->at[k] == at && *bound >= at);
    CHECK(details == NULL);
    return 1;
}
static int32_t stop_visit(void* context, uint64_t id, double at, const void* details, double* bound)
{
    (void)id, (void)at, (void)details, (void)bound;
    ++((visited*)context)->calls;
    return 0;
}
static int32_t shrink_visit(void* context, uint64_t id, double at, const void* details, double* bound)
{
    (void)id, (void)details;
    ++((visited*)context)->calls;
    *bound = at;
    return 1;
}
static int32_t failing_visit(void* context, uint64_t id, double at, const void* details, double* bound)
{
    (void)context, (void)id, (void)at, (void)details, (void)bound;
    return -3;
}

/* The closest pairs of an index come in the order of their distances, and so do a world's. */
typedef struct
{
    uint64_t calls, at_zero, stop;
    double last;
    uint64_t a[64], b[64];
    int ascending;
} close_pairs;

static int32_t take_pair(void* context, uint64_t a, uint64_t b, double at, double* bound)
{
    close_pairs* const seen = context;
    seen->ascending &= at >= seen->last && (bound == NULL || *bound >= at);
    seen->last = at;
    seen->at_zero += at == 0;
    seen->a[seen->calls % 64] = a;
    seen->b[seen->calls % 64] = b;
    return ++seen->calls != seen->stop;
}

static void check_closest(jostle_space space, const jostle_index* index, const jostle_world* world)
{
    close_pairs touching = {0, 0, 0, 0, {0}, {0}, 1}, all = touching, some = touching, of_world = touching;
    int32_t finished = 7;
    jostle_index* empty;
    const double anywhere = HUGE_VAL;
    OK(jostle_index_pairs(index, NULL, take_pair, &touching, &finished, &error));
    CHECK(finished == 1 && touching.calls > 0 && touching.at_zero == touching.calls);
    OK(jostle_query_closest_pairs(index, NULL, anywhere, take_pair, &all, &finished, &error));
    CHECK(finished == 1 && all.ascending && all.at_zero == touching.calls);
    CHECK(all.calls == (uint64_t)boxes_made * (boxes_made - 1) / 2);
    some.stop = 64;
    OK(jostle_query_closest_pairs(index, index, anywhere, take_pair, &some, &finished, &error));
    CHECK(finished == 0 && some.calls == 64);
    of_world.stop = 1;
    OK(jostle_query_closest_pairs(world, NULL, anywhere, take_pair, &of_world, &finished, &error));
    CHECK(finished == 0 && of_world.calls == 1 && (uint32_t)of_world.a[0] < (uint32_t)of_world.b[0]);
    CHECK(of_world.at_zero == (some.at_zero > 0));
    OK(jostle_index_new(space, NULL, &empty, &error));
    OK(jostle_query_closest_pairs(index, empty, anywhere, take_pair, &some, &finished, &error));
    CHECK(finished == 1 && some.calls == 64);
    OK(jostle_free(empty, &error));
    OK(jostle_index_new(space == JOSTLE_2F ? JOSTLE_3F : JOSTLE_2F, NULL, &empty, &error));
    FAILS(jostle_index_pairs(index, empty, take_pair, &some, &finished, &error), JOSTLE_INVALID_ARGUMENT,
          "spaces");
    FAILS(jostle_query_closest_pairs(index, empty, 1, take_pair, &some, &finished, &error),
          JOSTLE_INVALID_ARGUMENT, "spaces");
    OK(jostle_free(empty, &error));
    FAILS(jostle_query_closest_pairs(world, index, 1, take_pair, &some, &finished, &error), JOSTLE_BAD_HANDLE,
          "no jostle_world but a jostle_index");
    FAILS(jostle_query_closest_pairs(index, world, 1, take_pair, &some, &finished, &error), JOSTLE_BAD_HANDLE,
          "no jostle_index but a jostle_world");
    FAILS(jostle_query_closest_pairs(index, NULL, -1, take_pair, &some, &finished, &error),
          JOSTLE_INVALID_ARGUMENT, "max_distance");
    FAILS(jostle_query_closest_pairs(world, NULL, -1, take_pair, &some, &finished, &error),
          JOSTLE_INVALID_ARGUMENT, "max_distance");
}

/* Index and world are asked the same; what each box answers is the definition. */
/* Two boxes that meet across the border, and two that meet within. */
static void test_images(jostle_space space)
{
    const double at[4] = {0.5, 9.5, 5, 5.5};
    const int dim = dim_of(space);
    jostle_images* images;
    jostle_images_view view;
    jostle_results* pairs;
    jostle_filter filter, given;
    jostle_blocks blocks;
    jostle_boxes boxes;
    numbers memory, period;
    int32_t answer = -5;
    uint32_t owner[4] = {1, 1, 2, 3};
    int i, d, round;
    for (d = 0; d < dim; ++d)
        set_number(space, &period, d, d == 0 ? 10 : 0);
    for (i = 0; i < 4; ++i)
        for (d = 0; d < dim; ++d) {
            set_number(space, &memory, i * 2 * dim + d, at[i] - 1);
            set_number(space, &memory, i * 2 * dim + dim + d, at[i] + (i < 2 ? 20 * (d != 0) : 0) + 1);
        }
    boxes = jostle_boxes_strided(space, memory.f, (const char*)memory.f + dim * number_size(space), 4,
                                 2 * dim * number_size(space));
    OK(jostle_results_new(NULL, &pairs, &error));
    OK(jostle_images_new(space, NULL, &images, &error));
    OK(jostle_images_view_read(images, &view, &error));
    CHECK(view.originals == 0 && view.boxes.count == 0);
    OK(jostle_images_build(images, &boxes, period.f, &error));
    OK(jostle_images_view_read(images, &view, &error));
    CHECK(view.originals == 4 && view.boxes.count == 5 && view.origin[4] == 1 && view.origin[3] == 3);
    CHECK(is_float(space) ? ((const float*)view.shift)[4 * dim] == -10
                          : ((const double*)view.shift)[4 * dim] == -10);
    for (round = 0; round < 4; ++round) { /* no filter, accept, owners, a callback that fails */
        memset(&given, 0, sizeof given);
        given.struct_size = sizeof given;
        if (round == 1) given.accept = accept_even;
        if (round == 2) {
            given.owner.data = owner;
            given.owner.count = 4;
            given.owner.stride = sizeof *owner;
        }
        if (round == 3) {
            given.accept = fail_pair;
            given.context = &answer;
        }
        OK(jostle_images_filter(images, round == 0 ? NULL : &given, &filter, &error));
        if (round == 3) {
            FAILS(jostle_find_pairs(space, &view.boxes, NULL, &filter, JOSTLE_SORTED, NULL, pairs, &error),
                  JOSTLE_CALLBACK_FAILED, "callback");
            CHECK(error.callback_result == answer);
            continue;
        }
        OK(jostle_find_pairs(space, &view.boxes, NULL, &filter, JOSTLE_SORTED, NULL, pairs, &error));
        OK(jostle_results_blocks(pairs, &blocks, &error));
        if (round == 0) {
            jostle_pair found[2];
            CHECK(blocks.count == 2);
            OK(jostle_blocks_copy(&blocks, 2, found, &error));
            CHECK(found[0].a == 0 && found[0].b == 4 && found[1].a == 2 && found[1].b == 3);
        } else {
            CHECK(blocks.count == (round == 1 ? 0 : 1));
        }
    }
    FAILS(jostle_images_filter(NULL, NULL, &filter, &error), JOSTLE_INVALID_ARGUMENT, "jostle_images");
    given.owner_b = given.owner;
    given.owner_b.data = owner;
    given.owner_b.count = 4;
    given.owner_b.stride = sizeof *owner;
    FAILS(jostle_images_filter(images, &given, &filter, &error), JOSTLE_INVALID_ARGUMENT, "second");
    FAILS(jostle_images_build(images, &boxes, NULL, &error), JOSTLE_INVALID_ARGUMENT, "period");
    set_number(space, &period, 0, 4);
    FAILS(jostle_images_build(images, &boxes, period.f, &error), JOSTLE_INVALID_ARGUMENT, "shorter");
    CHECK(error.index == 0);
    OK(jostle_free(images, &error));
    OK(jostle_free(NULL, &error));
    OK(jostle_free(pairs, &error));
}

/* One of some queries. */
static jostle_queries query_of(const jostle_queries* all, int i)
{
    jostle_queries one = *all;
    one.values.data = (const char*)all->values.data + i * all->values.stride;
    one.values.count = 1;
    return one;
}

static void check_answers(jostle_space space, const jostle_index* index, const jostle_world* world,
                          const jostle_id* ids, const numbers* memory)
{
    const int dim = dim_of(space), asked = 3;
    numbers given;
    jostle_frustum frusta[3];
    jostle_results *of_index, *of_world;
    int32_t any_finished;
    OK(jostle_results_new(NULL, &of_index, &error));
    OK(jostle_results_new(NULL, &of_world, &error));
    for (jostle_query_kind kind = JOSTLE_RAY; kind <= JOSTLE_NEAREST_TO_BOX; ++kind) {
        const int nearest = kind == JOSTLE_NEAREST || kind == JOSTLE_NEAREST_TO_BOX;
        const int sizes[] = {0, 2 * dim + 1, 3 * dim + 1, 2 * dim, dim + 1, dim + 1, dim + 1, 2 * dim + 1};
        const int64_t step = sizes[kind] * number_size(space);
        jostle_queries queries = {0}, two, one;
        jostle_lists lists, same;
        jostle_hit hits[3], world_hits[3];
        uint8_t any[3], world_any[3];
        uint64_t counts[3], world_counts[3];
        uint64_t q;
        int i, d;
        for (i = 0; i < asked; ++i) {
            for (d = 0; d < sizes[kind]; ++d)
                set_number(space, &given, i * sizes[kind] + d, 1 + i + next_random());
            if (kind == JOSTLE_SWEEP || kind == JOSTLE_BOX || kind == JOSTLE_NEAREST_TO_BOX)
                for (d = 0; d < dim; ++d)
                    set_number(space, &given, i * sizes[kind] + dim + d, 4 + i + next_random());
            if (nearest) set_number(space, &given, i * sizes[kind] + sizes[kind] - 1, 3);
            if (kind == JOSTLE_FRUSTUM) { /* dim + 1 numbers are one plane */
                set_number(space, &given, i * sizes[kind] + dim - 1, -1);
                frusta[i].planes = (const char*)given.f + i * step;
                frusta[i].count = 1;
            }
        }
        queries.kind = kind;
        queries.nearest = nearest ? 7 : 0;
        queries.values.data = kind == JOSTLE_FRUSTUM ? (const void*)frusta : given.f;
        queries.values.count = 3;
        queries.values.stride = kind == JOSTLE_FRUSTUM ? (int64_t)sizeof frusta[0] : step;
        two = queries;
        two.values.count = 2;
        OK(jostle_query_all(index, &queries, NULL, NULL, UINT64_MAX, of_index, &error));
        OK(jostle_query_all(world, &queries, NULL, NULL, UINT64_MAX, of_world, &error));
        OK(jostle_results_lists(of_index, &lists, &error));
        OK(jostle_results_lists(of_world, &same, &error));
        CHECK(lists.queries == 3 && same.queries == 3 && lists.count == same.count && lists.count > 0);
        CHECK((lists.at != NULL) == (kind == JOSTLE_RAY || kind == JOSTLE_SWEEP || nearest));
        for (q = 0; q < lists.count && q < same.count; ++q) {
            CHECK(same.ids[q] == ids[lists.ids[q]]);
            CHECK(lists.at == NULL || lists.at[q] == same.at[q]);
        }
        for (i = 0; i < asked; ++i) { /* box by box */
            uint64_t found = 0;
            one = query_of(&queries, i);
            for (d = 0; d < boxes_made; ++d) {
                uint8_t answers;
                double at;
                uint64_t k;
                OK(jostle_box_answers(space, &one, (const char*)memory->f + d * 2 * dim * number_size(space),
                                      &answers, &at, &error));
                found += answers;
                for (k = lists.first[i]; k < lists.first[i + 1]; ++k)
                    if (lists.ids[k] == (uint64_t)d) {
                        CHECK(answers && (lists.at == NULL || lists.at[k] == at));
                        break;
                    }
                CHECK((k < lists.first[i + 1]) == (answers != 0) || nearest);
            }
            if (nearest) found = found < 7 ? found : 7;
            CHECK(found == lists.first[i + 1] - lists.first[i]);
        }
        for (i = 0; i < asked; ++i) { /* one by one */
            visited seen = {&lists, ids, lists.first[i], lists.first[i + 1], lists.at == NULL, 0, 0, 0};
            int32_t finished = 7;
            one = query_of(&queries, i);
            OK(jostle_query_visit(index, &one, NULL, NULL, count_visit, &seen, &finished, &error));
            CHECK(finished == 1 && seen.good == (int)seen.calls);
            CHECK(seen.calls == lists.first[i + 1] - lists.first[i]);
            seen.calls = 0, seen.good = 0, seen.of_world = 1;
            OK(jostle_query_visit(world, &one, NULL, NULL, count_visit, &seen, &finished, &error));
            CHECK(finished == 1 && seen.good == (int)seen.calls);
            CHECK(seen.calls == lists.first[i + 1] - lists.first[i]);
            if (seen.calls == 0) continue;
            seen.end = seen.begin + 1, seen.calls = 0;
            OK(jostle_query_visit(index, &one, NULL, NULL, stop_visit, &seen, &finished, &error));
            CHECK(finished == 0 && seen.calls == 1);
            OK(jostle_query_visit(world, &one, NULL, NULL, stop_visit, &seen, &finished, &error));
            CHECK(finished == 0 && seen.calls == 2);
            if (lists.at == NULL) continue;
            seen.calls = 0;
            OK(jostle_query_visit(index, &one, NULL, NULL, shrink_visit, &seen, &finished, &error));
            CHECK(finished == 1 && seen.calls > 0);
            for (q = lists.first[i]; q < lists.first[i + 1]; ++q)
                CHECK((q - lists.first[i] < seen.calls) == (lists.at[q] <= lists.at[lists.first[i]]));
            CHECK(jostle_query_visit(index, &one, NULL, NULL, failing_visit, &seen, &finished, &error) ==
                  JOSTLE_CALLBACK_FAILED);
        }
        FAILS(jostle_query_visit(index, NULL, NULL, NULL, count_visit, NULL, &any_finished, &error),
              JOSTLE_INVALID_ARGUMENT, "queries");
        FAILS(jostle_query_visit(world, &one, NULL, NULL, NULL, NULL, &any_finished, &error),
              JOSTLE_INVALID_ARGUMENT, "visit");
        FAILS(jostle_query_visit(world, &two, NULL, NULL, count_visit, NULL, &any_finished, &error),
              JOSTLE_SIZE_MISMATCH, "2 queries");
        one = queries;
        one.values.stride -= 4; /* as if a number were missing */
        FAILS(jostle_query_all(index, &one, NULL, NULL, UINT64_MAX, of_world, &error),
              JOSTLE_INVALID_ARGUMENT, "the stride of queries");
        /* Backwards, and from memory where each has more behind it. */
        one = query_of(&queries, 2);
        one.values.count = 3;
        one.values.stride = -queries.values.stride;
        OK(jostle_query_all(index, &one, NULL, NULL, UINT64_MAX, of_world, &error));
        OK(jostle_results_lists(of_world, &same, &error));
        for (i = 0; i < asked; ++i)
            CHECK(same.first[3 - i] - same.first[2 - i] == lists.first[i + 1] - lists.first[i] &&
                  memcmp(same.ids + same.first[2 - i], lists.ids + lists.first[i],
                         (size_t)(lists.first[i + 1] - lists.first[i]) * sizeof *lists.ids) == 0);
        if (lists.at != NULL) {
            OK(jostle_query_first(index, &queries, NULL, NULL, hits, NULL, &error));
            OK(jostle_query_first(world, &queries, NULL, NULL, world_hits, NULL, &error));
            for (i = 0; i < asked; ++i)
                if (lists.first[i] == lists.first[i + 1])
                    CHECK(hits[i].id == UINT64_MAX && world_hits[i].id == 0);
                else {
                    CHECK(hits[i].id == lists.ids[lists.first[i]] && hits[i].at == lists.at[lists.first[i]]);
                    CHECK(world_hits[i].id == ids[hits[i].id] && world_hits[i].at == hits[i].at);
                }
            one = query_of(&queries, 1);
            OK(jostle_query_first(index, &one, NULL, NULL, &world_hits[0], NULL, &error));
            CHECK(world_hits[0].id == hits[1].id &&
                  world_hits[0].at == hits[1].at); /* alone, as in the batch */
        } else {
            FAILS(jostle_query_first(world, &queries, NULL, NULL, hits, NULL, &error),
                  JOSTLE_INVALID_ARGUMENT, "kind");
        }
        if (nearest) {
            FAILS(jostle_query_any(index, &queries, NULL, NULL, any, &error), JOSTLE_INVALID_ARGUMENT,
                  "kind");
            OK(jostle_query_all(index, &queries, NULL, NULL, 2, of_world, &error));
            OK(jostle_results_lists(of_world, &same, &error));
            for (i = 0; i < asked; ++i)
                CHECK(same.first[i + 1] - same.first[i] <= 2 &&
                      same.ids[same.first[i]] == lists.ids[lists.first[i]]);
            continue;
        }
        OK(jostle_query_any(index, &queries, NULL, NULL, any, &error));
        OK(jostle_query_any(world, &queries, NULL, NULL, world_any, &error));
        OK(jostle_query_count(index, &queries, NULL, NULL, counts, &error));
        OK(jostle_query_count(world, &queries, NULL, NULL, world_counts, &error));
        for (i = 0; i < asked; ++i) {
            CHECK(counts[i] == lists.first[i + 1] - lists.first[i] && world_counts[i] == counts[i]);
            CHECK(any[i] == (counts[i] != 0) && world_any[i] == any[i]);
        }
        /* Filters, and lists that are cut short. */
        if (counts[0] > 1) {
            jostle_query_filter filter;
            const uint64_t excluded = lists.ids[lists.first[0]], excluded_object = ids[excluded];
            uint64_t left;
            memset(&filter, 0, sizeof filter);
            filter.struct_size = sizeof filter;
            filter.exclude = &excluded;
            one = query_of(&queries, 0);
            OK(jostle_query_count(index, &one, NULL, &filter, &left, &error));
            CHECK(left == counts[0] - 1);
            filter.exclude = &excluded_object;
            OK(jostle_query_count(world, &one, NULL, &filter, &left, &error));
            CHECK(left == counts[0] - 1);
            OK(jostle_query_all(index, &one, NULL, NULL, 1, of_world, &error));
            OK(jostle_results_lists(of_world, &same, &error));
            CHECK(same.count == 1 && same.more[0] == 1);
            /* A filter for each query. */
            {
                jostle_query_filter each[3];
                uint64_t alone[3], together[3];
                uint32_t i;
                memset(each, 0, sizeof each);
                for (i = 0; i < 3; ++i) {
                    each[i].struct_size = sizeof each[i];
                    if (i != 1) each[i].exclude = &excluded;
                }
                for (i = 0; i < 3; ++i) {
                    one = query_of(&queries, (int)i);
                    OK(jostle_query_count(index, &one, NULL, &each[i], &alone[i], &error));
                }
                each[0].count = 3;
                OK(jostle_query_count(index, &queries, NULL, each, together, &error));
                CHECK(memcmp(alone, together, sizeof alone) == 0 && together[0] == counts[0] - 1 &&
                      together[1] == counts[1]);
                each[0].exclude = each[2].exclude = &excluded_object;
                OK(jostle_query_count(world, &queries, NULL, each, together, &error));
                CHECK(memcmp(alone, together, sizeof alone) == 0);
                FAILS(jostle_query_count(index, &two, NULL, each, together, &error), JOSTLE_SIZE_MISMATCH,
                      "2 queries and 3 filters");
            }
        }
    }
    OK(jostle_free(of_index, &error));
    OK(jostle_free(of_world, &error));
}

static int32_t refuse_objects(void* context, jostle_id a, jostle_id b)
{
    ++*(int*)context;
    return a != 0 && b != 0 && *(int*)context < 0;
}
static int32_t visit_three(void* context, jostle_id a, jostle_id b)
{
    return a != b && ++*(int*)context < 3;
}
static int32_t fail_answer(void* context, uint32_t question, uint64_t id)
{
    (void)context;
    (void)question;
    (void)id;
    return -11;
}
static int32_t count_drawn(void* context, const void* shown, jostle_draw_kind kind)
{
    ++((int*)context)[kind];
    return shown != NULL;
}
static int32_t fail_drawing(void* context, const void* shown, jostle_draw_kind kind)
{
    (void)context;
    (void)shown;
    (void)kind;
    return -2;
}

static void test_index_and_world(jostle_space space)
{
    static numbers memory, other, read;
    const int dim = dim_of(space);
    const jostle_boxes boxes = make_boxes(space, &memory, boxes_made);
    jostle_id ids[boxes_made], some[boxes_made];
    uint32_t indices[boxes_made], plain[boxes_made];
    uint8_t flags[boxes_made];
    double margins[boxes_made];
    jostle_object_filter filters[boxes_made];
    jostle_index* index;
    jostle_world *world, *fork;
    jostle_results *results, *expected;
    jostle_blocks pairs, right;
    const jostle_id_pair* began;
    const jostle_ended_pair* ended;
    const void* bytes;
    uint64_t count, size, sum, right_sum;
    uint32_t end;
    jostle_index_stats index_stats;
    jostle_world_stats world_stats;
    int drawn[6] = {0}, i;
    OK(jostle_results_new(NULL, &results, &error));
    OK(jostle_results_new(NULL, &expected, &error));
    for (i = 0; i < boxes_made; ++i)
        plain[i] = (uint32_t)i;

    OK(jostle_index_new(space, NULL, &index, &error));
    OK(jostle_index_insert(index, plain, &boxes, &error));
    FAILS(jostle_index_insert(index, plain, &boxes, &error), JOSTLE_INVALID_ARGUMENT, "0");
    OK(jostle_index_build(index, NULL, &boxes, &error));
    OK(jostle_size(index, &size, &error));
    CHECK(size == boxes_made);
    OK(jostle_index_boxes(index, plain, boxes_made, read.f, &error));
    CHECK(memcmp(read.f, memory.f, (size_t)(boxes_made * 2 * dim * number_size(space))) == 0);
    plain[1] = 5000;
    OK(jostle_index_contains(index, plain, 2, flags, &error));
    CHECK(flags[0] == 1 && flags[1] == 0);
    FAILS(jostle_index_boxes(index, plain, 2, read.f, &error), JOSTLE_INVALID_ARGUMENT, "5000");
    CHECK(error.index == 1);
    plain[1] = 1;
    index_stats.struct_size = sizeof index_stats;
    OK(jostle_index_stats_read(index, &index_stats, &error));
    CHECK(index_stats.objects == boxes_made);

    OK(jostle_world_new(space, NULL, &world, &error));
    OK(jostle_world_add(world, &boxes, NULL, ids, &error));
    OK(jostle_world_update(world, &error));
    OK(jostle_size(world, &size, &error));
    OK(jostle_world_index_end(world, &end, &error));
    CHECK(size == boxes_made && end == boxes_made);
    for (i = 0; i < boxes_made; ++i)
        indices[i] = (uint32_t)ids[i];
    OK(jostle_world_ids(world, indices, boxes_made, some, &error));
    CHECK(memcmp(ids, some, sizeof ids) == 0);
    check_answers(space, index, world, ids, &memory);
    check_closest(space, index, world);

    { /* Every box has its place in the order. */
        uint32_t order[boxes_made];
        uint8_t has[boxes_made] = {0};
        OK(jostle_spatial_order(space, &boxes, NULL, order, &error));
        for (i = 0; i < boxes_made; ++i) {
            CHECK(order[i] < boxes_made && has[order[i]] == 0);
            has[order[i]] = 1;
        }
        FAILS(jostle_spatial_order(space, &boxes, NULL, NULL, &error), JOSTLE_INVALID_ARGUMENT, "order");
    }

    OK(jostle_find_pairs_brute_force(space, &boxes, NULL, NULL, expected, &error));
    OK(jostle_results_blocks(expected, &right, &error));
    OK(jostle_world_began(world, &began, &count, &error));
    CHECK(count == right.count && (uint32_t)began[0].a < (uint32_t)began[0].b);
    OK(jostle_world_pairs(world, results, &error));
    OK(jostle_results_blocks(results, &pairs, &error));
    OK(jostle_pair_checksum(&pairs, &sum, &error));
    OK(jostle_pair_checksum(&right, &right_sum, &error));
    CHECK(sum == right_sum);
    OK(jostle_world_changed_pairs(world, &pairs, &error));
    CHECK(pairs.count == right.count);

    /* One by one, object by object, and all once more. */
    {
        jostle_lists lists;
        int32_t finished, any;
        int visited = 0;
        OK(jostle_world_visit_pairs(world, visit_three, &visited, &finished, &error));
        CHECK(finished == 0 && visited == 3);
        OK(jostle_world_touching(world, ids, boxes_made, results, &error));
        OK(jostle_results_lists(results, &lists, &error));
        CHECK(lists.queries == boxes_made && lists.count == 2 * right.count && lists.at == NULL);
        OK(jostle_query_bounds(world, &any, read.f, &error));
        CHECK(any == 1);
        OK(jostle_world_report_again(world, ids, NULL, boxes_made, &error));
        OK(jostle_world_update(world, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        CHECK(count == right.count);
        some[0] = began[0].a;
        some[1] = began[0].b;
        OK(jostle_world_report_again(world, some, some + 1, 1, &error));
        OK(jostle_world_update(world, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        CHECK(count == 1);
    }

    /* What is queued is seen ahead of the update, whose lists stay. */
    {
        uint64_t size, now;
        OK(jostle_size(world, &size, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        OK(jostle_world_add(world, &boxes, NULL, some, &error));
        OK(jostle_world_apply(world, &error));
        OK(jostle_size(world, &now, &error));
        CHECK(now == size + boxes_made && count == 1);
        OK(jostle_world_remove(world, some, boxes_made, &error));
        OK(jostle_world_apply(world, &error));
        OK(jostle_size(world, &now, &error));
        CHECK(now == size);
        OK(jostle_world_update(world, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        CHECK(count == 0);
    }

    /* What the caller keeps with objects and pairs. */
    {
        jostle_world* slotted;
        jostle_pair_slots *slots, *restored;
        jostle_object_options each;
        const jostle_ended_pair* gone;
        const uint32_t *began_slots, *ended_slots;
        const void* bytes;
        uint64_t data[2], i, ended_count, size;
        jostle_pair pair;
        uint32_t slot, slots_end;
        memset(&each, 0, sizeof each);
        each.struct_size = sizeof each;
        each.user_data = 1234567890123;
        OK(jostle_world_new(space, NULL, &slotted, &error));
        OK(jostle_pair_slots_new(&slots, &error));
        OK(jostle_pair_slots_new(&restored, &error));
        OK(jostle_world_add(slotted, &boxes, &each, some, &error));
        OK(jostle_world_user_data(slotted, some, 2, data, &error));
        CHECK(data[0] == 1234567890123 && data[1] == data[0]);
        data[1] = 7;
        OK(jostle_world_set_user_data(slotted, some, 2, data, &error));
        OK(jostle_world_update(slotted, &error));
        OK(jostle_world_began(slotted, &began, &count, &error));
        OK(jostle_world_ended(slotted, &gone, &ended_count, &error));
        OK(jostle_pair_slots_update(slots, began, count, gone, ended_count, &error));
        OK(jostle_pair_slots_lists(slots, &began_slots, &i, &ended_slots, &ended_count, &slots_end, &error));
        CHECK(i == count && count > 1 && ended_count == 0 && slots_end == count);
        for (i = 0; i < count; ++i)
            CHECK(began_slots[i] == i);
        pair.a = (uint32_t)began[1].b;
        pair.b = (uint32_t)began[1].a;
        OK(jostle_pair_slots_find(slots, &pair, 1, &slot, &error));
        CHECK(slot == 1);
        pair.b = pair.a;
        OK(jostle_pair_slots_find(slots, &pair, 1, &slot, &error));
        CHECK(slot == UINT32_MAX);
        OK(jostle_pair_slots_save(slots, results, &error));
        OK(jostle_results_bytes(results, &bytes, &size, &error));
        FAILS(jostle_pair_slots_restore(restored, bytes, size - 1, &error), JOSTLE_BAD_SNAPSHOT,
              "were saved");
        OK(jostle_pair_slots_restore(restored, bytes, size, &error));
        OK(jostle_world_remove(slotted, some, boxes_made, &error));
        OK(jostle_world_update(slotted, &error));
        OK(jostle_world_ended(slotted, &gone, &ended_count, &error));
        CHECK(ended_count == count);
        OK(jostle_pair_slots_update(restored, NULL, 0, gone, ended_count, &error));
        OK(jostle_pair_slots_lists(restored, &began_slots, &i, &ended_slots, &ended_count, &slots_end,
                                   &error));
        CHECK(i == 0 && ended_count == count && slots_end == count && ended_slots[1] == 1);
        FAILS(jostle_pair_slots_update(restored, NULL, 0, gone, ended_count, &error), JOSTLE_INVALID_ARGUMENT,
              "never began");
        FAILS(jostle_pair_slots_update(restored, NULL, 1, NULL, 0, &error), JOSTLE_INVALID_ARGUMENT, "began");
        OK(jostle_free(slots, &error));
        OK(jostle_free(restored, &error));
        FAILS(jostle_free(slots, &error), JOSTLE_BAD_HANDLE, "jostle_pair_slots");
        OK(jostle_world_user_data(slotted, some, 2, data, &error));
        CHECK(data[0] == 1234567890123 && data[1] == 7);
        OK(jostle_free(slotted, &error));
    }
    /* Layers change no answer. */
    {
        jostle_world* layered;
        jostle_world_options with;
        jostle_query_layer layers[9];
        jostle_query_filter by_layer;
        jostle_queries region = {0};
        jostle_asker asker;
        uint64_t found[2];
        const double everywhere[6] = {-1e9, -1e9, dim == 2 ? 1e9 : -1e9, 1e9, 1e9, 1e9};
        const float everywhere_f[6] = {-1e9f, -1e9f, dim == 2 ? 1e9f : -1e9f, 1e9f, 1e9f, 1e9f};
        memset(&with, 0, sizeof with);
        with.struct_size = sizeof with;
        for (i = 0; i < 9; ++i) {
            layers[i].category = UINT32_MAX;
            layers[i].mask = 1;
        }
        with.layer_count = 1;
        FAILS(jostle_world_new(space, &with, &layered, &error), JOSTLE_INVALID_ARGUMENT, "layers is NULL");
        with.layers = layers;
        with.layer_count = 9;
        FAILS(jostle_world_new(space, &with, &layered, &error), JOSTLE_INVALID_ARGUMENT, "9 layers");
        with.layer_count = 1;
        OK(jostle_world_new(space, &with, &layered, &error));
        OK(jostle_world_add(layered, &boxes, NULL, some, &error));
        OK(jostle_world_update(layered, &error));
        memset(&asker, 0, sizeof asker);
        asker.category = UINT32_MAX;
        asker.mask = 1;
        asker.owner = UINT32_MAX;
        memset(&by_layer, 0, sizeof by_layer);
        by_layer.struct_size = sizeof by_layer;
        by_layer.asker = &asker;
        region.kind = JOSTLE_BOX;
        region.values.data = number_size(space) == 4 ? (const void*)everywhere_f : (const void*)everywhere;
        region.values.count = 1;
        region.values.stride = 2 * dim * number_size(space);
        OK(jostle_query_count(layered, &region, NULL, &by_layer, found, &error));
        CHECK(found[0] == boxes_made);
        OK(jostle_free(layered, &error));
    }

    /* Joins are pairs between two sets. */
    OK(jostle_find_pairs_brute_force(space, &boxes, &boxes, NULL, expected, &error));
    OK(jostle_results_blocks(expected, &right, &error));
    OK(jostle_pair_checksum(&right, &right_sum, &error));
    OK(jostle_query_join(index, &boxes, NULL, results, &error));
    OK(jostle_results_blocks(results, &pairs, &error));
    OK(jostle_pair_checksum(&pairs, &sum, &error));
    CHECK(sum == right_sum);
    {
        /* An index knows no object's category: all that it filters by is given. */
        const uint64_t excluded = pairs.count == 0 ? 0 : ((const jostle_pair*)pairs.blocks[0].items)->b;
        const uint64_t before = pairs.count;
        jostle_query_filter filter;
        memset(&filter, 0, sizeof filter);
        filter.struct_size = sizeof filter;
        filter.exclude = &excluded;
        OK(jostle_query_join(index, &boxes, &filter, results, &error));
        OK(jostle_results_blocks(results, &pairs, &error));
        CHECK(pairs.count < before);
    }
    OK(jostle_query_join(world, &boxes, NULL, results, &error));
    OK(jostle_results_blocks(results, &pairs, &error));
    OK(jostle_pair_checksum(&pairs, &sum, &error));
    CHECK(sum == right_sum);

    /* Who touches whom, and pairs once more. */
    {
        jostle_lists lists;
        uint64_t i, all = 0;
        const jostle_ended_pair* ended;
        OK(jostle_world_touching(world, ids, boxes_made, results, &error));
        OK(jostle_results_lists(results, &lists, &error));
        CHECK(lists.queries == boxes_made && lists.at == NULL);
        OK(jostle_world_pairs(world, expected, &error));
        OK(jostle_results_blocks(expected, &pairs, &error));
        CHECK(lists.count == 2 * pairs.count && pairs.count > 0);
        for (i = 0; i < lists.queries; ++i)
            if (lists.first[i + 1] > lists.first[i]) break;
        OK(jostle_world_report_again(world, &ids[i], NULL, 1, &error));
        all = lists.first[i + 1] - lists.first[i];
        OK(jostle_world_update(world, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        CHECK(count == all);
        OK(jostle_world_report_again(world, &began[0].a, &began[0].b, 1, &error));
        OK(jostle_world_update(world, &error));
        OK(jostle_world_began(world, &began, &count, &error));
        CHECK(count == 1);
        OK(jostle_world_ended(world, &ended, &count, &error));
        CHECK(count == 0);
    }

    /* A snapshot, a fork, and what became of them. */
    OK(jostle_world_save(world, results, &error));
    OK(jostle_results_bytes(results, &bytes, &count, &error));
    CHECK(count > 44 * boxes_made / 2);
    OK(jostle_world_fork(world, &fork, &error));
    OK(jostle_world_restore(world, bytes, count, &error));
    FAILS(jostle_world_restore(world, bytes, count - 1, &error), JOSTLE_BAD_SNAPSHOT, "");
    OK(jostle_world_began(world, &began, &count, &error));
    OK(jostle_size(fork, &size, &error));
    CHECK(size == boxes_made);

    /* Commands. */
    make_boxes(space, &other, boxes_made);
    {
        const jostle_boxes moved =
            jostle_boxes_strided(space, other.f, (const char*)other.f + dim * number_size(space), boxes_made,
                                 2 * dim * number_size(space));
        OK(jostle_world_update_moves(world, ids, &moved, &error));
        OK(jostle_world_move(fork, ids, &moved, NULL, 0, &error));
        OK(jostle_world_update(fork, &error));
        OK(jostle_world_boxes(fork, ids, boxes_made, read.f, &error));
        CHECK(memcmp(read.f, other.f, (size_t)(boxes_made * 2 * dim * number_size(space))) == 0);
        OK(jostle_world_ended(world, &ended, &count, &error));
        CHECK(count > 0 && ended[0].reason == JOSTLE_MOVED_APART);
        OK(jostle_world_persisted(world, &pairs, &error));
        OK(jostle_world_move(fork, ids, &boxes, NULL, 1, &error));
        OK(jostle_world_move(fork, ids, &boxes, memory.f, 2, &error)); /* any displacements */
        OK(jostle_world_update(fork, &error));
        OK(jostle_world_bounds(fork, ids, boxes_made, read.f, &error));
        CHECK(memcmp(read.f, memory.f, (size_t)(boxes_made * 2 * dim * number_size(space))) != 0);
        OK(jostle_index_move(index, plain, &moved, &error));
        OK(jostle_index_boxes(index, plain, boxes_made, read.f, &error));
        CHECK(memcmp(read.f, other.f, (size_t)(boxes_made * 2 * dim * number_size(space))) == 0);
    }
    for (i = 0; i < boxes_made; ++i) {
        filters[i].category = 2;
        filters[i].mask = 1;
        filters[i].owner = UINT32_MAX;
        filters[i].is_static = 0;
        margins[i] = 0.5;
        flags[i] = i != 0;
    }
    OK(jostle_world_set_filter(world, ids, boxes_made, filters, 0, &error));
    OK(jostle_world_set_margin(world, ids, boxes_made, margins, 0, &error));
    OK(jostle_world_set_enabled(world, ids, boxes_made, flags, 0, &error));
    OK(jostle_world_resize(world, ids, 1, memory.f, 0, &error));
    OK(jostle_world_update(world, &error));
    OK(jostle_world_filters(world, ids, boxes_made, filters, &error));
    CHECK(filters[3].category == 2 && filters[3].mask == 1);
    OK(jostle_world_margins(world, ids, boxes_made, margins, &error));
    CHECK(margins[9] == 0.5);
    OK(jostle_world_enabled(world, ids, boxes_made, flags, &error));
    CHECK(flags[0] == 0 && flags[1] == 1);
    OK(jostle_world_pairs(world, results, &error));
    OK(jostle_results_blocks(results, &pairs, &error));
    CHECK(pairs.count == 0); /* category and mask never meet */
    world_stats.struct_size = sizeof world_stats;
    OK(jostle_world_stats_read(world, &world_stats, &error));
    CHECK(world_stats.objects == boxes_made && world_stats.disabled == 1 && world_stats.commands > 0);
    OK(jostle_world_explain(world, results, &error));
    OK(jostle_results_bytes(results, &bytes, &count, &error));
    CHECK(strlen(bytes) == count && count > 20);
    OK(jostle_world_draw(world, count_drawn, count_drawn, drawn, &error));
    CHECK(drawn[0] + drawn[1] + drawn[2] == boxes_made && drawn[JOSTLE_DRAW_ENDED] > 0);
    OK(jostle_world_draw(world, count_drawn, NULL, drawn, &error));
    FAILS(jostle_world_draw(world, fail_drawing, NULL, NULL, &error), JOSTLE_CALLBACK_FAILED, "-2");

    /* Mistakes name the object, and leave the world as it was. */
    OK(jostle_world_remove(world, ids, 1, &error));
    OK(jostle_world_update(world, &error));
    OK(jostle_world_contains(world, ids, 2, flags, &error));
    CHECK(flags[0] == 0 && flags[1] == 1);
    FAILS(jostle_world_boxes(world, ids, 2, read.f, &error), JOSTLE_STALE_ID, "");
    CHECK(error.index == 0);
    FAILS(jostle_world_remove(world, ids, 2, &error), JOSTLE_STALE_ID, "");
    some[0] = ids[1];
    some[1] = ids[0];
    FAILS(jostle_world_resize(world, some, 2, memory.f, 0, &error), JOSTLE_STALE_ID, "");
    CHECK(error.index == 1);
    OK(jostle_world_ids(world, indices, 1, some, &error));
    CHECK(some[0] == 0);
    {
        jostle_query_filter filter;
        jostle_queries region = {0};
        uint8_t any;
        region.kind = JOSTLE_BOX;
        region.values.data = memory.f;
        region.values.count = 1;
        region.values.stride = 2 * dim * number_size(space);
        memset(&filter, 0, sizeof filter);
        filter.struct_size = sizeof filter;
        filter.accept = fail_answer;
        OK(jostle_index_build(index, NULL, &boxes, &error));
        FAILS(jostle_query_any(index, &region, NULL, &filter, &any, &error), JOSTLE_CALLBACK_FAILED, "-11");
        FAILS(jostle_query_join(fork, &boxes, &filter, results, &error), JOSTLE_CALLBACK_FAILED, "-11");
        filter.accept = NULL;
        filter.owner.data = plain;
        filter.owner.count = boxes_made;
        filter.owner.stride = 4;
        FAILS(jostle_query_any(world, &region, NULL, &filter, &any, &error), JOSTLE_INVALID_ARGUMENT,
              "world knows");
    }
    OK(jostle_free(fork, &error));
    {
        jostle_world_options options;
        jostle_object_options object;
        int asked = 0;
        memset(&options, 0, sizeof options);
        options.struct_size = sizeof options;
        options.margin = 0.25;
        options.accept = refuse_objects;
        options.context = &asked;
        OK(jostle_world_new(space, &options, &fork, &error));
        memset(&object, 0, sizeof object);
        object.struct_size = sizeof object;
        object.margin = 0.25;
        OK(jostle_world_add(fork, &boxes, &object, some, &error));
        OK(jostle_world_update(fork, &error));
        CHECK(asked > 0);
        OK(jostle_world_began(fork, &began, &count, &error));
        CHECK(count == 0);
        OK(jostle_world_margins(fork, some, 1, margins, &error));
        CHECK(margins[0] == 0.5);
        OK(jostle_clear(fork, &error));
        OK(jostle_size(fork, &size, &error));
        CHECK(size == 0);
        OK(jostle_free(fork, &error));
    }
    OK(jostle_free(world, &error));
    OK(jostle_index_erase(index, plain, 5, &error));
    OK(jostle_size(index, &size, &error));
    CHECK(size == boxes_made - 5);
    OK(jostle_clear(index, &error));
    OK(jostle_release_memory(index, &error));
    OK(jostle_free(index, &error));
    OK(jostle_free(results, &error));
    OK(jostle_free(expected, &error));
}

static void support_of_point(void* context, const double* direction, double* point)
{
    (void)direction;
    memcpy(point, context, 3 * sizeof(double));
}
static void always_one(void* context, const jostle_pair_test_input* input,
                       void (*emit)(void* emit_context, const void* contact), void* emit_context)
{
    jostle_contact_3d contact;
    memset(&contact, 0, sizeof contact);
    contact.normal[1] = 1;
    contact.count = 1;
    contact.point[0].depth =
        0.125 + input->margin + *(const double*)context + *(double*)input->shape_a.context;
    emit(emit_context, &contact);
}

static void test_shapes_and_contacts(void)
{
    const double half[3] = {1, 1, 1}, up[3] = {0, 1, 0};
    const float corners[8][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                 {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
    const uint32_t triangle[3] = {0, 1, 2};
    const float heights[4] = {0, 0, 0, 0};
    float poses[3][13] = {{0, 0, 0, 0, 0, 0, 1}, {1.5f, 0, 0, 0, 0, 0, 1}, {9, 0, 0, 0, 0, 0, 1, -10, 0, 0}};
    double child_poses[2][7] = {{0, 0, 0, 0, 0, 0, 1}, {2, 0, 0, 0, 0, 0, 1}};
    double point[3] = {0, 0, 0}, radii[2] = {1, 2};
    float one[10], many[2][10], bounds[3][6];
    uint8_t flags[2];
    int32_t touching;
    uint64_t count;
    jostle_shape *sphere, *box, *capsule, *space_below, *hull, *mesh, *field, *compound, *custom, *flat,
        *bad = NULL;
    const jostle_shape* children[2];
    jostle_shapes *shapes, *flat_shapes, *some_shapes;
    jostle_objects objects;
    jostle_pair pairs[2] = {{0, 1}, {0, 2}};
    jostle_block block = {0, 0};
    jostle_blocks given = {0, 0, 0, 0}, contacts;
    jostle_contact_finder* finder;
    jostle_results* results;
    jostle_shape_info info;
    const double* vertices;
    const uint32_t* face;
    block.items = pairs;
    block.count = 2;
    given.blocks = &block;
    given.block_count = 1;
    given.count = 2;
    given.item_size = sizeof(jostle_pair);

    OK(jostle_shape_sphere(3, 1, &sphere, &error));
    OK(jostle_shape_box(3, half, 0, &box, &error));
    OK(jostle_shape_capsule(3, 1, 0.5, &capsule, &error));
    OK(jostle_shape_half_space(3, up, 0, &space_below, &error));
    OK(jostle_shape_hull(JOSTLE_3F, corners, 8, 0, &hull, &error));
    OK(jostle_shape_mesh(JOSTLE_3F, corners, 8, triangle, 1, 0, &mesh, &error));
    OK(jostle_shape_height_field(JOSTLE_3F, heights, 2, 2, 1, 1, 0, &field, &error));
    OK(jostle_shape_custom(3, 20, 1, support_of_point, point, &custom, &error));
    OK(jostle_shape_sphere(2, 1, &flat, &error));
    children[0] = sphere;
    children[1] = hull;
    OK(jostle_shape_compound(3, children, child_poses[0], 2, &compound, &error));
    OK(jostle_shape_vertices(hull, &vertices, &count, &error));
    CHECK(count == 8 && vertices[3] == 1);
    OK(jostle_shape_face_count(hull, &count, &error));
    CHECK(count == 6);
    OK(jostle_shape_face(hull, 5, &face, &count, &error));
    CHECK(count == 4 && face[0] < 8);
    FAILS(jostle_shape_face(hull, 6, &face, &count, &error), JOSTLE_INVALID_ARGUMENT, "6");
    FAILS(jostle_shape_face(sphere, 0, &face, &count, &error), JOSTLE_INVALID_ARGUMENT, "hull");
    OK(jostle_shape_face_count(mesh, &count, &error));
    CHECK(count == 1);
    OK(jostle_shape_face(mesh, 0, &face, &count, &error));
    CHECK(count == 3 && face[0] == triangle[0] && face[1] == triangle[1] && face[2] == triangle[2]);
    OK(jostle_shape_vertices(mesh, &vertices, &count, &error));
    CHECK(count == 8 && vertices[3] == corners[1][0] && vertices[23] == corners[7][2]);
    OK(jostle_shape_info_read(capsule, &info, &error));
    CHECK(info.dim == 3 && info.type == JOSTLE_SHAPE_CAPSULE && info.radius == 0.5 && info.size[1] == 1);
    OK(jostle_shape_info_read(custom, &info, &error));
    CHECK(info.type == 20 && info.context == point);
    FAILS(jostle_shape_sphere(3, -1, &bad, &error), JOSTLE_INVALID_ARGUMENT, "-1");
    {
        const float corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
        const jostle_shape_type types[5] = {JOSTLE_SHAPE_ROUNDED_BOX, JOSTLE_SHAPE_ROUNDED_HULL,
                                            JOSTLE_SHAPE_CYLINDER, JOSTLE_SHAPE_CONE, JOSTLE_SHAPE_ELLIPSOID};
        jostle_shape* made[5];
        int k;
        OK(jostle_shape_box(3, half, 0.5, &made[0], &error));
        OK(jostle_shape_hull(JOSTLE_3F, corners, 4, 0.5, &made[1], &error));
        OK(jostle_shape_cylinder(1, 0.5, &made[2], &error));
        OK(jostle_shape_cone(1, 0.5, &made[3], &error));
        OK(jostle_shape_ellipsoid(3, half, &made[4], &error));
        for (k = 0; k < 5; ++k) {
            OK(jostle_shape_info_read(made[k], &info, &error));
            CHECK(info.type == types[k] && info.dim == 3 && info.radius == (k < 2 ? 0.5 : 0));
            OK(jostle_free(made[k], &error));
        }
        FAILS(jostle_shape_cylinder(1, -1, &bad, &error), JOSTLE_INVALID_ARGUMENT, "radius is -1");
        FAILS(jostle_shape_box(4, half, 1, &bad, &error), JOSTLE_INVALID_ARGUMENT, "dim is 4");
    }
    FAILS(jostle_shape_sphere(4, 1, &bad, &error), JOSTLE_INVALID_ARGUMENT, "dim");
    FAILS(jostle_shape_height_field(JOSTLE_2F, heights, 2, 2, 1, 1, 0, &bad, &error), JOSTLE_INVALID_ARGUMENT,
          "3D");
    FAILS(jostle_shape_custom(3, 3, 1, NULL, NULL, &bad, &error), JOSTLE_INVALID_ARGUMENT, "type");
    FAILS(jostle_shape_hull(JOSTLE_3F, NULL, 8, 0, &bad, &error), JOSTLE_INVALID_ARGUMENT, "points");
    CHECK(bad == NULL);

    OK(jostle_shapes_new(3, &shapes, &error));
    OK(jostle_shapes_new(2, &flat_shapes, &error));
    OK(jostle_shapes_add(shapes, compound, 1, &error));
    OK(jostle_shapes_add_spheres(shapes, radii, 2, &error));
    OK(jostle_shapes_add_boxes(shapes, half, 1, &error));
    OK(jostle_shapes_add_capsules(shapes, radii, radii, 2, &error));
    OK(jostle_size(shapes, &count, &error));
    CHECK(count == 6);
    radii[1] = -5;
    FAILS(jostle_shapes_add_spheres(shapes, radii, 2, &error), JOSTLE_INVALID_ARGUMENT, "-5");
    CHECK(error.index == 1);
    OK(jostle_size(shapes, &count, &error));
    CHECK(count == 6);
    FAILS(jostle_shapes_add(flat_shapes, sphere, 1, &error), JOSTLE_INVALID_ARGUMENT, "2D");
    FAILS(jostle_shapes_add(shapes, sphere, UINT64_MAX, &error), JOSTLE_TOO_MANY_OBJECTS, "shapes");
    FAILS(jostle_shapes_set(shapes, 6, sphere, &error), JOSTLE_INVALID_ARGUMENT, "6");
    OK(jostle_clear(shapes, &error));
    OK(jostle_shapes_add(shapes, hull, 1, &error));
    OK(jostle_shapes_add(shapes, sphere, 2, &error));
    OK(jostle_shapes_set(shapes, 0, compound, &error)); /* at 0: a sphere of 1; at 2: a cube up to 3 */
    OK(jostle_free(compound, &error));                  /* the list keeps what it needs */
    OK(jostle_free(hull, &error));
    OK(jostle_shapes_new(3, &some_shapes, &error));
    OK(jostle_shapes_add_from(some_shapes, shapes, 0, 3, &error));
    FAILS(jostle_shapes_add_from(some_shapes, shapes, 2, 2, &error), JOSTLE_INVALID_ARGUMENT, "3 shapes");
    FAILS(jostle_shapes_add_from(some_shapes, shapes, UINT64_MAX, 2, &error), JOSTLE_INVALID_ARGUMENT,
          "3 shapes");
    FAILS(jostle_shapes_add_from(some_shapes, flat_shapes, 0, 0, &error), JOSTLE_INVALID_ARGUMENT, "3D");
    FAILS(jostle_shapes_add_from(some_shapes, NULL, 0, 0, &error), JOSTLE_INVALID_ARGUMENT, "is NULL");
    OK(jostle_free(shapes, &error)); /* the other list keeps it, too */
    shapes = some_shapes;

    objects.shapes = shapes;
    objects.poses.data = poses;
    objects.poses.count = 3;
    objects.poses.stride = sizeof poses[0];
    OK(jostle_bounds(JOSTLE_3F, &objects, 0.5, NULL, bounds, &error));
    CHECK(bounds[1][0] <= 0 && bounds[1][0] > -0.01 && bounds[1][3] >= 3 && bounds[0][3] >= 3.5);
    FAILS(jostle_bounds(JOSTLE_2F, &objects, 0, NULL, bounds, &error), JOSTLE_INVALID_ARGUMENT, "2D");
    FAILS(jostle_bounds(JOSTLE_3F, &objects, -1, NULL, bounds, &error), JOSTLE_INVALID_ARGUMENT, "");

    OK(jostle_contact_finder_new(JOSTLE_3F, NULL, &finder, &error));
    OK(jostle_results_new(NULL, &results, &error));
    OK(jostle_contact_finder_find(finder, &objects, NULL, &given, 0.01, &contacts, &error));
    CHECK(contacts.count == 2 && contacts.item_size == sizeof(jostle_contact_3f)); /* of both children */
    {
        const jostle_contact_3f* contact = contacts.blocks[0].items;
        CHECK(contact->pair.a == 0 && contact->pair.b == 1 && contact->part_a == 0 && contact->count == 1);
        CHECK(contact->normal[0] == 1 && contact->point[0].depth == 0.5f);
    }
    OK(jostle_contact_finder_find_points(finder, &objects, NULL, &given, 0.01, &contacts, &error));
    CHECK(contacts.count == 2 && contacts.item_size == sizeof(jostle_point_contact_3f));
    {
        const jostle_point_contact_3f* contact = contacts.blocks[0].items;
        CHECK(contact->pair.a == 0 && contact->pair.b == 1 && contact->normal[0] == 1 &&
              contact->depth == 0.5f);
    }
    OK(jostle_contact_finder_find(finder, &objects, &objects, &given, 0, &contacts, &error));
    CHECK(contacts.count == 2);
    OK(jostle_contact_finder_touching(finder, &objects, NULL, &given, flags, &error));
    CHECK(flags[0] == 1 && flags[1] == 0);
    OK(jostle_contact_finder_distances(finder, &objects, NULL, &given, HUGE_VAL, many, &error));
    CHECK(many[0][0] < 0 && many[1][0] > 4.9f && many[1][0] < 5.1f);
    {
        const uint64_t offsets[4] = {0, 0, 1, 2};
        uint64_t first[3], nearest[3];
        float least[3][10];
        OK(jostle_contact_finder_first_touching(finder, &objects, NULL, &given, offsets, 3, first, &error));
        CHECK(first[0] == UINT64_MAX && first[1] == 0 && first[2] == UINT64_MAX);
        OK(jostle_contact_finder_first_touching(finder, &objects, &objects, &given, offsets, 3, first,
                                                &error));
        CHECK(first[1] == 0);
        OK(jostle_contact_finder_least_distances(finder, &objects, NULL, &given, offsets, 3, HUGE_VAL, least,
                                                 nearest, &error));
        CHECK(nearest[0] == UINT64_MAX && nearest[1] == 0 && nearest[2] == 1);
        CHECK(least[0][0] == HUGE_VALF && least[1][0] < 0 && least[2][0] == many[1][0]);
        OK(jostle_contact_finder_least_distances(finder, &objects, &objects, &given, offsets, 3, 1, least,
                                                 nearest, &error));
        CHECK(nearest[1] == 0 && nearest[2] == UINT64_MAX);
        FAILS(jostle_contact_finder_first_touching(finder, &objects, NULL, &given, NULL, 3, first, &error),
              JOSTLE_INVALID_ARGUMENT, "offsets");
        FAILS(jostle_contact_finder_first_touching(finder, &objects, NULL, &given, offsets, 2, first, &error),
              JOSTLE_SIZE_MISMATCH, "there are 2 pairs");
        FAILS(jostle_contact_finder_least_distances(finder, &objects, NULL, &given, offsets, 3, 1, least,
                                                    NULL, &error),
              JOSTLE_INVALID_ARGUMENT, "nearest");
    }
    OK(jostle_contact_finder_distances(finder, &objects, &objects, &given, 1, many, &error));
    CHECK(many[1][0] == HUGE_VALF);
    OK(jostle_contact_finder_impacts(finder, &objects, NULL, &given, 0.001, many, &error));
    CHECK(many[0][0] == 0 && many[1][0] > 0.49f && many[1][0] < 0.51f);
    pairs[1].b = 3;
    FAILS(jostle_contact_finder_touching(finder, &objects, NULL, &given, flags, &error),
          JOSTLE_INVALID_ARGUMENT, "3");
    pairs[1].b = 2;
    given.count = 3;
    FAILS(jostle_contact_finder_touching(finder, &objects, NULL, &given, flags, &error), JOSTLE_SIZE_MISMATCH,
          "3");
    given.count = 2;
    given.item_size = 12;
    FAILS(jostle_contact_finder_touching(finder, &objects, NULL, &given, flags, &error),
          JOSTLE_INVALID_ARGUMENT, "12");
    given.item_size = sizeof(jostle_pair);
    {
        /* Two blocks are as good as one. */
        jostle_block two[2];
        jostle_blocks split = given;
        two[0].items = pairs;
        two[1].items = pairs + 1;
        two[0].count = two[1].count = 1;
        split.blocks = two;
        split.block_count = 2;
        OK(jostle_contact_finder_touching(finder, &objects, NULL, &split, flags, &error));
        CHECK(flags[0] == 1 && flags[1] == 0);
    }
    {
        double more = 0.25;
        point[0] = 1; /* what support_of_point answers, and the first number of the shape's context */
        OK(jostle_shapes_set(shapes, 0, custom, &error));
        OK(jostle_contact_finder_touching(finder, &objects, NULL, &given, flags, &error));
        CHECK(flags[0] == 1 && flags[1] == 0); /* the point (1, 0, 0) in a sphere around (1.5, 0, 0) */
        OK(jostle_contact_finder_add_test(finder, 20, JOSTLE_SHAPE_SPHERE, always_one, &more, &error));
        OK(jostle_contact_finder_find(finder, &objects, NULL, &given, 0, &contacts, &error));
        CHECK(contacts.count == 2);
        CHECK(((const jostle_contact_3f*)contacts.blocks[0].items)->point[0].depth == 1.375f);
        FAILS(jostle_contact_finder_add_test(finder, -1, 0, always_one, NULL, &error),
              JOSTLE_INVALID_ARGUMENT, "-1");
    }
    OK(jostle_touching(JOSTLE_3F, sphere, poses[0], box, poses[1], &touching, &error));
    CHECK(touching == 1);
    OK(jostle_contacts(JOSTLE_3F, sphere, poses[0], box, poses[1], 0, results, &error));
    OK(jostle_results_blocks(results, &contacts, &error));
    CHECK(contacts.count == 1);
    OK(jostle_distance(JOSTLE_3F, sphere, poses[0], box, poses[2], 100, one, &error));
    CHECK(one[0] == 7);
    OK(jostle_distance(JOSTLE_3F, sphere, poses[0], box, poses[2], 1, one, &error));
    CHECK(one[0] == HUGE_VALF);
    OK(jostle_time_of_impact(JOSTLE_3F, sphere, poses[0], sphere, poses[2], 0.001, one, &error));
    CHECK(one[0] > 0.69f && one[0] < 0.71f);
    FAILS(jostle_touching(JOSTLE_3F, sphere, poses[0], flat, poses[1], &touching, &error),
          JOSTLE_INVALID_ARGUMENT, "3D");
    {
        float rays[2][7] = {{4, 0, 0, 2, 0, 0, 100}, {4, 0, 0, 0, 1, 0, 100}};
        float ways[3][3] = {{10, 0, 0}, {0, 10, 0}, {0, 0, 0}};
        const jostle_pair ray_pairs[2] = {{0, 2}, {1, 2}};
        const jostle_block block = {ray_pairs, 2};
        const jostle_blocks cast_pairs = {&block, 1, 2, sizeof ray_pairs[0]};
        jostle_values given_rays = {rays, 2, sizeof rays[0]};
        const jostle_values given_ways = {ways, 3, sizeof ways[0]};
        jostle_cast_hit_3f hits[3];
        OK(jostle_cast_ray(JOSTLE_3F, sphere, poses[2], rays[0], hits, &error));
        CHECK(hits[0].fraction == 2 && hits[0].normal[0] == -1 && hits[0].point[0] == -1 &&
              hits[0].part == 0);
        OK(jostle_cast_ray(JOSTLE_3F, sphere, poses[2], rays[1], hits, &error));
        CHECK(hits[0].fraction == HUGE_VALF);
        OK(jostle_cast_shape(JOSTLE_3F, sphere, poses[0], ways[0], sphere, poses[2], hits, &error));
        CHECK(hits[0].fraction > 0.6999f && hits[0].fraction <= 0.7f && hits[0].normal[0] == -1);
        OK(jostle_cast_shape(JOSTLE_3F, sphere, poses[0], ways[1], sphere, poses[2], hits, &error));
        CHECK(hits[0].fraction == HUGE_VALF);
        FAILS(jostle_cast_ray(JOSTLE_3F, sphere, poses[2], NULL, hits, &error), JOSTLE_INVALID_ARGUMENT,
              "ray is NULL");
        objects.shapes = shapes;
        OK(jostle_clear(shapes, &error));
        OK(jostle_shapes_add(shapes, sphere, 3, &error));
        OK(jostle_contact_finder_ray_casts(finder, &given_rays, &objects, &cast_pairs, hits, &error));
        CHECK(hits[0].fraction == 2 && hits[1].fraction == HUGE_VALF);
        OK(jostle_contact_finder_shape_casts(finder, &objects, &given_ways, &objects, &cast_pairs, hits,
                                             &error));
        CHECK(hits[0].fraction <= 0.7f && hits[1].fraction == HUGE_VALF);
        {
            /* Against all three at once: the one at x = 8 is met, in an index and in a world. */
            float shape_boxes[3][6];
            jostle_index* shape_index = NULL;
            jostle_world* shape_world = NULL;
            jostle_boxes boxes_of_shapes;
            jostle_queries casts = {0}, near = {0};
            jostle_shapes* one_shape = NULL;
            jostle_lists lists;
            jostle_blocks all_blocks;
            jostle_query_filter filters[3];
            jostle_id world_ids[3];
            jostle_hit found[3];
            uint64_t left_out = 2;
            uint64_t numbers_of[3];
            uint8_t any[3];
            int32_t finished = 7;
            float distances[3][10];
            const float no_further[3] = {0.5f, 0.5f, 0.5f};
            casts.kind = JOSTLE_RAY;
            casts.values = given_rays;
            {
                jostle_objects odd = objects;
                odd.poses.stride = 24;
                FAILS(jostle_bounds(JOSTLE_3F, &odd, 0, NULL, shape_boxes, &error), JOSTLE_INVALID_ARGUMENT,
                      "the stride of poses is 24 bytes, and one of them takes 28");
                odd.poses.stride = 0; /* all at one place */
                OK(jostle_bounds(JOSTLE_3F, &odd, 0, NULL, shape_boxes, &error));
                CHECK(memcmp(shape_boxes[0], shape_boxes[2], sizeof shape_boxes[0]) == 0);
            }
            OK(jostle_bounds(JOSTLE_3F, &objects, 0, NULL, shape_boxes, &error));
            boxes_of_shapes =
                jostle_boxes_strided(JOSTLE_3F, shape_boxes[0], shape_boxes[0] + 3, 3, sizeof shape_boxes[0]);
            OK(jostle_index_new(JOSTLE_3F, NULL, &shape_index, &error));
            OK(jostle_index_build(shape_index, NULL, &boxes_of_shapes, &error));
            OK(jostle_world_new(JOSTLE_3F, NULL, &shape_world, &error));
            OK(jostle_world_add(shape_world, &boxes_of_shapes, NULL, world_ids, &error));
            OK(jostle_world_update(shape_world, &error));
            OK(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error));
            CHECK(found[0].id == 2 && found[0].at == 2 && hits[0].fraction == 2 && hits[0].point[0] == -1);
            CHECK(found[1].id == UINT64_MAX && found[1].at == HUGE_VAL && hits[1].fraction == HUGE_VALF);
            casts.values.data = rays[1];
            casts.values.count = 1;
            OK(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error));
            CHECK(found[0].id == UINT64_MAX && found[0].at == HUGE_VAL && hits[0].fraction == HUGE_VALF);
            casts.values = given_rays;
            OK(jostle_query_first(shape_world, &casts, &objects, NULL, found, NULL, &error));
            CHECK(found[0].id == world_ids[2] && found[0].at == 2 && found[1].id == 0);
            OK(jostle_query_any(shape_index, &casts, &objects, NULL, any, &error));
            OK(jostle_query_count(shape_world, &casts, &objects, NULL, numbers_of, &error));
            CHECK(any[0] == 1 && any[1] == 0 && numbers_of[0] == 1 && numbers_of[1] == 0);
            OK(jostle_query_all(shape_index, &casts, &objects, NULL, 1, results, &error));
            OK(jostle_results_lists(results, &lists, &error));
            OK(jostle_results_blocks(results, &all_blocks, &error));
            CHECK(lists.queries == 2 && lists.count == 1 && lists.first[1] == 1 && lists.ids[0] == 2 &&
                  lists.at[0] == 2 && lists.more[0] == 0 && all_blocks.count == 1);
            CHECK(((const jostle_cast_hit_3f*)all_blocks.blocks[0].items)->normal[0] == -1);
            OK(jostle_query_all(shape_world, &casts, &objects, NULL, 0, results, &error));
            OK(jostle_results_lists(results, &lists, &error));
            CHECK(lists.count == 0 && lists.more[0] == 1 && lists.more[1] == 0);
            /* One filter for each: the first leaves the sphere out, the second nothing. */
            memset(filters, 0, sizeof filters);
            filters[0].struct_size = filters[1].struct_size = filters[2].struct_size = sizeof filters[0];
            filters[0].exclude = &left_out;
            filters[0].count = 2;
            OK(jostle_query_first(shape_index, &casts, &objects, filters, found, hits, &error));
            CHECK(found[0].id == UINT64_MAX);
            OK(jostle_query_first(shape_index, &casts, &objects, filters + 1, found, hits, &error));
            CHECK(found[0].id == 2);
            left_out = UINT64_MAX; /* what a hit has that is none */
            OK(jostle_query_first(shape_index, &casts, &objects, filters, found, hits, &error));
            CHECK(found[0].id == 2);
            filters[0].count = 3;
            FAILS(jostle_query_first(shape_index, &casts, &objects, filters, found, hits, &error),
                  JOSTLE_SIZE_MISMATCH, "3 filters");
            /* Shapes that move. */
            casts.shapes = &objects;
            FAILS(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error),
                  JOSTLE_INVALID_ARGUMENT, "have no shapes");
            casts.kind = JOSTLE_SHAPE_SWEEP;
            FAILS(jostle_query_first(shape_index, &casts, NULL, NULL, found, hits, &error),
                  JOSTLE_INVALID_ARGUMENT, "where objects is NULL");
            FAILS(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error),
                  JOSTLE_SIZE_MISMATCH, "2 values");
            casts.values = given_ways;
            OK(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error));
            CHECK(found[0].id == 0 && hits[0].fraction == 0); /* itself */
            /* Shapes that stay touch themselves alone. */
            casts.kind = JOSTLE_POSED_SHAPE;
            FAILS(jostle_query_count(shape_index, &casts, &objects, NULL, numbers_of, &error),
                  JOSTLE_INVALID_ARGUMENT, "values.count is 3 and must be 0");
            memset(&casts.values, 0, sizeof casts.values);
            OK(jostle_query_count(shape_index, &casts, &objects, NULL, numbers_of, &error));
            CHECK(numbers_of[2] == 1);
            OK(jostle_query_all(shape_world, &casts, &objects, NULL, UINT64_MAX, results, &error));
            OK(jostle_results_lists(results, &lists, &error));
            CHECK(lists.queries == 3 && lists.at == NULL && lists.ids[lists.first[2]] == world_ids[2]);
            FAILS(jostle_results_blocks(results, &all_blocks, &error), JOSTLE_INVALID_ARGUMENT, "");
            FAILS(jostle_query_first(shape_index, &casts, &objects, NULL, found, hits, &error),
                  JOSTLE_INVALID_ARGUMENT, "JOSTLE_SHAPE_SWEEP");
            /* The nearest, which is itself. */
            near.kind = JOSTLE_NEAREST_TO_SHAPE;
            near.shapes = &objects;
            OK(jostle_query_first(shape_index, &near, &objects, NULL, found, distances, &error));
            CHECK(found[2].id == 2 && found[2].at == -2 && distances[2][0] == -2);
            near.values.data = no_further;
            near.values.count = 3;
            near.values.stride = sizeof no_further[0];
            OK(jostle_query_first(shape_world, &near, &objects, NULL, found, distances, &error));
            CHECK(found[2].id == world_ids[2] && distances[2][0] == -2);
            near.nearest = 3;
            memset(&near.values, 0, sizeof near.values);
            OK(jostle_query_all(shape_index, &near, &objects, NULL, UINT64_MAX, results, &error));
            OK(jostle_results_lists(results, &lists, &error));
            OK(jostle_results_blocks(results, &all_blocks, &error));
            CHECK(lists.count == 9 && all_blocks.count == 9 && all_blocks.item_size == sizeof distances[0] &&
                  lists.ids[6] == 2 && lists.at[6] == -2 && lists.at[6] <= lists.at[7] &&
                  lists.at[7] <= lists.at[8]);
            {
                static jostle_objects third;
                jostle_queries one = near;
                closest_three seen = {&lists, 6};
                third = objects;
                third.poses.data = (const char*)objects.poses.data + 2 * objects.poses.stride;
                third.poses.count = 1;
                one.shapes = &third;
                FAILS(jostle_query_visit(shape_index, &one, &objects, NULL, visit_closest, &seen, &finished,
                                         &error),
                      JOSTLE_SIZE_MISMATCH, "3 shapes, 1 poses");
                OK(jostle_shapes_set_repeats(shapes, 1, &error));
                FAILS(jostle_query_visit(shape_index, &one, &objects, NULL, visit_closest, &seen, &finished,
                                         &error),
                      JOSTLE_SIZE_MISMATCH, "3 shapes, 1 poses");
                OK(jostle_shapes_set_repeats(shapes, 0, &error));
                near.shapes = NULL;
                FAILS(jostle_query_visit(shape_index, &near, &objects, NULL, visit_closest, &seen, &finished,
                                         &error),
                      JOSTLE_INVALID_ARGUMENT, "shapes is NULL");
                OK(jostle_shapes_new(3, &one_shape, &error));
                OK(jostle_shapes_add(one_shape, sphere, 1, &error));
                third.shapes = one_shape;
                OK(jostle_query_visit(shape_index, &one, &objects, NULL, visit_closest, &seen, &finished,
                                      &error));
                CHECK(finished == 1 && seen.next == 9);
                OK(jostle_free(one_shape, &error));
            }
            OK(jostle_free(shape_index, &error));
            OK(jostle_free(shape_world, &error));
        }
        given_rays.count = 1;
        FAILS(jostle_contact_finder_ray_casts(finder, &given_rays, &objects, &cast_pairs, hits, &error),
              JOSTLE_INVALID_ARGUMENT, "pair 1");
    }
    {
        /* A tetrahedron, then without one of its sides. */
        const float corners[4][3] = {{0, 0, 0}, {4, 0, 0}, {0, 4, 0}, {0, 0, 4}};
        const uint32_t sides[4][3] = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
        const float asked[3][3] = {{11, 1, 1}, {9, 1, 1}, {10, 1, 1}};
        const float place[7] = {10, 0, 0, 0, 0, 0, 1};
        const double own[3] = {1, 1, 1};
        const jostle_values points = {asked, 3, sizeof asked[0]};
        jostle_shape* closed_shape = NULL;
        jostle_closed_mesh* closed = NULL;
        uint8_t inside[3] = {9, 9, 9};
        float far_away[3][7];
        int32_t number = 9;
        OK(jostle_shape_mesh(JOSTLE_3F, corners, 4, sides[0], 3, 0, &closed_shape, &error));
        FAILS(jostle_closed_mesh_new(closed_shape, &closed, &error), JOSTLE_INVALID_ARGUMENT,
              "isn't closed: the side of triangle 0 between the vertices 0 and 2");
        FAILS(jostle_closed_mesh_new(sphere, &closed, &error), JOSTLE_INVALID_ARGUMENT, "another type");
        FAILS(jostle_closed_mesh_new(flat, &closed, &error), JOSTLE_INVALID_ARGUMENT, "3D");
        OK(jostle_free(closed_shape, &error));
        OK(jostle_shape_mesh(JOSTLE_3F, corners, 4, sides[0], 4, 0, &closed_shape, &error));
        OK(jostle_closed_mesh_new(closed_shape, &closed, &error));
        OK(jostle_free(closed_shape, &error));
        OK(jostle_closed_mesh_winding_numbers(closed, own, 1, &number, &error));
        CHECK(number == 1);
        OK(jostle_closed_mesh_contains(closed, JOSTLE_3F, place, &points, NULL, inside, &error));
        CHECK(inside[0] == 1 && inside[1] == 0 && inside[2] == 1);
        OK(jostle_closed_mesh_contains(closed, JOSTLE_3F, NULL, &points, NULL, inside, &error));
        CHECK(inside[0] == 0);
        OK(jostle_closed_mesh_signed_distances(closed, JOSTLE_3F, place, &points, NULL, far_away, &error));
        CHECK(far_away[0][0] < -0.57f && far_away[0][0] > -0.58f && far_away[1][0] == 1 &&
              far_away[1][1] == -1 && far_away[1][4] == 0 && far_away[1][5] == 1);
        FAILS(jostle_closed_mesh_contains(closed, JOSTLE_2F, NULL, &points, NULL, inside, &error),
              JOSTLE_INVALID_ARGUMENT, "JOSTLE_3F or JOSTLE_3D");
        FAILS(jostle_closed_mesh_contains(closed, JOSTLE_3F, NULL, NULL, NULL, inside, &error),
              JOSTLE_INVALID_ARGUMENT, "points is NULL");
        OK(jostle_free(closed, &error));
        FAILS(jostle_free(closed, &error), JOSTLE_BAD_HANDLE, "jostle_closed_mesh");
    }
    FAILS(jostle_distance(JOSTLE_3F, sphere, poses[0], NULL, poses[1], 1, one, &error),
          JOSTLE_INVALID_ARGUMENT, "b is NULL");
    OK(jostle_free(finder, &error));
    OK(jostle_free(results, &error));
    OK(jostle_free(shapes, &error));
    OK(jostle_free(flat_shapes, &error));
    OK(jostle_free(sphere, &error));
    OK(jostle_free(box, &error));
    OK(jostle_free(capsule, &error));
    OK(jostle_free(space_below, &error));
    OK(jostle_free(mesh, &error));
    OK(jostle_free(field, &error));
    OK(jostle_free(custom, &error));
    OK(jostle_free(flat, &error));
}

static int32_t run_serially(void* context, uint32_t count, void (*task)(void* task_context, uint32_t i),
                            void* task_context)
{
    uint32_t i;
    const int32_t answer = *(const int32_t*)context;
    for (i = 0; i < count && answer == 0; ++i)
        task(task_context, i);
    return answer;
}
/* An allocator that counts, and refuses when it is told to. */
struct memory
{
    int64_t bytes;
    int refuse;
};
static void* allocate(void* context, uint64_t size, uint64_t alignment)
{
    struct memory* memory = context;
    char *got, *aligned;
    if (memory->refuse) return NULL;
    got = malloc((size_t)(size + alignment + sizeof(char*)));
    if (got == NULL) return NULL;
    memory->bytes += (int64_t)size;
    aligned = got + sizeof(char*);
    aligned += alignment - (uintptr_t)aligned % alignment;
    memcpy(aligned - sizeof(char*), &got, sizeof(char*)); /* in front: what free() wants */
    return aligned;
}
static void deallocate(void* context, void* given, uint64_t size, uint64_t alignment)
{
    char* got;
    (void)alignment;
    memcpy(&got, (char*)given - sizeof(char*), sizeof(char*));
    ((struct memory*)context)->bytes -= (int64_t)size;
    free(got);
}

static int32_t add_block(void* context, const void* items, uint64_t count, uint64_t first, jostle_work work)
{
    (void)items;
    (void)first;
    (void)work;
    *(uint64_t*)context += count;
    return count < 1000 ? 0 : -4;
}
static int32_t add_items(void* context, uint64_t begin, uint64_t end, jostle_work work)
{
    (void)work;
    *(uint64_t*)context += end - begin;
    return 0;
}

static void test_hosts_and_responses(void)
{
    static numbers memory;
    const jostle_boxes boxes = make_boxes(JOSTLE_3F, &memory, boxes_made);
    int32_t answer = 0;
    uint64_t items = 0;
    struct memory counted = {0, 0};
    jostle_allocator allocator;
    jostle_options options;
    jostle_process_options process;
    jostle_executor* executor;
    jostle_finder* finder;
    jostle_results* results;
    jostle_blocks pairs;
    double sums[10];
    const jostle_block all_of_them = {memory.f, 1000};
    const jostle_blocks many = {&all_of_them, 1, 1000, 4};
    const double numbers_given[4] = {1, 5, 3, 2};
    const uint32_t objects[4] = {0, 1, 1, 9};
    OK(jostle_executor_callback(2, run_serially, &answer, &executor, &error));
    memset(&allocator, 0, sizeof allocator);
    allocator.struct_size = sizeof allocator;
    allocator.context = &counted;
    allocator.allocate = allocate;
    allocator.deallocate = deallocate;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.executor = executor;
    options.allocator = &allocator;
    options.instruction_set = JOSTLE_SCALAR;
    OK(jostle_finder_new(&options, &finder, &error));
    OK(jostle_results_new(NULL, &results, &error));
    counted.refuse = 1;
    FAILS(jostle_finder_take(finder, JOSTLE_3F, &boxes, NULL, NULL, 0, results, &error), JOSTLE_OUT_OF_MEMORY,
          "memory");
    counted.refuse = 0;
    answer = -9; /* so few boxes are searched without it */
    memset(&process, 0, sizeof process);
    process.struct_size = sizeof process;
    process.executor = executor;
    FAILS(jostle_process_items(100000, add_items, &items, &process, &error), JOSTLE_CALLBACK_FAILED, "-9");
    items = 0;
    answer = 0;
    OK(jostle_finder_take(finder, JOSTLE_3F, &boxes, NULL, NULL, 0, results, &error));
    CHECK(counted.bytes > 0);
    OK(jostle_free(finder, &error));
    OK(jostle_results_blocks(results, &pairs, &error));
    CHECK(pairs.count > 20);

    OK(jostle_process_blocks(&pairs, add_block, &items, &process, &error));
    CHECK(items == pairs.count);
    process.block_items = 1000;
    FAILS(jostle_process_blocks(&many, add_block, &items, &process, &error), JOSTLE_CALLBACK_FAILED, "-4");
    process.block_items = 0;
    items = 0;

    OK(jostle_sum_by_object(JOSTLE_DOUBLE, 1, objects, numbers_given, 4, &options, 10, sums, &error));
    CHECK(sums[1] == 8 && sums[9] == 2 && sums[5] == 0);
    FAILS(jostle_sum_by_object(JOSTLE_DOUBLE, 1, objects, numbers_given, 4, NULL, 9, sums, &error),
          JOSTLE_INVALID_ARGUMENT, "objects[3] is 9, and there are 9 objects");
    CHECK(error.index == 3 && sums[1] == 8);
    FAILS(jostle_sum_by_object(JOSTLE_DOUBLE, 9, objects, numbers_given, 4, NULL, 10, sums, &error),
          JOSTLE_INVALID_ARGUMENT, "9");
    FAILS(jostle_sum_by_object(4, 1, objects, numbers_given, 4, NULL, 10, sums, &error),
          JOSTLE_INVALID_ARGUMENT, "4");

    OK(jostle_process_items(1000, add_items, &items, &process, &error));
    CHECK(items == 1000);
    OK(jostle_free(executor, &error));
    OK(jostle_free(results, &error)); /* gives the finder's memory back, long after the finder */
    CHECK(counted.bytes == 0);
}

static void test_bad_input(void)
{
    static numbers memory;
    jostle_boxes boxes = make_boxes(JOSTLE_3F, &memory, 10), wrong;
    jostle_options options;
    struct
    {
        jostle_options known;
        uint64_t from_the_future;
    } newer;
    jostle_finder *finder, *untouched = NULL;
    jostle_index* index;
    jostle_results* results;
    jostle_blocks pairs;
    jostle_lists lists;
    uint64_t size, nothing[4] = {0, 0, 0, 0};
    int i;
    int32_t any;
    float box[6];
    OK(jostle_finder_new(NULL, &finder, &error));
    OK(jostle_index_new(JOSTLE_3F, NULL, &index, &error));
    OK(jostle_results_new(NULL, &results, &error));

    FAILS(jostle_finder_find(NULL, JOSTLE_3F, &boxes, NULL, NULL, 0, &pairs, &error), JOSTLE_INVALID_ARGUMENT,
          "jostle_finder is NULL");
    FAILS(jostle_finder_find((jostle_finder*)index, JOSTLE_3F, &boxes, NULL, NULL, 0, &pairs, &error),
          JOSTLE_BAD_HANDLE, "no jostle_finder");
    FAILS(jostle_finder_find((jostle_finder*)nothing, JOSTLE_3F, &boxes, NULL, NULL, 0, &pairs, &error),
          JOSTLE_BAD_HANDLE, "no jostle_finder");
    FAILS(jostle_size((const char*)nothing + 1, &size, &error), JOSTLE_BAD_HANDLE, "");
    FAILS(jostle_size(finder, &size, &error), JOSTLE_BAD_HANDLE, "a jostle_finder has no size");
    FAILS(jostle_size(index, NULL, &error), JOSTLE_INVALID_ARGUMENT, "size is NULL");
    FAILS(jostle_clear(results, &error), JOSTLE_BAD_HANDLE, "a jostle_results can't be cleared");
    FAILS(jostle_clear(NULL, &error), JOSTLE_INVALID_ARGUMENT, "handle is NULL");
    FAILS(jostle_release_memory(results, &error), JOSTLE_BAD_HANDLE, "a jostle_results has no memory");
    FAILS(jostle_index_contains((const jostle_index*)finder, NULL, 0, NULL, &error), JOSTLE_BAD_HANDLE,
          "no jostle_index but a jostle_finder");
    FAILS(jostle_query_bounds(finder, &any, box, &error), JOSTLE_BAD_HANDLE,
          "no jostle_index or jostle_world but a jostle_finder");
    FAILS(jostle_query_bounds(nothing, &any, box, &error), JOSTLE_BAD_HANDLE,
          "no jostle_index or jostle_world");
    FAILS(jostle_query_bounds(NULL, &any, box, &error), JOSTLE_INVALID_ARGUMENT,
          "the jostle_index or jostle_world is NULL");
    FAILS(jostle_free(nothing, &error), JOSTLE_BAD_HANDLE, "no handle");
    FAILS(jostle_free(&finder, &error), JOSTLE_BAD_HANDLE, "no handle"); /* not what it points to */
    FAILS(jostle_free((char*)index + 1, &error), JOSTLE_BAD_HANDLE, "no handle");
    OK(jostle_free(NULL, &error));
    OK(jostle_free(index, &error));
    FAILS(jostle_size(index, &size, &error), JOSTLE_BAD_HANDLE, "jostle_index was freed");
    FAILS(jostle_free(index, &error), JOSTLE_BAD_HANDLE, "jostle_index was freed");
    for (i = 0; i < 2000; ++i) { /* more than are remembered: none leaks */
        OK(jostle_index_new(JOSTLE_2D, NULL, &index, &error));
        OK(jostle_free(index, &error));
    }
    FAILS(jostle_finder_find(finder, 0, &boxes, NULL, NULL, 0, &pairs, &error), JOSTLE_INVALID_ARGUMENT,
          "space is 0");
    FAILS(jostle_finder_find(finder, JOSTLE_3F, NULL, NULL, NULL, 0, &pairs, &error), JOSTLE_INVALID_ARGUMENT,
          "a is NULL");
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &boxes, NULL, NULL, 2, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "order");
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &boxes, NULL, NULL, 0, NULL, &error), JOSTLE_INVALID_ARGUMENT,
          "pairs");
    wrong = boxes;
    wrong.hi[2] = NULL;
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "a::hi[2] is NULL");
    wrong = boxes;
    wrong.lo[0] = (const char*)boxes.lo[0] + 1;
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "aligned");
    wrong = boxes;
    wrong.stride = 6;
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error),
          JOSTLE_INVALID_ARGUMENT, "stride");
    wrong = boxes;
    wrong.count = UINT64_MAX / 8;
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error),
          JOSTLE_TOO_MANY_OBJECTS, "a");
    wrong.count = UINT64_C(1) << 33;
    FAILS(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error),
          JOSTLE_TOO_MANY_OBJECTS, "");
    wrong = boxes;
    wrong.count = 0;
    wrong.lo[0] = NULL;
    OK(jostle_finder_find(finder, JOSTLE_3F, &wrong, NULL, NULL, 0, &pairs, &error));
    CHECK(pairs.count == 0);

    FAILS(jostle_results_lists(results, &lists, &error), JOSTLE_INVALID_ARGUMENT, "lists");
    OK(jostle_finder_take(finder, JOSTLE_3F, &boxes, NULL, NULL, 0, results, &error));
    FAILS(jostle_results_lists(results, &lists, &error), JOSTLE_INVALID_ARGUMENT, "lists");

    /* Options of programs compiled earlier and later. */
    memset(&options, 0, sizeof options);
    FAILS(jostle_finder_new(&options, &untouched, &error), JOSTLE_INVALID_ARGUMENT, "struct_size is 0");
    CHECK(untouched == NULL);
    options.struct_size = sizeof(uint64_t);
    options.instruction_set = 77; /* not read */
    OK(jostle_finder_new(&options, &untouched, &error));
    OK(jostle_free(untouched, &error));
    options.struct_size = sizeof options;
    FAILS(jostle_finder_new(&options, &untouched, &error), JOSTLE_INVALID_ARGUMENT, "77");
    memset(&newer, 0, sizeof newer);
    newer.known.struct_size = sizeof newer;
    OK(jostle_finder_new(&newer.known, &untouched, &error));
    OK(jostle_free(untouched, &error));
    newer.from_the_future = 1;
    FAILS(jostle_finder_new(&newer.known, &untouched, &error), JOSTLE_INVALID_ARGUMENT, "doesn't know");

    OK(jostle_free(finder, &error));
    OK(jostle_free(results, &error));
}

/* The file itself is read by the C++ tests of recordings. */
static void test_recorder(jostle_space space)
{
    const char* const path = "c_api_test.jrec";
    jostle_error error;
    jostle_recorder* recorder = NULL;
    numbers memory;
    const jostle_boxes boxes = make_boxes(space, &memory, boxes_made);
    FILE* file;

    FAILS(jostle_recorder_new(space, "no such folder/a.jrec", 60, NULL, &recorder, &error), JOSTLE_FILE_ERROR,
          "no such folder/a.jrec: can't be written: No such file");
    CHECK(recorder == NULL);
    FAILS(jostle_recorder_new(space, NULL, 60, NULL, &recorder, &error), JOSTLE_INVALID_ARGUMENT, "path");
    OK(jostle_recorder_new(space, path, 60, "a test", &recorder, &error));
    OK(jostle_recorder_frame(recorder, &boxes, &error));
    OK(jostle_recorder_frame(recorder, &boxes, &error));
    OK(jostle_recorder_close(recorder, &error));
    FAILS(jostle_recorder_frame(recorder, &boxes, &error), JOSTLE_FILE_ERROR, "closed");
    OK(jostle_free(recorder, &error));
    file = fopen(path, "rb");
    CHECK(file != NULL && fgetc(file) == 'J');
    if (file != NULL) fclose(file);
    remove(path);
}

int main(void)
{
    jostle_space space;
    test_general();
    for (space = JOSTLE_2F; space <= JOSTLE_3D; ++space) {
        test_pairs(space);
        test_images(space);
        test_index_and_world(space);
        test_recorder(space);
    }
    test_shapes_and_contacts();
    test_hosts_and_responses();
    test_bad_input();
    printf(failures == 0 ? "all good\n" : "%d failures\n", failures);
    return failures == 0 ? 0 : 1;
}
