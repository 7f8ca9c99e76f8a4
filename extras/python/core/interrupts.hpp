// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <new>
#include <thread>
#include <utility>

#include "core/calls.hpp"

// Calls that Ctrl-C ends. The library knows nothing of signals, and there are three ways to look for them:
//
//   what is asked about many things is asked in parts, with a look in between: call_in_parts;
//   one piece of work, such as a search for pairs, looks while it allocates or calls back: Interruptible;
//   what is made and does neither, such as a hull, is made on another thread and left to it: make_apart.
//
// Visits look in what they call (visits.hpp).

namespace jostle_python {

/// Calls ask(first, count, error) about `count` things, a few at a time, at most `most`, and looks for
/// signals in between. If there are none, it is called once all the same, so that the other arguments are
/// checked. After a mistake it is called about all of them at once, so that the mistake's number counts from
/// the first one.
template <class F>
void call_in_parts(std::uint64_t count, Pending* pending, F&& ask, std::uint64_t most = UINT64_MAX)
{
    using Clock = std::chrono::steady_clock;
    std::uint64_t first = 0, part = std::min<std::uint64_t>(4, most); // each may take a second
    do {
        const std::uint64_t now = std::min(part, count - first);
        const Clock::time_point begin = Clock::now();
        bool all_at_once = false;
        call(
            [&](jostle_error* error) {
                const jostle_status status = ask(first, now, error);
                if (status == JOSTLE_OK || first == 0 || error->index == UINT64_MAX) return status;
                all_at_once = true;
                return ask(std::uint64_t{0}, count, error);
            },
            pending);
        if (all_at_once) return; // another thread has corrected it
        first += now;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
        const auto took = Clock::now() - begin;
        if (took < std::chrono::milliseconds(25))
            part = std::min(part * (took < std::chrono::milliseconds(2) ? 8 : 2), most);
        if (took > std::chrono::milliseconds(100)) part = std::max<std::uint64_t>(part / 2, 1);
    } while (first < count);
}

/// Memory for calls that may take long. The thread that makes such a call looks for signals now and then,
/// while it allocates. If a signal's handler raises, there is no memory left, and that ends the call; the
/// library leaves everything unchanged. The call stays on its thread: to a world it matters which thread a
/// command comes from.
class Interruptible
{
  public:
    Interruptible()
    {
        allocator_.struct_size = sizeof allocator_;
        allocator_.context = this;
        allocator_.allocate = [](void* context, std::uint64_t size, std::uint64_t alignment) -> void* {
            if (!static_cast<Interruptible*>(context)->may_go_on()) return nullptr;
            return ::operator new(size, std::align_val_t(alignment), std::nothrow);
        };
        allocator_.deallocate = [](void*, void* memory, std::uint64_t, std::uint64_t alignment) {
            ::operator delete(memory, std::align_val_t(alignment));
        };
    }
    Interruptible(const Interruptible&) = delete;
    [[nodiscard]] const jostle_allocator* allocator() const noexcept { return &allocator_; }

    /// Whether a call goes on: for callbacks, which fail where it doesn't. The thread that made the call
    /// looks for signals here.
    bool may_go_on() noexcept
    {
        if (std::this_thread::get_id() == caller_.load(std::memory_order_relaxed) &&
            Clock::now() >= next_look_) {
            const py::gil_scoped_acquire with_python;
            if (PyErr_CheckSignals() != 0) {
                try {
                    throw py::error_already_set();
                } catch (...) {
                    PyErr_Clear(); // still set where there was no memory to take it from Python
                    interrupt_ = std::current_exception();
                }
                ended_ = true;
            }
            next_look_ = Clock::now() + pause;
        }
        return !ended_;
    }
    /// As call(), of a function that works in this memory. Where several threads call at a time, the signals
    /// interrupt the first one's call.
    template <class F>
    void call(F&& f, Pending* pending = nullptr)
    {
        std::thread::id nobody;
        if (!caller_.compare_exchange_strong(nobody, std::this_thread::get_id()))
            return jostle_python::call(f, pending);
        next_look_ = Clock::now() + pause;
        std::exception_ptr failed;
        try {
            jostle_python::call(f, pending);
        } catch (...) {
            failed = std::current_exception();
        }
        if (interrupt_ != nullptr) failed = std::exchange(interrupt_, nullptr);
        ended_ = false;
        caller_ = std::thread::id();
        if (failed != nullptr) std::rethrow_exception(failed);
    }

  private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds pause{50};

    jostle_allocator allocator_{};
    std::atomic<std::thread::id> caller_{}; // none: no such call now
    Clock::time_point next_look_;           // the caller's, as is what follows
    std::exception_ptr interrupt_;
    std::atomic<bool> ended_{false};
};

/// As make(), of what may take long. Where a signal ends the call, the other thread goes on, and what it
/// makes is given back: so `f` has all that it reads.
template <class Owner, class F>
Owner make_apart(F f)
{
    struct Making
    {
        explicit Making(F&& given) : f(std::move(given)) {}
        F f;
        jostle_error error{};
        jostle_status status = JOSTLE_OK;
        Owner made;
        std::mutex mutex;
        std::condition_variable changed;
        bool done = false;
    };
    const auto making = std::make_shared<Making>(std::move(f));
    std::thread([making] {
        typename Owner::element_type* out = nullptr;
        making->status = making->f(&out, &making->error);
        making->made = Owner(out);
        const std::lock_guard lock(making->mutex);
        making->done = true;
        making->changed.notify_all();
    }).detach();
    for (;;) {
        {
            const py::gil_scoped_release without_python;
            std::unique_lock lock(making->mutex);
            if (making->changed.wait_for(lock, std::chrono::milliseconds(50), [&] { return making->done; }))
                break;
        }
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
    if (making->status != JOSTLE_OK) raise(making->error);
    return std::move(making->made);
}

} // namespace jostle_python
