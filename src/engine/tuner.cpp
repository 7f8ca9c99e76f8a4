// SPDX-License-Identifier: MIT
#include "engine/tuner.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

// The cost model, in nanoseconds on the machine it was fitted on; only the ratios matter.
constexpr double ns_per_record = 7.5;  // storing, sorting and arranging one record
constexpr double ns_per_step = 3.0;    // testing 16 candidates against one row
constexpr double ns_per_brick = 150.0; // claiming a brick, clearing and summing its buckets
constexpr double brick_records = 800;  // records that, sorted and arranged, still fit the L1 cache
constexpr double most_cells_x = 4096;  // along the sweep axis
constexpr std::int32_t most_cells_per_axis = 1 << 16; // cells * 2^14 stays below 2^31
constexpr double least_boxes_per_brick = 8;           // bounds the memory for bricks by that for boxes
constexpr double most_crossing = 0.25;                // copies of a box if rows have few candidates
constexpr double finer = 1.19;                        // each edge tried is this much shorter

struct Bounds
{
    double lo, hi;
    double size() const { return hi - lo; }
};

/// Collects the `count` least of the numbers added, ascending. For few among many: most are rejected by one
/// comparison, which std::nth_element can't guarantee.
struct Least
{
    static constexpr std::size_t most = 1023 / 64 + 1; // bounds_of uses fewer than 1024 boxes
    double values[most];
    std::size_t count;
    explicit Least(std::size_t wanted) : count(wanted)
    {
        std::fill_n(values, count, std::numeric_limits<double>::infinity());
    }
    void show(double value)
    {
        if (!(value < values[count - 1])) return;
        std::size_t place = count - 1;
        for (; place > 0 && value < values[place - 1]; --place)
            values[place] = values[place - 1];
        values[place] = value;
    }
};

/// Where most boxes are: from the 1/64 to the 63/64 quantile of their centres, widened, but no further than
/// their bounds. A few boxes far away must not stretch the grid: they go to border bricks; nor must infinite
/// boxes. `parts` replaces 64, and `wider` is the share of the size by which it is widened at each end.
Bounds bounds_of(Sample& sample, int axis, std::size_t parts = 64, double wider = 0.15)
{
    const std::size_t step = std::max<std::size_t>(1, sample.size / 512);
    std::size_t size = 0, next = 0;
    double least = Sample::unbounded, greatest = -Sample::unbounded;
    for (std::size_t k = 0; k < sample.size; ++k) {
        const double lo = sample.lo[axis][k], hi = sample.hi[axis][k];
        if (lo <= -Sample::unbounded || hi >= Sample::unbounded) continue;
        least = std::min(least, lo);
        greatest = std::max(greatest, hi);
        if (k < next) continue;
        next = k + step;
        sample.work[size++] = 0.5 * lo + 0.5 * hi;
    }
    if (size == 0) return {0, 0};
    Least lowest(size / parts + 1), highest(size / parts + 1); // the highest by their negatives
    for (std::size_t k = 0; k < size; ++k) {
        lowest.show(sample.work[k]);
        highest.show(-sample.work[k]);
    }
    const double low = lowest.values[lowest.count - 1], high = -highest.values[highest.count - 1];
    const double margin = wider * (high - low);
    return {std::max(least, low - margin), std::min(greatest, high + margin)};
}

/// Boxes of similar extent on the sweep axis, as the sums that the model needs.
struct ExtentClass
{
    double count = 0, x = 0, y = 0, z = 0, yz = 0;

    void operator+=(const ExtentClass& other)
    {
        count += other.count;
        x += other.x;
        y += other.y;
        z += other.z;
        yz += other.yz;
    }
};

/// How often 1 can be halved before it is no greater than the given number from 0 to 1; at most 23.
int halvings(double number)
{
    std::uint64_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    return std::clamp(1022 - static_cast<int>(bits >> 52), 0, 23);
}

/// What a sample tells about its boxes, on the grid's axes: the sweep axis first. Lengths are relative to the
/// size on their axis, since products of lengths near the largest or smallest numbers leave the range of
/// double.
struct Crowding
{
    int axis[3] = {0, 1, 2}; // the user's
    Bounds bounds[3] = {};   // of most boxes
    double size[3] = {0, 0, 0};
    double samples = 1;
    double density = 0; // boxes around an average box, relative to an even spread
    double share = 1;   // of them that a row is tested against
    ExtentClass total;
    ExtentClass classes[24]; // by halvings of the extent on the sweep axis, without empty ones
    int class_count = 0;
};

/// A histogram of the places of boxes, coarse enough for some to share a bin: the number of pairs in one bin
/// measures the density around boxes.
template <int Dim>
class Histogram
{
  public:
    Histogram(const double (&size)[3], std::size_t samples)
    {
        int bins = 1;
        while (bins < most && power(bins + 1) * 4 <= static_cast<int>(samples))
            ++bins;
        for (int p = 0; p < Dim; ++p)
            if (size[p] > 0) {
                bins_[p] = bins;
                volume_ /= bins;
            }
        std::fill_n(count_, bins_[0] * bins_[1] * bins_[2], std::uint16_t{0});
    }
    /// Adds a box by its place on each axis, 0 to 1, or beyond for boxes outside.
    void add(const double (&place)[3])
    {
        int bin = 0;
        for (int p = Dim - 1; p >= 0; --p) {
            if (bins_[p] == 1) continue;
            const double here = place[p] * bins_[p];
            bin = bin * bins_[p] +
                  (here > 0 ? std::min(static_cast<int>(std::min(here, 1e6)), bins_[p] - 1) : 0);
        }
        pairs_ += 2.0 * count_[bin]++;
    }
    [[nodiscard]] double pairs() const { return pairs_; }
    [[nodiscard]] double volume_of_bin() const { return volume_; }

  private:
    static constexpr int most = 16; // bins on an axis
    static constexpr int power(int bins) { return Dim == 3 ? bins * bins * bins : bins * bins; }
    int bins_[3] = {1, 1, 1};
    double volume_ = 1;
    double pairs_ = 0;
    std::uint16_t count_[most * most * most];
};

template <int Dim>
Crowding crowding_of(Sample& sample, double boxes)
{
    Crowding crowding;
    Bounds bounds[3] = {}; // on the user's axes
    if (sample.size != 0)
        for (int d = 0; d < Dim; ++d)
            bounds[d] = bounds_of(sample, d);

    // Sweep along the longest axis, on which windows are shortest.
    int longest = 0;
    for (int d = 1; d < Dim; ++d)
        if (bounds[d].size() > bounds[longest].size()) longest = d;
    for (int p = 0; p < Dim; ++p) {
        crowding.axis[p] = (longest + p) % Dim;
        crowding.bounds[p] = bounds[crowding.axis[p]];
        crowding.size[p] = crowding.bounds[p].size();
    }

    const auto& size = crowding.size;
    Histogram<Dim> histogram(size, sample.size);
    ExtentClass classes[std::size(crowding.classes)];
    for (std::size_t k = 0; k < sample.size; ++k) {
        double extent[3] = {0, 0, 0}, place[3] = {0, 0, 0};
        for (int p = 0; p < Dim; ++p) {
            if (!(size[p] > 0)) continue;
            const auto [least, greatest] = crowding.bounds[p];
            const double lo = std::max(sample.lo[crowding.axis[p]][k], least),
                         hi = std::min(sample.hi[crowding.axis[p]][k], greatest);
            extent[p] = std::max(0.0, hi - lo) / size[p];
            place[p] = (0.5 * lo + 0.5 * hi - least) / size[p];
        }
        histogram.add(place);
        classes[size[0] > 0 ? halvings(extent[0]) : 0] +=
            {1, extent[0], extent[1], extent[2], extent[1] * extent[2]};
    }
    for (const ExtentClass& each : classes) {
        if (each.count == 0) continue;
        crowding.total += each;
        crowding.classes[crowding.class_count++] = each;
    }
    crowding.samples = std::max<double>(1, static_cast<double>(sample.size));
    if (histogram.volume_of_bin() > 0)
        crowding.density =
            histogram.pairs() / crowding.samples / histogram.volume_of_bin() * (boxes / crowding.samples);
    return crowding;
}

/// The expected cost of a grid per box.
struct Cost
{
    double ns;
    std::int32_t cells_x; // the number of bricks along the sweep axis at that cost
};

/// The cost model, for a grid that cuts the second axis into cy parts and the third into cz:
///
///     records = 1 + crossings                  a box is copied into each brick it reaches
///     steps   = candidates / 16 + 1/2          a window has the boxes that begin within the extent
///                                              at the density of the place and in the section of a brick
///     ns      = 7.5 records + 3 steps + 150 bricks / boxes
///
/// Steps are computed separately for each class of extents, and are at least one: mean extents would hide
/// that a few large boxes have most of the candidates.
///
/// If rows are tested against only a share of their windows, in two sets of which one is far smaller, bricks
/// may hold more than fits the L1 cache, so no cut of the sweep axis is worth a copy of each box.
Cost cost_of(const Crowding& crowding, double boxes, std::int32_t cy, std::int32_t cz)
{
    const double along_y = crowding.size[1] > 0 ? cy : 0, along_z = crowding.size[2] > 0 ? cz : 0;
    const double section = 1 / (std::max(1.0, along_y) * std::max(1.0, along_z));
    const auto copies = [&](const ExtentClass& c) {
        return c.count + c.y * along_y + c.z * along_z + c.yz * (along_y * along_z);
    };
    const double records = copies(crowding.total) / crowding.samples;
    double steps = 0;
    for (int k = 0; k < crowding.class_count; ++k) {
        const ExtentClass& c = crowding.classes[k];
        const double window =
            c.x / c.count * crowding.density * section * records * crowding.share / 16 + 0.5;
        steps += copies(c) * std::max(1.0, window);
    }
    steps /= crowding.samples;
    const double columns = static_cast<double>(cy) * cz;
    std::int32_t cx = 1;
    const double mean_x = crowding.total.x / crowding.samples;
    if (crowding.size[0] > 0) {
        double most = most_cells_x;
        if (crowding.share < 1) most = std::min(most, 1 + most_crossing / std::max(mean_x, 1e-9));
        cx = static_cast<std::int32_t>(
            std::clamp(std::floor(boxes * records / columns / brick_records) + 1, 1.0, most));
    }
    const double crossing = cx > 1 ? mean_x * cx : 0;
    return {(ns_per_record * records + ns_per_step * steps) * (1 + crossing) +
                ns_per_brick * columns * cx / boxes,
            cx};
}

/// Tries ever smaller bricks, with edges of equal length on the second and third axis as far as whole numbers
/// allow, and sets `cells` to the cheapest. Returns their cost.
double search_cells(const Crowding& crowding, double boxes, std::int32_t (&cells)[3])
{
    Cost best = cost_of(crowding, boxes, 1, 1);
    cells[0] = best.cells_x;
    const double longer = std::max(crowding.size[1], crowding.size[2]);
    const double most_bricks = std::max(1.0, boxes / least_boxes_per_brick);
    // An edge relative to the longer side, down to where no axis can be cut finer.
    for (double share = 1 / finer; longer > 0 && share > 0.5 / most_cells_per_axis; share /= finer) {
        const auto cells_of = [&](double length) {
            return static_cast<std::int32_t>(std::clamp(std::floor(length / longer / share + 0.5), 1.0,
                                                        static_cast<double>(most_cells_per_axis)));
        };
        const std::int32_t cy = cells_of(crowding.size[1]), cz = cells_of(crowding.size[2]);
        const double columns = static_cast<double>(cy) * cz;
        if (columns > most_bricks) break;
        const Cost cost = cost_of(crowding, boxes, cy, cz);
        if (cost.ns < best.ns && columns * cost.cells_x <= most_bricks) {
            best = cost;
            cells[0] = cost.cells_x;
            cells[1] = cy;
            cells[2] = cz;
        } else if (cost.ns > 2 * best.ns) {
            break; // from here on smaller bricks only cost more
        }
    }
    return best.ns;
}

/// Maps the grid's axis p, whose number of cells is already set, to one of the user's.
template <class T>
void lay_axis(Grid<T>& grid, int p, bool used, int axis, const Bounds& bounds)
{
    const double cells = static_cast<double>(grid.cells[p]) * quanta;
    grid.last[p] = std::nextafter(static_cast<T>(cells), T(0));
    if (!used) return;
    grid.axis[p] = axis;
    grid.origin[p] = static_cast<T>(bounds.lo);
    grid.flat[p] = !(bounds.size() > 0);
    if (grid.flat[p]) return;
    // Any finite positive scale is correct; a normal one keeps the products exact enough to be useful.
    const double scale = cells / bounds.size();
    grid.scale[p] = static_cast<T>(std::clamp(scale, static_cast<double>(std::numeric_limits<T>::min()),
                                              static_cast<double>(std::numeric_limits<T>::max()) / 4));
}

} // namespace

double sweep_cost(double steps) noexcept
{
    return ns_per_record + ns_per_step * steps;
}

template <int Dim, class T>
TunedGrid<T> tune(Sample& sample, std::size_t boxes, double share)
{
    const double n = static_cast<double>(boxes);
    Crowding crowding = crowding_of<Dim>(sample, n);
    crowding.share = share;
    TunedGrid<T> tuned;
    tuned.cost = search_cells(crowding, n, tuned.grid.cells);
    for (int p = 0; p < 3; ++p)
        lay_axis(tuned.grid, p, p < Dim, crowding.axis[p], crowding.bounds[p]);
    return tuned;
}

template <int Dim, class T>
Grid<T> fit(Sample& sample, int sweep_axis)
{
    Grid<T> grid;
    for (int p = 0; p < 3; ++p) {
        const int axis = (sweep_axis + p) % Dim;
        lay_axis(grid, p, p < Dim, axis, p < Dim ? bounds_of(sample, axis, 8, 1) : Bounds{0, 0});
    }
    return grid;
}

template TunedGrid<float> tune<2, float>(Sample&, std::size_t, double);
template TunedGrid<float> tune<3, float>(Sample&, std::size_t, double);
template TunedGrid<double> tune<2, double>(Sample&, std::size_t, double);
template TunedGrid<double> tune<3, double>(Sample&, std::size_t, double);
template Grid<float> fit<2, float>(Sample&, int);
template Grid<float> fit<3, float>(Sample&, int);
template Grid<double> fit<2, double>(Sample&, int);
template Grid<double> fit<3, double>(Sample&, int);

} // namespace engine
JOSTLE_NAMESPACE_END
