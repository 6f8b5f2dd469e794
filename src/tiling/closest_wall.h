/* closest_wall.h - the closest place of a wall to each of many points: the closest point of the mesh of all walls (walls.h), found by a
   hierarchy of its triangles, in world coordinates, so that distances are the world's on any grid. */
#ifndef SPRINGLS__TILING_CLOSEST_WALL_H
#define SPRINGLS__TILING_CLOSEST_WALL_H

#include "../model/closest_point.h"
#include "../output/query.h"
#include "walls.h"

typedef struct springls__wall_query {
    const springls_context *host;
    const springls_walls *walls;
    const springls__surface *surface;
    const float *points;
    springls_wall_hit *out;
} springls__wall_query;

SPRINGLS__FN void springls__closest_wall_task(void *arg, int begin, int end)
{
    const springls__wall_query *q = (const springls__wall_query *)arg;
    for (; begin < end; begin++) {
        float near_point[3];
        const double left_out = springls__bring_near(q->host, q->points + 3 * (size_t)begin, near_point);
        const springls__v3 x = springls__load3(near_point);
        const springls__surface_hit found = springls__surface_closest(q->surface, x, FLT_MAX);
        const bool any = found.triangle >= 0;
        const int32_t *labels = q->walls->labels + (any ? 2 * (size_t)found.triangle : 0);
        springls_wall_hit *out = &q->out[begin];
        const springls__v3 place = any ? found.hit.point : x;
        const int low = any && labels[0] > labels[1];
        out->point[0] = place.x, out->point[1] = place.y, out->point[2] = place.z;
        out->distance = any ? springls__whole_distance((double)springls__length(springls__sub(place, x)), left_out) : FLT_MAX;
        out->labels[0] = any ? labels[low] : SPRINGLS__NO_LABEL;
        out->labels[1] = any ? labels[!low] : SPRINGLS__NO_LABEL;
    }
}

/* Makes the hierarchy of the triangles of walls. */
SPRINGLS__FN springls_status springls__surface_of_walls(springls_tiling *tiling, const springls_walls *walls, springls__surface *surface)
{
    int i;
    SPRINGLS__TRY(springls__surface_reserve(tiling->host, surface, walls->triangle_count));
    for (i = 0; i < 3 * walls->triangle_count; i++)
        surface->points[i] = springls__load3(walls->positions + 3 * (size_t)walls->triangles[i]);
    return springls__surface_finish(tiling->host, surface, walls->triangle_count);
}

SPRINGLS__TILINGS_API springls_status springls_tiling_closest_wall(springls_tiling *tiling, const float *points, int count,
                                                                   springls_wall_hit *out)
{
    springls__surface surface;
    springls__wall_query q;
    springls_walls walls;
    springls_status status;
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__check_points(tiling->host, points, count, out, "tiling_closest_wall"));
    SPRINGLS__TRY(springls__make_walls(tiling, "tiling_closest_wall", &walls));
    memset(&surface, 0, sizeof surface);
    status = springls__surface_of_walls(tiling, &walls, &surface);
    q.host = tiling->host;
    q.walls = &walls;
    q.surface = &surface;
    q.points = points;
    q.out = out;
    if (status == SPRINGLS_OK) springls__parallel(tiling->host, count, 64, springls__closest_wall_task, &q);
    springls__surface_free(tiling->host, &surface);
    springls_walls_free(tiling, &walls);
    return status;
}

#endif
