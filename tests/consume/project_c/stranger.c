/* SPDX-License-Identifier: MIT */
#include <jostle/jostle.h>
#include <stdio.h>

/* A hull as well: it takes more of the C++ runtime than pairs do. */
int main(void)
{
    const float rows[3][6] = {{0, 0, 0, 1, 1, 1}, {1, 0, 0, 2, 1, 1}, {5, 5, 5, 6, 6, 6}};
    const double corners[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    jostle_boxes boxes;
    jostle_finder* finder;
    jostle_shape* hull;
    jostle_blocks pairs;
    jostle_error error;
    uint64_t faces = 0;

    boxes = jostle_boxes_strided(JOSTLE_3F, &rows[0][0], &rows[0][3], 3, sizeof rows[0]);
    if (jostle_finder_new(NULL, &finder, &error) ||
        jostle_finder_find(finder, JOSTLE_3F, &boxes, NULL, NULL, JOSTLE_CANONICAL, &pairs, &error) ||
        jostle_shape_hull(JOSTLE_3D, corners, 4, 0, &hull, &error) ||
        jostle_shape_face_count(hull, &faces, &error)) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    if (pairs.count != 1 || faces != 4) return 1;
    jostle_free(hull, NULL);
    return jostle_free(finder, NULL);
}
