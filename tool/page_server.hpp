// SPDX-License-Identifier: MIT
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>

#include "jostle/box.hpp"

namespace jostle_tool {

class Command;

/// Options of the commands that show something on the page.
struct PageOptions
{
    std::filesystem::path page; ///< its folder; empty: where it was installed or built
    std::uint32_t port = 0;     ///< 0: any that is free
};
void add_page_options(const Command& command, PageOptions& options);

/// Moving boxes for the page, which asks for the newest frame.
///
/// Threads  any.
class LiveFrames
{
  public:
    /// `title` says what they are.
    explicit LiveFrames(std::string title) : title_(std::move(title)) {}

    /// Takes the place of the frame before.
    void show(std::uint64_t frame, std::span<const jostle::Aabb3f> boxes);
    /// There will be no frame after the present one.
    void end();
    /// Whether somebody has asked for a frame.
    [[nodiscard]] bool watched() const;

    struct Answer
    {
        std::string npy; ///< the boxes as a file of NumPy's, (n, 2, 3); empty if there is no newer frame
        std::uint64_t frame = 0;
        bool ended = false;
    };
    /// The frame if it isn't `seen`. Waits for it, but a second at most.
    [[nodiscard]] Answer newer_than(std::uint64_t seen);
    /// The frame.
    [[nodiscard]] Answer newest();

    [[nodiscard]] const std::string& title() const noexcept { return title_; }

  private:
    const std::string title_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    std::string npy_;
    std::uint64_t frame_ = 0;
    bool shown_ = false, ended_ = false, watched_ = false;
};

/// The page (docs/guide/web.md), served to this machine alone, on 127.0.0.1, for as long as the object lives.
class PageServer
{
  public:
    /// Throws UsageError if there is no page, or the port is another program's.
    explicit PageServer(const PageOptions& options);
    ~PageServer();

    /// Serves a file beside the page, and returns the address at which the page shows it. Not after start().
    [[nodiscard]] std::string show(const std::filesystem::path& file);
    /// The same for boxes that move; `frames` must outlive the server.
    [[nodiscard]] std::string show(LiveFrames& frames);
    void start();

  private:
    struct Http;
    std::unique_ptr<Http> http_;
};

} // namespace jostle_tool
