// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "engine/engine.hpp"
#include "jostle/find_pairs.hpp"

JOSTLE_NAMESPACE_BEGIN

/// Finds the pairs of many scenes: whole scenes are distributed over the threads. Keeps its working memory
/// from call to call.
class SceneFinder
{
  public:
    explicit SceneFinder(const FinderOptions& options);
    ~SceneFinder();

    /// PairFinder::find_scenes. `engine` searches scenes that are too large for one thread. Fills in all of
    /// `stats` except the time.
    template <int Dim, Coordinate T>
    void find(const BoxView<Dim, T>& boxes, std::span<const std::uint64_t> offsets, const SceneFilter& filter,
              engine::Engine& engine, Stats& stats);

    [[nodiscard]] const ScenePairs& result() const noexcept { return result_; }
    /// Clears the result and keeps its memory.
    void clear() noexcept;
    void release() noexcept;

  private:
    struct Slot;
    template <int Dim, class T>
    class Search;

    FinderOptions options_;
    std::vector<std::unique_ptr<Slot>> slots_;
    ScenePairs result_;
    engine::ResultChunks chunks_; // of result_.small_
};

JOSTLE_NAMESPACE_END
