// SPDX-License-Identifier: MIT
// Uses every part of the interface that has to cross the border of a library: templates instantiated there,
// an exception thrown there and caught here, a class of here called from there, threads.
#include <jostle/jostle.hpp>

#include <cstdio>
#include <limits>
#include <vector>

namespace {
class HostExecutor final : public jostle::Executor
{
  public:
    std::uint32_t concurrency() const noexcept override { return 2; }
    void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
    {
        for (std::uint32_t i = count; i-- > 0;)
            task(i);
    }
};

bool error_arrives()
{
    const std::vector<jostle::Aabb2d> boxes = {{{0, 0}, {1, 1}},
                                               {{0, std::numeric_limits<double>::quiet_NaN()}, {1, 1}}};
    try {
        (void)jostle::find_pairs(boxes);
    } catch (const jostle::Error& error) {
        return error.code() == jostle::ErrorCode::nan_coordinate && error.index() == 1;
    }
    return false;
}
} // namespace

int main()
{
    std::vector<jostle::Aabb3f> boxes; // a row in which each touches the next
    for (int i = 0; i < 1000; ++i)
        boxes.push_back({{float(i), 0, 0}, {float(i + 1), 1, 1}});
    HostExecutor host;
    for (jostle::Executor* executor : {static_cast<jostle::Executor*>(&host), &jostle::default_executor()}) {
        jostle::FinderOptions options;
        options.executor = executor;
        jostle::PairFinder finder(options);
        const auto pairs = finder.find(boxes, {}, jostle::Order::sorted).to_vector();
        if (pairs.size() != 999 || pairs[0] != jostle::Pair{0, 1} || pairs[998] != jostle::Pair{998, 999}) {
            std::fprintf(stderr, "wrong pairs: %zu found, 999 expected\n", pairs.size());
            return 1;
        }
    }
    // Two sets: each box of the one touches itself and its two neighbours in the other.
    const jostle::BoxView<3, float> view(boxes);
    jostle::PairFinder finder;
    if (jostle::find_pairs_brute_force(view, view).size() != 2998 || finder.find(view, view).size() != 2998) {
        std::fprintf(stderr, "wrong pairs of two sets: 2998 expected\n");
        return 1;
    }
    if (!error_arrives()) {
        std::fprintf(stderr, "no jostle::Error for a NaN\n");
        return 1;
    }
    std::puts("jostle found all 999 pairs");
}
