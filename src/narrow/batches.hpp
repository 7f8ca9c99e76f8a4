// SPDX-License-Identifier: MIT
// A block of pairs, grouped by what tests them. Groups with a kernel go through it `batch` pairs at a time.
#pragma once

#include <span>

#include "narrow/pair.hpp"
#include "narrow/simple3.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// One piece of work: results and lists of a block stay in the second-level cache.
inline constexpr std::size_t block_pairs = 512;

enum class Group
{
    spheres,
    boxes,
    capsule_box, ///< sphere with box as well
    other
};
inline constexpr std::size_t groups = 4;

/// Of the two types of a pair, in any order. There are no kernels for the plane.
template <int Dim>
Group group_of(ShapeType a, ShapeType b)
{
    constexpr Group group[3][3] = {{Group::spheres, Group::other, Group::capsule_box},
                                   {Group::other, Group::other, Group::capsule_box},
                                   {Group::capsule_box, Group::capsule_box, Group::boxes}};
    return Dim == 3 && a <= ShapeTypes::box && b <= ShapeTypes::box ? group[a][b] : Group::other;
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

/// Where a pair's contacts are, and which way round it was computed.
template <int Dim>
struct PairContacts
{
    std::uint32_t first = 0, count = 0;
    bool swapped = false;
    V<Dim> d;
};

template <class T>
struct Batch
{
    StridedView<Shape<3>> shapes_a;
    StridedView<Pose<3, T>> poses_a;
    StridedView<Shape<3>> shapes_b;
    StridedView<Pose<3, T>> poses_b;
    std::span<const Pair> pairs;
    PairLists& lists;          ///< what turns out to need the general way moves to Group::other
    PairContacts<3>* contacts; ///< of each pair, without contacts so far
    FoundList<3>& found;
    double margin;

    void run(const Kernels& kernels);

  private:
    struct Arranged
    {
        const Shape<3>*a, *b;
        const Pose<3, T>*pose_a, *pose_b;
        Vec3 d;
        bool swapped;
    };
    [[nodiscard]] Arranged take(std::uint16_t i) const;
    void keep(std::uint16_t i, const Arranged& pair, Verdict verdict);
    void run_spheres();
    template <class Rows, class Put, class Answer>
    void run_kernel(Group group, void (*kernel)(Rows&), const Put& put_rest, const Answer& answer);
};
extern template struct Batch<float>;
extern template struct Batch<double>;

} // namespace narrow
JOSTLE_NAMESPACE_END
