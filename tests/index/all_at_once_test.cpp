// SPDX-License-Identifier: MIT
// Every feature of an index with every other, and every number of objects, ids, questions and results on both
// sides of a power of two: failed calls, filters for all and one each, batches, visits, joins and
// pairs of two indexes, against a walk over all boxes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "index/box_index_access.hpp"
#include "jostle/box_index.hpp"
#include "tests/bad_box.hpp"
#include "tests/contract/edge_numbers.hpp"
#include "tests/index/twin.hpp"

namespace {

using namespace jostle;
using twin::Kind;
using twin::Random;

template <int Dim, class T>
class Model
{
  public:
    using Box = Aabb<Dim, T>;

    Model(std::uint64_t seed, const IndexOptions& options)
        : random(seed),
          index(options),
          kind_(static_cast<Kind>(random.below(static_cast<std::uint32_t>(Kind::last) + 1)))
    {
    }

    void change()
    {
        switch (random.below(12)) {
        case 0:
        case 1:
            build(edge(900));
            break;
        case 2:
            if (random.below(4) == 0) index.clear(), boxes.clear(), id_end_ = 0;
            index.release_memory();
            id_end_ = boxes.empty() ? 0 : boxes.rbegin()->first + 1;
            break;
        case 3:
            fail();
            break;
        case 4:
        case 5:
        case 6:
            insert(edge(600));
            break;
        case 7:
        case 8:
            erase(edge(500));
            break;
        default:
            move(edge(600));
        }
    }
    [[nodiscard]] std::uint32_t edge(std::uint32_t most) { return contract::edge_number(random, most); }
    [[nodiscard]] Box some_box() { return twin::random_box<Dim, T>(random, kind_); }
    [[nodiscard]] Box finite_box()
    {
        return twin::random_box<Dim, T>(random, kind_ == Kind::giants ? Kind::uniform : kind_);
    }
    [[nodiscard]] std::uint32_t id_end() const { return id_end_; }
    [[nodiscard]] bool has_all() const
    {
        return index.size() == boxes.size() && std::ranges::all_of(boxes, [&](const auto& each) {
                   if (!index.contains(each.first)) return false;
                   const Box box = index.box(each.first);
                   return std::memcmp(&box, &each.second, sizeof box) == 0;
               });
    }

    Random random;
    BoxIndex<Dim, T> index;
    std::map<std::uint32_t, Box> boxes;

  private:
    /// Ids that aren't in use, often with the greatest at a power of two or beside it.
    std::vector<std::uint32_t> fresh_ids(std::uint32_t count)
    {
        const auto room = static_cast<std::uint32_t>(boxes.size()) + count;
        const std::uint32_t end =
            random.below(4) == 0 ? 4 * room + 1 : contract::edge_number_from(random, room);
        std::vector<std::uint32_t> ids;
        std::map<std::uint32_t, bool> taken;
        for (std::uint32_t id = end; ids.size() < count; id = random.below(end) + 1) {
            while (boxes.count(id - 1) != 0 || taken.count(id - 1) != 0)
                id = id % end + 1;
            taken[id - 1] = true;
            ids.push_back(id - 1);
        }
        return ids;
    }
    std::vector<std::uint32_t> some_ids(std::uint32_t count)
    {
        std::vector<std::uint32_t> all;
        for (const auto& each : boxes)
            all.push_back(each.first);
        for (std::size_t k = 0; k + 1 < all.size(); ++k)
            std::swap(all[k], all[k + random.below(static_cast<std::uint32_t>(all.size() - k))]);
        all.resize(std::min<std::size_t>(all.size(), count));
        return all;
    }
    std::vector<Box> some_boxes(std::size_t count)
    {
        std::vector<Box> some;
        while (some.size() < count)
            some.push_back(some_box());
        return some;
    }
    void build(std::uint32_t count)
    {
        boxes.clear();
        std::vector<std::uint32_t> ids = fresh_ids(count);
        const std::vector<Box> given = some_boxes(count);
        if (random.below(2) == 0) {
            for (std::uint32_t i = 0; i < count; ++i)
                ids[i] = i;
            index.build(given);
        } else {
            index.build(ids, given);
        }
        id_end_ = 0;
        note(ids, given);
    }
    void note(const std::vector<std::uint32_t>& ids, const std::vector<Box>& given)
    {
        for (std::size_t i = 0; i < ids.size(); ++i) {
            boxes[ids[i]] = given[i];
            id_end_ = std::max(id_end_, ids[i] + 1);
        }
    }
    void insert(std::uint32_t count)
    {
        const std::vector<std::uint32_t> ids = fresh_ids(count);
        const std::vector<Box> given = some_boxes(count);
        index.insert(ids, given);
        note(ids, given);
    }
    void erase(std::uint32_t count)
    {
        const std::vector<std::uint32_t> ids = some_ids(count);
        index.erase(ids);
        for (const std::uint32_t id : ids)
            boxes.erase(id);
    }
    void move(std::uint32_t count)
    {
        const std::vector<std::uint32_t> ids = some_ids(count);
        std::vector<Box> given = some_boxes(ids.size());
        const bool near = random.below(2) == 0;
        for (std::size_t i = 0; i < ids.size() && near; ++i) {
            given[i] = boxes[ids[i]];
            given[i].lo[0] -= static_cast<T>(0.125);
        }
        index.move(ids, given);
        note(ids, given);
    }
    /// Calls that are refused for one of their entries: the last, the first or any other.
    void fail()
    {
        std::vector<std::uint32_t> here = some_ids(1 + edge(300)), fresh = fresh_ids(1 + edge(300));
        const auto any_of = [&](const auto& list) {
            const auto size = static_cast<std::uint32_t>(list.size());
            return std::min(size - 1, edge(size));
        };
        std::vector<Box> boxes_here = some_boxes(here.size()), boxes_fresh = some_boxes(fresh.size());
        std::vector<Box> bad = boxes_fresh;
        make_bad(bad[any_of(bad)], random.below(1000));
        EXPECT_THROW(index.insert(fresh, bad), Error);
        EXPECT_THROW(index.build(fresh, bad), Error);
        std::vector<std::uint32_t> twice = fresh;
        twice.insert(twice.begin() + any_of(fresh), fresh[any_of(fresh)]);
        boxes_fresh.push_back(some_box());
        EXPECT_THROW(index.insert(twice, boxes_fresh), Error);
        if (here.empty()) return;
        twice = here;
        twice.insert(twice.begin() + any_of(here), here[any_of(here)]);
        boxes_here.push_back(some_box());
        EXPECT_THROW(index.move(twice, boxes_here), Error);
        EXPECT_THROW(index.erase(twice), Error);
        here[any_of(here)] = fresh[any_of(fresh)]; // isn't there
        EXPECT_THROW(index.erase(here), Error);
        boxes_here.pop_back();
        EXPECT_THROW(index.move(here, boxes_here), Error);
    }

    Kind kind_;
    std::uint32_t id_end_ = 0;
};

template <int Dim, class T>
[[nodiscard]] bool is_valid(const Aabb<Dim, T>& box)
{
    for (int d = 0; d < Dim; ++d)
        if (!(box.lo[d] <= box.hi[d])) return false;
    return true;
}

/// One round of questions to a model's index.
template <int Dim, class T>
class Asker
{
  public:
    using Box = Aabb<Dim, T>;

    Asker(Model<Dim, T>& model, std::size_t questions)
        : model_(model),
          random_(model.random),
          index_(model.index),
          category_(model.id_end()),
          mask_(model.id_end()),
          owner_(model.id_end()),
          accept_{random_.below(2) == 0 ? 97u : 3u},
          one_each_(random_.below(2) == 0),
          filters_(questions)
    {
        for (std::size_t id = 0; id < model.id_end(); ++id) {
            category_[id] = 1u << random_.below(4);
            mask_[id] = random_.below(16);
            owner_[id] = random_.below(4);
        }
        for (QueryFilter& filter : filters_)
            filter = one_each_ || &filter == &filters_[0] ? some_filter() : filters_[0];
    }

    template <class Line>
    void ask_lines(const std::vector<Line>& lines)
    {
        std::vector<std::vector<Hit<T>>> expected(lines.size());
        for (std::uint32_t q = 0; q < lines.size(); ++q) {
            for (const auto& [id, box] : model_.boxes)
                if (is_valid(box) && is_asked(lines[q]) && counts(q, id))
                    if (const auto at = hit_fraction(lines[q], box)) expected[q].push_back({id, *at});
            std::sort(expected[q].begin(), expected[q].end());
        }
        std::vector<Hit<T>> firsts(lines.size());
        batch([&](const auto& filters) { index_.first(lines, firsts, filters); });
        for (std::size_t q = 0; q < lines.size(); ++q)
            ASSERT_EQ(firsts[q].id, expected[q].empty() ? Hit<T>::none : expected[q][0].id) << q;
        for (std::size_t q = 0; q < lines.size(); q += 4) {
            if (!may_be_alone(q)) continue;
            const auto first = index_.first(lines[q], filters_[q]);
            ASSERT_EQ(first.has_value(), !expected[q].empty());
            ASSERT_TRUE(!first || *first == expected[q][0]);
        }
        ask_all<Hit<T>>(lines, expected);
    }
    template <class Region>
    void ask_regions(const std::vector<Region>& regions)
    {
        std::vector<std::vector<std::uint32_t>> expected(regions.size());
        for (std::uint32_t q = 0; q < regions.size(); ++q)
            for (const auto& [id, box] : model_.boxes)
                if (is_valid(box) && is_asked(regions[q]) && counts(q, id) && overlaps(regions[q], box))
                    expected[q].push_back(id);
        ask_all<std::uint32_t>(regions, expected);
    }
    template <class Question>
    void ask_nearest(const std::vector<Question>& questions)
    {
        std::vector<std::vector<Hit<T>>> expected(questions.size());
        for (std::uint32_t q = 0; q < questions.size(); ++q) {
            const T limit = questions[q].max_distance * questions[q].max_distance;
            for (const auto& [id, box] : model_.boxes) {
                if (!is_valid(box) || !is_asked(questions[q]) || !counts(q, id)) continue;
                if (const T at = distance(questions[q], box); at <= limit) expected[q].push_back({id, at});
            }
            std::sort(expected[q].begin(), expected[q].end());
            if (expected[q].size() > questions[q].count) expected[q].resize(questions[q].count);
        }
        ResultLists<Hit<T>> lists;
        batch([&](const auto& filters) { index_.nearest(questions, lists, filters); });
        for (std::size_t q = 0; q < questions.size(); ++q) {
            ASSERT_TRUE(std::ranges::equal(lists[q], expected[q])) << q;
            if (q % 4 != 0 || !may_be_alone(q)) continue;
            std::vector<Hit<T>> found(3);
            index_.nearest(questions[q], found, filters_[q]);
            ASSERT_EQ(found, expected[q]);
            visit(q, questions[q], expected[q]);
        }
    }
    void join(const std::vector<Box>& boxes)
    {
        std::pmr::vector<Pair> expected, found(2), visited;
        for (std::uint32_t a = 0; a < boxes.size(); ++a)
            for (const auto& [id, box] : model_.boxes)
                if (is_valid(boxes[a]) && is_valid(box) && overlaps(boxes[a], box) && counts(a, id))
                    expected.push_back({a, id});
        batch([&](const auto& filters) { index_.join(boxes, found, filters); });
        ASSERT_EQ(found, expected);
        const std::size_t stop = stop_of(expected.size());
        const auto visitor = [&](std::uint32_t a, std::uint32_t b) {
            visited.push_back({a, b});
            return visited.size() != stop;
        };
        batch([&](const auto& filters) {
            EXPECT_EQ(index_.join(boxes, visitor, filters), stop == 0 || stop > expected.size());
        });
        ASSERT_EQ(visited.size(), stop == 0 ? expected.size() : std::min(stop, expected.size()));
        std::sort(visited.begin(), visited.end());
        ASSERT_TRUE(std::ranges::includes(expected, visited));
        ASSERT_TRUE(std::ranges::adjacent_find(visited) == visited.end());
    }
    void pairs(const Model<Dim, T>& other)
    {
        const bool same = &other == &model_;
        const T reach = random_.below(2) == 0 ? std::numeric_limits<T>::infinity() : T(1);
        std::vector<PairHit<T>> closest, found;
        std::pmr::vector<Pair> touching, visited;
        for (const auto& [a, box] : model_.boxes)
            for (const auto& [b, target] : other.boxes) {
                if ((same && b <= a) || !is_valid(box) || !is_valid(target)) continue;
                if (overlaps(box, target)) touching.push_back({a, b});
                if (const T at = squared_distance(box, target); at <= reach * reach)
                    closest.push_back({a, b, at});
            }
        const auto visitor = [&](std::uint32_t a, std::uint32_t b) {
            return visited.push_back({a, b}), true;
        };
        ASSERT_TRUE(same ? index_.pairs(visitor) : index_.pairs(other.index, visitor));
        std::sort(visited.begin(), visited.end());
        ASSERT_EQ(visited, touching);
        std::sort(closest.begin(), closest.end());
        const auto zeros = static_cast<std::size_t>(
            std::ranges::find_if(closest, [](const auto& hit) { return hit.at > 0; }) - closest.begin());
        const std::size_t most = zeros + model_.edge(600);
        const auto collect = [&](const PairHit<T>& hit, T&) {
            return found.push_back(hit), found.size() < most;
        };
        if (same)
            index_.closest_pairs(collect, reach);
        else
            index_.closest_pairs(other.index, collect, reach);
        std::sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(std::min(zeros, found.size())));
        ASSERT_EQ(found.size(), std::min(std::max<std::size_t>(most, 1), closest.size()));
        ASSERT_TRUE(most < zeros || most == 0 || std::equal(found.begin(), found.end(), closest.begin()));
    }

  private:
    [[nodiscard]] QueryFilter some_filter()
    {
        QueryFilter filter;
        const std::uint32_t what = random_.below(16);
        if ((what & 1) != 0) {
            filter.category = std::span<const std::uint32_t>(category_);
            filter.mask = std::span<const std::uint32_t>(mask_);
            filter.asker_category = 1 + random_.below(15);
            filter.asker_mask = 1 + random_.below(15);
        }
        if ((what & 2) != 0) {
            filter.owner = std::span<const std::uint32_t>(owner_);
            filter.asker_owner = random_.below(4);
        }
        if ((what & 4) != 0 && model_.id_end() != 0) filter.exclude = random_.below(model_.id_end());
        if ((what & 8) != 0) filter.accept = accept_;
        return filter;
    }
    [[nodiscard]] bool counts(std::uint32_t q, std::uint32_t id) const
    {
        const QueryFilter& filter = filters_[q];
        if (!filter.mask.empty() &&
            ((category_[id] & filter.asker_mask) == 0 || (mask_[id] & filter.asker_category) == 0))
            return false;
        if (!filter.owner.empty() && owner_[id] == filter.asker_owner) return false;
        return id != filter.exclude && (!filter.accept || accept_(q, id));
    }

    template <class Question>
    [[nodiscard]] static bool is_asked(const Question& question)
    {
        if constexpr (requires { question.box; })
            return is_valid(question.box);
        else if constexpr (requires { question.lo; })
            return is_valid(question);
        else
            return true;
    }
    static T distance(const Nearest<Dim, T>& question, const Box& box)
    {
        return squared_distance(question.point, box);
    }
    static T distance(const NearestToBox<Dim, T>& question, const Box& box)
    {
        return squared_distance(question.box, box);
    }
    template <class Body>
    void batch(const Body& body) const
    {
        if (one_each_)
            body(filters_);
        else
            body(filters_.empty() ? QueryFilter{} : filters_[0]);
    }
    /// After how many a visitor stops; 0: never.
    [[nodiscard]] std::size_t stop_of(std::size_t results)
    {
        switch (random_.below(4)) {
        case 0:
            return 0;
        case 1:
            return results;
        case 2:
            return results + 1;
        default:
            return model_.edge(static_cast<std::uint32_t>(results));
        }
    }
    template <class Item, class Question>
    void ask_all(const std::vector<Question>& questions, const std::vector<std::vector<Item>>& expected)
    {
        std::size_t most_found = 0;
        for (const auto& each : expected)
            most_found = std::max(most_found, each.size());
        const std::uint64_t limit = random_.below(2) == 0
                                        ? BoxIndex<Dim, T>::no_limit
                                        : model_.edge(static_cast<std::uint32_t>(most_found) + 1);
        ResultLists<Item> lists;
        std::vector<std::uint64_t> sizes(questions.size());
        const auto any = std::make_unique<bool[]>(questions.size() + 1);
        batch([&](const auto& filters) {
            index_.all(questions, lists, filters, limit);
            index_.count(questions, sizes, filters);
            index_.any(questions, std::span<bool>(any.get(), questions.size()), filters);
        });
        ASSERT_EQ(lists.size(), questions.size());
        for (std::size_t q = 0; q < questions.size(); ++q) {
            const std::size_t size = expected[q].size();
            const auto cut = std::span(expected[q]).first(std::min<std::size_t>(size, limit));
            ASSERT_TRUE(std::ranges::equal(lists[q], cut)) << q << " of " << questions.size();
            ASSERT_EQ(lists.more(q), size > limit);
            ASSERT_EQ(sizes[q], size);
            ASSERT_EQ(any[q], size != 0);
            if (q % 4 != 0 || !may_be_alone(q)) continue;
            visit(q, questions[q], expected[q]);
            std::vector<Item> found(5);
            ASSERT_EQ(index_.all(questions[q], found, filters_[q], limit), size > limit);
            ASSERT_TRUE(std::ranges::equal(found, cut));
            ASSERT_EQ(index_.count(questions[q], filters_[q]), size);
            ASSERT_EQ(index_.any(questions[q], filters_[q]), size != 0);
        }
    }
    /// Whether a question says the same alone, where it has the number 0.
    [[nodiscard]] bool may_be_alone(std::size_t q) const { return q == 0 || !filters_[q].accept; }
    template <class Question, class Item>
    void visit(std::size_t q, const Question& question, const std::vector<Item>& expected)
    {
        std::vector<Item> found;
        const std::size_t stop = stop_of(expected.size());
        bool all = false;
        if constexpr (std::is_same_v<Item, std::uint32_t>)
            all = index_.visit(
                question, [&](std::uint32_t id) { return found.push_back(id), found.size() != stop; },
                filters_[q]);
        else
            all = index_.visit(
                question, [&](const Hit<T>& hit, T&) { return found.push_back(hit), found.size() != stop; },
                filters_[q]);
        ASSERT_EQ(all, stop == 0 || stop > expected.size());
        ASSERT_EQ(found.size(), stop == 0 ? expected.size() : std::min(stop, expected.size()));
        if constexpr (std::is_same_v<Item, std::uint32_t>) {
            std::sort(found.begin(), found.end());
            ASSERT_TRUE(std::ranges::includes(expected, found));
        } else {
            ASSERT_TRUE(std::equal(found.begin(), found.end(), expected.begin()));
        }
    }

    Model<Dim, T>& model_;
    Random& random_;
    BoxIndex<Dim, T>& index_;
    std::vector<std::uint32_t> category_, mask_, owner_;
    /// Most, or hardly any.
    struct Accept
    {
        std::uint32_t one_of;
        bool operator()(std::uint32_t q, std::uint32_t id) const
        {
            return one_of > 3 ? (id + q) % one_of == 0 : (id * 7 + q) % one_of != 0;
        }
    };
    const Accept accept_;
    bool one_each_;
    std::vector<QueryFilter> filters_;
};

template <int Dim, class T>
void ask(Model<Dim, T>& model, const Model<Dim, T>& other)
{
    Random& random = model.random;
    const std::size_t questions = model.edge(70);
    std::vector<Ray<Dim, T>> rays(questions);
    std::vector<Sweep<Dim, T>> sweeps(questions);
    std::vector<Aabb<Dim, T>> regions;
    std::vector<Sphere<Dim, T>> spheres(questions);
    std::vector<Nearest<Dim, T>> nearest(questions);
    std::vector<NearestToBox<Dim, T>> nearest_to_box;
    std::vector<Plane<Dim, T>> planes;
    std::vector<Frustum<Dim, T>> frustums;
    Aabb<Dim, T> all;
    std::fill(all.lo.begin(), all.lo.end(), -std::numeric_limits<T>::infinity());
    std::fill(all.hi.begin(), all.hi.end(), std::numeric_limits<T>::infinity());
    for (std::size_t q = 0; q < questions; ++q) {
        for (int d = 0; d < Dim; ++d) {
            const auto along = static_cast<T>(random.number(-1, 1)) + T(0.001);
            rays[q].origin[d] = model.finite_box().lo[d];
            rays[q].direction[d] =
                random.below(3) == 0 ? model.finite_box().lo[d] - rays[q].origin[d] : along;
            if (!std::isfinite(1 / rays[q].direction[d])) rays[q].direction[d] = along;
            sweeps[q].motion[d] = along;
            spheres[q].center[d] = nearest[q].point[d] = model.finite_box().hi[d];
        }
        if (random.below(3) == 0) rays[q].max_fraction = static_cast<T>(random.number(0, 2));
        sweeps[q].box = model.finite_box();
        regions.push_back(random.below(8) == 0 ? all : model.some_box());
        spheres[q].radius = static_cast<T>(random.below(4) == 0 ? 0 : random.number(0, 30));
        nearest[q].count = model.edge(300);
        if (random.below(3) == 0) nearest[q].max_distance = static_cast<T>(random.number(0, 5));
        nearest_to_box.push_back({model.finite_box(), model.edge(300), nearest[q].max_distance});
    }
    planes.resize(model.edge(8));
    for (Plane<Dim, T>& plane : planes) {
        for (int d = 0; d < Dim; ++d)
            plane.normal[d] = static_cast<T>(random.number(-1, 1)) + T(0.001);
        plane.offset = static_cast<T>(random.number(-10, 40));
    }
    for (std::size_t q = 0; q < questions; ++q)
        frustums.push_back(
            {std::span<const Plane<Dim, T>>(planes).first(planes.size() - q % (planes.size() + 1))});
    Asker<Dim, T> asker(model, questions);
    asker.ask_lines(rays);
    asker.ask_lines(sweeps);
    asker.ask_regions(regions);
    asker.ask_regions(spheres);
    asker.ask_regions(frustums);
    asker.ask_nearest(nearest);
    asker.ask_nearest(nearest_to_box);
    std::vector<Aabb<Dim, T>> joined(model.edge(400));
    for (Aabb<Dim, T>& box : joined)
        box = random.below(16) == 0 ? all : model.some_box();
    Asker<Dim, T>(model, joined.size()).join(joined);
    if (model.boxes.size() * other.boxes.size() < 400'000) asker.pairs(other);
    if (model.boxes.size() < 500) asker.pairs(model);
}

template <int Dim, class T>
void live(std::uint64_t seed, InstructionSet set)
{
    SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(Dim) +
                 (sizeof(T) == 4 ? "f " : "d ") + name(set));
    const auto executor = make_thread_executor(1 + static_cast<std::uint32_t>(seed % 3));
    const IndexOptions options{.executor = executor.get(), .instruction_set = set};
    Model<Dim, T> one(2 * seed, options), other(2 * seed + 1, options);
    for (int step = 0; step < 12; ++step) {
        one.change();
        if (step % 3 == 0) other.change();
        ASSERT_EQ(BoxIndexAccess::tree(one.index).validate(), nullptr) << "step " << step;
        ASSERT_TRUE(one.has_all());
        ask(one, other);
        if (testing::Test::HasFailure()) FAIL() << "step " << step << ", " << one.boxes.size() << " boxes";
    }
}

TEST(AllAtOnce, AnswersAreAsDefined)
{
    std::uint64_t seed = 0;
    for (const InstructionSet set : supported_instruction_sets())
        for (int round = 0; round < 6; ++round) {
            live<3, float>(++seed, set);
            live<2, float>(++seed, set);
            live<3, double>(++seed, set);
            live<2, double>(++seed, set);
        }
}

} // namespace
