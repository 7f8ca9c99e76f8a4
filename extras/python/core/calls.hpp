// SPDX-License-Identifier: MIT
#pragma once

#include <pybind11/pybind11.h>

#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "jostle/jostle.h"

// How the package calls jostle.h: without Python's lock, with errors as exceptions and handles that free
// themselves.

namespace py = pybind11;

namespace jostle_python {

using namespace py::literals;

/// The first exception of a callback in Python, until the call that it ended has returned.
class Pending
{
  public:
    /// Runs a callback in Python; -1 if it raised.
    template <class F>
    std::int32_t call(F&& function) noexcept
    {
        const py::gil_scoped_acquire with_python;
        try {
            return function() ? 1 : 0;
        } catch (...) {
            PyErr_Clear(); // still set where there was no memory to take it from Python
            const std::lock_guard lock(mutex_);
            if (first_ == nullptr) first_ = std::current_exception();
            return -1;
        }
    }
    void rethrow()
    {
        if (first_ != nullptr) std::rethrow_exception(std::exchange(first_, nullptr));
    }

  private:
    std::mutex mutex_;
    std::exception_ptr first_;
};

/// Raises the package's exception for a status; `index` is the object at fault, or None.
[[noreturn]] void raise_error(const std::string& status, const std::string& message, const py::object& index);
/// Raises the one for an invalid argument.
[[noreturn]] void refuse(const std::string& message);
[[noreturn]] void raise(const jostle_error& error);

/// What a function in Python has answered to yes or no.
[[nodiscard]] inline bool truth_of(const py::object& answer)
{
    try {
        return answer.cast<bool>();
    } catch (const py::cast_error&) {
        refuse("accept returned " + std::string(py::repr(answer)) + ": it must return True or False");
    }
}

/// Calls f(error) without Python's lock. What went wrong becomes an exception.
template <class F>
void call(F&& f, Pending* pending = nullptr)
{
    jostle_error error;
    jostle_status status;
    {
        const py::gil_scoped_release without_python;
        status = f(&error);
    }
    if (status == JOSTLE_OK) return;
    // First: where the library had no memory for saying that a callback failed, it says that. The exception
    // must not stay in any case, since its traceback holds its holders.
    if (pending != nullptr) pending->rethrow();
    raise(error);
}

struct Free
{
    void operator()(void* handle) const noexcept { jostle_free(handle, nullptr); }
};
template <class Handle>
using Owned = std::unique_ptr<Handle, Free>;
using Executor = Owned<jostle_executor>;
using Results = Owned<jostle_results>;
using FinderHandle = Owned<jostle_finder>;
using ImagesHandle = Owned<jostle_images>;
using IndexHandle = Owned<jostle_index>;
using WorldHandle = Owned<jostle_world>;
using ShapeHandle = Owned<jostle_shape>;
using ShapesHandle = Owned<jostle_shapes>;
using ContactFinderHandle = Owned<jostle_contact_finder>;

/// Makes a handle: make(&out, error).
template <class Owner, class F>
Owner make(F&& f)
{
    typename Owner::pointer out = nullptr;
    call([&](jostle_error* error) { return f(&out, error); });
    return Owner(out);
}

[[nodiscard]] Results new_results(const jostle_allocator* allocator = nullptr);

/// The executor for that many threads; null, which means the default, for 0.
[[nodiscard]] Executor executor_of(std::uint32_t threads);
[[nodiscard]] jostle_options options_of(const Executor& executor,
                                        const jostle_allocator* allocator = nullptr);

} // namespace jostle_python
