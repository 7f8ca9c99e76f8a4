// SPDX-License-Identifier: MIT
#include <embree3/rtcore.h>

#include <cmath>
#include <stdexcept>

#include "query_parts.hpp"

namespace jostle_bench {
namespace {

/// Embree 3.13: one user geometry, built at RTC_BUILD_QUALITY_HIGH. It has no query for a box: a point
/// query with the sphere around the box stands in.
class Embree final : public QueryPeer
{
  public:
    ~Embree() override
    {
        if (geometry_ != nullptr) rtcReleaseGeometry(geometry_);
        if (scene_ != nullptr) rtcReleaseScene(scene_);
        if (device_ != nullptr) rtcReleaseDevice(device_);
    }
    const char* name() const noexcept override { return "embree"; }
    bool answers(QueryKind kind) const noexcept override
    {
        return kind != QueryKind::sweep && kind != QueryKind::frustum;
    }
    void build(Boxes3 boxes) override
    {
        boxes_ = boxes;
        device_ = rtcNewDevice(nullptr);
        if (device_ == nullptr) throw std::runtime_error("embree: cannot create a device");
        scene_ = rtcNewScene(device_);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_HIGH);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST); // without it rays miss boxes that they graze
        geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(boxes.size()));
        rtcSetGeometryUserData(geometry_, this);
        rtcSetGeometryBoundsFunction(geometry_, bounds, nullptr);
        rtcSetGeometryIntersectFunction(geometry_, intersect);
        rtcCommitGeometry(geometry_);
        rtcAttachGeometry(scene_, geometry_);
        rtcCommitScene(scene_);
        if (rtcGetDeviceError(device_) != RTC_ERROR_NONE) throw std::runtime_error("embree: building failed");
    }
    void ask(QueryKind kind, const Queries& queries, std::size_t i, Findings& found) const override
    {
        if (kind == QueryKind::first || kind == QueryKind::all) {
            Context context{};
            rtcInitIntersectContext(&context);
            context.line = &queries.rays[i];
            context.all = kind == QueryKind::all ? &found : nullptr;
            RTCRayHit ray{};
            const jostle::Ray<3, float>& from = queries.rays[i];
            ray.ray = {from.origin[0],
                       from.origin[1],
                       from.origin[2],
                       0,
                       from.direction[0],
                       from.direction[1],
                       from.direction[2],
                       0,
                       from.max_fraction,
                       ~0u,
                       0,
                       0};
            ray.hit.geomID = RTC_INVALID_GEOMETRY_ID;
            rtcIntersect1(scene_, &context, &ray);
            context.first.give(found);
            return;
        }
        Query query{this, &queries, kind, i, &found, nullptr};
        RTCPointQuery point{};
        NearestSoFar nearest(kind == QueryKind::nearest ? queries.nearest[i] : jostle::Nearest<3, float>{});
        query.nearest = &nearest;
        const auto at = [&](const jostle::Vec3f& p, float radius) {
            point.x = p[0];
            point.y = p[1];
            point.z = p[2];
            point.radius = radius;
        };
        if (kind == QueryKind::nearest) {
            at(queries.nearest[i].point, queries.nearest[i].max_distance);
        } else if (kind == QueryKind::sphere) {
            at(queries.spheres[i].center, queries.spheres[i].radius * 1.000001f);
        } else {
            const jostle::Aabb3f& box = queries.boxes[i];
            float center[3], sum = 0;
            for (int d = 0; d < 3; ++d) {
                center[d] = 0.5f * (box.lo[d] + box.hi[d]);
                sum += (box.hi[d] - center[d]) * (box.hi[d] - center[d]);
            }
            at(center, std::sqrt(sum) * 1.000001f);
        }
        RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene_, &point, &context, near, &query);
        if (kind == QueryKind::nearest) nearest.give(found);
    }

  private:
    struct Context : RTCIntersectContext
    {
        const jostle::Ray<3, float>* line;
        Findings* all;
        FirstSoFar first;
    };
    struct Query
    {
        const Embree* self;
        const Queries* queries;
        QueryKind kind;
        std::size_t i;
        Findings* found;
        NearestSoFar* nearest;
    };
    static void bounds(const RTCBoundsFunctionArguments* arguments)
    {
        const jostle::Aabb3f& box =
            static_cast<const Embree*>(arguments->geometryUserPtr)->boxes_[arguments->primID];
        *arguments->bounds_o = {box.lo[0], box.lo[1], box.lo[2], 0, box.hi[0], box.hi[1], box.hi[2], 0};
    }
    static void intersect(const RTCIntersectFunctionNArguments* arguments)
    {
        const auto& self = *static_cast<const Embree*>(arguments->geometryUserPtr);
        auto& context = *static_cast<Context*>(arguments->context);
        const std::uint32_t id = arguments->primID;
        if (arguments->valid[0] == 0) return;
        if (context.all != nullptr) {
            if (jostle::hit_fraction(*context.line, self.boxes_[id])) context.all->add(id);
            return;
        }
        context.first.offer(*context.line, id, self.boxes_[id]);
        if (context.first.best.id != id) return;
        auto* const ray = reinterpret_cast<RTCRayHit*>(arguments->rayhit);
        ray->ray.tfar = context.first.best.at;
        ray->hit.geomID = arguments->geomID;
        ray->hit.primID = id;
    }
    static bool near(RTCPointQueryFunctionArguments* arguments)
    {
        Query& query = *static_cast<Query*>(arguments->userPtr);
        const jostle::Aabb3f& box = query.self->boxes_[arguments->primID];
        if (query.kind == QueryKind::nearest) {
            const float before = query.nearest->limit();
            query.nearest->offer(jostle::squared_distance(query.queries->nearest[query.i].point, box));
            if (query.nearest->limit() == before) return false;
            arguments->query->radius = std::sqrt(query.nearest->limit()) * 1.000001f;
            return true;
        }
        const bool touches = query.kind == QueryKind::sphere
                                 ? jostle::overlaps(query.queries->spheres[query.i], box)
                                 : jostle::overlaps(query.queries->boxes[query.i], box);
        if (touches) query.found->add(arguments->primID);
        return false;
    }

    Boxes3 boxes_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    RTCGeometry geometry_ = nullptr;
};

} // namespace

std::unique_ptr<QueryPeer> make_embree_queries()
{
    return std::make_unique<Embree>();
}

std::vector<std::unique_ptr<QueryPeer>> make_query_peers()
{
    std::vector<std::unique_ptr<QueryPeer>> peers;
    peers.push_back(make_embree_queries());
    peers.push_back(make_bullet_queries());
    peers.push_back(make_fcl_queries());
    peers.push_back(make_boost_queries());
    return peers;
}

} // namespace jostle_bench
