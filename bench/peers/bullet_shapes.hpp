// SPDX-License-Identifier: MIT
#pragma once

#include <btBulletCollisionCommon.h>

#include "bench/contact_peers.hpp"

namespace jostle_bench {

/// Bodies as Bullet's shapes, with the margins that it gives them. Ellipsoids it has none.
class BulletShapes
{
  public:
    btCollisionShape* make(const BodyShape& body)
    {
        const auto radius = static_cast<btScalar>(body.radius);
        const auto length = static_cast<btScalar>(2 * body.half_length);
        switch (body.kind) {
        case BodyKind::sphere:
            return keep(std::make_unique<btSphereShape>(radius));
        case BodyKind::capsule:
            return keep(std::make_unique<btCapsuleShape>(radius, length));
        case BodyKind::cylinder:
            return keep(std::make_unique<btCylinderShape>(btVector3(radius, length / 2, radius)));
        case BodyKind::cone:
            return keep(std::make_unique<btConeShape>(radius, length));
        case BodyKind::box:
            return keep(std::make_unique<btBoxShape>(point(body.half)));
        case BodyKind::hull: {
            auto hull = std::make_unique<btConvexHullShape>();
            for (const auto& p : body.points)
                hull->addPoint(point(p), false);
            hull->recalcLocalAabb();
            return keep(std::move(hull));
        }
        case BodyKind::mesh:
            return keep(std::make_unique<btBvhTriangleMeshShape>(triangles(body), true));
        case BodyKind::ellipsoid:
            break;
        }
        return nullptr;
    }
    void clear()
    {
        shapes_.clear();
        meshes_.clear();
    }

  private:
    btTriangleMesh* triangles(const BodyShape& body)
    {
        auto mesh = std::make_unique<btTriangleMesh>();
        for (const auto& t : body.triangles)
            mesh->addTriangle(point(body.points[t[0]]), point(body.points[t[1]]), point(body.points[t[2]]));
        meshes_.push_back(std::move(mesh));
        return meshes_.back().get();
    }
    template <class Shape>
    Shape* keep(std::unique_ptr<Shape> shape)
    {
        Shape* const raw = shape.get();
        shapes_.push_back(std::move(shape));
        return raw;
    }
    template <class Point>
    static btVector3 point(const Point& p)
    {
        return {static_cast<btScalar>(p[0]), static_cast<btScalar>(p[1]), static_cast<btScalar>(p[2])};
    }

    std::vector<std::unique_ptr<btTriangleMesh>> meshes_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
};

} // namespace jostle_bench
