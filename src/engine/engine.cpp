// SPDX-License-Identifier: MIT
#include "engine/engine.hpp"

#include <algorithm>
#include <bit>
#include <chrono>

#include "base/block_buffer_access.hpp"
#include "base/box.hpp"
#include "base/exact_floats.hpp"
#include "base/run_tasks.hpp"
#include "engine/apart.hpp"
#include "engine/kernels/few.hpp"
#include "engine/output.hpp"
#include "engine/scatter.hpp"
#include "engine/slot.hpp"
#include "engine/sort_brick.hpp"
#include "engine/tuner.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {
namespace {

// While this many rows are swept, as many records of the next brick are fetched. Even.
constexpr std::uint32_t rows_per_fetch = 64;
// For fewer boxes than this per thread, waking a thread doesn't pay.
constexpr std::size_t boxes_per_thread = 2048;
// A brick whose rows take more steps than this on average may get its own grid.
constexpr double crowded_steps = 10;
// ... if the model expects it to cost less than this share of sweeping the brick directly.
constexpr double worth_nesting = 0.6;
// A brick whose rows take more than this, half a step beside the candidates, may be too coarse for its boxes.
constexpr double coarse_steps = 1;
constexpr std::uint32_t fit_boxes = 16; // this many show where the boxes of a part are
// Nested grids at least halve the cost (see above) and shrink the extent; no real scene came near this depth.
constexpr int deepest_nesting = 24;
// Nested grids and single bricks of this much work are divided among all threads instead of one worker doing
// them.
constexpr std::uint32_t job_records = 1u << 15;
constexpr double job_steps = 1 << 19;
constexpr std::uint64_t job_candidates = std::uint64_t{1 << 19} * step_size;
constexpr std::uint32_t job_rows = 2048; // per block of a brick that is divided; even
// Bricks are claimed in this many blocks a grid, so that claiming costs nothing and the last block doesn't
// keep all threads waiting.
constexpr std::uint32_t blocks_per_grid = 512;

// One of two sets is far smaller if it is this many times smaller. Among fewer boxes than this it doesn't
// matter.
constexpr std::uint64_t far_smaller = 32;
constexpr std::uint64_t many_boxes = 1u << 15;

/// The share of a window's steps that costs time: all (1), unless one of the sets is far smaller. Then bricks
/// are swept set by set (apart.hpp), and only the records of the other set are tested: 2ab / n^2 on average.
/// This is counted twice, because testing them takes more than their share of time.
template <int Dim, class T>
double share_of_windows(const Boxes<Dim, T>& boxes)
{
    const std::uint64_t a = boxes.a.size(), b = boxes.b.size();
    if (!boxes.cross || a + b < many_boxes || std::min(a, b) * far_smaller > std::max(a, b)) return 1;
    const double n = static_cast<double>(a + b);
    return 4 * (static_cast<double>(a) / n) * (static_cast<double>(b) / n);
}

using Clock = std::chrono::steady_clock;
double milliseconds(Clock::time_point from, Clock::time_point to)
{
    return std::chrono::duration<double, std::milli>(to - from).count();
}

} // namespace

/// One search: its stages, and the work of a task in each.
template <int Dim, class T>
class Engine::Search
{
  public:
    Search(Engine& engine, const Boxes<Dim, T>& boxes, const Request& request)
        : engine_(engine),
          kernels_(kernels_for(engine.options_.instruction_set)),
          boxes_(boxes),
          request_(request),
          shared_{boxes, request, engine.chunks_},
          share_(share_of_windows(boxes)),
          blocks_(engine.blocks_),
          jobs_(engine.jobs_),
          stores_(engine.stores_)
    {
        const std::size_t wanted = std::max<std::size_t>(1, boxes.size() / boxes_per_thread);
        slots_ = static_cast<std::uint32_t>(
            std::min<std::size_t>(std::max(1u, engine.executor_->concurrency()), wanted));
        engine.use_slots(slots_);
        blocks_.clear();
        jobs_.clear();
        engine.job_pool_->take_all_back();
        for (std::uint32_t s = 0; s < slots_; ++s)
            slot(s).start_search();
    }

    /// Returns false if the sink stopped it.
    bool operator()()
    {
        const ExactFloats exact;
        const auto t0 = Clock::now();
        const Grid<T> grid = choose_grid();
        const auto t1 = Clock::now();
        scatter(grid);
        const auto t2 = Clock::now();
        sweep_grid(grid, 0);
        while (!shared_.is_stopped() && take_jobs())
            run_jobs();
        const auto t3 = Clock::now();
        finish();

        Stats& total = engine_.stats;
        add_counts(total);
        total.ms_tune += milliseconds(t0, t1);
        total.ms_scatter += milliseconds(t1, t2);
        total.ms_sweep += milliseconds(t2, t3);
        total.ms_finish += milliseconds(t3, Clock::now());
        return !shared_.is_stopped();
    }

  private:
    using Out = Output<Dim, T>;

    Slot& slot(std::uint32_t s) { return *engine_.slots_[s]; }

    Grid<T> choose_grid()
    {
        Sample& sample = *slot(0).sample.reserve_exactly(1);
        sample_boxes(boxes_, sample);
        return tune<Dim, T>(sample, boxes_.size(), share_).grid;
    }

    /// Stores all boxes in the slots' stores.
    void scatter(const Grid<T>& grid)
    {
        const std::uint32_t units = Scatter<Dim, T>::units_of(boxes_);
        each_slot([&](Slot& mine, std::uint32_t s) {
            mine.store.clear(grid.bricks());
            Scatter<Dim, T> to_store(kernels_, boxes_, grid, mine.template unit<T>(), mine.store);
            const auto [first, last] = share_of(s, units);
            for (std::uint32_t u = first; u < last && !mine.bad_box; ++u)
                mine.bad_box = !to_store.add_unit(u);
            mine.store.close();
        });
        for (std::uint32_t s = 0; s < slots_; ++s)
            if (slot(s).bad_box) throw BadBox{};
    }

    /// The contiguous share of a slot, so that the slots' stores, one after another, are in the order of the
    /// boxes.
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> share_of(std::uint32_t s, std::uint32_t units) const
    {
        return {static_cast<std::uint32_t>(std::uint64_t{units} * s / slots_),
                static_cast<std::uint32_t>(std::uint64_t{units} * (s + 1) / slots_)};
    }

    /// Sweeps all bricks of a grid whose records are in the slots' stores.
    void sweep_grid(const Grid<T>& grid, int depth)
    {
        stores_.clear();
        for (std::uint32_t s = 0; s < slots_; ++s)
            stores_.push_back(&slot(s).store);
        const Bricks bricks{stores_, grid.bricks(), grid.axis[0]};
        const std::uint32_t per_block = (bricks.count + blocks_per_grid - 1) / blocks_per_grid;
        const std::uint32_t blocks = (bricks.count + per_block - 1) / per_block;
        claim_blocks(blocks, [&](Slot& mine, Out& out, std::uint32_t block) {
            const std::uint32_t end = std::min(bricks.count, (block + 1) * per_block);
            sweep_bricks(mine, out, bricks, block * per_block, end, depth);
        });
    }

    void sweep_bricks(Slot& mine, Out& out, const Bricks& bricks, std::uint32_t first, std::uint32_t last,
                      int depth)
    {
        for (std::uint32_t brick = first; brick < last && !shared_.is_stopped(); ++brick)
            sweep_brick(mine, out, bricks, brick, depth);
    }

    /// Sorts a brick's records and finds its pairs.
    void sweep_brick(Slot& mine, Out& out, const Bricks& bricks, std::uint32_t brick, int depth)
    {
        const std::uint32_t count = bricks.records(brick);
        mine.counts.records += count;
        mine.counts.bricks += count != 0;
        const bool sided = boxes_.cross || boxes_.loners < boxes_.a.size();
        if (count < 2 || (sided && !may_pair(bricks, brick, depth == 0))) return;
        const std::uint64_t windows = sort_brick(bricks, brick, count, mine);
        const double steps_per_row = static_cast<double>(windows) / step_size / count + 0.5;
        if (steps_per_row > coarse_steps && count < job_records && is_coarse(boxes_, mine, count) &&
            refine(mine, out, bricks, count, depth))
            return;
        if (steps_per_row > crowded_steps) {
            // If few meet many, a brick is swept apart rather than divided, unless that is too much work for
            // one task.
            Apart apart;
            const auto make_apart = [&] {
                return apart.make(mine.sorted.data(), mine.window_end.data(), count, kernels_, mine);
            };
            bool made = share_ < 1 && make_apart() && apart.candidates() <= job_candidates;
            if (!made && divide(mine, out, count, steps_per_row, depth)) return;
            made = made || (boxes_.cross && make_apart());
            if (made) {
                sweep_rows_apart(mine, out, apart, 0, count);
                return;
            }
        }
        const SortedBrick sorted = arrange(mine, mine.sorted.data(), mine.window_end.data(), count);
        FetchBrick next(bricks, brick + 1);
        for (std::uint32_t row = 0; row < count && !shared_.is_stopped(); row += rows_per_fetch) {
            next.chunks(rows_per_fetch / BrickStore::Chunk::capacity);
            mine.counts.steps +=
                kernels_.template sweep<Dim>()(sorted, row, std::min(count, row + rows_per_fetch), out);
        }
        out.resolve_ties();
    }

    SortedBrick arrange(Slot& mine, const Record* records, const std::uint32_t* window_end,
                        std::uint32_t count)
    {
        std::uint32_t* columns = mine.columns.reserve(std::size_t{padded(count)} * columns_per_record);
        SortedBrick sorted{count, columns, window_end};
        kernels_.arrange(records, sorted);
        return sorted;
    }

    void sweep_rows(Slot& mine, Out& out, const SortedBrick& brick, std::uint32_t first, std::uint32_t last)
    {
        mine.counts.steps += kernels_.template sweep<Dim>()(brick, first, last, out);
        out.resolve_ties();
    }

    void sweep_rows_apart(Slot& mine, Out& out, const Apart& brick, std::uint32_t first, std::uint32_t last)
    {
        mine.counts.steps += brick.sweep<Dim>(kernels_, first, last, mine, out);
        out.resolve_ties();
    }

    /// For a crowded brick, sorted in the slot: gives it its own grid, or makes it a job for all threads if
    /// it is too much for one. Returns false if the brick is best swept directly.
    bool divide(Slot& mine, Out& out, std::uint32_t count, double steps_per_row, int depth)
    {
        if (depth < deepest_nesting) {
            Sample& sample = *mine.sample.reserve_exactly(1);
            sample_records(boxes_, mine.sorted.data(), count, sample);
            const TunedGrid<T> tuned = tune<Dim, T>(sample, count);
            if (tuned.grid.bricks() > 1 && tuned.cost < worth_nesting * sweep_cost(steps_per_row)) {
                if (count >= job_records)
                    add_job(mine, out, Job::Kind::crowd, count).depth = depth + 1;
                else
                    sweep_nested(mine, out, tuned.grid, count, depth);
                return true;
            }
        }
        if (steps_per_row * count <= job_steps) return false;
        Job& job = add_job(mine, out, Job::Kind::brick, count);
        std::copy_n(mine.window_end.data(), count + 1, job.window_end.reserve(padded(count)));
        return true;
    }

    /// Gives the sorted records in the slot their own grid, and sweeps its bricks. These may overwrite the
    /// sorted records, which are then in the nested grid's store.
    void sweep_nested(Slot& mine, Out& out, const Grid<T>& grid, std::uint32_t count, int depth)
    {
        BrickStore& store = mine.nested_store(depth);
        ++mine.counts.nested;
        store.clear(grid.bricks());
        Scatter<Dim, T>(kernels_, boxes_, grid, mine.template unit<T>(), store)
            .add_records(mine.sorted.data(), count);
        store.close();
        const BrickStore* const stores[] = {&store};
        const std::uint32_t bricks = grid.bricks();
        sweep_bricks(mine, out, {stores, bricks, grid.axis[0]}, 0, bricks, depth + 1);
    }

    /// For a brick, sorted in the slot, whose boxes are smaller than its quanta, as in a town of a large
    /// world: cuts it along the sweep axis, and gives each part its own grid of one brick that fits its
    /// boxes. Returns false if it fits them already.
    bool refine(Slot& mine, Out& out, const Bricks& bricks, std::uint32_t count, int depth)
    {
        const std::span<const std::uint32_t> ends = cut_brick(mine, count);
        if (depth == deepest_nesting || (bricks.fitted && ends.size() == 1)) return false;
        const int axis = longest_axis_of(mine.sorted.data(), ends);
        const auto parts = static_cast<std::uint32_t>(ends.size());
        BrickStore& store = mine.nested_store(depth);
        ++mine.counts.nested;
        store.clear(parts);
        // Boxes that extend from earlier parts into the present one: copies on the axis that is cut.
        Record* const reaching = mine.apart.reserve(count);
        std::uint32_t* const row_of = mine.apart_place.reserve(count);
        std::uint32_t reach = 0, begin = 0;
        for (std::uint32_t part = 0; part < parts; begin = ends[part++]) {
            const std::uint32_t end = ends[part];
            const Grid<T> grid = fit_part(mine, begin, end, axis);
            Scatter<Dim, T> to_part(kernels_, boxes_, grid, mine.template unit<T>(), store, part);
            to_part.add_records(reaching, reach);
            to_part.add_records(mine.sorted.data() + begin, end - begin);
            std::uint32_t kept = 0;
            const auto keep = [&](const Record& record, std::uint32_t row) {
                if (mine.window_end.data()[row] <= end) return;
                reaching[kept] = record;
                reaching[kept].object |= copy_flag(bricks.sweep_axis);
                row_of[kept++] = row;
            };
            for (std::uint32_t k = 0; k < reach; ++k)
                keep(reaching[k], row_of[k]);
            for (std::uint32_t row = begin; row < end; ++row)
                keep(mine.sorted.data()[row], row);
            reach = kept;
        }
        store.close();
        const BrickStore* const stores[] = {&store};
        sweep_bricks(mine, out, {stores, parts, axis, true}, 0, parts, depth + 1);
        return true;
    }

    /// The user's axis on which boxes of one part are furthest apart, estimated from a few.
    int longest_axis_of(const Record* sorted, std::span<const std::uint32_t> ends) const
    {
        double length[3] = {0, 0, 0};
        std::uint32_t begin = 0;
        for (const std::uint32_t end : ends) {
            const Aabb<Dim, T> first = box_of(sorted[begin]),
                               middle = box_of(sorted[begin + (end - begin) / 2]);
            for (int d = 0; d < Dim; ++d)
                length[d] += std::abs(static_cast<double>(first.lo[d]) - static_cast<double>(middle.lo[d]));
            begin = end;
        }
        return static_cast<int>(std::max_element(length, length + Dim) - length);
    }
    Aabb<Dim, T> box_of(const Record& record) const { return boxes_[record.object & object_mask]; }

    Grid<T> fit_part(Slot& mine, std::uint32_t begin, std::uint32_t end, int axis)
    {
        Sample& sample = *mine.sample.reserve_exactly(1);
        const std::uint32_t step = (end - begin + fit_boxes - 1) / fit_boxes;
        sample.size = 0;
        for (std::uint32_t i = begin + step / 2; i < end; i += step, ++sample.size) {
            const Aabb<Dim, T> box = box_of(mine.sorted.data()[i]);
            for (int d = 0; d < Dim; ++d)
                sample.add(d, static_cast<double>(box.lo[d]), static_cast<double>(box.hi[d]));
        }
        return fit<Dim, T>(sample, axis);
    }

    Job& add_job(Slot& mine, const Out& out, Job::Kind kind, std::uint32_t count)
    {
        const std::uint32_t size = padded(count);
        Job& job = engine_.job_pool_->take(size, engine_.options_.memory);
        std::copy_n(mine.sorted.data(), size, job.records.reserve(size));
        job.kind = kind;
        job.block = out.block();
        job.number = static_cast<std::uint32_t>(mine.jobs.size());
        job.count = count;
        mine.jobs.push_back(&job);
        return job;
    }

    /// Collects the jobs that the slots have found, in an order that doesn't depend on which slot found them.
    bool take_jobs()
    {
        jobs_.clear();
        for (std::uint32_t s = 0; s < slots_; ++s) {
            Slot& each = slot(s);
            jobs_.insert(jobs_.end(), each.jobs.begin(), each.jobs.end());
            each.jobs.clear();
        }
        // A block's jobs come from one slot, numbered in the order of its bricks.
        std::sort(jobs_.begin(), jobs_.end(), [](const Job* x, const Job* y) {
            return x->block != y->block ? x->block < y->block : x->number < y->number;
        });
        return !jobs_.empty();
    }

    void run_jobs()
    {
        for (const Job* job : jobs_) {
            if (shared_.is_stopped()) return;
            if (job->kind == Job::Kind::crowd)
                sweep_crowd(*job);
            else
                sweep_by_rows(*job);
        }
    }

    /// Gives a crowd its own grid, as in a whole search.
    void sweep_crowd(const Job& job)
    {
        Sample& sample = *slot(0).sample.reserve_exactly(1);
        sample_records(boxes_, job.records.data(), job.count, sample);
        const Grid<T> grid = tune<Dim, T>(sample, job.count).grid;
        ++slot(0).counts.nested;
        const std::uint32_t units = Scatter<Dim, T>::units_of(job.count);
        each_slot([&](Slot& mine, std::uint32_t s) {
            mine.store.clear(grid.bricks());
            const auto [first_unit, last_unit] = share_of(s, units);
            const std::uint32_t first = first_unit * unit_size,
                                last = std::min(job.count, last_unit * unit_size);
            if (first < last)
                Scatter<Dim, T>(kernels_, boxes_, grid, mine.template unit<T>(), mine.store)
                    .add_records(job.records.data() + first, last - first);
            mine.store.close();
        });
        sweep_grid(grid, job.depth);
    }

    /// Sweeps a brick that can't be divided, by rows: all tasks read the same columns.
    void sweep_by_rows(const Job& job)
    {
        const auto each_part = [&](const auto& sweep) {
            claim_blocks((job.count + job_rows - 1) / job_rows,
                         [&](Slot& mine, Out& out, std::uint32_t part) {
                             sweep(mine, out, part * job_rows, std::min(job.count, (part + 1) * job_rows));
                         });
        };
        Apart apart;
        if (boxes_.cross &&
            apart.make(job.records.data(), job.window_end.data(), job.count, kernels_, slot(0))) {
            each_part([&](Slot& mine, Out& out, std::uint32_t first, std::uint32_t last) {
                sweep_rows_apart(mine, out, apart, first, last);
            });
            return;
        }
        const SortedBrick brick = arrange(slot(0), job.records.data(), job.window_end.data(), job.count);
        each_part([&](Slot& mine, Out& out, std::uint32_t first, std::uint32_t last) {
            sweep_rows(mine, out, brick, first, last);
        });
    }

    /// Distributes `count` new blocks of the result: calls body(slot, output, i) for each i, claimed one by
    /// one.
    template <class Body>
    void claim_blocks(std::uint32_t count, const Body& body)
    {
        const std::size_t base = blocks_.size();
        blocks_.resize(base + count);
        std::atomic<std::uint32_t> cursor{0};
        each_slot([&](Slot& mine, std::uint32_t s) {
            for (std::uint32_t i; (i = cursor.fetch_add(1, std::memory_order_relaxed)) < count;) {
                if (shared_.is_stopped()) return;
                const auto first = static_cast<std::uint32_t>(mine.segments.size());
                Out out(shared_, mine, base + i);
                body(mine, out, i);
                out.close();
                blocks_[base + i] = {s, first, static_cast<std::uint32_t>(mine.segments.size())};
            }
        });
    }

    /// Runs body(slot, s) for each slot on the executor; what a body throws is thrown here, the lowest slot's
    /// first.
    template <class Body>
    void each_slot(const Body& body)
    {
        auto task = [&](std::uint32_t s) {
            const ExactFloats exact;
            try {
                body(slot(s), s);
            } catch (...) {
                slot(s).error = std::current_exception();
                shared_.stopped = true;
            }
        };
        if (slots_ == 1)
            task(0);
        else
            run_tasks(*engine_.executor_, slots_, task);
        for (std::uint32_t s = 0; s < slots_; ++s)
            if (slot(s).error) std::rethrow_exception(slot(s).error);
    }

    /// Puts the segments in the order of their blocks, and ensures that next time no slot lacks memory.
    void finish()
    {
        engine_.next_block = request_.first_block + blocks_.size();
        std::size_t segments = 0;
        for (std::uint32_t s = 0; s < slots_; ++s)
            segments += slot(s).segments.size();
        for (std::uint32_t s = 0; s < slots_; ++s)
            if (slot(s).segments.capacity() < segments) slot(s).segments.reserve(segments + segments / 4);
        for (std::uint32_t s = 1; s < slots_; ++s)
            slot(0).match(slot(s));
        for (std::uint32_t s = 1; s < slots_; ++s)
            slot(s).match(slot(0));
        if (request_.sink) return;
        PairBufferAccess result(*request_.result);
        result.reserve_blocks(segments);
        for (const Block& block : blocks_)
            for (std::uint32_t k = block.first; k < block.last; ++k)
                result.append(slot(block.slot).segments[k]);
        if (slots_ > 1) engine_.chunks_.keep_spare(*request_.result, slots_);
    }

    void add_counts(Stats& total)
    {
        total.objects += boxes_.size();
        for (std::uint32_t s = 0; s < slots_; ++s) {
            const Counts& counts = slot(s).counts;
            total.records += counts.records;
            total.candidates += counts.steps * 2 * step_size;
            total.ties += counts.ties;
            total.bricks += counts.bricks;
            total.nested_grids += counts.nested;
        }
    }

    Engine& engine_;
    const Kernels& kernels_;
    const Boxes<Dim, T>& boxes_;
    const Request& request_;
    Shared<Dim, T> shared_;
    const double share_; // of a window that a row is tested against
    std::uint32_t slots_;
    std::pmr::vector<Block>& blocks_;
    std::pmr::vector<Job*>& jobs_;
    std::pmr::vector<const BrickStore*>& stores_;
};

std::span<Pair> ResultChunks::next(PairBuffer& result, std::size_t pairs)
{
    const std::lock_guard lock(mutex_);
    const std::span<Pair> chunk = PairBufferAccess(result).chunk(used_, pairs);
    ++used_; // only now: after a failure, other threads still request theirs
    return chunk;
}

void ResultChunks::keep_spare(PairBuffer& result, std::uint32_t tasks)
{
    const std::uint64_t chunks = result.bytes_reserved() / (chunk_pairs * sizeof(Pair));
    if (chunks < used_ + tasks) reserve(result, used_ + 2 * tasks + used_ / 16);
}

void ResultChunks::reserve(PairBuffer& result, std::uint64_t chunks)
{
    for (std::uint64_t c = result.bytes_reserved() / (chunk_pairs * sizeof(Pair)); c < chunks; ++c)
        PairBufferAccess(result).chunk(c, chunk_pairs);
}

Engine::Engine(const FinderOptions& options)
    : options_(options),
      executor_(options.executor != nullptr ? options.executor : &default_executor()),
      job_pool_(std::make_unique<JobPool>()),
      blocks_(options.memory),
      jobs_(options.memory),
      stores_(options.memory)
{
}

Engine::~Engine() = default;

void Engine::use_slots(std::uint32_t count)
{
    while (slots_.size() < count)
        slots_.push_back(std::make_unique<Slot>(options_.memory));
    stores_.reserve(count);
}

std::uint64_t Engine::bytes() const noexcept
{
    std::uint64_t sum = job_pool_->bytes();
    for (const auto& each : slots_)
        sum += each->bytes();
    return sum;
}

void Engine::release()
{
    slots_.clear();
    job_pool_->release();
    blocks_ = std::pmr::vector<Block>(options_.memory);
    jobs_ = std::pmr::vector<Job*>(options_.memory);
    stores_ = std::pmr::vector<const BrickStore*>(options_.memory);
}

void Engine::begin_call() noexcept
{
    stats = {};
    next_block = 0;
    chunks_.begin_call();
}

void Engine::match(const Engine& other)
{
    use_slots(static_cast<std::uint32_t>(other.slots_.size()));
    for (std::size_t s = 0; s < other.slots_.size(); ++s) {
        slots_[s]->match(*other.slots_[s]);
        slots_[s]->store.match(other.slots_[s]->store); // sizes depend on the boxes here, not on chance
    }
    job_pool_->match(*other.job_pool_, options_.memory);
    blocks_.reserve(other.blocks_.capacity());
    jobs_.reserve(other.jobs_.capacity());
}

/// Without a grid: see few.hpp. The second of two sets is processed part by part.
template <int Dim, class T>
bool Engine::search_few(const Boxes<Dim, T>& boxes, const Request& request)
{
    const ExactFloats exact;
    use_slots(1);
    Slot& slot = *slots_[0];
    const std::uint64_t n = boxes.size(),
                        most = boxes.cross ? boxes.a.size() * boxes.b.size() : n * (n - (n != 0)) / 2;
    // In big steps, so that a scene whose size fluctuates doesn't allocate at every new box.
    const std::size_t room = std::bit_ceil(std::min(static_cast<std::size_t>(most) + 8, chunk_pairs));
    const auto new_chunk = [&] {
        return request.sink ? slot.to_sink.reserve_exactly(room) : chunks_.next(*request.result, room).data();
    };
    if (request.sink) // it may get the pairs of the first parts before the others have been checked
        for (std::size_t k = few_boxes; k < boxes.b.size(); ++k)
            if (!valid(boxes.b[k])) throw BadBox{};
    Pair *first = new_chunk(), *end = first;
    std::uint32_t told = 0;
    const auto tell = [&] {
        if (request.offset_a != 0 || request.offset_b != 0)
            for (Pair* pair = first; pair != end; ++pair)
                *pair = {pair->a + request.offset_a, pair->b + request.offset_b};
        if (request.select && first != end) end = request.select(first, end);
        if (first == end) return true;
        const std::span<const Pair> pairs(first, end);
        if (request.sink) return request.sink({pairs, request.first_block, told++});
        PairBufferAccess result(*request.result);
        result.reserve_blocks(1);
        result.append(pairs);
        return true;
    };
    for (std::size_t begin = 0; begin == 0 || begin < boxes.b.size(); begin += few_boxes) {
        Boxes<Dim, T> part = boxes;
        part.b = boxes.b.subview(begin, std::min<std::size_t>(few_boxes, boxes.b.size() - begin));
        const std::size_t part_room = boxes.cross ? part.a.size() * part.b.size() + 8 : room;
        if (room - static_cast<std::size_t>(end - first) < part_room) {
            if (!tell()) return false;
            first = end = new_chunk();
        }
        Pair* const here = end;
        end = find_among_few(options_.instruction_set, part, slot.unit<T>(), here);
        if (end == nullptr) throw BadBox{};
        for (Pair* pair = here; begin != 0 && pair != end; ++pair)
            pair->b += static_cast<std::uint32_t>(begin);
    }
    stats.objects += n;
    stats.candidates += most;
    next_block = request.first_block + 1;
    return tell();
}

template <int Dim, class T>
bool Engine::search(const Boxes<Dim, T>& boxes, const Request& request)
{
    return are_few(boxes) ? search_few(boxes, request) : Search<Dim, T>(*this, boxes, request)();
}

template bool Engine::search(const Boxes<2, float>&, const Request&);
template bool Engine::search(const Boxes<2, double>&, const Request&);
template bool Engine::search(const Boxes<3, float>&, const Request&);
template bool Engine::search(const Boxes<3, double>&, const Request&);

} // namespace engine
JOSTLE_NAMESPACE_END
