#include "imaging/front.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { SUPPORT = 9, NEIGHBORS = 26 }; /* SUPPORT: of a flat front; tried on a lung: 3 and 7 ran into airways */
enum { INSIDE = 1, LISTED = 2, BORDER = 4 }; /* of a voxel */

struct voxel_list {
    size_t *items, count, room;
};

struct front {
    ptrdiff_t around[NEIGHBORS]; /* from a voxel to its neighbours, those through faces first */
    const float *force;
    uint8_t *state;
    struct voxel_list list, next; /* voxels that may change sides in this round and in the next */
};

static void find_neighbors(const int dims[3], ptrdiff_t around[NEIGHBORS])
{
    int count = 0;
    for (int distance = 1; distance <= 3; ++distance) {
        for (int n = 0; n < 27; ++n) {
            const int x = n % 3 - 1, y = n / 3 % 3 - 1, z = n / 9 - 1;
            if (x * x + y * y + z * z == distance) {
                around[count++] = x + (ptrdiff_t)dims[0] * (y + (ptrdiff_t)dims[1] * z);
            }
        }
    }
}

static bool is_inside(const struct front *front, size_t at) { return (front->state[at] & INSIDE) != 0; }

static bool on_border(const int dims[3], size_t at)
{
    const size_t nx = (size_t)dims[0], ny = (size_t)dims[1], nz = (size_t)dims[2];
    const size_t x = at % nx, y = at / nx % ny, z = at / (nx * ny);
    return x == 0 || x + 1 == nx || y == 0 || y + 1 == ny || z == 0 || z + 1 == nz;
}

/* Returns true if the force asks the voxel to change sides and its neighbours allow it. */
static bool should_change(const struct front *front, size_t at)
{
    const bool inside = is_inside(front, at);
    if (inside ? !(front->force[at] < 0.0f) : !(front->force[at] > 0.0f)) {
        return false;
    }
    int faces = 0, others = 0;
    for (int n = 0; n < NEIGHBORS; ++n) {
        others += is_inside(front, at + (size_t)front->around[n]) != inside;
        faces = n < 6 ? others : faces;
    }
    return faces > 0 && others >= SUPPORT;
}

/* Lists a voxel for the next round, unless it is there, or the force has it where it is. Returns false if memory is short. */
static bool list(struct front *front, size_t at)
{
    struct voxel_list *next = &front->next;
    const float force = front->force[at];
    if ((front->state[at] & (LISTED | BORDER)) || !(is_inside(front, at) ? force < 0.0f : force > 0.0f)) {
        return true;
    }
    if (next->count == next->room) {
        const size_t room = next->room + next->room / 2 + 1024;
        size_t *items = realloc(next->items, room * sizeof *items);
        if (!items) {
            return false;
        }
        next->items = items;
        next->room = room;
    }
    front->state[at] |= LISTED;
    next->items[next->count++] = at;
    return true;
}

static void take_next(struct front *front)
{
    const struct voxel_list old = front->list;
    front->list = front->next;
    front->next = old;
    front->next.count = 0;
    for (size_t i = 0; i < front->list.count; ++i) {
        front->state[front->list.items[i]] &= (uint8_t)~LISTED;
    }
}

/* Lets the listed voxels change sides together and lists their neighbours. changed: grows by how many have. */
static bool advance(struct front *front, size_t *changed)
{
    size_t *items = front->list.items, changing = 0;
    bool good = true;
    for (size_t i = 0; i < front->list.count; ++i) {
        if (should_change(front, items[i])) {
            items[changing++] = items[i];
        }
    }
    for (size_t i = 0; i < changing; ++i) {
        front->state[items[i]] ^= INSIDE;
    }
    for (size_t i = 0; good && i < changing; ++i) {
        for (int n = 0; good && n < NEIGHBORS; ++n) {
            good = list(front, items[i] + (size_t)front->around[n]);
        }
    }
    *changed += changing;
    return good;
}

bool front_move(const int dims[3], const float *force, int most, float *phi, size_t *changed)
{
    const size_t total = (size_t)dims[0] * (size_t)dims[1] * (size_t)dims[2];
    struct front front = {.force = force, .state = malloc(total)};
    bool good = front.state != NULL;
    *changed = 0;
    find_neighbors(dims, front.around);
    for (size_t n = 0; good && n < total; ++n) {
        front.state[n] = on_border(dims, n) ? BORDER : phi[n] < 0.0f ? INSIDE : 0;
    }
    for (size_t n = 0; good && n < total; ++n) {
        good = (front.state[n] & BORDER) || !should_change(&front, n) || list(&front, n);
    }
    for (int i = 0; good && i < most && front.next.count > 0; ++i) {
        take_next(&front);
        good = advance(&front, changed);
    }
    for (size_t n = 0; good && n < total; ++n) {
        phi[n] = is_inside(&front, n) ? (force[n] > 0.0f ? -force[n] : -0.5f) : (force[n] < 0.0f ? -force[n] : 0.5f);
    }
    free(front.state);
    free(front.list.items);
    free(front.next.items);
    return good;
}
