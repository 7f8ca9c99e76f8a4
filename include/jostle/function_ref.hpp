// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <type_traits>
#include <utility>

#include "jostle/version.hpp"

JOSTLE_NAMESPACE_BEGIN

template <class Signature>
class FunctionRef;

/// A reference to something callable: two pointers, no allocation, no ownership.
///
/// Lifetime  the callable must outlive the reference. A lambda written in the argument list of the
///           call that takes the FunctionRef does.
template <class Result, class... Args>
class FunctionRef<Result(Args...)>
{
  public:
    /// Refers to nothing; tests false.
    FunctionRef() = default;

    template <class F>
        requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef> &&
                 std::is_invocable_r_v<Result, F&, Args...>)
    FunctionRef(F&& callable)
        : object_(const_cast<void*>(static_cast<const void*>(std::addressof(callable)))),
          call_([](void* object, Args... args) -> Result {
              return (*static_cast<std::remove_reference_t<F>*>(object))(std::forward<Args>(args)...);
          })
    {
    }

    Result operator()(Args... args) const { return call_(object_, std::forward<Args>(args)...); }
    explicit operator bool() const noexcept { return call_ != nullptr; }

  private:
    void* object_ = nullptr;
    Result (*call_)(void*, Args...) = nullptr;
};

JOSTLE_NAMESPACE_END
