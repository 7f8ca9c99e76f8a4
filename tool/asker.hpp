// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bench/query_peers.hpp"
#include "tool/scenes/random.hpp"

/// What the benchmarks ask about boxes, and how other systems are asked it.
namespace jostle_tool {

/// Queries of one kind, asked together.
struct QueryBatch
{
    jostle_bench::QueryKind kind;
    std::uint32_t queries;
    float size = 0; ///< a box's edge, 0 for a fifth of the world's; how many are the nearest
    bool only_count = false;
};

/// Makes queries near objects chosen at random: where there is something to find.
class Asker
{
  public:
    Asker(std::span<const jostle::Aabb3f> boxes, std::uint64_t seed);
    [[nodiscard]] jostle_bench::Queries make(const QueryBatch& batch);

  private:
    void place(float* at);
    void direction(float* along);
    [[nodiscard]] std::array<jostle::Plane3f, 6> view(const float* at, const float* along) const;

    std::span<const jostle::Aabb3f> boxes_;
    jostle_scenes::Random random_;
    float world_ = 0;
};

#ifdef JOSTLE_WITH_PEERS
/// A batch put to another system, on a number of threads.
class AskedPeer
{
  public:
    AskedPeer(const jostle_bench::QueryPeer& peer, const QueryBatch& batch,
              const jostle_bench::Queries& queries, std::uint32_t threads);
    void ask();
    /// To what was asked last.
    [[nodiscard]] jostle_bench::Answers answers() const;

  private:
    static constexpr std::uint32_t per_claim = 32;
    const jostle_bench::QueryPeer& peer_;
    const QueryBatch& batch_;
    const jostle_bench::Queries& queries_;
    std::uint32_t threads_;
    std::vector<jostle_bench::Findings> found_;
};
#endif

} // namespace jostle_tool
