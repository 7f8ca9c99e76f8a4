// SPDX-License-Identifier: MIT
#pragma once

#if !defined(_MSVC_LANG) && __cplusplus < 202002L
#error "Jostle needs C++20: compile with -std=c++20"
#endif

/// Version of these headers. The numbers are read by CMakeLists.txt; they stand nowhere else.
#define JOSTLE_VERSION_MAJOR 0
#define JOSTLE_VERSION_MINOR 3
#define JOSTLE_VERSION_PATCH 0

/// Everything lives in `jostle`, inside an inline namespace of the interface's version, so that two
/// versions linked into one program can't be mixed up silently: the link fails instead.
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
