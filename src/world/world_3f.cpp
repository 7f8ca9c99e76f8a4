// SPDX-License-Identifier: MIT
#include "world/world-inl.hpp"

JOSTLE_NAMESPACE_BEGIN
JOSTLE_INSTANTIATE_WORLD(3, float)
JOSTLE_NAMESPACE_END
