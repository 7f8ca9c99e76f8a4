// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <random>
#include <string>

/// A new folder, which goes with all that is in it when the object does.
class TemporaryFolder
{
  public:
    TemporaryFolder()
    {
        do
            path_ = std::filesystem::temp_directory_path() /
                    ("jostle-test-" + std::to_string(std::random_device()()));
        while (!std::filesystem::create_directory(path_));
    }
    ~TemporaryFolder()
    {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  private:
    std::filesystem::path path_;
};
