// SPDX-License-Identifier: MIT
#include <cstring>
#include <memory>

#include "c_api/results.hpp"
#include "c_api/shapes.hpp"
#include "jostle/closed_mesh.hpp"

namespace jostle::c_api {

class ClosedMeshContent final : public Content
{
  public:
    explicit ClosedMeshContent(const Mesh<3>& mesh) : solid(mesh) {}
    ClosedMesh solid;
};

template <>
struct Behind<jostle_closed_mesh> : Kind<ClosedMeshContent, 0x11>
{
    static constexpr const char* name = "jostle_closed_mesh";
};

namespace {

/// inside(solid, pose, points, executor) in floats or doubles.
template <class F>
void with_points(const jostle_closed_mesh* mesh, jostle_space space, const void* pose,
                 const jostle_values* points, const jostle_executor* executor, F&& inside)
{
    const ClosedMesh& solid = open(mesh).solid;
    const auto kept = executor == nullptr ? nullptr : keep_executor(executor);
    in_space(space, [&](auto in) {
        using T = typename decltype(in)::T;
        if constexpr (decltype(in)::dim != 3) {
            refuse("a closed mesh is in 3D: give JOSTLE_3F or JOSTLE_3D");
        } else {
            Pose<3, T> at;
            if (pose != nullptr)
                std::memcpy(static_cast<void*>(&at), wanted_array_of<Pose<3, T>>(pose, 1, "pose"), sizeof at);
            inside(solid, at, view<Vec<3, T>>(wanted(points, "points"), "points"),
                   kept == nullptr ? serial_executor() : *kept);
        }
    });
}

template <Coordinate T>
constexpr bool as_documented = sizeof(SignedDistance<T>) == 7 * sizeof(T);
static_assert(as_documented<float> && as_documented<double>);

} // namespace
} // namespace jostle::c_api

using namespace jostle;
using namespace jostle::c_api;

extern "C" {

jostle_status jostle_closed_mesh_new(const jostle_shape* mesh, jostle_closed_mesh** out, jostle_error* error)
{
    return guarded(error, [&] {
        wanted(out, "out");
        const OneShape<3>& shape = shape_of<3>(mesh, "mesh");
        if (shape.owned == nullptr || !shape.owned->mesh) refuse("mesh is a shape of another type");
        hand_out(out, std::make_unique<ClosedMeshContent>(*shape.owned->mesh));
    });
}
jostle_status jostle_closed_mesh_winding_numbers(const jostle_closed_mesh* mesh, const double* points,
                                                 uint64_t count, int32_t* numbers, jostle_error* error)
{
    return guarded(error, [&] {
        const ClosedMesh& solid = open(mesh).solid;
        const auto* const given = wanted_array_of<Vec<3, double>>(points, count, "points");
        wanted_array(numbers, count, "numbers");
        for_each_object(static_cast<std::size_t>(count),
                        [&](std::size_t i) { numbers[i] = solid.winding_number(given[i]); });
    });
}
jostle_status jostle_closed_mesh_contains(const jostle_closed_mesh* mesh, jostle_space space,
                                          const void* pose, const jostle_values* points,
                                          const jostle_executor* executor, uint8_t* inside,
                                          jostle_error* error)
{
    return guarded(error, [&] {
        with_points(mesh, space, pose, points, executor,
                    [&](const ClosedMesh& solid, const auto& at, const auto& given, Executor& on) {
                        solid.contains(at, given,
                                       std::span(wanted_array(inside, given.size(), "inside"), given.size()),
                                       on);
                    });
    });
}
jostle_status jostle_closed_mesh_signed_distances(const jostle_closed_mesh* mesh, jostle_space space,
                                                  const void* pose, const jostle_values* points,
                                                  const jostle_executor* executor, void* distances,
                                                  jostle_error* error)
{
    return guarded(error, [&] {
        with_points(
            mesh, space, pose, points, executor,
            [&]<class T>(const ClosedMesh& solid, const Pose<3, T>& at, const auto& given, Executor& on) {
                auto* const out = wanted_array_of<SignedDistance<T>>(distances, given.size(), "distances");
                solid.signed_distances(at, given, std::span(out, given.size()), on);
            });
    });
}

} // extern "C"
