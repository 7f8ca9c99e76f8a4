// SPDX-License-Identifier: MIT
#include <limits>
#include <string>

#include "jostle/contact.hpp"
#include "narrow/pair.hpp"
#include "narrow/share_out.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace narrow {
namespace {

constexpr std::size_t block_pairs = 512;
constexpr std::size_t block_poses = 4096;

template <int Dim, class T>
bool valid(const Pose<Dim, T>& pose)
{
    // A sum of finite numbers halved often enough is finite; NaN and infinity stay.
    bool finite = true, turned = false;
    for (const T x : pose.position)
        finite = finite && std::abs(x) <= std::numeric_limits<T>::max();
    for (const T q : pose.rotation) {
        finite = finite && std::abs(q) <= std::numeric_limits<T>::max();
        turned = turned || q != 0;
    }
    return finite && turned;
}

template <int Dim, class T>
[[noreturn]] void refuse_pose(const Pose<Dim, T>& pose, std::uint64_t object)
{
    std::string numbers = "position";
    for (const T x : pose.position)
        numbers += " " + std::to_string(x);
    numbers += ", rotation";
    for (const T q : pose.rotation)
        numbers += " " + std::to_string(q);
    const std::string name =
        object == Error::no_index ? "a pose" : "the pose of object " + std::to_string(object);
    throw Error(ErrorCode::invalid_argument,
                name + " is no pose: " + numbers +
                    "; positions must be finite, rotations finite and not all zero",
                object);
}

template <int Dim, class T>
void check_poses(const StridedView<Pose<Dim, T>>& poses, Executor& executor)
{
    std::atomic<std::uint64_t> worst{Error::no_index};
    share_out(executor, (poses.size() + block_poses - 1) / block_poses,
              [&](std::uint32_t, std::uint64_t block) {
                  const std::size_t last = std::min(poses.size(), (block + 1) * block_poses);
                  for (std::size_t i = block * block_poses; i < last; ++i)
                      if (!valid(poses[i])) {
                          std::uint64_t before = worst.load();
                          while (i < before && !worst.compare_exchange_weak(before, i)) {
                          }
                          return;
                      }
              });
    if (worst != Error::no_index) refuse_pose(poses[worst], worst);
}

template <class T>
void check_length(const char* what, T value, bool zero_allowed)
{
    if (!(value >= 0) || (value == 0 && !zero_allowed) || value > std::numeric_limits<T>::max())
        throw Error(ErrorCode::invalid_argument, std::string("the ") + what + " is " + std::to_string(value) +
                                                     "; give a finite length " +
                                                     (zero_allowed ? "of 0 or more" : "above 0"));
}

template <int Dim, class T>
struct Side
{
    StridedView<Shape<Dim>> shapes;
    StridedView<Pose<Dim, T>> poses;
};

} // namespace
} // namespace narrow

template <int Dim, Coordinate T>
struct ContactFinder<Dim, T>::Implementation
{
    explicit Implementation(const ContactOptions& given) : options(given), result(given.memory) {}

    [[nodiscard]] Executor& executor() const
    {
        return options.executor != nullptr ? *options.executor : default_executor();
    }

    void check(const narrow::Side<Dim, T>& side) const
    {
        if (side.shapes.size() != side.poses.size())
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(side.shapes.size()) +
                                                      " shapes and " + std::to_string(side.poses.size()) +
                                                      " poses; give one of each per object");
        narrow::check_poses(side.poses, executor());
    }

    const ContactBuffer<Dim, T>& find(const narrow::Side<Dim, T>& side_a, const narrow::Side<Dim, T>& side_b,
                                      bool same, std::span<const std::span<const Pair>> blocks, T margin);

    struct Worker
    {
        explicit Worker(std::pmr::memory_resource* memory) : found(memory) {}
        narrow::FoundList<Dim> found;
    };

    ContactOptions options;
    std::vector<PairTest<Dim>> tests;
    std::vector<Worker> workers;
    ContactBuffer<Dim, T> result;
};

template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>&
ContactFinder<Dim, T>::Implementation::find(const narrow::Side<Dim, T>& side_a,
                                            const narrow::Side<Dim, T>& side_b, bool same,
                                            std::span<const std::span<const Pair>> blocks, T margin)
{
    using Access = narrow::ShapeAccess;
    result.clear();
    narrow::check_length("margin", margin, true);
    check(side_a);
    if (!same) check(side_b);

    // Blocks of work: runs of pairs of one given block.
    struct Work
    {
        std::size_t block, first;
    };
    std::pmr::vector<Work> works(options.memory);
    for (std::size_t b = 0; b < blocks.size(); ++b)
        for (std::size_t first = 0; first < blocks[b].size(); first += narrow::block_pairs)
            works.push_back({b, first});
    auto& chunks = Access::chunks(result);
    if (chunks.size() < works.size()) chunks.resize(works.size());
    Executor& executor = this->executor();
    const std::uint32_t worker_count = narrow::workers_for(executor, works.size());
    while (workers.size() < worker_count)
        workers.emplace_back(options.memory);

    try {
        narrow::share_out(executor, works.size(), [&](std::uint32_t w, std::uint64_t k) {
            const std::span<const Pair> all = blocks[works[k].block];
            const std::span<const Pair> pairs =
                all.subspan(works[k].first, std::min(narrow::block_pairs, all.size() - works[k].first));
            Worker& worker = workers[w];
            auto& chunk = chunks[k];
            chunk.size = 0;
            const double wide = double{margin};
            for (const Pair& pair : pairs) {
                if (pair.a >= side_a.shapes.size() || pair.b >= side_b.shapes.size())
                    throw Error(ErrorCode::invalid_argument,
                                "a pair names objects " + std::to_string(pair.a) + " and " +
                                    std::to_string(pair.b) + ", but there are " +
                                    std::to_string(side_a.shapes.size()) + " and " +
                                    std::to_string(side_b.shapes.size()),
                                pair.a >= side_a.shapes.size() ? pair.a : pair.b);
                narrow::Placed<Dim> placed = narrow::place(side_a.shapes[pair.a], side_a.poses[pair.a],
                                                           side_b.shapes[pair.b], side_b.poses[pair.b]);
                const bool swapped = narrow::arrange(placed);
                worker.found.clear();
                narrow::find_contacts(placed, wide, worker.found);
                if (chunk.size + worker.found.size() > chunk.capacity) {
                    const std::size_t capacity =
                        std::max<std::size_t>(64, (chunk.size + worker.found.size()) * 3 / 2);
                    auto* memory = static_cast<Contact<Dim, T>*>(options.memory->allocate(
                        capacity * sizeof(Contact<Dim, T>), alignof(Contact<Dim, T>)));
                    std::uninitialized_copy(chunk.contacts, chunk.contacts + chunk.size, memory);
                    if (chunk.capacity != 0)
                        options.memory->deallocate(chunk.contacts, chunk.capacity * sizeof(Contact<Dim, T>),
                                                   alignof(Contact<Dim, T>));
                    chunk.contacts = memory;
                    chunk.capacity = capacity;
                }
                for (const narrow::Found<Dim>& one : worker.found) {
                    Contact<Dim, T>& contact = *::new (chunk.contacts + chunk.size++) Contact<Dim, T>;
                    contact.pair = pair;
                    contact.part_a = swapped ? one.part_b : one.part_a;
                    contact.part_b = swapped ? one.part_a : one.part_b;
                    narrow::finish(one.manifold, placed.d, swapped, contact);
                }
            }
        });
        for (std::size_t k = 0; k < works.size(); ++k)
            if (chunks[k].size != 0) {
                Access::blocks(result).push_back({chunks[k].contacts, chunks[k].size});
                Access::size_of(result) += chunks[k].size;
            }
    } catch (...) {
        result.clear();
        throw;
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
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Shapes& shapes, const Poses& poses,
                                                         std::span<const Pair> pairs, T margin)
{
    return implementation_->find({shapes, poses}, {shapes, poses}, true, {&pairs, 1}, margin);
}
template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Shapes& shapes, const Poses& poses,
                                                         const PairBuffer& pairs, T margin)
{
    return implementation_->find({shapes, poses}, {shapes, poses}, true, pairs.blocks(), margin);
}
template <int Dim, Coordinate T>
const ContactBuffer<Dim, T>& ContactFinder<Dim, T>::find(const Shapes& shapes_a, const Poses& poses_a,
                                                         const Shapes& shapes_b, const Poses& poses_b,
                                                         const PairBuffer& pairs, T margin)
{
    return implementation_->find({shapes_a, poses_a}, {shapes_b, poses_b}, false, pairs.blocks(), margin);
}

template class ContactFinder<3, float>;
template class ContactFinder<3, double>;

JOSTLE_NAMESPACE_END
