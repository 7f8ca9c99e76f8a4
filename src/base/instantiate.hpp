// SPDX-License-Identifier: MIT
#pragma once

/// The spaces that the library is compiled for, by dimensions and coordinates. A source file that defines
/// templates ends by compiling them for these.
#define JOSTLE_FOR_EACH_SPACE(Instantiate)                                                                   \
    Instantiate(2, float) Instantiate(2, double) Instantiate(3, float) Instantiate(3, double)
