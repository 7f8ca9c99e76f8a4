// SPDX-License-Identifier: MIT
// A program without exceptions and RTTI, linked with a jostle_all.cpp that has them.
#include <cstdio>
#include <limits>

#include "jostle.h"

#if defined(__cpp_exceptions) || defined(__cpp_rtti)
#error "compile it with -fno-exceptions -fno-rtti"
#endif

int main()
{
    float corners[2][6] = {{0, 0, 0, 1, 1, 1}, {1, 0, 0, 2, 1, 1}};
    jostle_boxes boxes;
    jostle_finder* finder = nullptr;
    jostle_blocks pairs;
    jostle_error error;
    const auto find = [&] {
        return jostle_finder_find(finder, JOSTLE_3F, &boxes, nullptr, nullptr, JOSTLE_CANONICAL, &pairs,
                                  &error);
    };
    boxes = jostle_boxes_strided(JOSTLE_3F, corners[0], corners[0] + 3, 2, sizeof corners[0]);
    if (jostle_finder_new(nullptr, &finder, &error) != JOSTLE_OK || find() != JOSTLE_OK || pairs.count != 1) {
        std::fprintf(stderr, "one pair expected: %s\n", error.message);
        return 1;
    }
    corners[1][2] = std::numeric_limits<float>::quiet_NaN();
    if (find() != JOSTLE_NAN_COORDINATE || error.index != 1) {
        std::fprintf(stderr, "an error about box 1 expected: %s\n", error.message);
        return 1;
    }
    return jostle_free(finder, nullptr);
}
