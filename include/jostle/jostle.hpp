// SPDX-License-Identifier: MIT
#pragma once

/// Everything. The parts are usable on their own.
#include "jostle/box.hpp"
#include "jostle/box_index.hpp"
#include "jostle/chapter.hpp"
#include "jostle/contact.hpp"
#include "jostle/error.hpp"
#include "jostle/executor.hpp"
#include "jostle/find_pairs.hpp"
#include "jostle/function_ref.hpp"
#include "jostle/pair_buffer.hpp"
#include "jostle/process.hpp"
#include "jostle/query.hpp"
#include "jostle/responses.hpp"
#include "jostle/shapes.hpp"
#include "jostle/stats.hpp"
#include "jostle/vec.hpp"
#include "jostle/version.hpp"
#include "jostle/world.hpp"
