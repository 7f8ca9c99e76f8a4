// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <string>

namespace jostle_tool {

/// Where a file lies that was installed with this command, wherever the folder was moved to; empty if
/// there is none.
[[nodiscard]] std::filesystem::path installed(const std::string& name);

} // namespace jostle_tool
