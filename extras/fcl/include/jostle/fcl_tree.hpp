// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#if defined(__SSE2__) || defined(_M_X64)
#include <emmintrin.h>
#endif

#include "jostle/box.hpp"
#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace fcl {

/// The squared distance of two boxes; what FCL's AABB::distance says is its root.
template <class S>
S squared_gap(const Aabb<3, S>& a, const Aabb<3, S>& b) noexcept
{
    S sum = 0;
    for (int d = 0; d < 3; ++d) {
        const S below = a.lo[d] - b.hi[d], above = b.lo[d] - a.hi[d];
        const S apart = a.lo[d] > b.hi[d] ? below : b.lo[d] > a.hi[d] ? above : S(0);
        sum += apart * apart;
    }
    return sum;
}

/// Some numbers side by side: as many as any processor of this kind takes at once. Compilers don't make this
/// of loops, because comparisons may trap.
template <class S>
struct Lanes
{
    static constexpr std::size_t size = 1;
    static constexpr std::uint32_t bits = 2; ///< what a bit for each is less than
    S lanes;
    static Lanes all(S value) noexcept { return {value}; }
    static Lanes load(const S* from) noexcept { return {*from}; }
    void store(S* to) const noexcept { *to = lanes; }
    friend Lanes operator+(Lanes a, Lanes b) noexcept { return {a.lanes + b.lanes}; }
    friend Lanes operator-(Lanes a, Lanes b) noexcept { return {a.lanes - b.lanes}; }
    friend Lanes operator*(Lanes a, Lanes b) noexcept { return {a.lanes * b.lanes}; }
    friend Lanes min(Lanes a, Lanes b) noexcept { return {a.lanes < b.lanes ? a.lanes : b.lanes}; }
    friend Lanes max(Lanes a, Lanes b) noexcept { return {a.lanes > b.lanes ? a.lanes : b.lanes}; }
    friend std::uint32_t less(Lanes a, Lanes b) noexcept { return a.lanes < b.lanes ? 1 : 0; }
};
#if defined(__SSE2__) || defined(_M_X64)
template <>
struct Lanes<double>
{
    static constexpr std::size_t size = 2;
    static constexpr std::uint32_t bits = 4;
    __m128d lanes;
    static Lanes all(double value) noexcept { return {_mm_set1_pd(value)}; }
    static Lanes load(const double* from) noexcept { return {_mm_loadu_pd(from)}; }
    void store(double* to) const noexcept { _mm_storeu_pd(to, lanes); }
    friend Lanes operator+(Lanes a, Lanes b) noexcept { return {_mm_add_pd(a.lanes, b.lanes)}; }
    friend Lanes operator-(Lanes a, Lanes b) noexcept { return {_mm_sub_pd(a.lanes, b.lanes)}; }
    friend Lanes operator*(Lanes a, Lanes b) noexcept { return {_mm_mul_pd(a.lanes, b.lanes)}; }
    friend Lanes min(Lanes a, Lanes b) noexcept { return {_mm_min_pd(a.lanes, b.lanes)}; }
    friend Lanes max(Lanes a, Lanes b) noexcept { return {_mm_max_pd(a.lanes, b.lanes)}; }
    friend std::uint32_t less(Lanes a, Lanes b) noexcept
    {
        return static_cast<std::uint32_t>(_mm_movemask_pd(_mm_cmplt_pd(a.lanes, b.lanes)));
    }
};
template <>
struct Lanes<float>
{
    static constexpr std::size_t size = 4;
    static constexpr std::uint32_t bits = 16;
    __m128 lanes;
    static Lanes all(float value) noexcept { return {_mm_set1_ps(value)}; }
    static Lanes load(const float* from) noexcept { return {_mm_loadu_ps(from)}; }
    void store(float* to) const noexcept { _mm_storeu_ps(to, lanes); }
    friend Lanes operator+(Lanes a, Lanes b) noexcept { return {_mm_add_ps(a.lanes, b.lanes)}; }
    friend Lanes operator-(Lanes a, Lanes b) noexcept { return {_mm_sub_ps(a.lanes, b.lanes)}; }
    friend Lanes operator*(Lanes a, Lanes b) noexcept { return {_mm_mul_ps(a.lanes, b.lanes)}; }
    friend Lanes min(Lanes a, Lanes b) noexcept { return {_mm_min_ps(a.lanes, b.lanes)}; }
    friend Lanes max(Lanes a, Lanes b) noexcept { return {_mm_max_ps(a.lanes, b.lanes)}; }
    friend std::uint32_t less(Lanes a, Lanes b) noexcept
    {
        return static_cast<std::uint32_t>(_mm_movemask_ps(_mm_cmplt_ps(a.lanes, b.lanes)));
    }
};
#endif

/// The tree that a Manager asks about single objects: boxes in an order in which neighbours are near each
/// other, sixteen to a block, blocks sixteen to a block of bounds, up to one. When boxes move their order
/// stays and the bounds are worked out anew, which costs a few nanoseconds a box; the order is made anew when
/// the bounds have grown too much by that. See docs/decisions/054.
///
/// Boxes are known by their place among the manager's. Those that are upside down or have a NaN are never
/// found. Const members from any number of threads at a time while no other is called.
template <class S>
class MendedTree
{
  public:
    using Box = Aabb<3, S>;
    static constexpr std::uint32_t none = ~std::uint32_t{0};

    /// The box at a place, and the square of its distance from another.
    struct Near
    {
        S squared = std::numeric_limits<S>::infinity();
        std::uint32_t place = none;
    };

    void clear() noexcept
    {
        places_.clear();
        slots_.clear();
        levels_.clear();
        extent_when_sorted_ = 0;
        loose_ = 0;
    }

    /// How many boxes it knows.
    [[nodiscard]] std::size_t size() const noexcept { return slots_.size(); }

    /// Takes these boxes in an order made for them.
    void sort(const std::vector<Box>& boxes)
    {
        items_.resize(boxes.size());
        for (std::uint32_t place = 0; place < boxes.size(); ++place)
            items_[place] = item(boxes[place], place);
        split(0, items_.size());
        places_.resize(boxes.size());
        slots_.resize(boxes.size());
        for (std::uint32_t slot = 0; slot < boxes.size(); ++slot) {
            places_[slot] = items_[slot].place;
            slots_[places_[slot]] = slot;
        }
        loose_ = 0;
        for (auto& level : levels_)
            level.clear();
        mend(boxes);
        extent_when_sorted_ = extent();
    }

    /// Takes these boxes in the order that there is.
    void mend(const std::vector<Box>& boxes)
    {
        resize(boxes.size());
        for (std::size_t b = 0; b < levels_[0].size(); ++b) {
            Block& block = levels_[0][b];
            const std::size_t end = std::min(width, places_.size() - b * width);
            for (std::size_t lane = 0; lane < end; ++lane)
                if (const std::uint32_t place = places_[b * width + lane]; place != none)
                    block.set(lane, boxes[place]);
        }
        for (std::size_t above = 1; above < levels_.size(); ++above)
            for (std::size_t b = 0; b < levels_[above - 1].size(); ++b)
                levels_[above][b / width].set(b % width, levels_[above - 1][b].bounds());
    }

    /// The same where only the boxes at these places, which may be beyond the end, differ from before.
    void mend(const std::vector<Box>& boxes, const std::vector<std::uint32_t>& changed)
    {
        touched_.clear();
        resize(boxes.size());
        for (const std::uint32_t place : changed) {
            if (place >= boxes.size()) continue;
            const std::uint32_t slot = slots_[place];
            levels_[0][slot / width].set(slot % width, boxes[place]);
            touched_.push_back(static_cast<std::uint32_t>(slot / width));
        }
        for (std::size_t above = 1; above < levels_.size(); ++above) {
            std::sort(touched_.begin(), touched_.end());
            touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
            for (std::uint32_t& b : touched_) {
                levels_[above][b / width].set(b % width, levels_[above - 1][b].bounds());
                b /= width;
            }
        }
    }

    /// How much the order has suffered: about 1 when it is new, more as bounds grow.
    [[nodiscard]] S wear() const noexcept
    {
        const S loose = S(4) * static_cast<S>(loose_) / static_cast<S>(size() + 64);
        const S now = extent();
        return loose + (now > extent_when_sorted_ ? now / extent_when_sorted_ : S(1));
    }

    /// Calls `visit` with the place of each box that touches this one until it returns false; says whether it
    /// never did.
    template <class Visit>
    bool touching(const Box& box, const Visit& visit) const
    {
        return levels_.empty() || touching(levels_.size() - 1, 0, box, visit);
    }

    /// Of the boxes that `take(place, squared distance)` accepts the nearest one.
    template <class Take>
    [[nodiscard]] Near nearest(const Box& box, const Take& take) const
    {
        Near found;
        if (!levels_.empty()) nearest(levels_.size() - 1, 0, box, take, found);
        return found;
    }

    /// Calls `visit(place, squared distance)` for all boxes whose distance is less, in any order.
    template <class Visit>
    void nearer(const Box& box, S distance, const Visit& visit) const
    {
        if (levels_.empty()) return;
        S squared = distance * distance; // never too small, however it is rounded
        squared += squared * 8 * std::numeric_limits<S>::epsilon() + std::numeric_limits<S>::min();
        nearer(levels_.size() - 1, 0, box, squared, [&](std::uint32_t place, S gap) {
            if (std::sqrt(gap) < distance) visit(place, gap);
        });
    }

    /// Two that are near each other, if not as near as any: of neighbours in the order those whose distance
    /// is least. Both `none` where there are no two.
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> near_pair(const std::vector<Box>& boxes) const
    {
        std::pair<std::uint32_t, std::uint32_t> best{none, none};
        S least = std::numeric_limits<S>::infinity();
        std::uint32_t last = none;
        for (const std::uint32_t place : places_) {
            if (place == none) continue;
            if (last != none) {
                if (const S squared = squared_gap(boxes[last], boxes[place]); squared < least) {
                    least = squared;
                    best = {std::min(last, place), std::max(last, place)};
                    if (!(least > 0)) break;
                }
            }
            last = place;
        }
        return best;
    }

  private:
    static constexpr std::size_t width = 16;
    using Pack = Lanes<S>;
    using Gaps = std::array<S, width>; ///< squared

    static S least_of(Pack pack) noexcept
    {
        std::array<S, Pack::size> several;
        pack.store(several.data());
        return *std::min_element(several.begin(), several.end());
    }
    /// The lane with the least.
    static std::size_t nearest_of(const Gaps& gaps, S& gap) noexcept
    {
        Pack least = Pack::load(gaps.data());
        for (std::size_t lane = Pack::size; lane < width; lane += Pack::size)
            least = min(least, Pack::load(&gaps[lane]));
        gap = least_of(least);
        const Pack found = Pack::all(gap);
        std::uint32_t bits = 1U << (width - 1);
        for (std::size_t lane = 0; lane < width; lane += Pack::size)
            bits |= ~less(found, Pack::load(&gaps[lane])) % Pack::bits << lane;
        return static_cast<std::size_t>(std::countr_zero(bits));
    }

    /// Sixteen boxes. Those that aren't there are upside down: they touch nothing and are infinitely far.
    struct Block
    {
        S lo[3][width], hi[3][width];
        Block() noexcept
        {
            for (std::size_t lane = 0; lane < width; ++lane)
                set_nowhere(lane);
        }
        void set_nowhere(std::size_t lane) noexcept
        {
            for (int d = 0; d < 3; ++d) {
                lo[d][lane] = std::numeric_limits<S>::infinity();
                hi[d][lane] = -std::numeric_limits<S>::infinity();
            }
        }
        void set(std::size_t lane, const Box& box) noexcept
        {
            if (!(box.lo[0] <= box.hi[0] && box.lo[1] <= box.hi[1] && box.lo[2] <= box.hi[2]))
                return set_nowhere(lane);
            for (int d = 0; d < 3; ++d) {
                lo[d][lane] = box.lo[d];
                hi[d][lane] = box.hi[d];
            }
        }
        [[nodiscard]] Box bounds() const noexcept
        {
            Box box;
            for (int d = 0; d < 3; ++d) {
                Pack low = Pack::load(lo[d]), high = Pack::load(hi[d]);
                for (std::size_t lane = Pack::size; lane < width; lane += Pack::size) {
                    low = min(low, Pack::load(&lo[d][lane]));
                    high = max(high, Pack::load(&hi[d][lane]));
                }
                box.lo[d] = least_of(low);
                box.hi[d] = -least_of(Pack::all(0) - high);
            }
            return box;
        }
        /// A bit for each that touches.
        [[nodiscard]] std::uint32_t touching(const Box& box) const noexcept
        {
            std::uint32_t apart = 0;
            for (std::size_t lane = 0; lane < width; lane += Pack::size)
                for (int d = 0; d < 3; ++d) {
                    const Pack low = Pack::load(&lo[d][lane]), high = Pack::load(&hi[d][lane]);
                    apart |= (less(Pack::all(box.hi[d]), low) | less(high, Pack::all(box.lo[d]))) << lane;
                }
            return ~apart & ((1U << width) - 1);
        }
        [[nodiscard]] Gaps squared_gaps(const Box& box) const noexcept
        {
            Gaps gaps;
            for (std::size_t lane = 0; lane < width; lane += Pack::size) {
                Pack sum = Pack::all(0);
                for (int d = 0; d < 3; ++d) {
                    const Pack below = Pack::all(box.lo[d]) - Pack::load(&hi[d][lane]);
                    const Pack above = Pack::load(&lo[d][lane]) - Pack::all(box.hi[d]);
                    const Pack apart = max(max(below, above), Pack::all(0));
                    sum = sum + apart * apart;
                }
                sum.store(&gaps[lane]);
            }
            return gaps;
        }
    };
    /// What the order is made by: a box's middle and its size, roughly.
    struct Item
    {
        std::array<float, 4> at;
        std::uint32_t place;
    };

    static Item item(const Box& box, std::uint32_t place) noexcept
    {
        constexpr S most = S(1e18); // beyond that, the order doesn't matter
        Item result{{0, 0, 0, 0}, place};
        for (int d = 0; d < 3; ++d) {
            if (!(box.lo[d] <= box.hi[d])) return {{0, 0, 0, 0}, place};
            const S lo = std::clamp(box.lo[d], -most, most), hi = std::clamp(box.hi[d], -most, most);
            result.at[static_cast<std::size_t>(d)] = static_cast<float>(lo / 2 + hi / 2);
            result.at[3] = std::max(result.at[3], static_cast<float>(hi - lo));
        }
        return result;
    }

    /// Halves a range of items again and again, so that the ends of blocks and of blocks of blocks are ends
    /// of halves: where their middles are furthest apart, or, if that is more, by their size.
    void split(std::size_t begin, std::size_t end)
    {
        while (end - begin > width) {
            std::array<float, 4> lo = items_[begin].at, hi = lo;
            for (std::size_t i = begin + 1; i < end; ++i)
                for (std::size_t d = 0; d < 4; ++d) {
                    lo[d] = std::min(lo[d], items_[i].at[d]);
                    hi[d] = std::max(hi[d], items_[i].at[d]);
                }
            std::size_t axis = 0;
            for (std::size_t d = 1; d < 4; ++d)
                if (hi[d] - lo[d] > hi[axis] - lo[axis]) axis = d;
            std::size_t unit = width;
            while (unit * width < end - begin)
                unit *= width;
            const std::size_t units = (end - begin + unit - 1) / unit, middle = begin + units / 2 * unit;
            const auto at = [&](std::size_t i) { return items_.begin() + static_cast<std::ptrdiff_t>(i); };
            std::nth_element(at(begin), at(middle), at(end),
                             [axis](const Item& a, const Item& b) { return a.at[axis] < b.at[axis]; });
            split(begin, middle);
            begin = middle;
        }
    }

    /// Takes places from the end, or gives new ones slots at the end of the order.
    void resize(std::size_t count)
    {
        while (slots_.size() > count) {
            const std::uint32_t slot = slots_.back();
            slots_.pop_back();
            places_[slot] = none;
            levels_[0][slot / width].set_nowhere(slot % width);
            touched_.push_back(static_cast<std::uint32_t>(slot / width));
            ++loose_;
        }
        while (slots_.size() < count) {
            slots_.push_back(static_cast<std::uint32_t>(places_.size()));
            places_.push_back(static_cast<std::uint32_t>(slots_.size() - 1));
            ++loose_;
        }
        std::size_t blocks = (places_.size() + width - 1) / width;
        for (std::size_t level = 0; blocks > 0; ++level) {
            const bool is_new = levels_.size() == level;
            if (is_new) levels_.emplace_back();
            levels_[level].resize(blocks);
            if (is_new && level > 0) // it begins with all that is below it
                for (std::size_t b = 0; b < levels_[level - 1].size(); ++b)
                    levels_[level][b / width].set(b % width, levels_[level - 1][b].bounds());
            if (blocks == 1) {
                levels_.resize(level + 1);
                return;
            }
            blocks = (blocks + width - 1) / width;
        }
        levels_.clear();
    }

    /// The sum of the finite extents of all blocks.
    [[nodiscard]] S extent() const noexcept
    {
        S sum = 0;
        if (levels_.size() < 2) return sum;
        for (const Block& block : levels_[1])
            for (int d = 0; d < 3; ++d)
                for (std::size_t lane = 0; lane < width; ++lane)
                    if (const S size = block.hi[d][lane] - block.lo[d][lane];
                        size >= 0 && size < std::numeric_limits<S>::max())
                        sum += size;
        return sum;
    }

    template <class Visit>
    bool touching(std::size_t level, std::size_t at, const Box& box, const Visit& visit) const
    {
        std::uint32_t bits = levels_[level][at].touching(box);
        for (std::size_t child = at * width; bits != 0; bits >>= 1, ++child) {
            if ((bits & 1) == 0) continue;
            if (level == 0 ? !visit(places_[child]) : !touching(level - 1, child, box, visit)) return false;
        }
        return true;
    }
    template <class Take>
    void nearest(std::size_t level, std::size_t at, const Box& box, const Take& take, Near& found) const
    {
        Gaps gaps = levels_[level][at].squared_gaps(box);
        while (found.squared > 0) {
            S gap = 0;
            const std::size_t lane = nearest_of(gaps, gap), child = at * width + lane;
            if (!(gap < found.squared)) return;
            gaps[lane] = std::numeric_limits<S>::infinity();
            if (level > 0)
                nearest(level - 1, child, box, take, found);
            else if (take(places_[child], gap))
                found = {gap, places_[child]};
        }
    }
    template <class Visit>
    void nearer(std::size_t level, std::size_t at, const Box& box, S squared, const Visit& visit) const
    {
        const Gaps gaps = levels_[level][at].squared_gaps(box);
        for (std::size_t lane = 0; lane < width; ++lane) {
            if (!(gaps[lane] < squared)) continue;
            const std::size_t child = at * width + lane;
            if (level > 0)
                nearer(level - 1, child, box, squared, visit);
            else
                visit(places_[child], gaps[lane]);
        }
    }

    std::vector<std::uint32_t> places_;      ///< by slot, of which each block has sixteen
    std::vector<std::uint32_t> slots_;       ///< by place
    std::vector<std::vector<Block>> levels_; ///< the boxes, then bounds; the last has one block
    std::size_t loose_ = 0;                  ///< slots that were left or added since the order was made
    S extent_when_sorted_ = 0;
    std::vector<Item> items_;
    std::vector<std::uint32_t> touched_; ///< blocks, for a moment
};

} // namespace fcl
JOSTLE_NAMESPACE_END
