// SPDX-License-Identifier: MIT
#pragma once

#include <cstdio>
#include <limits>
#include <string>

#include "jostle/vec.hpp"

JOSTLE_NAMESPACE_BEGIN

/// printf's text of a number, with a point instead of the locale's, which has one byte or several.
inline std::string with_a_point(const char* printed)
{
    std::string text;
    bool has_point = false;
    for (const char* at = printed; *at != 0; ++at) {
        const bool is_own =
            (*at >= '0' && *at <= '9') || (*at >= 'a' && *at <= 'z') || *at == '-' || *at == '+';
        if (is_own || !has_point) text += is_own ? *at : '.';
        has_point = has_point || !is_own;
    }
    return text;
}

/// A number for messages, with as many digits as tell it from all others, whatever locale the program has.
/// (Not by a stream: where nothing else has one, its locales would be a quarter of a program, such as the npm
/// package's smallest modules.)
template <Coordinate T>
std::string number_text(T number)
{
    char digits[40];
    std::snprintf(digits, sizeof digits, "%.*g", std::numeric_limits<T>::max_digits10, double{number});
    return with_a_point(digits);
}

JOSTLE_NAMESPACE_END
