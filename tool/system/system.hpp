// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// What operating systems do in different ways, as the command and what belongs to it need it. posix.cpp and
/// windows.cpp have the same functions. Text is UTF-8 and files are bytes, also on Windows.
///
/// Errors   std::system_error with a code of std::generic_category, where nothing else is said.
/// Threads  any function from any thread, but those that say that they belong to the start of main().
namespace jostle_system {

/// What main() does first: makes the standard streams carry bytes as they are, and the numbers 0 to 2 theirs
/// alone. Returns the arguments of main(), in UTF-8.
[[nodiscard]] std::vector<std::string> start(int argc, char** argv);

/// A path from UTF-8, and the other way round. What std::filesystem::path takes a std::string for depends on
/// the system, and on Windows on the compiler, too.
[[nodiscard]] std::filesystem::path path_of(std::string_view text);
[[nodiscard]] std::string text_of(const std::filesystem::path& path);

/// Whether somebody watches stderr, on a terminal that knows escape sequences.
[[nodiscard]] bool stderr_is_terminal();

/// The file of the running program; empty where the system doesn't say.
[[nodiscard]] std::filesystem::path this_program();

/// What the processor calls itself; empty where the system doesn't say.
[[nodiscard]] std::string processor_name();

/// Gives an environment variable a value unless it has one. Only before there are threads.
void set_default_variable(const char* name, const char* value);

/// Milliseconds that all threads of this process have worked.
[[nodiscard]] double processor_ms();
/// How often the system took a core away from this process; always 0 on Windows, which doesn't say.
[[nodiscard]] std::uint64_t preemptions();
/// The memory that this program has asked for and not given back. Takes a while where there are many pieces.
[[nodiscard]] std::uint64_t allocated_bytes();

// Files by the number that the system gives them; 0 is stdin and 1 is stdout. Programs that this one starts
// don't get them.
/// Whether it is there and neither a regular file nor a directory: a pipe, a terminal, a device.
[[nodiscard]] bool is_stream(const std::filesystem::path& path);
[[nodiscard]] int open_to_read(const std::filesystem::path& path);
/// Of what is there already; see UnfinishedFile for a new file.
[[nodiscard]] int open_to_write(const std::filesystem::path& path);
/// In bytes; none of what is no regular file.
[[nodiscard]] std::optional<std::uint64_t> size_of(int file);
/// Reads up to `most` bytes and returns how many: 0 at the end only.
[[nodiscard]] std::size_t read_some(int file, char* to, std::size_t most);
/// Writes all bytes, whatever signals come in between.
void write_all(int file, std::string_view bytes);
/// Some file systems find out only here that the disk is full.
void close_file(int file);

/// How a program ended, and what it wrote.
struct Finished
{
    bool well = false; ///< with exit status 0
    std::string output;
};
enum class Errors
{
    shown, ///< what the program writes to stderr appears on this one's
    taken  ///< it is part of the output
};
/// Runs a program, found as a shell finds it, with these words for arguments, and waits for its end. None if
/// it can't be started. Its stdin has the input, if there is any, and else what this program's has.
[[nodiscard]] std::optional<Finished> run_program(const std::vector<std::string>& command, Errors errors,
                                                  std::string_view input = {});

} // namespace jostle_system
