// SPDX-License-Identifier: MIT
#pragma once
#include "jostle/find_pairs.hpp"
