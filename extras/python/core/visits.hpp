// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "core/arrays.hpp"

// Answers and pairs handed to a function in Python as they are found, some at a time.

namespace jostle_python {

/// The user's function, and what it is to be handed next. To call Python for each answer would cost more than
/// to find it, so that answers come as arrays.
class Visitor
{
  public:
    /// For one object at a time, or two; `narrow` ids are 32-bit numbers in the arrays.
    Visitor(py::object visit, std::uint64_t chunk, py::ssize_t width, bool narrow, Pending& pending)
        : visit_(std::move(visit)), chunk_(chunk), width_(width), narrow_(narrow), pending_(pending)
    {
        if (chunk == 0) refuse("chunk is 0: it must be at least 1");
    }
    Visitor(const Visitor&) = delete;

    /// Runs find(this as context, &finished, error), then hands over what is left. Whether the function never
    /// said stop.
    template <class F>
    bool run(F&& find)
    {
        std::int32_t finished = 0;
        call([&](jostle_error* error) { return find(this, &finished, error); }, &pending_);
        if (finished != 0 && !at_.empty()) {
            finished = hand_over(nullptr);
            pending_.rethrow();
        }
        return finished != 0;
    }

    static std::int32_t take_answer(void* context, std::uint64_t id, double at, const void*,
                                    double* bound) noexcept
    {
        return static_cast<Visitor*>(context)->take(&id, at, bound);
    }
    static std::int32_t take_pair(void* context, std::uint64_t a, std::uint64_t b, double at,
                                  double* bound) noexcept
    {
        const std::uint64_t both[2] = {a, b};
        return static_cast<Visitor*>(context)->take(both, at, bound);
    }
    static std::int32_t take_touching_pair(void* context, std::uint64_t a, std::uint64_t b) noexcept
    {
        return take_pair(context, a, b, 0, nullptr);
    }

  private:
    std::int32_t take(const std::uint64_t* ids, double at, double* bound) noexcept
    {
        try {
            ids_.insert(ids_.end(), ids, ids + width_);
            at_.push_back(at);
        } catch (...) {
            return pending_.call([]() -> bool { throw; });
        }
        ordered_ = bound != nullptr;
        if (at_.size() >= chunk_) return hand_over(bound);
        if (at_.size() % 65536 != 0) return 1;
        return pending_.call([] { // a chunk may be all there is: Ctrl-C ends it
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            return true;
        });
    }
    std::int32_t hand_over(double* bound) noexcept
    {
        double lowered = std::numeric_limits<double>::infinity();
        const std::int32_t status = pending_.call([&] {
            const py::object ids = narrow_ ? array_of<std::uint32_t>() : array_of<std::uint64_t>();
            const py::object at = copy_array(at_.data(), at_.size());
            ids_.clear();
            at_.clear();
            const py::object answer = visit_(ids, at);
            py::detail::make_caster<bool> truth; // Python's, or NumPy's
            if (answer.is_none()) return true;
            if (truth.load(answer, false)) return static_cast<bool>(truth);
            lowered = py::float_(answer);
            if (!ordered_)
                refuse("these have no order that a number could bound: return None, True or False");
            if (std::isnan(lowered)) refuse("the bound is NaN: it must be a number");
            return true;
        });
        if (bound != nullptr && lowered < *bound) *bound = lowered;
        return status;
    }
    template <class Id>
    [[nodiscard]] py::object array_of() const
    {
        std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(at_.size())};
        if (width_ == 2) shape.push_back(2);
        Packed<Id> out(shape);
        std::copy(ids_.begin(), ids_.end(), out.mutable_data());
        return out;
    }

    py::object visit_;
    std::uint64_t chunk_;
    py::ssize_t width_;
    bool narrow_;
    std::vector<std::uint64_t> ids_;
    std::vector<double> at_;
    bool ordered_ = false;
    Pending& pending_;
};

} // namespace jostle_python
