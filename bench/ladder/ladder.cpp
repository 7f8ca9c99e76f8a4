// SPDX-License-Identifier: MIT
// The table of the rungs, and those of them that the library has: the mended grid, and the engine.
#include "bench/ladder/ladder.hpp"

#include <algorithm>
#include <optional>

#include "bench/ladder/printed.hpp"
#include "jostle/chapter.hpp"
#include "jostle/find_pairs.hpp"

namespace jostle_ladder {

namespace chapter = jostle::chapter;

std::vector<float> level_sizes(Boxes boxes)
{
    std::vector<float> sizes = chapter::choose_cell_sizes(jostle::BoxView<3, float>(boxes));
    float edge = 0;
    for (const jostle::Aabb3f& box : boxes)
        for (int d = 0; d < 3; ++d)
            edge = std::max(edge, box.hi[d] - box.lo[d]);
    while (sizes.back() < 1.001f * edge) // for the rounding of cells
        sizes.push_back(2 * sizes.back());
    return sizes;
}

namespace {

std::uint32_t bucket_count(Boxes boxes)
{
    return std::max<std::uint32_t>(1, static_cast<std::uint32_t>(boxes.size()));
}

template <chapter::Hash hash>
class PrintedRung final : public Rung
{
  public:
    /// With the printed hash alone searches take long: with another, all objects search.
    explicit PrintedRung(std::uint32_t most_searches)
        : most_searches_(hash == chapter::Hash::as_printed ? most_searches : ~0u)
    {
    }
    void find(Boxes boxes, jostle::Executor& executor) override
    {
        grid_.emplace(level_sizes(boxes), bucket_count(boxes), hash);
        for (const jostle::Aabb3f& box : boxes)
            grid_->add_object(box);
        const auto objects = static_cast<std::uint32_t>(boxes.size());
        stride_ = objects / most_searches_ + (objects % most_searches_ != 0 ? 1 : 0);
        stride_ = std::max(1u, stride_);
        searched_ = (objects + stride_ - 1) / stride_;
        grid_->detect_proximity(executor, stride_);
    }
    [[nodiscard]] std::vector<jostle::Pair> pairs() const override { return grid_->close_pairs; }
    [[nodiscard]] Counts counts() const override
    {
        return {grid_->probes, grid_->candidates, grid_->bytes(), grid_->again, grid_->selves, searched_};
    }

  private:
    std::uint32_t most_searches_, stride_ = 1, searched_ = 0;
    std::optional<Printed<3, float>> grid_;
};

class MendedRung final : public Rung
{
  public:
    void find(Boxes boxes, jostle::Executor& executor) override
    {
        grid_.emplace(chapter::GridOptions<float>{level_sizes(boxes), bucket_count(boxes)});
        for (const jostle::Aabb3f& box : boxes)
            grid_->add(box);
        grid_->detect_proximity(executor);
    }
    [[nodiscard]] std::vector<jostle::Pair> pairs() const override
    {
        return {grid_->close_pairs().begin(), grid_->close_pairs().end()};
    }
    [[nodiscard]] Counts counts() const override
    {
        const chapter::GridStats& stats = grid_->stats();
        return {stats.cells, stats.tests, stats.bytes, 0, 0, grid_->size()};
    }

  private:
    std::optional<chapter::Grid<3, float>> grid_;
};

class EngineRung final : public Rung
{
  public:
    explicit EngineRung(jostle::InstructionSet instruction_set) : instruction_set_(instruction_set) {}
    void find(Boxes boxes, jostle::Executor& executor) override
    {
        jostle::FinderOptions options;
        options.executor = &executor;
        options.instruction_set = instruction_set_;
        if (!finder_) finder_.emplace(options);
        pairs_ = &finder_->find(boxes);
    }
    [[nodiscard]] std::vector<jostle::Pair> pairs() const override
    {
        return {pairs_->begin(), pairs_->end()};
    }
    [[nodiscard]] Counts counts() const override
    {
        const jostle::Stats& stats = finder_->stats();
        return {stats.bricks, stats.candidates, stats.bytes_reserved, 0, 0, stats.objects};
    }

  private:
    jostle::InstructionSet instruction_set_;
    std::optional<jostle::PairFinder> finder_;
    const jostle::PairBuffer* pairs_ = nullptr;
};

} // namespace

std::span<const RungInfo> ladder()
{
    static constexpr RungInfo rungs[] = {
        {"printed", "Algorithms 6 to 10 to the letter", false,
         [](std::uint32_t most) -> std::unique_ptr<Rung> {
             return std::make_unique<PrintedRung<chapter::Hash::as_printed>>(most);
         }},
        {"mixing hash", "a hash that mixes its bits", false,
         [](std::uint32_t most) -> std::unique_ptr<Rung> {
             return std::make_unique<PrintedRung<chapter::Hash::mixing>>(most);
         }},
        {"mended", "every pair, once; results per thread, no lock", true,
         [](std::uint32_t) -> std::unique_ptr<Rung> { return std::make_unique<MendedRung>(); }},
        {"counted", "cells sorted by counting, no linked lists", true, make_counted},
        {"copied", "boxes copied into every cell, no neighbours probed", true, make_copied},
        {"swept", "sorted along x and swept inside a cell", true, make_swept},
        {"engine, scalar", "today's engine, without SIMD", true,
         [](std::uint32_t) -> std::unique_ptr<Rung> {
             return std::make_unique<EngineRung>(jostle::supported_instruction_sets().back());
         }},
        {"engine", "with SIMD", true,
         [](std::uint32_t) -> std::unique_ptr<Rung> {
             return std::make_unique<EngineRung>(jostle::supported_instruction_sets().front());
         }},
    };
    return rungs;
}

} // namespace jostle_ladder
