/* springl_body.h - the record of one springl, and of several at once, one a lane. */

/* The hot record: all that relax, omega and every distance query need of a springl, in one cache line. */
typedef struct SPRINGLS__W(springl) {
    SPRINGLS__NUM3 q[3];             /* triangle vertices, counter-clockwise seen from outside */
    SPRINGLS__NUM3 p;                /* particle                                               */
    SPRINGLS__NUM inverse_edge2[3];  /* 1/|q[m+1]-q[m]|^2, 0 for an edge of no length          */
    SPRINGLS__NUM bounding_radius;   /* max |q[m] - p|                                         */
} SPRINGLS__W(springl);

/* Returns s with the members that follow from q and p. */
SPRINGLS__W_MATHS SPRINGLS__W(springl) SPRINGLS__W(springl_finished)(SPRINGLS__W(springl) s)
{
    SPRINGLS__NUM radius2 = SPRINGLS__W(broadcast)(0.0f);
    int m;
    for (m = 0; m < 3; m++) {
        s.inverse_edge2[m] = SPRINGLS__W(inverse_length2)(s.q[m], s.q[m == 2 ? 0 : m + 1]);
        radius2 = SPRINGLS__W(max)(radius2, SPRINGLS__W(length2)(SPRINGLS__W(sub)(s.q[m], s.p)));
    }
    s.bounding_radius = SPRINGLS__W(sqrt)(radius2);
    return s;
}

/* Reads the springls first, first + 1, ..., one a lane. */
SPRINGLS__W_MATHS SPRINGLS__W(springl) SPRINGLS__W(springl_load)(SPRINGLS__GLOBAL const springls__springl *all, int first)
{
    SPRINGLS__NUM number[16], part[SPRINGLS__WIDTH];
    SPRINGLS__W(springl) s;
    int lane, k, m;
    for (k = 0; k < 16; k += SPRINGLS__WIDTH) {
        for (lane = 0; lane < SPRINGLS__WIDTH; lane++)
            part[lane] = SPRINGLS__W(load)((SPRINGLS__GLOBAL const float *)&all[first + lane] + k);
        SPRINGLS__W(transpose)(part);
        for (lane = 0; lane < SPRINGLS__WIDTH; lane++) number[k + lane] = part[lane];
    }
    for (m = 0; m < 3; m++) {
        s.q[m] = SPRINGLS__W(v3_make)(number[3 * m], number[3 * m + 1], number[3 * m + 2]);
        s.inverse_edge2[m] = number[12 + m];
    }
    s.p = SPRINGLS__W(v3_make)(number[9], number[10], number[11]);
    s.bounding_radius = number[15];
    return s;
}

/* Writes springls to the places that they were read from. */
SPRINGLS__W_MATHS void SPRINGLS__W(springl_store)(SPRINGLS__GLOBAL springls__springl *all, int first, SPRINGLS__W(springl) s)
{
    SPRINGLS__NUM number[16], part[SPRINGLS__WIDTH];
    int lane, k, m;
    for (m = 0; m < 3; m++) {
        number[3 * m] = s.q[m].x;
        number[3 * m + 1] = s.q[m].y;
        number[3 * m + 2] = s.q[m].z;
        number[12 + m] = s.inverse_edge2[m];
    }
    number[9] = s.p.x;
    number[10] = s.p.y;
    number[11] = s.p.z;
    number[15] = s.bounding_radius;
    for (k = 0; k < 16; k += SPRINGLS__WIDTH) {
        for (lane = 0; lane < SPRINGLS__WIDTH; lane++) part[lane] = number[k + lane];
        SPRINGLS__W(transpose)(part);
        for (lane = 0; lane < SPRINGLS__WIDTH; lane++)
            SPRINGLS__W(store)((SPRINGLS__GLOBAL float *)&all[first + lane] + k, part[lane]);
    }
}
