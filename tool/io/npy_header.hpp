// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace jostle_tool {

/// What an NPY file of this machine's own numbers begins with. `type` is NumPy's, without the order of its
/// bytes ("u4", "f4"); `shape` is a Python tuple, "(17, 2)".
[[nodiscard]] std::string npy_header(const std::string& type, const std::string& shape);

} // namespace jostle_tool
