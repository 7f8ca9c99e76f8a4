// SPDX-License-Identifier: MIT
#include "core/arrays.hpp"

namespace jostle_python {

int dim_of(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_2D ? 2 : 3;
}
bool is_float(jostle_space space)
{
    return space == JOSTLE_2F || space == JOSTLE_3F;
}
jostle_space space_of(py::ssize_t dim, bool single)
{
    return dim == 2 ? (single ? JOSTLE_2F : JOSTLE_2D) : (single ? JOSTLE_3F : JOSTLE_3D);
}
py::dtype number_of(jostle_space space)
{
    return is_float(space) ? py::dtype::of<float>() : py::dtype::of<double>();
}
std::string shape_text(const py::array& array)
{
    return py::str(array.attr("shape"));
}
void want_number(const py::array& array, jostle_space space, const char* name)
{
    if (!number_of(space).is(array.dtype()) && !array.dtype().equal(number_of(space)))
        refuse(std::string(name) + " must be " + (is_float(space) ? "float32" : "float64") +
               " as the rest, not " + std::string(py::str(array.dtype())));
}

Boxes boxes_of(const py::array& array, const char* name, jostle_space wanted)
{
    Boxes boxes{array};
    const bool single = array.dtype().equal(py::dtype::of<float>());
    if (!single && !array.dtype().equal(py::dtype::of<double>()))
        refuse(std::string(name) + " must be float32 or float64, not " + std::string(py::str(array.dtype())));
    py::ssize_t dim = 0, axis_stride = 0, half_stride = 0;
    if (array.ndim() == 3 && array.shape(1) == 2) {
        dim = array.shape(2);
        axis_stride = array.strides(2);
        half_stride = array.strides(1);
    } else if (array.ndim() == 2 && array.shape(1) % 2 == 0) {
        dim = array.shape(1) / 2;
        axis_stride = array.strides(1);
        half_stride = dim * axis_stride;
    }
    if (dim != 2 && dim != 3)
        refuse(std::string(name) + " has the shape " + shape_text(array) +
               ": it must be (n, 2, d) or (n, 2 d), with d 2 or 3, lower bounds before upper ones" +
               (array.ndim() == 2 && (array.shape(1) == 2 || array.shape(1) == 3)
                    ? "; make one array of two by numpy.stack([lo, hi], axis=1)"
                    : ""));
    boxes.space = space_of(dim, single);
    if (wanted != any_space && wanted != boxes.space)
        refuse(std::string(name) + " is " + std::to_string(dim) + "D " + (single ? "float32" : "float64") +
               ", and it must be " + std::to_string(dim_of(wanted)) + "D " +
               (is_float(wanted) ? "float32" : "float64"));
    const auto* const first = static_cast<const char*>(array.data());
    boxes.view.count = static_cast<std::uint64_t>(array.shape(0));
    boxes.view.stride = array.strides(0);
    for (py::ssize_t d = 0; d < dim; ++d) {
        boxes.view.lo[d] = first + d * axis_stride;
        boxes.view.hi[d] = first + half_stride + d * axis_stride;
    }
    return boxes;
}

void want_rows(const py::array& array, jostle_space space, py::ssize_t width, std::uint64_t count,
               const char* name)
{
    want_number(array, space, name);
    if (array.ndim() != 2 || array.shape(1) != width || static_cast<std::uint64_t>(array.shape(0)) != count)
        refuse(std::string(name) + " has the shape " + shape_text(array) + ": it must be (" +
               (array.ndim() == 2 ? std::to_string(count) : "n") + ", " + std::to_string(width) + ")");
    if ((array.flags() & py::array::c_style) == 0) refuse(std::string(name) + " must be contiguous");
}

py::array copy_pairs(const jostle_blocks& blocks)
{
    Packed<std::uint32_t> pairs({static_cast<py::ssize_t>(blocks.count), py::ssize_t(2)});
    void* const out = pairs.mutable_data();
    call([&](jostle_error* error) { return jostle_blocks_copy(&blocks, blocks.count, out, error); });
    return pairs;
}
py::array copy_pairs(const Results& results)
{
    jostle_blocks blocks;
    call([&](jostle_error* error) { return jostle_results_blocks(results.get(), &blocks, error); });
    return copy_pairs(blocks);
}
} // namespace jostle_python
