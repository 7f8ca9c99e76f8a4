// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "bench/program_peers.hpp"

namespace jostle_bench {
namespace {

using jostle::Vec3f;

/// Cells as wide as the largest ball with its skin, each with a list of the balls whose centres it has, and
/// half of the 26 cells around: what particle codes begin with.
class LinkedCells final : public NeighboursPeer
{
  public:
    const char* name() const noexcept override { return "cells"; }
    void find(std::span<const Vec3f> centers, std::span<const float> radii, float period, float skin,
              std::vector<jostle::Pair>& pairs, std::vector<Vec3f>& shift) override
    {
        pairs.clear();
        shift.clear();
        const float least = 2 * *std::max_element(radii.begin(), radii.end()) + skin;
        float low = centers[0][2], high = low;
        for (const Vec3f& center : centers) {
            low = std::min(low, center[2]);
            high = std::max(high, center[2]);
        }
        const int around = std::max(3, static_cast<int>(period / least));
        const int up = static_cast<int>((high - low) / least) + 1;
        const float width = period / static_cast<float>(around);
        const auto cell_along = [&](float x) {
            return std::clamp(static_cast<int>(x / width), 0, around - 1);
        };
        first_.assign(static_cast<std::size_t>(around) * static_cast<std::size_t>(around) *
                          static_cast<std::size_t>(up),
                      none);
        next_.resize(centers.size());
        const auto number = [&](int x, int y, int z) {
            return static_cast<std::size_t>((z * around + y) * around + x);
        };
        for (std::uint32_t i = static_cast<std::uint32_t>(centers.size()); i-- > 0;) {
            const Vec3f& at = centers[i];
            std::uint32_t& first = first_[number(cell_along(at[0]), cell_along(at[1]),
                                                 std::min(static_cast<int>((at[2] - low) / least), up - 1))];
            next_[i] = first;
            first = i;
        }
        for (int z = 0; z < up; ++z)
            for (int y = 0; y < around; ++y)
                for (int x = 0; x < around; ++x)
                    for (int k = 13; k < 27; ++k) { // the cell itself, and those behind it
                        int there[3] = {x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1};
                        if (there[2] >= up) continue;
                        Vec3f by{};
                        for (int d = 0; d < 2; ++d) {
                            if (there[d] < 0) there[d] += around, by[d] = -period;
                            if (there[d] >= around) there[d] -= around, by[d] = period;
                        }
                        const std::uint32_t other = first_[number(there[0], there[1], there[2])];
                        for (std::uint32_t a = first_[number(x, y, z)]; a != none; a = next_[a])
                            for (std::uint32_t b = k == 13 ? next_[a] : other; b != none; b = next_[b]) {
                                const Vec3f way = centers[b] + by - centers[a];
                                const float reach = radii[a] + radii[b] + skin;
                                if (jostle::dot(way, way) > reach * reach) continue;
                                pairs.push_back({a, b});
                                shift.push_back(by);
                            }
                    }
    }

  private:
    static constexpr std::uint32_t none = ~std::uint32_t{0};
    std::vector<std::uint32_t> first_, next_;
};

} // namespace

std::unique_ptr<NeighboursPeer> make_linked_cells()
{
    return std::make_unique<LinkedCells>();
}

} // namespace jostle_bench
