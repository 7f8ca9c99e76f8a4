// SPDX-License-Identifier: MIT
// Executors that throw before the k-th task, for every k, and executors that run tasks last to first,
// with pauses: the call ends with what was thrown, and the next one answers as if nothing had been.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <thread>
#include <vector>

#include "jostle/jostle.hpp"
#include "tool/scenes/random.hpp"

namespace faults {
namespace {

using namespace jostle;

struct HostFailed
{
};

/// Last to first, on the calling thread, until it was told to fail.
class ThrowingExecutor final : public Executor
{
  public:
    static constexpr std::uint64_t never = ~std::uint64_t{0};
    std::uint64_t tasks_left = never;
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return 3; }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        while (count-- > 0) {
            if (tasks_left != never && tasks_left-- == 0) throw HostFailed{};
            task(count);
        }
    }
};

/// Every task on a thread of its own, after a pause that nobody can foresee.
class LateExecutor final : public Executor
{
  public:
    [[nodiscard]] std::uint32_t concurrency() const noexcept override { return 4; }
    void run(std::uint32_t count, FunctionRef<void(std::uint32_t)> task) override
    {
        std::vector<std::thread> threads;
        for (std::uint32_t i = 0; i < count; ++i)
            threads.emplace_back([=, pause = random_.below(200)] {
                std::this_thread::sleep_for(std::chrono::microseconds(pause));
                task(i);
            });
        for (std::thread& thread : threads)
            thread.join();
    }

  private:
    jostle_scenes::Random random_{7};
};

std::vector<Aabb3f> some_boxes(std::uint64_t seed, std::size_t count)
{
    jostle_scenes::Random random(seed);
    std::vector<Aabb3f> boxes(count);
    for (Aabb3f& box : boxes)
        for (int d = 0; d < 3; ++d) {
            box.lo[d] = static_cast<float>(random.uniform(0, 26));
            box.hi[d] = box.lo[d] + static_cast<float>(random.uniform(0.2, 1.2));
        }
    return boxes;
}

/// Things that are done on an executor, each with an answer that must always be the same.
class Works
{
  public:
    explicit Works(Executor& executor)
        : finder_({.executor = &executor}),
          index_({.executor = &executor}),
          contacts_({.executor = &executor}),
          world_(WorldOptions{.executor = &executor}),
          shapes_(boxes_.size(), Shape3::box({0.4, 0.3, 0.3})),
          poses_(boxes_.size())
    {
        for (std::size_t i = 0; i < boxes_.size(); ++i)
            for (std::size_t d = 0; d < 3; ++d)
                poses_[i].position[d] = boxes_[i].lo[static_cast<int>(d)];
        ids_.resize(boxes_.size());
        world_.add(boxes_, ids_);
    }

    static constexpr int count = 7;
    /// Numbers that tell what came of it.
    std::vector<std::uint64_t> go(int which)
    {
        const BoxView<3, float> view(boxes_);
        switch (which) {
        case 0: {
            const std::vector<Pair> pairs = finder_.find(view).to_vector();
            return {pairs.size(), pair_checksum(pairs), pairs.front().a};
        }
        case 1: {
            const std::vector<Pair> pairs = finder_.find(view, {}, Order::sorted).to_vector();
            return {pairs.size(), pair_checksum(pairs), pairs.back().b};
        }
        case 2: {
            std::vector<std::uint32_t> ids(boxes_.size());
            for (std::uint32_t i = 0; i < ids.size(); ++i)
                ids[i] = i;
            index_.build(ids, view);
            std::pmr::vector<Pair> pairs;
            index_.join(view, pairs);
            return {pairs.size(), pair_checksum(pairs)};
        }
        case 3: {
            ResultLists<std::uint32_t> lists;
            index_.all(std::span<const Aabb3f>(boxes_), lists);
            std::uint64_t sum = lists.size();
            for (std::size_t i = 0; i < lists.size(); ++i)
                for (const std::uint32_t id : lists[i])
                    sum = sum * 31 + id;
            return {sum};
        }
        case 4: {
            const std::vector<Pair> pairs = finder_.find(view, {}, Order::sorted).to_vector();
            const auto found = contacts_.find({shapes_, poses_}, pairs).to_vector();
            return {found.size(), found.empty() ? 0 : found.back().pair.a};
        }
        case 5: {
            const std::vector<Pair> pairs = finder_.find(view, {}, Order::sorted).to_vector();
            std::vector<Distance<3, float>> out(pairs.size());
            contacts_.distances({shapes_, poses_}, pairs, 5, out);
            std::uint64_t near = 0;
            for (const auto& each : out)
                near += each.distance < 0.5f;
            return {near};
        }
        default:
            world_.update();
            return {world_.size(), world_.began().size()};
        }
    }

    [[nodiscard]] std::vector<std::byte> saved() const { return world_.save(); }

  private:
    std::vector<Aabb3f> boxes_ = some_boxes(1, 9000);
    PairFinder finder_;
    BoxIndex3f index_;
    ContactFinder3f contacts_;
    World3f world_;
    std::vector<Shape3> shapes_;
    std::vector<Pose3f> poses_;
    std::vector<ObjectId> ids_;
};

std::vector<std::vector<std::uint64_t>> expected()
{
    Works works(serial_executor());
    std::vector<std::vector<std::uint64_t>> all;
    for (int which = 0; which < Works::count; ++which)
        all.push_back(works.go(which));
    return all;
}

TEST(Executors, ThatThrowBeforeAnyTaskEndTheCallAndNothingElse)
{
    const auto answers = expected();
    ThrowingExecutor executor;
    Works works(executor);
    for (int which = 0; which < Works::count; ++which) {
        std::uint64_t failures = 0;
        for (std::uint64_t k = 0;; ++k) {
            const std::vector<std::byte> before = works.saved();
            executor.tasks_left = k;
            bool failed = false;
            std::vector<std::uint64_t> answer;
            try {
                answer = works.go(which);
            } catch (const HostFailed&) {
                failed = true;
            }
            executor.tasks_left = ThrowingExecutor::never;
            if (!failed) {
                EXPECT_EQ(answer, answers[static_cast<std::size_t>(which)]) << which << ", " << k;
                break;
            }
            ++failures;
            ASSERT_EQ(works.saved(), before) << which << ", " << k;
            if (which < 2) {
                ASSERT_EQ(works.go(which), answers[static_cast<std::size_t>(which)]) << which << ", " << k;
            }
        }
        EXPECT_GT(failures, 1u) << which;
    }
}

TEST(Executors, ThatAreLateGiveTheSameAnswers)
{
    LateExecutor executor;
    Works works(executor);
    const auto answers = expected();
    for (int which = 0; which < Works::count; ++which)
        EXPECT_EQ(works.go(which), answers[static_cast<std::size_t>(which)]) << which;
}

TEST(Executors, ThatThrowFailAMergeWhichLosesNothing)
{
    const ProcessOptions work{.executor = &serial_executor()};
    jostle_scenes::Random random(5);
    std::vector<Pair> pairs(40'000);
    for (Pair& pair : pairs)
        pair = {random.below(1000), random.below(1000)};
    const auto add_all = [&](Responses<double>& responses) {
        responses.start(1000, plan_work(pairs.size(), work));
        process_pairs(
            pairs, [&](Pair pair, Work at) { responses.add(at, pair.a, 1.0 / (1 + pair.b)); }, work);
    };
    Responses<double> sound({.executor = &serial_executor()});
    add_all(sound);
    const auto sums = sound.merge();
    const std::vector<double> truth(sums.begin(), sums.end());
    ThrowingExecutor executor;
    Responses<double> responses({.executor = &executor});
    std::uint64_t failures = 0;
    for (bool failed = true; failed; failures += failed) {
        add_all(responses);
        executor.tasks_left = failures;
        failed = false;
        try {
            (void)responses.merge();
        } catch (const HostFailed&) {
            failed = true;
        }
        executor.tasks_left = ThrowingExecutor::never;
        const auto merged = responses.merge();
        ASSERT_TRUE(std::equal(merged.begin(), merged.end(), truth.begin(), truth.end())) << failures;
    }
    EXPECT_GT(failures, 1u);
}

} // namespace
} // namespace faults
