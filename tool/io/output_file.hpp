// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "tool/system/unfinished_file.hpp"

namespace jostle_tool {

/// What a command writes: an UnfinishedFile, which appears complete or not at all. "-" is stdout, and devices
/// and pipes are written directly. Errors are UsageErrors that name the file.
class OutputFile
{
  public:
    explicit OutputFile(const std::string& path);
    ~OutputFile();
    OutputFile(const OutputFile&) = delete;
    OutputFile& operator=(const OutputFile&) = delete;

    /// Buffered.
    void write(std::string_view bytes);
    void commit();

  private:
    void flush();
    template <class Work>
    void attempt(const Work& work);

    std::string name_; // as the user wrote it
    std::optional<jostle_system::UnfinishedFile> file_;
    int direct_ = -1; // what is written directly
    std::string buffer_;
};

/// Throws a UsageError where what is written to `out` would replace `in`, which is read.
void keep_input(const std::string& in, const std::string& out);

} // namespace jostle_tool
