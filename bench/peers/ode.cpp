// SPDX-License-Identifier: MIT
#include <ode/ode.h>

#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

// ODE's usual choice, dHashSpace, is no peer: it loses pairs silently. Its sweep-and-prune space finds all.
constexpr PeerInfo peer_info{
    "ode",
    "ODE 0.16 dSweepAndPruneSpace (its hash space loses pairs): dGeomSetPosition for "
    "what moved, dSpaceCollide",
    100'000, false, true};

/// What a geom of our class carries: where its box lies.
struct GeomBox
{
    const jostle::Aabb3f* box;
};

void box_of_geom(dGeomID geom, dReal bounds[6])
{
    const jostle::Aabb3f& box = *static_cast<const GeomBox*>(dGeomGetClassData(geom))->box;
    for (int d = 0; d < 3; ++d) {
        bounds[2 * d] = box.lo[d];
        bounds[2 * d + 1] = box.hi[d];
    }
}

/// A geom whose bounds are exactly a box; ODE's own boxes compute theirs from centre and size, rounded.
int box_class()
{
    static const int number = [] {
        dInitODE2(0);
        dGeomClass geom_class{};
        geom_class.bytes = sizeof(GeomBox);
        geom_class.collider = [](int) -> dColliderFn* { return nullptr; };
        geom_class.aabb = box_of_geom;
        return dCreateGeomClass(&geom_class);
    }();
    return number;
}

class Ode final : public Peer<3>
{
  public:
    ~Ode() override { Ode::stop(); }
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<3> boxes, std::uint32_t) override
    {
        stop();
        boxes_ = boxes;
        const int geom_class = box_class();
        space_ = dSweepAndPruneSpaceCreate(nullptr, dSAP_AXES_XYZ);
        for (std::size_t i = 0; i < boxes.size(); ++i) {
            const dGeomID geom = dCreateGeom(geom_class);
            dGeomSetData(geom, reinterpret_cast<void*>(i));
            static_cast<GeomBox*>(dGeomGetClassData(geom))->box = &boxes[i];
            move(geom, boxes[i]);
            dSpaceAdd(space_, geom);
            geoms_.push_back(geom);
        }
    }

    void frame(Boxes<3> boxes, std::span<const std::uint32_t> moved) override
    {
        if (boxes.data() != boxes_.data())
            for (std::size_t i = 0; i < boxes.size(); ++i)
                static_cast<GeomBox*>(dGeomGetClassData(geoms_[i]))->box = &boxes[i];
        boxes_ = boxes;
        pairs_.clear();
        for (const std::uint32_t i : moved)
            move(geoms_[i], boxes[i]);
        dSpaceCollide(space_, this, [](void* context, dGeomID x, dGeomID y) {
            auto& self = *static_cast<Ode*>(context);
            const std::uint32_t a = object(x), b = object(y);
            if (jostle::overlaps(self.boxes_[a], self.boxes_[b])) self.pairs_.push_back({a, b});
        });
    }

    PeerResult result() const override { return summarise(pairs_); }

    void stop() override
    {
        if (space_ != nullptr) dSpaceDestroy(space_); // and its geoms
        space_ = nullptr;
        geoms_.clear();
        pairs_.clear();
    }

  private:
    static void move(dGeomID geom, const jostle::Aabb3f& box)
    {
        dGeomSetPosition(geom, (dReal(box.lo[0]) + box.hi[0]) / 2, (dReal(box.lo[1]) + box.hi[1]) / 2,
                         (dReal(box.lo[2]) + box.hi[2]) / 2);
    }
    static std::uint32_t object(dGeomID geom)
    {
        return static_cast<std::uint32_t>(reinterpret_cast<std::size_t>(dGeomGetData(geom)));
    }

    Boxes<3> boxes_;
    dSpaceID space_ = nullptr;
    std::vector<dGeomID> geoms_;
    std::vector<jostle::Pair> pairs_;
};

} // namespace

std::unique_ptr<Peer<3>> make_ode()
{
    return std::make_unique<Ode>();
}

} // namespace jostle_bench
