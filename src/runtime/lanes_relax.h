/* lanes_relax.h - springls__relax_springl of kernels_embed/relax.h for a few springls at a time. */

#ifdef SPRINGLS__LANES

SPRINGLS__LANE springls__vec springls__weight_lanes(springls__relax_rule rule, springls__vec x)
{
    float v[SPRINGLS__LANES];
    int i;
    if (rule.weight == 0) return x;
    springls__vec_store(v, x);
    for (i = 0; i < SPRINGLS__LANES; i++) v[i] = springls__weight(rule.weight, v[i], rule.d_max, rule.radius);
    return springls__vec_load(v);
}

/* One edge for each lane: where it starts, its vector, 1 / length^2, and whether it is there. */
typedef struct springls__edges_lanes {
    float a[3][SPRINGLS__LANES], b[3][SPRINGLS__LANES], inverse[SPRINGLS__LANES];
    int there[SPRINGLS__LANES];
} springls__edges_lanes;

/* Edges codes[stride * lane]; a lane without one (-1) gets an edge of springl `instead`, of no effect. */
SPRINGLS__LANE int springls__edges_gather(springls__edges_lanes *edges, const springls__springl *all, const int *codes,
                                          int stride, int instead)
{
    int lane, axis, some = 0;
    for (lane = 0; lane < SPRINGLS__LANES; lane++) {
        int code = codes[stride * lane], there = code >= 0, e;
        const springls__springl *o = &all[there ? code / 3 : instead];
        const float *a, *b, *q = (const float *)(const void *)o->q;
        e = there ? code % 3 : 0;
        a = q + 3 * e;
        b = q + (e == 2 ? 0 : 3 * e + 3);
        for (axis = 0; axis < 3; axis++) {
            edges->a[axis][lane] = a[axis];
            edges->b[axis][lane] = b[axis];
        }
        edges->inverse[lane] = o->inverse_edge2[e];
        edges->there[lane] = -there;
        some |= there;
    }
    return some;
}

/* springls__vertex_force of one vertex of each springl. */
SPRINGLS__LANE springls__vec3 springls__vertex_force_lanes(springls__relax_rule rule, const springls__springl *all,
                                                           springls__vec3 q, const int *rows, int stride, int instead)
{
    springls__vec3 c = springls__vec3_all(springls__v3_make(0.0f, 0.0f, 0.0f)), a, ab, d;
    springls__vec x, s, zero = c.x;
    springls__edges_lanes edges;
    springls__vmask there;
    int k;
    for (k = 0; k < SPRINGLS__MAX_NEIGHBORS && springls__edges_gather(&edges, all, rows + k, stride, instead); k++) {
        a.x = springls__vec_load(edges.a[0]);
        a.y = springls__vec_load(edges.a[1]);
        a.z = springls__vec_load(edges.a[2]);
        ab.x = springls__vec_load(edges.b[0]);
        ab.y = springls__vec_load(edges.b[1]);
        ab.z = springls__vec_load(edges.b[2]);
        ab = springls__vec3_sub(ab, a);
        s = springls__vec_clamp(springls__vec3_dot(springls__vec3_sub(q, a), ab) * springls__vec_load(edges.inverse), 0.0f, 1.0f);
        d = springls__vec3_sub(springls__vec3_mad(a, ab, s), q);
        x = springls__vec3_length(d);
        memcpy(&there, edges.there, sizeof there);
        s = rule.kappa_ext * springls__weight_lanes(rule, (x - rule.rest) / rule.radius) / x;                    /* eq. 12 */
        c = springls__vec3_mad(c, d, springls__vec_select(there & (x > 1e-6f), s, zero));
    }
    x = springls__vec3_length(c);
    s = rule.sharpness * x;
    s = (rule.threshold == 0 ? s : springls__vec_tanh(s)) / x;                                                /* eq. 13 */
    return springls__vec3_scale(c, springls__vec_select(x > 1e-6f, s, zero));
}

/* An axis, and the sine and cosine of the angle about it. */
typedef struct springls__turn_lanes {
    springls__vec3 axis;
    springls__vec sine, cosine;
    springls__vmask some;
} springls__turn_lanes;

SPRINGLS__LANE springls__turn_lanes springls__turn_of_lanes(springls__vec3 w)
{
    springls__vec angle = springls__vec3_length(w);
    springls__turn_lanes turn;
    turn.some = angle >= 1e-7f;
    turn.axis = springls__vec3_scale(w, 1.0f / angle);
    turn.sine = springls__vec_sinpi(angle * 0.318309886f);
    turn.cosine = springls__vec_cospi(angle * 0.318309886f);
    return turn;
}

SPRINGLS__LANE springls__vec3 springls__rotate_lanes(springls__vec3 v, const springls__turn_lanes *turn)
{
    springls__vec3 r = springls__vec3_add(
        springls__vec3_add(springls__vec3_scale(v, turn->cosine),
                           springls__vec3_scale(springls__vec3_cross(turn->axis, v), turn->sine)),
        springls__vec3_scale(turn->axis, springls__vec3_dot(turn->axis, v) * (1.0f - turn->cosine)));
    r.x = springls__vec_select(turn->some, r.x, v.x);
    r.y = springls__vec_select(turn->some, r.y, v.y);
    r.z = springls__vec_select(turn->some, r.z, v.z);
    return r;
}

/* springls__relax_springl of springls first, first + 1, ... `lanes` of them; idle lanes repeat the last. */
SPRINGLS__LANE void springls__relax_lanes(springls__relax_rule rule, const springls__springl *all, const int *rows, int first,
                                          int lanes, springls__springl *next)
{
    float record[16][SPRINGLS__LANES];
    springls__vec3 p, q[3], g[3], spring[3], turning = springls__vec3_all(springls__v3_make(0.0f, 0.0f, 0.0f));
    springls__vec length[3], reach2 = springls__vec_all(0.0f);
    springls__turn_lanes turn;
    int lane, m, codes[SPRINGLS__LANES * SPRINGLS__NEIGHBOR_ROW];
    for (lane = 0; lane < SPRINGLS__LANES; lane++) {
        int i = first + springls__imin(lane, lanes - 1);
        const float *s = (const float *)(const void *)&all[i];
        for (m = 0; m < 12; m++) record[m][lane] = s[m];
    }
    if (lanes < SPRINGLS__LANES) {
        memset(codes, 0xff, sizeof codes);
        memcpy(codes, rows, (size_t)lanes * SPRINGLS__NEIGHBOR_ROW * sizeof *codes);
        rows = codes;
    }
    p.x = springls__vec_load(record[9]);
    p.y = springls__vec_load(record[10]);
    p.z = springls__vec_load(record[11]);
    for (m = 0; m < 3; m++) {
        springls__vec arm;
        q[m].x = springls__vec_load(record[3 * m]);
        q[m].y = springls__vec_load(record[3 * m + 1]);
        q[m].z = springls__vec_load(record[3 * m + 2]);
        g[m] = springls__vertex_force_lanes(rule, all, q[m], rows + SPRINGLS__MAX_NEIGHBORS * m, SPRINGLS__NEIGHBOR_ROW, first);
        spring[m] = springls__vec3_sub(q[m], p);
        length[m] = springls__vec3_length(spring[m]);
        spring[m] = springls__vec3_normalize(spring[m]);
        arm = rule.physical ? length[m] : springls__vec_all(1.0f);
        turning = springls__vec3_mad(turning, springls__vec3_cross(spring[m], g[m]), arm);
    }
    turn = springls__turn_of_lanes(springls__vec3_scale(turning, springls__vec_all(rule.step_rotation)));
    for (m = 0; m < 3; m++) {
        springls__vec along = springls__vec3_dot(spring[m], g[m]) - rule.kappa_int * (length[m] - rule.rest);
        length[m] = springls__vec_max(length[m] + rule.step_length * along, springls__vec_all(0.25f * rule.rest));
        q[m] = springls__vec3_mad(p, springls__rotate_lanes(spring[m], &turn), length[m]);
        springls__vec_store(record[3 * m], q[m].x);
        springls__vec_store(record[3 * m + 1], q[m].y);
        springls__vec_store(record[3 * m + 2], q[m].z);
    }
    for (m = 0; m < 3; m++) { /* springls__springl_finish */
        springls__vec3 edge = springls__vec3_sub(q[m == 2 ? 0 : m + 1], q[m]), arm = springls__vec3_sub(q[m], p);
        springls__vec l2 = springls__vec3_dot(edge, edge);
        springls__vec_store(record[12 + m], springls__vec_select(l2 > 1e-20f, 1.0f / l2, springls__vec_all(0.0f)));
        reach2 = springls__vec_max(reach2, springls__vec3_dot(arm, arm));
    }
    springls__vec_store(record[15], springls__vec_sqrt(reach2));
    for (lane = 0; lane < lanes; lane++) {
        float *s = (float *)(void *)&next[first + lane];
        for (m = 0; m < 16; m++) s[m] = record[m][lane];
    }
}

SPRINGLS__FN void springls__relax_range(const springls__model *model, springls__job job, int begin, int end)
{
    springls__springl *next = (springls__springl *)model->work.scratch[1];
    springls__relax_rule rule = springls__relax_rule_of(&model->params);
    int first, i;
    (void)job;
    for (first = begin; first < end; first += SPRINGLS__LANES)
        springls__relax_lanes(rule, model->set.s, model->cells.neighbors + (size_t)first * SPRINGLS__NEIGHBOR_ROW, first,
                              springls__imin(end - first, SPRINGLS__LANES), next);
    for (i = begin; i < end; i++)
        if (model->set.mask[i]) next[i] = model->set.s[i];
}

#else
SPRINGLS__RANGE(relax)
#endif
