// SPDX-License-Identifier: MIT
#include "narrow/convex/epa.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

bool Expansion::start(const Simplex& simplex)
{
    static const Vec3 tries[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}};
    // Rebuilds a tetrahedron from the first point: keeps the points of the simplex that are independent, and
    // adds the missing ones.
    const auto take = [&](auto&& measure, auto&& directions) {
        const double least = 1e-10 * size_;
        for (int i = 0; i < simplex.count; ++i)
            if (measure(simplex.point[i].w) > least) return points_.push_back(simplex.point[i].w), true;
        Vec3 best;
        double most = least;
        for (const Vec3& direction : directions) {
            const Vec3 w = furthest(direction);
            if (const double m = measure(w); m > most) {
                most = m;
                best = w;
            }
        }
        if (most > least) points_.push_back(best);
        return most > least;
    };
    points_.push_back(simplex.point[0].w);
    const Vec3 p0 = simplex.point[0].w;
    if (!take([&](const Vec3& w) { return length(w - p0); }, tries)) return flat({0, 1, 0});
    Vec3 line = points_[1] - p0;
    line = line * (1 / length(line));
    Vec3 u, v;
    basis(line, u, v);
    const Vec3 around[] = {u, v, -u, -v, u + v, -u - v, u - v, v - u};
    if (!take([&](const Vec3& w) { return length(cross(w - p0, line)); }, around)) return flat(u);
    Vec3 n = cross(line, points_[2] - p0);
    n = n * (1 / length(n));
    const Vec3 across[] = {n, -n};
    if (!take([&](const Vec3& w) { return std::abs(dot(w - p0, n)); }, across)) return flat(n);
    std::uint32_t s[4] = {0, 1, 2, 3};
    if (dot(n, points_[3] - p0) > 0) std::swap(s[1], s[2]);
    add(s[0], s[1], s[2]);
    add(s[0], s[3], s[1]);
    add(s[1], s[3], s[2]);
    add(s[2], s[3], s[0]);
    join(0, 0, 1, 2);
    join(0, 1, 2, 2);
    join(0, 2, 3, 2);
    join(1, 0, 3, 1);
    join(1, 1, 2, 0);
    join(2, 1, 3, 0);
    return true;
}

std::uint32_t Expansion::add(std::uint32_t i, std::uint32_t j, std::uint32_t k)
{
    std::uint32_t f = static_cast<std::uint32_t>(faces_.size());
    if (!places_.empty()) {
        f = places_.pop_back();
    } else {
        faces_.resize(f + 1);
        offsets_.resize(f + 1);
        faces_[f].waits = false;
    }
    Face& face = faces_[f];
    face.v[0] = i;
    face.v[1] = j;
    face.v[2] = k;
    face.round = 0;
    const Vec3 p = points_[i], n = cross(points_[j] - p, points_[k] - p);
    const double size = length(n);
    if (!(size > 1e-16 * size_ * size_)) { // a sliver is never the nearest; its neighbours are as good
        face.normal = {};
        offsets_[f] = HUGE_VAL;
        return f;
    }
    face.normal = n * (1 / size);
    offsets_[f] = dot(face.normal, p);
    const bool waits = offsets_[f] < limit_; // half do, unpredictably: so without a branch
    waiting_.push_back(f);
    waiting_.resize(waiting_.size() - (waits && !face.waits ? 0 : 1));
    face.waits |= waits;
    return f;
}

void Expansion::join(std::uint32_t face, int side, std::uint32_t other, int its)
{
    faces_[face].beside[side] = other;
    faces_[face].beside_its[side] = static_cast<std::uint8_t>(its);
    faces_[other].beside[its] = face;
    faces_[other].beside_its[its] = static_cast<std::uint8_t>(side);
}

/// Visits a face across one of its sides: if `beyond` is outside the face, it is removed, and its other
/// neighbours are visited in turn. So the sides of the remaining faces are met one after another around the
/// hole.
void Expansion::visit(std::uint32_t face, std::uint8_t side, const Vec3& beyond)
{
    Face& here = faces_[face];
    if (here.round == round_) return;
    const std::uint8_t next = side == 2 ? 0 : side + 1, last = side == 0 ? 2 : side - 1;
    if (offsets_[face] != HUGE_VAL && !(dot(here.normal, beyond) - offsets_[face] > least_out_)) {
        horizon_.push_back({face, here.v[next], here.v[side], side});
        return;
    }
    here.round = round_;
    offsets_[face] = HUGE_VAL;
    places_.push_back(face);
    visit(here.beside[next], here.beside_its[next], beyond);
    visit(here.beside[last], here.beside_its[last], beyond);
}

bool Expansion::grow(std::uint32_t from, const Vec3& beyond)
{
    const std::uint32_t apex = static_cast<std::uint32_t>(points_.size());
    points_.push_back(beyond);
    horizon_.clear();
    Face& first = faces_[from];
    first.round = ++round_;
    offsets_[from] = HUGE_VAL;
    places_.push_back(from);
    for (int i = 0; i < 3; ++i)
        visit(first.beside[i], first.beside_its[i], beyond);
    const std::size_t sides = horizon_.size();
    for (std::size_t k = 0; k < sides; ++k)
        if (horizon_[k].to != horizon_[k + 1 < sides ? k + 1 : 0].from) return false;
    if (sides < 3) return false;
    std::uint32_t made_first = 0, made_before = 0;
    for (std::size_t k = 0; k < sides; ++k) {
        const Side& side = horizon_[k];
        const std::uint32_t made = add(side.from, side.to, apex);
        join(made, 0, side.face, side.of);
        if (k == 0)
            made_first = made;
        else
            join(made, 2, made_before, 1);
        made_before = made;
    }
    join(made_first, 2, made_before, 1);
    return true;
}

bool Expansion::take_in(const Vec3& point)
{
    std::uint32_t from = 0;
    double furthest_out = least_out_;
    for (std::uint32_t f = 0; f < offsets_.size(); ++f) {
        const double out = dot(faces_[f].normal, point) - offsets_[f];
        if (!(out > furthest_out)) continue; // nor beyond an empty place, whose offset is infinite
        furthest_out = out;
        from = f;
    }
    return !(furthest_out > least_out_) || grow(from, point);
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
        const auto [face, offset] = expansion.nearest(HUGE_VAL);
        if (offset == HUGE_VAL) break;
        const Vec3 n = expansion.normal(face);
        const Vec3 w = expansion.furthest(n);
        const double reach = dot(n, w);
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
