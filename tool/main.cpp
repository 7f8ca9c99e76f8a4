// SPDX-License-Identifier: MIT
// The command `jostle`. Each subcommand lives in its own file.
#include <string>
#include <vector>

#include "command_line.hpp"
#include "program.hpp"

int main(int argc, char** argv)
{
    return jostle_tool::run_program(argc, argv, [](const std::vector<std::string>& arguments) {
        std::vector<const char*> words;
        for (const std::string& argument : arguments)
            words.push_back(argument.c_str());
        jostle_tool::run(static_cast<int>(words.size()), words.data());
    });
}
