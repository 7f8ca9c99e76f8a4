// SPDX-License-Identifier: MIT
// Particles that push each other apart: find pairs, work on them on all cores, add up the pushes on each.
#include <jostle/jostle.hpp>

#include <cmath>
#include <cstdio>
#include <vector>

struct Push
{
    float x = 0, y = 0;
    Push& operator+=(const Push& other)
    {
        x += other.x;
        y += other.y;
        return *this;
    }
};

int main()
{
    constexpr float radius = 0.5f;
    std::vector<Push> at; // positions: too close to each other, and each a little off its place
    for (int i = 0; i < 60 * 60; ++i)
        at.push_back({float(i % 60) * 0.8f + float(i * 7 % 10) * 0.01f, float(i / 60) * 0.8f});

    jostle::PairFinder finder;
    jostle::Responses<Push> pushes;
    std::vector<jostle::Aabb2f> boxes(at.size());
    const auto width = [&] { return at.back().x - at.front().x; };
    const float width_first = width();
    for (int frame = 0; frame < 200; ++frame) {
        for (std::size_t i = 0; i < at.size(); ++i)
            boxes[i] = {{at[i].x - radius, at[i].y - radius}, {at[i].x + radius, at[i].y + radius}};
        const jostle::PairBuffer& pairs = finder.find(boxes);

        pushes.start(static_cast<std::uint32_t>(at.size()), jostle::plan_work(pairs.size()));
        jostle::process_pairs(pairs, [&](jostle::Pair pair, jostle::Work work) {
            const float x = at[pair.b].x - at[pair.a].x, y = at[pair.b].y - at[pair.a].y;
            const float distance = std::sqrt(x * x + y * y);
            if (distance == 0 || distance > 2 * radius) return;
            const float part = 0.2f * (2 * radius - distance) / distance;
            pushes.add(work, pair.a, {-part * x, -part * y}); // any object, no lock: merged below
            pushes.add(work, pair.b, {part * x, part * y});
        });
        const std::span<const Push> sums = pushes.merge(); // the same bits on any number of threads
        for (std::size_t i = 0; i < at.size(); ++i)
            at[i] += sums[i];
    }
    std::printf("%.1f wide at first, %.1f in the end\n", double(width_first), double(width()));
    return width() > width_first + 1 ? 0 : 1;
}
