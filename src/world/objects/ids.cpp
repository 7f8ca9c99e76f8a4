// SPDX-License-Identifier: MIT
#include "world/objects/ids.hpp"

#include <string>

JOSTLE_NAMESPACE_BEGIN
namespace world {

void IdTable::throw_stale(ObjectId id) const
{
    if (id == ObjectId{})
        throw Error(ErrorCode::stale_id, "an empty ObjectId names no object; use ids that add() returned");
    const std::string name =
        "object " + std::to_string(id.index) + " (generation " + std::to_string(id.generation) + ")";
    const std::uint32_t now = generation(id.index);
    std::string why;
    if (id.generation == 0 || id.index >= end())
        why = " was never handed out by this world; use ids that add() returned";
    else
        why =
            " is not in this world" +
            (now == 0 ? std::string() : ", where this index has generation " + std::to_string(now)) +
            ": it was removed, comes from another world, or was added after the snapshot that this one is of";
    throw Error(ErrorCode::stale_id, name + why, id.index);
}

} // namespace world
JOSTLE_NAMESPACE_END
