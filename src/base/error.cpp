// SPDX-License-Identifier: MIT
#include "jostle/error.hpp"

JOSTLE_NAMESPACE_BEGIN

Error::Error(ErrorCode code, const std::string& message, std::uint64_t index)
    : std::runtime_error(message), code_(code), index_(index)
{
}

Error::~Error() = default;

JOSTLE_NAMESPACE_END
