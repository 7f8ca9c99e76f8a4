// SPDX-License-Identifier: MIT
#include "bench/ladder/responses.hpp"

#include <atomic>
#include <mutex>

#include "jostle/chapter.hpp"
#include "jostle/process.hpp"
#include "jostle/responses.hpp"

namespace jostle_ladder {
namespace {

namespace chapter = jostle::chapter;

/// Each processor takes its share of the pairs: add(processor, object, push).
template <class Add>
void respond(std::span<const jostle::Pair> pairs, jostle::Executor& executor, Add add)
{
    chapter::on_all_processors(executor, [&](std::uint32_t processor, std::uint32_t processors) {
        const std::size_t begin = pairs.size() * processor / processors;
        const std::size_t end = pairs.size() * (processor + 1) / processors;
        for (const jostle::Pair& pair : pairs.subspan(begin, end - begin)) {
            add(processor, pair.a, push_of(pair.a, pair.b));
            add(processor, pair.b, push_of(pair.b, pair.a));
        }
    });
}

/// A lock for each object, as in [Andrews99].
class Mutexes final : public ResponseWay
{
  public:
    explicit Mutexes(std::uint32_t objects) : mutexes_(objects) {}
    std::vector<Push> sum(std::span<const jostle::Pair> pairs, jostle::Executor& executor) override
    {
        std::vector<Push> sums(mutexes_.size(), 0);
        respond(pairs, executor, [&](std::uint32_t, std::uint32_t object, Push push) {
            const std::scoped_lock lock(mutexes_[object]);
            sums[object] += push;
        });
        return sums;
    }

  private:
    std::vector<std::mutex> mutexes_;
};

class Atomics final : public ResponseWay
{
  public:
    explicit Atomics(std::uint32_t objects) : sums_(objects) {}
    std::vector<Push> sum(std::span<const jostle::Pair> pairs, jostle::Executor& executor) override
    {
        for (auto& sum : sums_)
            sum.store(0, std::memory_order_relaxed);
        respond(pairs, executor, [&](std::uint32_t, std::uint32_t object, Push push) {
            sums_[object].fetch_add(push, std::memory_order_relaxed);
        });
        return {sums_.begin(), sums_.end()};
    }

  private:
    std::vector<std::atomic<Push>> sums_;
};

/// Fig. 4.8: a row of all objects for each processor, merged behind a barrier; a second barrier ends the
/// merging.
class PerProcessor final : public ResponseWay
{
  public:
    explicit PerProcessor(std::uint32_t objects) : objects_(objects) {}
    std::vector<Push> sum(std::span<const jostle::Pair> pairs, jostle::Executor& executor) override
    {
        chapter::DenseResponses<Push> responses(objects_, executor.concurrency());
        respond(pairs, executor, [&](std::uint32_t processor, std::uint32_t object, Push push) {
            responses.add(processor, object, 0, push);
        });
        const auto merged = responses.merge(executor);
        return {merged.begin(), merged.end()};
    }

  private:
    std::uint32_t objects_;
};

/// The library's: a list for each block of work, so that the order of the sums doesn't depend on who did the
/// work.
class PerBlock final : public ResponseWay
{
  public:
    explicit PerBlock(std::uint32_t objects) : objects_(objects) {}
    std::vector<Push> sum(std::span<const jostle::Pair> pairs, jostle::Executor& executor) override
    {
        jostle::ProcessOptions process;
        process.executor = &executor;
        jostle::ResponsesOptions options;
        options.executor = &executor;
        if (!responses_) responses_ = std::make_unique<jostle::Responses<Push>>(options);
        responses_->start(objects_, jostle::plan_work(pairs.size(), process));
        jostle::process_pairs(
            pairs,
            [&](const jostle::Pair& pair, jostle::Work work) {
                responses_->add(work, pair.a, push_of(pair.a, pair.b));
                responses_->add(work, pair.b, push_of(pair.b, pair.a));
            },
            process);
        const auto merged = responses_->merge();
        return {merged.begin(), merged.end()};
    }

  private:
    std::uint32_t objects_;
    std::unique_ptr<jostle::Responses<Push>> responses_;
};

template <class Way>
std::unique_ptr<ResponseWay> make(std::uint32_t objects)
{
    return std::make_unique<Way>(objects);
}

} // namespace

std::span<const ResponseInfo> response_ways()
{
    static constexpr ResponseInfo ways[] = {{"a mutex per object", make<Mutexes>},
                                            {"atomic additions", make<Atomics>},
                                            {"a row per processor, merged (fig. 4.8)", make<PerProcessor>},
                                            {"a list per block of work, merged", make<PerBlock>}};
    return ways;
}

} // namespace jostle_ladder
