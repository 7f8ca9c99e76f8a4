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
constexpr double ns_per_block = 3.0;   // testing 16 candidates against one row
constexpr double ns_per_brick = 150.0; // claiming a brick, clearing and summing its buckets
constexpr double brick_records = 800;  // records that, sorted and arranged, still fit the L1 cache
constexpr std::int32_t most_cells_per_axis = 1 << 16;   // cells * 2^14 stays below 2^31
constexpr std::int64_t most_bricks_per_box_inverse = 8; // at least that many boxes per brick

struct Bounds
{
    double lo, hi;
    double size() const { return hi - lo; }
};

/// The `count` least of the numbers that it is shown, ascending. For few among many: most are turned away by
/// one comparison, which std::nth_element can't promise.
struct Least
{
    static constexpr std::size_t most = 1023 / 64 + 1; // bounds_of looks at fewer than 1024 boxes
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
/// they reach. A few boxes far away must not stretch the grid, they land in border bricks; nor must boxes
/// without end.
Bounds bounds_of(Sample& sample, int axis)
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
    Least lowest(size / 64 + 1), highest(size / 64 + 1); // the highest by their negatives
    for (std::size_t k = 0; k < size; ++k) {
        lowest.show(sample.work[k]);
        highest.show(-sample.work[k]);
    }
    const double low = lowest.values[lowest.count - 1], high = -highest.values[highest.count - 1];
    const double margin = 0.15 * (high - low);
    return {std::max(least, low - margin), std::min(greatest, high + margin)};
}

/// Boxes of similar extent on the sweep axis, as the sums the model needs.
struct ExtentClass
{
    double count = 0, x = 0, y = 0, z = 0, yz = 0;
    double mean_x = 0;
};

/// How often 1 can be halved before it is no greater than the number from 0 to 1, at most 23 times.
int halvings(double number)
{
    std::uint64_t bits;
    std::memcpy(&bits, &number, sizeof bits);
    return std::clamp(1022 - static_cast<int>(bits >> 52), 0, 23);
}

} // namespace

double sweep_cost(double blocks) noexcept
{
    return ns_per_record + ns_per_block * blocks;
}

template <int Dim, class T>
TunedGrid<T> tune(Sample& sample, std::size_t boxes)
{
    TunedGrid<T> tuned;
    Grid<T>& grid = tuned.grid;
    const double n = static_cast<double>(boxes);
    Bounds bounds[3] = {};
    if (sample.size != 0)
        for (int d = 0; d < Dim; ++d)
            bounds[d] = bounds_of(sample, d);

    // Sweep along the longest axis: there the windows are shortest.
    int longest = 0;
    for (int d = 1; d < Dim; ++d)
        if (bounds[d].size() > bounds[longest].size()) longest = d;
    for (int p = 0; p < Dim; ++p)
        grid.axis[p] = (longest + p) % Dim;
    if constexpr (Dim == 2) grid.axis[2] = 2;

    double size[3] = {0, 0, 0};
    for (int p = 0; p < Dim; ++p)
        size[p] = bounds[grid.axis[p]].size();
    const std::size_t m = sample.size;

    // The density that a box sees around it: pairs of sampled boxes in one bin of a coarse histogram. From
    // here on lengths are shares of the grid's size on their axis, for products of lengths near the largest
    // or smallest numbers leave the range of double.
    double volume = 1;
    int bins_of[3] = {1, 1, 1};
    int bins_per_axis = 1;
    const auto enough = [&](int bins) {
        return (Dim == 3 ? bins * bins * bins : bins * bins) * 4 <= static_cast<int>(m);
    };
    while (bins_per_axis < 16 && enough(bins_per_axis + 1))
        ++bins_per_axis;
    for (int p = 0; p < Dim; ++p) {
        if (size[p] > 0) {
            bins_of[p] = bins_per_axis;
            volume /= bins_per_axis;
        }
    }
    std::uint16_t histogram[16 * 16 * 16];
    std::fill_n(histogram, bins_of[0] * bins_of[1] * bins_of[2], std::uint16_t{0});
    double pairs_in_bins = 0;
    ExtentClass classes[24];
    for (std::size_t k = 0; k < m; ++k) {
        int bin = 0;
        double extent[3] = {0, 0, 0};
        for (int p = Dim - 1; p >= 0; --p) {
            const int a = grid.axis[p];
            const double lo = std::max(sample.lo[a][k], bounds[a].lo),
                         hi = std::min(sample.hi[a][k], bounds[a].hi);
            if (size[p] > 0) extent[p] = std::max(0.0, hi - lo) / size[p];
            if (bins_of[p] == 1) continue;
            const double place = (0.5 * lo + 0.5 * hi - bounds[a].lo) / size[p] * bins_of[p];
            bin = bin * bins_of[p] +
                  (place > 0 ? std::min(static_cast<int>(std::min(place, 1e6)), bins_of[p] - 1) : 0);
        }
        pairs_in_bins += 2.0 * histogram[bin]++;
        const int e = size[0] > 0 ? halvings(extent[0]) : 0;
        ExtentClass& c = classes[e];
        c.count += 1;
        c.x += extent[0];
        c.y += extent[1];
        c.z += extent[2];
        c.yz += extent[1] * extent[2];
    }
    int class_count = 0;
    ExtentClass total;
    for (const ExtentClass& c : classes) {
        if (c.count == 0) continue;
        total.count += c.count;
        total.x += c.x;
        total.y += c.y;
        total.z += c.z;
        total.yz += c.yz;
        classes[class_count] = c;
        classes[class_count++].mean_x = c.x / c.count;
    }
    const double samples = std::max<double>(1, static_cast<double>(m));
    const double density = volume > 0 ? pairs_in_bins / samples / volume * (n / samples) : 0;

    // What a grid of cy x cz columns costs per box.
    const auto evaluate = [&](std::int32_t cy, std::int32_t cz, std::int32_t& cx) {
        const double along_y = size[1] > 0 ? cy : 0, along_z = size[2] > 0 ? cz : 0;
        const double section = 1 / (std::max(1.0, along_y) * std::max(1.0, along_z));
        const auto copies = [&](const ExtentClass& c) {
            return c.count + c.y * along_y + c.z * along_z + c.yz * (along_y * along_z);
        };
        const double records = copies(total) / samples;
        double blocks = 0;
        for (int k = 0; k < class_count; ++k) {
            const ExtentClass& c = classes[k];
            const double window = c.mean_x * density * section * records / 16 + 0.5;
            blocks += copies(c) * std::max(1.0, window);
        }
        blocks /= samples;
        const double columns = static_cast<double>(cy) * cz;
        cx = static_cast<std::int32_t>(
            std::clamp(std::floor(n * records / columns / brick_records) + 1, 1.0, 4096.0));
        if (!(size[0] > 0)) cx = 1;
        const double crossing = cx > 1 ? total.x / samples * cx : 0;
        return (ns_per_record * records + ns_per_block * blocks) * (1 + crossing) +
               ns_per_brick * columns * cx / n;
    };

    std::int32_t best_cx = 1;
    tuned.cost = evaluate(1, 1, best_cx);
    grid.cells[0] = best_cx;
    const double area = std::max(size[1], size[2]);
    const double most_bricks = std::max(1.0, n / static_cast<double>(most_bricks_per_box_inverse));
    // Bricks as a share of the longer side, down to where no axis can be cut finer.
    for (double share = 1 / 1.19; area > 0 && share > 0.5 / most_cells_per_axis; share /= 1.19) {
        const auto cells_of = [&](double length) {
            return static_cast<std::int32_t>(std::clamp(std::floor(length / area / share + 0.5), 1.0,
                                                        static_cast<double>(most_cells_per_axis)));
        };
        const std::int32_t cy = cells_of(size[1]), cz = cells_of(size[2]);
        if (static_cast<double>(cy) * cz > most_bricks) break;
        std::int32_t cx = 1;
        const double cost = evaluate(cy, cz, cx);
        if (cost < tuned.cost && static_cast<double>(cy) * cz * cx <= std::max(most_bricks, 1.0)) {
            tuned.cost = cost;
            grid.cells[0] = cx;
            grid.cells[1] = cy;
            grid.cells[2] = cz;
        } else if (cost > 2 * tuned.cost) {
            break; // ever smaller bricks only cost more from here on
        }
    }

    for (int p = 0; p < 3; ++p) {
        const double cells = static_cast<double>(grid.cells[p]) * quanta;
        grid.last[p] = std::nextafter(static_cast<T>(cells), T(0));
        if (p >= Dim) continue;
        grid.origin[p] = static_cast<T>(bounds[grid.axis[p]].lo);
        grid.flat[p] = !(size[p] > 0);
        if (grid.flat[p]) continue;
        // Any finite positive scale is right; a normal one keeps the products exact enough to be useful.
        const double scale = cells / size[p];
        grid.scale[p] = static_cast<T>(std::clamp(scale, static_cast<double>(std::numeric_limits<T>::min()),
                                                  static_cast<double>(std::numeric_limits<T>::max()) / 4));
    }
    return tuned;
}

template TunedGrid<float> tune<2, float>(Sample&, std::size_t);
template TunedGrid<float> tune<3, float>(Sample&, std::size_t);
template TunedGrid<double> tune<2, double>(Sample&, std::size_t);
template TunedGrid<double> tune<3, double>(Sample&, std::size_t);

} // namespace engine
JOSTLE_NAMESPACE_END
