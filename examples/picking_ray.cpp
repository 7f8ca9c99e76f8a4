// SPDX-License-Identifier: MIT
// Which object is under the mouse pointer? A ray from the eye through the pointer, first by boxes, then by
// shape.
#include <cmath>
#include <cstdio>
#include <jostle/jostle.hpp>
#include <optional>
#include <vector>

namespace {

struct Ball
{
    float center[3];
    float radius;
};

/// How far along the ray the ball itself is hit, if it is.
std::optional<float> hit(const jostle::Ray3f& ray, const Ball& ball)
{
    float along = 0, square = 0, length = 0;
    for (int d = 0; d < 3; ++d) {
        const float to = ball.center[d] - ray.origin[d];
        along += to * ray.direction[d];
        square += to * to;
        length += ray.direction[d] * ray.direction[d];
    }
    const float root = along * along - length * (square - ball.radius * ball.radius);
    if (root < 0) return std::nullopt;
    return (along - std::sqrt(root)) / length;
}

} // namespace

int main()
{
    // The ray passes the first ball's box, but not the ball; then it hits the two others.
    const std::vector<Ball> balls = {{{0.9f, 0.9f, 5}, 1}, {{0.2f, 0, 20}, 1}, {{0, 0, 10}, 1}};
    std::vector<jostle::Aabb3f> boxes;
    for (const Ball& ball : balls)
        boxes.push_back(jostle::grown(jostle::Aabb3f{ball.center, ball.center}, ball.radius));
    jostle::BoxIndex3f index;
    index.build(boxes); // once; insert, move and erase keep it up to date
    const jostle::Ray3f ray = {{0, 0, 0}, {0, 0, 1}};
    std::vector<jostle::Hit<float>> candidates; // nearest box first
    index.all(ray, candidates);
    jostle::Hit<float> picked;
    for (const jostle::Hit<float>& candidate : candidates) {
        if (picked.id != picked.none && candidate.at > picked.at) break; // its ball can't be nearer
        const auto at = hit(ray, balls[candidate.id]);
        if (at && (picked.id == picked.none || *at < picked.at)) picked = {candidate.id, *at};
    }
    std::printf("%zu boxes on the way; picked ball %u at %g\n", candidates.size(), picked.id, picked.at);
    return candidates.size() == 3 && picked.id == 2 && picked.at == 9 ? 0 : 1;
}
