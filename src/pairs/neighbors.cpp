// SPDX-License-Identifier: MIT
// Neighbour lists: points in the cells of a grid along the reciprocal axes of the space that repeats. A test
// of wrapped points with room for rounding finds who may be near; the test of the definition decides.
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <limits>
#include <memory_resource>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "base/buffer.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/in_use.hpp"
#include "base/instantiate.hpp"
#include "base/run_tasks.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace {

constexpr std::size_t rows_per_block = 128; // of work; fewer than four blocks are done by the calling thread
constexpr int image_bits = 10;              // of an image's number along an axis, in the key of a neighbour
constexpr std::int64_t image_bias = 1 << (image_bits - 1), most_images = 500;

template <int Dim>
using Periods = std::array<std::int32_t, detail::axes<Dim>>;

template <class Number>
std::string number_text(Number number)
{
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(std::numeric_limits<double>::max_digits10);
    if constexpr (std::is_same_v<Number, float>) out.precision(std::numeric_limits<float>::max_digits10);
    out << number;
    return out.str();
}

template <int Dim, Coordinate T>
std::string point_text(const char* set, std::size_t i, const Vec<Dim, T>& point)
{
    std::string text = std::string("point ") + set + std::to_string(i) + ", (";
    for (int d = 0; d < Dim; ++d)
        text += (d == 0 ? "" : ", ") + number_text(point[d]);
    return text + ")";
}

/// How errors name a set as a whole: nothing where there is one.
std::string set_text(const char* set)
{
    return *set == 0 ? std::string() : std::string(" of ") + *set;
}

[[noreturn]] void refuse_search(const std::string& message, std::uint64_t index = Error::no_index)
{
    throw Error(ErrorCode::invalid_argument, message, index);
}

/// The vector of the definition.
template <int Dim, Coordinate T>
Vec<Dim, T> vector_between(const Vec<Dim, T>& from, const Vec<Dim, T>& to, const Periods<Dim>& shift,
                           const PeriodicCell<Dim, T>& cell)
{
    Vec<Dim, T> sum{};
    bool first = true;
    for (int k = 0; k < Dim; ++k) {
        if (!cell.repeats[k]) continue;
        const Vec<Dim, T> term = cell.vectors[k] * static_cast<T>(shift[static_cast<std::size_t>(k)]);
        sum = first ? term : sum + term;
        first = false;
    }
    const Vec<Dim, T> apart = to - from;
    return first ? apart : apart + sum;
}

/// One set as a call sees it.
template <int Dim, Coordinate T>
struct PointSet
{
    std::span<const Vec<Dim, T>> points;
    std::span<const T> radii;
    std::span<const std::uint32_t> types;
    const char* name; ///< in errors
};

/// Where a call's cutoffs come from.
template <Coordinate T>
struct CutoffRule
{
    T value;
    std::span<const T> table;
    std::size_t types = 0;
    bool sums = false;
    T greatest = 0;

    T operator()(T radius_a, std::uint32_t type_a, T radius_b, std::uint32_t type_b) const
    {
        return sums ? radius_a + radius_b : types != 0 ? table[type_a * types + type_b] : value;
    }
};

template <Coordinate T>
void check_cutoff(T value, const std::string& what, std::uint64_t index)
{
    if (!(value >= 0 && value <= std::numeric_limits<T>::max()))
        refuse_search(what + " is " + number_text(value) + "; give a length", index);
}

/// Adds what a set has to the rule, or throws.
template <int Dim, Coordinate T>
T checked_radii(const PointSet<Dim, T>& set, const CutoffRule<T>& rule)
{
    const auto lengths = [&](std::size_t size, const char* what) {
        if (size != set.points.size())
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(size) + " " + what + " for " +
                                                      std::to_string(set.points.size()) + " points" +
                                                      set_text(set.name) + "; give one for each");
    };
    T greatest = 0;
    if (rule.sums) lengths(set.radii.size(), "radii");
    for (std::size_t i = 0; rule.sums && i < set.radii.size(); ++i) {
        check_cutoff(set.radii[i], std::string("the radius of point ") + set.name + std::to_string(i), i);
        greatest = std::max(greatest, set.radii[i]);
    }
    if (rule.types != 0) lengths(set.types.size(), "types");
    for (std::size_t i = 0; rule.types != 0 && i < set.types.size(); ++i)
        if (set.types[i] >= rule.types)
            refuse_search(std::string("point ") + set.name + std::to_string(i) + " is of type " +
                              std::to_string(set.types[i]) + ", and the table has " +
                              std::to_string(rule.types) + " types",
                          i);
    return greatest;
}

template <int Dim, Coordinate T>
CutoffRule<T> check_cutoffs(const PointSet<Dim, T>& a, const PointSet<Dim, T>& b,
                            const NeighborCutoff<T>& cutoff)
{
    CutoffRule<T> rule{cutoff.value, cutoff.table};
    rule.sums = !a.radii.empty() || !b.radii.empty();
    while (rule.types * rule.types < cutoff.table.size())
        ++rule.types;
    if (rule.sums + (rule.types != 0) + (cutoff.value != 0) > 1)
        refuse_search("of cutoff, radii and table only one may be given");
    if (rule.types == 0 && (!a.types.empty() || !b.types.empty()))
        refuse_search("there are types, but no table");
    if (rule.types * rule.types != cutoff.table.size())
        throw Error(ErrorCode::size_mismatch, "a table of " + std::to_string(cutoff.table.size()) +
                                                  " cutoffs isn't square; give k * k for k types");
    check_cutoff(cutoff.value, "the cutoff", Error::no_index);
    for (std::size_t k = 0; k < cutoff.table.size(); ++k) {
        check_cutoff(cutoff.table[k], "cutoff " + std::to_string(k) + " of the table", k);
        const std::size_t mirrored = k % rule.types * rule.types + k / rule.types;
        if (cutoff.table[k] != cutoff.table[mirrored])
            refuse_search("cutoff " + std::to_string(k) + " of the table is " + number_text(cutoff.table[k]) +
                              ", and that of the same types in turn " + number_text(cutoff.table[mirrored]),
                          k);
        rule.greatest = std::max(rule.greatest, cutoff.table[k]);
    }
    const T radius_a = checked_radii(a, rule), radius_b = checked_radii(b, rule);
    rule.greatest = rule.sums ? radius_a + radius_b : std::max(rule.greatest, rule.value);
    const T square = rule.greatest * rule.greatest;
    const bool nobody = a.points.empty() || b.points.empty();
    if (!nobody && !(square >= std::numeric_limits<T>::min() && square <= std::numeric_limits<T>::max()))
        refuse_search("the greatest cutoff is " + number_text(rule.greatest) +
                      "; it must be above 0, and its square within the range of its type");
    return rule;
}

template <int Dim, Coordinate T>
void check_points(const PointSet<Dim, T>& set)
{
    if (set.points.size() > std::numeric_limits<std::uint32_t>::max())
        throw Error(ErrorCode::too_many_objects, std::to_string(set.points.size()) + " points" +
                                                     set_text(set.name) + " are more than 2^32 - 1");
    for (std::size_t i = 0; i < set.points.size(); ++i)
        for (int d = 0; d < Dim; ++d) {
            const T x = set.points[i][d];
            if (std::abs(x) <= std::numeric_limits<T>::max() / 8) continue;
            throw Error(x != x ? ErrorCode::nan_coordinate : ErrorCode::invalid_argument,
                        point_text(set.name, i, set.points[i]) +
                            (x != x
                                 ? " is NaN; every coordinate must be a number"
                                 : " is too far away; coordinates reach to an eighth of their type's range"),
                        i);
        }
}

/// How space is divided into cells of a grid: along each axis k a point has the fraction dot(reciprocal_k, x
/// - origin), in periods if the axis repeats, else in units of length along directions at right angles to
/// those that do. All of it is in double, with bounds for what rounding can do.
template <int Dim, Coordinate T>
struct NeighborGrid
{
    using Wide = Vec<Dim, double>;
    static constexpr double far = sizeof(T) == 4 ? 32768 : 1073741824; // periods

    bool repeats[detail::axes<Dim>];
    Wide vectors[detail::axes<Dim>], reciprocal[detail::axes<Dim>], origin;
    double lengths[detail::axes<Dim>], low[detail::axes<Dim>], high[detail::axes<Dim>];
    double thickness = 1; ///< the volume that unit vectors along the axes span
    double scale[detail::axes<Dim>];
    std::int64_t cells[detail::axes<Dim>], reach[detail::axes<Dim>];
    double rounding = 0; ///< by how much a distance of the definition may differ from the true one
    T near = 0;          ///< the square within which the test of wrapped points must let pass

    static Wide wide(const Vec<Dim, T>& v)
    {
        Wide out;
        for (int d = 0; d < Dim; ++d)
            out[d] = static_cast<double>(v[d]);
        return out;
    }

    void set_axes(const PeriodicCell<Dim, T>& cell)
    {
        int count = 0;
        Wide along[detail::axes<Dim>], known[detail::axes<Dim>];
        for (int k = 0; k < Dim; ++k) {
            repeats[k] = cell.repeats[k];
            vectors[k] = {};
            lengths[k] = 1;
            if (!repeats[k]) continue;
            vectors[k] = wide(cell.vectors[k]);
            along[k] = normalized(vectors[k]);
            lengths[k] = 0;
            for (int d = 0; d < Dim; ++d)
                lengths[k] = std::hypot(lengths[k], vectors[k][d]);
            if (!(lengths[k] > 0 && lengths[k] <= static_cast<double>(std::numeric_limits<T>::max()) / 8))
                refuse_search("vector " + std::to_string(k) + " of the cell has length " +
                              number_text(lengths[k]) + "; an axis that repeats needs one with a length");
            known[count++] = along[k];
        }
        for (int k = 0; k < Dim; ++k) // what doesn't repeat lies at right angles to all before
            if (!repeats[k]) {
                along[k] = perpendicular(known, count, k);
                known[count++] = along[k];
            }
        double volume;
        if constexpr (Dim == 3) {
            volume = dot(along[0], cross(along[1], along[2]));
        } else {
            volume = cross(along[0], along[1]);
        }
        thickness = std::abs(volume);
        if (!(thickness > 1e-6))
            refuse_search("the cell is flat: vectors of length 1 along its axes span " +
                          number_text(thickness) + "; axes that repeat must point in different directions");
        if constexpr (Dim == 3) {
            for (int k = 0; k < 3; ++k)
                reciprocal[k] = cross(along[(k + 1) % 3], along[(k + 2) % 3]) / volume / lengths[k];
        } else {
            reciprocal[0] = Wide{along[1][1], -along[1][0]} / volume / lengths[0];
            reciprocal[1] = Wide{-along[0][1], along[0][0]} / volume / lengths[1];
        }
    }
    /// A unit vector at right angles to the first `count`; if there are none, along axis k.
    static Wide perpendicular(const Wide* known, int count, int k)
    {
        Wide unit{};
        if (count == 0) {
            unit[k] = 1;
            return unit;
        }
        if constexpr (Dim == 3) {
            if (count == 2) return normalized(cross(known[0], known[1]));
            int least = 0;
            for (int d = 1; d < 3; ++d)
                if (std::abs(known[0][d]) < std::abs(known[0][least])) least = d;
            unit[least] = 1;
            return normalized(cross(known[0], unit));
        } else {
            return {-known[0][1], known[0][0]};
        }
    }

    double fraction(const Vec<Dim, T>& point, int k) const
    {
        return dot(reciprocal[k], wide(point) - origin);
    }

    /// Fits the grid to points, of which each set has some.
    void fit(const PointSet<Dim, T>& a, const PointSet<Dim, T>& b, double cutoff)
    {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        double spread = 0;
        for (int d = 0; d < Dim; ++d) {
            double least = infinity, most = -infinity;
            for (const auto* set : {&a, &b})
                for (const Vec<Dim, T>& point : set->points) {
                    least = std::min(least, static_cast<double>(point[d]));
                    most = std::max(most, static_cast<double>(point[d]));
                }
            origin[d] = least;
            spread += most - least;
        }
        for (int k = 0; k < Dim; ++k) {
            low[k] = infinity, high[k] = -infinity;
            for (const auto* set : {&a, &b})
                for (std::size_t i = 0; i < set->points.size(); ++i) {
                    const double f = fraction(set->points[i], k);
                    if (repeats[k] && !(std::abs(f) <= far))
                        refuse_search(point_text(set->name, i, set->points[i]) + " lies " + number_text(f) +
                                          " periods along axis " + std::to_string(k) +
                                          " from the lowest coordinates; at most " + number_text(far) +
                                          " are allowed, wrap the points",
                                      i);
                    low[k] = std::min(low[k], f);
                    high[k] = std::max(high[k], f);
                }
        }
        divide(cutoff, spread, a.points.size() + b.points.size());
    }

  private:
    void divide(double cutoff, double spread, std::size_t points)
    {
        const double eps = static_cast<double>(std::numeric_limits<T>::epsilon());
        double shifted = 0, wrapped = spread;
        for (int k = 0; k < Dim; ++k)
            if (repeats[k]) shifted += (high[k] - low[k] + cutoff * length(reciprocal[k]) + 2) * lengths[k];
        rounding = 16 * eps * (cutoff + shifted);
        const double within = cutoff + rounding;
        double reaches[detail::axes<Dim>]; // as fractions
        for (int k = 0; k < Dim; ++k) {
            const double error = std::ldexp(1, -46) / (thickness * thickness);
            reaches[k] =
                within * length(reciprocal[k]) + 2 * error * (spread / lengths[k] + (repeats[k] ? 1 : 0));
            if (!repeats[k]) continue;
            if (!(reaches[k] < static_cast<double>(most_images)))
                refuse_search("the cutoff reaches over " + number_text(reaches[k]) + " periods along axis " +
                              std::to_string(k) + ", and it may over " + std::to_string(most_images) +
                              "; put several periods into one cell");
            wrapped += (high[k] - low[k] + reaches[k] + 2) * lengths[k];
        }
        const double passing = (within + 16 * eps * (wrapped + cutoff)) * (1 + 16 * eps);
        const double square = passing * passing * (1 + 16 * eps);
        near = square < static_cast<double>(std::numeric_limits<T>::max())
                   ? static_cast<T>(square)
                   : std::numeric_limits<T>::infinity();

        // Cells of about a cutoff's edge; along the last axis, where cells follow each other in memory,
        // smaller.
        double size[detail::axes<Dim>], all = 1;
        for (int k = 0; k < Dim; ++k) {
            const double finer = k == Dim - 1 ? 4 : 1;
            scale[k] = finer / reaches[k];
            size[k] = repeats[k] ? std::max(1.0, std::floor(scale[k]))
                                 : std::min(std::floor((high[k] - low[k]) * scale[k]) + 1, 1e18);
            all *= size[k];
        }
        const double most = std::min(std::max(64.0, 2 * static_cast<double>(points)), std::ldexp(1, 31));
        while (all > most) { // sparse: no more cells than that
            int longest = 0;
            for (int k = 1; k < Dim; ++k)
                if (size[k] > size[longest]) longest = k;
            scale[longest] /= 2;
            size[longest] = std::max(1.0, std::floor(size[longest] / 2));
            all = 1;
            for (int k = 0; k < Dim; ++k)
                all *= size[k];
        }
        for (int k = 0; k < Dim; ++k) {
            cells[k] = static_cast<std::int64_t>(size[k]);
            if (repeats[k]) scale[k] = size[k];
            reach[k] = static_cast<std::int64_t>(std::min(std::ceil(reaches[k] * scale[k]), 1e15));
        }
    }
};

/// A point where the grid has it.
template <int Dim, Coordinate T>
struct GridPoint
{
    Vec<Dim, T> at;
    T radius;
    std::uint32_t type, index;
    Periods<Dim> wrapped; ///< by how many periods it lies outside of the cell
};

/// Points in the order of the grid's cells, and where each cell's begin.
template <int Dim, Coordinate T>
struct GridPoints
{
    explicit GridPoints(std::pmr::memory_resource* memory)
        : points(memory), cell(memory), starts(memory), periods(memory), x(memory), y(memory), z(memory)
    {
    }

    Buffer<GridPoint<Dim, T>> points;
    Buffer<std::uint32_t> cell, starts;
    Buffer<Periods<Dim>> periods; ///< GridPoint::wrapped, by index
    Buffer<T> x, y, z;            ///< the points, wrapped

    T* axis(int d) { return (d == 0 ? x : d == 1 ? y : z).data(); }

    void fill(const PointSet<Dim, T>& set, const NeighborGrid<Dim, T>& grid)
    {
        const std::size_t n = set.points.size();
        std::size_t cells = 1;
        for (int k = 0; k < Dim; ++k)
            cells *= static_cast<std::size_t>(grid.cells[k]);
        points.reserve(n), cell.reserve(n), periods.reserve(n), x.reserve(n), y.reserve(n);
        if (Dim == 3) z.reserve(n);
        starts.reserve(cells + 2);
        std::fill_n(starts.data(), cells + 2, 0u);
        for (std::size_t i = 0; i < n; ++i) {
            std::int64_t number = 0;
            for (int k = 0; k < Dim; ++k) {
                double f = grid.fraction(set.points[i], k);
                std::int32_t& whole = periods[i][static_cast<std::size_t>(k)];
                whole = 0;
                if (grid.repeats[k]) {
                    const double floor = std::floor(f);
                    whole = static_cast<std::int32_t>(floor);
                    f -= floor;
                } else {
                    f -= grid.low[k];
                }
                const double last = static_cast<double>(grid.cells[k] - 1);
                number = number * grid.cells[k] +
                         static_cast<std::int64_t>(std::clamp(f * grid.scale[k], 0.0, last));
            }
            cell[i] = static_cast<std::uint32_t>(number);
            ++starts[static_cast<std::size_t>(number) + 2];
        }
        for (std::size_t c = 2; c < cells + 2; ++c)
            starts[c] += starts[c - 1];
        for (std::size_t i = 0; i < n; ++i) { // starts[c + 1] goes from where c begins to where it ends
            const std::size_t to = starts[std::size_t{cell[i]} + 1]++;
            points[to] = {set.points[i], set.radii.empty() ? T(0) : set.radii[i],
                          set.types.empty() ? 0 : set.types[i], static_cast<std::uint32_t>(i), periods[i]};
            Vec<Dim, double> at = grid.wide(set.points[i]) - grid.origin;
            for (int k = 0; k < Dim; ++k)
                at -= grid.vectors[k] * static_cast<double>(periods[i][static_cast<std::size_t>(k)]);
            for (int d = 0; d < Dim; ++d)
                axis(d)[to] = static_cast<T>(at[d]);
        }
    }
    void release()
    {
        points.release(), cell.release(), starts.release(), periods.release();
        x.release(), y.release(), z.release();
    }
};

/// Points of the grid that follow each other in memory, all shifted in the same way.
template <int Dim, Coordinate T>
struct ImageRun
{
    std::size_t begin, end;
    Vec<Dim, T> by;
    Periods<Dim> image;
};

/// A neighbour as it is sorted: by index, then by image, the first axis first. Of two points in whole periods
/// of their own, shifts ascend as images do.
template <int Dim>
std::uint64_t neighbor_key(std::uint32_t index, const Periods<Dim>& image)
{
    std::uint64_t code = 0;
    for (const std::int32_t periods : image)
        code = code << image_bits | static_cast<std::uint64_t>(periods + image_bias);
    return std::uint64_t{index} << 32 | code;
}
template <int Dim>
Periods<Dim> image_of(std::uint64_t key)
{
    Periods<Dim> image;
    for (std::size_t k = detail::axes<Dim>; k-- > 0; key >>= image_bits)
        image[k] =
            static_cast<std::int32_t>(static_cast<std::int64_t>(key % (1u << image_bits)) - image_bias);
    return image;
}

/// A list in memory of its own.
template <int Dim, Coordinate T>
struct StoredNeighbors
{
    explicit StoredNeighbors(std::pmr::memory_resource* memory)
        : offsets(memory), neighbors(memory), shifts(memory), vectors(memory), distances(memory)
    {
    }

    Buffer<std::uint64_t> offsets;
    Buffer<std::uint32_t> neighbors;
    Buffer<Periods<Dim>> shifts;
    Buffer<Vec<Dim, T>> vectors;
    Buffer<T> distances;

    void release()
    {
        offsets.release(), neighbors.release(), shifts.release(), vectors.release(), distances.release();
    }
};

} // namespace

template <int Dim, Coordinate T>
struct NeighborFinder<Dim, T>::Implementation
{
    using Set = PointSet<Dim, T>;

    struct Scratch
    {
        explicit Scratch(std::pmr::memory_resource* memory) : runs(memory) {}
        std::pmr::vector<ImageRun<Dim, T>> runs;
    };
    struct Request
    {
        Set a, b;
        bool two_sets;
        CutoffRule<T> rule;
        Cell cell;
        NeighborOptions options;
    };

    explicit Implementation(const FinderOptions& given)
        : options(given),
          grid_a((check_memory(given.memory), given.memory)),
          grid_b(given.memory),
          scratch(given.memory),
          blocks(given.memory),
          counts(given.memory),
          result(given.memory),
          kept(given.memory),
          kept_points(given.memory),
          kept_radii(given.memory),
          kept_types(given.memory),
          kept_table(given.memory)
    {
        (void)checked(given.instruction_set);
    }

    FinderOptions options;
    std::atomic<bool> in_use{false};
    NeighborGrid<Dim, T> grid;
    GridPoints<Dim, T> grid_a, grid_b;                        ///< one set has the first alone
    std::pmr::vector<Scratch> scratch;                        ///< of each task
    std::pmr::vector<std::pmr::vector<std::uint64_t>> blocks; ///< what each block of rows found
    Buffer<std::uint64_t> counts;                             ///< of each row
    std::size_t most_runs = 0;                                ///< what each Scratch has room for
    StoredNeighbors<Dim, T> result, kept;
    NeighborList<Dim, T> list;

    // What is kept is for these.
    bool is_kept = false, kept_two_sets = false, kept_half = false;
    double kept_skin = 0, kept_rounding = 0;
    T kept_value = 0;
    Cell kept_cell;
    std::size_t kept_a = 0;
    std::pmr::vector<Vec<Dim, T>> kept_points; ///< of both sets, as are the next two
    std::pmr::vector<T> kept_radii;
    std::pmr::vector<std::uint32_t> kept_types;
    std::pmr::vector<T> kept_table;

    /// Calls work(scratch, block, begin, end) for each block of n rows. What it throws leaves the call.
    template <class Work>
    void each_block(std::size_t n, const Work& work)
    {
        const std::size_t count = (n + rows_per_block - 1) / rows_per_block;
        Executor& executor = options.executor != nullptr ? *options.executor : default_executor();
        const auto tasks =
            count < 4 ? 1 : static_cast<std::uint32_t>(std::min<std::size_t>(executor.concurrency(), count));
        while (scratch.size() < tasks)
            scratch.emplace_back(options.memory);
        while (blocks.size() < count)
            blocks.emplace_back();
        for (Scratch& each : scratch)
            each.runs.reserve(most_runs);
        std::atomic<std::size_t> next{0};
        std::exception_ptr thrown;
        std::mutex mutex;
        const auto task = [&](std::uint32_t number) {
            const ExactFloats exact;
            try {
                for (std::size_t block; (block = next.fetch_add(1, std::memory_order_relaxed)) < count;)
                    work(scratch[number], block, block * rows_per_block,
                         std::min(n, (block + 1) * rows_per_block));
            } catch (...) { // for want of memory alone
                next.store(count, std::memory_order_relaxed);
                const std::lock_guard lock(mutex);
                thrown = std::current_exception();
            }
        };
        if (tasks == 1) {
            task(0);
        } else {
            run_tasks(executor, tasks, task);
        }
        if (thrown) std::rethrow_exception(thrown);
    }

    /// Where the images of b's points lie that points of this cell of the grid can reach.
    void list_runs(std::uint32_t number, GridPoints<Dim, T>& b, std::pmr::vector<ImageRun<Dim, T>>& runs)
    {
        std::int64_t at[detail::axes<Dim>], other[detail::axes<Dim>];
        std::int64_t rest = number;
        for (int k = Dim - 1; k >= 0; --k) {
            at[k] = rest % grid.cells[k];
            rest /= grid.cells[k];
        }
        runs.clear();
        Periods<Dim> image{};
        const auto along = [&](const auto& self, int k) -> void {
            std::int64_t first = at[k] - grid.reach[k], last = at[k] + grid.reach[k];
            if (!grid.repeats[k])
                first = std::max<std::int64_t>(first, 0), last = std::min(last, grid.cells[k] - 1);
            for (std::int64_t c = first; c <= last; ++c) {
                const std::int64_t within = ((c % grid.cells[k]) + grid.cells[k]) % grid.cells[k];
                const std::int64_t periods = (c - within) / grid.cells[k];
                image[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(periods);
                other[k] = within;
                if (k < Dim - 1) {
                    self(self, k + 1);
                    continue;
                }
                const std::int64_t end = std::min(last, (periods + 1) * grid.cells[k] - 1);
                std::int64_t cell = 0;
                for (int d = 0; d < Dim; ++d)
                    cell = cell * grid.cells[d] + other[d];
                const std::size_t begin = b.starts[static_cast<std::size_t>(cell)];
                const std::size_t stop = b.starts[static_cast<std::size_t>(cell + end - c + 1)];
                c = end;
                if (begin == stop) continue;
                Vec<Dim, double> by{};
                for (int d = 0; d < Dim; ++d)
                    by += grid.vectors[d] * static_cast<double>(image[static_cast<std::size_t>(d)]);
                runs.push_back({begin, stop, Vec<Dim, T>(by), image});
            }
        };
        along(along, 0);
    }

    /// Appends the keys of the neighbours of a's point `row`, sorted.
    void find_row(const Request& request, const GridPoint<Dim, T>& from, std::size_t row,
                  const std::pmr::vector<ImageRun<Dim, T>>& runs, GridPoints<Dim, T>& b,
                  std::pmr::vector<std::uint64_t>& out)
    {
        constexpr std::size_t at_once = 64;
        const T skin = static_cast<T>(request.options.skin);
        const std::uint64_t itself = neighbor_key<Dim>(from.index, {});
        const std::size_t before = out.size();
        const T* const axes[] = {b.x.data(), b.y.data(), b.z.data()};
        T here[detail::axes<Dim>];
        for (int d = 0; d < Dim; ++d)
            here[d] = grid_a.axis(d)[row];
        for (const ImageRun<Dim, T>& run : runs) {
            T to[detail::axes<Dim>];
            for (int d = 0; d < Dim; ++d)
                to[d] = here[d] - run.by[d];
            for (std::size_t begin = run.begin; begin < run.end; begin += at_once) {
                const std::size_t size = std::min(at_once, run.end - begin);
                T squares[at_once];
                std::uint32_t hits[at_once];
                for (std::size_t k = 0; k < size; ++k) {
                    T square = 0;
                    for (int d = 0; d < Dim; ++d) {
                        const T apart = axes[d][begin + k] - to[d];
                        square += apart * apart;
                    }
                    squares[k] = square;
                }
                std::size_t count = 0;
                for (std::size_t k = 0; k < size; ++k) {
                    hits[count] = static_cast<std::uint32_t>(k);
                    count += squares[k] <= grid.near;
                }
                for (std::size_t k = 0; k < count; ++k) {
                    const GridPoint<Dim, T>& other = b.points[begin + hits[k]];
                    const std::uint64_t key = neighbor_key<Dim>(other.index, run.image);
                    if (!request.two_sets && (request.options.half ? key <= itself : key == itself)) continue;
                    const T cutoff = request.rule(from.radius, from.type, other.radius, other.type);
                    const T most = cutoff + skin;
                    const Vec<Dim, T> apart = vector_between(
                        from.at, other.at, shift_of(run.image, from.wrapped, other.wrapped), request.cell);
                    if (cutoff > 0 && dot(apart, apart) <= most * most) out.push_back(key);
                }
            }
        }
        std::sort(out.begin() + static_cast<std::ptrdiff_t>(before), out.end());
    }
    static Periods<Dim> shift_of(Periods<Dim> image, const Periods<Dim>& from, const Periods<Dim>& to)
    {
        for (std::size_t k = 0; k < detail::axes<Dim>; ++k)
            image[k] += from[k] - to[k];
        return image;
    }

    /// Writes what blocks have found: row_of(s) is the row of their s-th, and decode(row, found) the
    /// neighbour and its shift.
    template <class RowOf, class Decode>
    void store(const Request& request, const NeighborOptions& what, StoredNeighbors<Dim, T>& into,
               const RowOf& row_of, const Decode& decode)
    {
        const std::size_t n = request.a.points.size();
        std::uint64_t* const offsets = into.offsets.reserve(n + 1);
        std::uint64_t total = 0;
        for (std::size_t i = 0; i < n; ++i) {
            offsets[i] = total;
            total += counts[i];
        }
        offsets[n] = total;
        into.neighbors.reserve(total), into.shifts.reserve(total);
        if (what.vectors) into.vectors.reserve(total);
        if (what.distances) into.distances.reserve(total);
        each_block(n, [&](Scratch&, std::size_t block, std::size_t begin, std::size_t end) {
            const std::uint64_t* found = blocks[block].data();
            for (std::size_t s = begin; s < end; ++s) {
                const std::size_t row = row_of(s);
                for (std::uint64_t k = offsets[row]; k < offsets[row + 1]; ++k) {
                    const auto [neighbor, shift] = decode(row, *found++);
                    into.neighbors[k] = neighbor;
                    into.shifts[k] = shift;
                    if (!what.vectors && !what.distances) continue;
                    const Vec<Dim, T> apart = vector_between(request.a.points[row],
                                                             request.b.points[neighbor], shift, request.cell);
                    if (what.vectors) into.vectors[k] = apart;
                    if (what.distances) into.distances[k] = length(apart);
                }
            }
        });
    }

    void search(const Request& request, const NeighborOptions& what, StoredNeighbors<Dim, T>& into)
    {
        const std::size_t n = request.a.points.size();
        counts.reserve(n);
        if (n == 0 || request.b.points.empty()) {
            std::fill_n(counts.data(), n, std::uint64_t{0});
            return store(
                request, what, into, [](std::size_t s) { return s; },
                [](std::size_t, std::uint64_t) { return Neighbor{}; });
        }
        GridPoints<Dim, T>& b = request.two_sets ? grid_b : grid_a;
        grid_a.fill(request.a, grid);
        if (request.two_sets) grid_b.fill(request.b, grid);
        double runs = 1; // at most, unless they are very many: which task has the most is chance
        for (int k = 0; k < Dim; ++k)
            runs *= 2 * static_cast<double>(grid.reach[k]) /
                        static_cast<double>(k < Dim - 1 ? 1 : grid.cells[k]) +
                    2;
        most_runs = static_cast<std::size_t>(std::min(runs, 4096.0));
        each_block(n, [&](Scratch& own, std::size_t block, std::size_t begin, std::size_t end) {
            auto& found = blocks[block];
            found.clear();
            std::uint64_t cell = ~std::uint64_t{0};
            for (std::size_t s = begin; s < end; ++s) {
                const GridPoint<Dim, T>& from = grid_a.points[s];
                if (grid_a.cell[from.index] != cell) list_runs(grid_a.cell[from.index], b, own.runs);
                cell = grid_a.cell[from.index];
                const std::size_t before = found.size();
                find_row(request, from, s, own.runs, b, found);
                counts[from.index] = found.size() - before;
            }
        });
        store(
            request, what, into, [&](std::size_t s) { return grid_a.points[s].index; },
            [&](std::size_t row, std::uint64_t key) {
                const auto neighbor = static_cast<std::uint32_t>(key >> 32);
                return Neighbor{neighbor,
                                shift_of(image_of<Dim>(key), grid_a.periods[row], b.periods[neighbor])};
            });
    }
    struct Neighbor
    {
        std::uint32_t index;
        Periods<Dim> shift;
    };

    /// Chooses from what is kept.
    void choose(const Request& request)
    {
        const std::size_t n = request.a.points.size();
        counts.reserve(n);
        const auto of = [](const auto& values, std::size_t i) {
            using Value = std::remove_cvref_t<decltype(values[i])>;
            return values.empty() ? Value{} : values[i];
        };
        each_block(n, [&](Scratch&, std::size_t block, std::size_t begin, std::size_t end) {
            auto& found = blocks[block];
            found.clear();
            for (std::size_t i = begin; i < end; ++i) {
                const std::size_t before = found.size();
                for (std::uint64_t k = kept.offsets[i]; k < kept.offsets[i + 1]; ++k) {
                    const std::uint32_t j = kept.neighbors[k];
                    const Vec<Dim, T> apart = vector_between(request.a.points[i], request.b.points[j],
                                                             kept.shifts[k], request.cell);
                    const T cutoff = request.rule(of(request.a.radii, i), of(request.a.types, i),
                                                  of(request.b.radii, j), of(request.b.types, j));
                    if (dot(apart, apart) <= cutoff * cutoff) found.push_back(k);
                }
                counts[i] = found.size() - before;
            }
        });
        store(
            request, request.options, result, [](std::size_t i) { return i; },
            [&](std::size_t, std::uint64_t k) { return Neighbor{kept.neighbors[k], kept.shifts[k]}; });
    }

    /// Calls look(kept, given) with all that a kept list depends on, until it says false.
    template <class Look>
    bool each_input(const Request& request, const Look& look)
    {
        return look(kept_two_sets, request.two_sets) && look(kept_half, request.options.half) &&
               look(kept_skin, request.options.skin) && look(kept_value, request.rule.value) &&
               look(kept_cell, request.cell) && look(kept_a, request.a.points.size());
    }
    template <class Kept, class Get>
    static bool same_columns(const Request& request, const Kept& kept_column, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        return kept_column.size() == a.size() + b.size() &&
               std::equal(a.begin(), a.end(), kept_column.begin()) &&
               std::equal(b.begin(), b.end(), kept_column.begin() + static_cast<std::ptrdiff_t>(a.size()));
    }
    template <class Kept, class Get>
    static void keep_columns(const Request& request, Kept& kept_column, const Get& get)
    {
        const auto a = get(request.a), b = get(request.b);
        kept_column.assign(a.begin(), a.end());
        kept_column.insert(kept_column.end(), b.begin(), b.end());
    }
    static constexpr auto radii_of = [](const Set& set) { return set.radii; };
    static constexpr auto types_of = [](const Set& set) { return set.types; };

    /// Whether all who may be neighbours now are in the kept list.
    bool still_holds(const Request& request)
    {
        if (!is_kept ||
            !each_input(request, [](const auto& before, const auto& now) { return before == now; }) ||
            kept_points.size() != request.a.points.size() + request.b.points.size() ||
            !same_columns(request, kept_radii, radii_of) || !same_columns(request, kept_types, types_of) ||
            !std::equal(kept_table.begin(), kept_table.end(), request.rule.table.begin(),
                        request.rule.table.end()))
            return false;
        const double most = kept_skin / 2 * (1 - 1e-12) - 4 * kept_rounding;
        std::size_t at = 0;
        for (const Set* set : {&request.a, &request.b})
            for (const Vec<Dim, T>& point : set->points) {
                const auto moved = grid.wide(point) - grid.wide(kept_points[at++]);
                if (!(most > 0 && dot(moved, moved) <= most * most)) return false;
            }
        return true;
    }
    void keep(const Request& request)
    {
        each_input(request, [](auto& before, const auto& now) {
            before = now;
            return true;
        });
        keep_columns(request, kept_points, [](const Set& set) { return set.points; });
        keep_columns(request, kept_radii, radii_of);
        keep_columns(request, kept_types, types_of);
        kept_table.assign(request.rule.table.begin(), request.rule.table.end());
        kept_rounding = grid.rounding;
        is_kept = true;
    }

    const NeighborList<Dim, T>& find(const Set& a, const Set& b, bool two_sets,
                                     const NeighborCutoff<T>& cutoff, const Cell& cell,
                                     const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        if (!(what.skin >= 0 && what.skin <= static_cast<double>(std::numeric_limits<T>::max())))
            refuse_search("the skin is " + number_text(what.skin) + "; give a length, or 0");
        if (two_sets && what.half)
            refuse_search("half lists are for one set: of two sets each pair comes once already");
        check_points(a);
        if (two_sets) check_points(b);
        Request request{a, b, two_sets, check_cutoffs(a, b, cutoff), cell, what};
        const T most = request.rule.greatest + static_cast<T>(what.skin);
        if (!(most * most <= std::numeric_limits<T>::max()))
            refuse_search("the skin is " + number_text(what.skin) + ": its sum with the cutoff is too great");
        const bool somebody = !a.points.empty() && !b.points.empty();
        NeighborGrid<Dim, T> fresh;
        fresh.set_axes(cell);
        const bool holds = what.skin > 0 && still_holds(request);
        if (!holds && somebody) fresh.fit(a, b, static_cast<double>(most));
        list = {}; // from here on only want of memory ends the call
        if (!holds) {
            grid = fresh;
            is_kept = false;
            search(request, what.skin > 0 ? NeighborOptions{} : what, what.skin > 0 ? kept : result);
            if (what.skin > 0) keep(request);
        }
        if (what.skin > 0) choose(request);
        const std::size_t n = a.points.size(), total = result.offsets[n];
        list.offsets = {result.offsets.data(), n + 1};
        list.neighbors = {result.neighbors.data(), total};
        list.shifts = {result.shifts.data(), total};
        if (what.vectors) list.vectors = {result.vectors.data(), total};
        if (what.distances) list.distances = {result.distances.data(), total};
        list.searched = !holds;
        return list;
    }

    void release()
    {
        grid_a.release(), grid_b.release(), counts.release(), result.release(), kept.release();
        const auto empty = [this](auto& vector) {
            vector = std::remove_reference_t<decltype(vector)>(options.memory);
        };
        empty(scratch), empty(blocks), empty(kept_points), empty(kept_radii), empty(kept_types),
            empty(kept_table);
        list = {};
        is_kept = false;
    }
};

template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::NeighborFinder(const FinderOptions& options)
    : implementation_(std::make_unique<Implementation>(options))
{
}
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::NeighborFinder(NeighborFinder&&) noexcept = default;
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>& NeighborFinder<Dim, T>::operator=(NeighborFinder&&) noexcept = default;
template <int Dim, Coordinate T>
NeighborFinder<Dim, T>::~NeighborFinder() = default;

template <int Dim, Coordinate T>
const NeighborList<Dim, T>& NeighborFinder<Dim, T>::find(Points points, const NeighborCutoff<T>& cutoff,
                                                         const Cell& cell, const NeighborOptions& options)
{
    if (!cutoff.radii_b.empty() || !cutoff.types_b.empty())
        refuse_search("there are radii or types of a second set, and there is one set");
    const PointSet<Dim, T> set{points, cutoff.radii, cutoff.types, ""};
    return implementation_->find(set, set, false, cutoff, cell, options);
}

template <int Dim, Coordinate T>
const NeighborList<Dim, T>& NeighborFinder<Dim, T>::find(Points points, Points others,
                                                         const NeighborCutoff<T>& cutoff, const Cell& cell,
                                                         const NeighborOptions& options)
{
    return implementation_->find({points, cutoff.radii, cutoff.types, "a "},
                                 {others, cutoff.radii_b, cutoff.types_b, "b "}, true, cutoff, cell, options);
}

template <int Dim, Coordinate T>
void NeighborFinder<Dim, T>::release_memory() noexcept
{
    implementation_->release();
}

#define JOSTLE_INSTANTIATE(Dim, T) template class JOSTLE_API NeighborFinder<Dim, T>;
JOSTLE_FOR_EACH_SPACE(JOSTLE_INSTANTIATE)
#undef JOSTLE_INSTANTIATE

JOSTLE_NAMESPACE_END
