// SPDX-License-Identifier: MIT
// The contract of the pair finders, for boxes that lie on all ranks: the answer is the definition, whatever
// the boxes, their numbers, their owners and the threads.
#include <rapidcheck.h>

#include "scene.hpp"
#include "tests/contract/harness.hpp"

namespace mpi_tests {
namespace {

using contract::Boxes;
using contract::Question;
using jostle::Pair;

/// Whose box i is, and its id: both say nothing about where it is.
int owner_of(std::uint64_t salt, std::size_t i)
{
    return static_cast<int>(Random(salt, i, 0).below(static_cast<std::uint32_t>(ranks())));
}
std::uint64_t id_of(std::size_t i)
{
    return std::uint64_t{i} << 20 | 9;
}

/// The pairs of the distributed world, by the boxes' positions, in order; another answer if a rank's aren't.
template <int Dim, class T>
std::vector<Pair> merged(const std::vector<jostle::mpi::Pair<Dim, T>>& mine)
{
    const auto in_order = [](const auto& x, const auto& y) {
        return std::pair(x.a, x.b) < std::pair(y.a, y.b);
    };
    if (!everywhere(std::is_sorted(mine.begin(), mine.end(), in_order))) return {{1, 0}};
    std::vector<Pair> pairs;
    for (const auto& pair : gathered(std::span(mine)))
        pairs.push_back({static_cast<std::uint32_t>(pair.a >> 20), static_cast<std::uint32_t>(pair.b >> 20)});
    std::sort(pairs.begin(), pairs.end());
    return pairs;
}

/// A world that is asked a question by adding or moving objects.
template <int Dim, class T>
class AskedWorld
{
  public:
    AskedWorld(std::uint64_t salt, jostle::Executor& executor)
        : salt_(salt), world_(MPI_COMM_WORLD, {.executor = &executor})
    {
    }
    /// Objects that there are move, get other filters, are added or removed.
    std::vector<Pair> ask(const Question<Dim, T>& question)
    {
        for (std::size_t i = 0; i < std::max(count_, question.a.size()); ++i) {
            const std::uint64_t id = id_of(i);
            const bool is_here = world_.contains(id);
            if (i >= question.a.size()) {
                if (is_here) world_.remove(id);
                continue;
            }
            jostle::ObjectOptions<T> options;
            if (!question.columns_a.category.empty()) {
                options.filter.category = question.columns_a.category[i];
                options.filter.mask = question.columns_a.mask[i];
            }
            if (!question.columns_a.owner.empty()) options.filter.owner = question.columns_a.owner[i];
            if (is_here) {
                world_.move(id, question.a[i]);
                world_.set_filter(id, options.filter);
            } else if (i >= count_ && owner_of(salt_, i) == rank())
                world_.add(id, question.a[i], options);
        }
        count_ = question.a.size();
        world_.update();
        std::vector<jostle::mpi::EndedPair> ended = gathered(world_.ended());
        for (const Pair pair : merged(world_.began().to_vector()))
            good_ = pairs_.insert({pair.a, pair.b}).second && good_;
        for (const auto& pair : ended)
            good_ = pairs_.erase({static_cast<std::uint32_t>(pair.a >> 20),
                                  static_cast<std::uint32_t>(pair.b >> 20)}) == 1 &&
                    good_;
        std::vector<Pair> all;
        for (const auto& [a, b] : pairs_)
            all.push_back({a, b});
        return good_ ? all : std::vector<Pair>{{2, 0}};
    }

  private:
    std::uint64_t salt_;
    jostle::mpi::World<Dim, T> world_;
    std::size_t count_ = 0;
    std::set<std::pair<std::uint32_t, std::uint32_t>> pairs_;
    bool good_ = true; // each pair begins once and ends once
};
template <int Dim, class T>
std::vector<Pair> ask(const Question<Dim, T>& question, std::uint64_t salt, jostle::Executor& executor)
{
    return AskedWorld<Dim, T>(salt, executor).ask(question);
}

jostle::Executor& executor_of(std::uint32_t threads)
{
    static const std::unique_ptr<jostle::Executor> two = jostle::make_thread_executor(2);
    return threads == 2 ? *two : jostle::serial_executor();
}

TEST(Contract, ScenesOfEveryKind)
{
    std::uint64_t found = 0;
    contract::for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        for (const contract::Scene scene : contract::all_scenes())
            for (const std::uint32_t threads : {1u, 2u}) {
                const std::size_t n = contract::everything_touches(scene) ? 60 : 400;
                Question<K::dim, T> question;
                question.a = contract::make_scene<K::dim, T>(scene, n, threads);
                Random draw(threads);
                contract::Random random(threads);
                if (threads == 2) question.columns_a = contract::random_columns(random, n, true, true);
                const std::vector<Pair> expected = contract::oracle(question);
                ASSERT_EQ(ask(question, draw.next(), executor_of(threads)), expected)
                    << contract::name(scene) << " " << contract::kind_name<K::dim, T>();
                found += expected.size();
            }
    });
    EXPECT_GT(found, 50'000u);
}

TEST(Contract, AWorldRemembersNothing)
{
    std::uint64_t found = 0;
    contract::for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        AskedWorld<K::dim, T> world(3, executor_of(2));
        for (const contract::Scene scene : contract::all_scenes()) {
            const std::size_t n =
                contract::everything_touches(scene) ? 50 : 200 + 20 * static_cast<std::size_t>(scene);
            Question<K::dim, T> question;
            question.a = contract::make_scene<K::dim, T>(scene, n, 5);
            contract::Random random(n);
            question.columns_a = contract::random_columns(random, n, n % 3 == 0, n % 2 == 0);
            const std::vector<Pair> expected = contract::oracle(question);
            ASSERT_EQ(world.ask(question), expected)
                << contract::name(scene) << " " << contract::kind_name<K::dim, T>();
            found += expected.size();
        }
    });
    EXPECT_GT(found, 20'000u);
}

// --- Small random boxes that RapidCheck shrinks where an answer is wrong; main() gives all ranks one seed -

/// A bound: mostly small whole numbers, so that bounds meet; else anything but NaN.
template <class T>
rc::Gen<T> a_number()
{
    const auto numbers = contract::special_numbers<T>();
    return rc::gen::weightedOneOf<T>(
        {{6, rc::gen::map(rc::gen::inRange(-6, 7), [](int i) { return static_cast<T>(i) / 2; })},
         {1, rc::gen::elementOf(std::vector<T>(numbers.begin(), numbers.end()))},
         {1, rc::gen::suchThat(rc::gen::arbitrary<T>(), [](T x) { return x == x; })}});
}
template <int Dim, class T>
Boxes<Dim, T> some_boxes()
{
    const auto bounds = *rc::gen::container<std::vector<std::array<T, std::size_t{2 * Dim}>>>(
        rc::gen::container<std::array<T, std::size_t{2 * Dim}>>(a_number<T>()));
    Boxes<Dim, T> boxes;
    for (const auto& each : bounds) {
        auto& box = boxes.emplace_back();
        for (int d = 0; d < Dim; ++d) {
            const T x = each[2 * static_cast<std::size_t>(d)], y = each[2 * static_cast<std::size_t>(d) + 1];
            box.lo[d] = std::min(x, y);
            box.hi[d] = std::max(x, y);
        }
    }
    return boxes;
}
template <int Dim, class T>
Question<Dim, T> a_question()
{
    Question<Dim, T> question;
    question.a = some_boxes<Dim, T>();
    contract::Random random(*rc::gen::arbitrary<std::uint64_t>());
    const bool masks = *rc::gen::arbitrary<bool>(), owners = *rc::gen::arbitrary<bool>();
    question.columns_a = contract::random_columns(random, question.a.size(), masks, owners);
    return question;
}
/// The same property on all ranks: it holds on all or on none, so that they stay together.
template <class Property>
void check_all_kinds(const char* what, Property property)
{
    contract::for_each_kind([&](auto kind) {
        EXPECT_TRUE(rc::check(what, [&] { RC_ASSERT(everywhere(property(kind))); })) << what;
    });
}

TEST(Contract, AnswerIsTheDefinition)
{
    std::uint64_t found = 0;
    check_all_kinds("the pairs are those that the oracle finds", [&]<class K>(K) {
        const auto question = a_question<K::dim, typename K::Number>();
        const auto salt = *rc::gen::arbitrary<std::uint64_t>();
        const std::vector<Pair> expected = contract::oracle(question);
        found += expected.size();
        return ask(question, salt, executor_of(1 + salt % 2)) == expected;
    });
    EXPECT_GT(found, 300u);
}
TEST(Contract, NumberingAndOwnersDoNotMatter)
{
    check_all_kinds("boxes in another order, of other ranks, give the same pairs", [&]<class K>(K) {
        using T = typename K::Number;
        const auto boxes = some_boxes<K::dim, T>();
        const auto salt = *rc::gen::arbitrary<std::uint64_t>();
        std::vector<std::uint32_t> place(boxes.size());
        std::iota(place.begin(), place.end(), 0u);
        contract::Random random(salt);
        for (std::size_t i = place.size(); i > 1; --i)
            std::swap(place[i - 1], place[random.below(static_cast<std::uint32_t>(i))]);
        Boxes<K::dim, T> moved(boxes.size());
        for (std::size_t i = 0; i < boxes.size(); ++i)
            moved[place[i]] = boxes[i];
        std::vector<Pair> renumbered;
        for (const Pair& pair : ask(Question<K::dim, T>{boxes}, salt, executor_of(1)))
            renumbered.push_back(
                {std::min(place[pair.a], place[pair.b]), std::max(place[pair.a], place[pair.b])});
        return ask(Question<K::dim, T>{moved}, ~salt, executor_of(1)) == contract::sorted(renumbered);
    });
}
TEST(Contract, SomeUpdatesAreAsGoodAsOne)
{
    check_all_kinds("a used world answers like a new one", [&]<class K>(K) {
        const auto salt = *rc::gen::arbitrary<std::uint64_t>();
        AskedWorld<K::dim, typename K::Number> used(salt, executor_of(1));
        bool good = true;
        for (int call = 0; call < 4; ++call) {
            const auto question = a_question<K::dim, typename K::Number>();
            good = used.ask(question) == contract::oracle(question) && good;
        }
        return good;
    });
}

TEST(Contract, ABadBoundAtAnyPlaceNamesTheObject)
{
    contract::for_each_kind([&]<class K>(K) {
        using T = typename K::Number;
        for (int place = 0; place < 2 * K::dim; ++place)
            for (const bool is_nan : {true, false}) {
                Boxes<K::dim, T> boxes = contract::make_scene<K::dim, T>(contract::Scene::uniform, 30, 1);
                const auto bad = static_cast<std::size_t>(7 + place);
                const int axis = place % K::dim;
                auto& side = place < K::dim ? boxes[bad].lo : boxes[bad].hi;
                side[axis] = is_nan           ? std::numeric_limits<T>::quiet_NaN()
                             : place < K::dim ? boxes[bad].hi[axis] + 1
                                              : boxes[bad].lo[axis] - 1;
                const std::string text =
                    failure_of([&] { (void)ask(Question<K::dim, T>{boxes}, 1, executor_of(1)); });
                const std::string bound = is_nan ? (place < K::dim ? "lo." : "hi.") : "lo.";
                const std::string expected = "rank " + std::to_string(owner_of(1, bad)) + ": object " +
                                             std::to_string(id_of(bad)) + ": " + bound + "xyz"[axis] +
                                             (is_nan ? " is NaN" : " = ");
                EXPECT_NE(text.find(expected), std::string::npos) << text << "\n" << expected;
            }
    });
}

} // namespace
} // namespace mpi_tests
