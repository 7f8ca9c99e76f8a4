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
/// Lifetime  the callable must outlive the reference. A lambda in the argument list of the call that takes
///           the FunctionRef does. One that is assigned would not, so that doesn't compile: give it a name.
///           Structs of options, which keep a reference longer than a call, use StoredFunctionRef.
template <class Result, class... Args>
class FunctionRef<Result(Args...)>
{
  public:
    /// Refers to nothing; tests false.
    FunctionRef() = default;

    template <class F>
        requires(!std::is_base_of_v<FunctionRef, std::remove_cvref_t<F>> &&
                 std::is_invocable_r_v<Result, F&, Args...>)
    FunctionRef(F&& callable)
    {
        if constexpr (is_function<F>) {
            using Function = std::remove_pointer_t<std::decay_t<F>>;
            target_.function = reinterpret_cast<void (*)()>(static_cast<Function*>(callable));
            call_ = [](Target target, Args... args) -> Result {
                return (*reinterpret_cast<Function*>(target.function))(std::forward<Args>(args)...);
            };
        } else {
            target_.object = const_cast<void*>(static_cast<const void*>(std::addressof(callable)));
            call_ = [](Target target, Args... args) -> Result {
                return (*static_cast<std::remove_reference_t<F>*>(target.object))(
                    std::forward<Args>(args)...);
            };
        }
    }
    /// Deleted for callables with the wrong result, such as a visitor that forgets to return whether to go
    /// on.
    template <class F>
        requires(!std::is_base_of_v<FunctionRef, std::remove_cvref_t<F>> &&
                 std::is_invocable_v<F&, Args...> && !std::is_invocable_r_v<Result, F&, Args...>)
    FunctionRef(F&& returns_something_else) = delete;
    template <class F>
        requires(!std::is_same_v<std::remove_cvref_t<F>, FunctionRef> && !std::is_lvalue_reference_v<F> &&
                 !std::is_function_v<std::remove_pointer_t<std::decay_t<F>>>)
    FunctionRef& operator=(F&&) = delete;

    Result operator()(Args... args) const { return call_(target_, std::forward<Args>(args)...); }
    explicit operator bool() const noexcept { return call_ != nullptr; }

  private:
    union Target
    {
        void* object = nullptr;
        void (*function)();
    };
    template <class F>
    static constexpr bool is_function = std::is_function_v<std::remove_pointer_t<std::decay_t<F>>>;

    Target target_;
    Result (*call_)(Target, Args...) = nullptr;
};

template <class Signature>
class StoredFunctionRef;

/// A FunctionRef that is a member, such as `accept` of a filter. Since the struct may outlive a temporary, it
/// accepts only functions and named callables: a lambda written in place doesn't compile.
///
///     const auto accept = [&](std::uint32_t a, std::uint32_t b) { return a + b < limit; };
///     const jostle::Filter filter{.accept = accept};
///
/// Lifetime  the callable must outlive the last use of the reference.
template <class Result, class... Args>
class StoredFunctionRef<Result(Args...)> : public FunctionRef<Result(Args...)>
{
    template <class F>
    static constexpr bool lasts =
        std::is_lvalue_reference_v<F> || std::is_function_v<std::remove_pointer_t<std::remove_cvref_t<F>>>;

  public:
    /// Refers to nothing; tests false.
    StoredFunctionRef() = default;

    template <class F>
        requires(!std::is_same_v<std::remove_cvref_t<F>, StoredFunctionRef> && lasts<F> &&
                 std::is_constructible_v<FunctionRef<Result(Args...)>, F>)
    StoredFunctionRef(F&& callable) : FunctionRef<Result(Args...)>(std::forward<F>(callable))
    {
    }
    /// A temporary would be destroyed before it is called: give it a name.
    template <class F>
        requires(!std::is_same_v<std::remove_cvref_t<F>, StoredFunctionRef> && !lasts<F>)
    StoredFunctionRef(F&& temporary) = delete;
};

JOSTLE_NAMESPACE_END
