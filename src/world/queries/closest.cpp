// SPDX-License-Identifier: MIT
// The closest pairs of a world's objects, and of two worlds': the indexes of resting and of active objects
// are searched as if they were one.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <vector>

#include "base/instantiate.hpp"
#include "index/box_index_access.hpp"
#include "index/queries/check.hpp"
#include "index/queries/pair_answers.hpp"
#include "world/implementation.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace world {
namespace {

/// The index of resting objects. While apply() shows changes, some of its objects are elsewhere or gone for
/// queries. If they are few, they are skipped one by one; otherwise an index without them is made for the
/// query.
template <int Dim, class T>
class ShownResting
{
  public:
    explicit ShownResting(const State<Dim, T>& state) : state_(state), index_(&state.resting)
    {
        // If most of a tree is skipped, a search may visit all pairs before it finds one.
        constexpr std::size_t few = 8;
        if (state.shown == nullptr || few * state.shown->objects().size() <= state.resting.size()) return;
        std::vector<std::uint32_t> ids;
        std::vector<Aabb<Dim, T>> boxes;
        const std::uint32_t end = state.index_end();
        for (std::uint32_t i = 0; i < end; ++i)
            if (state.is_shown_resting(Index{i})) {
                ids.push_back(i);
                boxes.push_back(state.shown_box(Index{i}));
            }
        made_.emplace(IndexOptions{&serial_executor(), state.options.memory, state.options.instruction_set});
        BoxIndexAccess::rebuild(*made_, ids, boxes);
        index_ = &*made_;
    }
    ShownResting(const ShownResting&) = delete;
    ShownResting& operator=(const ShownResting&) = delete;
    [[nodiscard]] index::Child<Dim, T> root() const noexcept { return BoxIndexAccess::tree(*index_).root(); }
    /// Whether an object in the index counts.
    [[nodiscard]] bool has(std::uint32_t i) const noexcept
    {
        return state_.shown == nullptr || state_.is_shown_resting(Index{i});
    }

  private:
    const State<Dim, T>& state_;
    std::optional<BoxIndex<Dim, T>> made_;
    const BoxIndex<Dim, T>* index_;
};

/// The roots of the trees of a world's resting and active objects; either may be null.
template <int Dim, class T>
std::array<index::Child<Dim, T>, 2> roots_of(const typename World<Dim, T>::Implementation& world,
                                             const ShownResting<Dim, T>& resting)
{
    std::array<index::Child<Dim, T>, 2> roots{resting.root()};
    if (const BoxIndex<Dim, T>* const active = active_of(world.active_index, world.state))
        roots[1] = BoxIndexAccess::tree(*active).root();
    return roots;
}

template <int Dim, class T>
bool visit_closest(const typename World<Dim, T>::Implementation& one,
                   const typename World<Dim, T>::Implementation& other,
                   typename World<Dim, T>::ClosestVisitor visitor, T max_distance)
{
    index::check_max_distance(max_distance);
    const Users::Answering answering(&one.users), other_answering(&other.users);
    const bool is_same = &one == &other;
    const ShownResting<Dim, T> our_resting(one.state), their_resting(other.state);
    const auto ours = roots_of<Dim, T>(one, our_resting);
    const auto theirs = is_same ? ours : roots_of<Dim, T>(other, their_resting);
    const State<Dim, T>& state = one.state;
    const auto agree = [&](std::uint32_t a, std::uint32_t b) {
        return passes(state.objects[Index{a}].filter(), state.objects[Index{b}].filter()) &&
               !is_shown_refused(state, pair_of(Index{a}, Index{b}));
    };
    const auto both_rest = [&](std::uint32_t a, std::uint32_t b) {
        return our_resting.has(a) && their_resting.has(b) && (!is_same || agree(a, b));
    };
    const auto ours_rests = [&](std::uint32_t a, std::uint32_t b) {
        return our_resting.has(a) && (!is_same || agree(a, b));
    };
    const auto theirs_rests = [&](std::uint32_t, std::uint32_t b) { return their_resting.has(b); };
    const index::Roots<Dim, T> within[] = {{ours[0], ours[0], true, both_rest},
                                           {ours[0], ours[1], true, ours_rests},
                                           {ours[1], ours[1], true, agree}};
    const index::Roots<Dim, T> between[] = {{ours[0], theirs[0], false, both_rest},
                                            {ours[0], theirs[1], false, ours_rests},
                                            {ours[1], theirs[0], false, theirs_rests},
                                            {ours[1], theirs[1], false, {}}};
    const auto visit = [&](const PairHit<T>& hit, T& bound) {
        return visitor({state.id_of(Index{hit.a}), other.state.id_of(Index{hit.b}), hit.at}, bound);
    };
    return index::visit_closest<Dim, T>(index::kernels_for<Dim, T>(state.options.instruction_set),
                                        is_same ? std::span<const index::Roots<Dim, T>>(within)
                                                : std::span<const index::Roots<Dim, T>>(between),
                                        max_distance * max_distance, visit,
                                        BoxIndexAccess::tree(state.resting).closest_work());
}

} // namespace
} // namespace world

template <int Dim, Coordinate T>
bool World<Dim, T>::Implementation::closest_pairs(const Implementation& other, ClosestVisitor visitor,
                                                  T max_distance) const
{
    return world::visit_closest<Dim, T>(*this, other, visitor, max_distance);
}

#define JOSTLE_INSTANTIATE(Dim, T)                                                                           \
    template bool World<Dim, T>::Implementation::closest_pairs(const Implementation&, World::ClosestVisitor, \
                                                               T) const;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
