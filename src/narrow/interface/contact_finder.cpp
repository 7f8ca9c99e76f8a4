// SPDX-License-Identifier: MIT
#include <algorithm>

#include "base/block_buffer_access.hpp"
#include "base/checks.hpp"
#include "narrow/interface/answers.hpp"
#include "narrow/interface/contact_finder.hpp"
#include "narrow/parts/merge.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

/// Finds contacts by a user-defined test, for a pair whose a is of the test's first type.
template <int Dim>
void ask_own_test(const Placed<Dim>& pair, double margin, const PairTest<Dim>& test, FoundList<Dim>& found)
{
    Pose<Dim, double> pose_a, pose_b;
    unload(pair.ra, pose_a.rotation);
    unload(pair.rb, pose_b.rotation);
    store(pair.d, pose_b.position);
    test.test(test.context, {*pair.a, pose_a, *pair.b, pose_b, margin},
              [&](const Contact<Dim, double>& contact) {
                  Found<Dim>& one = found.emplace_back();
                  one.part_a = contact.part_a;
                  one.part_b = contact.part_b;
                  one.manifold.normal = load(contact.normal);
                  one.manifold.count = std::min(contact.count, Contact<Dim, double>::max_points);
                  for (std::uint32_t i = 0; i < one.manifold.count; ++i) {
                      const ContactPoint<Dim, double>& point = contact.point[i];
                      one.manifold.point[i] = {load(point.from_a), point.depth,
                                               static_cast<std::uint16_t>(point.feature),
                                               static_cast<std::uint16_t>(point.feature >> 16)};
                  }
              });
}

} // namespace
} // namespace narrow

template <int Dim, Coordinate T>
const PairTest<Dim>* ContactFinder<Dim, T>::Implementation::own_test(ShapeType a, ShapeType b) const
{
    for (std::size_t i = tests.size(); i-- > 0;) { // the last one counts
        const PairTest<Dim>& test = tests[i];
        if ((test.type_a == a && test.type_b == b) || (test.type_a == b && test.type_b == a)) return &test;
    }
    return nullptr;
}

template <int Dim, Coordinate T>
auto ContactFinder<Dim, T>::Implementation::find_one(const Objects& set_a, const Objects& set_b,
                                                     const Pair& pair, double margin,
                                                     narrow::FoundList<Dim>& found) const -> Arranged
{
    const Shape<Dim>& a = set_a.shapes[pair.a];
    const Shape<Dim>& b = set_b.shapes[pair.b];
    Arranged arranged{narrow::place(a, set_a.poses[pair.a], b, set_b.poses[pair.b], *kernels), false};
    const PairTest<Dim>* const test = own_test(a.type(), b.type());
    found.clear();
    if (test == nullptr) {
        arranged.swapped = narrow::arrange(arranged.placed);
        narrow::find_contacts(arranged.placed, margin, found);
        if (!options.all_points) narrow::merge_contacts(arranged.placed, found);
    } else {
        arranged.swapped = narrow::arrange(arranged.placed, test->type_a);
        narrow::ask_own_test(arranged.placed, margin, *test, found);
    }
    narrow::sort_parts(found, arranged.swapped);
    return arranged;
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::sort_groups(const Objects& set_a, const Objects& set_b,
                                                        std::span<const Pair> pairs, std::uint64_t first,
                                                        Worker& worker) const
{
    worker.lists.clear();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        narrow::check_pair(set_a, set_b, pairs[i], first + i);
        const Shape<Dim>&a = set_a.shapes[pairs[i].a], &b = set_b.shapes[pairs[i].b];
        narrow::Group group = narrow::group_of<Dim>(a.type(), b.type());
        if (own_in_group[static_cast<std::size_t>(group)] && own_test(a.type(), b.type()) != nullptr)
            group = narrow::Group::other;
        worker.lists.add(group, static_cast<std::uint16_t>(i));
    }
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::run_groups(const Objects& set_a, const Objects& set_b,
                                                       std::span<const Pair> pairs, double margin,
                                                       Worker& worker) const
{
    worker.found.clear();
    for (std::size_t i = 0; i < pairs.size(); ++i)
        worker.contacts[i].count = 0;
    if constexpr (Dim == 3) {
        narrow::Batch<T> batch{{set_a, set_b, pairs}, worker.lists, worker.contacts, worker.found, margin};
        batch.run(*kernels);
    } else { // circles are tested at once only if there is nothing else
        for (const std::uint16_t i : worker.lists.of(narrow::Group::spheres))
            worker.lists.add(narrow::Group::other, i);
    }
}

template <int Dim, Coordinate T>
template <class Chunk>
std::optional<std::size_t>
ContactFinder<Dim, T>::Implementation::find_balls(const Objects& set_a, const Objects& set_b,
                                                  std::span<const Pair> pairs, double margin,
                                                  const Chunk& chunk_of)
{
    using V = narrow::V<Dim>;
    std::uint16_t near[narrow::block_pairs];
    std::size_t near_count = 0;
    bool in_one_place = false;
    for (std::size_t i = 0; i < pairs.size(); ++i) { // which are near is hard to predict, so no branches
        const Pair& pair = pairs[i];
        const V d = narrow::load(set_b.poses[pair.b].position) - narrow::load(set_a.poses[pair.a].position);
        const double radii = set_a.shapes[pair.a].radius() + set_b.shapes[pair.b].radius();
        near[near_count] = static_cast<std::uint16_t>(i);
        near_count += narrow::spheres_near(radii + margin, d) ? 1 : 0;
        in_one_place = in_one_place | (narrow::length2(d) == 0);
    }
    if (in_one_place) return {};
    const auto chunk = chunk_of(near_count);
    std::size_t count = 0;
    for (std::size_t k = 0; k < near_count; ++k) {
        const Pair& pair = pairs[near[k]];
        const Shape<Dim>&a = set_a.shapes[pair.a], &b = set_b.shapes[pair.b];
        const V d = narrow::load(set_b.poses[pair.b].position) - narrow::load(set_a.poses[pair.a].position);
        // Arranged like any other pair.
        const bool swapped = (d[0] != 0 ? d[0] : d[1] != 0 ? d[1] : d[Dim - 1]) < 0;
        const V way = d * (swapped ? -1.0 : 1.0) + V{}; // never -0, as in from_to()
        narrow::Manifold<Dim> manifold;
        const narrow::Verdict verdict = narrow::spheres(
            swapped ? b.radius() : a.radius(), swapped ? a.radius() : b.radius(), way, margin, manifold);
        if (verdict != narrow::Verdict::touch) continue;
        using Made = typename decltype(chunk)::value_type;
        Made& contact = *::new (&chunk[count++]) Made;
        contact.pair = pair;
        narrow::finish(manifold, way, swapped, contact);
    }
    return count;
}

template <int Dim, Coordinate T>
template <class Made>
std::size_t ContactFinder<Dim, T>::Implementation::write(const Worker& worker, std::span<const Pair> pairs,
                                                         std::span<Made> chunk)
{
    std::uint16_t touching[narrow::block_pairs];
    std::size_t touching_count = 0, count = 0;
    for (std::size_t i = 0; i < pairs.size(); ++i) { // without branches, which would be hard to predict
        touching[touching_count] = static_cast<std::uint16_t>(i);
        touching_count += worker.contacts[i].count != 0 ? 1 : 0;
    }
    for (const std::uint16_t i : std::span(touching).first(touching_count)) {
        const narrow::PairContacts<Dim>& those = worker.contacts[i];
        for (std::uint32_t f = those.first; f < those.first + those.count; ++f) {
            Made& contact = *::new (&chunk[count++]) Made;
            contact.pair = pairs[i];
            narrow::finish(worker.found[f], those.d, those.swapped, contact);
        }
    }
    return count;
}

template <int Dim, Coordinate T>
template <class Chunk>
std::size_t ContactFinder<Dim, T>::Implementation::find_in_block(const Objects& set_a, const Objects& set_b,
                                                                 std::span<const Pair> pairs,
                                                                 std::uint64_t first, double margin,
                                                                 Worker& worker, const Chunk& chunk_of)
{
    sort_groups(set_a, set_b, pairs, first, worker);
    if (worker.lists.of(narrow::Group::spheres).size() == pairs.size())
        if (const auto balls = find_balls(set_a, set_b, pairs, margin, chunk_of)) return *balls;
    run_groups(set_a, set_b, pairs, margin, worker);
    for (const std::uint16_t i : worker.lists.of(narrow::Group::other)) {
        const Arranged arranged = find_one(set_a, set_b, pairs[i], margin, worker.one);
        worker.contacts[i] = {static_cast<std::uint32_t>(worker.found.size()),
                              static_cast<std::uint32_t>(worker.one.size()), arranged.swapped,
                              arranged.placed.d};
        worker.found.insert(worker.found.end(), worker.one.begin(), worker.one.end());
    }
    return write(worker, pairs, chunk_of(worker.found.size()));
}

template <int Dim, Coordinate T>
template <class Made>
const BlockBuffer<Made>&
ContactFinder<Dim, T>::Implementation::find(const Objects& set_a, const Objects& set_b,
                                            std::span<const std::span<const Pair>> blocks, T margin,
                                            BlockBuffer<Made>& into)
{
    const InUse call(in_use, "ContactFinder");
    into.clear();
    narrow::check_length("margin", margin, true);
    narrow::check_sizes(set_a, set_b);

    pair_blocks.clear();
    std::uint64_t before = 0;
    for (std::size_t b = 0; b < blocks.size(); before += blocks[b++].size())
        for (std::size_t first = 0; first < blocks[b].size(); first += narrow::block_pairs)
            pair_blocks.push_back({b, first, before + first, 0});
    BlockBufferAccess access(into);
    access.reserve_chunks(pair_blocks.size());
    access.reserve_blocks(pair_blocks.size());
    const ProcessOptions one_by_one{&executor(), 1};
    ready_workers(plan_work(pair_blocks.size(), one_by_one).slots);

    const auto find_some = [&](std::uint64_t k, std::uint64_t, Work work) {
        PairBlock& block = pair_blocks[k];
        const std::span<const Pair> rest = blocks[block.block].subspan(block.first);
        // A little more than needed, so that a scene whose size fluctuates doesn't allocate at every new
        // contact.
        const auto chunk_of = [&](std::size_t most) {
            return access.chunk(k, most <= access.capacity(k) ? most : (most * 5 / 4 + 63) / 64 * 64);
        };
        block.contacts = find_in_block(set_a, set_b, rest.first(std::min(narrow::block_pairs, rest.size())),
                                       block.number, double{margin}, workers[work.slot], chunk_of);
    };
    process_items(pair_blocks.size(), find_some, one_by_one);
    for (std::size_t k = 0; k < pair_blocks.size(); ++k)
        access.append(access.chunk(k, 0).first(pair_blocks[k].contacts));
    return into;
}

template <int Dim, Coordinate T>
ContactFinder<Dim, T>::ContactFinder(const ContactOptions& options)
    : implementation_((check_memory(options.memory), std::make_unique<Implementation>(options)))
{
}
template <int Dim, Coordinate T>
ContactFinder<Dim, T>::ContactFinder(ContactFinder&&) noexcept = default;
template <int Dim, Coordinate T>
ContactFinder<Dim, T>& ContactFinder<Dim, T>::operator=(ContactFinder&&) noexcept = default;
template <int Dim, Coordinate T>
ContactFinder<Dim, T>::~ContactFinder() = default;

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::add_test(const PairTest<Dim>& test)
{
    if (test.test == nullptr)
        throw Error(ErrorCode::invalid_argument, "a pair test without a function; give PairTest::test");
    for (const ShapeType type : {test.type_a, test.type_b})
        if (type >= ShapeTypes::end && type < ShapeTypes::first_custom)
            throw Error(ErrorCode::invalid_argument,
                        "a pair test for shapes of type " + std::to_string(type) +
                            ", which doesn't exist; give one of ShapeTypes, or a custom one from " +
                            std::to_string(ShapeTypes::first_custom));
    const InUse call(implementation_->in_use, "ContactFinder");
    implementation_->tests.push_back(test);
    const narrow::Group group = narrow::group_of<Dim>(test.type_a, test.type_b);
    implementation_->own_in_group[static_cast<std::size_t>(group)] = group != narrow::Group::other;
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::take(ContactBuffer<Dim, T>& buffer)
{
    const InUse call(implementation_->in_use, "ContactFinder");
    std::swap(implementation_->result, buffer);
    implementation_->result.clear();
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::take(PointContactBuffer<Dim, T>& buffer)
{
    const InUse call(implementation_->in_use, "ContactFinder");
    std::swap(implementation_->points, buffer);
    implementation_->points.clear();
}

template <int Dim, Coordinate T>
bool ContactFinder<Dim, T>::Implementation::touches(const Objects& set_a, const Objects& set_b,
                                                    const Pair& pair, narrow::FoundList<Dim>& scratch) const
{
    const Shape<Dim>&a = set_a.shapes[pair.a], &b = set_b.shapes[pair.b];
    if (own_test(a.type(), b.type()) == nullptr)
        return narrow::touching_of(a, set_a.poses[pair.a], b, set_b.poses[pair.b], *kernels);
    find_one(set_a, set_b, pair, 0, scratch);
    bool any = false;
    for (const narrow::Found<Dim>& one : scratch)
        for (std::uint32_t p = 0; p < one.manifold.count; ++p)
            any = any || one.manifold.point[p].depth >= 0;
    return any;
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::touching(const Objects& set_a, const Objects& set_b,
                                                     PairView pairs, std::span<std::uint8_t> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(set_a, set_b);
    narrow::check_out(pairs.size(), out.size());
    const ProcessOptions in_blocks{&executor(), narrow::block_pairs};
    ready_workers(plan_work(pairs.size(), in_blocks).slots);
    const auto test_some = [&](const PairBatch& some) {
        Worker& worker = workers[some.work.slot];
        const std::span<std::uint8_t> touch = out.subspan(some.first, some.items.size());
        sort_groups(set_a, set_b, some.items, some.first, worker);
        run_groups(set_a, set_b, some.items, 0, worker);
        for (std::size_t i = 0; i < touch.size(); ++i)
            touch[i] = worker.contacts[i].count != 0 ? 1 : 0;
        for (const std::uint16_t i : worker.lists.of(narrow::Group::other))
            touch[i] = touches(set_a, set_b, some.items[i], worker.one) ? 1 : 0;
    };
    process_pairs(pairs, test_some, in_blocks);
}

/// out[i] = answer(a, its pose or motion, b, its), in blocks of this many pairs.
template <int Dim, Coordinate T>
template <class Set, class Out, class Answer>
void ContactFinder<Dim, T>::Implementation::ask(const Set& set_a, const Set& set_b, PairView pairs,
                                                std::span<Out> out, std::uint64_t block, const Answer& answer)
{
    narrow::check_out(pairs.size(), out.size());
    const auto ask_some = [&](const PairBatch& some) {
        for (std::size_t i = 0; i < some.items.size(); ++i) {
            const Pair& pair = some.items[i];
            narrow::check_pair(set_a, set_b, pair, some.first + i);
            out[some.first + i] = answer(set_a.shapes[pair.a], narrow::placed(set_a)[pair.a],
                                         set_b.shapes[pair.b], narrow::placed(set_b)[pair.b]);
        }
    };
    process_pairs(pairs, ask_some, {&executor(), block});
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::distances(const Objects& set_a, const Objects& set_b,
                                                      PairView pairs, T max_distance,
                                                      std::span<Distance<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(set_a, set_b);
    narrow::check_max_distance(max_distance);
    if constexpr (Dim == 3) {
        narrow::check_out(pairs.size(), out.size());
        const auto ask_some = [&](const PairBatch& some) {
            const narrow::Distances<T> block{set_a,        set_b,
                                             some.items,   some.first,
                                             max_distance, out.subspan(some.first, some.items.size())};
            block.run(*kernels);
        };
        process_pairs(pairs, ask_some, {&executor(), narrow::block_pairs});
    } else {
        ask(set_a, set_b, pairs, out, narrow::block_pairs,
            [&](const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
                const Pose<Dim, T>& pose_b) {
                return narrow::distance_of(a, pose_a, b, pose_b, max_distance, *kernels);
            });
    }
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::impacts(const MovingObjects& set_a, const MovingObjects& set_b,
                                                    PairView pairs, T tolerance,
                                                    std::span<Impact<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(set_a, set_b);
    narrow::check_length("tolerance", tolerance, false);
    constexpr std::uint64_t block = 32; // pairs differ in cost
    ask(set_a, set_b, pairs, out, block,
        [&](const Shape<Dim>& a, const Motion<Dim, T>& motion_a, const Shape<Dim>& b,
            const Motion<Dim, T>& motion_b) {
            return narrow::impact_of(a, motion_a, b, motion_b, tolerance);
        });
}

/// Pairs of rays or moving shapes with shapes at rest.
constexpr std::uint64_t cast_block = 64;

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::ray_casts(StridedView<Ray<Dim, T>> rays, const Objects& objects,
                                                      PairView pairs, std::span<CastHit<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(objects, objects);
    narrow::check_out(pairs.size(), out.size());
    const auto cast_some = [&](const PairBatch& some) {
        for (std::size_t i = 0; i < some.items.size(); ++i) {
            const Pair& pair = some.items[i];
            if (pair.a >= rays.size() || pair.b >= objects.shapes.size())
                narrow::refuse_pair(pair, some.first + i, rays.size(), objects.shapes.size());
            const Ray<Dim, T>& ray = rays[pair.a];
            const Shape<Dim>& shape = objects.shapes[pair.b];
            const Pose<Dim, T>& pose = objects.poses[pair.b];
            narrow::check_ray(ray, pair.a);
            narrow::check_object(shape, pose, pair.b);
            out[some.first + i] = narrow::ray_hit_of(shape, pose, ray, *kernels);
        }
    };
    process_pairs(pairs, cast_some, {&executor(), cast_block});
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::shape_casts(const Objects& moving,
                                                        StridedView<Vec<Dim, T>> displacements,
                                                        const Objects& objects, PairView pairs,
                                                        std::span<CastHit<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(moving, objects);
    if (displacements.size() != moving.shapes.size())
        throw Error(ErrorCode::size_mismatch,
                    "there are " + std::to_string(moving.shapes.size()) + " shapes that move and " +
                        std::to_string(displacements.size()) + " displacements; give one of each per object");
    narrow::check_out(pairs.size(), out.size());
    const auto cast_some = [&](const PairBatch& some) {
        for (std::size_t i = 0; i < some.items.size(); ++i) {
            const Pair& pair = some.items[i];
            narrow::check_pair(moving, objects, pair, some.first + i);
            narrow::check_displacement(displacements[pair.a], pair.a);
            out[some.first + i] =
                narrow::shape_hit_of(moving.shapes[pair.a], moving.poses[pair.a], displacements[pair.a],
                                     objects.shapes[pair.b], objects.poses[pair.b], *kernels);
        }
    };
    process_pairs(pairs, cast_some, {&executor(), cast_block});
}

template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Objects<Dim, T>& a, const Objects<Dim, T>& b,
                                                         PairView pairs, T margin) &
{
    return implementation_->find(a, b, pairs.blocks(), margin, implementation_->result);
}
template <int Dim, Coordinate T>
const PointContactBuffer<Dim, T>& ContactFinder<Dim, T>::find_points(const Objects<Dim, T>& a,
                                                                     const Objects<Dim, T>& b, PairView pairs,
                                                                     T margin) &
{
    return implementation_->find(a, b, pairs.blocks(), margin, implementation_->points);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::touching(const Objects<Dim, T>& a, const Objects<Dim, T>& b, PairView pairs,
                                     std::span<std::uint8_t> out)
{
    implementation_->touching(a, b, pairs, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::distances(const Objects<Dim, T>& a, const Objects<Dim, T>& b, PairView pairs,
                                      T max_distance, std::span<Distance<Dim, T>> out)
{
    implementation_->distances(a, b, pairs, max_distance, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::impacts(const MovingObjects<Dim, T>& a, const MovingObjects<Dim, T>& b,
                                    PairView pairs, T tolerance, std::span<Impact<Dim, T>> out)
{
    implementation_->impacts(a, b, pairs, tolerance, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::ray_casts(StridedView<Ray<Dim, T>> rays, const Objects<Dim, T>& objects,
                                      PairView pairs, std::span<CastHit<Dim, T>> out)
{
    implementation_->ray_casts(rays, objects, pairs, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::shape_casts(const Objects<Dim, T>& moving, StridedView<Vec<Dim, T>> displacements,
                                        const Objects<Dim, T>& objects, PairView pairs,
                                        std::span<CastHit<Dim, T>> out)
{
    implementation_->shape_casts(moving, displacements, objects, pairs, out);
}

template class ContactFinder<2, float>;
template class ContactFinder<2, double>;
template class ContactFinder<3, float>;
template class ContactFinder<3, double>;

JOSTLE_NAMESPACE_END
