// SPDX-License-Identifier: MIT
// The program `jostle_demo`: what `jostle demo` shows, for ./run, which has it minutes before the rest of the
// command is compiled.
#include <string>
#include <vector>

#include "commands.hpp"
#include "demo.hpp"
#include "program.hpp"

int main(int argc, char** argv)
{
    return jostle_tool::run_program(argc, argv, [](const std::vector<std::string>& arguments) {
        if (arguments.size() > 1)
            throw jostle_tool::UsageError("jostle_demo takes no arguments; jostle demo does");
        jostle_tool::run_demo({});
    });
}
