// SPDX-License-Identifier: MIT
// Neighbour lists: points in the cells of a grid along the reciprocal axes of periodic space. The candidates
// of all rows of a cell are collected once, in the order in which rows list them. A test of wrapped points,
// with bounds for rounding, finds those that are near; where it can't decide, the definition's test does.
#include "jostle/neighbors.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>
#include <memory_resource>
#include <new>
#include <span>
#include <utility>
#include <vector>

#include "base/buffer.hpp"
#include "base/checks.hpp"
#include "base/exact_floats.hpp"
#include "base/in_use.hpp"
#include "base/instantiate.hpp"
#include "base/radix.hpp"
#include "jostle/executor.hpp"
#include "jostle/process.hpp"
#include "neighbors/grid.hpp"
#include "neighbors/kernels/neighbors.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace neighbors {
namespace {

constexpr std::size_t rows_per_block = 128; // of work; up to three blocks are done by the calling thread
constexpr std::size_t systems_per_block = 16;

/// Points of the grid that follow each other in memory, all shifted in the same way, and the square of the
/// distance within which they may be neighbours.
template <int Dim, Coordinate T>
struct ImageRun
{
    std::size_t begin, end;
    Vec<Dim, T> by;
    T near;
    std::uint32_t code; ///< of the image
};

/// A task's working memory: the points that the rows of one cell may have as neighbours.
template <class T>
struct Surroundings
{
    explicit Surroundings(std::pmr::memory_resource* memory)
        : selected(memory),
          run(memory),
          sorted(memory),
          spare(memory),
          place(memory),
          index(memory),
          image(memory),
          x(memory),
          y(memory),
          z(memory),
          radius(memory),
          unsure(memory)
    {
    }

    Buffer<std::uint32_t> selected, run; ///< places in the grid, in the order of runs, and which run
    Buffer<std::uint64_t> sorted, spare; ///< index, and which of the selected
    // Sorted by index, then by image:
    Buffer<std::uint32_t> place, index, image;
    Buffer<T> x, y, z, radius;
    Buffer<UnsureNeighbor> unsure;
    std::size_t room = 0;

    void reserve(std::size_t count)
    {
        room = std::max(room, count);
        count = room + neighbor_padding;
        selected.reserve(count), run.reserve(count), sorted.reserve(count), spare.reserve(count),
            place.reserve(count);
        index.reserve(count), image.reserve(count), x.reserve(count), y.reserve(count), z.reserve(count);
        radius.reserve(count), unsure.reserve(count);
    }
    T* axis(int d) { return (d == 0 ? x : d == 1 ? y : z).data(); }
};

/// Rows that are worked on together: those of the points from `first` on, in the order of the grid.
struct RowRange
{
    std::size_t first, count;
    const std::uint32_t* places; ///< in the grid; null where all rows are, in whose order they then are

    std::size_t place(std::size_t s) const { return places == nullptr ? s : places[s]; }
};

/// What a block of rows has found, row after row.
struct BlockFound
{
    explicit BlockFound(std::pmr::memory_resource* memory) : index(memory), image(memory) {}
    Buffer<std::uint32_t> index, image;
    std::size_t count = 0;
};

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
} // namespace neighbors

template <int Dim, Coordinate T>
struct NeighborFinder<Dim, T>::Implementation
{
    using Set = neighbors::PointSet<Dim, T>;

    struct Scratch
    {
        explicit Scratch(std::pmr::memory_resource* memory)
            : runs(memory), around(memory), chosen(memory), unsure(memory)
        {
        }
        std::pmr::vector<neighbors::ImageRun<Dim, T>> runs;
        neighbors::Surroundings<T> around;
        std::array<std::uint32_t, neighbors::rows_per_block> itself{}; ///< where each row is in `around`
        Buffer<std::uint32_t> chosen, unsure; ///< of a kept row: a bit for each neighbour, and places
    };
    struct Request
    {
        Set a, b;
        bool two_sets;
        neighbors::CutoffRule<T> rule;
        Cell cell;
        NeighborOptions options;
        neighbors::ShiftedVectors<Dim, T> vectors;

        /// How far to look.
        T reach() const { return rule.greatest + static_cast<T>(options.skin); }
        T reach_of(T radius, T other) const
        {
            return rule.greatest_of(radius, other) + static_cast<T>(options.skin);
        }
        bool somebody() const { return !a.points.empty() && !b.points.empty(); }
    };

    explicit Implementation(const FinderOptions& given)
        : options(given),
          kernels(&neighbors::kernels_for<Dim, T>(checked(given.instruction_set))),
          grid_a((check_memory(given.memory), given.memory)),
          grid_b(given.memory),
          scratch(given.memory),
          blocks(given.memory),
          counts(given.memory),
          places(given.memory),
          next_place(given.memory),
          result(given.memory),
          kept(given.memory),
          in_system(given.memory),
          of_systems(given.memory),
          kept_points(given.memory),
          kept_radii(given.memory),
          kept_types(given.memory),
          kept_table(given.memory)
    {
    }

    FinderOptions options;
    const neighbors::NeighborKernels<Dim, T>* kernels;
    std::atomic<bool> in_use{false};
    neighbors::NeighborGrid<Dim, T> grid;
    neighbors::GridPoints<Dim, T> grid_a, grid_b; ///< one set has the first alone
    int image_bits = neighbors::any_bits;         ///< of codes
    std::pmr::vector<Scratch> scratch;            ///< of each task
    std::pmr::vector<neighbors::BlockFound> blocks;
    Buffer<std::uint64_t> counts;                ///< of each row
    Buffer<std::uint32_t> places, next_place;    ///< of a stream: of each of its ranges of rows
    std::size_t most_runs = 0, longest_kept = 0; ///< what each Scratch has room for
    neighbors::StoredNeighbors<Dim, T> result, kept;
    NeighborList<Dim, T> list;

    std::pmr::vector<std::unique_ptr<Implementation>>
        in_system; ///< of each task, where there are many systems
    std::pmr::vector<neighbors::StoredNeighbors<Dim, T>> of_systems; ///< what each block of systems found

    // What is kept is for these.
    bool is_kept = false, kept_two_sets = false, kept_half = false, kept_greater = false;
    double kept_skin = 0, kept_rounding = 0;
    double kept_moved = 0; ///< how far any point has since the search, at most
    T kept_value = 0;
    Cell kept_cell;
    std::size_t kept_a = 0;
    std::pmr::vector<Vec<Dim, T>> kept_points; ///< of both sets, as are the next two
    std::pmr::vector<T> kept_radii;
    std::pmr::vector<std::uint32_t> kept_types;
    std::pmr::vector<T> kept_table;

    /// Calls body(scratch, block, begin, end) for each block of n rows.
    template <class Body>
    void each_block(std::size_t n, const Body& body)
    {
        const bool few = n <= 3 * neighbors::rows_per_block;
        const ProcessOptions by{few ? &serial_executor() : options.executor, neighbors::rows_per_block};
        const WorkPlan plan = plan_work(n, by);
        while (scratch.size() < plan.slots)
            scratch.emplace_back(options.memory);
        while (blocks.size() < plan.blocks)
            blocks.emplace_back(options.memory);
        std::size_t most_around = 0; // so far: which task has the most is chance
        for (const Scratch& each : scratch)
            most_around = std::max(most_around, each.around.room);
        for (Scratch& each : scratch) {
            each.runs.reserve(most_runs);
            each.chosen.reserve(longest_kept / 32 + 1);
            each.unsure.reserve(longest_kept + neighbors::neighbor_padding);
            each.around.reserve(most_around);
        }
        const auto run_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            const ExactFloats exact; // on this thread
            body(scratch[work.slot], work.block, static_cast<std::size_t>(begin),
                 static_cast<std::size_t>(end));
        };
        process_items(n, run_block, by);
    }

    /// On each level, a box of cells: those with images of b's points that points of this cell with radii of
    /// at most `radius` can reach.
    void list_runs(const Request& request, std::uint32_t number, T radius, neighbors::GridPoints<Dim, T>& b,
                   std::pmr::vector<neighbors::ImageRun<Dim, T>>& runs)
    {
        const neighbors::GridLevel<Dim, T>& own = grid.level_of_cell(number);
        double low[detail::axes<Dim>], high[detail::axes<Dim>]; // of the cell
        std::size_t rest = number - own.begin;
        for (int k = Dim - 1; k >= 0; --k) {
            const auto cells = static_cast<std::size_t>(own.cells[k]);
            const double at = static_cast<double>(rest % cells);
            rest /= cells;
            low[k] = at / own.scale[k];
            high[k] = (at + 1) / own.scale[k];
            if (!grid.repeats[k] && at + 1 == static_cast<double>(cells)) // and all behind it
                high[k] = std::numeric_limits<double>::infinity();
        }
        runs.clear();
        for (int level = 0; level < grid.level_count; ++level) {
            const neighbors::GridLevel<Dim, T>& other = grid.levels[level];
            const double cutoff = static_cast<double>(request.reach_of(radius, other.radius));
            const T near = grid.near_of(cutoff);
            std::int64_t first[detail::axes<Dim>], last[detail::axes<Dim>], within[detail::axes<Dim>];
            for (int k = 0; k < Dim; ++k) {
                const double reach = grid.reach(cutoff, k);
                double from = std::floor((low[k] - reach) * other.scale[k]),
                       to = std::floor((high[k] + reach) * other.scale[k]);
                if (!grid.repeats[k]) {
                    const double end = static_cast<double>(other.cells[k] - 1);
                    from = std::clamp(from, 0.0, end), to = std::clamp(to, 0.0, end);
                }
                first[k] = static_cast<std::int64_t>(from), last[k] = static_cast<std::int64_t>(to);
            }
            neighbors::Periods<Dim> image{};
            const auto along = [&](const auto& self, int k) -> void {
                const std::int64_t cells = other.cells[k];
                for (std::int64_t c = first[k]; c <= last[k]; ++c) {
                    within[k] = ((c % cells) + cells) % cells;
                    const std::int64_t periods = (c - within[k]) / cells;
                    image[static_cast<std::size_t>(k)] = static_cast<std::int32_t>(periods);
                    if (k < Dim - 1) {
                        self(self, k + 1);
                        continue;
                    }
                    const std::int64_t end = std::min(last[k], (periods + 1) * cells - 1);
                    std::int64_t cell = 0;
                    for (int d = 0; d < Dim; ++d)
                        cell = cell * other.cells[d] + within[d];
                    const std::size_t at = other.begin + static_cast<std::size_t>(cell), begin = b.starts[at],
                                      stop = b.starts[at + static_cast<std::size_t>(end - c) + 1];
                    c = end;
                    if (begin == stop) continue;
                    Vec<Dim, double> by{};
                    for (int d = 0; d < Dim; ++d)
                        by += grid.vectors[d] * static_cast<double>(image[static_cast<std::size_t>(d)]);
                    runs.push_back(
                        {begin, stop, Vec<Dim, T>(by), near, neighbors::code_of<Dim>(image, image_bits)});
                }
            };
            along(along, 0);
        }
    }
    /// How many of them there are for any cell, at most.
    double most_runs_of(const Request& request) const
    {
        double most = 0;
        for (int level = 0; level < grid.level_count; ++level) {
            double all = 0;
            for (int other = 0; other < grid.level_count; ++other) {
                double runs = 1;
                for (int k = 0; k < Dim; ++k) {
                    const double reach =
                        grid.reach(static_cast<double>(request.reach_of(grid.levels[level].radius,
                                                                        grid.levels[other].radius)),
                                   k);
                    const double across = 2 * reach + 1 / grid.levels[level].scale[k];
                    runs *= (k < Dim - 1       ? across * grid.levels[other].scale[k]
                             : grid.repeats[k] ? across
                                               : 0) +
                            2;
                }
                all += runs;
            }
            most = std::max(most, all);
        }
        return most;
    }

    /// Rows are worked on in groups: those of a cell, or of rows_per_block places in it. This is where the
    /// group of a place begins.
    std::size_t group_of(std::size_t place)
    {
        const std::size_t begin = grid_a.starts[grid_a.cell[grid_a.index[place]]], before = place - begin;
        return place - before % neighbors::rows_per_block;
    }
    /// A block has the groups that begin in it. This is the first row, of these at or behind the s-th, with
    /// which a group begins.
    std::size_t group_from(const neighbors::RowRange& rows, std::size_t s)
    {
        if (s == 0 || s >= rows.count) return s;
        const std::size_t group = group_of(rows.place(s - 1));
        while (s < rows.count && group_of(rows.place(s)) == group)
            ++s;
        return s;
    }

    /// Collects the candidates of the points of a from `begin` to `end` - 1, which are in this cell.
    neighbors::NearbyColumns<T> surround(const Request& request, std::uint32_t cell, std::size_t begin,
                                         std::size_t end, bool with_images, neighbors::GridPoints<Dim, T>& b,
                                         Scratch& own)
    {
        neighbors::Extent<Dim, T> box;
        T radius = 0; // the greatest
        for (std::size_t place = begin; place < end; ++place)
            radius = std::max(radius, grid_a.points[place].radius);
        for (int d = 0; d < Dim; ++d) {
            const auto [lo, hi] = std::minmax_element(grid_a.axis(d) + begin, grid_a.axis(d) + end);
            box.lo[d] = *lo, box.hi[d] = *hi;
        }
        list_runs(request, cell, radius, b, own.runs);
        std::size_t most = 0;
        for (const neighbors::ImageRun<Dim, T>& run : own.runs)
            most += run.end - run.begin;
        if (most > std::numeric_limits<std::uint32_t>::max() / 2) throw std::bad_alloc();
        neighbors::Surroundings<T>& around = own.around;
        around.reserve(most);
        std::size_t count = 0;
        const T* const axes[3] = {b.x.data(), b.y.data(), b.z.data()};
        std::uint64_t* sorted = around.sorted.data();
        for (const neighbors::ImageRun<Dim, T>& run : own.runs) {
            const std::size_t before = count;
            std::uint32_t* const selected = around.selected.data();
            count += kernels->select(axes, run.begin, run.end, run.by, box, run.near, selected + count);
            std::fill(around.run.data() + before, around.run.data() + count,
                      static_cast<std::uint32_t>(&run - own.runs.data()));
            for (std::size_t k = before; k < count; ++k)
                sorted[k] = std::uint64_t{b.index[selected[k]]} << 32 | k;
        }
        // Images of one point keep their order, which is that of their shifts.
        const auto bits = static_cast<int>(std::bit_width(b.count - 1)), passes = (bits + 7) / 8;
        sorted = radix_sort<8, 2>(
            sorted, around.spare.data(), static_cast<std::uint32_t>(count), [](std::uint64_t v) { return v; },
            ((std::uint64_t{1} << bits) - 1) << 32, std::max(1, (bits + passes - 1) / std::max(passes, 1)));
        const std::uint32_t here = neighbors::code_of<Dim>({}, image_bits);
        for (std::size_t k = 0; k < count; ++k) {
            const auto chosen = static_cast<std::uint32_t>(sorted[k]);
            const std::uint32_t place = around.selected[chosen];
            const neighbors::ImageRun<Dim, T>& run = own.runs[around.run[chosen]];
            around.index[k] = static_cast<std::uint32_t>(sorted[k] >> 32);
            around.place[k] = place;
            for (int d = 0; d < Dim; ++d)
                around.axis(d)[k] = axes[d][place] + run.by[d];
            around.image[k] = run.code;
            if (request.rule.of_radii) around.radius[k] = b.radius[place];
            if (!request.two_sets && place - begin < end - begin && run.code == here)
                own.itself[place - begin] = static_cast<std::uint32_t>(k);
        }
        for (int d = 0; d < Dim; ++d)
            std::fill_n(around.axis(d) + count, neighbors::neighbor_padding,
                        std::numeric_limits<T>::quiet_NaN());
        if (request.rule.of_radii)
            std::fill_n(around.radius.data() + count, neighbors::neighbor_padding, T(0));
        return {{around.x.data(), around.y.data(), around.z.data()},
                around.index.data(),
                with_images ? around.image.data() : nullptr,
                request.rule.of_radii ? around.radius.data() : nullptr,
                count};
    }

    /// Adds the neighbours of a's point `row` to what its block has found.
    void find_row(const Request& request, std::size_t row, std::uint32_t itself,
                  const neighbors::NearbyColumns<T>& columns, neighbors::GridPoints<Dim, T>& b, Scratch& own,
                  neighbors::BlockFound& block)
    {
        const std::size_t room = block.count + columns.count + neighbors::neighbor_padding;
        neighbors::RowFound found{block.index.grow(room, block.count) + block.count, nullptr,
                                  own.around.unsure.data(), 0, 0};
        if (columns.image != nullptr) found.image = block.image.grow(room, block.count) + block.count;
        Vec<Dim, T> here;
        for (int d = 0; d < Dim; ++d)
            here[d] = grid_a.axis(d)[row];
        const T radius = grid_a.points[row].radius;
        const neighbors::RowCutoff<T> cutoff{request.rule.types == 0 ? grid.sure : T(-1),
                                             grid.near_of(static_cast<double>(request.reach())),
                                             radius,
                                             static_cast<T>(request.options.skin),
                                             grid.slack_of_radii,
                                             request.rule.greater,
                                             radius > 0}; // two radii of 0: none is near
        if (request.two_sets) {
            kernels->find_row(columns, 0, here, cutoff, found);
        } else if (request.options.half) {
            kernels->find_row(columns, itself + 1, here, cutoff, found);
        } else { // meanwhile the point itself is near none
            T& x = columns.at[0][itself];
            const T before = std::exchange(x, std::numeric_limits<T>::quiet_NaN());
            kernels->find_row(columns, 0, here, cutoff, found);
            x = before;
        }
        // Closes the gaps of those that the definition rejects.
        const neighbors::GridPoint<Dim, T>& from = grid_a.points[row];
        const T skin = static_cast<T>(request.options.skin);
        std::size_t to = 0, next = 0;
        const auto keep_until = [&](std::size_t end) {
            if (to != next) {
                std::copy(found.index + next, found.index + end, found.index + to);
                if (found.image != nullptr)
                    std::copy(found.image + next, found.image + end, found.image + to);
            }
            to += end - next;
        };
        for (std::size_t k = 0; k < found.unsure_count; ++k) {
            const neighbors::UnsureNeighbor& each = found.unsure[k];
            const neighbors::GridPoint<Dim, T>& other = b.points[own.around.place[each.nearby]];
            const T own_cutoff = request.rule(from.radius, from.type, other.radius, other.type);
            const T most = own_cutoff + skin;
            const auto image = neighbors::image_of<Dim>(own.around.image[each.nearby], image_bits);
            const Vec<Dim, T> apart =
                request.vectors.between(from.at, other.at, shift_of(image, from.wrapped, other.wrapped));
            if (own_cutoff > 0 && dot(apart, apart) <= most * most) continue;
            keep_until(each.found);
            next = each.found + 1;
        }
        keep_until(found.count);
        block.count += to;
    }
    static neighbors::Periods<Dim> shift_of(neighbors::Periods<Dim> image,
                                            const neighbors::Periods<Dim>& from,
                                            const neighbors::Periods<Dim>& to)
    {
        for (std::size_t k = 0; k < detail::axes<Dim>; ++k)
            image[k] += from[k] - to[k];
        return image;
    }

    /// Writes what blocks have found, in the order of the grid or of the rows. write(block, at, row, first,
    /// count) writes all of a row but distances: its neighbours begin at `at` of the block's.
    template <class Write>
    void store(const Request& request, const neighbors::RowRange& rows, const NeighborOptions& what,
               neighbors::StoredNeighbors<Dim, T>& into, bool in_grid, const Write& write)
    {
        const std::size_t n = rows.count;
        std::uint64_t* const offsets = into.offsets.reserve(n + 1);
        offsets[n] = exclusive_sum(std::copy_n(counts.data(), n, offsets) - n, n);
        const std::uint64_t total = offsets[n];
        into.neighbors.reserve(total + neighbors::neighbor_padding);
        if (needs_shifts(what)) into.shifts.reserve(total);
        if (what.vectors) into.vectors.reserve(total);
        if (what.distances) into.distances.reserve(total + neighbors::neighbor_padding);
        each_block(n, [&](Scratch&, std::size_t block, std::size_t begin, std::size_t end) {
            std::size_t at = 0;
            if (in_grid) begin = group_from(rows, begin), end = group_from(rows, end);
            for (std::size_t s = begin; s < end; ++s) {
                const std::size_t row = in_grid ? grid_a.index[rows.place(s)] : rows.first + s,
                                  first = offsets[row - rows.first],
                                  count = offsets[row - rows.first + 1] - first;
                write(blocks[block], at, row, first, count);
                at += count;
                if (!what.distances) continue;
                for (std::size_t k = first; k < first + count; ++k) {
                    const Vec<Dim, T> apart =
                        what.vectors ? into.vectors[k] : vector_of(request, row, into, k);
                    into.distances[k] = length(apart);
                }
            }
        });
    }
    static Vec<Dim, T> vector_of(const Request& request, std::size_t row,
                                 neighbors::StoredNeighbors<Dim, T>& into, std::size_t k)
    {
        return request.vectors.between(request.a.points[row], request.b.points[into.neighbors[k]],
                                       into.shifts[k]);
    }
    static bool needs_shifts(const NeighborOptions& what)
    {
        return what.shifts || what.vectors || what.distances;
    }

    /// Puts the points into the grid, if each set has some.
    void fill_grid(const Request& request)
    {
        if (!request.somebody()) return;
        image_bits = neighbors::near_bits;
        for (int k = 0; k < Dim; ++k)
            if (grid.repeats[k] && !(grid.reach(static_cast<double>(request.reach()), k) < 1))
                image_bits = neighbors::any_bits;
        const auto in_cell = [&](std::size_t c) {
            return grid_a.in_cell(c) + (request.two_sets ? grid_b.in_cell(c) : 0);
        };
        do {
            grid_a.number(request.a, grid);
            if (request.two_sets) grid_b.number(request.b, grid);
        } while (grid.refine(in_cell));
        grid_a.fill(request.a, grid);
        if (request.two_sets) grid_b.fill(request.b, grid);
    }

    void search(const Request& request, const neighbors::RowRange& rows, const NeighborOptions& what,
                neighbors::StoredNeighbors<Dim, T>& into)
    {
        const std::size_t n = rows.count;
        counts.reserve(n);
        if (!request.somebody()) {
            std::fill_n(counts.data(), n, std::uint64_t{0});
            return store(
                request, rows, what, into, false,
                [](const neighbors::BlockFound&, std::size_t, std::size_t, std::size_t, std::size_t) {});
        }
        neighbors::GridPoints<Dim, T>& b = request.two_sets ? grid_b : grid_a;
        const bool any_repeats = std::any_of(grid.repeats, grid.repeats + Dim, [](bool is) { return is; });
        // Unless they are very many: which task has the most is chance.
        most_runs = static_cast<std::size_t>(std::min(most_runs_of(request), 4096.0));
        const bool shifts = needs_shifts(what), with_images = shifts && any_repeats;
        each_block(n, [&](Scratch& own, std::size_t block, std::size_t begin, std::size_t end) {
            neighbors::BlockFound& found = blocks[block];
            found.count = 0;
            end = group_from(rows, end);
            for (std::size_t s = group_from(rows, begin); s < end;) {
                const std::size_t last = group_from(rows, s + 1), first = rows.place(s);
                const std::uint32_t cell = grid_a.cell[grid_a.index[first]];
                const auto columns =
                    surround(request, cell, first, rows.place(last - 1) + 1, with_images, b, own);
                for (; s < last; ++s) {
                    const std::size_t before = found.count, place = rows.place(s);
                    find_row(request, place, own.itself[place - first], columns, b, own, found);
                    counts[grid_a.index[place] - rows.first] = found.count - before;
                }
            }
        });
        const bool any_wrapped = grid_a.any_wrapped || b.any_wrapped;
        const Vec<Dim, T>* const points = request.b.points.data();
        const std::uint32_t here = neighbors::code_of<Dim>({}, image_bits);
        store(request, rows, what, into, true,
              [&](neighbors::BlockFound& found, std::size_t at, std::size_t row, std::size_t first,
                  std::size_t count) {
                  std::copy_n(found.index.data() + at, count, into.neighbors.data() + first);
                  if (!shifts) return;
                  const std::uint32_t* const neighbor = into.neighbors.data() + first;
                  neighbors::Periods<Dim>* const to = into.shifts.data() + first;
                  Vec<Dim, T>* const vectors = what.vectors ? into.vectors.data() + first : nullptr;
                  const Vec<Dim, T> from = request.a.points[row];
                  const auto code = [&](std::size_t k) { return with_images ? found.image[at + k] : here; };
                  if (!any_wrapped && image_bits == neighbors::near_bits) {
                      for (std::size_t k = 0; k < count; ++k) {
                          const auto& near = request.vectors.near(code(k));
                          to[k] = near.shift;
                          if (vectors != nullptr)
                              vectors[k] = request.vectors.between(from, points[neighbor[k]], near.sum);
                      }
                      return;
                  }
                  for (std::size_t k = 0; k < count; ++k) {
                      to[k] = shift_of(neighbors::image_of<Dim>(code(k), image_bits), grid_a.periods[row],
                                       b.periods[neighbor[k]]);
                      if (vectors != nullptr) vectors[k] = vector_of(request, row, into, first + k);
                  }
              });
    }

    /// Selects from the kept list. How far points have moved since decides most of it; the definition decides
    /// the rest.
    void choose(const Request& request)
    {
        const std::size_t n = request.a.points.size();
        counts.reserve(n);
        const auto of = [](const auto& values, std::size_t i) {
            using Value = std::remove_cvref_t<decltype(values[i])>;
            return values.empty() ? Value{} : values[i];
        };
        const bool one_cutoff = request.rule.types == 0 && !request.rule.of_radii;
        const bool shifts = needs_shifts(request.options);
        each_block(n, [&](Scratch& own, std::size_t block, std::size_t begin, std::size_t end) {
            neighbors::BlockFound& into = blocks[block];
            into.count = 0;
            const std::size_t room = kept.offsets[end] - kept.offsets[begin] + neighbors::neighbor_padding;
            into.index.reserve(room);
            if (shifts) into.image.reserve(room);
            for (std::size_t i = begin; i < end; ++i) {
                const std::uint64_t first = kept.offsets[i];
                const std::size_t count = kept.offsets[i + 1] - first;
                const Vec<Dim, T> from = request.a.points[i];
                const double moved = length(grid.wide(from) - grid.wide(kept_points[i])) + kept_moved,
                             by = moved * (1 + 1e-12) + 4 * kept_rounding;
                const T sure = one_cutoff ? static_cast<T>(request.rule.value - by) : T(-1),
                        near = one_cutoff ? static_cast<T>(request.rule.value + by)
                                          : std::numeric_limits<T>::infinity();
                std::uint32_t* const chosen = own.chosen.data();
                const std::size_t unsure = kernels->tell_apart(kept.distances.data() + first, count, sure,
                                                               near, chosen, own.unsure.data());
                for (std::size_t u = 0; u < unsure; ++u) { // without a branch that depends on what is near
                    const std::uint32_t k = own.unsure[u], j = kept.neighbors[first + k];
                    const Vec<Dim, T> apart =
                        request.vectors.between(from, request.b.points[j], kept.shifts[first + k]);
                    const T cutoff = request.rule(of(request.a.radii, i), of(request.a.types, i),
                                                  of(request.b.radii, j), of(request.b.types, j));
                    const bool is_far = !(dot(apart, apart) <= cutoff * cutoff);
                    chosen[k / 32] ^= std::uint32_t{is_far} << k % 32;
                }
                counts[i] = kernels->take_chosen(kept.neighbors.data() + first, count, chosen,
                                                 into.index.data() + into.count,
                                                 shifts ? into.image.data() + into.count : nullptr);
                into.count += counts[i];
            }
        });
        store(request, {0, n, nullptr}, request.options, result, false,
              [&](neighbors::BlockFound& found, std::size_t at, std::size_t row, std::size_t first,
                  std::size_t count) {
                  std::copy_n(found.index.data() + at, count, result.neighbors.data() + first);
                  for (std::size_t k = 0; shifts && k < count; ++k) {
                      result.shifts[first + k] = kept.shifts[kept.offsets[row] + found.image[at + k]];
                      if (request.options.vectors)
                          result.vectors[first + k] = vector_of(request, row, result, first + k);
                  }
              });
    }

    /// Calls look(kept, given) with all that a kept list depends on, until it says false.
    template <class Look>
    bool each_input(const Request& request, const Look& look)
    {
        return look(kept_two_sets, request.two_sets) && look(kept_half, request.options.half) &&
               look(kept_skin, request.options.skin) && look(kept_value, request.rule.value) &&
               look(kept_greater, request.rule.greater) && look(kept_cell, request.cell) &&
               look(kept_a, request.a.points.size());
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

    /// Whether the kept list has all that may be neighbours now.
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
        if (!(most > 0)) return false;
        double furthest = 0;
        std::size_t at = 0;
        for (const Set* set : {&request.a, &request.b})
            for (const Vec<Dim, T>& point : set->points) {
                const auto moved = grid.wide(point) - grid.wide(kept_points[at++]);
                furthest = std::max(furthest, dot(moved, moved));
                if (!(furthest <= most * most)) return false;
            }
        kept_moved = std::sqrt(furthest);
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
        kept_moved = 0;
        longest_kept = 0;
        for (std::size_t i = 0; i < request.a.points.size(); ++i)
            longest_kept = std::max<std::size_t>(longest_kept, kept.offsets[i + 1] - kept.offsets[i]);
        is_kept = true;
    }

    static Request checked_request(const Set& a, const Set& b, bool two_sets, const NeighborCutoff<T>& cutoff,
                                   const Cell& cell, const NeighborOptions& what)
    {
        if (!(what.skin >= 0 && what.skin <= static_cast<double>(std::numeric_limits<T>::max())))
            neighbors::refuse_search("the skin is " + number_text(what.skin) + "; give a length, or 0");
        if (two_sets && what.half)
            neighbors::refuse_search("half lists are for one set: of two sets each pair comes once already");
        neighbors::check_points(a);
        if (two_sets) neighbors::check_points(b);
        Request request{a,
                        b,
                        two_sets,
                        neighbors::check_cutoffs(a, b, cutoff),
                        cell,
                        what,
                        neighbors::ShiftedVectors<Dim, T>(cell)};
        const T most = request.reach();
        if (!(most * most <= std::numeric_limits<T>::max()))
            neighbors::refuse_search("the skin is " + number_text(what.skin) +
                                     ": its sum with the cutoff is too great");
        return request;
    }
    static neighbors::NeighborGrid<Dim, T> fitted_grid(const Request& request)
    {
        neighbors::NeighborGrid<Dim, T> fitted;
        fitted.set_axes(request.cell);
        const Set* const sets[] = {&request.a, &request.b};
        if (request.somebody())
            fitted.fit(std::span(sets).first(request.two_sets ? 2 : 1), request.rule,
                       static_cast<T>(request.options.skin));
        return fitted;
    }

    const NeighborList<Dim, T>& find(const Set& a, const Set& b, bool two_sets,
                                     const NeighborCutoff<T>& cutoff, const Cell& cell,
                                     const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        const Request request = checked_request(a, b, two_sets, cutoff, cell, what);
        const neighbors::RowRange all{0, a.points.size(), nullptr};
        const bool holds = what.skin > 0 && still_holds(request);
        if (!holds) {
            grid = fitted_grid(request);
            list = {}; // from here on only a lack of memory ends the call
            is_kept = false;
            fill_grid(request);
            constexpr NeighborOptions to_keep{.shifts = true, .distances = true};
            search(request, all, what.skin > 0 ? to_keep : what, what.skin > 0 ? kept : result);
            if (what.skin > 0) keep(request);
        }
        list = {};
        if (what.skin > 0) choose(request);
        return show(all.count, what, !holds);
    }

    bool stream(const Set& a, const Set& b, bool two_sets, const NeighborCutoff<T>& cutoff, std::size_t rows,
                Sink sink, const Cell& cell, const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        const ExactFloats exact;
        if (!sink) neighbors::refuse_search("no sink to stream to; find() lists all");
        if (rows == 0) neighbors::refuse_search("a stream in blocks of 0 rows never ends; give 1 or more");
        if (what.skin != 0)
            neighbors::refuse_search("a skin is for lists that are kept, and a stream keeps none");
        const Request request = checked_request(a, b, two_sets, cutoff, cell, what);
        grid = fitted_grid(request);
        list = {}; // from here on only a lack of memory, or the sink, ends the call
        fill_grid(request);
        const std::size_t n = a.points.size();
        rows = std::min(rows, n);
        places.reserve(n);
        if (request.somebody()) { // the places of each block's rows, ascending
            std::uint32_t* const next = next_place.reserve((n - 1) / rows + 1);
            for (std::size_t block = 0; block * rows < n; ++block)
                next[block] = static_cast<std::uint32_t>(block * rows);
            for (std::size_t place = 0; place < n; ++place)
                places[next[grid_a.index[place] / rows]++] = static_cast<std::uint32_t>(place);
        }
        for (std::size_t first = 0; first < n; first += rows) {
            const neighbors::RowRange some{first, std::min(rows, n - first), places.data() + first};
            search(request, some, what, result);
            const NeighborList<Dim, T> found = std::exchange(show(some.count, what, true), {});
            if (!sink(first, found)) return false;
        }
        return true;
    }
    NeighborList<Dim, T>& show(std::size_t n, const NeighborOptions& what, bool searched)
    {
        const std::size_t total = result.offsets[n];
        list.offsets = {result.offsets.data(), n + 1};
        list.neighbors = {result.neighbors.data(), total};
        if (what.shifts) list.shifts = {result.shifts.data(), total};
        if (what.vectors) list.vectors = {result.vectors.data(), total};
        if (what.distances) list.distances = {result.distances.data(), total};
        list.searched = searched;
        return list;
    }

    /// Each system by itself, divided among tasks.
    const NeighborList<Dim, T>& find_systems(const Set& all, std::span<const std::uint64_t> starts,
                                             const NeighborCutoff<T>& cutoff, std::span<const Cell> cells,
                                             const NeighborOptions& what)
    {
        const InUse use(in_use, "NeighborFinder");
        check_offsets(starts, "system", "point", all.points.size(), "points");
        neighbors::check_number(all);
        const std::size_t systems = starts.size() - 1;
        if (cells.size() > 1 && cells.size() != systems)
            throw Error(ErrorCode::size_mismatch, "there are " + std::to_string(cells.size()) +
                                                      " cells for " + std::to_string(systems) +
                                                      " systems; give one for each, or one for all");
        if (what.skin != 0) neighbors::refuse_search("a skin is for one system, and there are many");
        (void)neighbors::check_cutoffs(all, all, cutoff);
        const auto part_of = [](const auto& values, std::size_t first, std::size_t count) {
            return values.empty() ? values : values.subspan(first, count);
        };

        const ProcessOptions by{options.executor, neighbors::systems_per_block};
        const WorkPlan plan = plan_work(systems, by);
        while (in_system.size() < plan.slots) {
            FinderOptions serial = options;
            serial.executor = &serial_executor();
            in_system.push_back(std::make_unique<Implementation>(serial));
        }
        while (of_systems.size() < plan.blocks)
            of_systems.emplace_back(options.memory);
        counts.reserve(all.points.size());
        const auto find_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            neighbors::StoredNeighbors<Dim, T>& found = of_systems[work.block];
            std::size_t total = 0;
            for (auto k = static_cast<std::size_t>(begin); k < end; ++k) {
                const auto first = static_cast<std::size_t>(starts[k]),
                           size = static_cast<std::size_t>(starts[k + 1]) - first;
                NeighborCutoff<T> own = cutoff;
                own.radii = part_of(cutoff.radii, first, size);
                own.types = part_of(cutoff.types, first, size);
                const Set set{all.points.subspan(first, size), own.radii, own.types, ""};
                const auto is_zero = [](T radius) { return radius == 0; }; // alone all of them are an error
                if (!own.radii.empty() && std::all_of(own.radii.begin(), own.radii.end(), is_zero)) {
                    std::fill_n(counts.data() + first, size, std::uint64_t{0});
                    continue;
                }
                const NeighborList<Dim, T>* some = nullptr;
                try {
                    some = &in_system[work.slot]->find(
                        set, set, false, own, cells.empty() ? Cell{} : cells[cells.size() == 1 ? 0 : k],
                        what);
                } catch (const Error& error) {
                    throw Error(error.code(), "system " + std::to_string(k) + ": " + error.what(),
                                error.index() == Error::no_index ? Error::no_index : first + error.index());
                }
                for (std::size_t i = 0; i < size; ++i)
                    counts[first + i] = some->offsets[i + 1] - some->offsets[i];
                const auto append = [&](auto& to, const auto& from) {
                    if (from.empty()) return; // also what isn't wanted
                    std::copy(from.begin(), from.end(), to.grow(total + from.size(), total) + total);
                };
                append(found.neighbors, some->neighbors);
                for (std::size_t n = 0; n < some->neighbors.size(); ++n)
                    found.neighbors[total + n] += static_cast<std::uint32_t>(first);
                append(found.shifts, some->shifts);
                append(found.vectors, some->vectors);
                append(found.distances, some->distances);
                total += some->neighbors.size();
            }
        };
        process_items(systems, find_block, by);

        list = {};
        const std::size_t n = all.points.size();
        std::uint64_t* const offsets = result.offsets.reserve(n + 1);
        offsets[n] = exclusive_sum(std::copy_n(counts.data(), n, offsets) - n, n);
        const std::uint64_t total = offsets[n];
        result.neighbors.reserve(total);
        if (what.shifts) result.shifts.reserve(total);
        if (what.vectors) result.vectors.reserve(total);
        if (what.distances) result.distances.reserve(total);
        const auto copy_block = [&](std::uint64_t begin, std::uint64_t end, Work work) {
            neighbors::StoredNeighbors<Dim, T>& found = of_systems[work.block];
            const std::uint64_t first = offsets[starts[begin]], size = offsets[starts[end]] - first;
            std::copy_n(found.neighbors.data(), size, result.neighbors.data() + first);
            if (what.shifts) std::copy_n(found.shifts.data(), size, result.shifts.data() + first);
            if (what.vectors) std::copy_n(found.vectors.data(), size, result.vectors.data() + first);
            if (what.distances) std::copy_n(found.distances.data(), size, result.distances.data() + first);
        };
        process_items(systems, copy_block, by);
        return show(n, what, true);
    }

    void release()
    {
        grid_a.release(), grid_b.release(), counts.release(), result.release(), kept.release();
        places.release(), next_place.release();
        const auto empty = [](auto& vector) {
            vector.clear();
            vector.shrink_to_fit();
        };
        empty(scratch), empty(blocks), empty(in_system), empty(of_systems), empty(kept_points),
            empty(kept_radii), empty(kept_types), empty(kept_table);
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
                                                         const Cell& cell, const NeighborOptions& options) &
{
    neighbors::refuse_second_set(cutoff);
    const neighbors::PointSet<Dim, T> set{points, cutoff.radii, cutoff.types, ""};
    return implementation_->find(set, set, false, cutoff, cell, options);
}

template <int Dim, Coordinate T>
const NeighborList<Dim, T>& NeighborFinder<Dim, T>::find(Points points, Points others,
                                                         const NeighborCutoff<T>& cutoff, const Cell& cell,
                                                         const NeighborOptions& options) &
{
    return implementation_->find({points, cutoff.radii, cutoff.types, "a "},
                                 {others, cutoff.radii_b, cutoff.types_b, "b "}, true, cutoff, cell, options);
}

template <int Dim, Coordinate T>
const NeighborList<Dim, T>&
NeighborFinder<Dim, T>::find_systems(Points points, std::span<const std::uint64_t> offsets,
                                     const NeighborCutoff<T>& cutoff, std::span<const Cell> cells,
                                     const NeighborOptions& options) &
{
    neighbors::refuse_second_set(cutoff);
    return implementation_->find_systems({points, cutoff.radii, cutoff.types, ""}, offsets, cutoff, cells,
                                         options);
}

template <int Dim, Coordinate T>
bool NeighborFinder<Dim, T>::stream(Points points, const NeighborCutoff<T>& cutoff, std::size_t rows,
                                    Sink sink, const Cell& cell, const NeighborOptions& options)
{
    neighbors::refuse_second_set(cutoff);
    const neighbors::PointSet<Dim, T> set{points, cutoff.radii, cutoff.types, ""};
    return implementation_->stream(set, set, false, cutoff, rows, sink, cell, options);
}

template <int Dim, Coordinate T>
bool NeighborFinder<Dim, T>::stream(Points points, Points others, const NeighborCutoff<T>& cutoff,
                                    std::size_t rows, Sink sink, const Cell& cell,
                                    const NeighborOptions& options)
{
    return implementation_->stream({points, cutoff.radii, cutoff.types, "a "},
                                   {others, cutoff.radii_b, cutoff.types_b, "b "}, true, cutoff, rows, sink,
                                   cell, options);
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
