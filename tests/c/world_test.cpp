// SPDX-License-Identifier: MIT
// A world in C.
#include <algorithm>
#include <cstring>
#include <vector>

#include "tests/c/twin.hpp"

namespace c_twin {
namespace {

/// Boxes all of which touch.
std::vector<Aabb3f> heap(std::size_t count)
{
    std::vector<Aabb3f> boxes;
    for (std::size_t i = 0; i < count; ++i)
        boxes.push_back({{0, 0, 0}, {1, 1, 1 + static_cast<float>(i)}});
    return boxes;
}

class CWorld : public CTwin
{
  protected:
    void make(double margin = 0, jostle_accept_object_pair_function accept = nullptr, void* context = nullptr)
    {
        auto options = options_of<jostle_world_options>();
        options.margin = margin;
        options.accept = accept;
        options.context = context;
        ASSERT_EQ(jostle_world_new(JOSTLE_3F, &options, &world, &error), JOSTLE_OK);
    }
    void add(const std::vector<Aabb3f>& boxes, const jostle_object_options* options = nullptr)
    {
        const jostle_boxes all = view(boxes);
        ids.resize(ids.size() + boxes.size());
        ASSERT_EQ(jostle_world_add(world, &all, options, &ids[ids.size() - boxes.size()], &error), JOSTLE_OK)
            << error.message;
    }
    void update() { ASSERT_EQ(jostle_world_update(world, &error), JOSTLE_OK) << error.message; }
    [[nodiscard]] std::uint64_t began()
    {
        const jostle_id_pair* pairs = nullptr;
        std::uint64_t count = 0;
        EXPECT_EQ(jostle_world_began(world, &pairs, &count, &error), JOSTLE_OK);
        return count;
    }
    [[nodiscard]] std::uint64_t ended()
    {
        const jostle_ended_pair* pairs = nullptr;
        std::uint64_t count = 0;
        EXPECT_EQ(jostle_world_ended(world, &pairs, &count, &error), JOSTLE_OK);
        return count;
    }
    [[nodiscard]] std::uint64_t persisted()
    {
        jostle_blocks pairs{};
        EXPECT_EQ(jostle_world_persisted(world, &pairs, &error), JOSTLE_OK);
        return items_of<jostle_pair>(pairs).size();
    }
    [[nodiscard]] std::uint64_t changed()
    {
        jostle_blocks pairs{};
        EXPECT_EQ(jostle_world_changed_pairs(world, &pairs, &error), JOSTLE_OK);
        return items_of<jostle_pair>(pairs).size();
    }
    [[nodiscard]] std::vector<Aabb3f> bounds()
    {
        std::vector<Aabb3f> boxes(ids.size());
        EXPECT_EQ(jostle_world_bounds(world, ids.data(), ids.size(), boxes.data(), &error), JOSTLE_OK);
        return boxes;
    }

    std::vector<jostle_id> ids;
};

TEST_F(CWorld, DefaultsOfAFilterAreThoseOfAnObjectThatIsGivenNone)
{
    make(0);
    add(heap(1));
    update();
    jostle_object_filter told;
    OK(jostle_world_filters(world, ids.data(), 1, &told, &error));
    const jostle_object_filter defaults = JOSTLE_OBJECT_FILTER_DEFAULTS;
    EXPECT_EQ(told.category, defaults.category);
    EXPECT_EQ(told.mask, defaults.mask);
    EXPECT_EQ(told.owner, defaults.owner);
    EXPECT_EQ(told.is_static, defaults.is_static);
}

TEST_F(CWorld, WhatNewObjectsAreLikeArrives)
{
    make(0.25);
    const jostle_object_filter filter{6, 5, 7, 1};
    auto options = options_of<jostle_object_options>();
    options.filter = &filter;
    options.margin = 0.5;
    options.disabled = 1;
    add(heap(1), &options);
    add(heap(1));
    update();
    jostle_object_filter told[2];
    double margins[2];
    std::uint8_t enabled[2];
    OK(jostle_world_filters(world, ids.data(), 2, told, &error));
    OK(jostle_world_margins(world, ids.data(), 2, margins, &error));
    OK(jostle_world_enabled(world, ids.data(), 2, enabled, &error));
    EXPECT_EQ(told[0].category, 6u);
    EXPECT_EQ(told[0].mask, 5u);
    EXPECT_EQ(told[0].owner, 7u);
    EXPECT_EQ(told[0].is_static, 1);
    EXPECT_EQ(told[1].category, 1u);
    EXPECT_EQ(told[1].mask, UINT32_MAX);
    EXPECT_EQ(told[1].owner, UINT32_MAX);
    EXPECT_EQ(told[1].is_static, 0);
    EXPECT_EQ(margins[0], 0.75);
    EXPECT_EQ(margins[1], 0.25);
    EXPECT_EQ(enabled[0], 0);
    EXPECT_EQ(enabled[1], 1);
    EXPECT_EQ(bounds()[0].lo[0], -0.75f);
    EXPECT_EQ(bounds()[1].hi[1], 1.25f);
}

TEST_F(CWorld, EachNewObjectHasOptionsOfItsOwn)
{
    make(0.25);
    constexpr std::size_t n = 5;
    // In structs of a later version that is longer, or with members of the caller's own behind them.
    struct Longer
    {
        jostle_object_options options;
        std::uint64_t zero;
    };
    jostle_object_filter filters[n];
    std::vector<Longer> of_each(n, Longer{});
    for (std::uint32_t i = 0; i < n; ++i) {
        filters[i] = {1u << i, 5 + i, 7 * i, static_cast<std::int32_t>(i % 2)};
        of_each[i].options.struct_size = sizeof(Longer);
        if (i != 3) of_each[i].options.filter = &filters[i];
        of_each[i].options.margin = i;
        of_each[i].options.disabled = i == 1 ? 1 : 0;
        of_each[i].options.user_data = 100 + i;
    }
    filters[3] = JOSTLE_OBJECT_FILTER_DEFAULTS;
    of_each[0].options.count = n;
    add(heap(n), &of_each[0].options);
    update();
    jostle_object_filter told[n];
    double margins[n];
    std::uint8_t enabled[n];
    std::uint64_t data[n];
    OK(jostle_world_filters(world, ids.data(), n, told, &error));
    OK(jostle_world_margins(world, ids.data(), n, margins, &error));
    OK(jostle_world_enabled(world, ids.data(), n, enabled, &error));
    OK(jostle_world_user_data(world, ids.data(), n, data, &error));
    for (std::size_t i = 0; i < n; ++i) {
        EXPECT_EQ(std::memcmp(&told[i], &filters[i], sizeof told[i]), 0) << i;
        EXPECT_EQ(margins[i], 0.25 + static_cast<double>(i));
        EXPECT_EQ(enabled[i], i != 1);
        EXPECT_EQ(data[i], 100 + i);
    }

    const std::vector<Aabb3f> more = heap(n);
    const jostle_boxes all = view(more);
    jostle_id none[n] = {};
    const auto refused = [&](jostle_status status, const char* why) {
        EXPECT_EQ(jostle_world_add(world, &all, &of_each[0].options, none, &error), status);
        EXPECT_NE(std::strstr(error.message, why), nullptr) << error.message;
        EXPECT_EQ(none[0], 0u);
    };
    of_each[0].options.count = n - 1;
    refused(JOSTLE_SIZE_MISMATCH, "there are 5 boxes and 4 options: give none, one, or one for each");
    of_each[0].options.count = n;
    of_each[3].options.margin = -1;
    refused(JOSTLE_INVALID_ARGUMENT, "margin");
    of_each[3].options.margin = 0;
    of_each[2].zero = 1;
    refused(JOSTLE_INVALID_ARGUMENT, "doesn't know");
    of_each[2].zero = 0;
    of_each[0].options.struct_size = sizeof(Longer) - 4;
    refused(JOSTLE_INVALID_ARGUMENT, "struct_size");
    update();
    std::uint64_t size = 0;
    OK(jostle_size(world, &size, &error));
    EXPECT_EQ(size, n);
    of_each[0].options.struct_size = sizeof(Longer);
    of_each[0].options.count = 1; // of all
    add(more, &of_each[0].options);
    update();
    OK(jostle_world_margins(world, ids.data() + n, n, margins, &error));
    EXPECT_EQ(std::vector<double>(margins, margins + n), std::vector<double>(n, 0.25));
}

// The neighbours of neighbours: the ids that are asked about lie in the results that are filled.
TEST_F(CWorld, AsksAboutIdsInTheSameResults)
{
    make(0);
    Random random(6);
    const std::vector<Aabb3f> boxes = random_boxes(random, 300, 6);
    const jostle_boxes given = view(boxes);
    std::vector<jostle_id> all(boxes.size());
    OK(jostle_world_add(world, &given, nullptr, all.data(), &error));
    update();
    jostle_lists lists{};
    OK(jostle_world_touching(world, all.data(), 20, results, &error));
    OK(jostle_results_lists(results, &lists, &error));
    const std::vector<jostle_id> near(lists.ids, lists.ids + lists.count);
    ASSERT_GT(near.size(), 20u);
    OK(jostle_world_touching(world, lists.ids, lists.count, results, &error));
    OK(jostle_results_lists(results, &lists, &error));
    const std::vector<jostle_id> found(lists.ids, lists.ids + lists.count);
    OK(jostle_world_touching(world, near.data(), near.size(), results, &error));
    OK(jostle_results_lists(results, &lists, &error));
    EXPECT_EQ(found, std::vector<jostle_id>(lists.ids, lists.ids + lists.count));
}

TEST_F(CWorld, OfEachCommandTheGreaterSequenceWins)
{
    make();
    add(heap(3));
    update();
    const std::vector<Aabb3f> there(3, {{5, 0, 0}, {6, 1, 1}}), elsewhere(3, {{7, 0, 0}, {8, 1, 1}});
    const jostle_boxes first = view(there), second = view(elsewhere);
    const float way[3][3] = {{1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
    const auto is_at = [&](float x, float further = 0) {
        const std::vector<Aabb3f> now = bounds();
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_EQ(now[i].lo[0], x);
            EXPECT_EQ(now[i].hi[0], x + 1 + further * static_cast<float>(i + 1));
        }
    };
    OK(jostle_world_move(world, ids.data(), &first, nullptr, 9, &error));
    OK(jostle_world_move(world, ids.data(), &second, nullptr, 3, &error));
    update();
    is_at(5);
    OK(jostle_world_move(world, ids.data(), &second, way, 9, &error));
    OK(jostle_world_move(world, ids.data(), &first, way, 3, &error));
    update();
    is_at(7, 1);
    OK(jostle_world_move(world, ids.data(), &first, nullptr, 9, &error));
    OK(jostle_world_move(world, ids.data(), &second, nullptr, 3, &error));
    update();
    is_at(5);
    const float sizes[3][3] = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}},
                others[3][3] = {{4, 4, 4}, {4, 4, 4}, {4, 4, 4}};
    OK(jostle_world_resize(world, ids.data(), 3, sizes, 9, &error));
    OK(jostle_world_resize(world, ids.data(), 3, others, 3, &error));
    update();
    is_at(5);
    EXPECT_EQ(bounds()[2].hi[1], 1.5f);
    EXPECT_EQ(bounds()[2].hi[2], 2);
    jostle_object_filter filters[3] = {{1, 2, 3, 0}, {4, 5, 6, 1}, {7, 8, 9, 0}}, none[3] = {};
    OK(jostle_world_set_filter(world, ids.data(), 3, filters, 9, &error));
    OK(jostle_world_set_filter(world, ids.data(), 3, none, 3, &error));
    double margins[3] = {0.5, 1, 1.5}, zeros[3] = {};
    OK(jostle_world_set_margin(world, ids.data(), 3, margins, 9, &error));
    OK(jostle_world_set_margin(world, ids.data(), 3, zeros, 3, &error));
    std::uint8_t enabled[3] = {1, 0, 1}, all[3] = {1, 1, 1};
    OK(jostle_world_set_enabled(world, ids.data(), 3, enabled, 9, &error));
    OK(jostle_world_set_enabled(world, ids.data(), 3, all, 3, &error));
    update();
    OK(jostle_world_filters(world, ids.data(), 3, none, &error));
    EXPECT_EQ(std::memcmp(none, filters, sizeof filters), 0);
    OK(jostle_world_margins(world, ids.data(), 3, zeros, &error));
    EXPECT_TRUE(std::equal(zeros, zeros + 3, margins));
    OK(jostle_world_enabled(world, ids.data(), 3, all, &error));
    EXPECT_TRUE(std::equal(all, all + 3, enabled));
}

TEST_F(CWorld, ListsAreThoseOfTheLastUpdateWhateverEndsThem)
{
    make();
    add(heap(4));
    update();
    EXPECT_EQ(began(), 6u);
    EXPECT_EQ(changed(), 6u);
    EXPECT_EQ(persisted(), 0u);
    EXPECT_EQ(ended(), 0u);
    const std::vector<Aabb3f> away(1, {{9, 9, 9}, {10, 10, 10}});
    const jostle_boxes place = view(away);
    OK(jostle_world_move(world, ids.data(), &place, nullptr, 0, &error));
    const std::vector<Aabb3f> same(1, heap(2)[1]);
    const jostle_boxes stays = view(same);
    OK(jostle_world_update_moves(world, &ids[1], &stays, &error));
    EXPECT_EQ(began(), 0u);
    EXPECT_EQ(ended(), 3u);
    update();
    EXPECT_EQ(began() + ended(), 0u);
    OK(jostle_world_save(world, results, &error));
    const void* bytes;
    std::uint64_t size;
    OK(jostle_results_bytes(results, &bytes, &size, &error));
    OK(jostle_world_move(world, ids.data(), &stays, nullptr, 0, &error));
    update();
    EXPECT_EQ(began(), 3u);
    EXPECT_EQ(changed(), 3u + persisted());
    OK(jostle_world_restore(world, bytes, size, &error));
    EXPECT_EQ(began() + ended() + persisted() + changed(), 0u);
    OK(jostle_world_move(world, ids.data(), &stays, nullptr, 0, &error));
    update();
    EXPECT_EQ(began(), 3u);
    EXPECT_EQ(changed(), 3u + persisted());
    // And by what has changed since then.
    OK(jostle_world_save_base(world, results, &error));
    OK(jostle_world_move(world, ids.data(), &place, nullptr, 0, &error));
    update();
    EXPECT_EQ(ended(), 3u);
    OK(jostle_world_save_changes(world, results, &error));
    OK(jostle_results_bytes(results, &bytes, &size, &error));
    EXPECT_LT(size, 300u);
    OK(jostle_world_move(world, ids.data(), &stays, nullptr, 0, &error));
    update();
    EXPECT_EQ(began(), 3u);
    EXPECT_NE(jostle_world_restore_changes(world, bytes, size - 1, &error), JOSTLE_OK);
    EXPECT_EQ(began(), 3u);
    OK(jostle_world_restore_changes(world, bytes, size, &error));
    EXPECT_EQ(began() + ended() + persisted() + changed(), 0u);
    OK(jostle_world_move(world, ids.data(), &stays, nullptr, 0, &error));
    update();
    EXPECT_EQ(began(), 3u);
    // A view of it has no lists, and doesn't follow what is of another space.
    jostle_world* view;
    std::uint64_t count = 0;
    OK(jostle_world_new(JOSTLE_2D, NULL, &view, &error));
    EXPECT_NE(jostle_world_follow(view, world, &error), JOSTLE_OK);
    EXPECT_NE(std::string(error.message).find("different spaces"), std::string::npos);
    OK(jostle_free(view, &error));
    OK(jostle_world_fork(world, &view, &error));
    OK(jostle_world_follow(view, world, &error));
    OK(jostle_size(world, &size, &error));
    OK(jostle_size(view, &count, &error));
    EXPECT_EQ(count, size);
    const jostle_id_pair* none;
    OK(jostle_world_began(view, &none, &count, &error));
    EXPECT_EQ(count, 0u);
    EXPECT_NE(jostle_world_update(view, &error), JOSTLE_OK);
    OK(jostle_clear(view, &error));
    OK(jostle_world_update(view, &error));
    OK(jostle_free(view, &error));
    OK(jostle_clear(world, &error));
    EXPECT_EQ(began() + ended() + persisted() + changed(), 0u);
    EXPECT_NE(jostle_world_save_changes(world, results, &error), JOSTLE_OK);
}

TEST_F(CWorld, EndedPairsSayWhoAndWhy)
{
    make();
    add(heap(5));
    update();
    const std::vector<Aabb3f> away(1, {{9, 9, 9}, {10, 10, 10}});
    const jostle_boxes place = view(away);
    OK(jostle_world_move(world, ids.data(), &place, nullptr, 0, &error));
    OK(jostle_world_remove(world, &ids[1], 1, &error));
    const std::uint8_t no = 0;
    OK(jostle_world_set_enabled(world, &ids[2], 1, &no, 0, &error));
    const jostle_object_filter filter{1, 0, 5, 0};
    OK(jostle_world_set_filter(world, &ids[3], 1, &filter, 0, &error));
    update();
    const jostle_ended_pair* pairs;
    std::uint64_t count;
    OK(jostle_world_ended(world, &pairs, &count, &error));
    ASSERT_EQ(count, 10u);
    const auto reason = [&](std::size_t a, std::size_t b) {
        for (std::uint64_t i = 0; i < count; ++i)
            if (pairs[i].a == ids[a] && pairs[i].b == ids[b]) return pairs[i].reason;
        return jostle_end_reason{-1};
    };
    EXPECT_EQ(reason(0, 4), JOSTLE_MOVED_APART);
    EXPECT_EQ(reason(1, 4), JOSTLE_REMOVED);
    EXPECT_EQ(reason(2, 4), JOSTLE_DISABLED);
    EXPECT_EQ(reason(3, 4), JOSTLE_FILTERED);
}

TEST_F(CWorld, StatsAreThoseOfCpp)
{
    int refused = 0;
    const auto accept = [](void* context, jostle_id a, jostle_id b) {
        const bool fine = static_cast<std::uint32_t>(a) % 7 != 0 || static_cast<std::uint32_t>(b) % 5 != 0;
        *static_cast<int*>(context) += fine ? 0 : 1;
        return std::int32_t{fine};
    };
    make(0.125, accept, &refused);
    jostle::WorldOptions options;
    options.margin = 0.125;
    options.accept = [](ObjectId a, ObjectId b) { return a.index % 7 != 0 || b.index % 5 != 0; };
    jostle::World3f twin(options);
    Random random(5);
    std::vector<Aabb3f> boxes = random_boxes(random, 900);
    add(boxes);
    std::vector<ObjectId> objects(boxes.size());
    twin.add(boxes, objects);
    for (int frame = 0; frame < 90; ++frame) {
        std::vector<jostle_id> moved;
        std::vector<ObjectId> twins;
        std::vector<Aabb3f> to;
        // The first hundred lie still: some of them are removed.
        for (std::size_t i = frame < 40 ? 100 : 600; i < boxes.size(); i += 1 + random.below(3)) {
            for (int d = 0; d < 3; ++d) {
                const auto step = static_cast<float>(random.unit() - 0.5);
                boxes[i].lo[d] += step;
                boxes[i].hi[d] += step;
            }
            moved.push_back(ids[i]);
            twins.push_back(objects[i]);
            to.push_back(boxes[i]);
        }
        const jostle_boxes places = view(to);
        if (frame % 9 == 3) { // commands for one that is removed are dropped
            const std::size_t gone = static_cast<std::size_t>(frame), off = 599 - gone;
            const std::uint8_t no = 0;
            OK(jostle_world_set_enabled(world, &ids[off], 1, &no, 0, &error));
            OK(jostle_world_remove(world, &ids[gone], 1, &error));
            twin.set_enabled(objects[off], false);
            twin.remove(objects[gone]);
        }
        OK(jostle_world_move(world, moved.data(), &places, nullptr, 0, &error));
        twin.move(twins, to);
        update();
        twin.update();
        auto stats = options_of<jostle_world_stats>();
        OK(jostle_world_stats_read(world, &stats, &error));
        const jostle::WorldStats& expected = twin.stats();
        EXPECT_EQ(stats.objects, expected.objects);
        EXPECT_EQ(stats.resting, expected.resting);
        EXPECT_EQ(stats.active, expected.active);
        EXPECT_EQ(stats.disabled, expected.disabled);
        EXPECT_EQ(stats.refused, expected.refused);
        EXPECT_EQ(stats.commands, expected.commands);
        EXPECT_EQ(stats.dropped, expected.dropped);
        EXPECT_EQ(stats.changed, expected.changed);
        EXPECT_EQ(stats.woken, expected.woken);
        EXPECT_EQ(stats.settled, expected.settled);
        EXPECT_EQ(stats.candidates, expected.candidates);
        EXPECT_EQ(stats.false_positives, expected.false_positives);
        EXPECT_EQ(stats.listed, expected.listed);
        EXPECT_EQ(stats.contested, expected.contested);
        EXPECT_EQ(stats.began, expected.began);
        EXPECT_EQ(stats.persisted, expected.persisted);
        EXPECT_EQ(stats.ended, expected.ended);
        EXPECT_EQ(began(), expected.began);
        EXPECT_EQ(persisted(), expected.persisted);
        EXPECT_EQ(ended(), expected.ended);
    }
    EXPECT_GT(refused, 0);
}

} // namespace
} // namespace c_twin
