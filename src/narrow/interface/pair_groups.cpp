// SPDX-License-Identifier: MIT
// Pairs in groups, each with one answer; other pairs are computed only as far as needed.
#include <algorithm>
#include <limits>

#include "base/instantiate.hpp"
#include "narrow/interface/answers.hpp"
#include "narrow/interface/contact_finder.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace {

// Groups differ much in cost.
constexpr std::uint64_t groups_at_once = 4;

void check_groups(std::span<const std::uint64_t> offsets, std::size_t pairs, std::size_t out)
{
    check_offsets(offsets, "group", "pair", pairs, "pairs");
    if (offsets.size() - 1 != out)
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(offsets.size() - 1) +
                                                  " groups and room for " + std::to_string(out) +
                                                  " answers; give one per group");
}

/// A lower bound of the distance of two shapes, by spheres around them.
template <int Dim, class T>
double apart_at_least(const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                      const Pose<Dim, T>& pose_b)
{
    const double between = narrow::length(narrow::load(pose_b.position) - narrow::load(pose_a.position));
    const double reach = narrow::ShapeAccess::reach(a) + narrow::ShapeAccess::reach(b);
    return between - reach - (between + reach) * 1e-12; // rounding included
}

} // namespace

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::first_touching(const Objects& set_a, const Objects& set_b,
                                                           std::span<const Pair> pairs,
                                                           std::span<const std::uint64_t> offsets,
                                                           std::span<std::uint64_t> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(set_a, set_b);
    check_groups(offsets, pairs.size(), out.size());
    const ProcessOptions options_of_groups{&executor(), groups_at_once};
    ready_workers(plan_work(out.size(), options_of_groups).slots);

    // The first touching pair of a run, or the run's length if none touches.
    const auto first_of = [&](std::span<const Pair> some, std::uint64_t number, Worker& worker) {
        sort_groups(set_a, set_b, some, number, worker);
        run_groups(set_a, set_b, some, 0, worker);
        std::size_t first = 0;
        while (first < some.size() && worker.contacts[first].count == 0)
            ++first;
        // In ascending order except for pairs that a kernel couldn't decide, which come last.
        for (const std::uint16_t i : worker.lists.of(narrow::Group::other))
            if (i < first && touches(set_a, set_b, some[i], worker.one)) first = i;
        return first;
    };
    const auto answer = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        for (std::uint64_t group = begin; group < end; ++group) {
            out[group] = no_pair;
            // Kernels gain from many pairs at once, and groups that touch early from few.
            std::uint64_t length = 2 * narrow::batch;
            for (std::uint64_t at = offsets[group]; at < offsets[group + 1];) {
                const std::uint64_t count = std::min(length, offsets[group + 1] - at);
                const std::size_t first = first_of(pairs.subspan(at, count), at, workers[work.slot]);
                if (first < count) {
                    out[group] = at + first;
                    break;
                }
                at += count;
                length = std::min<std::uint64_t>(2 * length, narrow::block_pairs);
            }
        }
    };
    process_items(out.size(), answer, options_of_groups);
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::least_distances(const Objects& set_a, const Objects& set_b,
                                                            std::span<const Pair> pairs,
                                                            std::span<const std::uint64_t> offsets,
                                                            T max_distance, std::span<Distance<Dim, T>> out,
                                                            std::span<std::uint64_t> nearest)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(set_a, set_b);
    narrow::check_max_distance(max_distance);
    check_groups(offsets, pairs.size(), out.size());
    check_groups(offsets, pairs.size(), nearest.size());
    const ProcessOptions options_of_groups{&executor(), groups_at_once};
    ready_workers(plan_work(out.size(), options_of_groups).slots);

    const auto answer_one = [&](std::uint64_t begin, std::uint64_t end, Distance<Dim, T>& best,
                                std::uint64_t& best_pair, Worker& worker) {
        best = {};
        best.distance = std::numeric_limits<T>::infinity();
        best_pair = no_pair;
        T enough = max_distance;
        const auto take = [&](std::uint64_t number) {
            const Pair& pair = pairs[number];
            const Distance<Dim, T> found =
                narrow::distance_of(set_a.shapes[pair.a], set_a.poses[pair.a], set_b.shapes[pair.b],
                                    set_b.poses[pair.b], enough, *kernels);
            if (found.distance == std::numeric_limits<T>::infinity()) return;
            if (best_pair != no_pair &&
                !(found.distance < best.distance || (found.distance == best.distance && number < best_pair)))
                return;
            best = found;
            best_pair = number;
            // It may have been rounded down, and an equally far pair may come earlier.
            const T apart = std::max(best.distance, T(0));
            enough = std::min(enough, apart + apart * (4 * std::numeric_limits<T>::epsilon()) +
                                          std::numeric_limits<T>::min());
        };
        worker.pending.clear();
        for (std::uint64_t number = begin; number < end; ++number) {
            const Pair& pair = pairs[number];
            narrow::check_pair(set_a, set_b, pair, number);
            const Shape<Dim>&a = set_a.shapes[pair.a], &b = set_b.shapes[pair.b];
            if (narrow::is_simple(a.type()) && narrow::is_simple(b.type()))
                take(number); // which costs less than postponing it
            else
                worker.pending.push_back(
                    {apart_at_least(a, set_a.poses[pair.a], b, set_b.poses[pair.b]), number});
        }
        std::sort(worker.pending.begin(), worker.pending.end(), [](const Pending& x, const Pending& y) {
            return x.at_least != y.at_least ? x.at_least < y.at_least : x.number < y.number;
        });
        for (const Pending& each : worker.pending) {
            if (each.at_least > double{enough}) break;
            take(each.number);
        }
    };
    const auto answer = [&](std::uint64_t begin, std::uint64_t end, Work work) {
        for (std::uint64_t group = begin; group < end; ++group)
            answer_one(offsets[group], offsets[group + 1], out[group], nearest[group], workers[work.slot]);
    };
    process_items(out.size(), answer, options_of_groups);
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::first_touching(const Objects<Dim, T>& a, const Objects<Dim, T>& b,
                                           std::span<const Pair> pairs,
                                           std::span<const std::uint64_t> offsets,
                                           std::span<std::uint64_t> out)
{
    implementation_->first_touching(a, b, pairs, offsets, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::least_distances(const Objects<Dim, T>& a, const Objects<Dim, T>& b,
                                            std::span<const Pair> pairs,
                                            std::span<const std::uint64_t> offsets, T max_distance,
                                            std::span<Distance<Dim, T>> out, std::span<std::uint64_t> nearest)
{
    implementation_->least_distances(a, b, pairs, offsets, max_distance, out, nearest);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template JOSTLE_API void ContactFinder<Dim, T>::first_touching(                                          \
        const Objects<Dim, T>&, const Objects<Dim, T>&, std::span<const Pair>,                               \
        std::span<const std::uint64_t>, std::span<std::uint64_t>);                                           \
    template JOSTLE_API void ContactFinder<Dim, T>::least_distances(                                         \
        const Objects<Dim, T>&, const Objects<Dim, T>&, std::span<const Pair>,                               \
        std::span<const std::uint64_t>, T, std::span<Distance<Dim, T>>, std::span<std::uint64_t>);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
