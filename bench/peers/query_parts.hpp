// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>

#include "bench/query_peers.hpp"

namespace jostle_bench {

/// The k nearest so far.
class NearestSoFar
{
  public:
    explicit NearestSoFar(const jostle::Nearest<3, float>& query)
        : count_(query.count), limit_(query.max_distance * query.max_distance)
    {
    }
    /// Squared; nothing further away matters.
    [[nodiscard]] float limit() const noexcept { return limit_; }
    void offer(float at)
    {
        if (!(at <= limit_)) return;
        if (heap_.size() == count_) {
            std::pop_heap(heap_.begin(), heap_.end());
            heap_.back() = at;
        } else {
            heap_.push_back(at);
        }
        std::push_heap(heap_.begin(), heap_.end());
        if (heap_.size() == count_) limit_ = heap_.front();
    }
    void give(Findings& found) const
    {
        for (const float at : heap_)
            found.add_distance(at);
    }

  private:
    std::size_t count_;
    float limit_;
    std::vector<float> heap_;
};

/// The first hit so far.
struct FirstSoFar
{
    jostle::Hit<float> best;
    template <class Line>
    void offer(const Line& line, std::uint32_t id, const jostle::Aabb3f& box)
    {
        const auto at = jostle::hit_fraction(line, box);
        if (at && (best.id == best.none || jostle::Hit<float>{id, *at} < best)) best = {id, *at};
    }
    void give(Findings& found) const
    {
        if (best.id != best.none) found.add(best.id);
    }
};

std::unique_ptr<QueryPeer> make_embree_queries();
std::unique_ptr<QueryPeer> make_bullet_queries();
std::unique_ptr<QueryPeer> make_fcl_queries();
std::unique_ptr<QueryPeer> make_boost_queries();

} // namespace jostle_bench
