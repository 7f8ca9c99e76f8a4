// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string_view>

#include "c_api/handles.hpp"
#include "jostle/jostle.h"

// What the files of the WebAssembly modules share. Their functions keep to the C interface's rules, a
// status and `error`, and are called by extras/js/src/ alone.

#define JOSTLE_JS extern "C" __attribute__((used, visibility("default")))

namespace jostle_js {

/// A name and what it stands for, for JavaScript to read.
struct Info
{
    const char* name;
    std::uint32_t name_size;
    const char* summary;
    std::uint32_t summary_size;
    double pairs_per_object;
    std::uint32_t hostile, reserved;
};

inline Info info_of(std::string_view name, std::string_view summary)
{
    return {name.data(),
            static_cast<std::uint32_t>(name.size()),
            summary.data(),
            static_cast<std::uint32_t>(summary.size()),
            0,
            0,
            0};
}

/// What std::invalid_argument says, as an error of the caller's.
template <class F>
jostle_status guarded_scene(jostle_error* error, F&& inside)
{
    return jostle::c_api::guarded(error, [&] {
        try {
            inside();
        } catch (const std::invalid_argument& wrong) {
            jostle::c_api::refuse(wrong.what());
        }
    });
}

} // namespace jostle_js
