// SPDX-License-Identifier: MIT
// What `jostle distribute` starts with mpiexec; rows of JSON on the first rank's stdout.
//   jostle_distribute run SCENE N THREADS FRAMES SEED     over all ranks, beside an all-gather of its
//                                                         boxes and slabs that never change
//   jostle_distribute predict SCENE N SEED RANKS...       counted: what each of so many ranks would do
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <limits>
#include <map>
#include <numeric>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "jostle/mpi.hpp"
#include "partition.hpp"
#include "region.hpp"
#include "tool/scenes/scenes.hpp"

namespace {

using jostle::Aabb3f;
using jostle_scenes::Scene;
using Clock = std::chrono::steady_clock;

/// Frames that aren't counted, as in `jostle bench`: the answer is that of the first one that is.
constexpr int warm_up = 3;

int rank_of_this()
{
    int rank = 0;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    return rank;
}
int rank_count()
{
    int ranks = 1;
    MPI_Comm_size(MPI_COMM_WORLD, &ranks);
    return ranks;
}
double greatest(double number)
{
    MPI_Allreduce(MPI_IN_PLACE, &number, 1, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
    return number;
}
std::uint64_t sum(std::uint64_t number)
{
    MPI_Allreduce(MPI_IN_PLACE, &number, 1, MPI_UINT64_T, MPI_SUM, MPI_COMM_WORLD);
    return number;
}
double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}
/// Of pairs of a 32-bit world: the same as other systems have.
template <class Pairs>
std::uint64_t checksum(const Pairs& pairs)
{
    std::vector<jostle::Pair> narrow;
    for (const auto& pair : pairs)
        narrow.push_back({static_cast<std::uint32_t>(pair.a), static_cast<std::uint32_t>(pair.b)});
    return jostle::pair_checksum(narrow);
}

struct Timed
{
    std::vector<double> ms;
    std::uint64_t pairs = 0, checksum = 0, bytes = 0;
};

/// Updates that divided space anew, beside those that didn't.
class Divisions
{
  public:
    /// Of each frame that is timed: how often space was divided until then.
    void add(double ms, std::uint64_t partitions, double partition_ms)
    {
        const bool divided = partitions != partitions_;
        partitions_ = partitions;
        (divided ? dividing_ : other_).push_back(ms);
        if (divided) partition_times_.push_back(partition_ms);
    }
    /// Before the first frame that is timed.
    void start(std::uint64_t partitions) { partitions_ = partitions; }
    /// `ms`: an update that divides, the median; `extra_ms`: how much longer than another one it takes;
    /// `share`: how much of all updates' time went into that.
    [[nodiscard]] std::string json() const
    {
        const double other = median(other_), dividing = median(dividing_);
        double all = 0, extra = 0;
        for (const double ms : other_)
            all += ms;
        for (const double ms : dividing_) {
            all += ms;
            extra += ms - other;
        }
        const bool both = !other_.empty() && !dividing_.empty();
        char text[200];
        std::snprintf(text, sizeof text,
                      "\"divisions\":{\"times\":%zu,\"ms\":%.3f,\"extra_ms\":%.3f,\"partition_ms\":%.3f,"
                      "\"share\":%.4f},",
                      dividing_.size(), dividing, both ? dividing - other : 0, median(partition_times_),
                      both ? extra / all : 0);
        return text;
    }

  private:
    std::uint64_t partitions_ = 0;
    std::vector<double> dividing_, other_, partition_times_;
};

void print_row(const std::string& system, const std::string& scene, std::uint64_t n, std::uint32_t threads,
               std::uint64_t seed, const Timed& timed, const std::string& more)
{
    if (rank_of_this() != 0) return;
    std::printf(
        "{\"system\":\"%s\",\"scene\":\"%s\",\"n\":%llu,\"ranks\":%d,\"threads\":%u,\"median_ms\":%.3f,"
        "\"min_ms\":%.3f,\"max_ms\":%.3f,\"pairs\":%llu,\"checksum\":\"%016llx\",\"bytes\":%llu,%s"
        "\"dim\":3,\"type\":\"float\",\"seed\":%llu,\"frames\":%zu}\n",
        system.c_str(), scene.c_str(), static_cast<unsigned long long>(n), rank_count(), threads,
        median(timed.ms), *std::min_element(timed.ms.begin(), timed.ms.end()),
        *std::max_element(timed.ms.begin(), timed.ms.end()), static_cast<unsigned long long>(timed.pairs),
        static_cast<unsigned long long>(timed.checksum), static_cast<unsigned long long>(timed.bytes),
        more.c_str(), static_cast<unsigned long long>(seed), timed.ms.size());
    std::fflush(stdout);
}

template <class Call>
double timed_ms(const Call& call)
{
    MPI_Barrier(MPI_COMM_WORLD);
    const Clock::time_point before = Clock::now();
    call();
    return greatest(std::chrono::duration<double, std::milli>(Clock::now() - before).count());
}

/// What needs no thought: everybody gets all boxes and searches a share of them.
Timed run_allgather(const std::string& name, std::uint64_t n, jostle::Executor& executor, int frames,
                    std::uint64_t seed)
{
    const std::uint64_t rank = static_cast<std::uint64_t>(rank_of_this()),
                        ranks = static_cast<std::uint64_t>(rank_count());
    Timed gather;
    Scene<3, float> scene(name, n, seed);
    jostle::PairFinder finder({.executor = &executor});
    std::vector<Aabb3f> all(n);
    std::vector<int> counts, starts;
    for (std::uint64_t other = 0; other < ranks; ++other) {
        starts.push_back(static_cast<int>(other * n / ranks * sizeof(Aabb3f)));
        counts.push_back(static_cast<int>((other + 1) * n / ranks * sizeof(Aabb3f)) - starts.back());
    }
    const std::uint64_t first = rank * n / ranks, last = (rank + 1) * n / ranks;
    for (int frame = 0; frame < warm_up + frames; ++frame) {
        if (frame > 0) scene.step();
        std::uint64_t pairs = 0, check = 0;
        const double ms = timed_ms([&] {
            MPI_Allgatherv(scene.boxes().data() + first, counts[rank], MPI_BYTE, all.data(), counts.data(),
                           starts.data(), MPI_BYTE, MPI_COMM_WORLD);
            const jostle::BoxView<3, float> boxes(all);
            const auto later = [first](std::uint32_t a, std::uint32_t b) { return first + a < b; };
            jostle::CrossFilter filter;
            filter.accept = later;
            std::vector<jostle::Pair> found;
            for (jostle::Pair pair : finder.find(boxes.subview(first, last - first), boxes, filter))
                found.push_back({static_cast<std::uint32_t>(first + pair.a), pair.b});
            pairs = found.size();
            if (frame == warm_up) check = jostle::pair_checksum(found);
        });
        if (frame < warm_up) continue;
        gather.ms.push_back(ms);
        if (frame == warm_up) {
            gather.pairs = sum(pairs);
            gather.checksum = sum(check);
        }
    }
    gather.bytes = n * sizeof(Aabb3f) * (ranks - 1);
    return gather;
}

/// The places between which slabs of equal width lie along x, from the scene as it begins.
class Slabs
{
  public:
    Slabs(std::span<const Aabb3f> boxes, int count) : count_(count)
    {
        for (const Aabb3f& box : boxes) {
            const double x = jostle::mpi::Partition::middle(box)[0];
            lo_ = std::min(lo_, x);
            hi_ = std::max(hi_, x);
        }
    }
    [[nodiscard]] int at(double x) const
    {
        const double at = hi_ > lo_ ? (x - lo_) / (hi_ - lo_) * count_ : 0;
        return static_cast<int>(std::clamp(at, 0.0, count_ - 1.0));
    }
    [[nodiscard]] int home(const Aabb3f& box) const { return at(jostle::mpi::Partition::middle(box)[0]); }

  private:
    int count_;
    double lo_ = std::numeric_limits<double>::infinity(), hi_ = -lo_;
};

/// What is written first where space is divided by hand: slabs along x that never change. In each frame a
/// rank sends what touches other slabs, and searches all that touches its own.
Timed run_slabs(const std::string& name, std::uint64_t n, jostle::Executor& executor, int frames,
                std::uint64_t seed)
{
    struct Ghost
    {
        std::uint64_t id;
        Aabb3f box;
    };
    const int rank = rank_of_this();
    const auto ranks = static_cast<std::size_t>(rank_count());
    Timed timed;
    Scene<3, float> scene(name, n, seed);
    jostle::PairFinder finder({.executor = &executor});
    const Slabs slabs(scene.boxes(), rank_count());
    std::vector<std::uint64_t> mine, ids;
    for (std::uint64_t i = 0; i < n; ++i)
        if (slabs.home(scene.boxes()[i]) == rank) mine.push_back(i);
    std::vector<std::vector<Ghost>> to(ranks);
    std::vector<Ghost> out, in;
    std::vector<Aabb3f> boxes;
    std::vector<int> counts(ranks), starts(ranks), counts_in(ranks), starts_in(ranks);
    std::vector<double> bytes;
    for (int frame = 0; frame < warm_up + frames; ++frame) {
        if (frame > 0) scene.step();
        std::vector<jostle::Pair> found;
        const double ms = timed_ms([&] {
            ids.clear();
            boxes.clear();
            for (auto& each : to)
                each.clear();
            std::size_t staying = 0;
            for (const std::uint64_t id : mine) {
                const Aabb3f& box = scene.boxes()[id];
                const int first = slabs.at(box.lo[0]), last = slabs.at(box.hi[0]);
                for (int slab = first; slab <= last; ++slab)
                    if (slab != rank) to[static_cast<std::size_t>(slab)].push_back({id, box});
                if (first <= rank && rank <= last) {
                    ids.push_back(id);
                    boxes.push_back(box);
                }
                if (slabs.home(box) == rank) mine[staying++] = id;
            }
            mine.resize(staying);
            out.clear();
            for (std::size_t other = 0; other < ranks; ++other) {
                starts[other] = static_cast<int>(out.size() * sizeof(Ghost));
                counts[other] = static_cast<int>(to[other].size() * sizeof(Ghost));
                out.insert(out.end(), to[other].begin(), to[other].end());
            }
            MPI_Alltoall(counts.data(), 1, MPI_INT, counts_in.data(), 1, MPI_INT, MPI_COMM_WORLD);
            std::exclusive_scan(counts_in.begin(), counts_in.end(), starts_in.begin(), 0);
            in.resize(static_cast<std::size_t>(starts_in.back() + counts_in.back()) / sizeof(Ghost));
            MPI_Alltoallv(out.data(), counts.data(), starts.data(), MPI_BYTE, in.data(), counts_in.data(),
                          starts_in.data(), MPI_BYTE, MPI_COMM_WORLD);
            for (const Ghost& ghost : in) {
                ids.push_back(ghost.id);
                boxes.push_back(ghost.box);
                if (slabs.home(ghost.box) == rank) mine.push_back(ghost.id);
            }
            for (const jostle::Pair pair : finder.find(boxes)) {
                const Aabb3f &a = boxes[pair.a], &b = boxes[pair.b];
                if (slabs.at(std::max(a.lo[0], b.lo[0])) != rank)
                    continue; // the slab in which they begin to touch
                const auto x = static_cast<std::uint32_t>(ids[pair.a]),
                           y = static_cast<std::uint32_t>(ids[pair.b]);
                found.push_back({std::min(x, y), std::max(x, y)});
            }
        });
        if (frame < warm_up) continue;
        timed.ms.push_back(ms);
        bytes.push_back(static_cast<double>(sum(out.size() * sizeof(Ghost))));
        if (frame == warm_up) {
            timed.pairs = sum(found.size());
            timed.checksum = sum(jostle::pair_checksum(found));
        }
    }
    timed.bytes = static_cast<std::uint64_t>(median(bytes));
    return timed;
}

void run(const std::string& name, std::uint64_t n, std::uint32_t threads, int frames, std::uint64_t seed)
{
    const auto executor = jostle::make_thread_executor(threads);
    const jostle::mpi::WorldOptions options{.executor = executor.get()};
    const std::uint64_t rank = static_cast<std::uint64_t>(rank_of_this()),
                        ranks = static_cast<std::uint64_t>(rank_count());
    Timed ours;
    std::string more;
    {
        Scene<3, float> scene(name, n, seed);
        jostle::mpi::World3f world(MPI_COMM_WORLD, options);
        for (std::uint64_t i = rank * n / ranks; i < (rank + 1) * n / ranks; ++i)
            world.add(i, scene.boxes()[i]);
        world.update();
        std::vector<std::uint64_t> ids;
        std::vector<Aabb3f> boxes;
        std::vector<std::vector<double>> stages(5);
        std::vector<double> bytes;
        Divisions divisions;
        for (int frame = 0; frame < warm_up + frames; ++frame) {
            if (frame > 0) scene.step();
            if (frame == warm_up) divisions.start(world.stats().partitions);
            world.ids(ids);
            boxes.clear();
            for (const std::uint64_t id : ids)
                boxes.push_back(scene.boxes()[id]);
            const double ms = timed_ms([&] {
                world.move(ids, boxes);
                world.update();
            });
            if (frame == warm_up) {
                const auto pairs = jostle::mpi::find_pairs(MPI_COMM_WORLD, boxes, ids, options);
                ours.pairs = sum(pairs.size());
                ours.checksum = sum(checksum(pairs));
            }
            if (frame < warm_up) continue;
            ours.ms.push_back(ms);
            const jostle::mpi::WorldStats& stats = world.stats();
            const double us[] = {stats.us_stage, stats.us_partition, stats.us_search, stats.us_pairs,
                                 stats.us_wait};
            for (std::size_t k = 0; k < stages.size(); ++k)
                stages[k].push_back(greatest(us[k]) / 1000);
            bytes.push_back(static_cast<double>(sum(stats.bytes)));
            divisions.add(ms, stats.partitions, greatest(stats.us_partition) / 1000);
        }
        const jostle::mpi::WorldStats& stats = world.stats();
        const auto total = static_cast<double>(sum(stats.members));
        const std::uint64_t ghosts = sum(stats.ghosts), messages = sum(stats.messages),
                            of_boxes = sum(stats.bytes_of_boxes), of_pairs = sum(stats.bytes_of_pairs);
        ours.bytes = static_cast<std::uint64_t>(median(bytes));
        char text[1000];
        const auto whole = [](std::uint64_t number) { return static_cast<unsigned long long>(number); };
        std::snprintf(text, sizeof text,
                      "\"ghosts\":%llu,\"messages\":%llu,\"bytes_of_boxes\":%llu,\"bytes_of_pairs\":%llu,"
                      "\"imbalance\":%.3f,\"partitions\":%llu,\"stages\":{\"stage\":%.3f,\"partition\":%.3f,"
                      "\"search\":%.3f,\"pairs\":%.3f,\"wait\":%.3f},",
                      whole(ghosts), whole(messages), whole(of_boxes), whole(of_pairs),
                      greatest(static_cast<double>(stats.members)) * static_cast<double>(ranks) / total,
                      whole(stats.partitions), median(stages[0]), median(stages[1]), median(stages[2]),
                      median(stages[3]), median(stages[4]));
        more = text + divisions.json();
    }
    print_row("jostle-mpi", name, n, threads, seed, ours, more);

    for (const auto& [system, other] :
         {std::pair("allgather", run_allgather(name, n, *executor, frames, seed)),
          std::pair("slabs", run_slabs(name, n, *executor, frames, seed))}) {
        print_row(system, name, n, threads, seed, other, "");
        if (other.pairs != ours.pairs || other.checksum != ours.checksum)
            throw std::runtime_error(std::string(system) + " finds other pairs");
    }
}

/// What each of many ranks would search and receive if every object moved.
struct Load
{
    using Notice = jostle::mpi::Notice<3, float>;
    explicit Load(std::size_t ranks) : members(ranks) {}
    std::vector<std::uint64_t> members;
    std::map<std::pair<int, int>, std::uint64_t> messages; // from, to: the last id in it
    std::uint64_t ghosts = 0, bytes = 0;

    void add(int home, const jostle::mpi::Ranks& touched, const Notice& notice)
    {
        for (const int rank : touched) {
            ++members[static_cast<std::size_t>(rank)];
            if (rank == home) continue;
            ++ghosts;
            std::uint64_t& last = messages[{home, rank}];
            written_.assign(1, {}); // the kind
            jostle::mpi::put_short(written_, jostle::mpi::step_to(notice.id, last));
            notice.write(written_);
            last = notice.id;
            bytes += written_.size();
        }
    }
    void print(const std::string& system, const std::string& scene, std::uint64_t n, std::uint64_t seed) const
    {
        const std::size_t ranks = members.size();
        const auto total =
            static_cast<double>(std::accumulate(members.begin(), members.end(), std::uint64_t{0}));
        std::vector<std::uint64_t> neighbours(ranks);
        for (const auto& [link, last] : messages)
            ++neighbours[static_cast<std::size_t>(link.first)];
        std::printf("{\"system\":\"%s\",\"scene\":\"%s\",\"n\":%llu,\"ranks\":%zu,\"ghosts\":%llu,"
                    "\"ghosts_per_object\":%.4f,\"bytes_of_boxes\":%llu,\"messages\":%llu,"
                    "\"most_neighbours\":%llu,\"imbalance\":%.3f,\"seed\":%llu}\n",
                    system.c_str(), scene.c_str(), static_cast<unsigned long long>(n), ranks,
                    static_cast<unsigned long long>(ghosts),
                    static_cast<double>(ghosts) / static_cast<double>(n),
                    static_cast<unsigned long long>(bytes), static_cast<unsigned long long>(messages.size()),
                    static_cast<unsigned long long>(*std::max_element(neighbours.begin(), neighbours.end())),
                    static_cast<double>(*std::max_element(members.begin(), members.end())) *
                        static_cast<double>(ranks) / total,
                    static_cast<unsigned long long>(seed));
        std::fflush(stdout);
    }

  private:
    std::vector<std::byte> written_;
};

void predict(const std::string& name, std::uint64_t n, std::uint64_t seed, int ranks)
{
    Scene<3, float> scene(name, n, seed);
    const std::vector<Aabb3f> boxes(scene.boxes().begin(), scene.boxes().end());
    scene.step(); // what every object has to tell
    jostle::mpi::WeightedPoints points(std::pmr::get_default_resource());
    for (const Aabb3f& box : boxes) {
        const auto middle = jostle::mpi::Partition::middle(box);
        points.points.insert(points.points.end(), middle.begin(), middle.end());
        points.weights.push_back(1);
    }
    const jostle::mpi::Partition partition(MPI_COMM_WORLD, 3, points, ranks);
    const Slabs in_slabs(boxes, ranks);
    Load divided(static_cast<std::size_t>(ranks)), slabs(static_cast<std::size_t>(ranks));
    jostle::mpi::Ranks touched;
    for (std::uint64_t i = 0; i < n; ++i) {
        const Aabb3f& box = boxes[i];
        const Load::Notice notice{i,
                                  0,
                                  false,
                                  false,
                                  false,
                                  {box, {}, jostle::mpi::Presence::enabled},
                                  {scene.boxes()[i], {}, jostle::mpi::Presence::enabled}};
        partition.touched(box, touched);
        divided.add(partition.at_middle_of(box), touched, notice);
        touched.clear();
        for (int each = in_slabs.at(box.lo[0]); each <= in_slabs.at(box.hi[0]); ++each)
            touched.push_back(each);
        slabs.add(in_slabs.home(box), touched, notice);
    }
    divided.print("jostle-mpi-counted", name, n, seed);
    slabs.print("slabs-counted", name, n, seed);
}

} // namespace

int main(int count, char** arguments)
{
    int provided = 0;
    MPI_Init_thread(&count, &arguments, MPI_THREAD_FUNNELED, &provided);
    const std::vector<std::string> words(arguments + 1, arguments + count);
    int result = 0;
    try {
        const auto number = [&](std::size_t i) { return std::stoull(words.at(i)); };
        if (words.at(0) == "run")
            run(words.at(1), number(2), static_cast<std::uint32_t>(number(3)), static_cast<int>(number(4)),
                number(5));
        else
            for (std::size_t i = 4; i < words.size(); ++i)
                predict(words.at(1), number(2), number(3), static_cast<int>(number(i)));
    } catch (const std::exception& error) {
        std::fprintf(stderr, "rank %d: %s\n", rank_of_this(), error.what());
        result = 1;
        MPI_Abort(MPI_COMM_WORLD, 1);
    }
    MPI_Finalize();
    return result;
}
