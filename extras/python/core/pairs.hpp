// SPDX-License-Identifier: MIT
#pragma once

#include "core/pair_filter.hpp"

namespace jostle_python {

/// The pairs of one set of boxes or of two. Where `accept` isn't null, the filter is that function and its
/// context instead of Python's: it is called without Python's lock.
[[nodiscard]] py::array find(const Array& boxes, const Maybe& other, PairFilter& filter, bool sorted,
                             std::uint32_t threads, jostle_accept_pair_function accept = nullptr,
                             void* context = nullptr);

} // namespace jostle_python
