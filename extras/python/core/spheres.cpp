// SPDX-License-Identifier: MIT
// Spheres that touch: pairs of the boxes around them, of which those whose spheres are apart are left out.
#include <cmath>
#include <cstring>
#include <limits>

#include "core/module.hpp"
#include "core/pairs.hpp"

namespace jostle_python {

namespace {

/// Spheres that touch, in double: what join() keeps of the pairs of boxes.
struct SphereFilter
{
    jostle_boxes a, b; // lo is the centre
    const double *radii_a, *radii_b;
    jostle_space space;

    [[nodiscard]] bool touch(std::uint64_t i, std::uint64_t k) const
    {
        return is_float(space) ? touch_of<float>(i, k) : touch_of<double>(i, k);
    }
    template <class T>
    [[nodiscard]] bool touch_of(std::uint64_t i, std::uint64_t k) const
    {
        double sum = 0;
        for (int d = 0; d < dim_of(space); ++d) {
            T p, q;
            std::memcpy(&p, static_cast<const char*>(a.lo[d]) + static_cast<std::int64_t>(i) * a.stride,
                        sizeof p);
            std::memcpy(&q, static_cast<const char*>(b.lo[d]) + static_cast<std::int64_t>(k) * b.stride,
                        sizeof q);
            const double gap = static_cast<double>(p) - static_cast<double>(q);
            sum += gap * gap;
        }
        const double reach = radii_a[i] + radii_b[k];
        return sum <= reach * reach;
    }
};

/// Boxes around spheres, no smaller than they whatever rounding does; `centers` is (n, d).
template <class T>
py::array boxes_around(const py::array& centers, const Packed<double>& radii, const char* name)
{
    const py::ssize_t n = centers.shape(0), dim = centers.shape(1);
    py::array_t<T> boxes({n, py::ssize_t(2), dim});
    T* out = boxes.mutable_data();
    const double* const reach = radii.data();
    const auto* row = static_cast<const char*>(centers.data());
    const py::ssize_t row_stride = centers.strides(0), stride = centers.strides(1);
    py::ssize_t wrong = n;
    {
        const py::gil_scoped_release without_python;
        constexpr T few = 8 * std::numeric_limits<T>::epsilon();
        for (py::ssize_t i = 0; i < n; ++i, row += row_stride, out += 2 * dim) {
            const T radius = static_cast<T>(reach[i]); // rounded: the few are more than that
            bool finite = reach[i] >= 0 && std::isfinite(reach[i]);
            for (py::ssize_t d = 0; d < dim; ++d) {
                T at;
                std::memcpy(&at, row + d * stride, sizeof at);
                finite = finite && std::isfinite(at);
                const T more = radius + few * (std::abs(at) + radius) + std::numeric_limits<T>::denorm_min();
                out[d] = at - more;
                out[dim + d] = at + more;
            }
            if (!finite) {
                wrong = i;
                break;
            }
        }
    }
    if (wrong == n) return boxes;
    raise_error("invalid_argument",
                std::string(name) + "[" + std::to_string(wrong) + "] has the radius " +
                    std::string(py::str(py::float_(reach[wrong]))) + " and the place " +
                    std::string(py::str(centers[py::int_(wrong)])) +
                    ": both must be finite, and the radius at least 0",
                py::int_(wrong));
}

} // namespace

void define_spheres(py::module_& m)
{
    m.def("join", [](const Array& points, const Maybe& other, const F64& radii,
                     const std::optional<F64>& other_radii, bool sorted, std::uint32_t threads) {
        const auto view_of = [](const Array& from, const F64& reach) {
            if (from.ndim() != 2 || (from.shape(1) != 2 && from.shape(1) != 3))
                refuse("points has the shape " + shape_text(from) + ": it must be (n, 2) or (n, 3)");
            want_length(reach, static_cast<std::uint64_t>(from.shape(0)), "radii");
            jostle_boxes view{};
            for (py::ssize_t d = 0; d < from.shape(1); ++d)
                view.lo[d] = static_cast<const char*>(from.data()) + d * from.strides(1);
            view.count = static_cast<std::uint64_t>(from.shape(0));
            view.stride = from.strides(0);
            return view;
        };
        const jostle_boxes centers = view_of(points, radii);
        const bool single = points.dtype().equal(py::dtype::of<float>());
        const jostle_space space = space_of(points.shape(1), single);
        want_number(points, space, "points");
        const auto around = [&](const Array& from, const F64& reach, const char* name) {
            return single ? boxes_around<float>(from, reach, name) : boxes_around<double>(from, reach, name);
        };
        SphereFilter spheres{centers, centers, radii.data(), radii.data(), space};
        const Array boxes = around(points, radii, "points");
        Maybe other_boxes;
        if (other) {
            spheres.b = view_of(*other, other_radii.value());
            spheres.radii_b = other_radii->data();
            want_number(*other, space, "other");
            if (other->shape(1) != points.shape(1)) refuse("other has other dimensions than points");
            other_boxes = around(*other, *other_radii, "other");
        }
        PairFilter none({}, {}, {}, {}, {}, {}, 0, {}, py::none());
        const auto accept = [](void* context, std::uint32_t i, std::uint32_t k) -> std::int32_t {
            const auto* const self = static_cast<const SphereFilter*>(context);
            return self->touch(i, k) ? 1 : 0;
        };
        return find(boxes, other_boxes, none, sorted, threads, accept, &spheres);
    });
}

} // namespace jostle_python
