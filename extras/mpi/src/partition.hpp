// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <memory_resource>
#include <vector>

#include "jostle/mpi.hpp"

struct Zoltan_Struct;

JOSTLE_NAMESPACE_BEGIN
namespace mpi {

/// Ascending.
using Ranks = std::pmr::vector<int>;

/// Where objects are, and how much work each is.
struct WeightedPoints
{
    explicit WeightedPoints(std::pmr::memory_resource* memory) : points(memory), weights(memory) {}
    std::pmr::vector<double> points; ///< all coordinates of one after another
    std::pmr::vector<float> weights;
};

/// Space divided into one region for each rank, by Zoltan's recursive coordinate bisection. Every rank has
/// all of the cuts, so that queries need no other rank, and the same query has the same answer on all.
///
/// Regions are closed boxes, unbounded at the outside. So two boxes that touch, and a region that both touch,
/// have a point in common; and what touches the box that two boxes share touches both.
class Partition
{
  public:
    /// Rank 0 has all of space.
    Partition() = default;
    /// Collective. Into as many regions as there are ranks, or `regions`, to see what so many ranks would do.
    Partition(MPI_Comm comm, int dimensions, const WeightedPoints& points, int regions = 0);
    Partition(Partition&& from) noexcept;
    Partition& operator=(Partition&& from) noexcept;
    ~Partition();

    [[nodiscard]] explicit operator bool() const noexcept { return zoltan_ != nullptr; }

    /// Refills `ranks` with those whose regions the box touches, ascending.
    template <int Dim, class T>
    void touched(const Aabb<Dim, T>& box, Ranks& ranks) const
    {
        const std::array<double, 6> bounds = widened(box);
        ranks.clear();
        if (is_interior(bounds))
            ranks.push_back(rank_);
        else
            ask(bounds, ranks);
    }
    /// Whether a box, and so all that lies in it, touches this rank's region alone. To be asked first: it
    /// costs little, and most boxes do.
    template <int Dim, class T>
    [[nodiscard]] bool is_inside(const Aabb<Dim, T>& box) const noexcept
    {
        return is_interior(widened(box));
    }
    /// The rank whose region has the middle of the box. A fixed one where several have.
    template <int Dim, class T>
    [[nodiscard]] int at_middle_of(const Aabb<Dim, T>& box) const
    {
        return at(middle(box));
    }
    /// Finite where the box has a finite bound on each axis; else somewhere in it.
    template <int Dim, class T>
    [[nodiscard]] static std::array<double, 3> middle(const Aabb<Dim, T>& box) noexcept
    {
        std::array<double, 3> point{};
        for (int d = 0; d < Dim; ++d) {
            const double lo = box.lo[d], hi = box.hi[d];
            point[static_cast<std::size_t>(d)] = lo == -infinity()  ? (hi == infinity() ? 0 : hi)
                                                 : hi == infinity() ? lo
                                                                    : lo / 2 + hi / 2;
        }
        return point;
    }

  private:
    [[nodiscard]] static double infinity() noexcept;
    template <int Dim, class T>
    [[nodiscard]] static std::array<double, 6> widened(const Aabb<Dim, T>& box) noexcept
    {
        std::array<double, 6> bounds{};
        for (std::size_t d = 0; d < Dim; ++d) {
            bounds[d] = box.lo[static_cast<int>(d)];
            bounds[3 + d] = box.hi[static_cast<int>(d)];
        }
        return bounds;
    }
    /// Whether it lies inside this rank's region and touches no other.
    [[nodiscard]] bool is_interior(const std::array<double, 6>& bounds) const noexcept
    {
        for (std::size_t d = 0; d < 3; ++d)
            if (!(bounds[d] > region_[d]) || !(bounds[3 + d] < region_[3 + d])) return false;
        return true;
    }
    void ask(const std::array<double, 6>& bounds, Ranks& ranks) const;
    [[nodiscard]] int at(std::array<double, 3> point) const;

    Zoltan_Struct* zoltan_ = nullptr;
    int rank_ = 0, ranks_ = 1;
    std::array<double, 6> region_{}; // this rank's; an axis that the scene lacks has room around 0
};

} // namespace mpi
JOSTLE_NAMESPACE_END
