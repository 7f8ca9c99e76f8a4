// SPDX-License-Identifier: MIT
#include <embree3/rtcore.h>

#include <stdexcept>
#include <string>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/task_arena.h>

#include "peer_parts.hpp"

namespace jostle_bench {
namespace {

constexpr PeerInfo peer_info{
    "embree",
    "Embree 3.13: one user geometry, rebuilt each frame at RTC_BUILD_QUALITY_LOW, rtcCollide with itself",
    20'000'000, true, true};

template <int Dim>
class Embree final : public Peer<Dim>
{
  public:
    ~Embree() override { stop(); }
    const PeerInfo& info() const noexcept override { return peer_info; }

    void start(Boxes<Dim> boxes, std::uint32_t threads) override
    {
        stop();
        boxes_ = boxes;
        // The arena bounds the threads of Embree's loops. Its own "threads=" would bound oneTBB for the whole
        // process, and so the systems that are timed beside it.
        arena_ = std::make_unique<tbb::task_arena>(static_cast<int>(threads));
        device_ = rtcNewDevice(nullptr);
        if (device_ == nullptr) fail();
        scene_ = rtcNewScene(device_);
        rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
        rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
        geometry_ = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
        rtcSetGeometryUserPrimitiveCount(geometry_, static_cast<unsigned>(boxes.size()));
        rtcSetGeometryUserData(geometry_, this);
        rtcSetGeometryBuildQuality(geometry_, RTC_BUILD_QUALITY_LOW);
        rtcSetGeometryBoundsFunction(geometry_, bounds, nullptr);
        rtcAttachGeometry(scene_, geometry_);
        fail_on_error();
    }

    void frame(Boxes<Dim> boxes, std::span<const std::uint32_t>) override
    {
        boxes_ = boxes;
        for (std::vector<jostle::Pair>& pairs : pairs_)
            pairs.clear();
        arena_->execute([&] {
            rtcCommitGeometry(geometry_);
            rtcCommitScene(scene_);
            rtcCollide(scene_, scene_, collide, this);
        });
        fail_on_error();
    }

    PeerResult result() const override
    {
        PeerResult all;
        for (const std::vector<jostle::Pair>& pairs : pairs_)
            all = all + summarise(pairs);
        return all;
    }

    void stop() override
    {
        if (geometry_ != nullptr) rtcReleaseGeometry(geometry_);
        if (scene_ != nullptr) rtcReleaseScene(scene_);
        if (device_ != nullptr) rtcReleaseDevice(device_);
        geometry_ = nullptr;
        scene_ = nullptr;
        device_ = nullptr;
        arena_.reset();
        pairs_.clear();
    }

  private:
    static void bounds(const RTCBoundsFunctionArguments* arguments)
    {
        const auto& self = *static_cast<const Embree*>(arguments->geometryUserPtr);
        const jostle::Aabb<Dim, float>& box = self.boxes_[arguments->primID];
        RTCBounds& out = *arguments->bounds_o;
        out.lower_x = box.lo[0];
        out.lower_y = box.lo[1];
        out.upper_x = box.hi[0];
        out.upper_y = box.hi[1];
        out.lower_z = 0;
        out.upper_z = 0;
        if constexpr (Dim == 3) {
            out.lower_z = box.lo[2];
            out.upper_z = box.hi[2];
        }
    }

    // Called from several threads with the primitives of leaves that overlap, each pair in both orientations.
    static void collide(void* context, RTCCollision* collisions, unsigned count)
    {
        auto& self = *static_cast<Embree*>(context);
        std::vector<jostle::Pair>& pairs = self.pairs_.local();
        for (unsigned i = 0; i < count; ++i) {
            const std::uint32_t a = collisions[i].primID0;
            const std::uint32_t b = collisions[i].primID1;
            if (a < b && jostle::overlaps(self.boxes_[a], self.boxes_[b])) pairs.push_back({a, b});
        }
    }

    void fail_on_error()
    {
        if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE)
            throw std::runtime_error("embree: error " + std::to_string(error) +
                                     " (see RTCError in its documentation)");
    }
    [[noreturn]] void fail()
    {
        throw std::runtime_error("embree: cannot create a device (error " +
                                 std::to_string(rtcGetDeviceError(nullptr)) + ")");
    }

    Boxes<Dim> boxes_;
    std::unique_ptr<tbb::task_arena> arena_;
    RTCDevice device_ = nullptr;
    RTCScene scene_ = nullptr;
    RTCGeometry geometry_ = nullptr;
    tbb::enumerable_thread_specific<std::vector<jostle::Pair>> pairs_;
};

} // namespace

template <int Dim>
std::unique_ptr<Peer<Dim>> make_embree()
{
    return std::make_unique<Embree<Dim>>();
}
template std::unique_ptr<Peer<2>> make_embree<2>();
template std::unique_ptr<Peer<3>> make_embree<3>();

} // namespace jostle_bench
