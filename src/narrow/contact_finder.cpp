// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <limits>
#include <string>

#include "in_use.hpp"
#include "jostle/contact.hpp"
#include "jostle/process.hpp"
#include "narrow/answers.hpp"
#include "narrow/batches.hpp"
#include "validate.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

/// One set of objects, each with a Pose or a Motion.
template <int Dim, class Where>
struct Side
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Where> poses;
};

template <int Dim, class Where>
void check_sizes(const Side<Dim, Where>& a, const Side<Dim, Where>& b, const char* of)
{
    for (const Side<Dim, Where>* side : {&a, &b})
        if (side->shapes.size() != side->poses.size())
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(side->shapes.size()) +
                                                      " shapes and " + std::to_string(side->poses.size()) +
                                                      " " + of + "; give one of each per object");
}
void check_out(std::size_t pairs, std::size_t out)
{
    if (pairs != out)
        throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(pairs) + " pairs and room for " +
                                                  std::to_string(out) + " answers; give one per pair");
}
[[noreturn]] void refuse_pair(const Pair& pair, std::uint64_t number, std::size_t objects_a,
                              std::size_t objects_b)
{
    const std::string of_b = objects_b != objects_a ? " and " + std::to_string(objects_b) : "";
    throw Error(ErrorCode::invalid_argument,
                "pair " + std::to_string(number) + " names objects " + std::to_string(pair.a) + " and " +
                    std::to_string(pair.b) + ", but there are " + std::to_string(objects_a) + of_b +
                    ", numbered from 0",
                pair.a < objects_a ? pair.b : pair.a);
}
[[noreturn]] void refuse_itself(const Pair& pair, std::uint64_t number)
{
    throw Error(ErrorCode::invalid_argument,
                "pair " + std::to_string(number) + " is of object " + std::to_string(pair.a) +
                    " and itself; give pairs of two objects",
                pair.a);
}
template <int Dim, class T>
void check_object(const Shape<Dim>&, const Pose<Dim, T>& pose, std::uint32_t object)
{
    if (!valid(pose)) refuse_pose(pose, object);
}
template <int Dim, class T>
void check_object(const Shape<Dim>& shape, const Motion<Dim, T>& motion, std::uint32_t object)
{
    if (!valid(motion) || turns_without_end(shape, motion)) refuse_motion<Dim, T>(object);
}
/// Objects that no pair names are nobody's business.
template <int Dim, class Where>
inline void check_pair(const Side<Dim, Where>& a, const Side<Dim, Where>& b, const Pair& pair,
                       std::uint64_t number)
{
    if (pair.a >= a.shapes.size() || pair.b >= b.shapes.size())
        refuse_pair(pair, number, a.shapes.size(), b.shapes.size());
    if (pair.a == pair.b && &a.poses[pair.a] == &b.poses[pair.b] && &a.shapes[pair.a] == &b.shapes[pair.b])
        refuse_itself(pair, number);
    check_object(a.shapes[pair.a], a.poses[pair.a], pair.a);
    check_object(b.shapes[pair.b], b.poses[pair.b], pair.b);
}

} // namespace
} // namespace narrow

template <int Dim, Coordinate T>
struct ContactFinder<Dim, T>::Implementation
{
    using Sides = narrow::Side<Dim, Pose<Dim, T>>;
    using MovingSides = narrow::Side<Dim, Motion<Dim, T>>;
    explicit Implementation(const ContactOptions& given)
        : options(given), kernels(&narrow::kernels_for(checked(given.instruction_set))), result(given.memory)
    {
    }

    [[nodiscard]] Executor& executor() const
    {
        return options.executor != nullptr ? *options.executor : default_executor();
    }

    /// Contacts of one pair into `found`, seen from the first object of the arranged pair.
    struct Arranged
    {
        narrow::Placed<Dim> placed;
        bool swapped;
    };
    Arranged find_one(const Sides& side_a, const Sides& side_b, const Pair& pair, double margin,
                      narrow::FoundList<Dim>& found) const;
    const PairTest<Dim>* own_test(ShapeType a, ShapeType b, bool& turned) const;
    [[nodiscard]] bool has_own(ShapeType a, ShapeType b) const
    {
        return a < 8 && b < 8 && (own >> (8 * a + b) & 1) != 0;
    }

    const ContactBuffer<Dim, T>& find(const Sides& side_a, const Sides& side_b,
                                      std::span<const std::span<const Pair>> blocks, T margin);
    void touching(const Sides& side_a, const Sides& side_b, PairView pairs, std::span<std::uint8_t> out);
    void distances(const Sides& side_a, const Sides& side_b, PairView pairs, T max_distance,
                   std::span<Distance<Dim, T>> out);
    void impacts(const MovingSides& side_a, const MovingSides& side_b, PairView pairs, T tolerance,
                 std::span<Impact<Dim, T>> out);
    template <class Where, class Out, class Answer>
    void ask(const narrow::Side<Dim, Where>& side_a, const narrow::Side<Dim, Where>& side_b, PairView pairs,
             std::span<Out> out, std::uint64_t block, const Answer& answer);

    struct alignas(64) Worker
    {
        explicit Worker(std::pmr::memory_resource* memory) : found(memory), one(memory) {}
        narrow::FoundList<Dim> found, one;
        narrow::PairLists lists;
        narrow::Slot<Dim> slot[narrow::block_pairs];
    };
    /// A run of pairs of one given block.
    struct PairBlock
    {
        std::size_t block, first;
        std::uint64_t number; // of the first among all pairs
    };
    /// Sorts a block's pairs by what tests them and runs the kernels. What is left is in Group::other.
    void run_groups(const Sides& side_a, const Sides& side_b, std::span<const Pair> pairs,
                    std::uint64_t first, double margin, Worker& worker) const;
    void ready_workers(std::uint32_t count)
    {
        while (workers.size() < count)
            workers.emplace_back(options.memory);
    }

    ContactOptions options;
    const narrow::Kernels* kernels;
    std::pmr::vector<PairTest<Dim>> tests{options.memory};
    std::uint64_t own = 0; // bit 8 a + b: there is one for these two types of the library's
    std::pmr::vector<Worker> workers{options.memory};
    std::pmr::vector<PairBlock> pair_blocks{options.memory};
    ContactBuffer<Dim, T> result;
    std::atomic<bool> in_use{false};
};

template <int Dim, Coordinate T>
const PairTest<Dim>* ContactFinder<Dim, T>::Implementation::own_test(ShapeType a, ShapeType b,
                                                                     bool& turned) const
{
    for (std::size_t i = tests.size(); i-- > 0;) {
        const PairTest<Dim>& test = tests[i];
        const bool as_given = test.type_a == a && test.type_b == b;
        if (!as_given && !(test.type_a == b && test.type_b == a)) continue;
        turned = !as_given;
        return &test;
    }
    return nullptr;
}

template <int Dim, Coordinate T>
auto ContactFinder<Dim, T>::Implementation::find_one(const Sides& side_a, const Sides& side_b,
                                                     const Pair& pair, double margin,
                                                     narrow::FoundList<Dim>& found) const -> Arranged
{
    const Shape<Dim>& a = side_a.shapes[pair.a];
    const Shape<Dim>& b = side_b.shapes[pair.b];
    Arranged arranged{narrow::place(a, side_a.poses[pair.a], b, side_b.poses[pair.b]), false};
    arranged.placed.kernels = kernels;
    arranged.swapped = narrow::arrange(arranged.placed);
    found.clear();
    const narrow::Placed<Dim>& placed = arranged.placed;
    bool turned = false;
    const PairTest<Dim>* test =
        tests.empty() ? nullptr : own_test(placed.a->type(), placed.b->type(), turned);
    if (test == nullptr) {
        narrow::find_contacts(placed, margin, found);
        narrow::sort_parts(found, arranged.swapped);
        return arranged;
    }
    // Its types may be the other way round than the arranged ones.
    if (turned) {
        std::swap(arranged.placed.a, arranged.placed.b);
        std::swap(arranged.placed.ra, arranged.placed.rb);
        arranged.placed.d = -arranged.placed.d;
        arranged.swapped = !arranged.swapped;
    }
    Pose<Dim, double> pose_a, pose_b;
    narrow::unload(placed.ra, pose_a.rotation);
    narrow::unload(placed.rb, pose_b.rotation);
    narrow::store(placed.d, pose_b.position);
    test->test(test->context, {*placed.a, pose_a, *placed.b, pose_b, margin},
               [&](const Contact<Dim, double>& contact) {
                   narrow::Found<Dim>& one = found.emplace_back();
                   one.part_a = contact.part_a;
                   one.part_b = contact.part_b;
                   one.manifold.normal = narrow::load(contact.normal);
                   one.manifold.count = std::min(contact.count, Contact<Dim, double>::max_points);
                   for (std::uint32_t i = 0; i < one.manifold.count; ++i)
                       one.manifold.point[i] = {narrow::load(contact.point[i].from_a), contact.point[i].depth,
                                                static_cast<std::uint16_t>(contact.point[i].feature),
                                                static_cast<std::uint16_t>(contact.point[i].feature >> 16)};
               });
    narrow::sort_parts(found, arranged.swapped);
    return arranged;
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::run_groups(const Sides& side_a, const Sides& side_b,
                                                       std::span<const Pair> pairs, std::uint64_t first,
                                                       double margin, Worker& worker) const
{
    worker.found.clear();
    worker.lists.clear();
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        narrow::check_pair(side_a, side_b, pairs[i], first + i);
        worker.slot[i].count = 0;
        const Shape<Dim>&a = side_a.shapes[pairs[i].a], &b = side_b.shapes[pairs[i].b];
        narrow::Group group = narrow::group_of(a, b);
        if (own != 0 && has_own(a.type(), b.type())) group = narrow::Group::other;
        worker.lists.add(group, static_cast<std::uint16_t>(i));
    }
    if constexpr (Dim == 3) {
        narrow::Batch<T> batch{side_a.shapes, side_a.poses, side_b.shapes, side_b.poses, pairs,
                               worker.lists,  worker.slot,  worker.found,  margin};
        batch.run(*kernels);
    }
}

template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>&
ContactFinder<Dim, T>::Implementation::find(const Sides& side_a, const Sides& side_b,
                                            std::span<const std::span<const Pair>> blocks, T margin)
{
    using Access = narrow::ShapeAccess;
    const InUse call(in_use, "ContactFinder");
    result.clear();
    narrow::check_length("margin", margin, true);
    narrow::check_sizes(side_a, side_b, "poses");

    pair_blocks.clear();
    std::uint64_t before = 0;
    for (std::size_t b = 0; b < blocks.size(); before += blocks[b++].size())
        for (std::size_t first = 0; first < blocks[b].size(); first += narrow::block_pairs)
            pair_blocks.push_back({b, first, before + first});
    auto& chunks = Access::chunks(result);
    if (chunks.size() < pair_blocks.size()) chunks.resize(pair_blocks.size());
    Access::blocks(result).reserve(pair_blocks.size());
    const ProcessOptions one_by_one{&executor(), 1};
    ready_workers(plan_work(pair_blocks.size(), one_by_one).slots);

    const auto find_in_block = [&](std::uint64_t k, std::uint64_t, Work work) {
        const std::span<const Pair> all = blocks[pair_blocks[k].block];
        const std::span<const Pair> pairs = all.subspan(
            pair_blocks[k].first, std::min(narrow::block_pairs, all.size() - pair_blocks[k].first));
        Worker& worker = workers[work.slot];
        auto& chunk = chunks[k];
        chunk.size = 0;
        run_groups(side_a, side_b, pairs, pair_blocks[k].number, double{margin}, worker);
        for (const std::uint16_t i : worker.lists.of(narrow::Group::other)) {
            const Arranged arranged = find_one(side_a, side_b, pairs[i], double{margin}, worker.one);
            worker.slot[i] = {static_cast<std::uint32_t>(worker.found.size()),
                              static_cast<std::uint32_t>(worker.one.size()), arranged.swapped,
                              arranged.placed.d};
            worker.found.insert(worker.found.end(), worker.one.begin(), worker.one.end());
        }
        Access::grow(result, chunk, worker.found.size());
        std::uint16_t touching[narrow::block_pairs];
        std::size_t touching_count = 0;
        for (std::size_t i = 0; i < pairs.size(); ++i) { // without branches, which would be hard to predict
            touching[touching_count] = static_cast<std::uint16_t>(i);
            touching_count += worker.slot[i].count != 0 ? 1 : 0;
        }
        for (const std::uint16_t i : std::span(touching).first(touching_count)) {
            const narrow::Slot<Dim>& slot = worker.slot[i];
            for (std::uint32_t f = slot.first; f < slot.first + slot.count; ++f) {
                Contact<Dim, T>& contact = *::new (chunk.contacts + chunk.size++) Contact<Dim, T>;
                contact.pair = pairs[i];
                narrow::finish(worker.found[f], slot.d, slot.swapped, contact);
            }
        }
    };
    process_items(pair_blocks.size(), find_in_block, one_by_one);
    for (std::size_t k = 0; k < pair_blocks.size(); ++k)
        if (chunks[k].size != 0) {
            Access::blocks(result).push_back({chunks[k].contacts, chunks[k].size});
            Access::size_of(result) += chunks[k].size;
        }
    return result;
}

template <int Dim, Coordinate T>
ContactFinder<Dim, T>::ContactFinder(const ContactOptions& options)
    : implementation_(std::make_unique<Implementation>(options))
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
        if (type > ShapeTypes::compound && type < ShapeTypes::first_custom)
            throw Error(ErrorCode::invalid_argument,
                        "a pair test for shapes of type " + std::to_string(type) +
                            ", which there are none of; give one of ShapeTypes, or a custom one from " +
                            std::to_string(ShapeTypes::first_custom));
    const InUse call(implementation_->in_use, "ContactFinder");
    implementation_->tests.push_back(test);
    const unsigned a = test.type_a, b = test.type_b;
    if (a < 8 && b < 8)
        implementation_->own |= std::uint64_t{1} << (8 * a + b) | std::uint64_t{1} << (8 * b + a);
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::take(ContactBuffer<Dim, T>& buffer)
{
    const InUse call(implementation_->in_use, "ContactFinder");
    std::swap(implementation_->result, buffer);
    implementation_->result.clear();
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::touching(const Sides& side_a, const Sides& side_b, PairView pairs,
                                                     std::span<std::uint8_t> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(side_a, side_b, "poses");
    narrow::check_out(pairs.size(), out.size());
    const ProcessOptions in_blocks{&executor(), narrow::block_pairs};
    ready_workers(plan_work(pairs.size(), in_blocks).slots);
    const auto test_some = [&](const PairBatch& some) {
        Worker& worker = workers[some.work.slot];
        const std::span<std::uint8_t> touch = out.subspan(some.first, some.items.size());
        run_groups(side_a, side_b, some.items, some.first, 0, worker);
        for (std::size_t i = 0; i < touch.size(); ++i)
            touch[i] = worker.slot[i].count != 0 ? 1 : 0;
        for (const std::uint16_t i : worker.lists.of(narrow::Group::other)) {
            const Pair& pair = some.items[i];
            const Shape<Dim>&a = side_a.shapes[pair.a], &b = side_b.shapes[pair.b];
            bool turned;
            if (tests.empty() || own_test(a.type(), b.type(), turned) == nullptr) {
                narrow::Placed<Dim> placed = narrow::place(a, side_a.poses[pair.a], b, side_b.poses[pair.b]);
                placed.kernels = kernels;
                narrow::arrange(placed);
                touch[i] = narrow::find_touch(placed) ? 1 : 0;
            } else {
                find_one(side_a, side_b, pair, 0, worker.one);
                for (const narrow::Found<Dim>& one : worker.one)
                    for (std::uint32_t p = 0; p < one.manifold.count; ++p)
                        if (one.manifold.point[p].depth >= 0) touch[i] = 1;
            }
        }
    };
    process_pairs(pairs, test_some, in_blocks);
}

/// out[i] = answer(a, its pose or motion, b, its), in blocks of that many pairs.
template <int Dim, Coordinate T>
template <class Where, class Out, class Answer>
void ContactFinder<Dim, T>::Implementation::ask(const narrow::Side<Dim, Where>& side_a,
                                                const narrow::Side<Dim, Where>& side_b, PairView pairs,
                                                std::span<Out> out, std::uint64_t block, const Answer& answer)
{
    narrow::check_out(pairs.size(), out.size());
    const auto ask_some = [&](const PairBatch& some) {
        for (std::size_t i = 0; i < some.items.size(); ++i) {
            const Pair& pair = some.items[i];
            narrow::check_pair(side_a, side_b, pair, some.first + i);
            out[some.first + i] = answer(side_a.shapes[pair.a], side_a.poses[pair.a], side_b.shapes[pair.b],
                                         side_b.poses[pair.b]);
        }
    };
    process_pairs(pairs, ask_some, {&executor(), block});
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::distances(const Sides& side_a, const Sides& side_b,
                                                      PairView pairs, T max_distance,
                                                      std::span<Distance<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(side_a, side_b, "poses");
    narrow::check_max_distance(max_distance);
    ask(side_a, side_b, pairs, out, narrow::block_pairs,
        [&](const Shape<Dim>& a, const Pose<Dim, T>& pose_a, const Shape<Dim>& b,
            const Pose<Dim, T>& pose_b) {
            return narrow::distance_of(narrow::place(a, pose_a, b, pose_b), max_distance);
        });
}

template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::Implementation::impacts(const MovingSides& side_a, const MovingSides& side_b,
                                                    PairView pairs, T tolerance,
                                                    std::span<Impact<Dim, T>> out)
{
    const InUse call(in_use, "ContactFinder");
    narrow::check_sizes(side_a, side_b, "motions");
    narrow::check_length("tolerance", tolerance, false);
    constexpr std::uint64_t block = 32; // they differ in cost
    ask(side_a, side_b, pairs, out, block,
        [&](const Shape<Dim>& a, const Motion<Dim, T>& motion_a, const Shape<Dim>& b,
            const Motion<Dim, T>& motion_b) {
            return narrow::impact_of(a, motion_a, b, motion_b, tolerance);
        });
}

// With one set of objects, and with two.
template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Shapes& shapes, const Poses& poses,
                                                         PairView pairs, T margin)
{
    return find(shapes, poses, shapes, poses, pairs, margin);
}
template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Shapes& shapes_a, const Poses& poses_a,
                                                         const Shapes& shapes_b, const Poses& poses_b,
                                                         PairView pairs, T margin)
{
    return implementation_->find({shapes_a, poses_a}, {shapes_b, poses_b}, pairs.blocks(), margin);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::touching(const Shapes& shapes, const Poses& poses, PairView pairs,
                                     std::span<std::uint8_t> out)
{
    touching(shapes, poses, shapes, poses, pairs, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::touching(const Shapes& shapes_a, const Poses& poses_a, const Shapes& shapes_b,
                                     const Poses& poses_b, PairView pairs, std::span<std::uint8_t> out)
{
    implementation_->touching({shapes_a, poses_a}, {shapes_b, poses_b}, pairs, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::distances(const Shapes& shapes, const Poses& poses, PairView pairs,
                                      T max_distance, std::span<Distance<Dim, T>> out)
{
    distances(shapes, poses, shapes, poses, pairs, max_distance, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::distances(const Shapes& shapes_a, const Poses& poses_a, const Shapes& shapes_b,
                                      const Poses& poses_b, PairView pairs, T max_distance,
                                      std::span<Distance<Dim, T>> out)
{
    implementation_->distances({shapes_a, poses_a}, {shapes_b, poses_b}, pairs, max_distance, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::impacts(const Shapes& shapes, const Motions& motions, PairView pairs, T tolerance,
                                    std::span<Impact<Dim, T>> out)
{
    impacts(shapes, motions, shapes, motions, pairs, tolerance, out);
}
template <int Dim, Coordinate T>
void ContactFinder<Dim, T>::impacts(const Shapes& shapes_a, const Motions& motions_a, const Shapes& shapes_b,
                                    const Motions& motions_b, PairView pairs, T tolerance,
                                    std::span<Impact<Dim, T>> out)
{
    implementation_->impacts({shapes_a, motions_a}, {shapes_b, motions_b}, pairs, tolerance, out);
}

template class ContactFinder<2, float>;
template class ContactFinder<2, double>;
template class ContactFinder<3, float>;
template class ContactFinder<3, double>;

JOSTLE_NAMESPACE_END
