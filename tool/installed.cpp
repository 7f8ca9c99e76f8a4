// SPDX-License-Identifier: MIT
#include "installed.hpp"

#include <system_error>

#include "tool/system/system.hpp"

namespace jostle_tool {

std::filesystem::path installed(const std::string& name)
{
    const std::filesystem::path program = jostle_system::this_program();
    if (program.empty()) return {};
    std::error_code unknown;
    const auto path = (program.parent_path() / JOSTLE_DATA_FROM_BIN / name).lexically_normal();
    return std::filesystem::exists(path, unknown) ? path : std::filesystem::path();
}

} // namespace jostle_tool
