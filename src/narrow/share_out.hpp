// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>

#include "jostle/executor.hpp"

JOSTLE_NAMESPACE_BEGIN
namespace narrow {

/// Calls work(worker, block) for each block, blocks claimed one by one; `worker` is below
/// workers_for(executor, blocks). The first exception by block number is thrown again afterwards.
inline std::uint32_t workers_for(const Executor& executor, std::uint64_t blocks)
{
    const std::uint64_t most = executor.concurrency();
    return static_cast<std::uint32_t>(blocks < most ? blocks : most);
}
template <class Work>
void share_out(Executor& executor, std::uint64_t blocks, const Work& work)
{
    std::atomic<std::uint64_t> next{0};
    std::mutex mutex;
    std::exception_ptr error;
    std::uint64_t error_block = 0;
    const auto task = [&](std::uint32_t worker) {
        for (std::uint64_t block; (block = next.fetch_add(1, std::memory_order_relaxed)) < blocks;) {
            try {
                work(worker, block);
            } catch (...) {
                const std::lock_guard lock(mutex);
                if (!error || block < error_block) error = std::current_exception(), error_block = block;
            }
        }
    };
    executor.run(workers_for(executor, blocks), task);
    if (error) std::rethrow_exception(error);
}

} // namespace narrow
JOSTLE_NAMESPACE_END
