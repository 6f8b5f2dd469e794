/* edges.h - sharp edges: about a place where the surface has a crease, its springls fall into sides, groups that face one
   way each with nothing between. On a smooth surface normals fill the range between any two of them, and there are no sides,
   however strong the curvature. */

#define SPRINGLS__SIDES 3  /* that can meet in a corner                                     */
#define SPRINGLS__TRIES 6  /* directions looked at for sides                             */
#define SPRINGLS__CROWD 96 /* springls about a place                                        */
#define SPRINGLS__APART 0.64f   /* cosine of 50 degrees: sides of a crease differ by more   */
#define SPRINGLS__TOGETHER 0.95f /* cosine of 18 degrees: springls of a side differ by less */
#define SPRINGLS__NARROW 0.4f   /* voxel: see springls__find_sides                           */
#define SPRINGLS__AWAY -0.5f    /* cosine: the other sheet of a thin object                 */

/* Of `count` sides; 0 or 1: no crease here. */
typedef struct springls__sides { springls__v3 normal[SPRINGLS__SIDES], middle[SPRINGLS__SIDES]; int count; } springls__sides;

/* The side that a normal belongs to; -1: none. */
SPRINGLS__MATHS int springls__side_of(const springls__sides sides, springls__v3 n)
{
    int s, best = -1;
    float most = SPRINGLS__TOGETHER, along;
    for (s = 0; s < sides.count; s++) {
        along = springls__dot(sides.normal[s], n);
        if (along <= most) continue;
        most = along;
        best = s;
    }
    return best;
}

/* Where the places of a side lie, in two tangent coordinates. */
typedef struct springls__patch { float count, u, v, uu, uv, vv; } springls__patch;

SPRINGLS__MATHS springls__patch springls__patch_begin(void)
{
    springls__patch patch;
    patch.count = patch.u = patch.v = patch.uu = patch.uv = patch.vv = 0.0f;
    return patch;
}

SPRINGLS__MATHS springls__patch springls__patch_add(springls__patch patch, springls__v3 d, springls__v3 e1, springls__v3 e2)
{
    float u = springls__dot(d, e1), v = springls__dot(d, e2);
    patch.count += 1.0f;
    patch.u += u;
    patch.v += v;
    patch.uu += u * u;
    patch.uv += u * v;
    patch.vv += v * v;
    return patch;
}

/* Their variance in the direction in which it is least. */
SPRINGLS__MATHS float springls__patch_width2(springls__patch patch)
{
    float one = 1.0f / springls__max(patch.count, 1.0f), u = patch.u * one, v = patch.v * one;
    float uu = patch.uu * one - u * u, uv = patch.uv * one - u * v, vv = patch.vv * one - v * v;
    float difference = 0.5f * (uu - vv);
    return 0.5f * (uu + vv) - springls__sqrt(difference * difference + uv * uv);
}

/* The direction that most of the weight that faces elsewhere than the sides tried yet agrees about, and that weight. */
typedef struct springls__support { springls__v3 normal; float weight; } springls__support;

SPRINGLS__MATHS springls__support springls__next_side(const springls__v3 tried[SPRINGLS__TRIES], int tries, const springls__v3 n[SPRINGLS__CROWD],
                                                      const float weight[SPRINGLS__CROWD], int count)
{
    springls__support best;
    int i, j, elsewhere, stride = count / 24 + 1; /* of many, some are asked */
    best.normal = springls__v3_make(0.0f, 0.0f, 0.0f);
    best.weight = 0.0f;
    for (i = 0; i < count; i += stride) {
        springls__v3 sum = springls__v3_make(0.0f, 0.0f, 0.0f);
        float support = 0.0f;
        for (elsewhere = 1, j = 0; j < tries; j++) elsewhere = elsewhere && springls__dot(tried[j], n[i]) < SPRINGLS__APART;
        if (!elsewhere) continue;
        for (j = 0; j < count; j++) {
            if (springls__dot(n[i], n[j]) <= SPRINGLS__TOGETHER) continue;
            support += weight[j];
            sum = springls__mad(sum, n[j], weight[j]);
        }
        if (support <= best.weight) continue;
        best.weight = support;
        best.normal = springls__normalize(sum);
    }
    return best;
}

/* The middle of those that face like n, and how narrow a strip they are: the least standard deviation, squared. */
typedef struct springls__strip { springls__v3 middle; float width2; } springls__strip;

SPRINGLS__MATHS springls__strip springls__strip_of(springls__v3 facing, const springls__v3 p[SPRINGLS__CROWD], const springls__v3 n[SPRINGLS__CROWD],
                                                   const float weight[SPRINGLS__CROWD], int count)
{
    springls__v3 e1 = springls__fabs(facing.x) < 0.6f ? springls__v3_make(1.0f, 0.0f, 0.0f) : springls__v3_make(0.0f, 1.0f, 0.0f), e2;
    springls__patch patch = springls__patch_begin();
    springls__strip strip;
    float sum = 0.0f;
    int i;
    e1 = springls__normalize(springls__cross(facing, e1));
    e2 = springls__cross(facing, e1);
    strip.middle = springls__v3_make(0.0f, 0.0f, 0.0f);
    for (i = 0; i < count; i++) {
        if (springls__dot(facing, n[i]) <= SPRINGLS__TOGETHER) continue;
        patch = springls__patch_add(patch, springls__sub(p[i], p[0]), e1, e2);
        strip.middle = springls__mad(strip.middle, p[i], weight[i]);
        sum += weight[i];
    }
    strip.middle = springls__scale(strip.middle, 1.0f / springls__max(sum, 1e-6f));
    strip.width2 = springls__patch_width2(patch);
    return strip;
}

/* Sides from the springls about a place. A crease has at least two with a twelfth of the weight each, none a strip narrower
   than `narrow` (rows of triangles round a thin rim are no sides), and next to nothing is on none of them: a sixth at most,
   other sheets left out, or half of that and more narrowly judged where the answer must be certain. A springl is on a side
   that it lies on, whichever of several ways it has been turned. */
SPRINGLS__MATHS springls__sides springls__find_sides(const springls__v3 p[SPRINGLS__CROWD], const springls__v3 n[SPRINGLS__CROWD],
                                                     const float weight[SPRINGLS__CROWD], int count, float narrow, int certain)
{
    const float on = certain ? 0.06f : 0.15f; /* voxel */
    springls__v3 tried[SPRINGLS__TRIES];
    springls__sides sides;
    float total = 0.0f, stray = 0.0f;
    int i, s, tries = 0;
    sides.count = 0;
    for (i = 0; i < count; i++) total += weight[i];
    while (tries < SPRINGLS__TRIES && sides.count < SPRINGLS__SIDES) {
        springls__support side = springls__next_side(tried, tries, n, weight, count);
        springls__strip strip;
        if (side.weight < total * (1.0f / 12.0f) || side.weight <= 0.0f) break;
        tried[tries++] = side.normal;
        strip = springls__strip_of(side.normal, p, n, weight, count);
        if (narrow > 0.0f && strip.width2 < narrow * narrow) continue;
        sides.middle[sides.count] = strip.middle;
        sides.normal[sides.count++] = side.normal;
    }
    for (total = 0.0f, i = 0; i < count; i++) {
        int lies = springls__side_of(sides, n[i]) >= 0, away = 1;
        for (s = 0; s < sides.count; s++) {
            float along = springls__dot(n[i], sides.normal[s]);
            lies = lies || (along > 0.3f && springls__fabs(springls__dot(springls__sub(p[i], sides.middle[s]), sides.normal[s])) < on);
            away = away && along < SPRINGLS__AWAY;
        }
        if (lies) total += weight[i];
        else if (!away) stray += weight[i];
    }
    if (stray * (certain ? 12.0f : 5.0f) > total) sides.count = 0;
    return sides;
}

/* True where two sides, each given by a place on it and its normal there, meet in a convex edge. */
SPRINGLS__MATHS int springls__is_convex(springls__v3 p, springls__v3 n, springls__v3 q, springls__v3 m)
{
    springls__v3 d = springls__sub(q, p);
    return springls__dot(d, n) - springls__dot(d, m) < 0.0f;
}

/* Heights over sides that meet, as one: the larger where the edge between them is convex, else the smaller. Of three the two
   that meet in the odd way come first. convex: of sides 0 and 1, 0 and 2, 1 and 2. */
SPRINGLS__MATHS float springls__meet(float a, float b, int convex) { return convex ? springls__max(a, b) : springls__min(a, b); }

SPRINGLS__MATHS float springls__height_over_sides(const float h[SPRINGLS__SIDES], int count, const int convex[SPRINGLS__SIDES])
{
    if (count < 3) return count == 2 ? springls__meet(h[0], h[1], convex[0]) : h[0];
    if (convex[1] == convex[2]) return springls__meet(springls__meet(h[0], h[1], convex[0]), h[2], convex[1]);
    if (convex[0] == convex[2]) return springls__meet(springls__meet(h[0], h[2], convex[1]), h[1], convex[0]);
    return springls__meet(springls__meet(h[1], h[2], convex[2]), h[0], convex[0]);
}

/* phi at a crease: the height over the sides, further off than springls__corrected_phi would take it, for triangles that stick
   out beyond an edge carry the evolved value away. What is a voxel off is another surface. */
SPRINGLS__MATHS float springls__edge_phi(float phi, float height) { return springls__fabs(height - phi) < 0.75f ? height : phi; }

/* A triangle turned about p by the least rotation that takes unit vector n to m; as it is when they are opposite. */
SPRINGLS__MATHS springls__v3 springls__turn_to(springls__v3 v, springls__v3 n, springls__v3 m)
{
    springls__v3 axis = springls__cross(n, m), u = springls__cross(axis, v);
    float c = springls__dot(n, m);
    if (c < -0.5f) return v;
    return springls__add(springls__add(v, u), springls__scale(springls__cross(axis, u), 1.0f / (1.0f + c)));
}
