// SPDX-License-Identifier: MIT
#pragma once

#if !defined(_MSVC_LANG) && __cplusplus < 202002L
#error "Jostle needs C++20: compile with -std=c++20"
#endif

/// The version of these headers. CMakeLists.txt reads the numbers from here, and they are nowhere else.
#define JOSTLE_VERSION_MAJOR 0
#define JOSTLE_VERSION_MINOR 3
#define JOSTLE_VERSION_PATCH 0

/// Everything is in `jostle`, inside an inline namespace named for the interface's version, so that linking
/// two versions into one program fails instead of mixing them up silently.
#define JOSTLE_NAMESPACE_BEGIN                                                                               \
    namespace jostle {                                                                                       \
    inline namespace v0 {
#define JOSTLE_NAMESPACE_END                                                                                 \
    }                                                                                                        \
    }

#if defined(_WIN32) && defined(JOSTLE_SHARED)
#ifdef JOSTLE_BUILDING
#define JOSTLE_API __declspec(dllexport)
#else
#define JOSTLE_API __declspec(dllimport)
#endif
#elif defined(__GNUC__)
#define JOSTLE_API __attribute__((visibility("default")))
#else
#define JOSTLE_API
#endif
