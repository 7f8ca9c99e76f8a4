// SPDX-License-Identifier: MIT
#pragma once

#include <random>
#include <string>

namespace jostle_system {

/// Part of a name that can't be guessed.
inline std::string random_letters()
{
    std::random_device random;
    std::string letters;
    for (int i = 0; i < 12; ++i)
        letters += static_cast<char>('a' + random() % 26);
    return letters;
}

} // namespace jostle_system
