// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <new>
#include <thread>

#include "core/calls.hpp"

// Calls that Ctrl-C ends.

namespace jostle_python {

/// Memory of a call that may take long. Once the call is cancelled, there is none left: that ends it.
class Cancellable
{
  public:
    Cancellable()
    {
        allocator_.struct_size = sizeof allocator_;
        allocator_.context = this;
        allocator_.allocate = [](void* context, std::uint64_t size, std::uint64_t alignment) -> void* {
            if (static_cast<Cancellable*>(context)->cancelled.load(std::memory_order_relaxed)) return nullptr;
            return ::operator new(size, std::align_val_t(alignment), std::nothrow);
        };
        allocator_.deallocate = [](void*, void* memory, std::uint64_t, std::uint64_t alignment) {
            ::operator delete(memory, std::align_val_t(alignment));
        };
    }
    [[nodiscard]] const jostle_allocator* allocator() const noexcept { return &allocator_; }
    std::atomic<bool> cancelled{false};

  private:
    jostle_allocator allocator_{};
};

/// As call(), on another thread, while this one looks whether Ctrl-C was pressed: that cancels it.
template <class F>
void call_interruptibly(Cancellable& memory, F&& f, Pending* pending = nullptr)
{
    jostle_error error;
    jostle_status status = JOSTLE_OK;
    std::exception_ptr interrupt;
    {
        const py::gil_scoped_release without_python;
        std::mutex mutex;
        std::condition_variable ended;
        bool done = false;
        std::thread worker([&] {
            status = f(&error);
            const std::lock_guard lock(mutex);
            done = true;
            ended.notify_one();
        });
        std::unique_lock lock(mutex);
        while (!ended.wait_for(lock, std::chrono::milliseconds(50), [&] { return done; })) {
            if (interrupt != nullptr) continue;
            lock.unlock();
            {
                const py::gil_scoped_acquire with_python;
                if (PyErr_CheckSignals() != 0) {
                    try {
                        throw py::error_already_set();
                    } catch (...) {
                        interrupt = std::current_exception();
                    }
                    memory.cancelled = true;
                }
            }
            lock.lock();
        }
        lock.unlock();
        worker.join();
    }
    if (interrupt != nullptr) std::rethrow_exception(interrupt);
    if (status == JOSTLE_CALLBACK_FAILED && pending != nullptr) pending->rethrow();
    if (status != JOSTLE_OK) raise(error);
}
/// Calls of fewer objects are over before anybody could press a key.
constexpr py::ssize_t many = 20000;

} // namespace jostle_python
