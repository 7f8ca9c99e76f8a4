// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "jostle/box.hpp"

namespace jostle_bench {

/// What the users of a tree without periodic axes add: balls near one end again, a period further.
struct GrainImages
{
    struct Image
    {
        std::uint32_t ball;
        jostle::Vec3f shift;
        jostle::Aabb3f box;
    };
    std::vector<jostle::Aabb3f> boxes; ///< of the balls, larger by half the skin
    std::vector<Image> images;         ///< each pair across an end has one that touches a ball's box

    void build(std::span<const jostle::Vec3f> centers, std::span<const float> radii, float period, float skin)
    {
        boxes.clear();
        images.clear();
        constexpr float far = std::numeric_limits<float>::infinity();
        jostle::Aabb3f all{{far, far, far}, {-far, -far, -far}};
        for (std::size_t i = 0; i < centers.size(); ++i) {
            const float reach = radii[i] + skin / 2;
            const jostle::Vec3f half{reach, reach, reach};
            boxes.push_back({centers[i] - half, centers[i] + half});
            for (int d = 0; d < 3; ++d) {
                all.lo[d] = std::min(all.lo[d], boxes[i].lo[d]);
                all.hi[d] = std::max(all.hi[d], boxes[i].hi[d]);
            }
        }
        const jostle::Vec3f shifts[] = {
            {period, 0, 0}, {0, period, 0}, {period, period, 0}, {period, -period, 0}};
        for (std::uint32_t i = 0; i < boxes.size(); ++i)
            for (const jostle::Vec3f& shift : shifts) {
                const jostle::Aabb3f box{boxes[i].lo + shift, boxes[i].hi + shift};
                if (jostle::overlaps(box, all)) images.push_back({i, shift, box});
            }
    }
};

} // namespace jostle_bench
