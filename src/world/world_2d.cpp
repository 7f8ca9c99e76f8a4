// SPDX-License-Identifier: MIT
#include "world/world-inl.hpp"

JOSTLE_NAMESPACE_BEGIN
JOSTLE_INSTANTIATE_WORLD(2, double)
JOSTLE_NAMESPACE_END
