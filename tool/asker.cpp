// SPDX-License-Identifier: MIT
#include "asker.hpp"

#include <algorithm>
#include <cmath>

#ifdef JOSTLE_WITH_PEERS
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#endif

namespace jostle_tool {

using jostle::Aabb3f;
using jostle_bench::Queries;
using jostle_bench::QueryKind;

namespace {

float number(jostle_scenes::Random& random, float lo, float hi)
{
    return static_cast<float>(random.uniform(lo, hi));
}

Aabb3f around(const float* at, float half)
{
    const jostle::Vec3f middle{at[0], at[1], at[2]};
    return jostle::grown(Aabb3f{middle, middle}, half);
}

} // namespace

Asker::Asker(std::span<const Aabb3f> boxes, std::uint64_t seed) : boxes_(boxes), random_(seed)
{
    Aabb3f all = boxes[0];
    for (const Aabb3f& box : boxes)
        all = jostle::merged(all, box);
    for (const float edge : jostle::size(all))
        world_ = std::max(world_, edge);
}

Queries Asker::make(const QueryBatch& batch)
{
    Queries queries;
    for (std::uint32_t i = 0; i < batch.queries; ++i) {
        float at[3], along[3];
        place(at);
        direction(along);
        switch (batch.kind) {
        case QueryKind::first:
        case QueryKind::all:
            queries.rays.push_back({{at[0], at[1], at[2]}, {along[0], along[1], along[2]}, world_ / 2});
            break;
        case QueryKind::sweep: {
            const float far = world_ / 10;
            queries.sweeps.push_back(
                {around(at, 0.5f), {along[0] * far, along[1] * far, along[2] * far}, 1.0f});
            break;
        }
        case QueryKind::box:
            queries.boxes.push_back(around(at, batch.size > 0 ? batch.size / 2 : world_ / 10));
            break;
        case QueryKind::sphere:
            queries.spheres.push_back({{at[0], at[1], at[2]}, 5});
            break;
        case QueryKind::nearest:
            queries.nearest.push_back({{at[0], at[1], at[2]}, static_cast<std::uint32_t>(batch.size)});
            break;
        case QueryKind::frustum:
            queries.frustums.push_back(view(at, along));
            break;
        }
    }
    return queries;
}

void Asker::place(float* at)
{
    const Aabb3f& box = boxes_[random_.below(static_cast<std::uint32_t>(boxes_.size()))];
    for (int d = 0; d < 3; ++d)
        at[d] = number(random_, box.lo[d], box.hi[d]) + number(random_, -1, 1);
}

void Asker::direction(float* along)
{
    for (;;) {
        float square = 0;
        for (int d = 0; d < 3; ++d) {
            along[d] = number(random_, -1, 1);
            square += along[d] * along[d];
        }
        if (square > 1 || square < 0.01f) continue;
        for (int d = 0; d < 3; ++d)
            along[d] /= std::sqrt(square);
        return;
    }
}

std::array<jostle::Plane3f, 6> Asker::view(const float* at, const float* along) const
{
    // Two directions across the view.
    const bool x = std::abs(along[0]) < 0.5f;
    const float up[3] = {x ? 1.0f : 0.0f, x ? 0.0f : 1.0f, 0.0f};
    float u[3], v[3], length = 0;
    for (int d = 0; d < 3; ++d) {
        u[d] = along[(d + 1) % 3] * up[(d + 2) % 3] - along[(d + 2) % 3] * up[(d + 1) % 3];
        length += u[d] * u[d];
    }
    for (float& each : u)
        each /= std::sqrt(length);
    for (int d = 0; d < 3; ++d)
        v[d] = along[(d + 1) % 3] * u[(d + 2) % 3] - along[(d + 2) % 3] * u[(d + 1) % 3];
    const float slope = 0.268f; // of half of 30 degrees
    const auto plane = [&](float a, float b, float c, float offset) {
        jostle::Plane3f made{};
        made.offset = offset;
        for (int d = 0; d < 3; ++d) {
            made.normal[d] = a * along[d] + b * u[d] + c * v[d];
            made.offset -= made.normal[d] * at[d];
        }
        return made;
    };
    return {plane(1, 0, 0, -0.1f),  plane(-1, 0, 0, world_ / 2), plane(slope, 1, 0, 0),
            plane(slope, -1, 0, 0), plane(slope, 0, 1, 0),       plane(slope, 0, -1, 0)};
}

#ifdef JOSTLE_WITH_PEERS
AskedPeer::AskedPeer(const jostle_bench::QueryPeer& peer, const QueryBatch& batch, const Queries& queries,
                     std::uint32_t threads)
    : peer_(peer),
      batch_(batch),
      queries_(queries),
      threads_(threads),
      found_((batch.queries + per_claim - 1) / per_claim, jostle_bench::Findings(!batch.only_count))
{
}

void AskedPeer::ask()
{
    tbb::task_arena(static_cast<int>(threads_)).execute([&] {
        tbb::parallel_for(std::size_t{0}, found_.size(), [&](std::size_t claim) {
            found_[claim].clear();
            const auto begin = static_cast<std::uint32_t>(claim) * per_claim;
            for (std::uint32_t i = begin; i < std::min(batch_.queries, begin + per_claim); ++i) {
                peer_.ask(batch_.kind, queries_, i, found_[claim]);
                found_[claim].end_query();
            }
        });
    });
}

jostle_bench::Answers AskedPeer::answers() const
{
    jostle_bench::Answers answers;
    for (std::size_t claim = 0; claim < found_.size(); ++claim)
        found_[claim].sum(claim * per_claim, answers);
    return answers;
}
#endif

} // namespace jostle_tool
