/* omega.h - the unsigned level set: distance to a springl's triangle (eq. 21). */

/* A triangle prepared for many voxels: everything the distance needs that does not depend on the voxel. */
typedef struct springls__tri_plan {
    springls__tri t;
    springls__v3 edge[3], side[3], n; /* side: in-plane inward normal of an edge (not unit); n: twice the area vector */
    float inverse_edge2[3], inverse_n2;
} springls__tri_plan;

SPRINGLS__MATHS springls__tri_plan springls__tri_plan_make(springls__tri t)
{
    springls__tri_plan plan;
    float n2;
    plan.t = t;
    plan.n = springls__tri_area2(t);
    n2 = springls__length2(plan.n);
    plan.inverse_n2 = n2 > 1e-20f ? 1.0f / n2 : 0.0f; /* no area: inside is never true, edges decide */
    plan.edge[0] = springls__sub(t.b, t.a);
    plan.edge[1] = springls__sub(t.c, t.b);
    plan.edge[2] = springls__sub(t.a, t.c);
    plan.side[0] = springls__cross(plan.n, plan.edge[0]);
    plan.side[1] = springls__cross(plan.n, plan.edge[1]);
    plan.side[2] = springls__cross(plan.n, plan.edge[2]);
    plan.inverse_edge2[0] = springls__inverse_length2(t.a, t.b);
    plan.inverse_edge2[1] = springls__inverse_length2(t.b, t.c);
    plan.inverse_edge2[2] = springls__inverse_length2(t.c, t.a);
    return plan;
}

/* Squared distance from x to the segment that starts at a, of vector e. */
SPRINGLS__MATHS float springls__segment_distance2(springls__v3 x, springls__v3 a, springls__v3 e, float inverse)
{
    springls__v3 d = springls__sub(x, a);
    float s = springls__clamp(springls__dot(d, e) * inverse, 0.0f, 1.0f);
    return springls__length2(springls__mad(d, e, -s));
}

/* Squared distance from x to the triangle, without a branch. */
SPRINGLS__MATHS float springls__tri_distance2(const springls__tri_plan plan, springls__v3 x)
{
    springls__v3 da = springls__sub(x, plan.t.a), db = springls__sub(x, plan.t.b), dc = springls__sub(x, plan.t.c);
    float height = springls__dot(plan.n, da);
    float inner = springls__min(springls__min(springls__dot(plan.side[0], da), springls__dot(plan.side[1], db)),
                                springls__dot(plan.side[2], dc));
    float e0 = springls__segment_distance2(x, plan.t.a, plan.edge[0], plan.inverse_edge2[0]);
    float e1 = springls__segment_distance2(x, plan.t.b, plan.edge[1], plan.inverse_edge2[1]);
    float e2 = springls__segment_distance2(x, plan.t.c, plan.edge[2], plan.inverse_edge2[2]);
    float edges = springls__min(springls__min(e0, e1), e2);
    float face = height * height * plan.inverse_n2;
    float use_face = inner >= 0.0f ? plan.inverse_n2 : 0.0f;
    return use_face > 0.0f ? face : edges;
}

/* row[i] = min(row[i], distance from (x + i, y, z) to the springl), where its bounding sphere comes closer than that. */
SPRINGLS__MATHS void springls__omega_row(const springls__tri_plan *plan, springls__v3 center, float reach, int x, int y, int z,
                                         SPRINGLS__GLOBAL float *row);

/* omega's first voxel below zero: the brick is new, or its springls have moved. */
SPRINGLS__MATHS bool springls__omega_unknown(const springls__grid *g, int slot)
{
    return g->omega[(size_t)slot * SPRINGLS__BRICK_VOXELS] < 0.0f;
}


/* Exact distance to the springls in an active brick, clamped at params.capture, where it is unknown. */
SPRINGLS__MATHS void springls__omega_element(const springls__model *model, springls__job job, int i,
                                             SPRINGLS__LOCAL float *memory)
{
    const springls__grid *g = &model->grid;
    const float capture = model->params.capture;
    SPRINGLS__GLOBAL float *omega = g->omega + (size_t)g->active[i] * SPRINGLS__BRICK_VOXELS;
    bool unknown = springls__omega_unknown(g, g->active[i]);
    int origin[3], v, y, z;
    uint32_t k;
    (void)job;
    (void)memory;
    SPRINGLS__BARRIER; /* all have read whether it is */
    if (!unknown) return;
    springls__slot_origin(g, g->active[i], origin);
    for (y = model->group.item; y < SPRINGLS__ROWS; y += model->group.items)
        for (v = 8 * y; v < 8 * y + 8; v++) omega[v] = capture;
    for (k = model->cells.brick_list_first[i]; k < model->cells.brick_list_first[i + 1]; k++) {
        SPRINGLS__GLOBAL const springls__springl *s = &model->set.s[model->cells.brick_list_ids[k]];
        springls__tri_plan plan = springls__tri_plan_make(springls__springl_tri(*s));
        float ylo = springls__min(s->q[0].y, springls__min(s->q[1].y, s->q[2].y)) - capture - (float)origin[1];
        float yhi = springls__max(s->q[0].y, springls__max(s->q[1].y, s->q[2].y)) + capture - (float)origin[1];
        float zlo = springls__min(s->q[0].z, springls__min(s->q[1].z, s->q[2].z)) - capture - (float)origin[2];
        float zhi = springls__max(s->q[0].z, springls__max(s->q[1].z, s->q[2].z)) + capture - (float)origin[2];
        int y0 = (int)springls__clamp(ylo, 0.0f, 7.0f), y1 = (int)springls__clamp(yhi, 0.0f, 7.0f);
        float reach = s->bounding_radius * 1.0001f + 1e-3f; /* no rounding may turn away a springl that is nearer */
        int z0 = (int)springls__clamp(zlo, 0.0f, 7.0f), z1 = (int)springls__clamp(zhi, 0.0f, 7.0f);
        for (z = z0; z <= z1; z++)
            for (y = y0; y <= y1; y++)
                if (springls__is_mine(model->group, y + 8 * z))
                    springls__omega_row(&plan, s->p, reach, origin[0], origin[1] + y, origin[2] + z, omega + 8 * y + 64 * z);
    }
}

/* Voxel i of the two constant bricks: job.f, outside and inside. */
SPRINGLS__MATHS void springls__omega_constant_element(const springls__model *model, springls__job job, int i)
{
    model->grid.omega[i] = job.f[i >= SPRINGLS__BRICK_VOXELS * SPRINGLS__INSIDE];
}

/* The brick's omega is to be taken afresh (job.i[0]: all are); to SCRATCH1, whether it is unknown. */
SPRINGLS__MATHS void springls__omega_forget_element(const springls__model *model, springls__job job, int i)
{
    int slot = model->grid.active[i];
    if (job.i[0]) model->grid.omega[(size_t)slot * SPRINGLS__BRICK_VOXELS] = -1.0f;
    ((SPRINGLS__GLOBAL uint8_t *)model->work.scratch[1])[i] = springls__omega_unknown(&model->grid, slot) ? 1 : 0;
}
