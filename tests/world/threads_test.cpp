// SPDX-License-Identifier: MIT
#include "twin.hpp"
