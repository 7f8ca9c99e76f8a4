// SPDX-License-Identifier: MIT
#include "world/world-inl.hpp"

JOSTLE_NAMESPACE_BEGIN
template class World<2, float>;
JOSTLE_NAMESPACE_END
