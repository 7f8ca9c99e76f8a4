// SPDX-License-Identifier: MIT
// Small random questions that RapidCheck shrinks when an answer is wrong. RC_PARAMS sets seed and number, as
// in RC_PARAMS="seed=123 max_success=10000".
#include <gtest/gtest.h>

#include <rapidcheck.h>

#include "harness.hpp"

JOSTLE_NAMESPACE_BEGIN
template <int Dim, class T>
void showValue(const Aabb<Dim, T>& box, std::ostream& out)
{
    for (int d = 0; d < Dim; ++d)
        out << std::hexfloat << "[" << box.lo[d] << ", " << box.hi[d] << "]" << std::defaultfloat;
}
inline void showValue(const Pair& pair, std::ostream& out)
{
    out << "(" << pair.a << ", " << pair.b << ")";
}
JOSTLE_NAMESPACE_END

namespace contract {
namespace {

/// A bound: mostly small whole numbers, so that bounds meet; else anything but NaN.
template <class T>
rc::Gen<T> a_number()
{
    const auto numbers = special_numbers<T>();
    return rc::gen::weightedOneOf<T>(
        {{6, rc::gen::map(rc::gen::inRange(-6, 7), [](int i) { return static_cast<T>(i) / 2; })},
         {1, rc::gen::elementOf(std::vector<T>(numbers.begin(), numbers.end()))},
         {1, rc::gen::suchThat(rc::gen::arbitrary<T>(), [](T x) { return x == x; })}});
}

template <int Dim, class T>
rc::Gen<Aabb<Dim, T>> a_box()
{
    return rc::gen::map(rc::gen::container<std::array<T, std::size_t{2 * Dim}>>(a_number<T>()),
                        [](const std::array<T, std::size_t{2 * Dim}>& bounds) {
                            Aabb<Dim, T> box;
                            for (std::size_t d = 0; d < Dim; ++d) {
                                box.lo[d] = std::min(bounds[2 * d], bounds[2 * d + 1]);
                                box.hi[d] = std::max(bounds[2 * d], bounds[2 * d + 1]);
                            }
                            return box;
                        });
}

template <int Dim, class T>
Boxes<Dim, T> some_boxes()
{
    return *rc::gen::container<Boxes<Dim, T>>(a_box<Dim, T>());
}

/// A question with any combination of filters.
template <int Dim, class T>
Question<Dim, T> a_question(bool cross)
{
    Question<Dim, T> question;
    question.cross = cross;
    question.a = some_boxes<Dim, T>();
    if (cross) question.b = some_boxes<Dim, T>();
    Random random(*rc::gen::arbitrary<std::uint64_t>());
    const bool masks = *rc::gen::arbitrary<bool>(), owners = *rc::gen::arbitrary<bool>();
    question.columns_a = random_columns(random, question.a.size(), masks, owners);
    question.columns_b = random_columns(random, question.b.size(), masks, owners);
    question.accept_salt = *rc::gen::element<std::uint64_t>(0, 0, 7);
    if (!cross && *rc::gen::arbitrary<bool>())
        question.ghosts = *rc::gen::inRange<std::size_t>(0, question.a.size() + 1);
    if (!cross && *rc::gen::arbitrary<bool>()) question.vertices = random_vertices(random, question.a.size());
    return question;
}

Manner a_manner()
{
    Manner manner;
    manner.form = static_cast<Manner::Form>(*rc::gen::inRange<int>(0, Manner::forms));
    manner.layout = static_cast<Layout>(*rc::gen::inRange<int>(0, static_cast<int>(Layout::count)));
    manner.free_function = *rc::gen::arbitrary<bool>();
    const auto& executors = all_executors();
    manner.options.executor = executors[*rc::gen::inRange<std::size_t>(0, executors.size())].executor.get();
    const auto sets = jostle::supported_instruction_sets();
    manner.options.instruction_set = sets[*rc::gen::inRange<std::size_t>(0, sets.size())];
    return manner;
}

/// Fails the test, with the smallest example that RapidCheck found, unless the property holds.
template <class Property>
void check_all_kinds(const char* what, Property property)
{
    for_each_kind([&](auto kind) {
        EXPECT_TRUE(rc::check(what, [&] { property(kind); }))
            << what << ", " << kind_name<kind.dim, typename decltype(kind)::Number>();
    });
}

TEST(Oracle, BothFormsAgree)
{
    std::uint64_t found = 0;
    for_each_kind([&](auto kind) {
        for (const Scene scene : all_scenes())
            for (const bool cross : {false, true}) {
                Question<kind.dim, typename decltype(kind)::Number> question;
                question.a = make_scene<kind.dim, typename decltype(kind)::Number>(scene, 150, 1);
                question.b = make_scene<kind.dim, typename decltype(kind)::Number>(scene, 100, 2);
                question.cross = cross;
                Random random(3);
                question.columns_a = random_columns(random, 150, cross, true);
                question.columns_b = random_columns(random, 100, cross, true);
                const std::vector<Pair> pairs = oracle(question);
                EXPECT_EQ(pairs, large_oracle(question)) << name(scene);
                found += pairs.size();
            }
    });
    EXPECT_GT(found, 10'000u); // a test that finds nothing proves nothing
}

TEST(Property, AnswerIsTheDefinition)
{
    std::uint64_t found = 0;
    check_all_kinds("the pairs are those that the oracle finds", [&]<class K>(K) {
        const auto question = a_question<K::dim, typename K::Number>(*rc::gen::arbitrary<bool>());
        const std::vector<Pair> expected = oracle(question);
        const std::vector<Pair> answer = ask(question, a_manner());
        found += expected.size();
        RC_ASSERT(sorted(answer) == expected);
    });
    EXPECT_GT(found, 1'000u);
}

TEST(Property, BruteForceIsTheDefinition)
{
    check_all_kinds("find_pairs_brute_force gives the oracle's pairs, ascending", []<class K>(K) {
        const auto plain = some_boxes<K::dim, typename K::Number>();
        const auto others = some_boxes<K::dim, typename K::Number>();
        const BoxView<K::dim, typename K::Number> a(plain), b(others);
        RC_ASSERT((jostle::find_pairs_brute_force(a) == oracle<K::dim, typename K::Number>({plain})));
        RC_ASSERT((jostle::find_pairs_brute_force(a, b) ==
                   oracle<K::dim, typename K::Number>({plain, others, true})));
    });
}

TEST(Property, SortedFormAscends)
{
    check_all_kinds("Order::sorted gives ascending pairs", []<class K>(K) {
        const auto question = a_question<K::dim, typename K::Number>(*rc::gen::arbitrary<bool>());
        Manner manner = a_manner();
        manner.form = Manner::sorted;
        RC_ASSERT(ask(question, manner) == oracle(question));
    });
}

TEST(Property, StreamInOrderIsTheStoredForm)
{
    check_all_kinds("chunks by (block, part) are the canonical order", []<class K>(K) {
        const auto question = a_question<K::dim, typename K::Number>(*rc::gen::arbitrary<bool>());
        Manner stored = a_manner(), streamed = a_manner();
        stored.form = Manner::canonical;
        streamed.form = Manner::streamed;
        RC_ASSERT(ask(question, stored) == ask(question, streamed));
    });
}

TEST(Property, FiltersKeepTheOrder)
{
    // The order depends on the boxes alone, so a filter takes pairs away without moving the others.
    check_all_kinds("a filtered answer is the unfiltered one with pairs left out", []<class K>(K) {
        auto question = a_question<K::dim, typename K::Number>(*rc::gen::arbitrary<bool>());
        const std::vector<Pair> filtered = ask(question);
        const auto filters = question;
        question.columns_a = question.columns_b = {};
        question.ghosts = 0;
        question.vertices.clear();
        question.accept_salt = 0;
        std::vector<Pair> all = ask(question);
        std::erase_if(all, [&](const Pair& pair) { return forbidden(filters, pair.a, pair.b); });
        RC_ASSERT(filtered == all);
    });
}

TEST(Property, AFinderRemembersNothing)
{
    check_all_kinds("a used finder answers like a new one", []<class K>(K) {
        jostle::PairFinder finder;
        Manner used;
        used.finder = &finder;
        for (int call = 0; call < 4; ++call) {
            const auto question = a_question<K::dim, typename K::Number>(*rc::gen::arbitrary<bool>());
            used.form = static_cast<Manner::Form>(*rc::gen::inRange<int>(0, Manner::forms));
            Manner fresh = used;
            fresh.finder = nullptr;
            RC_ASSERT(ask(question, used) == ask(question, fresh));
            if (*rc::gen::arbitrary<bool>()) finder.release_memory();
        }
    });
}

// Relations between answers: they hold whatever the oracle says.

TEST(Property, NumberingOfObjectsDoesNotMatter)
{
    check_all_kinds("boxes in another order give the same pairs, renumbered", []<class K>(K) {
        const auto boxes = some_boxes<K::dim, typename K::Number>();
        std::vector<std::uint32_t> place(boxes.size());
        std::iota(place.begin(), place.end(), 0u);
        Random random(*rc::gen::arbitrary<std::uint64_t>());
        for (std::size_t i = place.size(); i > 1; --i)
            std::swap(place[i - 1], place[random.below(static_cast<std::uint32_t>(i))]);
        Boxes<K::dim, typename K::Number> moved(boxes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            moved[place[i]] = boxes[i];
        std::vector<Pair> renumbered;
        for (const Pair& pair : ask<K::dim, typename K::Number>({boxes}))
            renumbered.push_back(
                {std::min(place[pair.a], place[pair.b]), std::max(place[pair.a], place[pair.b])});
        RC_ASSERT(sorted(ask<K::dim, typename K::Number>({moved})) == sorted(renumbered));
    });
}

TEST(Property, MirroringAndSwappingAxesDoNotMatter)
{
    check_all_kinds("mirrored boxes with axes swapped give the same pairs", []<class K>(K) {
        const auto boxes = some_boxes<K::dim, typename K::Number>();
        auto turned = boxes;
        for (auto& box : turned) {
            std::swap(box.lo[0], box.hi[0]);
            box.lo[0] = -box.lo[0], box.hi[0] = -box.hi[0];
            std::swap(box.lo[0], box.lo[K::dim - 1]);
            std::swap(box.hi[0], box.hi[K::dim - 1]);
        }
        RC_ASSERT(sorted(ask<K::dim, typename K::Number>({boxes})) ==
                  sorted(ask<K::dim, typename K::Number>({turned})));
    });
}

TEST(Property, CrossFormIsSymmetric)
{
    check_all_kinds("swapping the sets swaps the pairs", []<class K>(K) {
        const auto a = some_boxes<K::dim, typename K::Number>();
        const auto b = some_boxes<K::dim, typename K::Number>();
        std::vector<Pair> swapped;
        for (const Pair& pair : ask<K::dim, typename K::Number>({b, a, true}))
            swapped.push_back({pair.b, pair.a});
        RC_ASSERT(sorted(ask<K::dim, typename K::Number>({a, b, true})) == sorted(swapped));
    });
}

TEST(Property, CrossWithItselfHoldsTheSelfForm)
{
    check_all_kinds("pairs a < b of (boxes, boxes) are the pairs of boxes", []<class K>(K) {
        const auto boxes = some_boxes<K::dim, typename K::Number>();
        std::vector<Pair> both = ask<K::dim, typename K::Number>({boxes, boxes, true});
        const auto with_itself =
            std::count_if(both.begin(), both.end(), [](const Pair& pair) { return pair.a == pair.b; });
        RC_ASSERT(static_cast<std::size_t>(with_itself) == boxes.size()); // every box touches itself
        std::erase_if(both, [](const Pair& pair) { return pair.a >= pair.b; });
        RC_ASSERT(sorted(both) == sorted(ask<K::dim, typename K::Number>({boxes})));
    });
}

// The smallest inputs, and finders at the end of their life.

TEST(SmallInput, NoneOneAndTwoBoxes)
{
    const jostle::Aabb3f unit{{0, 0, 0}, {1, 1, 1}}, touching{{1, 1, 1}, {2, 2, 2}},
        beside{{0, 0, 1.0000001f}, {1, 1, 2}};
    for (const auto form : {Manner::canonical, Manner::sorted, Manner::streamed}) {
        Manner manner;
        manner.form = form;
        const std::vector<Pair> one_pair = {{0, 1}}, cross_pair = {{0, 0}}, none;
        EXPECT_EQ(ask<3>(Question<3, float>{}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{unit}}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{unit, touching}}, manner), one_pair);
        EXPECT_EQ(ask<3>(Question<3, float>{{unit, beside}}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{}, {}, true}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{unit}, {}, true}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{}, {unit}, true}, manner), none);
        EXPECT_EQ(ask<3>(Question<3, float>{{touching}, {unit}, true}, manner), cross_pair);
        EXPECT_EQ(ask<3>(Question<3, float>{{unit}, {beside}, true}, manner), none);
    }
}

TEST(SmallInput, DefaultViewsAreEmpty)
{
    jostle::PairFinder finder;
    EXPECT_TRUE(finder.find(BoxView<2, double>{}).empty());
    EXPECT_TRUE(finder.find(BoxView<2, double>{}, BoxView<2, double>{}).empty());
}

/// {} could be a second set as well.
TEST(SmallInput, AnEmptyBraceIsNoFilter)
{
    const std::vector<jostle::Aabb3f> boxes(3, {{0, 0, 0}, {1, 1, 1}});
    const auto view = jostle::box_view(boxes);
    jostle::PairFinder finder;
    EXPECT_EQ(finder.find(view, {}).size(), 3u);
    EXPECT_EQ(finder.find(view, {}, jostle::Order::sorted).size(), 3u);
    EXPECT_EQ(finder.find(view, view, {}).size(), 9u);
    EXPECT_EQ(finder.take(view, {}).size(), 3u);
    EXPECT_EQ(jostle::find_pairs(view, {}).size(), 3u);
    EXPECT_EQ(jostle::find_pairs_brute_force(view, {}).size(), 3u);
}

/// Partners from a set that is much bigger than the one in front of it.
TEST(SmallInput, AFewGiantsAmongManyComeInOrder)
{
    std::vector<jostle::Aabb3f> many(70'000, {{0, 0, 0}, {1, 1, 1}});
    for (std::size_t i = 0; i < many.size(); ++i) // found in quite another order
        many[i].lo[0] = static_cast<float>(i * 7919 % many.size()) / -10'000;
    for (const std::size_t giants : {1u, 3u}) {
        const std::vector<jostle::Aabb3f> few(giants, {{-9, -9, -9}, {9, 9, 9}});
        const auto found = jostle::find_pairs(few, many, {}, jostle::Order::sorted).to_vector();
        EXPECT_EQ(found.size(), giants * many.size());
        EXPECT_TRUE(std::is_sorted(found.begin(), found.end())) << giants;
    }
}

TEST(FinderLife, ScenesOfEveryKindInTurn)
{
    jostle::PairFinder used;
    Manner with_used;
    with_used.finder = &used;
    std::uint64_t found = 0;
    for (std::uint64_t seed = 0; seed < 2; ++seed)
        for (const Scene scene : all_scenes())
            for_each_kind([&]<class K>(K) {
                const std::size_t n = everything_touches(scene) ? 100 : 700;
                Question<K::dim, typename K::Number> question{
                    make_scene<K::dim, typename K::Number>(scene, n, seed)};
                const std::vector<Pair> answer = ask(question, with_used);
                ASSERT_EQ(answer, ask(question)) << name(scene);
                ASSERT_EQ(sorted(answer), oracle(question)) << name(scene);
                found += answer.size();
                question.cross = true;
                question.b = make_scene<K::dim, typename K::Number>(scene, n / 2, seed + 10);
                ASSERT_EQ(ask(question, with_used), ask(question)) << name(scene);
            });
    EXPECT_GT(found, 100'000u);
}

TEST(FinderLife, MovedFindersAnswer)
{
    const Question<3, float> question{make_scene<3, float>(Scene::dense, 300, 5)};
    const std::vector<Pair> expected = ask(question);
    ASSERT_FALSE(expected.empty());
    jostle::PairFinder first;
    Manner manner;
    manner.finder = &first;
    EXPECT_EQ(ask(question, manner), expected);
    jostle::PairFinder second(std::move(first));
    manner.finder = &second;
    EXPECT_EQ(ask(question, manner), expected);
    first = std::move(second); // a moved-from finder may be given a new life, or die
    manner.finder = &first;
    EXPECT_EQ(ask(question, manner), expected);
    first = jostle::PairFinder{};
    EXPECT_EQ(ask(question, manner), expected);
}

TEST(FinderLife, ResultOfAFreeFunctionIsTheCallersOwn)
{
    const Boxes<2, double> boxes = make_scene<2, double>(Scene::dense, 200, 1);
    jostle::PairBuffer pairs = jostle::find_pairs(BoxView<2, double>(boxes));
    const std::vector<Pair> before = pairs.to_vector();
    const jostle::PairBuffer moved = std::move(pairs);
    EXPECT_EQ(moved.to_vector(), before);
    EXPECT_EQ(sorted(before), oracle(Question<2, double>{boxes}));
}

} // namespace
} // namespace contract
