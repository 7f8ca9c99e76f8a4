// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "bench/report.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/world.hpp"
#include "numbers.hpp"
#include "rows.hpp"

#ifdef JOSTLE_WITH_PEERS

#include "bench/peers.hpp"
#include "commands.hpp"
#endif

/// What `jostle bench` and `jostle bench world` measure frame by frame.

namespace jostle_tool {

/// Milliseconds by the name of a stage.
using Stages = std::vector<std::pair<std::string, double>>;

/// As tables show them.
inline std::string text_of(const Stages& stages)
{
    std::string text;
    for (const auto& [name, ms] : stages) {
        text += (text.empty() ? "" : ", ") + name + " " + time_text(ms);
    }
    return text;
}

/// The median of each stage over some frames; there is at least one.
inline Stages typical(const std::vector<Stages>& frames)
{
    Stages result;
    for (std::size_t k = 0; k < frames.front().size(); ++k) {
        std::vector<double> ms;
        for (const Stages& stages : frames)
            ms.push_back(stages[k].second);
        result.emplace_back(frames.front()[k].first, rounded(median(std::move(ms))));
    }
    return result;
}

/// What a system found in a frame: pairs, or what it was asked for.
struct Answer
{
    std::uint64_t found = 0, checksum = 0;
    friend bool operator==(const Answer&, const Answer&) = default;
};

/// What frames took, as reports have it.
inline jostle_bench::ReportRow report_row(const std::string& system, const std::string& scene,
                                          std::uint64_t n, std::uint32_t threads,
                                          const std::vector<double>& ms, const Answer& answer,
                                          const std::vector<Stages>& stages)
{
    const auto [least, most] = std::minmax_element(ms.begin(), ms.end());
    return {system,
            scene,
            n,
            threads,
            rounded(median(ms)),
            rounded(*least),
            rounded(*most),
            answer.found,
            hex(answer.checksum),
            typical(stages)};
}

/// How JSON has it; `of` says what the scene is called there.
inline JsonRow json_row(const jostle_bench::ReportRow& row, const std::string& of)
{
    return {
        {"system", row.system},       {of, row.scene},        {"n", row.n},          {"threads", row.threads},
        {"median_ms", row.median_ms}, {"min_ms", row.min_ms}, {"max_ms", row.max_ms}};
}

template <int Dim, class T>
class System
{
  public:
    using Boxes = std::span<const jostle::Aabb<Dim, T>>;
    /// Positions of boxes, ascending.
    using Positions = std::span<const std::uint32_t>;

    virtual ~System() = default;
    virtual void start(Boxes) {}
    /// What isn't timed, before each frame.
    virtual void before(Boxes, Positions /*moved*/) {}
    /// What is to be said about boxes that leap from one place to another. Timed, before the frame itself.
    virtual void leap(Boxes, Positions /*leapt*/) {}
    virtual void frame(Boxes boxes, Positions moved) = 0;
    [[nodiscard]] virtual Answer answer() = 0;
    [[nodiscard]] virtual Stages stages() const { return {}; }
    /// Of what it saves in a frame, where that is what it is about.
    [[nodiscard]] virtual std::uint64_t bytes() const { return 0; }
    virtual void stop() {}
};

/// The engine, which finds all pairs from scratch in each frame.
template <int Dim, class T>
class FinderSystem final : public System<Dim, T>
{
  public:
    using typename System<Dim, T>::Boxes, typename System<Dim, T>::Positions;

    explicit FinderSystem(const jostle::FinderOptions& options) : finder_(options) {}
    void frame(Boxes boxes, Positions) override { pairs_ = &finder_.find(jostle::BoxView(boxes)); }
    Answer answer() override { return {pairs_->size(), jostle::pair_checksum(*pairs_)}; }
    Stages stages() const override
    {
        const jostle::Stats& stats = finder_.stats();
        return {{"tune", stats.ms_tune},
                {"scatter", stats.ms_scatter},
                {"sweep", stats.ms_sweep},
                {"finish", stats.ms_finish}};
    }

  private:
    jostle::PairFinder finder_;
    const jostle::PairBuffer* pairs_ = nullptr;
};

/// The pairs of a world whose objects have these ids, by the ids' positions.
template <int Dim, class T>
Answer pairs_of(const jostle::World<Dim, T>& world, std::span<const jostle::ObjectId> ids)
{
    std::vector<std::uint32_t> number(world.index_end());
    for (std::uint32_t i = 0; i < ids.size(); ++i)
        number[ids[i].index] = i;
    std::vector<jostle::Pair> pairs = world.pairs().to_vector();
    for (jostle::Pair& pair : pairs)
        pair = {std::min(number[pair.a], number[pair.b]), std::max(number[pair.a], number[pair.b])};
    return {pairs.size(), jostle::pair_checksum(pairs)};
}

inline Stages stages_of(const jostle::WorldStats& stats)
{
    return {{"apply", stats.us_apply / 1e3},
            {"active", stats.us_active / 1e3},
            {"resting", stats.us_resting / 1e3},
            {"events", stats.us_events / 1e3},
            {"index", stats.us_index / 1e3}};
}

#ifdef JOSTLE_WITH_PEERS
/// The other systems that `list` names, with commas; `all` of them, or none if it is empty. Throws a
/// UsageError for a name that none has.
template <int Dim>
std::vector<std::unique_ptr<jostle_bench::Peer<Dim>>> peers_named(const std::string& list)
{
    if (list.empty()) return {};
    auto peers = jostle_bench::make_peers<Dim>();
    if (list == "all") return peers;
    std::string known;
    for (const auto& peer : peers)
        known += (known.empty() ? "" : ",") + std::string(peer->info().name);
    std::vector<std::string> names;
    std::istringstream words(list);
    for (std::string name; std::getline(words, name, ',');)
        names.push_back(name);
    for (const std::string& name : names)
        if (std::none_of(peers.begin(), peers.end(),
                         [&](const auto& peer) { return name == peer->info().name; }))
            throw UsageError("--peers=" + name + ": choose from " + known);
    std::erase_if(peers, [&](const auto& peer) {
        return std::find(names.begin(), names.end(), peer->info().name) == names.end();
    });
    return peers;
}

template <int Dim>
class PeerSystem final : public System<Dim, float>
{
  public:
    using typename System<Dim, float>::Boxes, typename System<Dim, float>::Positions;

    PeerSystem(jostle_bench::Peer<Dim>& peer, std::uint32_t threads) : peer_(peer), threads_(threads) {}
    void start(Boxes boxes) override
    {
        changed_ = std::make_unique<jostle_bench::ChangedBoxes<Dim>>(boxes);
        peer_.start(boxes, threads_);
    }
    void before(Boxes boxes, Positions) override { moved_ = changed_->since_last(boxes); }
    void frame(Boxes boxes, Positions) override { peer_.frame(boxes, moved_); }
    Answer answer() override
    {
        const jostle_bench::PeerResult result = peer_.result();
        return {result.pairs, result.checksum};
    }
    void stop() override { peer_.stop(); }

  private:
    jostle_bench::Peer<Dim>& peer_;
    std::uint32_t threads_;
    std::unique_ptr<jostle_bench::ChangedBoxes<Dim>> changed_;
    Positions moved_;
};
#endif

} // namespace jostle_tool
