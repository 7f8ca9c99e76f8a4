// SPDX-License-Identifier: MIT
// A block of pairs, grouped by their tests. Groups with a kernel go through it `batch` pairs at a time.
#pragma once

#include <span>

#include "narrow/convex/simple3.hpp"
#include "narrow/interface/input_checks.hpp"
#include "narrow/parts/pair.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// One piece of work: results and lists of a block stay in the second-level cache.
inline constexpr std::size_t block_pairs = 512;

enum class Group
{
    spheres,
    rounds, ///< capsules, and spheres with capsules
    boxes,
    capsule_box, ///< sphere with box as well
    other
};
inline constexpr std::size_t groups = 5;

/// The group for the two types of a pair, in any order. 2D has no kernels, but a group of circles.
template <int Dim>
Group group_of(ShapeType a, ShapeType b)
{
    constexpr Group group[3][3] = {{Group::spheres, Group::rounds, Group::capsule_box},
                                   {Group::rounds, Group::rounds, Group::capsule_box},
                                   {Group::capsule_box, Group::capsule_box, Group::boxes}};
    if (!is_simple(a) || !is_simple(b)) return Group::other;
    return Dim == 3 || group[a][b] == Group::spheres ? group[a][b] : Group::other;
}

/// The pairs of each group, by position in the block.
class PairLists
{
  public:
    void clear()
    {
        for (std::uint32_t& size : size_)
            size = 0;
    }
    void add(Group group, std::uint16_t pair)
    {
        const auto g = static_cast<std::size_t>(group);
        pair_[g][size_[g]++] = pair;
    }
    [[nodiscard]] std::span<const std::uint16_t> of(Group group) const
    {
        const auto g = static_cast<std::size_t>(group);
        return {pair_[g], size_[g]};
    }

  private:
    std::uint32_t size_[groups] = {};
    std::uint16_t pair_[groups][block_pairs];
};

/// The place of a pair's contacts, and whether the pair was swapped.
template <int Dim>
struct PairContacts
{
    std::uint32_t first = 0, count = 0;
    bool swapped = false;
    V<Dim> d;
};

/// A pair in the order in which it is computed.
template <class T>
struct ArrangedPair
{
    const Shape<3>*a, *b;
    const Pose<3, T>*pose_a, *pose_b;
    Vec3 d;
    bool swapped;
};
/// A block of pairs, and the objects that they name.
template <class T>
struct PairSet
{
    Objects<3, T> a, b;
    std::span<const Pair> pairs;

    /// Reads a pair and arranges it as `arrange` would, except for two shapes of one type in one place. The
    /// order in which it comes is hard to predict, so there are no branches.
    [[nodiscard]] ArrangedPair<T> take(std::uint16_t i) const
    {
        const Pair& pair = pairs[i];
        const Shape<3>* const shape[2] = {&a.shapes[pair.a], &b.shapes[pair.b]};
        const Pose<3, T>* const pose[2] = {&a.poses[pair.a], &b.poses[pair.b]};
        const Vec3 d = load(pose[1]->position) - load(pose[0]->position);
        const int type_a = shape[0]->type(), type_b = shape[1]->type();
        const double decides = d.x != 0 ? d.x : d.y != 0 ? d.y : d.z;
        const bool swapped = ((type_a == type_b) & (decides < 0)) | (type_a > type_b);
        const std::size_t first = swapped ? 1 : 0;
        return {
            shape[first], shape[1 - first], pose[first], pose[1 - first], d * (swapped ? -1.0 : 1.0) + Vec3{},
            swapped}; // never -0, as in from_to()
    }
};

/// Contacts of a block of pairs.
template <class T>
struct Batch
{
    PairSet<T> set;
    PairLists& lists;          ///< pairs that turn out to need the general way move to Group::other
    PairContacts<3>* contacts; ///< of each pair, empty so far
    FoundList<3>& found;
    double margin;

    void run(const Kernels& kernels);

  private:
    void keep(std::uint16_t i, const ArrangedPair<T>& pair, Verdict verdict);
    void run_spheres();
    template <class Rows, class Put, class Answer>
    void run_kernel(Group group, void (*kernel)(Rows&), const Put& put_rest, const Answer& answer);
};
extern template struct Batch<float>;
extern template struct Batch<double>;

/// Distances of a block of pairs; infinite if they are more than `enough`.
template <class T>
struct Distances
{
    Objects<3, T> a, b;
    std::span<const Pair> pairs;
    std::uint64_t first; ///< the first pair's number, for messages
    T enough;
    std::span<Distance<3, T>> out; ///< one per pair

    /// Checks the pairs as well, mostly within the kernels.
    void run(const Kernels& kernels) const;

  private:
    void run_kernel(std::span<const std::uint16_t> list, void (*kernel)(DistanceBatch&),
                    const Kernels& kernels) const;
    void put_pair(const Pair& pair, DistanceBatch& rows, std::uint32_t k) const;
    void answer_generally(std::uint16_t i, const Kernels& kernels) const;
    void check() const; ///< all pairs: throws for the first bad one
};
extern template struct Distances<float>;
extern template struct Distances<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
