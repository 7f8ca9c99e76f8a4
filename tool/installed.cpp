// SPDX-License-Identifier: MIT
#include "installed.hpp"

#include <system_error>

namespace jostle_tool {

std::filesystem::path installed(const std::string& name)
{
    std::error_code unknown; // where there is no /proc
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", unknown);
    if (unknown) return {};
    const auto path = (program.parent_path() / JOSTLE_DATA_FROM_BIN / name).lexically_normal();
    return std::filesystem::exists(path, unknown) ? path : std::filesystem::path();
}

} // namespace jostle_tool
