// SPDX-License-Identifier: MIT
// jostle bench neighbors: neighbour lists of atoms, beside a plain list of cells.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bench/neighbor_peers.hpp"
#include "bench_run.hpp"
#include "commands.hpp"
#include "jostle/neighbors.hpp"
#include "numbers.hpp"
#include "threads.hpp"
#include "tool/scenes/random.hpp"
#include "turns.hpp"

namespace jostle_tool {

namespace {

using jostle::NeighborOptions;
using jostle::Vec3f;
using Cell = jostle::PeriodicCell<3, float>;

struct Case
{
    const char* name;
    float cutoff; ///< in Angstrom
    bool repeats, skewed;
    NeighborOptions options; ///< with a skin, calls search no more
    bool systems = false;    ///< 20 times as many atoms, in systems of 100
};
constexpr NeighborOptions rows{.shifts = false}, half{.half = true, .shifts = false};
constexpr Case all_cases[] = {
    {"open-6", 6, false, false, rows},
    {"half-6", 6, true, false, half},
    {"vectors-6", 6, true, false, {.vectors = true}},
    {"open-3", 3, false, false, rows},
    {"half-3", 3, true, false, half},
    {"skewed-6", 6, true, true, half},
    {"step-6", 6, true, false, {.half = true, .shifts = false, .skin = 1}},
    {"systems-5", 5, false, false, rows, true},
};

/// Diamond whose atoms lie 0.1 Angstrom or less aside along each axis; with 6 Angstrom 122 neighbours.
struct Atoms
{
    std::vector<Vec3f> at;
    Cell cell; ///< of edge `edge`, perhaps skewed by 60 degrees
    double edge;
};
Atoms make_atoms(std::uint64_t n, bool skewed, std::uint64_t seed)
{
    constexpr double unit = 3.9; // holds 8
    constexpr double base[8][3] = {{0, 0, 0},          {0, 0.5, 0.5},      {0.5, 0, 0.5},
                                   {0.5, 0.5, 0},      {0.25, 0.25, 0.25}, {0.25, 0.75, 0.75},
                                   {0.75, 0.25, 0.75}, {0.75, 0.75, 0.25}};
    const int units = std::max(1, static_cast<int>(std::cbrt(static_cast<double>(n) / 8)));
    Atoms atoms;
    atoms.edge = units * unit;
    jostle_scenes::Random random(seed);
    const auto aside = [&] { return 0.2 * random.uniform() - 0.1; };
    const double slant = skewed ? 0.5 : 0, upright = skewed ? std::sqrt(0.75) : 1;
    for (int i = 0; i < units; ++i)
        for (int j = 0; j < units; ++j)
            for (int k = 0; k < units; ++k)
                for (const auto& [x, y, z] : base) {
                    const double u = unit * (i + x), v = unit * (j + y), w = unit * (k + z);
                    atoms.at.push_back({static_cast<float>(u + slant * v + aside()),
                                        static_cast<float>(upright * v + aside()),
                                        static_cast<float>(w + aside())});
                }
    const auto length = static_cast<float>(atoms.edge);
    atoms.cell = {{{length, 0, 0},
                   {static_cast<float>(slant * atoms.edge), static_cast<float>(upright * atoms.edge), 0},
                   {0, 0, length}},
                  {true, true, true}};
    return atoms;
}

/// Systems of 100 atoms of diamond, one behind the other in memory, and where each begins.
std::vector<std::uint64_t> make_systems(std::uint64_t n, std::uint64_t seed, std::vector<Vec3f>& atoms)
{
    constexpr std::uint64_t size = 100;
    std::vector<std::uint64_t> offsets{0};
    while (offsets.back() + size <= n) {
        const std::vector<Vec3f> some = make_atoms(216, false, seed + offsets.size()).at;
        atoms.insert(atoms.end(), some.begin(), some.begin() + size);
        offsets.push_back(atoms.size());
    }
    return offsets;
}

/// What a program has that does it by hand, with care: atoms sorted into cells of a cutoff's edge, each
/// tested against those of the 27 cells around it. Rows come in no order.
class PlainCells
{
  public:
    std::uint64_t find(const Atoms& atoms, float cutoff, bool repeats, bool half_list)
    {
        const std::size_t n = atoms.at.size();
        const auto edge = static_cast<float>(atoms.edge);
        const int count = std::max(1, static_cast<int>(edge / cutoff));
        const float scale = static_cast<float>(count) / edge, square = cutoff * cutoff;
        start_.assign(static_cast<std::size_t>(count * count * count) + 2, 0);
        of_.resize(n), sorted_.resize(n), number_.resize(n);
        const auto place = [&](float x) {
            return std::clamp(static_cast<int>(std::floor(x * scale)), 0, count - 1);
        };
        for (std::size_t i = 0; i < n; ++i) {
            Vec3f at = atoms.at[i];
            for (float& x : at)
                if (repeats) x -= edge * std::floor(x / edge);
            of_[i] = {
                at, static_cast<std::uint32_t>((place(at[0]) * count + place(at[1])) * count + place(at[2]))};
            ++start_[of_[i].cell + 2];
        }
        for (std::size_t c = 2; c < start_.size(); ++c)
            start_[c] += start_[c - 1];
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t to = start_[of_[i].cell + 1]++;
            sorted_[to] = of_[i].at;
            number_[to] = static_cast<std::uint32_t>(i);
        }
        offsets_.assign(1, 0);
        found_.clear();
        for (std::size_t i = 0; i < n; ++i) {
            const Vec3f at = of_[i].at;
            const int here[3] = {place(at[0]), place(at[1]), place(at[2])};
            for (int step = 0; step < 27; ++step) {
                const int steps[3] = {step / 9 - 1, step / 3 % 3 - 1, step % 3 - 1};
                std::size_t cell = 0;
                float moved[3];
                bool is_there = true;
                for (int d = 0; d < 3; ++d) {
                    int c = here[d] + steps[d];
                    moved[d] = at[d];
                    is_there &= repeats || (c >= 0 && c < count);
                    if (c < 0) c += count, moved[d] += edge;
                    if (c >= count) c -= count, moved[d] -= edge;
                    cell = cell * static_cast<std::size_t>(count) + static_cast<std::size_t>(c);
                }
                if (!is_there) continue;
                for (std::uint32_t k = start_[cell]; k < start_[cell + 1]; ++k) {
                    const float x = sorted_[k][0] - moved[0], y = sorted_[k][1] - moved[1],
                                z = sorted_[k][2] - moved[2];
                    if (x * x + y * y + z * z <= square && (half_list ? number_[k] > i : number_[k] != i))
                        found_.push_back(number_[k]);
                }
            }
            offsets_.push_back(found_.size());
        }
        return found_.size();
    }

  private:
    struct Wrapped
    {
        Vec3f at;
        std::uint32_t cell;
    };
    std::vector<std::uint32_t> start_, number_, found_;
    std::vector<std::uint64_t> offsets_;
    std::vector<Wrapped> of_;
    std::vector<Vec3f> sorted_;
};

class NeighborTable : public BenchTable
{
  public:
    explicit NeighborTable(const BenchOptions& options) : BenchTable(options)
    {
        if (shown())
            std::printf("%-10s %8s %7s  %-9s %10s %10s %10s %12s\n", "case", "atoms", "threads", "system",
                        "ms", "min", "max", "neighbours");
    }
    void row(const char* system, const Case& of, std::uint64_t n, std::uint32_t threads,
             std::vector<double> ms, std::uint64_t found)
    {
        add({{"system", system},
             {"scene", of.name},
             {"n", n},
             {"threads", threads},
             {"median_ms", rounded(median(ms))},
             {"min_ms", rounded(ms.front())},
             {"max_ms", rounded(ms.back())},
             {"neighbors", found}});
        if (!shown()) return;
        std::printf("%-10s %8llu %7u  %-9s %10.3f %10.3f %10.3f %12llu\n", of.name,
                    static_cast<unsigned long long>(n), threads, system, median(ms), ms.front(), ms.back(),
                    static_cast<unsigned long long>(found));
        std::fflush(stdout);
    }
};

void run(const BenchOptions& options)
{
    const std::vector<const Case*> wanted = choose(options.names, all_cases, "case that is measured");
    NeighborTable table(options);
    const auto nothing = [](std::uint32_t) {};
    for (const Case* each : wanted) {
        Atoms atoms;
        std::vector<std::uint64_t> systems;
        if (each->systems)
            systems = make_systems(20 * options.count, options.seed, atoms.at);
        else
            atoms = make_atoms(options.count, each->skewed, options.seed);
        const std::vector<Vec3f> searched = atoms.at;
        // With a skin atoms lie up to a quarter of it aside of where they were when they were searched.
        const auto move = [&](std::uint32_t run) {
            jostle_scenes::Random random(options.seed + run);
            const double most = run == 0 ? 0 : each->options.skin / 4 / std::sqrt(3);
            for (std::size_t i = 0; most > 0 && i < atoms.at.size(); ++i)
                for (int d = 0; d < 3; ++d)
                    atoms.at[i][d] = searched[i][d] + static_cast<float>(most * (2 * random.uniform() - 1));
        };
        const Cell cell = each->repeats ? atoms.cell : Cell{};
        std::uint64_t ours = 0;
        for (const std::uint32_t count : options.threads) {
            const Threads threads(count);
            jostle::NeighborFinder<3, float> finder({.executor = &threads.executor()});
            atoms.at = searched;
            const auto search = [&] {
                const auto& list =
                    each->systems ? finder.find_systems(atoms.at, systems, each->cutoff, {}, each->options)
                                  : finder.find(atoms.at, each->cutoff, cell, each->options);
                ours = list.neighbors.size();
            };
            const std::vector<double> ms = sorted_times(2, options.frames, move, search);
            table.row("jostle", *each, atoms.at.size(), threads.count(), ms, ours);
        }
        if (each->systems || each->skewed || each->options.skin > 0 || each->options.vectors) continue;
        PlainCells plain;
        std::uint64_t found = 0;
        const auto search = [&] {
            found = plain.find(atoms, each->cutoff, each->repeats, each->options.half);
        };
        const std::vector<double> ms = sorted_times(2, options.frames, nothing, search);
        table.row("cells", *each, atoms.at.size(), 1, ms, found);
        // Wrapped atoms are rounded, so a few at the cutoff may differ.
        if (std::max(found, ours) - std::min(found, ours) > ours / 10'000)
            table.differ(std::string(each->name) + ": " + std::to_string(ours) +
                         " neighbours, and cells finds " + std::to_string(found));
#ifdef JOSTLE_WITH_PEERS
        if (!options.peers || each->repeats != each->options.half) continue; // what they have
        const std::unique_ptr<jostle_bench::NeighborPeer> peer =
            each->repeats ? jostle_bench::make_lammps() : jostle_bench::make_nanoflann();
        peer->start(atoms.at, each->cutoff, atoms.edge);
        const std::vector<double> peer_ms = sorted_times(2, options.frames, nothing, [&] { peer->find(); });
        found = peer->found();
        table.row(peer->name(), *each, atoms.at.size(), 1, peer_ms, found);
        if (std::max(found, ours) - std::min(found, ours) > (each->repeats ? ours / 10'000 : 0))
            table.differ(std::string(each->name) + ": " + std::to_string(ours) + " neighbours, and " +
                         peer->name() + " finds " + std::to_string(found));
#endif
    }
    table.finish();
}

constexpr const char* help =
    R"(Cases: open-6, rows of neighbours in open space within 6 Angstrom; half-6, each pair once, and vectors-6,
all with whole-number shifts and vectors, in a periodic cell; open-3 and half-3 within 3 Angstrom; skewed-6, as
half-6 in a cell of 60 degrees; step-6, a call without a search, since atoms have moved by at most a quarter of the
skin of 1 Angstrom; systems-5, many open systems of 100 atoms in one call, 20 times as many atoms.
Atoms are those of diamond, each moved by up to 0.1 Angstrom. The system cells is a plain cell list on one thread,
with unsorted rows. --peers adds, on one thread, nanoflann, a k-d tree, in open space, which must find the same,
and LAMMPS's list in periodic space, which wraps and compares in double precision.

Examples:
  jostle bench neighbors
  jostle bench neighbors open-6 half-6 -n 1000000 --threads 1,2
  jostle bench neighbors --peers --json -)";

} // namespace

void add_bench_neighbors_command(const Command& bench)
{
    const auto [command, options] = add_bench_part(bench, "neighbors", "Times neighbour lists of atoms", help,
                                                   run, {.count = 50'000, .frames = 15});
    command.texts("CASE", options.names, "Which cases; all if none is given");
    command.number("-n", options.count, 8, 100'000'000, "N", "How many atoms, about (50000)");
    command.number("--repetitions", options.frames, 1, 100'000, "R", "How often each is measured (15)");
    add_thread_counts_option(command, options.threads);
    command.seed(options.seed, "Other atoms of the same kind (1)");
    add_rows_file_option(command, options.json);
    command.flag("--peers", options.peers, "nanoflann and LAMMPS as well, where the build has them");
}

} // namespace jostle_tool
