// SPDX-License-Identifier: MIT
// Batches of queries allocate nothing once the handles have grown, and keep apart what is asked at one time.
#include "twin.hpp"

#include <algorithm>

#include "tests/global_new.hpp"

namespace c_twin {
namespace {

class CMemory : public CTwin
{
  protected:
    static constexpr std::size_t n = 100, queries = 40;

    CMemory()
    {
        Random random(5);
        boxes = random_boxes(random, n);
        for (const Aabb3f& box : boxes)
            poses.push_back({{(box.lo[0] + box.hi[0]) / 2, box.lo[1], box.lo[2]}, {0, 0, 0, 1}});
        EXPECT_EQ(jostle_executor_serial(&executor, nullptr), JOSTLE_OK);
        options.executor = executor;
        EXPECT_EQ(jostle_shapes_new(3, &shapes, nullptr), JOSTLE_OK);
        const std::vector<double> radii(n, 0.4);
        EXPECT_EQ(jostle_shapes_add_spheres(shapes, radii.data(), n, nullptr), JOSTLE_OK);
        objects = {shapes, values_of(poses)};
        EXPECT_EQ(jostle_shapes_new(3, &more_shapes, nullptr), JOSTLE_OK);
        EXPECT_EQ(jostle_shapes_add_from(more_shapes, shapes, 0, queries, nullptr), JOSTLE_OK);
        askers = {more_shapes, {poses.data(), queries, sizeof poses[0]}};
        EXPECT_EQ(jostle_shapes_new(3, &one_shape, nullptr), JOSTLE_OK);
        EXPECT_EQ(jostle_shapes_add_from(one_shape, shapes, 0, 1, nullptr), JOSTLE_OK);
        for (std::size_t i = 0; i < 7 * queries; ++i)
            numbers.push_back(static_cast<float>(10 * random.unit()));
        std::sort(numbers.begin(), numbers.end()); // as boxes they aren't inverted
        std::fill_n(planes, 4, 1.f);
        frustums.assign(queries, {planes, 1});
        filters.assign(queries, options_of<jostle_query_filter>());
        filters[0].count = queries;
    }
    ~CMemory() override { jostle_free(one_shape, nullptr); }
    void make_index()
    {
        const jostle_boxes all = view(boxes);
        OK(jostle_index_new(JOSTLE_3F, &options, &index, &error));
        OK(jostle_index_build(index, nullptr, &all, &error));
    }

    /// So many queries of a kind, with or without numbers of the kind's own.
    [[nodiscard]] jostle_queries asked(jostle_query_kind kind, std::size_t size, bool of_shapes) const
    {
        jostle_queries given{};
        given.kind = kind;
        given.nearest = 3;
        if (kind == JOSTLE_FRUSTUM)
            given.values = values_of(frustums);
        else if (size != 0)
            given.values = {numbers.data(), queries, static_cast<std::int64_t>(size * sizeof(float))};
        if (of_shapes) given.shapes = &askers;
        return given;
    }
    /// Everything that can be asked.
    void ask(const void* handle)
    {
        const auto each = [&](const jostle_queries& given, const jostle_objects* of, bool ordered,
                              bool nearest) {
            for (const jostle_query_filter* filter :
                 {static_cast<jostle_query_filter*>(nullptr), filters.data()}) {
                if (!nearest) {
                    OK(jostle_query_any(handle, &given, of, filter, any, &error));
                    OK(jostle_query_count(handle, &given, of, filter, counts, &error));
                }
                if (ordered) {
                    OK(jostle_query_first(handle, &given, of, filter, hits, details, &error));
                }
                OK(jostle_query_all(handle, &given, of, filter, UINT64_MAX, results, &error));
            }
            // One alone.
            jostle_queries one = given;
            if (one.values.count != 0) one.values.count = 1;
            const jostle_objects asker = {one_shape, {poses.data(), 1, sizeof poses[0]}};
            if (one.shapes != nullptr) one.shapes = &asker;
            OK(jostle_query_all(handle, &one, of, nullptr, UINT64_MAX, results, &error));
        };
        each(asked(JOSTLE_RAY, 7, false), nullptr, true, false);
        each(asked(JOSTLE_FRUSTUM, 0, false), nullptr, false, false);
        each(asked(JOSTLE_NEAREST, 4, false), nullptr, true, true);
        each(asked(JOSTLE_NEAREST_TO_BOX, 7, false), nullptr, true, true);
        each(asked(JOSTLE_RAY, 7, false), &objects, true, false);
        each(asked(JOSTLE_SHAPE_SWEEP, 3, true), &objects, true, false);
        each(asked(JOSTLE_POSED_SHAPE, 0, true), &objects, false, false);
        each(asked(JOSTLE_NEAREST_TO_SHAPE, 1, true), &objects, true, true);
    }
    void ask_again(const void* handle)
    {
        ask(handle);
        const std::uint64_t before = global_new::calls;
        ask(handle);
        ask(handle);
        EXPECT_EQ(global_new::calls, before);
    }

    jostle_options options = options_of<jostle_options>();
    std::vector<Aabb3f> boxes;
    std::vector<jostle::Pose3f> poses;
    std::vector<float> numbers;
    float planes[4];
    std::vector<jostle_frustum> frustums;
    std::vector<jostle_query_filter> filters;
    jostle_objects objects{}, askers{};
    jostle_shapes* one_shape = nullptr;
    std::uint8_t any[queries];
    std::uint64_t counts[queries];
    jostle_hit hits[queries];
    alignas(8) unsigned char details[queries * 128];
};

TEST_F(CMemory, BatchesToAnIndexAllocateNothingAgain)
{
    make_index();
    ask_again(index);
    OK(jostle_release_memory(index, &error));
    ask_again(index);
}

TEST_F(CMemory, BatchesToAWorldAllocateNothingAgain)
{
    const jostle_boxes all = view(boxes);
    auto how = options_of<jostle_world_options>();
    how.common = &options;
    std::vector<jostle_id> ids(n);
    OK(jostle_world_new(JOSTLE_3F, &how, &world, &error));
    OK(jostle_world_add(world, &all, nullptr, ids.data(), &error));
    OK(jostle_world_update(world, &error));
    ask_again(world);
    const auto touching = [&] { OK(jostle_world_touching(world, ids.data(), n, results, &error)); };
    touching();
    const std::uint64_t before = global_new::calls;
    touching();
    EXPECT_EQ(global_new::calls, before);
}

TEST_F(CMemory, ReleasedMemoryIsGone)
{
    make_index();
    const jostle_queries given = asked(JOSTLE_NEAREST_TO_SHAPE, 1, true);
    const auto blocks = [] { return global_new::blocks.load(); };
    const std::int64_t before = blocks();
    OK(jostle_query_first(index, &given, &objects, nullptr, hits, details, &error));
#if JOSTLE_OWN_NEW
    EXPECT_GT(blocks(), before);
#endif
    OK(jostle_release_memory(index, &error));
    EXPECT_LE(blocks(), before);
}

/// Asks as many other queries while the call around it goes on.
struct Asking
{
    const jostle_index* index;
    const jostle_queries* queries;
    const jostle_objects* objects;
    std::uint32_t calls = 0;

    static std::int32_t accept(void* context, std::uint32_t, std::uint64_t)
    {
        auto& me = *static_cast<Asking*>(context);
        if (++me.calls % 16 != 1) return 1;
        jostle_hit found[40];
        return jostle_query_first(me.index, me.queries, me.objects, nullptr, found, nullptr, nullptr) ==
                       JOSTLE_OK
                   ? 1
                   : -1;
    }
};

TEST_F(CMemory, ACallbackThatAsksHasMemoryOfItsOwn)
{
    make_index();
    const jostle_queries given = asked(JOSTLE_NEAREST, 4, false);
    jostle_hit expected[queries];
    OK(jostle_query_first(index, &given, nullptr, nullptr, expected, nullptr, &error));
    jostle_queries inner = given;
    static_assert(queries == 40);
    inner.values.data = numbers.data() + 3 * queries;
    Asking asking{index, &inner, nullptr};
    auto filter = options_of<jostle_query_filter>();
    filter.accept = Asking::accept;
    filter.context = &asking;
    for (int round = 0; round < 2; ++round) {
        OK(jostle_query_first(index, &given, nullptr, &filter, hits, nullptr, &error));
        EXPECT_GE(asking.calls, 16u);
        for (std::size_t i = 0; i < queries; ++i) {
            EXPECT_EQ(hits[i].id, expected[i].id);
            EXPECT_EQ(hits[i].at, expected[i].at);
        }
    }
}

} // namespace
} // namespace c_twin
