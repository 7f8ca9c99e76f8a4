// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace jostle_tool {

/// What main() does in each program that is called `jostle`: sets up the streams, passes the arguments on,
/// that of the program's name first, and makes of what is thrown one line on stderr. The exit status is 0,
/// 2 for what users can mend, and 1 for our own faults.
int run_program(int argc, char** argv, const std::function<void(const std::vector<std::string>&)>& work);

} // namespace jostle_tool
