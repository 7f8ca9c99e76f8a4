// SPDX-License-Identifier: MIT
#include "jostle/periodic.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "base/box.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/in_use.hpp"
#include "base/number_text.hpp"
#include "base/run_tasks.hpp"
#include "pairs/filters.hpp"

JOSTLE_NAMESPACE_BEGIN

namespace {

constexpr std::size_t block_size = 2048; // boxes; the calling thread alone does fewer than four blocks
constexpr char axis_names[] = "xyz";

/// a + b, rounded down: to the next number below if the sum isn't exact.
/// Source   Knuth, The Art of Computer Programming 2 (1997), sec. 4.2.2, theorem B.
template <Coordinate T>
T sum_rounded_down(T a, T b)
{
    const T sum = a + b, rest = sum - a;
    const T error = (a - (sum - rest)) + (b - rest);
    return error < 0 ? std::nextafter(sum, -std::numeric_limits<T>::infinity()) : sum;
}
template <Coordinate T>
T sum_rounded_up(T a, T b)
{
    return -sum_rounded_down(-a, -b);
}

template <Coordinate T>
bool infinite_both_ways(T lo, T hi)
{
    return lo == -std::numeric_limits<T>::infinity() && hi == std::numeric_limits<T>::infinity();
}

/// How far an image is shifted, in periods, and on which axes, as bits.
template <int Dim>
struct Shift
{
    std::array<int, detail::axes<Dim>> periods;
    std::uint8_t axes;
};

/// All combinations of -1, 0 and 1 on the periodic axes whose first nonzero number is -1.
template <int Dim, Coordinate T>
std::size_t list_shifts(const Vec<Dim, T>& period, std::array<Shift<Dim>, 13>& out)
{
    std::size_t count = 0;
    for (int code = 1; code < (Dim == 3 ? 27 : 9); ++code) {
        Shift<Dim> shift{};
        int rest = code, first = 0;
        bool possible = true;
        for (int d = Dim - 1; d >= 0; --d, rest /= 3) {
            const int periods = rest % 3 == 2 ? 1 : -(rest % 3); // 0, -1, 1
            shift.periods[static_cast<std::size_t>(d)] = periods;
            if (periods == 0) continue;
            first = periods;
            shift.axes |= static_cast<std::uint8_t>(1u << d);
            possible &= period[d] > 0;
        }
        if (possible && first == -1) out[count++] = shift;
    }
    return count;
}

/// Boxes that end below this have no image further down: even rounded, it wouldn't reach up to `lowest`, the
/// lower end of all boxes.
template <Coordinate T>
T no_image_below(T lowest, T period)
{
    return sum_rounded_down(std::nextafter(lowest, -std::numeric_limits<T>::infinity()), period);
}

/// The result of one pass over a block.
template <int Dim, Coordinate T>
struct Survey
{
    static constexpr std::uint64_t none = ~std::uint64_t{0};

    Vec<Dim, T> lo, hi;       ///< of the boxes that are finite on the axis
    std::uint64_t bad = none; ///< the first box that is NaN, inverted or too long
    std::uint64_t images = 0, first_image = 0;
    bool walls = false; ///< some box is infinite along a periodic axis
};

template <int Dim, Coordinate T>
bool too_long(const Aabb<Dim, T>& box, const Vec<Dim, T>& period, int d)
{
    return period[d] > 0 && !infinite_both_ways(box.lo[d], box.hi[d]) &&
           !(box.hi[d] - box.lo[d] < period[d] / 2);
}

template <int Dim, Coordinate T>
[[noreturn]] void throw_too_long(const Aabb<Dim, T>& box, const Vec<Dim, T>& period, std::uint64_t i)
{
    check_box(box, i, "");
    for (int d = 0; d < Dim; ++d)
        if (too_long(box, period, d))
            throw Error(ErrorCode::invalid_argument,
                        "box " + std::to_string(i) + " reaches from " + number_text(box.lo[d]) + " to " +
                            number_text(box.hi[d]) + " on " + axis_names[d] +
                            ", and it must be shorter than half of the period there, which is " +
                            number_text(period[d]) + "; split it, or make it infinite both ways",
                        i);
    throw Error(ErrorCode::invalid_argument, "box " + std::to_string(i) + " changed while it was read", i);
}

} // namespace

template <int Dim, Coordinate T>
struct PeriodicImages<Dim, T>::Implementation
{
    /// The callback of filter(): calls that of the originals.
    struct Accept
    {
        const Implementation* images;
        StoredFunctionRef<bool(std::uint32_t a, std::uint32_t b)> originals;

        bool operator()(std::uint32_t a, std::uint32_t b) const
        {
            return originals(images->origin[a], images->origin[b]);
        }
    };

    explicit Implementation(const FinderOptions& given)
        : options(given),
          boxes((check_memory(given.memory), given.memory)),
          origin(given.memory),
          shift(given.memory),
          axes(given.memory),
          surveys(given.memory),
          category(given.memory),
          mask(given.memory),
          owner(given.memory),
          vertices(given.memory)
    {
    }

    FinderOptions options;
    std::atomic<bool> in_use{false};
    std::size_t originals = 0;
    std::pmr::vector<Box> boxes;
    std::pmr::vector<std::uint32_t> origin;
    std::pmr::vector<Vector> shift;
    std::pmr::vector<std::uint8_t> axes; ///< of ImageRule, if there are walls
    std::pmr::vector<Survey<Dim, T>> surveys;
    std::pmr::vector<std::uint32_t> category, mask, owner;
    std::pmr::vector<std::array<std::uint32_t, 3>> vertices;
    ImageRule rule;
    Accept accept{};

    /// Calls work(block, begin, end) for each block of n boxes.
    template <class Work>
    void each_block(std::size_t n, const Work& work)
    {
        const std::size_t blocks = (n + block_size - 1) / block_size;
        std::atomic<std::size_t> next{0};
        const auto task = [&](std::uint32_t) {
            const ExactFloats exact;
            for (std::size_t block; (block = next.fetch_add(1, std::memory_order_relaxed)) < blocks;)
                work(block, block * block_size, std::min(n, (block + 1) * block_size));
        };
        if (blocks < 4) return task(0);
        Executor& executor = options.executor != nullptr ? *options.executor : default_executor();
        run_tasks(executor,
                  std::min(executor.concurrency(),
                           static_cast<std::uint32_t>(std::min<std::size_t>(blocks, 1u << 20))),
                  task);
    }

    void build(const BoxView<Dim, T>& given, const Vector& period)
    {
        const InUse use(in_use, "PeriodicImages");
        check_period(period);
        const std::size_t n = given.size();
        if (n > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorCode::too_many_objects, std::to_string(n) + " boxes are more than 2^32 - 1");
        check_pointers(given);
        const Survey<Dim, T> all = survey_all(given, period);
        check_spread(given, period, all);
        const Imager make_images(period, all);
        const std::uint64_t size = count_images(given, make_images);
        try {
            boxes.resize(size), origin.resize(size), shift.resize(size);
            write_images(given, make_images);
            list_axes(n, all.walls);
        } catch (...) {
            boxes.clear(), origin.clear(), shift.clear(), axes.clear();
            originals = 0;
            throw;
        }
        originals = n;
    }

    /// Makes the images of boxes, each in the order of the shifts.
    class Imager
    {
      public:
        Imager(const Vector& period, const Survey<Dim, T>& all)
            : period_(period), all_(all), shift_count_(list_shifts(period, shifts_))
        {
            for (int d = 0; d < Dim; ++d)
                ends_[d] = period[d] > 0 && all.lo[d] <= all.hi[d] ? no_image_below(all.lo[d], period[d])
                                                                   : std::numeric_limits<T>::infinity();
        }
        /// Calls visit(image, shift).
        template <class Visit>
        void operator()(const Box& box, const Visit& visit) const
        {
            if (near_end(box, ends_))
                each_image(box, period_, all_, std::span(shifts_).first(shift_count_), visit);
        }

      private:
        const Vector& period_;
        const Survey<Dim, T>& all_;
        std::array<Shift<Dim>, 13> shifts_;
        std::size_t shift_count_;
        Vector ends_; // no box that ends below has an image
    };

    static void check_period(const Vector& period)
    {
        for (int d = 0; d < Dim; ++d)
            if (!(period[d] >= 0 && period[d] <= std::numeric_limits<T>::max()))
                throw Error(ErrorCode::invalid_argument,
                            std::string("the period along ") + axis_names[d] + " is " +
                                number_text(period[d]) +
                                "; give a length, or 0 where space doesn't repeat itself");
    }
    /// Surveys each block of boxes, and returns what that comes to.
    Survey<Dim, T> survey_all(const BoxView<Dim, T>& given, const Vector& period)
    {
        using Block = Survey<Dim, T>;
        surveys.resize((given.size() + block_size - 1) / block_size);
        each_block(given.size(), [&](std::size_t block, std::size_t begin, std::size_t end) {
            surveys[block] = survey(given, period, begin, end);
        });
        Block all = nothing();
        for (const Block& block : surveys) {
            if (block.bad != Block::none) throw_too_long(given[block.bad], period, block.bad);
            for (int d = 0; d < Dim; ++d) {
                all.lo[d] = std::min(all.lo[d], block.lo[d]);
                all.hi[d] = std::max(all.hi[d], block.hi[d]);
            }
            all.walls |= block.walls;
        }
        return all;
    }
    /// Sets where each block's images begin, behind the boxes themselves. Returns where the last ends.
    std::uint64_t count_images(const BoxView<Dim, T>& given, const Imager& make_images)
    {
        const std::size_t n = given.size();
        each_block(n, [&](std::size_t block, std::size_t begin, std::size_t end) {
            std::uint64_t images = 0;
            for (std::size_t i = begin; i < end; ++i)
                make_images(given[i], [&](const Box&, const Vector&) { ++images; });
            surveys[block].images = images;
        });
        std::uint64_t size = n;
        for (Survey<Dim, T>& block : surveys) {
            block.first_image = size;
            size += block.images;
        }
        if (size > std::numeric_limits<std::uint32_t>::max())
            throw Error(ErrorCode::too_many_objects, std::to_string(n) + " boxes and " +
                                                         std::to_string(size - n) +
                                                         " images of them are more than 2^32 - 1");
        return size;
    }
    void write_images(const BoxView<Dim, T>& given, const Imager& make_images)
    {
        each_block(given.size(), [&](std::size_t block, std::size_t begin, std::size_t end) {
            std::size_t next = surveys[block].first_image;
            for (std::size_t i = begin; i < end; ++i) {
                const Box box = given[i];
                boxes[i] = box;
                origin[i] = static_cast<std::uint32_t>(i);
                shift[i] = {};
                make_images(box, [&](const Box& image, const Vector& by) {
                    boxes[next] = image;
                    origin[next] = static_cast<std::uint32_t>(i);
                    shift[next++] = by;
                });
            }
        });
    }
    void list_axes(std::size_t n, bool walls)
    {
        axes.resize(walls ? boxes.size() : 0);
        each_block(axes.size(), [&](std::size_t, std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) {
                unsigned bits = 0;
                for (int d = 0; d < Dim; ++d)
                    if (i < n ? infinite_both_ways(boxes[i].lo[d], boxes[i].hi[d]) : shift[i][d] != 0)
                        bits |= 1u << d;
                axes[i] = static_cast<std::uint8_t>(bits);
            }
        });
    }

    static Survey<Dim, T> nothing()
    {
        Survey<Dim, T> survey;
        for (int d = 0; d < Dim; ++d) {
            survey.lo[d] = std::numeric_limits<T>::infinity();
            survey.hi[d] = -std::numeric_limits<T>::infinity();
        }
        return survey;
    }
    static Survey<Dim, T> survey(const BoxView<Dim, T>& given, const Vector& period, std::size_t begin,
                                 std::size_t end)
    {
        Survey<Dim, T> survey = nothing();
        for (std::size_t i = begin; i < end; ++i) {
            const Box box = given[i];
            bool plain = true;
            for (int d = 0; d < Dim; ++d)
                plain &= box.lo[d] <= box.hi[d] && (period[d] == 0 || box.hi[d] - box.lo[d] < period[d] / 2);
            if (plain) {
                for (int d = 0; d < Dim; ++d) {
                    survey.lo[d] = std::min(survey.lo[d], box.lo[d]);
                    survey.hi[d] = std::max(survey.hi[d], box.hi[d]);
                }
                continue;
            }
            bool good = valid(box);
            for (int d = 0; d < Dim; ++d) {
                if (period[d] == 0) continue;
                if (infinite_both_ways(box.lo[d], box.hi[d])) {
                    survey.walls = true;
                    continue;
                }
                good &= !too_long(box, period, d);
                survey.lo[d] = std::min(survey.lo[d], box.lo[d]);
                survey.hi[d] = std::max(survey.hi[d], box.hi[d]);
            }
            if (!good) {
                survey.bad = i;
                break;
            }
        }
        return survey;
    }
    /// At two periods or more, a pair could touch by a shift of two.
    static void check_spread(const BoxView<Dim, T>& given, const Vector& period, const Survey<Dim, T>& all)
    {
        for (int d = 0; d < Dim; ++d) {
            const auto too_far = [&](T hi) { return period[d] > 0 && !(hi - all.lo[d] < 2 * period[d]); };
            if (!(all.lo[d] <= all.hi[d]) || !too_far(all.hi[d])) continue;
            for (std::size_t i = 0; i < given.size(); ++i)
                if (!infinite_both_ways(given.lo(d, i), given.hi(d, i)) && too_far(given.hi(d, i)))
                    throw Error(
                        ErrorCode::invalid_argument,
                        "box " + std::to_string(i) + " reaches up to " + number_text(given.hi(d, i)) +
                            " on " + axis_names[d] + ", and the lowest box down to " +
                            number_text(all.lo[d]) + ": that is two periods of " + number_text(period[d]) +
                            " or more; shift boxes by whole periods until their centres lie within one",
                        i);
        }
    }
    /// Returns false if the box has no images, since each one is shifted down on some axis.
    static bool near_end(const Box& box, const Vector& ends)
    {
        bool near = false;
        for (int d = 0; d < Dim; ++d)
            near |= box.hi[d] >= ends[d];
        return near;
    }
    /// Calls make(image, shift) for each image of a box that can touch something.
    template <class Make>
    static void each_image(const Box& box, const Vector& period, const Survey<Dim, T>& all,
                           std::span<const Shift<Dim>> shifts, const Make& make)
    {
        unsigned down = 0, up = 0;
        Vec<Dim, T> shifted_lo[2], shifted_hi[2]; // down, up
        for (int d = 0; d < Dim; ++d) {
            const T lo = box.lo[d], hi = box.hi[d], length = period[d];
            if (length == 0 || infinite_both_ways(lo, hi)) continue;
            shifted_hi[0][d] = sum_rounded_up(hi, -length);
            if (shifted_hi[0][d] >= all.lo[d]) {
                down |= 1u << d;
                shifted_lo[0][d] = sum_rounded_down(lo, -length);
            }
            shifted_lo[1][d] = sum_rounded_down(lo, length);
            if (shifted_lo[1][d] <= all.hi[d]) {
                up |= 1u << d;
                shifted_hi[1][d] = sum_rounded_up(hi, length);
            }
        }
        if (down == 0) return; // every shift goes down on some axis
        for (const Shift<Dim>& shift : shifts) {
            Box image = box;
            Vector by{};
            bool wanted = true;
            for (int d = 0; d < Dim && wanted; ++d) {
                const int periods = shift.periods[static_cast<std::size_t>(d)];
                if (periods == 0) continue;
                const int which = periods < 0 ? 0 : 1;
                wanted = ((which == 0 ? down : up) >> d & 1u) != 0;
                if (!wanted) break;
                image.lo[d] = shifted_lo[which][d];
                image.hi[d] = shifted_hi[which][d];
                by[d] = periods < 0 ? -period[d] : period[d];
            }
            if (wanted) make(image, by);
        }
    }

    Filter filter(const Filter& given)
    {
        const InUse use(in_use, "PeriodicImages");
        check_filter(given, originals);
        if (given.ghosts != 0)
            throw Error(ErrorCode::invalid_argument, "filter ghosts is " + std::to_string(given.ghosts) +
                                                         ": periodic space has no ghosts");
        const std::uint32_t size = static_cast<std::uint32_t>(boxes.size());
        const auto spread = [&]<class Value>(const StridedView<Value>& values, std::pmr::vector<Value>& out) {
            if (values.empty()) return StridedView<Value>{};
            out.resize(size);
            for (std::uint32_t i = 0; i < size; ++i)
                out[i] = values[origin[i]];
            return StridedView<Value>(out);
        };
        Filter all;
        all.category = spread(given.category, category);
        all.mask = spread(given.mask, mask);
        all.owner = spread(given.owner, owner);
        all.vertices = spread(given.vertices, vertices);
        rule = {static_cast<std::uint32_t>(originals), axes};
        all.images = &rule;
        accept = {this, given.accept};
        if (given.accept) all.accept = accept;
        return all;
    }
};

template <int Dim, Coordinate T>
PeriodicImages<Dim, T>::PeriodicImages(const FinderOptions& options)
    : implementation_(std::make_unique<Implementation>(options))
{
}
template <int Dim, Coordinate T>
PeriodicImages<Dim, T>::PeriodicImages(PeriodicImages&&) noexcept = default;
template <int Dim, Coordinate T>
PeriodicImages<Dim, T>& PeriodicImages<Dim, T>::operator=(PeriodicImages&&) noexcept = default;
template <int Dim, Coordinate T>
PeriodicImages<Dim, T>::~PeriodicImages() = default;

template <int Dim, Coordinate T>
void PeriodicImages<Dim, T>::build(const BoxView<Dim, T>& boxes, const Vector& period)
{
    implementation_->build(boxes, period);
}
template <int Dim, Coordinate T>
std::size_t PeriodicImages<Dim, T>::originals() const noexcept
{
    return implementation_->originals;
}
template <int Dim, Coordinate T>
std::span<const Aabb<Dim, T>> PeriodicImages<Dim, T>::boxes() const noexcept
{
    return implementation_->boxes;
}
template <int Dim, Coordinate T>
std::span<const std::uint32_t> PeriodicImages<Dim, T>::origin() const noexcept
{
    return implementation_->origin;
}
template <int Dim, Coordinate T>
std::span<const Vec<Dim, T>> PeriodicImages<Dim, T>::shift() const noexcept
{
    return implementation_->shift;
}
template <int Dim, Coordinate T>
Filter PeriodicImages<Dim, T>::filter(const Filter& originals)
{
    return implementation_->filter(originals);
}

template class JOSTLE_API PeriodicImages<2, float>;
template class JOSTLE_API PeriodicImages<2, double>;
template class JOSTLE_API PeriodicImages<3, float>;
template class JOSTLE_API PeriodicImages<3, double>;

JOSTLE_NAMESPACE_END
