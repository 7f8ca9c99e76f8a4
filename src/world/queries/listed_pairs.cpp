// SPDX-License-Identifier: MIT
// Lists of pairs that are made on demand.
#include <memory_resource>
#include <vector>

#include "base/block_buffer_access.hpp"
#include "base/instantiate.hpp"
#include "pairs/pair_finder_access.hpp"
#include "pairs/sort_pairs.hpp"
#include "world/implementation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {

const PairBuffer& ListedPairs::of(const std::pmr::vector<ObjectPair>& began, const PairBuffer* persisted)
{
    made_.ensure([&] {
        const std::size_t count = began.size() + (persisted == nullptr ? 0 : persisted->size());
        const bool fits = count * sizeof(Pair) <= list_.bytes_reserved();
        list_.clear();
        if (count == 0) return;
        PairBufferAccess access(list_);
        Pair* const first = access.chunk(0, fits ? count : count + count / 4).data();
        Pair* to = first;
        auto next = began.begin();
        const auto take_began = [&] {
            *to++ = {next->a.index, next->b.index};
            ++next;
        };
        if (persisted != nullptr)
            for (const Pair& pair : *persisted) {
                while (next != began.end() && Pair{next->a.index, next->b.index} < pair)
                    take_began();
                *to++ = pair;
            }
        while (next != began.end())
            take_began();
        access.append({first, count});
    });
    return list_;
}

namespace {

/// Objects to be searched together.
template <int Dim, class T>
struct Searched
{
    explicit Searched(std::pmr::memory_resource* memory) : boxes(memory), indices(memory) {}
    [[nodiscard]] BoxView<Dim, T> view() const { return boxes; }
    std::pmr::vector<Aabb<Dim, T>> boxes;
    std::pmr::vector<Index> indices;
};

} // namespace
} // namespace world

template <int Dim, Coordinate T>
PairBuffer World<Dim, T>::pairs() const
{
    const world::State<Dim, T>& state = implementation_->state;
    std::pmr::memory_resource* const memory = state.options.memory;
    // Static objects, of which there may be many, never pair with each other.
    world::Searched<Dim, T> moving(memory), fixed(memory);
    const std::uint32_t end = state.index_end();
    for (std::uint32_t i = 0; i < end; ++i)
        if (const world::Index index{i}; state.is_shown(index)) {
            auto& searched = state.objects[index].has(world::flag::is_static) ? fixed : moving;
            searched.boxes.push_back(state.shown_box(index));
            searched.indices.push_back(index);
        }
    const auto select_with = [&](const world::Searched<Dim, T>& others) {
        return [&](Pair* first, Pair* last) {
            Pair* kept = first;
            for (Pair* pair = first; pair != last; ++pair) {
                const world::Index a = moving.indices[pair->a], b = others.indices[pair->b];
                const Pair ids = world::pair_of(a, b);
                if (!world::passes(state.objects[a].filter(), state.objects[b].filter())) continue;
                if (world::is_shown_refused(state, ids)) continue;
                *kept++ = ids;
            }
            return kept;
        };
    };
    PairFinder finder({state.options.executor, memory, state.options.instruction_set});
    PairBuffer found[2] = {PairBuffer(memory), PairBuffer(memory)}, all(memory), sorted(memory);
    const auto among_moving = select_with(moving), with_fixed = select_with(fixed);
    PairFinderAccess::find(finder, moving.view(), among_moving, found[0]);
    PairFinderAccess::find(finder, moving.view(), fixed.view(), with_fixed, found[1]);
    for (const PairBuffer& part : found)
        for (const std::span<const Pair> block : part.blocks())
            PairBufferAccess(all).append(block);
    PairSorter(memory).sort(all, end, *state.executor, state.options.instruction_set, sorted);
    return sorted;
}

#define JOSTLE_INSTANTIATE(Dim, T) template JOSTLE_API PairBuffer World<Dim, T>::pairs() const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
