/* resample.h - splitting at the longest edge (section 4.6). */

/* 0, 1 or 2: the edge from that vertex to the next. */
SPRINGLS__MATHS int springls__longest_edge(springls__tri t)
{
    float ab = springls__length2(springls__sub(t.b, t.a)), bc = springls__length2(springls__sub(t.c, t.b));
    float ca = springls__length2(springls__sub(t.a, t.c));
    if (ab >= bc && ab >= ca) return 0;
    return bc >= ca ? 1 : 2;
}

SPRINGLS__MATHS float springls__longest_edge2(springls__tri t)
{
    return springls__max(springls__length2(springls__sub(t.b, t.a)),
                         springls__max(springls__length2(springls__sub(t.c, t.b)), springls__length2(springls__sub(t.a, t.c))));
}

/* Half of a triangle cut from the middle of its longest edge to the opposite vertex; both halves keep the orientation. */
SPRINGLS__MATHS springls__tri springls__split_half(springls__tri t, int second)
{
    int edge = springls__longest_edge(t);
    springls__tri turned = t, part;
    springls__v3 middle;
    if (edge == 1) { turned.a = t.b; turned.b = t.c; turned.c = t.a; }
    if (edge == 2) { turned.a = t.c; turned.b = t.a; turned.c = t.b; }
    middle = springls__lerp(turned.a, turned.b, 0.5f);
    part.a = second ? middle : turned.a;
    part.b = second ? turned.b : middle;
    part.c = turned.c;
    return part;
}
