/* neighbors.h - the nearest edges of every springl vertex (section 4.8): at most max_neighbors springls within R, the
   closest edge of each, nearest first, ties by index. */

/* Inserts (d2, code) into an ascending list of at most `room`; returns the new length. */
SPRINGLS__MATHS int springls__insert_nearest(float *d2s, SPRINGLS__GLOBAL int *codes, int length, int room, float d2, int code)
{
    int i = length < room ? length : room - 1;
    if (length == room && (d2s[i] < d2 || (d2s[i] == d2 && codes[i] < code))) return length;
    for (; i > 0 && (d2s[i - 1] > d2 || (d2s[i - 1] == d2 && codes[i - 1] > code)); i--) {
        d2s[i] = d2s[i - 1];
        codes[i] = codes[i - 1];
    }
    d2s[i] = d2;
    codes[i] = code;
    return length < room ? length + 1 : room;
}

/* Which edge of springl o comes nearest to each of the points q[0..2], nearer than the radius: its number and its distance
   squared; else -1. */
SPRINGLS__MATHS void springls__nearest_edges(SPRINGLS__GLOBAL const springls__springl *o, SPRINGLS__GLOBAL const springls__v3 *q, float radius2, float d2[3], int edge[3]);

/* row[MAX_NEIGHBORS m + k]: 3 * springl + edge of the k-th nearest neighbour of vertex m; -1 after the last. */
SPRINGLS__MATHS void springls__find_neighbors(const springls__model *model, int n, SPRINGLS__GLOBAL int *row)
{
    SPRINGLS__GLOBAL const springls__springl *all = model->set.s, *self = &all[n];
    const float radius = model->params.neighbor_radius, radius2 = radius * radius;
    const int room = model->params.max_neighbors;
    springls__v3 lower, upper, normal = springls__springl_normal(*self);
    springls__cell_walk walk;
    float d2s[SPRINGLS__NEIGHBOR_ROW], d2[3];
    int length[3] = { 0, 0, 0 }, edge[3], other, m;
    for (m = 0; m < SPRINGLS__NEIGHBOR_ROW; m++) row[m] = -1;
    lower.x = springls__min(self->q[0].x, springls__min(self->q[1].x, self->q[2].x));
    lower.y = springls__min(self->q[0].y, springls__min(self->q[1].y, self->q[2].y));
    lower.z = springls__min(self->q[0].z, springls__min(self->q[1].z, self->q[2].z));
    upper.x = springls__max(self->q[0].x, springls__max(self->q[1].x, self->q[2].x));
    upper.y = springls__max(self->q[0].y, springls__max(self->q[1].y, self->q[2].y));
    upper.z = springls__max(self->q[0].z, springls__max(self->q[1].z, self->q[2].z));
    walk = springls__cell_walk_around(model, lower, upper, radius);
    while ((other = springls__cell_walk_next(&walk)) >= 0) {
        SPRINGLS__GLOBAL const springls__springl *o = &all[other];
        float within = radius + o->bounding_radius + self->bounding_radius;
        if (other == n) continue;
        if (springls__length2(springls__sub(o->p, self->p)) > within * within) continue;
        within = radius + o->bounding_radius;
        if (springls__length2(springls__sub(o->p, self->q[0])) > within * within && springls__length2(springls__sub(o->p, self->q[1])) > within * within
            && springls__length2(springls__sub(o->p, self->q[2])) > within * within) continue;
        if (model->params.relax_same_side && springls__dot(normal, springls__springl_normal(*o)) <= 0.0f) continue;
        springls__nearest_edges(o, self->q, radius2, d2, edge);
        for (m = 0; m < 3; m++)
            if (edge[m] >= 0)
                length[m] = springls__insert_nearest(d2s + SPRINGLS__MAX_NEIGHBORS * m, row + SPRINGLS__MAX_NEIGHBORS * m, length[m], room,
                                                     d2[m], 3 * other + edge[m]);
    }
}

SPRINGLS__MATHS void springls__neighbors_element(const springls__model *model, springls__job job, int i)
{
    (void)job;
    springls__find_neighbors(model, i, model->cells.neighbors + (size_t)i * SPRINGLS__NEIGHBOR_ROW);
}
