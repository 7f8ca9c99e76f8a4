// SPDX-License-Identifier: MIT
// A cloth that falls over a ball and onto itself, by position-based dynamics. Near parts are pushed apart,
// and no vertex moves beyond the first impact, so no edge ever passes through a triangle.
// Usage: cloth [VERTICES ALONG EACH SIDE] [FRAMES]
#include <jostle/jostle.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

using jostle::Vec3d;
constexpr double edge = 0.05, thickness = 0.006, dt = 1.0 / 120, ball = 0.3;
constexpr int steps_a_frame = 2, solver_rounds = 6, stopping_rounds = 4;

/// Moves the ends of a spring to its length; less where it is a diagonal, which only bends.
struct Spring
{
    std::uint32_t a, b;
    double length, stiffness;
};

void solve(const std::vector<Spring>& springs, std::vector<Vec3d>& at)
{
    for (const Spring& spring : springs) {
        const Vec3d way = at[spring.b] - at[spring.a];
        const double length = jostle::length(way);
        const Vec3d push = way * (0.5 * spring.stiffness * (length - spring.length) / (length + 1e-12));
        at[spring.a] += push;
        at[spring.b] -= push;
    }
}

/// Pushes the parts of pairs that are nearer than the cloth is thick, each vertex by its weight.
template <class Pairs>
void separate(const Pairs& pairs, std::size_t of_first, std::vector<Vec3d>& at)
{
    for (const auto& pair : pairs) {
        double squares = 0, gap = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            squares += pair.weights[k] * pair.weights[k];
            const double along = jostle::dot(at[pair.vertices[k]], pair.normal) * pair.weights[k];
            gap += k < of_first ? -along : along;
        }
        const double push = std::max(0.0, thickness - gap) / squares;
        for (std::size_t k = 0; k < 4; ++k)
            at[pair.vertices[k]] += pair.normal * ((k < of_first ? -push : push) * pair.weights[k]);
    }
}

} // namespace

int main(int argc, char** argv)
{
    const auto n = static_cast<std::uint32_t>(argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 32);
    const int frames = argc > 2 ? std::atoi(argv[2]) : 500;
    if (n < 2 || n > 1000) return std::fprintf(stderr, "give 2 to 1000 vertices along each side\n"), 1;

    std::vector<Vec3d> at;
    std::vector<jostle::Surface::Triangle> triangles;
    std::vector<Spring> springs;
    for (std::uint32_t y = 0; y < n; ++y)
        for (std::uint32_t x = 0; x < n; ++x) { // it hangs above the ball, a little turned and not centred
            const double u = (x - 0.35 * n) * edge, v = (y - 0.45 * n) * edge;
            at.push_back({u * 0.96 - v * 0.28, ball + 0.5 + 0.1 * u, u * 0.28 + v * 0.96});
            const std::uint32_t k = y * n + x;
            if (x + 1 < n) springs.push_back({k, k + 1, edge, 1});
            if (y + 1 < n) springs.push_back({k, k + n, edge, 1});
            if (x + 1 == n || y + 1 == n) continue;
            springs.push_back({k, k + n + 1, edge * std::sqrt(2.0), 0.3});
            springs.push_back({k + 1, k + n, edge * std::sqrt(2.0), 0.3});
            triangles.push_back({k, k + n, k + 1});
            triangles.push_back({k + 1, k + n, k + n + 1});
        }
    const jostle::Surface cloth(triangles);
    jostle::SurfaceFinder3d finder;
    std::vector<Vec3d> speed(at.size(), Vec3d{}), next(at.size());
    std::uint64_t met = 0, crossings = 0, most_near = 0;
    for (int step = 0; step < frames * steps_a_frame; ++step) {
        for (std::size_t k = 0; k < at.size(); ++k) {
            speed[k] = (speed[k] - Vec3d{0, 9.81 * dt, 0}) * 0.998;
            next[k] = at[k] + speed[k] * dt;
        }
        const auto& near = finder.near(cloth, at, 1.5 * thickness);
        most_near = std::max(most_near, near.vertex_triangle.size() + near.edge_edge.size());
        for (int round = 0; round < solver_rounds; ++round) {
            solve(springs, next);
            separate(near.vertex_triangle, 1, next);
            separate(near.edge_edge, 2, next);
            for (Vec3d& v : next) { // out of the ball and the floor
                const double height = jostle::length(v);
                if (height < ball + thickness) v *= (ball + thickness) / height;
                v[1] = std::max(v[1], -0.4);
            }
        }
        for (int round = 0;; ++round) { // stop vertices before impacts; in the end all, at the safe step
            const auto& moving = finder.moving(cloth, at, next);
            if (moving.safe_step == 1) break;
            std::vector<double> part(at.size(), round < stopping_rounds ? 1.0 : 0.8 * moving.safe_step);
            for (const auto* pairs : {&moving.vertex_triangle, &moving.edge_edge})
                for (const auto& pair : *pairs)
                    for (const std::uint32_t vertex : pair.vertices)
                        part[vertex] = std::min(part[vertex], 0.8 * pair.time);
            for (std::size_t k = 0; k < at.size(); ++k)
                next[k] = jostle::lerp(at[k], next[k], part[k]);
            met += moving.vertex_triangle.size() + moving.edge_edge.size();
            if (round >= stopping_rounds) break;
        }
        for (std::size_t k = 0; k < at.size(); ++k)
            speed[k] = (next[k] - at[k]) / dt;
        at.swap(next);
        crossings += finder.crossings(cloth, at).size();
    }
    double lowest = 0;
    for (const Vec3d& v : at)
        lowest = std::min(lowest, v[1]);
    std::printf(
        "%u triangles, %d frames: up to %llu pairs near each other, %llu impacts stopped, lowest at %.2f, "
        "%llu crossings\n",
        static_cast<unsigned>(triangles.size()), frames, static_cast<unsigned long long>(most_near),
        static_cast<unsigned long long>(met), lowest, static_cast<unsigned long long>(crossings));
    return crossings == 0 ? 0 : 1;
}
