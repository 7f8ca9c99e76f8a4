// SPDX-License-Identifier: MIT
// The C interface without memory, of the global operator new and of a handle's own allocator:
// JOSTLE_OUT_OF_MEMORY, `out` is as it was, nothing is lost, and the next call works.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "jostle/box.hpp"
#include "jostle/jostle.h"
#include "starve.hpp"

namespace faults {
namespace {

/// An allocator that fails when it is told to, and counts what is out.
struct Allocator
{
    std::atomic<std::uint64_t> calls{0}, fail_at{never};
    std::atomic<std::int64_t> blocks{0};
    jostle_allocator c{};

    Allocator()
    {
        c.struct_size = sizeof c;
        c.context = this;
        c.allocate = [](void* context, std::uint64_t size, std::uint64_t alignment) -> void* {
            auto& me = *static_cast<Allocator*>(context);
            if (me.calls++ >= me.fail_at) return nullptr;
            ++me.blocks;
            return std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
        };
        c.deallocate = [](void* context, void* memory, std::uint64_t, std::uint64_t) {
            --static_cast<Allocator*>(context)->blocks;
            std::free(memory);
        };
    }
};

struct Boxes
{
    std::vector<jostle::Aabb3f> boxes;
    jostle_boxes view{};

    explicit Boxes(std::size_t count)
    {
        for (std::size_t i = 0; i < count; ++i) {
            const auto x = static_cast<float>(i % 20), y = static_cast<float>(i / 20);
            boxes.push_back({{x, y, 0}, {x + 1.2f, y + 1.2f, 1}});
        }
        const auto* const lo = reinterpret_cast<const float*>(boxes.data());
        for (int d = 0; d < 3; ++d) {
            view.lo[d] = lo + d;
            view.hi[d] = lo + 3 + d;
        }
        view.count = count;
        view.stride = sizeof(jostle::Aabb3f);
    }
};

/// Something that makes a handle and works with it, over and over.
class Sequence
{
  public:
    explicit Sequence(const jostle_options& options) : options_(options) {}
    ~Sequence()
    {
        (void)jostle_free(finder, nullptr);
        (void)jostle_free(index, nullptr);
        (void)jostle_free(world, nullptr);
        (void)jostle_free(fork, nullptr);
        (void)jostle_free(results, nullptr);
        (void)jostle_free(shapes, nullptr);
        (void)jostle_free(hull, nullptr);
        (void)jostle_free(contacts, nullptr);
        (void)jostle_free(images, nullptr);
    }

    jostle_finder* finder = nullptr;
    jostle_index* index = nullptr;
    jostle_world *world = nullptr, *fork = nullptr;
    jostle_results* results = nullptr;
    jostle_shapes* shapes = nullptr;
    jostle_shape* hull = nullptr;
    jostle_contact_finder* contacts = nullptr;
    jostle_images* images = nullptr;
    std::uint64_t pairs = 0, answers = 0, touching = 0, saved = 0;

    static constexpr int steps = 20;
    jostle_status step(int which, jostle_error* error)
    {
        static constexpr double corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 1, 1};
        static constexpr std::uint32_t objects[] = {0, 1, 2, 1, 0};
        static constexpr double values[] = {1, 2, 3, 4, 5};
        const float period[] = {30, 40, 0};
        jostle_world_options of_world{};
        of_world.struct_size = sizeof of_world;
        of_world.common = &options_;
        switch (which) {
        case 0:
            return jostle_results_new(&options_, &results, error);
        case 1:
            return jostle_finder_new(&options_, &finder, error);
        case 2:
            return jostle_finder_take(finder, JOSTLE_3F, &boxes_.view, nullptr, nullptr, JOSTLE_SORTED,
                                      results, error);
        case 3:
            return count(pairs, error);
        case 4:
            return jostle_index_new(JOSTLE_3F, &options_, &index, error);
        case 5:
            return jostle_index_build(index, nullptr, &boxes_.view, error);
        case 6:
            return jostle_query_join(index, &boxes_.view, nullptr, results, error);
        case 7:
            return count(answers, error);
        case 8:
            return jostle_world_new(JOSTLE_3F, &of_world, &world, error);
        case 9:
            return jostle_world_add(world, &boxes_.view, nullptr, ids_.data(), error);
        case 10:
            return jostle_world_update(world, error);
        case 11:
            return jostle_world_pairs(world, results, error);
        case 12:
            return count(touching, error);
        case 13:
            return jostle_world_save(world, results, error);
        case 14: {
            const void* bytes = nullptr;
            const jostle_status status = jostle_results_bytes(results, &bytes, &saved, error);
            if (status != JOSTLE_OK) return status;
            return jostle_world_restore(world, bytes, saved, error);
        }
        case 15:
            return jostle_world_fork(world, &fork, error);
        case 16:
            if (shapes == nullptr) {
                const jostle_status status = jostle_shapes_new(3, &shapes, error);
                if (status != JOSTLE_OK) return status;
            }
            if (hull == nullptr) {
                const jostle_status status = jostle_shape_hull(JOSTLE_3D, corners, 5, 0, &hull, error);
                if (status != JOSTLE_OK) return status;
            }
            return jostle_shapes_add(shapes, hull, 3, error);
        case 17: {
            if (contacts == nullptr) {
                const jostle_status status =
                    jostle_contact_finder_new(JOSTLE_3D, &options_, &contacts, error);
                if (status != JOSTLE_OK) return status;
            }
            const double poses[] = {0, 0, 0, 0, 0, 0, 1, .5, 0, 0, 0, 0, 0, 1, 0, .5, 0, 0, 0, 0, 1};
            const jostle_objects bodies{shapes, {poses, 3, 7 * sizeof(double)}};
            const jostle_pair of[] = {{0, 1}, {1, 2}, {0, 2}};
            const jostle_block block{of, 3};
            const jostle_blocks all{&block, 1, 3, sizeof(jostle_pair)};
            jostle_blocks found{};
            return jostle_contact_finder_find(contacts, &bodies, nullptr, &all, 0, &found, error);
        }
        case 18: {
            double sums[3];
            return jostle_sum_by_object(JOSTLE_DOUBLE, 1, objects, values, 5, &options_, 3, sums, error);
        }
        default:
            if (images == nullptr) {
                const jostle_status status = jostle_images_new(JOSTLE_3F, &options_, &images, error);
                if (status != JOSTLE_OK) return status;
            }
            return jostle_images_build(images, &boxes_.view, period, error);
        }
    }

  private:
    jostle_status count(std::uint64_t& pairs_found, jostle_error* error) const
    {
        jostle_blocks found{};
        const jostle_status status = jostle_results_blocks(results, &found, error);
        pairs_found = found.count;
        return status;
    }

    jostle_options options_;
    Boxes boxes_{300};
    std::vector<jostle_id> ids_ = std::vector<jostle_id>(boxes_.boxes.size()); // here, where nothing fails
};

/// What it found, in numbers.
std::vector<std::uint64_t> numbers(const Sequence& sequence)
{
    std::uint64_t size = 0, forked = 0;
    EXPECT_EQ(jostle_size(sequence.world, &size, nullptr), JOSTLE_OK);
    EXPECT_EQ(jostle_size(sequence.fork, &forked, nullptr), JOSTLE_OK);
    return {sequence.pairs, sequence.answers, sequence.touching, sequence.saved, size, forked};
}

class Starved : public testing::TestWithParam<bool>
{
};

TEST_P(Starved, EveryCallEndsWithOutOfMemoryAndTheNextOneWorks)
{
    const bool by_allocator = GetParam();
    if (!by_allocator && !can_fail()) return;
    jostle_executor* serial = nullptr;
    ASSERT_EQ(jostle_executor_serial(&serial, nullptr), JOSTLE_OK);
    std::vector<std::uint64_t> expected;
    Allocator allocator;
    for (const bool starving : {false, true}) {
        jostle_options options{};
        options.struct_size = sizeof options;
        options.executor = serial;
        options.allocator = &allocator.c;
        {
            Sequence sequence(options);
            std::uint64_t failed = 0;
            for (int step = 0; step < Sequence::steps; ++step) {
                jostle_error error{};
                for (std::uint64_t k = 0;; ++k) {
                    if (starving && by_allocator) allocator.fail_at = allocator.calls + k;
                    if (starving && !by_allocator) fail_after(k);
                    const jostle_status status = sequence.step(step, &error);
                    allocator.fail_at = never;
                    fail_after(never);
                    if (status == JOSTLE_OK) break;
                    ASSERT_EQ(status, JOSTLE_OUT_OF_MEMORY)
                        << "step " << step << ", " << k << ": " << error.message;
                    ASSERT_EQ(error.status, status);
                    ASSERT_LT(k, 5000u) << step;
                    ++failed;
                }
            }
            if (starving) {
                EXPECT_GT(failed, 20u);
                EXPECT_EQ(numbers(sequence), expected);
            } else {
                expected = numbers(sequence);
                EXPECT_GT(expected[0], 300u);
                EXPECT_EQ(expected[4], 300u);
            }
        }
        EXPECT_EQ(allocator.blocks, 0) << "lost";
    }
    EXPECT_EQ(jostle_free(serial, nullptr), JOSTLE_OK);
}

// With an allocation for each, all would be copied each time, and 40,000 took ten seconds.
TEST(Shapes, AddedOneByOneAreSeldomCopied)
{
    if (!can_fail()) return;
    const double corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, half[3] = {1, 1, 1};
    jostle_shape *hull = nullptr, *box = nullptr;
    jostle_shapes* shapes = nullptr;
    ASSERT_EQ(jostle_shape_hull(JOSTLE_3D, corners, 4, 0, &hull, nullptr), JOSTLE_OK);
    ASSERT_EQ(jostle_shape_box(3, half, 0, &box, nullptr), JOSTLE_OK);
    ASSERT_EQ(jostle_shapes_new(3, &shapes, nullptr), JOSTLE_OK);
    fail_after(100);
    jostle_status status = JOSTLE_OK;
    for (int i = 0; i < 10'000 && status == JOSTLE_OK; ++i)
        status = jostle_shapes_add(shapes, i % 2 == 0 ? hull : box, 1, nullptr);
    fail_after(never);
    EXPECT_EQ(status, JOSTLE_OK);
    std::uint64_t size = 0;
    EXPECT_EQ(jostle_size(shapes, &size, nullptr), JOSTLE_OK);
    EXPECT_EQ(size, 10'000u);
    EXPECT_EQ(jostle_free(shapes, nullptr), JOSTLE_OK);
    EXPECT_EQ(jostle_free(box, nullptr), JOSTLE_OK);
    EXPECT_EQ(jostle_free(hull, nullptr), JOSTLE_OK);
}

INSTANTIATE_TEST_SUITE_P(, Starved, testing::Bool(),
                         [](const auto& each) { return each.param ? "OfItsAllocator" : "OfNew"; });

} // namespace
} // namespace faults
