// SPDX-License-Identifier: MIT
#include "narrow/convex/epa.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

bool Expansion::start(const Simplex& simplex)
{
    static const Vec3 tries[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    // From the first point: the simplex again, as far as it has full size, and what is missing.
    const auto take = [&](auto&& measure, auto&& directions) {
        const double least = 1e-10 * size_;
        for (int i = 0; i < simplex.count; ++i)
            if (measure(simplex.point[i].w) > least) return points_.push_back(simplex.point[i]), true;
        SimplexPoint best{};
        double most = least;
        for (const Vec3& direction : directions) {
            const SimplexPoint w = furthest(direction);
            if (const double m = measure(w.w); m > most) {
                most = m;
                best = w;
            }
        }
        if (most > least) points_.push_back(best);
        return most > least;
    };
    points_.push_back(simplex.point[0]);
    const Vec3 p0 = simplex.point[0].w;
    if (!take([&](const Vec3& w) { return length(w - p0); }, tries)) return flat({0, 1, 0});
    Vec3 line = points_[1].w - p0;
    line = line * (1 / length(line));
    Vec3 u, v;
    basis(line, u, v);
    const Vec3 around[] = {u, v, -u, -v, u + v, -u - v, u - v, v - u};
    if (!take([&](const Vec3& w) { return length(cross(w - p0, line)); }, around)) return flat(u);
    Vec3 n = cross(line, points_[2].w - p0);
    n = n * (1 / length(n));
    const Vec3 across[] = {n, -n};
    if (!take([&](const Vec3& w) { return std::abs(dot(w - p0, n)); }, across)) return flat(n);
    std::uint32_t s[4] = {0, 1, 2, 3};
    if (dot(n, points_[3].w - p0) > 0) std::swap(s[1], s[2]);
    add(s[0], s[1], s[2]);
    add(s[0], s[3], s[1]);
    add(s[1], s[3], s[2]);
    add(s[2], s[3], s[0]);
    static constexpr std::uint32_t beside[4][3] = {{1, 2, 3}, {3, 2, 0}, {1, 3, 0}, {2, 1, 0}};
    for (std::uint32_t f = 0; f < 4; ++f)
        for (int i = 0; i < 3; ++i)
            faces_[f].beside[i] = beside[f][i];
    return true;
}

std::uint32_t Expansion::add(std::uint32_t i, std::uint32_t j, std::uint32_t k)
{
    std::uint32_t f = static_cast<std::uint32_t>(faces_.size());
    if (free_ < patch_.size()) {
        f = patch_[free_++]; // in the place of one that went
    } else {
        faces_.push_back({});
        offsets_.push_back(HUGE_VAL);
    }
    Face& face = faces_[f];
    face.v[0] = i;
    face.v[1] = j;
    face.v[2] = k;
    face.round = 0;
    const Vec3 p = points_[i].w, n = cross(points_[j].w - p, points_[k].w - p);
    const double size = length(n);
    if (size > 1e-16 * size_ * size_) {
        face.normal = n * (1 / size);
        offsets_[f] = dot(face.normal, p);
    } else { // a sliver is never the nearest; its neighbours say the same
        face.normal = {};
        offsets_[f] = HUGE_VAL;
    }
    return f;
}

bool Expansion::grow(std::uint32_t from, const SimplexPoint& beyond)
{
    points_.push_back(beyond);
    const std::uint32_t apex = static_cast<std::uint32_t>(points_.size() - 1);
    patch_.clear();
    horizon_.clear();
    made_.clear();
    patch_.push_back(from);
    faces_[from].round = ++round_;
    for (std::size_t k = 0; k < patch_.size(); ++k) {
        const Face& face = faces_[patch_[k]];
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t f = face.beside[i];
            Face& next = faces_[f];
            if (next.round == round_) continue;
            if (offsets_[f] == HUGE_VAL || dot(next.normal, beyond.w) - offsets_[f] > 1e-14 * size_) {
                next.round = round_;
                patch_.push_back(f);
            }
        }
    }
    for (std::size_t k = 0; k < patch_.size(); ++k) {
        const Face& face = faces_[patch_[k]];
        offsets_[patch_[k]] = HUGE_VAL;
        for (int i = 0; i < 3; ++i)
            if (faces_[face.beside[i]].round != round_)
                horizon_.push_back({face.v[i], face.v[(i + 1) % 3], face.beside[i]});
    }
    free_ = 0;
    for (std::size_t k = 0; k < horizon_.size(); ++k) {
        const Side side = horizon_[k];
        const std::uint32_t f = add(side.a, side.b, apex);
        faces_[f].beside[0] = side.beyond;
        made_.push_back(f);
        Face& across = faces_[side.beyond];
        for (int i = 0; i < 3; ++i)
            if (across.v[i] == side.b && across.v[(i + 1) % 3] == side.a) across.beside[i] = f;
    }
    free_ = patch_.size();
    std::size_t joined = 0;
    for (std::size_t k = 0; k < made_.size(); ++k)
        for (std::size_t l = 0; l < made_.size(); ++l)
            if (horizon_[k].b == horizon_[l].a) {
                faces_[made_[k]].beside[1] = made_[l];
                faces_[made_[l]].beside[2] = made_[k];
                ++joined;
            }
    return joined == made_.size() && joined >= 3;
}

void Expansion::take_in(const SimplexPoint& point)
{
    std::uint32_t from = 0;
    double furthest_out = 1e-14 * size_;
    bool outside = false;
    for (std::uint32_t f = 0; f < offsets_.size(); ++f) {
        const double out = dot(faces_[f].normal, point.w) - offsets_[f];
        if (!(out > furthest_out)) continue; // nor beyond an empty place, whose offset is infinite
        furthest_out = out;
        from = f;
        outside = true;
    }
    if (outside) grow(from, point);
}

void expand(const Core3& a, const Core3& b, const Simplex& simplex, Gap<3>& gap)
{
    Expansion expansion(a, b);
    gap.on_a = gap.on_b = {};
    if (!expansion.start(simplex)) {
        gap.normal = expansion.flat_normal;
        gap.distance = 0;
        return;
    }
    const bool smooth = a.is_smooth() || b.is_smooth();
    const double enough = (smooth ? 1e-8 : 1e-12) * (a.reach + b.reach);
    const int most_steps = smooth ? 64 : 1000;
    double depth = HUGE_VAL;
    for (int step = 0; step < most_steps; ++step) {
        const auto [face, offset] = expansion.nearest();
        if (offset == HUGE_VAL) break;
        const Vec3 n = expansion.normal(face);
        const SimplexPoint w = expansion.furthest(n);
        const double reach = dot(n, w.w);
        if (reach < depth) {
            depth = reach;
            gap.normal = n;
        }
        if (depth - offset <= enough || reach - offset <= enough || !expansion.grow(face, w)) break;
    }
    gap.distance = depth == HUGE_VAL ? 0 : -std::max(0.0, depth);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
