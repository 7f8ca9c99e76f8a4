// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "jostle/box_index.hpp"

/// Stops at the first difference: the rest would say the same again.
#define ASSERT_OR_RETURN(condition)                                                                          \
    do {                                                                                                     \
        if (!(condition)) {                                                                                  \
            ADD_FAILURE() << #condition;                                                                     \
            return 0;                                                                                        \
        }                                                                                                    \
    } while (false)

/// An index and its slow twin: the same objects in a map, every question answered from the definition.
namespace twin {

using namespace jostle;

/// Numbers that are the same with every compiler and library, or a fuzzer's.
class Random
{
  public:
    explicit Random(std::uint64_t seed) : engine_(std::mt19937_64(seed)) {}
    explicit Random(std::function<std::uint64_t()> engine) : engine_(std::move(engine)) {}
    std::uint32_t below(std::uint32_t end) { return static_cast<std::uint32_t>(engine_() % end); }
    double number(double lo, double hi)
    {
        return lo + (hi - lo) * (static_cast<double>(engine_() >> 11) * (1.0 / 9007199254740992.0));
    }

  private:
    std::function<std::uint64_t()> engine_;
};

enum class Kind
{
    uniform,
    power_law, // sizes over three orders of magnitude
    clusters,
    lattice,   // integers: everything touches something exactly
    flat,      // thin in the last axis
    points,    // zero size, many in the same place
    identical, // all in one place
    giants,    // a few that cover everything, some without end
    far,       // around 1e9, where floats are 64 apart
    stretched, // one long line
    growing,   // distances from the origin of all orders of magnitude
    outliers,  // half of all very far away, in one place on the first axis
    last = outliers
};

inline const char* name(Kind kind)
{
    static const char* const names[] = {"uniform", "power_law", "clusters",  "lattice",
                                        "flat",    "points",    "identical", "giants",
                                        "far",     "stretched", "growing",   "outliers"};
    return names[static_cast<int>(kind)];
}

template <int Dim, class T>
Aabb<Dim, T> random_box(Random& random, Kind kind)
{
    Aabb<Dim, T> box;
    const double infinity = std::numeric_limits<double>::infinity();
    const std::uint32_t draw = random.below(100);
    const double power = 0.1 * std::pow(1 - random.number(0, 0.999), -1 / 1.6);
    for (int d = 0; d < Dim; ++d) {
        double center = random.number(0, 30), size = random.number(0.4, 1);
        switch (kind) {
        case Kind::uniform:
            break;
        case Kind::power_law:
            size = power * random.number(0.8, 1);
            break;
        case Kind::clusters:
            center = 40.0 * (draw % 4) + random.number(0, 3) * random.number(0, 3);
            size = 0.1;
            break;
        case Kind::lattice:
            center = random.below(10);
            size = 2 * random.below(2);
            break;
        case Kind::flat:
            if (d == Dim - 1) center = random.number(0, 0.3);
            break;
        case Kind::points:
            center = random.below(12);
            size = 0;
            break;
        case Kind::identical:
            center = 1;
            size = 1;
            break;
        case Kind::giants:
            if (draw < 3) size = 1000;
            if (draw == 3 && d == 0) size = infinity;
            if (draw == 4) size = infinity;
            if (draw == 5) center = 1e6;
            break;
        case Kind::far:
            center = 1e9 + random.number(0, 3000);
            size = 100;
            break;
        case Kind::stretched:
            center = d == 0 ? random.number(0, 1e5) : 0;
            break;
        case Kind::growing:
            center = std::pow(10.0, (sizeof(T) == 4 ? 0.15 : 1) * (static_cast<double>(draw) + center / 30));
            size *= 0.2 * center;
            if (random.below(2) == 0) center = -center;
            break;
        case Kind::outliers:
            if (d == 0 && draw < 50) center = sizeof(T) == 4 ? 1e17 : 1e100;
            break;
        }
        box.lo[d] = static_cast<T>(size == infinity ? -infinity : center - size / 2);
        box.hi[d] = static_cast<T>(size == infinity ? infinity : center + size / 2);
    }
    return box;
}

template <int Dim, class T>
class Twin
{
  public:
    using Box = Aabb<Dim, T>;

    Twin(Kind kind, std::uint64_t seed, const IndexOptions& options) : Twin(kind, Random(seed), options) {}
    Twin(Kind kind, Random source, const IndexOptions& options)
        : index(options), random(std::move(source)), kind_(kind)
    {
    }

    void insert(std::uint32_t count)
    {
        std::vector<std::uint32_t> ids;
        std::vector<Box> boxes;
        for (std::uint32_t k = 0; k < count; ++k) {
            std::uint32_t id = random.below(4 * (count + static_cast<std::uint32_t>(boxes_.size())));
            while (boxes_.count(id) != 0)
                ++id;
            ids.push_back(id);
            id_end_ = std::max(id_end_, id + 1);
            boxes.push_back(random_box<Dim, T>(random, kind_));
            boxes_[id] = boxes.back();
        }
        index.insert(ids, BoxView<Dim, T>(boxes));
    }
    void erase(std::uint32_t count)
    {
        const std::vector<std::uint32_t> ids = some_ids(count);
        index.erase(ids);
        for (const std::uint32_t id : ids)
            boxes_.erase(id);
    }
    /// Half of them a little, half of them anywhere.
    void move(std::uint32_t count)
    {
        const std::vector<std::uint32_t> ids = some_ids(count);
        std::vector<Box> boxes;
        for (const std::uint32_t id : ids) {
            Box box = random_box<Dim, T>(random, kind_);
            if (random.below(2) == 0) {
                box = boxes_[id];
                for (int d = 0; d < Dim; ++d) {
                    const T by = static_cast<T>(random.number(-0.2, 0.2));
                    box.lo[d] += by;
                    box.hi[d] += by;
                }
            }
            boxes.push_back(boxes_[id] = box);
        }
        index.move(ids, BoxView<Dim, T>(boxes));
    }
    void build()
    {
        std::vector<std::uint32_t> ids;
        std::vector<Box> boxes;
        for (const auto& [id, box] : boxes_) {
            ids.push_back(id);
            boxes.push_back(box);
        }
        index.build(ids, BoxView<Dim, T>(boxes));
    }

    /// Asks everything and compares. Returns the number of results, so that callers can see that there were
    /// some.
    std::uint64_t compare(std::uint32_t questions)
    {
        std::uint64_t results = 0;
        EXPECT_EQ(index.size(), boxes_.size());
        for (const auto& [id, box] : boxes_) {
            EXPECT_TRUE(index.contains(id));
            const Box kept = index.box(id);
            for (int d = 0; d < Dim; ++d)
                EXPECT_TRUE(kept.lo[d] == box.lo[d] && kept.hi[d] == box.hi[d]);
        }
        const std::uint32_t id_end = id_end_;
        std::vector<std::uint32_t> category(id_end), mask(id_end), owner(id_end);
        for (std::uint32_t id = 0; id < id_end; ++id) {
            category[id] = 1u << random.below(4);
            mask[id] = random.below(16);
            owner[id] = random.below(8);
        }
        QueryFilter filters[3];
        filters[1].category = std::span<const std::uint32_t>(category);
        filters[1].mask = std::span<const std::uint32_t>(mask);
        filters[1].asker_category = 3;
        filters[1].asker_mask = 7;
        filters[1].owner = std::span<const std::uint32_t>(owner);
        filters[1].asker_owner = 5;
        filters[1].exclude = boxes_.empty() ? 0 : boxes_.begin()->first;
        const auto odd = [](std::uint32_t, std::uint32_t id) { return id % 2 == 1; };
        filters[2].accept = odd;

        std::vector<Ray<Dim, T>> rays;
        std::vector<Sweep<Dim, T>> sweeps;
        std::vector<Box> regions;
        std::vector<Sphere<Dim, T>> spheres;
        std::vector<Nearest<Dim, T>> nearest;
        std::vector<NearestToBox<Dim, T>> nearest_to_box;
        std::vector<std::vector<Plane<Dim, T>>> planes(questions);
        std::vector<Frustum<Dim, T>> frustums;
        for (std::uint32_t q = 0; q < questions; ++q) {
            rays.push_back(random_ray());
            Sweep<Dim, T> sweep;
            sweep.box = finite_box();
            for (int d = 0; d < Dim; ++d)
                sweep.motion[d] = random_ray().direction[d];
            if (!moves(sweep.motion)) sweep.motion[0] = 1;
            sweep.max_fraction = static_cast<T>(random.number(0, 3));
            sweeps.push_back(sweep);
            regions.push_back(random_box<Dim, T>(random, random.below(4) == 0 ? Kind::giants : kind_));
            Sphere<Dim, T> sphere;
            Nearest<Dim, T> near;
            for (int d = 0; d < Dim; ++d) {
                sphere.center[d] = finite_box().lo[d];
                near.point[d] = finite_box().hi[d];
            }
            sphere.radius = static_cast<T>(random.below(5) == 0 ? 0 : random.number(0, 4));
            near.count = random.below(3) == 0 ? 20 : 1 + random.below(3);
            if (random.below(3) == 0) near.max_distance = static_cast<T>(random.number(0, 5));
            spheres.push_back(sphere);
            nearest.push_back(near);
            nearest_to_box.push_back({finite_box(), near.count, near.max_distance});
            for (std::uint32_t p = random.below(7); p > 0; --p) {
                Plane<Dim, T> plane;
                const Box through = finite_box();
                double offset = 0;
                for (int d = 0; d < Dim; ++d) {
                    plane.normal[d] = random_ray().direction[d];
                    offset -= static_cast<double>(plane.normal[d]) * static_cast<double>(through.lo[d]);
                }
                if (!moves(plane.normal)) plane.normal[Dim - 1] = -1;
                plane.offset = static_cast<T>(offset + random.number(0, 20));
                planes[q].push_back(plane);
            }
            frustums.push_back({planes[q]});
        }

        for (const QueryFilter& filter : filters) {
            const std::uint64_t limit = random.below(2) == 0 ? BoxIndex<Dim, T>::no_limit : random.below(5);
            results += compare_lines(rays, filter, limit);
            results += compare_lines(sweeps, filter, limit);
            results += compare_regions(regions, filter, limit);
            results += compare_regions(spheres, filter, limit);
            results += compare_regions(frustums, filter, limit);
            results += compare_nearest(nearest, filter);
            results += compare_nearest(nearest_to_box, filter);
        }
        results += compare_join(regions);
        return results;
    }

    BoxIndex<Dim, T> index;
    Random random;
    const std::map<std::uint32_t, Box>& boxes() const { return boxes_; }

  private:
    std::vector<std::uint32_t> some_ids(std::uint32_t count)
    {
        std::vector<std::uint32_t> all;
        for (const auto& each : boxes_)
            all.push_back(each.first);
        for (std::size_t k = 0; k + 1 < all.size(); ++k)
            std::swap(all[k], all[k + random.below(static_cast<std::uint32_t>(all.size() - k))]);
        all.resize(std::min<std::size_t>(all.size(), count));
        return all;
    }
    Box finite_box() { return random_box<Dim, T>(random, kind_ == Kind::giants ? Kind::uniform : kind_); }
    static bool moves(const Vec<Dim, T>& direction)
    {
        return std::any_of(direction.begin(), direction.end(),
                           [](T each) { return std::isfinite(T(1) / each); });
    }
    Ray<Dim, T> random_ray()
    {
        Ray<Dim, T> ray;
        const Box from = finite_box(), to = finite_box();
        for (int d = 0; d < Dim; ++d) {
            ray.origin[d] = random.below(2) == 0 ? from.lo[d] : from.hi[d];
            ray.direction[d] = to.hi[d] - ray.origin[d];
            if (random.below(6) == 0) ray.direction[d] = 0;
            if (random.below(40) == 0) ray.direction[d] = std::numeric_limits<T>::denorm_min();
        }
        if (random.below(20) == 0) // so short that fractions overflow
            for (T& each : ray.direction)
                each *= std::numeric_limits<T>::min();
        if (!moves(ray.direction)) ray.direction[random.below(Dim)] = random.below(2) == 0 ? T(-1) : T(2);
        if (random.below(3) == 0) ray.max_fraction = static_cast<T>(random.number(0, 1.5));
        return ray;
    }
    bool counts(const QueryFilter& filter, std::uint32_t id) const
    {
        const bool layers = filter.mask.empty() || ((filter.category[id] & filter.asker_mask) != 0 &&
                                                    (filter.mask[id] & filter.asker_category) != 0);
        const bool others = filter.owner.empty() || filter.owner[id] != filter.asker_owner;
        return layers && others && id != filter.exclude && (!filter.accept || filter.accept(0, id));
    }

    template <class Line>
    std::uint64_t compare_lines(const std::vector<Line>& lines, const QueryFilter& filter,
                                std::uint64_t limit)
    {
        std::vector<std::vector<Hit<T>>> expected(lines.size());
        std::vector<std::uint64_t> counts_all(lines.size());
        std::uint64_t results = 0;
        for (std::size_t q = 0; q < lines.size(); ++q) {
            for (const auto& [id, box] : boxes_) {
                const auto at = hit_fraction(lines[q], box);
                if (at && counts(filter, id)) expected[q].push_back({id, *at});
            }
            std::sort(expected[q].begin(), expected[q].end());
            counts_all[q] = expected[q].size();
            results += counts_all[q];
            std::vector<Hit<T>> got;
            const bool more = index.all(lines[q], got, filter, limit);
            EXPECT_EQ(more, expected[q].size() > limit);
            const auto first = index.first(lines[q], filter);
            ASSERT_OR_RETURN(first.has_value() == !expected[q].empty());
            ASSERT_OR_RETURN(!first || *first == expected[q].front());
            EXPECT_EQ(index.any(lines[q], filter), !expected[q].empty());
            EXPECT_EQ(index.count(lines[q], filter), expected[q].size());
            ASSERT_OR_RETURN(compare_visits(lines[q], expected[q], filter));
            if (expected[q].size() > limit) expected[q].resize(static_cast<std::size_t>(limit));
            ASSERT_OR_RETURN(got == expected[q]);
        }
        const std::span<const Line> batch(lines);
        std::vector<Hit<T>> firsts(lines.size());
        index.first(batch, std::span<Hit<T>>(firsts), filter);
        ResultLists<Hit<T>> lists;
        index.all(batch, lists, filter, limit);
        ASSERT_OR_RETURN(lists.size() == lines.size());
        for (std::size_t q = 0; q < lines.size(); ++q) {
            ASSERT_OR_RETURN((firsts[q].id == Hit<T>::none) == (counts_all[q] == 0));
            ASSERT_OR_RETURN(limit == 0 || counts_all[q] == 0 || firsts[q] == expected[q].front());
            EXPECT_EQ(lists.more(q), counts_all[q] > limit);
            ASSERT_OR_RETURN(
                std::equal(lists[q].begin(), lists[q].end(), expected[q].begin(), expected[q].end()));
        }
        compare_counts(batch, counts_all, filter);
        return results;
    }
    template <class Region>
    std::uint64_t compare_regions(const std::vector<Region>& regions, const QueryFilter& filter,
                                  std::uint64_t limit)
    {
        std::vector<std::vector<std::uint32_t>> expected(regions.size());
        std::vector<std::uint64_t> counts_all(regions.size());
        std::uint64_t results = 0;
        for (std::size_t q = 0; q < regions.size(); ++q) {
            for (const auto& [id, box] : boxes_)
                if (overlaps(regions[q], box) && counts(filter, id)) expected[q].push_back(id);
            counts_all[q] = expected[q].size();
            results += counts_all[q];
            std::vector<std::uint32_t> got;
            const bool more = index.all(regions[q], got, filter, limit);
            EXPECT_EQ(more, expected[q].size() > limit);
            EXPECT_EQ(index.any(regions[q], filter), !expected[q].empty());
            EXPECT_EQ(index.count(regions[q], filter), expected[q].size());
            ASSERT_OR_RETURN(compare_visits(regions[q], expected[q], filter));
            if (expected[q].size() > limit) expected[q].resize(static_cast<std::size_t>(limit));
            ASSERT_OR_RETURN(got == expected[q]);
        }
        const std::span<const Region> batch(regions);
        ResultLists<std::uint32_t> lists;
        index.all(batch, lists, filter, limit);
        ASSERT_OR_RETURN(lists.size() == regions.size());
        for (std::size_t q = 0; q < regions.size(); ++q) {
            EXPECT_EQ(lists.more(q), counts_all[q] > limit);
            ASSERT_OR_RETURN(
                std::equal(lists[q].begin(), lists[q].end(), expected[q].begin(), expected[q].end()));
        }
        compare_counts(batch, counts_all, filter);
        return results;
    }
    template <class Question>
    void compare_counts(std::span<const Question> batch, const std::vector<std::uint64_t>& expected,
                        const QueryFilter& filter)
    {
        std::vector<std::uint64_t> found(batch.size());
        const auto any = std::make_unique<bool[]>(batch.size());
        index.count(batch, std::span<std::uint64_t>(found), filter);
        index.any(batch, std::span<bool>(any.get(), batch.size()), filter);
        EXPECT_EQ(found, expected);
        for (std::size_t q = 0; q < batch.size(); ++q)
            EXPECT_EQ(any[q], expected[q] != 0);
    }
    static T distance_of(const Nearest<Dim, T>& question, const Box& box)
    {
        return squared_distance(question.point, box);
    }
    static T distance_of(const NearestToBox<Dim, T>& question, const Box& box)
    {
        return squared_distance(question.box, box);
    }

    /// Visits all of a region, and some.
    template <class Region>
    bool compare_visits(const Region& region, const std::vector<std::uint32_t>& expected,
                        const QueryFilter& filter)
    {
        std::vector<std::uint32_t> all, some;
        if (!index.visit(region, [&](std::uint32_t id) { return all.push_back(id), true; }, filter))
            return false;
        const std::size_t stop = random.below(40);
        const auto stops = [&](std::uint32_t id) {
            some.push_back(id);
            return some.size() < stop;
        };
        if (index.visit(region, stops, filter) != (expected.empty() || stop > expected.size()) ||
            some.size() != std::min(expected.size(), std::max<std::size_t>(stop, 1)) ||
            !std::equal(some.begin(), some.end(), all.begin()))
            return false;
        std::sort(all.begin(), all.end());
        return all == expected;
    }

    /// Visits what is expected in this order, to the end, with a stop on the way, and looking for the least
    /// of distances that the visitor alone knows.
    template <class Question>
    bool compare_visits(const Question& question, const std::vector<Hit<T>>& expected,
                        const QueryFilter& filter)
    {
        std::vector<Hit<T>> got;
        if (!index.visit(
                question, [&](const Hit<T>& hit, T&) { return got.push_back(hit), true; }, filter) ||
            got != expected)
            return false;
        const std::size_t stop = random.below(6);
        got.clear();
        const auto stops = [&](const Hit<T>& hit, T& bound) {
            bound += 1; // greater: stays as it is
            got.push_back(hit);
            return got.size() < stop;
        };
        if (index.visit(question, stops, filter) != (expected.empty() || stop > expected.size()) ||
            got.size() != std::min(expected.size(), std::max<std::size_t>(stop, 1)) ||
            !std::equal(got.begin(), got.end(), expected.begin()))
            return false;
        // A shape lies somewhere in its box, so at least as far as that; or isn't met at all.
        const auto real = [](const Hit<T>& hit) { return hit.at + static_cast<T>(hit.id % 7) / 2; };
        const auto met = [](const Hit<T>& hit) { return hit.id % 3 != 0; };
        Hit<T> nearest, least;
        for (const Hit<T>& hit : expected)
            if (met(hit) && (least.id == Hit<T>::none || Hit<T>{hit.id, real(hit)} < least))
                least = {hit.id, real(hit)};
        std::size_t seen = 0, too_far = 0;
        const auto shrinks = [&](const Hit<T>& hit, T& bound) {
            if (seen == expected.size() || !(hit == expected[seen])) return false;
            ++seen;
            too_far += nearest.id != Hit<T>::none && hit.at > nearest.at;
            if (met(hit) && (nearest.id == Hit<T>::none || Hit<T>{hit.id, real(hit)} < nearest)) {
                nearest = {hit.id, real(hit)};
                bound = nearest.at;
            }
            return true;
        };
        return index.visit(question, shrinks, filter) && nearest == least && too_far == 0;
    }

    template <class Question>
    std::uint64_t compare_nearest(const std::vector<Question>& questions, const QueryFilter& filter)
    {
        std::uint64_t results = 0;
        ResultLists<Hit<T>> lists;
        index.nearest(std::span<const Question>(questions), lists, filter);
        std::vector<Hit<T>> first(questions.size());
        index.nearest(questions, first, filter);
        ASSERT_OR_RETURN(lists.offsets().size() == questions.size() + 1);
        for (std::size_t q = 0; q < questions.size(); ++q) {
            const Question& question = questions[q];
            std::vector<Hit<T>> expected, got;
            for (const auto& [id, box] : boxes_) {
                const T at = distance_of(question, box);
                if (at <= question.max_distance * question.max_distance && counts(filter, id))
                    expected.push_back({id, at});
            }
            std::sort(expected.begin(), expected.end());
            if (expected.size() > question.count) expected.resize(question.count);
            results += expected.size();
            index.nearest(question, got, filter);
            ASSERT_OR_RETURN(got == expected);
            ASSERT_OR_RETURN(compare_visits(question, expected, filter));
            ASSERT_OR_RETURN(std::equal(lists[q].begin(), lists[q].end(), expected.begin(), expected.end()));
            ASSERT_OR_RETURN(lists.items().data() + lists.offsets()[q] == lists[q].data());
            ASSERT_OR_RETURN(first[q] == (expected.empty() ? Hit<T>() : expected.front()));
            ASSERT_OR_RETURN(index.nearest(question, filter).value_or(Hit<T>()) == first[q]);
        }
        ASSERT_OR_RETURN(lists.offsets().back() == lists.items().size());
        return results;
    }
    std::uint64_t compare_join(const std::vector<Box>& movers)
    {
        std::vector<Pair> expected;
        for (std::uint32_t a = 0; a < movers.size(); ++a)
            for (const auto& [id, box] : boxes_)
                if (overlaps(movers[a], box)) expected.push_back({a, id});
        std::pmr::vector<Pair> got;
        index.join(BoxView<Dim, T>(movers), got);
        ASSERT_OR_RETURN(std::equal(got.begin(), got.end(), expected.begin(), expected.end()));
        return expected.size();
    }
#undef ASSERT_OR_RETURN
    std::map<std::uint32_t, Box> boxes_;
    Kind kind_;
    std::uint32_t id_end_ = 1;
};

} // namespace twin
