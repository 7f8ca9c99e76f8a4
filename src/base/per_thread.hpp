// SPDX-License-Identifier: MIT
#pragma once

#include "jostle/version.hpp"

#ifdef __EMSCRIPTEN__
#include <pthread.h>
#endif

JOSTLE_NAMESPACE_BEGIN

/// A pointer that each thread has for itself, one for each type; null at first.
///
/// In WebAssembly it isn't thread_local: the npm package's modules without threads are linked from the same
/// objects as those with threads, and then wasm-ld 14 puts thread_local variables amid the constants.
template <class Value>
class PerThread
{
  public:
#ifdef __EMSCRIPTEN__
    [[nodiscard]] static Value* get() noexcept { return static_cast<Value*>(pthread_getspecific(key())); }
    static void set(Value* value) noexcept { pthread_setspecific(key(), value); }

  private:
    static pthread_key_t key() noexcept
    {
        static const pthread_key_t made = [] {
            pthread_key_t fresh;
            pthread_key_create(&fresh, nullptr);
            return fresh;
        }();
        return made;
    }
#else
    [[nodiscard]] static Value* get() noexcept { return value_; }
    static void set(Value* value) noexcept { value_ = value; }

  private:
    static inline constinit thread_local Value* value_ = nullptr;
#endif
};

JOSTLE_NAMESPACE_END
