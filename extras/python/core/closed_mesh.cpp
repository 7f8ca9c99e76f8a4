// SPDX-License-Identifier: MIT
#include "core/interrupts.hpp"
#include "core/module.hpp"
#include "core/shapes.hpp"

namespace jostle_python {

namespace {

using ClosedMeshHandle = Owned<jostle_closed_mesh>;

class ClosedMesh
{
  public:
    explicit ClosedMesh(const Shape& mesh)
    {
        handle = make_apart<ClosedMeshHandle>([of = mesh.handle](auto** out, auto* error) {
            return jostle_closed_mesh_new(of.get(), out, error);
        });
    }
    /// Calls f(space, pose, some of the points, the number of the first of these, executor, error); both
    /// arrays are of the space's numbers.
    template <class F>
    void with(const Array& pose, const Array& points, std::uint32_t threads, F&& f) const
    {
        const jostle_space space = space_of(3, points.dtype().equal(py::dtype::of<float>()));
        const auto count = static_cast<std::uint64_t>(points.ndim() == 2 ? points.shape(0) : 0);
        want_rows(points, space, 3, count, "points");
        want_rows(pose, space, 7, 1, "pose");
        const auto* const given = static_cast<const char*>(points.data());
        const py::ssize_t row = points.strides(0);
        const void* const at = pose.data();
        const Executor executor = executor_of(threads);
        call_in_parts(count, nullptr, [&](std::uint64_t first, std::uint64_t number, jostle_error* error) {
            const jostle_values some{given + static_cast<std::int64_t>(first) * row, number, row};
            return f(space, at, &some, first, executor.get(), error);
        });
    }
    ClosedMeshHandle handle;
};

} // namespace

void define_closed_mesh(py::module_& m)
{
    define_class<ClosedMesh>(m, "ClosedMesh")
        .def(py::init<const Shape&>())
        .def("winding_numbers",
             [](const ClosedMesh& self, const F64& points) {
                 const auto count = static_cast<std::uint64_t>(points.ndim() == 2 ? points.shape(0) : 0);
                 want_rows(points, JOSTLE_3D, 3, count, "points");
                 Packed<std::int32_t> out(static_cast<py::ssize_t>(count));
                 std::int32_t* const numbers = out.mutable_data();
                 const double* const given = points.data();
                 call_in_parts(count, nullptr, [&](auto first, auto some, jostle_error* error) {
                     return jostle_closed_mesh_winding_numbers(self.handle.get(), given + 3 * first, some,
                                                               numbers + first, error);
                 });
                 return out;
             })
        .def("contains",
             [](const ClosedMesh& self, const Array& pose, const Array& points, std::uint32_t threads) {
                 Packed<std::uint8_t> out(points.ndim() == 2 ? points.shape(0) : 0);
                 std::uint8_t* const inside = out.mutable_data();
                 self.with(pose, points, threads,
                           [&](auto space, auto at, auto given, auto first, auto executor, auto error) {
                               return jostle_closed_mesh_contains(self.handle.get(), space, at, given,
                                                                  executor, inside + first, error);
                           });
                 return out;
             })
        .def("signed_distances", [](const ClosedMesh& self, const Array& pose, const Array& points,
                                    std::uint32_t threads) {
            Array out(points.dtype(), {points.ndim() == 2 ? points.shape(0) : 0, py::ssize_t(7)});
            auto* const distances = static_cast<char*>(out.mutable_data());
            const auto row = static_cast<std::uint64_t>(out.strides(0));
            self.with(pose, points, threads,
                      [&](auto space, auto at, auto given, auto first, auto executor, auto error) {
                          return jostle_closed_mesh_signed_distances(
                              self.handle.get(), space, at, given, executor, distances + first * row, error);
                      });
            return out;
        });
}

} // namespace jostle_python
