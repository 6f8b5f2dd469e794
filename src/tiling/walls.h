/* walls.h - the walls of a tiling as one mesh, two labels a triangle, by dual contouring of the labels: a vertex in each cube of eight
   voxels that are not all of one label, a quad across each pair of neighbouring voxels whose labels differ. So walls meet in the
   vertices that they share, without cracks.

   A vertex lies where the planes of the walls in its cube meet in least squares. A plane is where the two phi are equal, moved to the
   middle of the two sheets of springls there, which know it better.

   Why no two triangles cross (after Ju and Udeshi, Intersection-free Contouring, 2006): a vertex lies inside its cube. The line between the
   vertices of two cubes that share a face passes through that face, and so cuts it, with its four sides, into four triangles. The pair of
   voxels p, q at the ends of a side and two cubes' vertices beside it make a tetrahedron; those of all pairs fill space without overlap.
   The quad around p and q has four of them, its envelope. Four triangles from a point between p and q to the quad's sides lie in it. So do
   the two on both sides of a diagonal, mostly, and these are taken wherever they do. */
#ifndef SPRINGLS__TILING_WALLS_H
#define SPRINGLS__TILING_WALLS_H

#include "decode.h"
#include "sheets.h"

/* What a cube's vertex is the least-squares solution of: A x = b, A symmetric, and the mean of the places where walls cross its edges. */
typedef struct springls__wall_planes { double a[6], b[3], mean[3]; int count; } springls__wall_planes;

typedef struct springls__walls_job {
    const springls_tiling *tiling;
    const int *size;
    const int32_t *label; /* of each voxel                                                                            */
    int *vertex;          /* of the cube from each voxel on; -1: none                                                 */
    int *cube;            /* of each vertex: its voxel                                                                */
    float *positions;     /* of the cubes' vertices, voxels                                                           */
    int cubes;            /* how many                                                                                 */
} springls__walls_job;

SPRINGLS__FN float springls__label_phi(const springls__walls_job *job, int number, const int at[3])
{
    const springls__tiling_body *body = &job->tiling->body[number];
    return body->sign * springls__grid_phi(&body->ctx->model.grid, body->ctx->model.grid.phi, at[0], at[1], at[2]);
}

/* Returns the slope at x of phi of one body less that of another, of unit length. */
SPRINGLS__FN springls__v3 springls__wall_normal(const springls__tiling_body *one, const springls__tiling_body *other, springls__v3 x)
{
    const springls__grid *g = &one->ctx->model.grid, *h = &other->ctx->model.grid;
    const springls__v3 a = springls__scale(springls__grid_gradient(g, g->phi, x), one->sign);
    return springls__normalize(springls__sub(a, springls__scale(springls__grid_gradient(h, h->phi, x), other->sign)));
}

/* Returns how far the wall between two bodies lies behind x along n: the mean of what their two sheets say, 0 if there is none. */
SPRINGLS__FN float springls__behind_sheets(const springls__tiling_body *one, const springls__tiling_body *other, springls__v3 x,
                                           springls__v3 n)
{
    const float trusted = 0.6f; /* voxel */
    float sum = 0.0f, d;
    int count = 0;
    if (springls__sheet_distance(one, x, n, &d) && springls__fabs(d) < trusted) {
        sum += d;
        count++;
    }
    if (springls__sheet_distance(other, x, springls__scale(n, -1.0f), &d) && springls__fabs(d) < trusted) {
        sum -= d;
        count++;
    }
    return count ? sum / (float)count : 0.0f;
}

/* A place where a wall crosses the edge between two voxels: the bodies on both sides, how far along the edge by phi, and the slope. */
typedef struct springls__wall_crossing { const springls__tiling_body *one, *other; float s; springls__v3 x, n; } springls__wall_crossing;

/* Finds where a wall crosses the edge between two neighbouring voxels along an axis; false: they have one label. */
SPRINGLS__FN bool springls__find_wall_crossing(const springls__walls_job *job, const int from[3], int axis, springls__wall_crossing *c)
{
    const springls__grid *g = &job->tiling->host->model.grid;
    int to[3], numbers[2], k;
    float xyz[3], f[2];
    for (k = 0; k < 3; k++) to[k] = from[k] + (k == axis);
    for (k = 0; k < 2; k++)
        numbers[k] = springls__body_number(job->tiling, job->label[springls__voxel_index(g, (k ? to : from)[0], (k ? to : from)[1],
                                                                                         (k ? to : from)[2])]);
    if (numbers[0] == numbers[1]) return false;
    for (k = 0; k < 2; k++)
        f[k] = springls__label_phi(job, numbers[0], k ? to : from) - springls__label_phi(job, numbers[1], k ? to : from);
    c->s = f[0] < f[1] ? springls__clamp(f[0] / (f[0] - f[1]), 0.0f, 1.0f) : 0.5f;
    for (k = 0; k < 3; k++) xyz[k] = (float)from[k] + (k == axis ? c->s : 0.0f);
    c->one = &job->tiling->body[numbers[0]];
    c->other = &job->tiling->body[numbers[1]];
    c->x = springls__load3(xyz);
    c->n = springls__wall_normal(c->one, c->other, c->x);
    return true;
}

/* Adds the plane of the wall that crosses an edge between voxels, where one does. */
SPRINGLS__FN void springls__add_wall_plane(const springls__walls_job *job, const int from[3], int axis, springls__wall_planes *planes)
{
    springls__wall_crossing c;
    springls__v3 x;
    double offset = 0.0, normal[3], at[3];
    int k;
    if (!springls__find_wall_crossing(job, from, axis, &c)) return;
    planes->mean[0] += (double)c.x.x, planes->mean[1] += (double)c.x.y, planes->mean[2] += (double)c.x.z;
    planes->count++;
    x = springls__mad(c.x, c.n, -springls__behind_sheets(c.one, c.other, c.x, c.n));
    normal[0] = (double)c.n.x, normal[1] = (double)c.n.y, normal[2] = (double)c.n.z;
    at[0] = (double)x.x, at[1] = (double)x.y, at[2] = (double)x.z;
    for (k = 0; k < 3; k++) offset += normal[k] * at[k];
    for (k = 0; k < 3; k++) {
        planes->a[k] += normal[k] * normal[k];
        planes->b[k] += normal[k] * offset;
    }
    planes->a[3] += normal[0] * normal[1];
    planes->a[4] += normal[0] * normal[2];
    planes->a[5] += normal[1] * normal[2];
}

/* Solves (A + r) d = b - A mean for the vertex mean + d, by Cramer's rule. r holds it near the mean where planes are nearly parallel; with
   it A is positive definite. */
SPRINGLS__FN void springls__meet_planes(const springls__wall_planes *p, double vertex[3])
{
    const double r = 0.05, *m = p->mean;
    const double a = p->a[0] + r, b = p->a[1] + r, c = p->a[2] + r, d = p->a[3], e = p->a[4], f = p->a[5];
    const double u = p->b[0] - (p->a[0] * m[0] + d * m[1] + e * m[2]), v = p->b[1] - (d * m[0] + p->a[1] * m[1] + f * m[2]);
    const double w = p->b[2] - (e * m[0] + f * m[1] + p->a[2] * m[2]);
    const double whole = a * (b * c - f * f) - d * (d * c - e * f) + e * (d * f - b * e);
    vertex[0] = m[0] + (u * (b * c - f * f) - d * (v * c - f * w) + e * (v * f - b * w)) / whole;
    vertex[1] = m[1] + (a * (v * c - f * w) - u * (d * c - e * f) + e * (d * w - v * e)) / whole;
    vertex[2] = m[2] + (a * (b * w - v * f) - d * (d * w - v * e) + u * (d * f - b * e)) / whole;
}

/* Finds the places of vertices, within their cubes. */
SPRINGLS__FN void springls__wall_vertex_task(void *arg, int begin, int end)
{
    const springls__walls_job *job = (const springls__walls_job *)arg;
    const double margin = 0.01; /* voxel */
    const int none[3] = { 0, 0, 0 };
    for (; begin < end; begin++) {
        springls__wall_planes planes;
        double vertex[3];
        int o[3], from[3], e, k;
        memset(&planes, 0, sizeof planes);
        springls__place_in_box(none, job->size, (size_t)job->cube[begin], o);
        for (e = 0; e < 12; e++) {
            const int axis = e / 4;
            for (k = 0; k < 3; k++) from[k] = o[k];
            from[(axis + 1) % 3] += e & 1;
            from[(axis + 2) % 3] += e >> 1 & 1;
            springls__add_wall_plane(job, from, axis, &planes);
        }
        for (k = 0; k < 3; k++) planes.mean[k] /= (double)planes.count;
        springls__meet_planes(&planes, vertex);
        for (k = 0; k < 3; k++) {
            const double lower = (double)o[k] + margin, upper = (double)(o[k] + 1) - margin;
            job->positions[3 * (size_t)begin + (size_t)k] = (float)(vertex[k] < lower ? lower : vertex[k] > upper ? upper : vertex[k]);
        }
    }
}

/* ---- vertices, triangles, edges: counted with NULL, then written ---- */

SPRINGLS__FN int32_t springls__label_at(const springls__walls_job *job, const int at[3])
{
    return job->label[springls__voxel_index(&job->tiling->host->model.grid, at[0], at[1], at[2])];
}

/* Returns the vertex of the cube that begins at a voxel. */
SPRINGLS__FN int springls__vertex_at(const springls__walls_job *job, const int at[3])
{
    return job->vertex[springls__voxel_index(&job->tiling->host->model.grid, at[0], at[1], at[2])];
}

/* Numbers the cubes whose voxels have several labels; returns how many there are. */
SPRINGLS__FN int springls__number_cubes(const springls__walls_job *job)
{
    const size_t n = springls__box_voxels(job->size);
    const int none[3] = { 0, 0, 0 };
    size_t v;
    int count = 0, o[3], at[3], c, k;
    for (v = 0; v < n; v++) {
        bool mixed = false;
        job->vertex[v] = -1;
        springls__place_in_box(none, job->size, v, o);
        if (o[0] + 1 >= job->size[0] || o[1] + 1 >= job->size[1] || o[2] + 1 >= job->size[2]) continue;
        for (c = 1; c < 8 && !mixed; c++) {
            for (k = 0; k < 3; k++) at[k] = o[k] + (c >> k & 1);
            mixed = springls__label_at(job, at) != job->label[v];
        }
        if (!mixed) continue;
        job->cube[count] = (int)v;
        job->vertex[v] = count++;
    }
    return count;
}

SPRINGLS__FN float springls__vertex_distance2(const float *positions, int a, int b)
{
    return springls__length2(springls__sub(springls__load3(positions + 3 * (size_t)a), springls__load3(positions + 3 * (size_t)b)));
}

/* The vertices of a quad about its pair of voxels: two coordinates across the pair, from its line, and the height above the first voxel.
   Counter-clockwise, one a quadrant. */
typedef struct springls__wall_quad { double u[4], v[4], h[4]; int corner[4]; } springls__wall_quad;

/* Finds the quad across the pair of voxels from `at` on along an axis. */
SPRINGLS__FN springls__wall_quad springls__quad_of(const springls__walls_job *job, const int at[3], int axis)
{
    static const int around[4][2] = { { -1, -1 }, { 0, -1 }, { 0, 0 }, { -1, 0 } }; /* counter-clockwise seen along the axis */
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    springls__wall_quad quad;
    int cube[3], k;
    for (k = 0; k < 4; k++) {
        const float *x;
        memcpy(cube, at, sizeof cube);
        cube[u] += around[k][0];
        cube[v] += around[k][1];
        quad.corner[k] = springls__vertex_at(job, cube);
        x = job->positions + 3 * (size_t)quad.corner[k];
        quad.u[k] = (double)x[u] - (double)at[u];
        quad.v[k] = (double)x[v] - (double)at[v];
        quad.h[k] = (double)x[axis] - (double)at[axis];
    }
    return quad;
}

/* Finds where the diagonal from corner a to the one across passes the plane of the pair's line and another corner: how far out, in that
   corner's distance from the line, negative behind the line; and how high. */
SPRINGLS__FN double springls__pass_corner(const springls__wall_quad *q, int a, int corner, double *height)
{
    const int c = (a + 2) % 4;
    const double u = q->u[corner], v = q->v[corner];
    const double ga = u * q->v[a] - v * q->u[a], gc = u * q->v[c] - v * q->u[c], t = ga / (ga - gc); /* of opposite signs */
    *height = q->h[a] + t * (q->h[c] - q->h[a]);
    return ((q->u[a] + t * (q->u[c] - q->u[a])) * u + (q->v[a] + t * (q->v[c] - q->v[a])) * v) / (u * u + v * v);
}

/* Returns whether the two triangles on both sides of the diagonal from corner a lie in the quad's envelope. */
SPRINGLS__FN bool springls__diagonal_is_safe(const springls__wall_quad *q, int a)
{
    const double margin = 1e-3; /* voxel */
    int beside = (a + 1) % 4, other;
    double r, h;
    if (springls__pass_corner(q, a, beside, &h) < 0.0) beside = (a + 3) % 4;
    other = (beside + 2) % 4;
    r = springls__pass_corner(q, a, beside, &h);
    if (r > 1.0 - margin || h < r * q->h[beside] + margin || h > r * q->h[beside] + 1.0 - r - margin) return false;
    r = -springls__pass_corner(q, a, other, &h); /* the line pierces the triangle with the other corner */
    if (r < 0.0) return false;
    h = (r * q->h[other] + h) / (1.0 + r);
    return h > margin && h < 1.0 - margin;
}

/* Returns the corner from which the quad's shorter diagonal, or its only safe one, begins: 0 or 1; -1: neither is safe. */
SPRINGLS__FN int springls__diagonal_of(const springls__walls_job *job, const springls__wall_quad *q)
{
    const int shorter = springls__vertex_distance2(job->positions, q->corner[1], q->corner[3])
                        < springls__vertex_distance2(job->positions, q->corner[0], q->corner[2]);
    if (springls__diagonal_is_safe(q, shorter)) return shorter;
    return springls__diagonal_is_safe(q, 1 - shorter) ? 1 - shorter : -1;
}

/* Adds the vertex between the two voxels of a pair; returns its number. */
SPRINGLS__FN int springls__add_wall_middle(const springls__walls_job *job, const int at[3], int axis, springls_walls *walls)
{
    const float margin = 0.02f; /* voxel */
    float *out = walls->positions + 3 * (size_t)walls->vertex_count;
    springls__wall_crossing c;
    int k;
    for (k = 0; k < 3; k++) out[k] = (float)at[k];
    if (springls__find_wall_crossing(job, at, axis, &c)) {
        const float along = axis == 0 ? c.n.x : axis == 1 ? c.n.y : c.n.z;
        const float behind = springls__behind_sheets(c.one, c.other, c.x, c.n);
        const float s = springls__fabs(along) > 0.2f ? c.s - behind / along : c.s;
        out[axis] += springls__clamp(s, margin, 1.0f - margin);
    }
    return walls->vertex_count++;
}

/* Adds a triangle with the labels of a pair. */
SPRINGLS__FN void springls__add_wall_triangle(springls_walls *walls, int a, int b, int c, const int32_t labels[2])
{
    int *triangle = walls->triangles + 3 * (size_t)walls->triangle_count;
    int32_t *sides = walls->labels + 2 * (size_t)walls->triangle_count++;
    triangle[0] = a, triangle[1] = b, triangle[2] = c;
    sides[0] = labels[0], sides[1] = labels[1];
}

/* Adds the quad across the pair of voxels from `at` on along an axis: two triangles or four. */
SPRINGLS__FN void springls__add_quad(const springls__walls_job *job, const int at[3], int axis, springls_walls *walls)
{
    const bool mirrored = springls__is_mirrored(job->tiling->host);
    springls__wall_quad quad;
    int32_t labels[2];
    int to[3], corner[4], first, middle, k;
    for (k = 0; k < 3; k++) to[k] = at[k] + (k == axis);
    labels[0] = springls__label_at(job, at);
    labels[1] = springls__label_at(job, to);
    if (labels[0] == labels[1]) return;
    quad = springls__quad_of(job, at, axis);
    first = springls__diagonal_of(job, &quad);
    if (!walls->triangles) {
        walls->triangle_count += first < 0 ? 4 : 2;
        walls->vertex_count += first < 0;
        return;
    }
    middle = first < 0 ? springls__add_wall_middle(job, at, axis, walls) : -1;
    for (k = 0; k < 4; k++) corner[k] = quad.corner[mirrored ? 3 - k : k];
    if (mirrored && first == 0) first = 1; /* the corners 0 and 2 are now 3 and 1 */
    else if (mirrored && first == 1) first = 0;
    for (k = 0; k < 4 && first < 0; k++) springls__add_wall_triangle(walls, corner[k], corner[(k + 1) % 4], middle, labels);
    if (first < 0) return;
    springls__add_wall_triangle(walls, corner[first], corner[first + 1], corner[first + 2], labels);
    springls__add_wall_triangle(walls, corner[first], corner[first + 2], corner[(first + 3) % 4], labels);
}

/* Adds the edge between the cubes on both sides of the four voxels from `at` on across an axis, where three walls or four meet. */
SPRINGLS__FN void springls__add_wall_edge(const springls__walls_job *job, const int at[3], int axis, springls_walls *walls)
{
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    int32_t label[4];
    int corner[3], k, meeting = 0;
    for (k = 0; k < 4; k++) {
        memcpy(corner, at, sizeof corner);
        corner[u] += (k == 1 || k == 2);
        corner[v] += k >> 1;
        label[k] = springls__label_at(job, corner);
    }
    for (k = 0; k < 4; k++) meeting += label[k] != label[(k + 1) % 4];
    if (meeting < 3) return;
    if (walls->edges) {
        memcpy(corner, at, sizeof corner);
        corner[axis]--;
        walls->edges[2 * (size_t)walls->edge_count] = springls__vertex_at(job, corner);
        walls->edges[2 * (size_t)walls->edge_count + 1] = springls__vertex_at(job, at);
    }
    walls->edge_count++;
}

/* Counts the triangles and edges or, if there is room, writes them; triangles that would need cubes beyond the outermost voxels are left
   out. Returns false if there are more than an int counts. */
SPRINGLS__FN bool springls__add_walls(const springls__walls_job *job, springls_walls *walls)
{
    int at[3], axis;
    walls->vertex_count = job->cubes;
    walls->triangle_count = walls->edge_count = 0;
    for (at[2] = 0; at[2] + 1 < job->size[2]; at[2]++)
        for (at[1] = 0; at[1] + 1 < job->size[1]; at[1]++)
            for (at[0] = 0; at[0] + 1 < job->size[0]; at[0]++)
                for (axis = 0; axis < 3 && springls__vertex_at(job, at) >= 0; axis++) {
                    if (walls->triangle_count > INT32_MAX - 4 || walls->edge_count == INT32_MAX || walls->vertex_count == INT32_MAX)
                        return false;
                    if (at[(axis + 1) % 3] > 0 && at[(axis + 2) % 3] > 0) springls__add_quad(job, at, axis, walls);
                    if (at[axis] > 0) springls__add_wall_edge(job, at, axis, walls);
                }
    return true;
}

/* Lists the vertices, `count` those of cubes, where other than two edges end; `ends` has a number for each. */
SPRINGLS__FN void springls__list_corners(springls_walls *walls, int count, int *ends)
{
    const size_t both = 2 * (size_t)walls->edge_count;
    size_t e;
    int i;
    memset(ends, 0, (size_t)count * sizeof *ends);
    for (e = 0; e < both; e++) ends[walls->edges[e]]++;
    for (i = 0; i < count; i++)
        if (ends[i] != 0 && ends[i] != 2) walls->corners[walls->corner_count++] = i;
}

/* Lays the arrays of walls whose counts are known into one block; there are at most as many corners as ends of edges. */
SPRINGLS__FN springls_status springls__walls_reserve(springls_tiling *tiling, springls_walls *walls)
{
    const size_t vertices = (size_t)walls->vertex_count, triangles = (size_t)walls->triangle_count, edges = (size_t)walls->edge_count;
    const double numbers = 3.0 * (double)vertices + 5.0 * (double)triangles + 4.0 * (double)edges + 1.0;
    const bool possible = numbers * (double)sizeof(int) < (double)(SIZE_MAX / 2);
    int *at;
    walls->bytes = possible ? (3 * vertices + 5 * triangles + 4 * edges + 1) * sizeof(int) : 0;
    at = possible ? (int *)springls__allocate(tiling->host, walls->bytes) : NULL;
    if (!at) {
        memset(walls, 0, sizeof *walls);
        return springls__fail(tiling->host, SPRINGLS_OUT_OF_MEMORY, "tiling_extract: out of memory");
    }
    walls->positions = (float *)(void *)at;
    walls->triangles = at + 3 * vertices;
    walls->labels = (int32_t *)(void *)(walls->triangles + 3 * triangles);
    walls->edges = (int *)(void *)(walls->labels + 2 * triangles);
    walls->corners = walls->edges + 2 * edges;
    return SPRINGLS_OK;
}

/* Builds the walls of bodies that have been read. buffers: of labels, phi and later vertices' numbers, cubes, places. */
SPRINGLS__FN springls_status springls__extract_walls(springls_tiling *tiling, springls__buffer buffers[4], springls_walls *walls)
{
    const size_t n = springls__box_voxels(tiling->host->model.grid.size);
    springls__walls_job job;
    int i;
    for (i = 0; i < 3; i++) SPRINGLS__TRY(springls__buffer_grow(tiling->host, &buffers[i], n, sizeof(int), 0));
    springls__decode(tiling, (float *)buffers[1].data, (int32_t *)buffers[0].data);
    job.tiling = tiling;
    job.size = tiling->host->model.grid.size;
    job.label = (const int32_t *)buffers[0].data;
    job.vertex = (int *)buffers[1].data;
    job.cube = (int *)buffers[2].data;
    job.cubes = springls__number_cubes(&job);
    SPRINGLS__TRY(springls__buffer_grow(tiling->host, &buffers[3], (size_t)job.cubes + 1, 3 * sizeof(float), 0));
    job.positions = (float *)buffers[3].data;
    springls__parallel(tiling->host, job.cubes, 64, springls__wall_vertex_task, &job);
    if (!springls__add_walls(&job, walls)) {
        memset(walls, 0, sizeof *walls);
        return springls__fail(tiling->host, SPRINGLS_OUT_OF_MEMORY, "tiling_extract: the walls have more than %d triangles",
                              (int)INT32_MAX);
    }
    SPRINGLS__TRY(springls__walls_reserve(tiling, walls));
    memcpy(walls->positions, job.positions, 3 * (size_t)job.cubes * sizeof(float));
    springls__add_walls(&job, walls);
    springls__list_corners(walls, job.cubes, job.cube);
    springls_to_world(tiling->host, walls->positions, walls->vertex_count, walls->positions);
    return SPRINGLS_OK;
}

/* Makes the mesh of all walls for a call. */
SPRINGLS__FN springls_status springls__make_walls(springls_tiling *tiling, const char *call, springls_walls *walls)
{
    springls__buffer buffers[4];
    springls_status status;
    int i;
    memset(walls, 0, sizeof *walls);
    SPRINGLS__TRY(springls__check_voxels(tiling, call));
    SPRINGLS__TRY(springls__read_bodies(tiling, call));
    memset(buffers, 0, sizeof buffers);
    status = springls__extract_walls(tiling, buffers, walls);
    for (i = 0; i < 4; i++) springls__buffer_free(tiling->host, &buffers[i]);
    return status;
}

SPRINGLS__TILINGS_API springls_status springls_tiling_extract(springls_tiling *tiling, springls_walls *walls)
{
    if (walls) memset(walls, 0, sizeof *walls);
    if (!tiling) return SPRINGLS_INVALID_ARGUMENT;
    if (!walls) return springls__fail_null(tiling->host, "tiling_extract", "walls");
    return springls__make_walls(tiling, "tiling_extract", walls);
}

SPRINGLS__TILINGS_API void springls_walls_free(springls_tiling *tiling, springls_walls *walls)
{
    if (!tiling || !walls) return;
    springls__release(tiling->host, walls->positions, walls->bytes);
    memset(walls, 0, sizeof *walls);
}

#endif
