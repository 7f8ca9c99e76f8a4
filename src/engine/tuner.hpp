// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

#include "engine/record.hpp"
#include "engine/sample.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace engine {

/// A grid and its cost by the model, in model nanoseconds per box.
template <class T>
struct TunedGrid
{
    Grid<T> grid;
    double cost = 0;
};

/// Chooses a grid for `boxes` boxes of which `sample` was drawn. Deterministic: it uses no library function
/// whose result may differ between machines. `share`: the part of their windows that rows are tested against.
template <int Dim, class T>
TunedGrid<T> tune(Sample& sample, std::size_t boxes, double share = 1);

/// A grid of one brick around most of a few boxes: an eighth of them may be elsewhere or be giants.
template <int Dim, class T>
Grid<T> fit(Sample& sample, int sweep_axis);

/// The model cost per box of sweeping one brick whose rows have windows of `steps` steps each on average.
double sweep_cost(double steps) noexcept;

} // namespace engine
JOSTLE_NAMESPACE_END
