// SPDX-License-Identifier: MIT
#include "page_server.hpp"

#include <chrono>

#include "io/npy_header.hpp"
#include "options.hpp"

namespace jostle_tool {

void add_page_options(const Command& command, PageOptions& options)
{
    command.number("--port", options.port, 1, 65'535, "P", "Serve there; any free port if not given");
    command.text("--page", options.page, "DIR", "The page's folder, as ./run web --build DIR writes it");
}

void LiveFrames::show(std::uint64_t frame, std::span<const jostle::Aabb3f> boxes)
{
    std::string npy = npy_header("f4", "(" + std::to_string(boxes.size()) + ", 2, 3)");
    npy.append(reinterpret_cast<const char*>(boxes.data()), boxes.size_bytes());
    const std::lock_guard lock(mutex_);
    npy_.swap(npy);
    frame_ = frame;
    shown_ = true;
    changed_.notify_all();
}

void LiveFrames::end()
{
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
}

bool LiveFrames::watched() const
{
    const std::lock_guard lock(mutex_);
    return watched_;
}

LiveFrames::Answer LiveFrames::newest()
{
    const std::lock_guard lock(mutex_);
    watched_ = true;
    return {npy_, frame_, ended_};
}

LiveFrames::Answer LiveFrames::newer_than(std::uint64_t seen)
{
    std::unique_lock lock(mutex_);
    watched_ = true;
    const auto is_newer = [&] { return shown_ && frame_ != seen; };
    changed_.wait_for(lock, std::chrono::seconds(1), [&] { return is_newer() || ended_; });
    return {is_newer() ? npy_ : std::string(), frame_, ended_};
}

} // namespace jostle_tool
