// SPDX-License-Identifier: MIT
// Boxes and filters that are no boxes and filters: which one the Error names, and what is left afterwards.
#include <gtest/gtest.h>

#include "harness.hpp"
#include "jostle/responses.hpp"
#include "tests/contract/error_of.hpp"
#include <atomic>

namespace contract {
namespace {

using jostle::Error;
using jostle::ErrorCode;

/// The Error of every form of a search, having checked that all forms and executors throw the same one.
template <class... Views>
Error error_of_search(const Views&... views)
{
    const auto never = [](const jostle::PairChunk&) { return true; };
    const Error first = error_of([&] { (void)jostle::find_pairs(views...); });
    const auto same = [&](auto&& call) {
        const Error other = error_of(call);
        EXPECT_EQ(other.code(), first.code());
        EXPECT_EQ(other.index(), first.index());
        EXPECT_STREQ(other.what(), first.what());
    };
    same([&] { (void)jostle::find_pairs_brute_force(views...); });
    same([&] { (void)jostle::PairFinder().stream(views..., never); });
    for (const NamedExecutor& executor : all_executors())
        for (const auto set : jostle::supported_instruction_sets()) {
            jostle::FinderOptions options;
            options.executor = executor.executor.get();
            options.instruction_set = set;
            same([&] { (void)jostle::PairFinder(options).take(views...); });
            same([&] { (void)jostle::PairFinder(options).stream(views..., never); });
        }
    return first;
}

TEST(BadBox, NaNAtAnyPlaceNamesTheLowestBox)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        for (const std::size_t n : {1u, 2u, 17u, 300u})
            for (int place = 0; place < 2 * K::dim; ++place) {
                Boxes<K::dim, T> boxes = make_scene<K::dim, T>(Scene::uniform, n, 1);
                Random random(n + static_cast<std::uint64_t>(place));
                const std::size_t lowest = place == 0 ? n - 1 : random.below(static_cast<std::uint32_t>(n));
                const T nan = std::copysign(std::numeric_limits<T>::quiet_NaN(), T(place % 3) - 1);
                const auto spoil = [&](std::size_t i, int where) {
                    // Not (... ? lo : hi)[...]: g++ 12 with -fsanitize=bounds takes a wrong index there.
                    auto& side = where < K::dim ? boxes[i].lo : boxes[i].hi;
                    side[where % K::dim] = nan;
                };
                spoil(lowest, place);
                for (std::size_t more = lowest + 1; more < n; more += 1 + more / 4)
                    spoil(more, static_cast<int>(random.below(2 * K::dim)));
                const Error error = error_of_search(BoxView<K::dim, T>(boxes));
                EXPECT_EQ(error.code(), ErrorCode::nan_coordinate);
                EXPECT_EQ(error.index(), lowest);
                const std::string what = error.what();
                const std::string bound = place < K::dim ? "lo." : "hi.";
                EXPECT_EQ(what.find("box " + std::to_string(lowest) + ": " + bound + "xyz"[place % K::dim] +
                                    " is NaN"),
                          0u)
                    << what;
            }
    });
}

TEST(BadBox, InvertedNamesTheLowestBoxAndItsValues)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        for (const std::size_t n : {1u, 40u})
            for (int axis = 0; axis < K::dim; ++axis) {
                Boxes<K::dim, T> boxes = make_scene<K::dim, T>(Scene::uniform, n, 2);
                const std::size_t lowest = n / 3;
                boxes[lowest].lo[axis] = T(2.5), boxes[lowest].hi[axis] = T(-1.25);
                if (n > 1) boxes[n - 1].lo[0] = boxes[n - 1].hi[0] + 1;
                const Error error = error_of_search(BoxView<K::dim, T>(boxes));
                EXPECT_EQ(error.code(), ErrorCode::inverted_box);
                EXPECT_EQ(error.index(), lowest);
                for (const char* part : {"2.5", "-1.25"})
                    EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
                EXPECT_NE(std::string(error.what()).find(std::string("lo.") + "xyz"[axis]),
                          std::string::npos);
            }
    });
}

TEST(BadBox, InvertedByTheLeast)
{
    for_each_kind([]<class K>(K) {
        using T = typename K::Number;
        using limits = std::numeric_limits<T>;
        const std::vector<std::array<T, 2>> inverted = {
            {T(1), std::nextafter(T(1), T(0))},    {limits::denorm_min(), T(-0.0)},
            {T(0), -limits::denorm_min()},         {limits::infinity(), limits::max()},
            {-limits::max(), -limits::infinity()}, {limits::infinity(), -limits::infinity()},
        };
        for (const auto& [lo, hi] : inverted) {
            Boxes<K::dim, T> boxes = make_scene<K::dim, T>(Scene::lattice, 20, 2);
            boxes[13].lo[K::dim - 1] = lo, boxes[13].hi[K::dim - 1] = hi;
            const Error error = error_of_search(BoxView<K::dim, T>(boxes));
            EXPECT_EQ(error.code(), ErrorCode::inverted_box) << lo << " " << hi;
            EXPECT_EQ(error.index(), 13u);
        }
    });
}

TEST(BadBox, LowestOfManyInALargeInput)
{
    // Large enough for several threads to come across bad boxes, the later ones sooner.
    Boxes<3, float> boxes = make_scene<3, float>(Scene::uniform, 60'000, 3);
    for (std::size_t i = 31'007; i < boxes.size(); i += 13)
        boxes[i].hi[1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(error_of_search(BoxView<3, float>(boxes)).index(), 31'007u);
    boxes[30'001].lo[0] = boxes[30'001].hi[0] + 1;
    const Error error = error_of_search(BoxView<3, float>(boxes));
    EXPECT_EQ(error.index(), 30'001u);
    EXPECT_EQ(error.code(), ErrorCode::inverted_box);
}

TEST(BadBox, TheOnlyOneIsFoundInWhoeversShareItLies)
{
    const Boxes<3, float> good = make_scene<3, float>(Scene::uniform, 50'000, 3);
    for (const NamedExecutor& executor : all_executors()) {
        jostle::FinderOptions options;
        options.executor = executor.executor.get();
        jostle::PairFinder finder(options);
        for (const std::size_t place :
             {0u, 1u, 255u, 256u, 7'000u, 16'500u, 24'999u, 25'000u, 33'500u, 41'000u, 49'999u}) {
            Boxes<3, float> boxes = good;
            boxes[place].hi[2] = std::numeric_limits<float>::quiet_NaN();
            EXPECT_EQ(error_of([&] { (void)finder.find(BoxView<3, float>(boxes)); }).index(), place)
                << executor.name;
            const BoxView<3, float> all(boxes), half = all.subview(0, 20'000),
                                                rest = all.subview(20'000, 30'000);
            EXPECT_EQ(error_of([&] { (void)finder.find(half, rest); }).index(),
                      place < 20'000 ? place : place - 20'000)
                << executor.name;
        }
    }
}

TEST(BadBox, CrossFormNamesTheSet)
{
    const Boxes<3, float> good = make_scene<3, float>(Scene::uniform, 50, 1);
    Boxes<3, float> bad = good;
    bad[31].hi[2] = std::numeric_limits<float>::quiet_NaN();
    bad[40].lo[0] = bad[40].hi[0] + 1;
    const BoxView<3, float> good_view(good), bad_view(bad), none;
    for (const Error& error : {error_of_search(bad_view, good_view), error_of_search(bad_view, none)}) {
        EXPECT_NE(std::string(error.what()).find("box a 31"), std::string::npos) << error.what();
        EXPECT_EQ(error.index(), 31u);
        EXPECT_EQ(error.code(), ErrorCode::nan_coordinate);
    }
    for (const Error& error : {error_of_search(good_view, bad_view), error_of_search(none, bad_view)}) {
        EXPECT_NE(std::string(error.what()).find("box b 31"), std::string::npos) << error.what();
        EXPECT_EQ(error.index(), 31u);
    }
    // Both bad: the first set's box is named, whatever the numbers.
    Boxes<3, float> worse = good;
    worse[2].lo[0] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(error_of_search(bad_view, BoxView<3, float>(worse)).index(), 31u);
}

TEST(BadBox, FinderIsUsableAfterwards)
{
    const Question<3, float> question{make_scene<3, float>(Scene::dense, 400, 1)};
    const std::vector<Pair> expected = ask(question);
    ASSERT_FALSE(expected.empty());
    Boxes<3, float> bad = question.a;
    bad[399].lo[0] = std::numeric_limits<float>::quiet_NaN();
    for (const NamedExecutor& executor : all_executors()) {
        jostle::FinderOptions options;
        options.executor = executor.executor.get();
        jostle::PairFinder finder(options);
        Manner manner;
        manner.finder = &finder;
        for (int round = 0; round < 3; ++round) {
            EXPECT_THROW((void)finder.find(BoxView<3, float>(bad)), Error);
            EXPECT_EQ(ask(question, manner), expected) << executor.name;
        }
    }
}

TEST(BadBox, CheckThrowsWhatASearchThrows)
{
    Boxes<2, double> boxes = make_scene<2, double>(Scene::uniform, 50, 1);
    EXPECT_NO_THROW(jostle::check_boxes(BoxView<2, double>(boxes)));
    boxes[7].lo[1] = 1e300;
    const Error expected = error_of([&] { jostle::check_boxes(BoxView<2, double>(boxes)); });
    EXPECT_STREQ(error_of_search(BoxView<2, double>(boxes)).what(), expected.what());
}

TEST(BadArgument, IsAnErrorAndNotACrash)
{
    const Boxes<3, float> boxes = make_scene<3, float>(Scene::uniform, 5'000, 1);
    const auto expect = [](ErrorCode code, auto&& call) { EXPECT_EQ(error_of(call).code(), code); };
    jostle::FinderOptions without_memory;
    without_memory.memory = nullptr;
    expect(ErrorCode::invalid_argument, [&] { jostle::PairFinder{without_memory}; });
    expect(ErrorCode::invalid_argument, [] {
        jostle::ResponsesOptions options;
        options.memory = nullptr;
        jostle::Responses<int>{options};
    });
    expect(ErrorCode::invalid_argument,
           [] { (void)jostle::find_pairs(BoxView<3, float>::strided(nullptr, nullptr, 10, 24)); });
    expect(ErrorCode::invalid_argument, [&] { (void)jostle::PairFinder().stream(boxes, {}); });
    jostle::PairFinder finder;
    finder.find(boxes);
    const jostle::Error order =
        error_of([&] { (void)finder.find(boxes, {}, static_cast<jostle::Order>(7)); });
    EXPECT_EQ(order.code(), ErrorCode::invalid_argument);
    EXPECT_NE(std::string(order.what()).find("order 7"), std::string::npos);
    // A finder that is busy keeps what it is at.
    const std::uint64_t all = finder.find(boxes).size();
    std::atomic<int> refused{0};
    const auto call_again = [&](std::uint32_t, std::uint32_t) {
        if (error_of([&] { (void)finder.find(boxes); }).code() == ErrorCode::invalid_argument) ++refused;
        return true;
    };
    jostle::Filter again;
    again.accept = call_again;
    EXPECT_EQ(finder.find(boxes, again).size(), all);
    EXPECT_EQ(static_cast<std::uint64_t>(refused), all);
    EXPECT_EQ(finder.find(boxes).size(), all);
    expect(ErrorCode::invalid_argument, [] {
        jostle::ResponsesOptions options;
        options.form = static_cast<jostle::ResponseForm>(7);
        jostle::Responses<int>{options};
    });
    const jostle::PairBuffer pairs = jostle::find_pairs(boxes);
    std::vector<Pair> room(pairs.size() - 1);
    expect(ErrorCode::size_mismatch, [&] { pairs.copy_to(room); });

    struct NoThreads final : jostle::Executor
    {
        std::uint32_t concurrency() const noexcept override { return 0; }
        void run(std::uint32_t count, jostle::FunctionRef<void(std::uint32_t)> task) override
        {
            for (std::uint32_t i = 0; i < count; ++i)
                task(i);
        }
    } none;
    jostle::FinderOptions options;
    options.executor = &none;
    EXPECT_EQ(jostle::PairFinder(options).take(boxes).to_vector(), pairs.to_vector());
}

TEST(BadFilter, ColumnsOfTheWrongLength)
{
    const Boxes<3, float> boxes = make_scene<3, float>(Scene::uniform, 10, 1);
    const BoxView<3, float> view(boxes);
    const std::vector<std::uint32_t> right(10, 1u), wrong(9, 1u);
    const std::span<const std::uint32_t> r(right), w(wrong);
    const auto expect = [&](const jostle::Filter& filter, const char* column) {
        const Error error = error_of([&] { (void)jostle::find_pairs(view, filter); });
        EXPECT_EQ(error.code(), ErrorCode::size_mismatch);
        EXPECT_EQ(error.index(), Error::no_index);
        EXPECT_NE(std::string(error.what()).find(column), std::string::npos) << error.what();
    };
    expect({w, r, {}, {}}, "category");
    expect({r, w, {}, {}}, "mask");
    expect({r, {}, {}, {}}, "mask");
    expect({{}, r, {}, {}}, "category");
    expect({{}, {}, w, {}}, "owner");
    const std::vector<std::array<std::uint32_t, 3>> nine(9);
    jostle::Filter vertices;
    vertices.vertices = std::span(nine);
    expect(vertices, "vertices has 9 entries for 10");
    jostle::Filter ghosts;
    ghosts.ghosts = 11;
    expect(ghosts, "ghosts is 11 for 10");
    ghosts.ghosts = 10;
    EXPECT_EQ(jostle::find_pairs(view, ghosts).size(), 0u);
    const std::string message = error_of([&] { (void)jostle::find_pairs(view, {{}, {}, w, {}}); }).what();
    for (const char* part : {"9", "10"})
        EXPECT_NE(message.find(part), std::string::npos) << message;

    const auto expect_cross = [&](const jostle::CrossFilter& filter, const char* column) {
        const Error error = error_of([&] { (void)jostle::find_pairs(view, view, filter); });
        EXPECT_EQ(error.code(), ErrorCode::size_mismatch);
        EXPECT_NE(std::string(error.what()).find(column), std::string::npos) << error.what();
    };
    expect_cross({w, r, {}, r, r, {}, {}}, "category_a");
    expect_cross({r, r, {}, r, w, {}, {}}, "mask_b");
    expect_cross({{}, {}, r, {}, {}, w, {}}, "owner_b");
    expect_cross({{}, {}, w, {}, {}, r, {}}, "owner_a");
    expect_cross({r, r, {}, {}, {}, {}, {}}, "category");
    expect_cross({{}, {}, {}, {}, {}, r, {}}, "owner");

    const auto never = [](const jostle::PairChunk&) { return true; };
    jostle::PairFinder finder;
    EXPECT_THROW((void)finder.stream(view, never, jostle::Filter{{}, {}, w, {}}), Error);
    EXPECT_EQ(finder.find(view, jostle::Filter{{}, {}, r, {}}).size(), 0u); // all of one owner
}

} // namespace
} // namespace contract
