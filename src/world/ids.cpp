// SPDX-License-Identifier: MIT
#include "world/ids.hpp"

#include <string>

JOSTLE_NAMESPACE_BEGIN
namespace world {

void IdTable::throw_stale(ObjectId id) const
{
    const std::string name =
        "object " + std::to_string(id.index) + " (generation " + std::to_string(id.generation) + ")";
    const std::uint32_t now = generation(id.index);
    std::string why;
    if (id.generation == 0 || id.index >= end())
        why = " was never handed out by this world; use ids that add() returned";
    else if (now == 0)
        why = " was removed; forget its id when you remove it";
    else
        why = " was removed, and index " + std::to_string(id.index) + " now has generation " +
              std::to_string(now) + "; forget an object's id when you remove it";
    throw Error(ErrorCode::stale_id, name + why, id.index);
}

} // namespace world
JOSTLE_NAMESPACE_END
