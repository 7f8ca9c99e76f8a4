// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <locale>
#include <sstream>
#include <string>

#include "jostle/vec.hpp"

JOSTLE_NAMESPACE_BEGIN

/// A number for messages, with as many digits as tell it from all others, whatever locale the program has.
template <Coordinate T>
std::string number_text(T number)
{
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out.precision(std::numeric_limits<T>::max_digits10);
    out << number;
    return out.str();
}

JOSTLE_NAMESPACE_END
