// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <tuple>

#include "churn.hpp"

namespace world_tests {

using jostle::Hit;

/// Asks a world everything, and goes through the twin's objects for the same.
template <int Dim, class T>
class Questions
{
  public:
    template <class Source>
    Questions(const Churn<Dim, T, Source>& churn, std::uint64_t seed) : Questions(churn, *churn.world, seed)
    {
    }
    /// To another world that should say the same.
    template <class Source>
    Questions(const Churn<Dim, T, Source>& churn, jostle::World<Dim, T>& world, std::uint64_t seed)
        : world_(world), to_fork_(*churn.world), random_(seed)
    {
        for (const auto& [index, thing] : churn.twin.things)
            if (thing.enabled) there_.push_back({thing.id, thing.bounds(), thing.filter});
        extent_ = churn.extent;
        if (random_.below(2) == 0) {
            filter_.mask = 3;
            filter_.category = 1;
            filter_.owner = random_.below(6);
            accept_ = [](std::uint32_t, ObjectId id) { return id.index % 5 != 0; };
            filter_.accept = accept_;
            if (!there_.empty()) filter_.exclude = there_[there_.size() / 2].id;
        }
    }

    /// About these only, and all of them.
    void only(std::uint32_t category, std::uint32_t mask)
    {
        filter_ = {};
        filter_.category = category;
        filter_.mask = mask;
    }

    testing::AssertionResult agree()
    {
        constexpr std::size_t many = 3;
        std::vector<jostle::Ray<Dim, T>> rays(many);
        std::vector<jostle::Sweep<Dim, T>> sweeps(many);
        std::vector<Aabb<Dim, T>> boxes(many);
        std::vector<jostle::Sphere<Dim, T>> spheres(many);
        std::vector<jostle::Nearest<Dim, T>> nears(many);
        std::vector<jostle::Plane<Dim, T>> planes(4);
        for (std::size_t i = 0; i < many; ++i) {
            for (int d = 0; d < Dim; ++d) {
                rays[i].origin[d] = spheres[i].center[d] = nears[i].point[d] = coordinate();
                rays[i].direction[d] = sweeps[i].motion[d] =
                    random_.below(6) == 0 && d > 0 ? T(0) : static_cast<T>(random_.uniform(-3, 3)) + T(0.01);
                boxes[i].lo[d] = coordinate();
                boxes[i].hi[d] = boxes[i].lo[d] + static_cast<T>(random_.uniform(0, 3));
            }
            rays[i].max_fraction = static_cast<T>(random_.uniform(0, 9));
            sweeps[i].box = boxes[i];
            sweeps[i].max_fraction = static_cast<T>(random_.uniform(0, 3));
            spheres[i].radius = static_cast<T>(random_.uniform(0, 3));
            nears[i].count = 1 + random_.below(9);
            if (random_.below(2) == 0) nears[i].max_distance = static_cast<T>(random_.uniform(0, 3));
        }
        for (auto& plane : planes) {
            for (int d = 0; d < Dim; ++d)
                plane.normal[d] = static_cast<T>(random_.uniform(-1, 1)) + T(0.01);
            plane.offset = static_cast<T>(random_.uniform(-1, 3));
        }
        const std::vector<jostle::Frustum<Dim, T>> frusta(1, {planes});
        std::string wrong;
        lines(rays, "ray", wrong);
        lines(sweeps, "sweep", wrong);
        regions(boxes, "box", wrong);
        regions(spheres, "sphere", wrong);
        regions(frusta, "frustum", wrong);
        nearest(nears, wrong);
        std::vector<jostle::NearestToBox<Dim, T>> nears_to_box;
        for (std::size_t i = 0; i < many; ++i)
            nears_to_box.push_back({boxes[i], nears[i].count, nears[i].max_distance});
        nearest(nears_to_box, wrong);
        join(boxes, wrong);
        closest(wrong);
        if (!wrong.empty()) return testing::AssertionFailure() << "other answers for" << wrong;
        return testing::AssertionSuccess();
    }

    std::uint64_t results = 0;

  private:
    struct There
    {
        ObjectId id;
        Aabb<Dim, T> bounds;
        ObjectFilter filter;
    };

    T coordinate() { return static_cast<T>(random_.uniform(-1, extent_ + 1)); }
    bool counts(const There& there) const
    {
        if ((filter_.mask != ~0u || filter_.category != ~0u) &&
            ((there.filter.category & filter_.mask) == 0 || (filter_.category & there.filter.mask) == 0))
            return false;
        if (filter_.owner != jostle::Filter::no_owner && there.filter.owner == filter_.owner) return false;
        return there.id != filter_.exclude && (!filter_.accept || filter_.accept(0, there.id));
    }
    static bool earlier(const Hit<T, ObjectId>& a, const Hit<T, ObjectId>& b)
    {
        return a.at != b.at ? a.at < b.at : a.id.index < b.id.index;
    }
    template <class Item>
    static std::vector<Item> cut(std::vector<Item> items, std::size_t most)
    {
        if (items.size() > most) items.resize(most);
        return items;
    }

    template <class Line>
    void lines(const std::vector<Line>& questions, const char* name, std::string& wrong)
    {
        bool good = true;
        std::vector<Hit<T, ObjectId>> firsts(questions.size());
        world_.first(std::span<const Line>(questions), std::span<Hit<T, ObjectId>>(firsts), filter_);
        jostle::ResultLists<Hit<T, ObjectId>> lists, short_lists;
        world_.all(std::span<const Line>(questions), lists, filter_);
        world_.all(std::span<const Line>(questions), short_lists, filter_, 2);
        std::vector<std::uint64_t> sizes;
        for (std::size_t i = 0; i < questions.size(); ++i) {
            std::vector<Hit<T, ObjectId>> expected;
            for (const There& there : there_)
                if (counts(there))
                    if (const std::optional<T> at = jostle::hit_fraction(questions[i], there.bounds))
                        expected.push_back({there.id, *at});
            std::sort(expected.begin(), expected.end(), earlier);
            results += expected.size();
            sizes.push_back(expected.size());
            const auto first = world_.first(questions[i], filter_);
            good &= first.has_value() == !expected.empty() && (!first || *first == expected[0]);
            good &= firsts[i] == (expected.empty() ? Hit<T, ObjectId>{} : expected[0]);
            std::vector<Hit<T, ObjectId>> found;
            good &= !world_.all(questions[i], found, filter_) && found == expected;
            good &= world_.all(questions[i], found, filter_, 2) == (expected.size() > 2) &&
                    found == cut(expected, 2);
            found.assign(lists[i].begin(), lists[i].end());
            good &= found == expected && !lists.more(i);
            found.assign(short_lists[i].begin(), short_lists[i].end());
            good &= found == cut(expected, 2) && short_lists.more(i) == (expected.size() > 2);
            good &= world_.any(questions[i], filter_) == !expected.empty();
            good &= world_.count(questions[i], filter_) == expected.size();
            good &= visited(questions[i], expected);
        }
        good &= counted(questions, sizes);
        if (!good) wrong += std::string(" ") + name;
    }

    /// Whether a visitor gets these, in this order, and may stop.
    template <class Question>
    bool visited(const Question& question, const std::vector<Hit<T, ObjectId>>& expected)
    {
        std::vector<Hit<T, ObjectId>> all, some;
        const auto collect = [&](const Hit<T, ObjectId>& hit, T&) { return all.push_back(hit), true; };
        const auto collect_some = [&](const Hit<T, ObjectId>& hit, T&) {
            some.push_back(hit);
            return some.size() < 3;
        };
        return world_.visit(question, collect, filter_) && all == expected &&
               world_.visit(question, collect_some, filter_) == (expected.size() < 3) &&
               some == cut(expected, 3);
    }
    template <class Region>
    bool visited(const Region& region, const std::vector<ObjectId>& expected)
    {
        std::vector<ObjectId> all, some;
        const auto collect = [&](ObjectId id) { return all.push_back(id), true; };
        const auto collect_some = [&](ObjectId id) {
            some.push_back(id);
            return some.size() < 3;
        };
        bool good = world_.visit(region, collect, filter_);
        good &= world_.visit(region, collect_some, filter_) == (expected.size() < 3) && some == cut(all, 3);
        std::sort(all.begin(), all.end());
        return good && all == expected;
    }

    /// expected[i]: how many results question i has.
    template <class Question>
    bool counted(const std::vector<Question>& questions, const std::vector<std::uint64_t>& expected)
    {
        std::vector<std::uint64_t> found(questions.size());
        const auto any = std::make_unique<bool[]>(questions.size());
        world_.count(std::span<const Question>(questions), std::span<std::uint64_t>(found), filter_);
        world_.any(std::span<const Question>(questions), std::span<bool>(any.get(), questions.size()),
                   filter_);
        for (std::size_t i = 0; i < questions.size(); ++i)
            if (any[i] != (expected[i] != 0)) return false;
        return found == expected;
    }

    void join(const std::vector<Aabb<Dim, T>>& boxes, std::string& wrong)
    {
        std::vector<jostle::Pair> expected;
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
            for (const There& there : there_)
                if (counts(there) && overlaps(boxes[i], there.bounds))
                    expected.push_back({i, there.id.index});
        std::pmr::vector<jostle::Pair> found(3);
        world_.join(boxes, found, filter_);
        if (!std::equal(found.begin(), found.end(), expected.begin(), expected.end())) wrong += " join";
        // One by one, and with filters of each box's own: every other asker leaves out another object, and
        // the last has another mask.
        std::vector<jostle::ObjectQueryFilter> filters(boxes.size(), filter_);
        for (std::size_t i = 0; i < filters.size(); i += 2)
            if (!there_.empty()) filters[i].exclude = there_[i % there_.size()].id;
        if (!filters.empty()) filters.back().mask = ~filter_.mask;
        std::vector<jostle::Pair> told;
        const auto tell = [&](std::uint32_t position, ObjectId id) {
            told.push_back({position, id.index});
            return true;
        };
        if (!world_.join(boxes, tell, filter_)) wrong += " join's visitor stopped";
        std::sort(told.begin(), told.end());
        if (told != expected) wrong += " join one by one";
        expected.clear();
        for (std::uint32_t i = 0; i < boxes.size(); ++i) {
            std::swap(filter_, filters[i]);
            for (const There& there : there_)
                if (counts(there) && overlaps(boxes[i], there.bounds))
                    expected.push_back({i, there.id.index});
            std::swap(filter_, filters[i]);
        }
        world_.join(boxes, found, filters);
        if (!std::equal(found.begin(), found.end(), expected.begin(), expected.end()))
            wrong += " join with filters";
        told.clear();
        world_.join(boxes, tell, filters);
        std::sort(told.begin(), told.end());
        if (told != expected) wrong += " join with filters one by one";
        std::size_t calls = 0;
        const bool went_on =
            world_.join(boxes, [&](std::uint32_t, ObjectId) { return ++calls < 2; }, filters);
        if (went_on != (expected.size() < 2) || calls != std::min<std::size_t>(2, expected.size()))
            wrong += " join's visitor wasn't obeyed";
    }

    /// The closest pairs whose filters agree, up to where there are some hundreds at most.
    void closest(std::string& wrong)
    {
        using Hit = jostle::PairHit<T, jostle::ObjectId>;
        if (world_.stats().refused != 0) return; // only the world knows which
        if (there_.size() > 500) return;         // there are too many pairs
        const T most = 1;
        std::vector<Hit> expected, found;
        for (const There& a : there_)
            for (const There& b : there_) {
                if (!(a.id.index < b.id.index) || !pair_up(a.filter, b.filter)) continue;
                const T at = jostle::squared_distance(a.bounds, b.bounds);
                if (at <= most * most) expected.push_back({a.id, b.id, at});
            }
        const auto in_order = [](const Hit& a, const Hit& b) {
            return std::tie(a.at, a.a.index, a.b.index) < std::tie(b.at, b.a.index, b.b.index);
        };
        const auto collect = [&](const Hit& hit, T&) { return found.push_back(hit), true; };
        bool good = world_.closest_pairs(collect, most);
        const auto zeros =
            std::find_if(found.begin(), found.end(), [](const Hit& hit) { return hit.at > 0; });
        good &= std::is_sorted(zeros, found.end(), in_order);
        const auto first = world_.closest_pair(most);
        good &= first.has_value() == !found.empty() && (!first || *first == found[0]);
        good &= world_.closest_pair(world_, most) == first; // a world's pairs with itself are its own
        std::sort(expected.begin(), expected.end(), in_order);
        std::sort(found.begin(), zeros, in_order);
        good &= found == expected;
        if (!good) wrong += " closest";
        closest_of_two(most, in_order, wrong);
    }
    /// The closest pairs with a fork, which is what the last update left, apply() or not: whichever asks.
    template <class InOrder>
    void closest_of_two(T most, const InOrder& in_order, std::string& wrong)
    {
        using Hit = jostle::PairHit<T, jostle::ObjectId>;
        const jostle::World<Dim, T> fork = to_fork_.fork();
        std::vector<There> others;
        for (std::uint32_t i = 0; i < fork.index_end(); ++i) {
            const ObjectId id = fork.id(i);
            if (!fork.contains(id) || !fork.enabled(id)) continue;
            others.push_back({id, fork.bounds(id), {}});
        }
        std::vector<Hit> expected, found;
        for (const There& a : there_)
            for (const There& b : others)
                if (const T at = jostle::squared_distance(a.bounds, b.bounds); at <= most * most)
                    expected.push_back({a.id, b.id, at});
        const auto ask = [&](const jostle::World<Dim, T>& one, const jostle::World<Dim, T>& other) {
            found.clear();
            const auto collect = [&](const Hit& hit, T&) { return found.push_back(hit), true; };
            if (!one.closest_pairs(other, collect, most)) wrong += " closest of two: it stopped";
            std::sort(found.begin(), found.end(), in_order);
            std::sort(expected.begin(), expected.end(), in_order);
            if (found != expected) wrong += " closest of two";
        };
        ask(world_, fork);
        for (Hit& hit : expected)
            std::swap(hit.a, hit.b);
        ask(fork, world_);
    }
    static bool pair_up(const ObjectFilter& a, const ObjectFilter& b)
    {
        return (a.category & b.mask) != 0 && (b.category & a.mask) != 0 &&
               (a.owner != b.owner || a.owner == jostle::Filter::no_owner) && !(a.is_static && b.is_static);
    }

    template <class Region>
    void regions(const std::vector<Region>& questions, const char* name, std::string& wrong)
    {
        bool good = true;
        jostle::ResultLists<ObjectId> lists, short_lists;
        world_.all(std::span<const Region>(questions), lists, filter_);
        world_.all(std::span<const Region>(questions), short_lists, filter_, 3);
        std::vector<std::uint64_t> sizes;
        for (std::size_t i = 0; i < questions.size(); ++i) {
            std::vector<ObjectId> expected;
            for (const There& there : there_)
                if (counts(there) && overlaps(questions[i], there.bounds)) expected.push_back(there.id);
            results += expected.size();
            sizes.push_back(expected.size());
            std::vector<ObjectId> found;
            good &= !world_.all(questions[i], found, filter_) && found == expected;
            good &= world_.all(questions[i], found, filter_, 3) == (expected.size() > 3) &&
                    found == cut(expected, 3);
            found.assign(lists[i].begin(), lists[i].end());
            good &= found == expected && !lists.more(i);
            found.assign(short_lists[i].begin(), short_lists[i].end());
            good &= found == cut(expected, 3) && short_lists.more(i) == (expected.size() > 3);
            good &= world_.any(questions[i], filter_) == !expected.empty();
            good &= world_.count(questions[i], filter_) == expected.size();
            good &= visited(questions[i], expected);
        }
        good &= counted(questions, sizes);
        if (!good) wrong += std::string(" ") + name;
    }

    static T distance(const jostle::Nearest<Dim, T>& question, const Aabb<Dim, T>& bounds)
    {
        return jostle::squared_distance(question.point, bounds);
    }
    static T distance(const jostle::NearestToBox<Dim, T>& question, const Aabb<Dim, T>& bounds)
    {
        return jostle::squared_distance(question.box, bounds);
    }
    template <class Question>
    void nearest(const std::vector<Question>& questions, std::string& wrong)
    {
        bool good = true;
        jostle::ResultLists<Hit<T, ObjectId>> lists;
        world_.nearest(std::span<const Question>(questions), lists, filter_);
        std::vector<Hit<T, ObjectId>> first(questions.size());
        world_.nearest(questions, first, filter_);
        for (std::size_t i = 0; i < questions.size(); ++i) {
            const T limit = questions[i].max_distance * questions[i].max_distance;
            std::vector<Hit<T, ObjectId>> expected;
            for (const There& there : there_)
                if (const T at = distance(questions[i], there.bounds); counts(there) && at <= limit)
                    expected.push_back({there.id, at});
            std::sort(expected.begin(), expected.end(), earlier);
            expected = cut(expected, questions[i].count);
            results += expected.size();
            std::vector<Hit<T, ObjectId>> found;
            world_.nearest(questions[i], found, filter_);
            good &= found == expected && visited(questions[i], expected);
            found.assign(lists[i].begin(), lists[i].end());
            good &= found == expected;
            good &= first[i] == (expected.empty() ? Hit<T, ObjectId>() : expected.front());
            good &= world_.nearest(questions[i], filter_).value_or(Hit<T, ObjectId>()) == first[i];
        }
        if (!good) wrong += " nearest";
    }

    jostle::World<Dim, T>& world_;
    const jostle::World<Dim, T>& to_fork_; // a view can't be forked
    Random random_;
    double extent_;
    std::vector<There> there_;
    std::function<bool(std::uint32_t, ObjectId)> accept_;
    jostle::ObjectQueryFilter filter_;
};

} // namespace world_tests
