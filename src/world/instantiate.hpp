// SPDX-License-Identifier: MIT
#pragma once

/// The kinds of worlds. Each stage is a template in a file of its own, which ends by compiling it for these.
#define JOSTLE_FOR_EACH_WORLD(Instantiate)                                                                   \
    Instantiate(2, float) Instantiate(2, double) Instantiate(3, float) Instantiate(3, double)
