/* cell_marks.h - marks where something is: a bit for each cell of a box. */
#ifndef SPRINGLS__TOOLS_CELL_MARKS_H
#define SPRINGLS__TOOLS_CELL_MARKS_H

#include "../runtime/memory.h"

/* A bit for each cell of a box. */
typedef struct springls__cell_marks {
    springls__v3 lower;
    float scale; /* cells a voxel */
    int size[3];
    uint32_t *bits;
    springls__buffer memory;
} springls__cell_marks;

/* Finds the cells from place `lower` to place `upper`: those at the border stand for what lies beyond. */
SPRINGLS__FN void springls__cells_between(const springls__cell_marks *marks, springls__v3 lower, springls__v3 upper, int first[3],
                                          int last[3])
{
    const springls__v3 from = springls__scale(springls__sub(lower, marks->lower), marks->scale);
    const springls__v3 to = springls__scale(springls__sub(upper, marks->lower), marks->scale);
    first[0] = springls__cell_coordinate(from.x, 0, marks->size[0]);
    first[1] = springls__cell_coordinate(from.y, 0, marks->size[1]);
    first[2] = springls__cell_coordinate(from.z, 0, marks->size[2]);
    last[0] = springls__cell_coordinate(to.x, 0, marks->size[0]);
    last[1] = springls__cell_coordinate(to.y, 0, marks->size[1]);
    last[2] = springls__cell_coordinate(to.z, 0, marks->size[2]);
}

/* Marks the cells of a box, or (mark false) finds whether one of them is marked. */
SPRINGLS__FN bool springls__visit_cells(const springls__cell_marks *marks, springls__v3 lower, springls__v3 upper, bool mark)
{
    int first[3], last[3], x, y, z;
    springls__cells_between(marks, lower, upper, first, last);
    for (z = first[2]; z <= last[2]; z++)
        for (y = first[1]; y <= last[1]; y++)
            for (x = first[0]; x <= last[0]; x++) {
                const size_t cell = (size_t)x + (size_t)marks->size[0] * ((size_t)y + (size_t)marks->size[1] * (size_t)z);
                const uint32_t bit = 1u << (cell & 31u);
                if (mark) marks->bits[cell >> 5] |= bit;
                else if (marks->bits[cell >> 5] & bit) return true;
            }
    return false;
}

/* Makes cells, none of them marked, in a box: `scale` a voxel, or fewer where those would be too many. */
SPRINGLS__FN springls_status springls__cell_marks_begin(springls_context *ctx, springls__cell_marks *marks, springls__v3 lower,
                                                        springls__v3 upper, float scale)
{
    const double most = (double)(1 << 24); /* cells */
    const float extent[3] = { upper.x - lower.x, upper.y - lower.y, upper.z - lower.z };
    double cells = most + 1.0;
    int axis;
    marks->lower = lower;
    for (marks->scale = scale; cells > most; marks->scale *= 0.5f)
        for (axis = 0, cells = 1.0; axis < 3; axis++) {
            marks->size[axis] = 1 + (int)springls__min(springls__max(extent[axis], 0.0f) * marks->scale, (float)most);
            cells *= (double)marks->size[axis];
        }
    marks->scale *= 2.0f; /* as that which fits */
    SPRINGLS__TRY(springls__buffer_grow(ctx, &marks->memory, (size_t)cells / 32 + 1, sizeof(uint32_t), 0));
    marks->bits = (uint32_t *)marks->memory.data;
    memset(marks->bits, 0, ((size_t)cells / 32 + 1) * sizeof(uint32_t));
    return SPRINGLS_OK;
}

/* Marks the cells within a distance of a place. */
SPRINGLS__FN void springls__mark_cells_around(const springls__cell_marks *marks, springls__v3 x, float r)
{
    springls__visit_cells(marks, springls__v3_make(x.x - r, x.y - r, x.z - r), springls__v3_make(x.x + r, x.y + r, x.z + r), true);
}

#endif
