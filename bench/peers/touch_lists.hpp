// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <iterator>
#include <vector>

#include "jostle/pair_buffer.hpp"

namespace jostle_bench {

/// Who touches whom, a list for each player: what a server keeps beside a tree to know what began and ended.
class TouchLists
{
  public:
    void start(std::size_t players) { touching_.assign(players, {}); }
    /// Player `a` touches `now`, in any order.
    void change(std::uint32_t a, std::vector<std::uint32_t>& now, std::vector<jostle::Pair>& began,
                std::vector<jostle::Pair>& ended)
    {
        std::sort(now.begin(), now.end());
        std::vector<std::uint32_t>& before = touching_[a];
        changed_.clear();
        std::set_difference(now.begin(), now.end(), before.begin(), before.end(),
                            std::back_inserter(changed_));
        for (const std::uint32_t b : changed_) {
            began.push_back({std::min(a, b), std::max(a, b)});
            if (b < touching_.size())
                touching_[b].insert(std::lower_bound(touching_[b].begin(), touching_[b].end(), a), a);
        }
        changed_.clear();
        std::set_difference(before.begin(), before.end(), now.begin(), now.end(),
                            std::back_inserter(changed_));
        for (const std::uint32_t b : changed_) {
            ended.push_back({std::min(a, b), std::max(a, b)});
            if (b < touching_.size()) std::erase(touching_[b], a);
        }
        before = now;
    }

  private:
    std::vector<std::vector<std::uint32_t>> touching_;
    std::vector<std::uint32_t> changed_;
};

} // namespace jostle_bench
