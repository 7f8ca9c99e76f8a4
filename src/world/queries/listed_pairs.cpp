// SPDX-License-Identifier: MIT
// Lists of pairs that are made on demand.
#include <algorithm>
#include <memory_resource>
#include <vector>

#include "base/block_buffer_access.hpp"
#include "base/instantiate.hpp"
#include "pairs/pair_finder_access.hpp"
#include "world/implementation.hpp"
#include "world/update/sort_keys.hpp"

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

template <int Dim, class T>
PairBuffer all_pairs(const State<Dim, T>& state)
{
    std::pmr::memory_resource* const memory = state.options.memory;
    // Static objects, of which there may be many, never pair with each other.
    Searched<Dim, T> moving(memory), fixed(memory);
    const std::uint32_t end = state.index_end();
    for (std::uint32_t i = 0; i < end; ++i)
        if (state.is_shown(Index{i})) {
            Searched<Dim, T>& searched = state.objects[Index{i}].has(flag::is_static) ? fixed : moving;
            searched.boxes.push_back(state.shown_box(Index{i}));
            searched.indices.push_back(Index{i});
        }
    const auto select_with = [&](const Searched<Dim, T>& others) {
        return [&](Pair* first, Pair* last) {
            Pair* kept = first;
            for (Pair* pair = first; pair != last; ++pair) {
                const Index a = moving.indices[pair->a], b = others.indices[pair->b];
                const Pair ids = pair_of(a, b);
                if (!passes(state.objects[a].filter(), state.objects[b].filter())) continue;
                if (is_shown_refused(state, ids)) continue;
                *kept++ = ids;
            }
            return kept;
        };
    };
    PairFinder finder({state.options.executor, memory, state.options.instruction_set});
    PairBuffer found[2] = {PairBuffer(memory), PairBuffer(memory)};
    const auto among_moving = select_with(moving), with_fixed = select_with(fixed);
    PairFinderAccess::find(finder, moving.view(), among_moving, found[0]);
    PairFinderAccess::find(finder, moving.view(), fixed.view(), with_fixed, found[1]);

    std::pmr::vector<Pair> all(memory), scratch(memory);
    all.reserve(found[0].size() + found[1].size());
    for (const PairBuffer& part : found)
        for (const std::span<const Pair> block : part.blocks())
            all.insert(all.end(), block.begin(), block.end());
    sort_pairs(all, scratch);
    PairBuffer result(memory);
    if (all.empty()) return result;
    PairBufferAccess access(result);
    const std::span<Pair> memory_of_result = access.chunk(0, all.size()).first(all.size());
    std::copy(all.begin(), all.end(), memory_of_result.begin());
    access.append(memory_of_result);
    return result;
}

#define JOSTLE_INSTANTIATE(Dim, T) template PairBuffer all_pairs(const State<Dim, T>&);
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

} // namespace world
JOSTLE_NAMESPACE_END
