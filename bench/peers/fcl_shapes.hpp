// SPDX-License-Identifier: MIT
#pragma once

// The packaged library holds the double version only; a float one would be compiled here, for minutes.
#include <fcl/narrowphase/collision.h>

#include "bench/contact_peers.hpp"

namespace jostle_bench {

/// A body as FCL's, and how FCL has it turned: its capsules, cylinders and cones lie along z, the
/// scene's along y.
inline std::shared_ptr<fcl::CollisionGeometryd> fcl_shape(const BodyShape& body)
{
    switch (body.kind) {
    case BodyKind::sphere:
        return std::make_shared<fcl::Sphered>(body.radius);
    case BodyKind::capsule:
        return std::make_shared<fcl::Capsuled>(body.radius, 2 * body.half_length);
    case BodyKind::box:
        return std::make_shared<fcl::Boxd>(2 * body.half[0], 2 * body.half[1], 2 * body.half[2]);
    case BodyKind::hull: {
        auto points = std::make_shared<std::vector<fcl::Vector3d>>();
        for (const auto& p : body.points)
            points->emplace_back(p[0], p[1], p[2]);
        auto faces = std::make_shared<std::vector<int>>();
        for (const auto& t : body.triangles) {
            faces->push_back(3);
            for (const std::uint32_t v : t)
                faces->push_back(static_cast<int>(v));
        }
        return std::make_shared<fcl::Convexd>(points, static_cast<int>(body.triangles.size()), faces);
    }
    case BodyKind::cylinder:
        return std::make_shared<fcl::Cylinderd>(body.radius, 2 * body.half_length);
    case BodyKind::cone:
        return std::make_shared<fcl::Coned>(body.radius, 2 * body.half_length);
    case BodyKind::ellipsoid:
        return std::make_shared<fcl::Ellipsoidd>(body.half[0], body.half[1], body.half[2]);
    case BodyKind::mesh:
        break;
    }
    auto mesh = std::make_shared<fcl::BVHModel<fcl::OBBRSSd>>();
    mesh->beginModel(static_cast<int>(body.triangles.size()), static_cast<int>(body.points.size()));
    for (const auto& t : body.triangles) {
        const auto corner = [&](std::size_t i) {
            const auto& p = body.points[t[i]];
            return fcl::Vector3d(p[0], p[1], p[2]);
        };
        mesh->addTriangle(corner(0), corner(1), corner(2));
    }
    mesh->endModel();
    return mesh;
}

inline fcl::Quaterniond fcl_turn(BodyKind kind, const fcl::Quaterniond& turn)
{
    if (kind != BodyKind::capsule && kind != BodyKind::cylinder && kind != BodyKind::cone) return turn;
    return turn * fcl::Quaterniond(0.70710678118654752, -0.70710678118654752, 0, 0);
}

} // namespace jostle_bench
