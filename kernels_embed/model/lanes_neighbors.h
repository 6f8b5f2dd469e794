/* lanes_neighbors.h - the three vertices of a springl against the three edges of another (section 4.8). */

#ifdef SPRINGLS__LANES

SPRINGLS__MATHS void springls__nearest_edges(SPRINGLS__GLOBAL const springls__springl *o, SPRINGLS__GLOBAL const springls__v3 *q, float radius2, float d2[3], int edge[3])
{
    const float x[8] = { q[0].x, q[1].x, q[2].x, 0.0f }, y[8] = { q[0].y, q[1].y, q[2].y, 0.0f }, z[8] = { q[0].z, q[1].z, q[2].z, 0.0f };
    springls__vec3 at;
    springls__vec best = springls__vec_all(radius2), found = springls__vec_all(-1.0f);
    float d2s[SPRINGLS__LANES], edges[SPRINGLS__LANES];
    int e, m;
    at.x = springls__vec_load(x);
    at.y = springls__vec_load(y);
    at.z = springls__vec_load(z);
    for (e = 0; e < 3; e++) {
        springls__v3 a = o->q[e], ab = springls__sub(o->q[e == 2 ? 0 : e + 1], a);
        springls__vec d = springls__segment_distance2_lanes(at, a, ab, o->inverse_edge2[e]);
        springls__vmask nearer = d < best;
        best = springls__vec_select(nearer, d, best);
        found = springls__vec_select(nearer, springls__vec_all((float)e), found);
    }
    springls__vec_store(d2s, best);
    springls__vec_store(edges, found);
    for (m = 0; m < 3; m++) {
        d2[m] = d2s[m];
        edge[m] = (int)edges[m];
    }
}

#endif
