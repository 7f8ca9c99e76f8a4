// SPDX-License-Identifier: MIT
#include "index/queries/join.hpp"

#include <algorithm>
#include <bit>
#include <memory>

#include "base/radix.hpp"
#include "index/queries/answers.hpp"
#include "jostle/process.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace index {
namespace {

constexpr std::uint32_t positions_per_claim = 4096;
// For fewer boxes than this per thread, waking a thread doesn't pay.
constexpr std::uint32_t boxes_per_thread = 128;

// Boxes that touch this many each are searched one by one: then searching together saves nothing, and the
// results needn't be separated by box. The answer is the same.
constexpr std::size_t many_touched = 40;

/// Ids to be appended to a buffer.
struct IntoBuffer : Found<std::uint32_t>
{
    Buffer<std::uint32_t>& to;
    std::size_t& size;
    IntoBuffer(Buffer<std::uint32_t>& buffer, std::size_t& used) : to(buffer), size(used) { full = flush; }
    static void flush(Found<std::uint32_t>& self)
    {
        auto& own = static_cast<IntoBuffer&>(self);
        const auto count = static_cast<std::size_t>(own.next - own.items);
        if (own.size + count > own.to.capacity()) own.to.grow(2 * (own.size + count), own.size);
        std::copy_n(own.items, count, own.to.data() + own.size);
        own.size += count;
        own.next = own.items;
    }
};

Executor& executor_for(Executor& executor, std::size_t boxes)
{
    return boxes < 2 * boxes_per_thread ? serial_executor() : executor;
}

} // namespace

template <int Dim, class T>
struct Join<Dim, T>::Slot
{
    explicit Slot(std::pmr::memory_resource* memory) : work(memory), ids(memory), seen(memory) {}
    JoinWork<Dim, T> work;
    Buffer<std::uint32_t> ids; // of all askers so far
    Buffer<Seen<Dim, T>> seen; // or these
    std::size_t found = 0;
    bool one_by_one = false; // because the last boxes touched many
};

template <int Dim, class T>
Join<Dim, T>::Join(const IndexOptions& options)
    : kernels_(kernels_for<Dim, T>(options.instruction_set)),
      memory_(options.memory),
      keys_(memory_),
      keys_to_(memory_),
      lists_(memory_),
      first_(memory_)
{
}

template <int Dim, class T>
Join<Dim, T>::~Join() = default;

template <int Dim, class T>
const std::uint64_t* Join<Dim, T>::order(const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes)
{
    const auto count = static_cast<std::uint32_t>(boxes.size());
    std::uint64_t* keys = keys_.reserve(count);
    if (count <= lanes) {
        for (std::uint32_t i = 0; i < count; ++i)
            keys[i] = i;
        return keys;
    }
    // Places on a grid over most of the world with about eight cells a box, along the Z curve.
    const int digits = std::min(10, (static_cast<int>(std::bit_width(count)) + 3) / Dim + 1);
    const Frame<Dim>& frame = tree.frame();
    const double cells = static_cast<double>(1u << digits);
    double factor[Dim], offset[Dim];
    for (int d = 0; d < Dim; ++d) {
        factor[d] = frame.scale / Frame<Dim>::world_quanta * cells / 1.25; // with a margin
        offset[d] = 0.5 * cells - (frame.origin[d] + Frame<Dim>::world_quanta / frame.scale) * factor[d];
        factor[d] *= 0.5; // of lo + hi
    }
    const double last = cells - 1;
    for (std::uint32_t i = 0; i < count; ++i) {
        std::uint64_t place = 0;
        for (int d = 0; d < Dim; ++d) {
            const double at =
                (static_cast<double>(boxes.lo(d, i)) + static_cast<double>(boxes.hi(d, i))) * factor[d] +
                offset[d];
            const auto cell = static_cast<std::uint32_t>(at > 0 ? (at < last ? at : last) : 0);
            place |= spread<Dim>(cell) << d;
        }
        keys[i] = (place << 32) | i;
    }
    if (count < 256) {
        std::sort(keys, keys + count);
        return keys;
    }
    const std::uint64_t places = ((std::uint64_t{1} << digits * Dim) - 1) << 32;
    return radix_sort<11>(
        keys, keys_to_.reserve(count), count, [](std::uint64_t key) { return key; }, places);
}

template <int Dim, class T>
void Join<Dim, T>::ask(std::uint32_t number, const Tree<Dim, T>& tree, const BoxView<Dim, T>& boxes,
                       bool with_boxes, const std::uint64_t* order, std::uint32_t begin, std::uint32_t end)
{
    Slot& slot = *slots_[number];
    JoinWork<Dim, T>& work = slot.work;
    constexpr std::uint32_t most = JoinWork<Dim, T>::most_askers;
    Aabb<Dim, T> askers[most];
    const std::uint32_t count = end - begin;
    for (std::uint32_t a = 0; a < count; ++a) {
        const auto position = static_cast<std::uint32_t>(order[begin + a]);
        askers[a] = boxes[position];
    }
    if (slot.one_by_one && !with_boxes) {
        const std::size_t before = slot.found;
        for (std::uint32_t a = 0; a < count; ++a) {
            const std::size_t first = slot.found;
            IntoBuffer found(slot.ids, slot.found);
            kernels_.box(tree.root(), askers[a], {}, found);
            found.flush(found);
            const std::size_t size = slot.found - first;
            lists_[static_cast<std::uint32_t>(order[begin + a])] = {first, number,
                                                                    static_cast<std::uint32_t>(size)};
            if (size == 0) continue;
            if (slot.found + size > slot.ids.capacity()) slot.ids.grow(2 * (slot.found + size), slot.found);
            sort_ids(kernels_, slot.ids.data() + first, size, tree.id_end(), slot.ids.data() + slot.found);
        }
        slot.one_by_one = slot.found - before > count * many_touched / 2;
        return;
    }
    const auto keep = [&](auto& kept, auto& fresh) {
        std::copy_n(fresh.data(), work.touched,
                    kept.grow(slot.found + work.touched, slot.found) + slot.found);
    };
    if (with_boxes) {
        kernels_.around(tree.root(), askers, count, work);
        keep(slot.seen, work.seen);
    } else {
        kernels_.join(tree.root(), askers, count, work);
        keep(slot.ids, work.ids);
        slot.one_by_one = work.touched > count * many_touched;
    }
    for (std::uint32_t a = 0; a < count; ++a) {
        lists_[static_cast<std::uint32_t>(order[begin + a])] = {slot.found, number, work.count[a]};
        slot.found += work.count[a];
    }
}

template <int Dim, class T>
void Join<Dim, T>::ask_all(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes,
                           bool with_boxes)
{
    const auto count = static_cast<std::uint32_t>(boxes.size());
    const ProcessOptions asking{&executor, JoinWork<Dim, T>::most_askers};
    const std::uint32_t slots = plan_work(count, asking).slots;
    while (slots_.size() < slots)
        slots_.push_back(std::make_unique<Slot>(memory_));
    for (const auto& slot : slots_) {
        slot->found = 0;
        slot->one_by_one = false;
    }
    const std::uint64_t* const ordered = order(tree, boxes);
    lists_.reserve(count);
    process_items(
        count,
        [&](std::uint64_t begin, std::uint64_t end, Work work) {
            ask(work.slot, tree, boxes, with_boxes, ordered, static_cast<std::uint32_t>(begin),
                static_cast<std::uint32_t>(end));
        },
        asking);
}

template <int Dim, class T>
void Join<Dim, T>::look_around(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes)
{
    if (tree.size() != 0) {
        ask_all(tree, executor_for(executor, boxes.size()), boxes, true);
        return;
    }
    List* const lists = lists_.reserve(boxes.size());
    std::fill_n(lists, boxes.size(), List{0, 0, 0});
}

template <int Dim, class T>
std::span<const Seen<Dim, T>> Join<Dim, T>::around(std::size_t position) const noexcept
{
    const List& list = lists_.data()[position];
    if (list.count == 0) return {};
    return {slots_[list.slot]->seen.data() + list.begin, list.count};
}

template <int Dim, class T>
void Join<Dim, T>::run(const Tree<Dim, T>& tree, Executor& executor, const BoxView<Dim, T>& boxes,
                       FunctionRef<Pair*(std::size_t pairs)> make_room)
{
    const auto count = static_cast<std::uint32_t>(boxes.size());
    if (count == 0 || tree.size() == 0) {
        make_room(0);
        return;
    }
    Executor& used = executor_for(executor, count);
    ask_all(tree, used, boxes, false);
    const List* const lists = lists_.data();
    const std::uint32_t runs = (count + positions_per_claim - 1) / positions_per_claim;
    std::uint64_t* const first = first_.reserve(runs);
    std::uint64_t total = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        if (i % positions_per_claim == 0) first[i / positions_per_claim] = total;
        total += lists[i].count;
    }
    Pair* const out = make_room(static_cast<std::size_t>(total));
    process_items(count,
                  [&](std::uint64_t begin, std::uint64_t end, Work work) {
                      Pair* to = out + first[work.block];
                      for (auto i = static_cast<std::uint32_t>(begin); i < end; ++i) {
                          const List& list = lists[i];
                          const std::uint32_t* const ids = slots_[list.slot]->ids.data() + list.begin;
                          for (std::uint32_t k = 0; k < list.count; ++k)
                              *to++ = {i, ids[k]};
                      }
                  },
                  {&used, positions_per_claim});
}

template <int Dim, class T>
void Join<Dim, T>::release_memory() noexcept
{
    slots_.clear();
    keys_.release();
    keys_to_.release();
    lists_.release();
    first_.release();
}

template <int Dim, class T>
std::uint64_t Join<Dim, T>::bytes() const noexcept
{
    std::uint64_t sum = keys_.bytes() + keys_to_.bytes() + lists_.bytes() + first_.bytes();
    for (const auto& slot : slots_)
        sum += slot->work.bytes() + slot->ids.bytes() + slot->seen.bytes();
    return sum;
}

template class Join<2, float>;
template class Join<2, double>;
template class Join<3, float>;
template class Join<3, double>;

} // namespace index
JOSTLE_NAMESPACE_END
