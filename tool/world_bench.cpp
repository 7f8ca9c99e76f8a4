// SPDX-License-Identifier: MIT
// jostle bench world: what an update of a world costs in which some objects move, and queries right after
// one; ours and other systems'.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "asker.hpp"
#include "bench_run.hpp"
#include "bench_systems.hpp"
#include "clock.hpp"
#include "commands.hpp"
#include "jostle/box_index.hpp"
#include "jostle/world.hpp"
#include "numbers.hpp"
#include "progress.hpp"
#include "threads.hpp"
#include "tool/scenes/random.hpp"
#include "tool/scenes/scenes.hpp"

namespace jostle_tool {

namespace {

using jostle::Aabb3f;
using jostle::ObjectId;
using jostle_bench::QueryKind;

struct SceneInfo
{
    [[nodiscard]] bool is(std::string_view scene) const { return scene == name; }

    const char* name;
    const char* summary;
    std::uint64_t objects;                // 0: those given with -n
    std::uint64_t movers;                 // 0: as many as the scene says
    std::optional<QueryBatch> asked = {}; // not the update is timed, but this, asked after each
};
constexpr SceneInfo scenes[] = {
    {"resting", "a twentieth of the boxes moves", 0, 0},
    {"moving", "all boxes move", 0, 0},
    {"static-1m", "1,000,000 boxes at rest, 100 that move", 1'000'000, 100},
    {"static-2m", "2,000,000 boxes at rest, 2,000 that move", 2'000'000, 2'000},
    {"churn",
     "1 in 20 boxes moves, others every 8 frames; 1 in 200 is replaced, or gets a new place or filter", 0, 0},
    {"breathe", "1,000 boxes of a pile, each of which moves to and fro by a 500th of its edge", 1'001, 0},
    {"small", "1,000 worlds of 8 boxes are made, updated once and dropped", 8'000, 0},
    {"others", "20,000 boxes, of which 1,000 move, others in each frame", 20'000, 0},
    {"same", "20,000 boxes, of which 1,000 move, the same in each frame", 20'000, 0},
    {"few", "30,000 boxes that moved and stopped up to 64 frames before; one more is added", 30'000, 0},
    {"rollback",
     "100,000 boxes, of which 1,000 move; each frame is saved, goes back to the last and again to it",
     100'000, 1'000},
    {"rays", "as resting; timed are 4,000 queries after each update: the first box along a ray", 0, 0,
     QueryBatch{QueryKind::first, 4000}},
    {"overlaps", "... all boxes that touch a box of edge 10", 0, 0, QueryBatch{QueryKind::box, 4000, 10}},
    {"nearest", "... the 8 boxes nearest to a point", 0, 0, QueryBatch{QueryKind::nearest, 4000, 8}},
    {"masked", "... all of every eleventh box that touch a box of edge 10: a mask says which", 0, 0,
     QueryBatch{QueryKind::box, 4000, 10}},
    {"counted", "... how many of every eleventh box do", 0, 0, QueryBatch{QueryKind::box, 4000, 10, true}},
};

constexpr std::uint32_t warm_up = 8;
/// A system that takes longer than this for a scene stops early, with at least `fewest` frames.
constexpr double patience_ms = 20'000;
constexpr std::uint32_t fewest = 5;

constexpr std::uint32_t kinds_of_masked = 11; // one box in so many is what is asked for

/// The ground, and on it layers of boxes of edge 1, shifted by half a box from layer to layer: each touches
/// the next one of its row and four above it.
std::vector<Aabb3f> pile(std::uint64_t boxes)
{
    std::vector<Aabb3f> all = {{{-2, -1, -2}, {13, 0.01f, 13}}};
    for (std::uint64_t k = 0; k + 1 < boxes; ++k) {
        const std::uint64_t layer = k / 100;
        const float shift = layer % 2 == 0 ? 0.0f : 0.5f;
        const float lo[3] = {1.03f * static_cast<float>(k % 10) + shift, 0.99f * static_cast<float>(layer),
                             0.99f * static_cast<float>(k / 10 % 10) + shift};
        all.push_back({{lo[0], lo[1], lo[2]}, {lo[0] + 1, lo[1] + 1, lo[2] + 1}});
    }
    return all;
}

constexpr std::uint32_t frames_at_rest = 64; // of scene few, after each in which all move

/// Boxes, and which of them a frame moves.
class Motion
{
  public:
    Motion(const SceneInfo& info, std::uint64_t n, std::uint64_t seed)
        : info_(info),
          scene_(info.is("resting") || info.asked ? "resting" : "uniform", n, seed),
          boxes_(scene_.boxes().begin(), scene_.boxes().end()),
          random_(seed, 77, 1)
    {
        if (info.is("breathe")) base_ = boxes_ = pile(n);
        for (const Aabb3f& box : boxes_)
            for (int d = 0; d < 3; ++d)
                extent_ = std::max(extent_, box.hi[d]);
        const std::uint64_t movers = info.movers != 0 ? info.movers : n;
        for (std::uint64_t k = 0; k < movers && info.movers != 0; ++k) {
            moved_.push_back(static_cast<std::uint32_t>(k * n / movers));
            for (int d = 0; d < 3; ++d)
                velocity_.push_back(static_cast<float>(random_.uniform(-0.1, 0.1)));
        }
    }

    void step()
    {
        ++frame_;
        if (info_.movers != 0) {
            for (std::size_t k = 0; k < moved_.size(); ++k)
                for (std::size_t d = 0; d < 3; ++d) {
                    Aabb3f& box = boxes_[moved_[k]];
                    float& v = velocity_[3 * k + d];
                    if (box.lo[d] + v < 0 || box.hi[d] + v > extent_) v = -v;
                    box.lo[d] += v;
                    box.hi[d] += v;
                }
        } else if (info_.is("churn")) {
            moved_.clear();
            leapt_.clear();
            for (std::uint32_t i = 0; i < boxes_.size(); ++i) {
                const std::uint32_t turn = (i + frame_ / 8) % 20;
                const bool leaps = random_.below(200) == 0;
                if (turn != 0 && !leaps) continue;
                moved_.push_back(i);
                if (leaps) leapt_.push_back(i);
                for (int d = 0; d < 3; ++d) {
                    const float size = boxes_[i].hi[d] - boxes_[i].lo[d];
                    const auto by = static_cast<float>(random_.uniform(-0.1, 0.1));
                    float lo = leaps ? static_cast<float>(random_.uniform()) * extent_ : boxes_[i].lo[d] + by;
                    lo = std::clamp(lo, 0.0f, extent_ - size);
                    boxes_[i].lo[d] = lo;
                    boxes_[i].hi[d] = lo + size;
                }
            }
        } else if (!base_.empty()) {
            moved_.clear();
            for (std::uint32_t i = 1; i < boxes_.size(); ++i) { // all but the ground
                moved_.push_back(i);
                for (int d = 0; d < 3; ++d) {
                    const auto by = static_cast<float>(random_.uniform(-0.002, 0.002));
                    boxes_[i].lo[d] = base_[i].lo[d] + by;
                    boxes_[i].hi[d] = base_[i].hi[d] + by;
                }
            }
        } else if (info_.is("few")) {
            moved_.clear();
            if (frame_ % frames_at_rest != 0) return;
            scene_.step();
            for (std::uint32_t i = 0; i < boxes_.size(); ++i) {
                moved_.push_back(i);
                boxes_[i] = scene_.boxes()[i];
            }
        } else if (info_.is("others") || info_.is("same")) {
            const bool others = info_.is("others");
            moved_.clear();
            for (std::uint32_t i = 0; i < boxes_.size(); ++i) {
                if (others ? random_.below(20) != 0 : i % 20 != 0) continue;
                moved_.push_back(i);
                for (int d = 0; d < 3; ++d) {
                    const auto by = static_cast<float>(random_.uniform(-0.05, 0.05));
                    boxes_[i].lo[d] += by;
                    boxes_[i].hi[d] += by;
                }
            }
        } else {
            scene_.step();
            moved_.clear();
            for (std::uint32_t i = 0; i < boxes_.size(); ++i) {
                const Aabb3f &from = boxes_[i], &to = scene_.boxes()[i];
                if (from.lo != to.lo || from.hi != to.hi) {
                    moved_.push_back(i);
                    boxes_[i] = to;
                }
            }
        }
    }

    [[nodiscard]] std::span<const Aabb3f> boxes() const { return boxes_; }
    [[nodiscard]] std::span<const std::uint32_t> moved() const { return moved_; }
    /// Of these, the ones that are elsewhere now.
    [[nodiscard]] std::span<const std::uint32_t> leapt() const { return leapt_; }

  private:
    const SceneInfo& info_;
    jostle_scenes::Scene<3, float> scene_;
    std::vector<Aabb3f> boxes_;
    std::vector<Aabb3f> base_; // of a pile that breathes
    std::vector<std::uint32_t> moved_, leapt_;
    std::vector<float> velocity_;
    jostle_scenes::Random random_;
    float extent_ = 0;
    std::uint32_t frame_ = 0;
};

using WorldSystem = System<3, float>;

/// Identities, events and filters on, as they always are.
class Ours final : public WorldSystem
{
  public:
    /// `kinds`: one box in so many is of a category of its own, category 2.
    explicit Ours(jostle::Executor& executor, std::size_t kinds = 0)
        : world_({.executor = &executor,
                  .layers = kinds == 0 ? std::vector<jostle::QueryLayer>{}
                                       : std::vector<jostle::QueryLayer>{{.mask = 2}}}),
          kinds_(kinds)
    {
    }
    void start(std::span<const Aabb3f> boxes) override
    {
        ids_.resize(boxes.size());
        if (kinds_ == 0) world_.add(boxes, ids_);
        for (std::size_t i = 0; i < boxes.size() && kinds_ != 0; ++i)
            ids_[i] = world_.add(boxes[i], {.filter = {.category = i % kinds_ == 0 ? 2u : 1u}});
        while (world_.stats().active != 0 || world_.stats().objects == 0)
            world_.update();
    }
    void frame(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> moved) override
    {
        if (moved.size() == boxes.size()) {
            world_.update(ids_, boxes);
            return;
        }
        moved_ids_.clear();
        moved_boxes_.clear();
        for (const std::uint32_t i : moved) {
            moved_ids_.push_back(ids_[i]);
            moved_boxes_.push_back(boxes[i]);
        }
        world_.update(moved_ids_, moved_boxes_);
    }
    /// In turn replaced by another object, moved, and given another filter, which lets all pass as well.
    void leap(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> leapt) override
    {
        for (std::size_t k = 0; k < leapt.size(); ++k) {
            ObjectId& id = ids_[leapt[k]];
            const Aabb3f& box = boxes[leapt[k]];
            if (k % 3 == 0) {
                world_.remove(id);
                id = world_.add(box);
            } else if (k % 3 == 1) {
                world_.move(id, box);
            } else {
                world_.set_filter(id, {.category = 1u << k / 3 % 8});
            }
        }
    }
    Answer answer() override { return pairs_of(world_, ids_); }
    Stages stages() const override { return stages_of(world_.stats()); }

    [[nodiscard]] const jostle::World3f& world() const { return world_; }
    /// Of the box that is this object's: as nobody is replaced but in churn, its place in the order of
    /// adding.
    [[nodiscard]] std::uint32_t number(ObjectId id) const { return id.index; }

  private:
    jostle::World3f world_;
    std::size_t kinds_;
    std::vector<ObjectId> ids_, moved_ids_;
    std::vector<Aabb3f> moved_boxes_;
};

/// All move now and then, which isn't timed; adding one more, instead of the last, is.
class OursFew final : public WorldSystem
{
  public:
    explicit OursFew(jostle::Executor& executor) : world_({.executor = &executor}) {}
    void start(std::span<const Aabb3f> boxes) override
    {
        ids_.resize(boxes.size());
        world_.add(boxes, ids_);
        world_.update();
    }
    void before(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> moved) override
    {
        if (!moved.empty()) world_.update(ids_, boxes);
    }
    void frame(std::span<const Aabb3f> boxes, std::span<const std::uint32_t>) override
    {
        if (one_.generation != 0) world_.remove(one_);
        one_ = world_.add(boxes[next_++ * 7919 % boxes.size()]);
        world_.update();
    }
    Answer answer() override { return {world_.began().size(), world_.began().size()}; }
    Stages stages() const override { return stages_of(world_.stats()); }

  private:
    jostle::World3f world_;
    std::vector<ObjectId> ids_;
    ObjectId one_;
    std::size_t next_ = 0;
};

/// Each frame is saved, whole or as what has changed since the start. Then the world goes back to the frame
/// before, and again to this one.
class OursRollback final : public WorldSystem
{
  public:
    OursRollback(jostle::Executor& executor, bool whole) : world_({.executor = &executor}), whole_(whole) {}
    void start(std::span<const Aabb3f> boxes) override
    {
        ids_.resize(boxes.size());
        world_.add(boxes, ids_);
        do
            world_.update();
        while (world_.stats().active != 0);
        if (!whole_) (void)world_.save_base();
        save();
    }
    void frame(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> moved) override
    {
        moved_ids_.clear();
        moved_boxes_.clear();
        for (const std::uint32_t i : moved) {
            moved_ids_.push_back(ids_[i]);
            moved_boxes_.push_back(boxes[i]);
        }
        const Clock::time_point t0 = Clock::now();
        world_.update(moved_ids_, moved_boxes_);
        const Clock::time_point t1 = Clock::now();
        saved_.swap(before_);
        save();
        const Clock::time_point t2 = Clock::now();
        restore(before_);
        restore(saved_);
        const Clock::time_point t3 = Clock::now();
        update_ms_ = ms_between(t0, t1);
        save_ms_ = ms_between(t1, t2);
        restore_ms_ = ms_between(t2, t3) / 2;
    }
    Answer answer() override { return pairs_of(world_, ids_); }
    Stages stages() const override
    {
        return {{"update", update_ms_}, {"save", save_ms_}, {"restore", restore_ms_}};
    }
    std::uint64_t bytes() const override { return saved_.size(); }

  private:
    void save()
    {
        if (whole_)
            saved_ = world_.save();
        else
            world_.save_changes(saved_);
    }
    void restore(const std::vector<std::byte>& bytes)
    {
        if (whole_)
            world_.restore(bytes);
        else
            world_.restore_changes(bytes);
    }

    jostle::World3f world_;
    const bool whole_;
    std::vector<ObjectId> ids_, moved_ids_;
    std::vector<Aabb3f> moved_boxes_;
    std::vector<std::byte> saved_, before_;
    double update_ms_ = 0, save_ms_ = 0, restore_ms_ = 0;
};

/// A world for every few boxes, made and dropped in each frame.
class OursSmall final : public WorldSystem
{
  public:
    explicit OursSmall(jostle::Executor& executor) : executor_(executor) {}
    void frame(std::span<const Aabb3f> boxes, std::span<const std::uint32_t>) override
    {
        pairs_ = 0;
        ObjectId ids[boxes_each];
        for (std::size_t first = 0; first + boxes_each <= boxes.size(); first += boxes_each) {
            jostle::World3f world({.executor = &executor_});
            world.add(boxes.subspan(first, boxes_each), ids);
            world.update();
            pairs_ += world.began().size();
        }
    }
    Answer answer() override { return {pairs_, pairs_}; }

  private:
    static constexpr std::size_t boxes_each = 8;
    jostle::Executor& executor_;
    std::uint64_t pairs_ = 0;
};

/// Queries to a world that has just been updated.
class OursAsked final : public WorldSystem
{
  public:
    OursAsked(jostle::Executor& executor, const QueryBatch& batch, const jostle_bench::Queries& queries,
              bool masked)
        : world_(executor, masked ? kinds_of_masked : 0),
          batch_(batch),
          queries_(queries),
          is_masked_(masked),
          filter_{.mask = masked ? 2 : ~0u},
          firsts_(batch.queries),
          counts_(batch.queries)
    {
    }
    void start(std::span<const Aabb3f> boxes) override { world_.start(boxes); }
    void before(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> moved) override
    {
        world_.frame(boxes, moved);
    }
    void frame(std::span<const Aabb3f>, std::span<const std::uint32_t>) override
    {
        const jostle::World3f& world = world_.world();
        const Clock::time_point begin = Clock::now();
        if (!is_masked_) (void)world.any(jostle::Aabb3f{}); // the first one brings the index up to date
        index_ms_ = ms_since(begin);
        switch (batch_.kind) {
        case QueryKind::first:
            world.first(std::span<const jostle::Ray3f>(queries_.rays), firsts_);
            break;
        case QueryKind::box:
            if (batch_.only_count)
                world.count(std::span<const Aabb3f>(queries_.boxes), std::span(counts_), filter_);
            else
                world.all(std::span<const Aabb3f>(queries_.boxes), ids_, filter_);
            break;
        default:
            world.nearest(queries_.nearest, hits_);
        }
    }
    Answer answer() override
    {
        jostle_bench::Answers answers;
        for (std::size_t i = 0; i < batch_.queries; ++i) {
            if (batch_.kind == QueryKind::first) {
                if (firsts_[i].id.generation != 0) answers.add_object(i, world_.number(firsts_[i].id));
            } else if (batch_.only_count) {
                answers.results += counts_[i];
            } else if (batch_.kind == QueryKind::box) {
                for (const ObjectId id : ids_[i])
                    answers.add_object(i, world_.number(id));
            } else {
                for (const jostle::Hit<float, jostle::ObjectId>& hit : hits_[i])
                    answers.add_distance(i, hit.at);
            }
        }
        return {answers.results, answers.checksum};
    }
    Stages stages() const override
    {
        return {{"update", world_.world().stats().us_total / 1e3}, {"index", index_ms_}};
    }

  private:
    Ours world_;
    const QueryBatch& batch_;
    const jostle_bench::Queries& queries_;
    const bool is_masked_;
    const jostle::ObjectQueryFilter filter_;
    std::vector<jostle::Hit<float, jostle::ObjectId>> firsts_;
    std::vector<std::uint64_t> counts_;
    jostle::ResultLists<ObjectId> ids_;
    jostle::ResultLists<jostle::Hit<float, jostle::ObjectId>> hits_;
    double index_ms_ = 0;
};

/// What a program that knows whom it will ask for may keep instead of a mask: an index of these alone.
class OwnIndex final : public WorldSystem
{
  public:
    OwnIndex(jostle::Executor& executor, const QueryBatch& batch, const jostle_bench::Queries& queries)
        : index_({.executor = &executor}), batch_(batch), queries_(queries), counts_(batch.queries)
    {
    }
    void start(std::span<const Aabb3f> boxes) override
    {
        moved_ids_.clear();
        moved_boxes_.clear();
        for (std::uint32_t i = 0; i < boxes.size(); i += kinds_of_masked) {
            moved_ids_.push_back(i);
            moved_boxes_.push_back(boxes[i]);
        }
        index_.build(moved_ids_, jostle::box_view(moved_boxes_));
    }
    void frame(std::span<const Aabb3f> boxes, std::span<const std::uint32_t> moved) override
    {
        const Clock::time_point begin = Clock::now();
        moved_ids_.clear();
        moved_boxes_.clear();
        for (const std::uint32_t i : moved)
            if (i % kinds_of_masked == 0) {
                moved_ids_.push_back(i);
                moved_boxes_.push_back(boxes[i]);
            }
        index_.move(moved_ids_, jostle::box_view(moved_boxes_));
        index_ms_ = ms_since(begin);
        if (batch_.only_count)
            index_.count(std::span<const Aabb3f>(queries_.boxes), std::span(counts_));
        else
            index_.all(std::span<const Aabb3f>(queries_.boxes), ids_);
    }
    Answer answer() override
    {
        jostle_bench::Answers answers;
        for (std::size_t i = 0; i < batch_.queries; ++i) {
            if (batch_.only_count) {
                answers.results += counts_[i];
                continue;
            }
            for (const std::uint32_t id : ids_[i])
                answers.add_object(i, id);
        }
        return {answers.results, answers.checksum};
    }
    Stages stages() const override { return {{"index", index_ms_}}; }

  private:
    jostle::BoxIndex3f index_;
    const QueryBatch& batch_;
    const jostle_bench::Queries& queries_;
    std::vector<std::uint32_t> moved_ids_;
    std::vector<Aabb3f> moved_boxes_;
    std::vector<std::uint64_t> counts_;
    jostle::ResultLists<std::uint32_t> ids_;
    double index_ms_ = 0;
};

#ifdef JOSTLE_WITH_PEERS
/// The k-th of them, made anew each time that boxes have moved: its structure is built once. That isn't
/// timed.
class PeerAsked final : public WorldSystem
{
  public:
    PeerAsked(std::size_t k, const QueryBatch& batch, const jostle_bench::Queries& queries,
              std::uint32_t threads)
        : k_(k), batch_(batch), queries_(queries), threads_(threads)
    {
    }
    void before(std::span<const Aabb3f> boxes, std::span<const std::uint32_t>) override
    {
        asked_.reset();
        peer_ = std::move(jostle_bench::make_query_peers()[k_]);
        peer_->build(boxes);
        asked_.emplace(*peer_, batch_, queries_, threads_);
    }
    void frame(std::span<const Aabb3f>, std::span<const std::uint32_t>) override { asked_->ask(); }
    Answer answer() override
    {
        const jostle_bench::Answers answers = asked_->answers();
        return {answers.results, answers.checksum};
    }

  private:
    std::size_t k_;
    const QueryBatch& batch_;
    const jostle_bench::Queries& queries_;
    std::uint32_t threads_;
    std::unique_ptr<jostle_bench::QueryPeer> peer_;
    std::optional<AskedPeer> asked_;
};
#endif

struct Measurement
{
    std::vector<double> ms; // sorted
    Stages stages;
    Answer answer; // of the last warm-up frame
    std::uint64_t bytes = 0;
};

Measurement measure(WorldSystem& system, Motion motion, std::uint32_t frames, Progress& progress)
{
    Measurement result;
    std::vector<Stages> stages;
    system.start(motion.boxes());
    const Clock::time_point begin = Clock::now();
    for (std::uint32_t frame = 0; frame < warm_up + frames; ++frame) {
        motion.step();
        system.before(motion.boxes(), motion.moved());
        const Clock::time_point before = Clock::now();
        system.leap(motion.boxes(), motion.leapt());
        system.frame(motion.boxes(), motion.moved());
        const Clock::time_point after = Clock::now();
        if (frame + 1 == warm_up) result.answer = system.answer();
        if (frame < warm_up) continue;
        progress.step();
        result.ms.push_back(ms_between(before, after));
        stages.push_back(system.stages());
        if (result.ms.size() >= std::min(fewest, frames) && ms_between(begin, after) > patience_ms) break;
    }
    result.bytes = system.bytes();
    system.stop();
    std::sort(result.ms.begin(), result.ms.end());
    result.stages = typical(stages);
    return result;
}

class Table : public BenchTable
{
  public:
    explicit Table(const BenchOptions& options) : BenchTable(options)
    {
        if (shown())
            std::printf("%-10s %10s %7s  %-10s %10s %9s %9s %9s %11s\n", "scene", "n", "threads", "system",
                        "median ms", "min", "p99", "max", "found");
    }

    void add_row(const std::string& system, const SceneInfo& scene, std::uint64_t n, std::uint64_t moved,
                 std::uint32_t threads, const Measurement& m)
    {
        const auto at = [&](double share) {
            return rounded(m.ms[std::min(
                m.ms.size() - 1, static_cast<std::size_t>(share * static_cast<double>(m.ms.size())))]);
        };
        JsonRow row{{"system", system},
                    {"scene", scene.name},
                    {"n", n},
                    {"threads", threads},
                    {"median_ms", rounded(median(m.ms))},
                    {"min_ms", at(0)},
                    {"p99_ms", at(0.99)},
                    {"max_ms", at(1)}};
        if (scene.asked) row.set("queries", scene.asked->queries);
        row.set(scene.asked ? "results" : "pairs", m.answer.found);
        row.set("checksum", hex(m.answer.checksum));
        row.set("stages", row_of(m.stages));
        if (m.bytes != 0) row.set("bytes", m.bytes);
        row.set("moved", moved);
        row.set("dim", 3);
        row.set("type", "float");
        row.set("frames", m.ms.size());
        if (answered_ && !(answer_ == m.answer)) {
            row.set("differs", true);
            differ(std::string("scene ") + scene.name + ", n = " + std::to_string(n) + ": " + system +
                   " finds " + std::to_string(m.answer.found) + ", jostle " + std::to_string(answer_.found));
        }
        if (!answered_) answer_ = m.answer;
        answered_ = true;
        if (shown()) {
            std::string remark = m.stages.empty() ? "" : " " + text_of(m.stages);
            if (m.bytes != 0) remark += " bytes " + grouped(m.bytes);
            std::printf("%-10s %10s %7u  %-10s %10.4f %9.4f %9.4f %9.4f %11s %s\n", scene.name,
                        grouped(n).c_str(), threads, system.c_str(), median(m.ms), at(0), at(0.99), at(1),
                        grouped(m.answer.found).c_str(), remark.c_str());
            std::fflush(stdout);
        }
        add(row);
    }
    void next_scene() { answered_ = false; }

  private:
    bool answered_ = false;
    Answer answer_;
};

void measure_scene(const BenchOptions& options, const SceneInfo& info, std::uint64_t n, Table& table)
{
    Motion motion(info, n, options.seed);
    Motion ahead = motion;
    ahead.step();
    const std::uint64_t moved = ahead.moved().size();
    const bool all_move = info.is("moving");
    for (const std::uint32_t count : options.threads) {
        const Threads threads(count);
        const auto one = [&](WorldSystem& system, const std::string& name, std::uint32_t used) {
            Measurement measurement;
            {
                Progress progress(std::string(info.name) + ", " + grouped(n) + " boxes, " + name,
                                  options.frames);
                measurement = measure(system, motion, options.frames, progress);
            }
            table.add_row(name, info, n, moved, used, measurement);
        };
        if (info.asked) {
            const bool masked = info.is("masked") || info.is("counted");
            const jostle_bench::Queries queries = Asker(motion.boxes(), options.seed).make(*info.asked);
            {
                OursAsked ours(threads.executor(), *info.asked, queries, masked);
                one(ours, "jostle", threads.count());
            }
            if (masked) {
                OwnIndex alone(threads.executor(), *info.asked, queries);
                one(alone, "own index", threads.count());
            }
#ifdef JOSTLE_WITH_PEERS
            if (!options.peers || masked) continue;
            const auto peers = jostle_bench::make_query_peers();
            for (std::size_t k = 0; k < peers.size(); ++k) {
                if (!peers[k]->answers(info.asked->kind)) continue;
                PeerAsked theirs(k, *info.asked, queries, threads.count());
                one(theirs, peers[k]->name(), threads.count());
            }
#endif
            continue;
        }
        if (info.is("small")) {
            OursSmall ours(threads.executor());
            one(ours, "jostle", threads.count());
            continue;
        }
        if (info.is("rollback")) {
            for (const bool whole : {true, false}) {
                OursRollback ours(threads.executor(), whole);
                one(ours, whole ? "whole" : "changes", threads.count());
            }
            continue;
        }
        if (info.is("few")) {
            OursFew ours(threads.executor());
            one(ours, "jostle", threads.count());
            continue;
        }
        {
            Ours ours(threads.executor());
            one(ours, "jostle", threads.count());
        }
        if (all_move) {
            FinderSystem<3, float> stateless({.executor = &threads.executor()});
            one(stateless, "stateless", threads.count());
        }
#ifdef JOSTLE_WITH_PEERS
        if (!options.peers) continue;
        for (const auto& peer : jostle_bench::make_peers<3>()) {
            const jostle_bench::PeerInfo& peer_info = peer->info();
            // Those that keep a structure from frame to frame, and the fastest of those that don't.
            const std::string name = peer_info.name;
            if (name != "bullet" && name != "fcl" && name != "embree") continue;
            if (!peer_info.uses_threads && count != options.threads.front()) continue;
            if (n > std::max(peer_info.max_objects, name == "bullet" ? 2'000'000u : 0u)) continue;
            const std::uint32_t used = peer_info.uses_threads ? threads.count() : 1;
            PeerSystem<3> system(*peer, used);
            one(system, name, used);
        }
#endif
    }
    table.next_scene();
}

void run(const BenchOptions& options)
{
    const std::vector<const SceneInfo*> wanted = choose(options.names, scenes, "scene of bench world");
    Table table(options);
    for (const SceneInfo* info : wanted)
        for (const std::uint64_t n : options.sizes) {
            measure_scene(options, *info, info->objects != 0 ? info->objects : n, table);
            if (info->objects != 0) break;
        }
    table.finish();
}

} // namespace

void add_bench_world_command(const Command& bench)
{
    const auto [command, options] = add_bench_part(
        bench, "world", "Times updates of a world, and queries", listed("Scenes", scenes, 11) + R"(
Times of updates include handing over the boxes that moved, and the lists of pairs that began, persist and
ended. Times of queries include updating the index of moving objects (stage index); other systems' structures
are rebuilt outside the time. The rows `own index` use an index of the objects that the mask selects. If answers
differ, the exit status is 1.

Examples:
  jostle bench world                                  all scenes
  jostle bench world resting -n 100000 --threads 1,2
  jostle bench world static-1m --peers --json -)",
        run, {.sizes = {10'000, 100'000, 1'000'000}, .frames = 200});
    command.texts("SCENE", options.names, "Which scenes; all if none is given");
    add_sizes_option(command, options.sizes, "10000,100000,1000000");
    add_thread_counts_option(command, options.threads);
    command.number("--frames", options.frames, 1, 100'000, "F", "How many updates are counted (200)");
    command.seed(options.seed, "Other boxes of the same kind (1)");
    add_rows_file_option(command, options.json);
    command.flag("--peers", options.peers, "Other systems as well, where the build has them");
}

} // namespace jostle_tool
