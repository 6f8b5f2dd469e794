#include "surface/gltf_scene.h"

#include "surface/gltf_accessor.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = INT32_MAX / 16 }; /* vertices or corners of a part */

bool gltf_no_memory(struct gltf_scene *g) { return scene_fail(g->file.error, g->file.path, "not enough memory"); }

/* ---- nodes ---- */

/* The depth-first order of the nodes of a scene. */
struct order {
    int *nodes, *parents, count; /* of the file; parents: of the scene */
    int *stack, *above, depth;   /* nodes to visit, and whose children they are */
    bool *seen;
};

static bool push(struct gltf_scene *g, struct order *o, double node, int parent)
{
    if (!(node >= 0.0 && node < g->file.counts[GLTF_NODES]) || node != floor(node)) {
        return scene_fail(g->file.error, g->file.path, "children or a scene name a node that there is not");
    }
    if (o->seen[(int)node]) {
        return gltf_fail(&g->file, GLTF_NODES, (int)node, "it is within itself, or has two parents");
    }
    o->seen[(int)node] = true;
    o->stack[o->depth] = (int)node;
    o->above[o->depth++] = parent;
    return true;
}

/* Pushes a list of nodes so that its first is visited first. */
static bool push_list(struct gltf_scene *g, struct order *o, const cJSON *list, int parent)
{
    const cJSON *item;
    const int first = o->depth;
    bool good = true;
    cJSON_ArrayForEach(item, list) { good = good && push(g, o, cJSON_IsNumber(item) ? item->valuedouble : -1.0, parent); }
    for (int a = first, b = o->depth - 1; a < b; ++a, --b) {
        const int node = o->stack[a];
        o->stack[a] = o->stack[b];
        o->stack[b] = node;
    }
    return good;
}

/* Pushes the nodes that are no child, of files without scenes. */
static bool push_roots(struct gltf_scene *g, struct order *o)
{
    const int count = g->file.counts[GLTF_NODES];
    bool *child = calloc((size_t)count + 1, sizeof *child), good = child != NULL;
    for (int n = 0; good && n < count; ++n) {
        const cJSON *item;
        cJSON_ArrayForEach(item, gltf_member(g->file.items[GLTF_NODES][n], "children")) {
            const double number = cJSON_IsNumber(item) ? item->valuedouble : -1.0;
            if (number >= 0.0 && number < count) { child[(int)number] = true; }
        }
    }
    for (int n = count - 1; good && n >= 0; --n) { good = child[n] || push(g, o, n, -1); }
    if (!child) { gltf_no_memory(g); }
    free(child);
    return good;
}

/* Visits all nodes of the default scene, parents first. several: it has more than one root. */
static bool find_order(struct gltf_scene *g, struct order *o, bool *several)
{
    int scene;
    if (!gltf_reference(&g->file, g->file.root, "scene", GLTF_SCENES, &scene)) {
        return false;
    }
    scene = scene < 0 && g->file.counts[GLTF_SCENES] > 0 ? 0 : scene;
    if (!(scene >= 0 ? push_list(g, o, gltf_member(g->file.items[GLTF_SCENES][scene], "nodes"), -1) : push_roots(g, o))) {
        return false;
    }
    *several = o->depth > 1;
    for (bool good = true; o->depth > 0;) {
        const int node = o->stack[--o->depth], number = o->count++;
        o->nodes[number] = node;
        o->parents[number] = o->above[o->depth];
        good = push_list(g, o, gltf_member(g->file.items[GLTF_NODES][node], "children"), number);
        if (!good) { return false; }
    }
    return o->count > 0 || scene_fail(g->file.error, g->file.path, "no nodes");
}

/* Reads where a node is: a matrix, columns first, or translation, rotation and scale. */
static bool read_place(struct gltf_scene *g, int number, struct scene_node *node)
{
    const cJSON *item = g->file.items[GLTF_NODES][number], *matrix = gltf_member(item, "matrix");
    double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, q[4] = {0, 0, 0, 1};
    node->rest = placement_identity();
    const bool good = gltf_read_numbers(matrix, m, 16) && gltf_read_numbers(gltf_member(item, "translation"), node->rest.translation, 3)
        && gltf_read_numbers(gltf_member(item, "rotation"), q, 4) && gltf_read_numbers(gltf_member(item, "scale"), node->rest.scale, 3);
    const double w_first[4] = {q[3], q[0], q[1], q[2]};
    quaternion_slerp(w_first, w_first, 0.0, node->rest.rotation); /* of length 1 */
    node->local = placement_matrix(&node->rest);
    if (matrix) {
        for (int i = 0; i < 12; ++i) { node->local.m[i] = m[4 * (i % 4) + i / 4]; }
        node->rest = placement_of(&node->local);
    }
    return good || gltf_fail(&g->file, GLTF_NODES, number, "its matrix, translation, rotation or scale is no list of finite numbers");
}

/* Adds the nodes in their order; below one more where the scene has several roots. A node without a name is called nodes[N]. */
static bool add_nodes(struct gltf_scene *g, const struct order *o, bool several)
{
    struct scene *to = g->to;
    to->nodes = calloc((size_t)o->count + 1, sizeof *to->nodes);
    if (!to->nodes) {
        return gltf_no_memory(g);
    }
    if (several) {
        snprintf(to->nodes[0].name, SCENE_NAME, "ROOT");
        to->nodes[0].parent = -1;
        to->nodes[0].rest = placement_identity();
        to->nodes[0].local = affine_identity();
        to->node_count = 1;
    }
    const int before = to->node_count;
    bool good = true;
    for (int n = 0; good && n < o->count; ++n) {
        struct scene_node *node = &to->nodes[to->node_count];
        const cJSON *name = gltf_member(g->file.items[GLTF_NODES][o->nodes[n]], "name");
        node->parent = o->parents[n] + before;
        if (cJSON_IsString(name) && name->valuestring[0]) {
            snprintf(node->name, SCENE_NAME, "%.*s", SCENE_NAME - 1, name->valuestring);
        } else {
            snprintf(node->name, SCENE_NAME, "nodes[%d]", o->nodes[n]);
        }
        g->node_of[o->nodes[n]] = to->node_count++;
        good = read_place(g, o->nodes[n], node);
    }
    return good;
}

static bool read_nodes(struct gltf_scene *g)
{
    const size_t count = (size_t)g->file.counts[GLTF_NODES] + 1;
    struct order o = {.nodes = malloc(count * sizeof *o.nodes), .parents = malloc(count * sizeof *o.parents),
                      .stack = malloc(count * sizeof *o.stack), .above = malloc(count * sizeof *o.above),
                      .seen = calloc(count, sizeof *o.seen)};
    bool several = false, good = o.nodes && o.parents && o.stack && o.above && o.seen;
    g->node_of = malloc(count * sizeof *g->node_of);
    if (!good || !g->node_of) {
        good = gltf_no_memory(g);
    }
    for (size_t n = 0; good && n < count; ++n) {
        g->node_of[n] = -1;
    }
    good = good && find_order(g, &o, &several) && add_nodes(g, &o, several);
    free(o.nodes);
    free(o.parents);
    free(o.stack);
    free(o.above);
    free(o.seen);
    return good;
}

/* ---- parts ---- */

/* A primitive that is being read. */
struct primitive {
    const cJSON *item, *attributes, *targets, *weights, *draco_ids; /* weights: of the targets */
    struct gltf_draco *draco;
    struct scene_part *part;
    int mesh;
};

static bool decode_draco(struct gltf_scene *g, struct primitive *p)
{
    const cJSON *compression = gltf_extension(p->item, "KHR_draco_mesh_compression");
    const char *reason = "names no buffer view";
    int view;
    if (!compression) {
        return true;
    }
    if (!gltf_reference(&g->file, compression, "bufferView", GLTF_VIEWS, &view)) {
        return false;
    }
    const struct gltf_bytes *bytes = view >= 0 ? gltf_view(&g->file, view) : NULL;
    if (view >= 0 && !bytes) {
        return false;
    }
    p->draco_ids = gltf_member(compression, "attributes");
    p->draco = bytes ? gltf_draco_decode(bytes->at, bytes->size, &reason) : NULL;
    return p->draco || gltf_fail(&g->file, GLTF_MESHES, p->mesh, "its KHR_draco_mesh_compression %s", reason);
}

/* Reads an attribute that has one element a vertex; values->at is NULL where there is none. */
static bool read_attribute(struct gltf_scene *g, const struct primitive *p, const cJSON *attributes, const char *name, int least,
                           int most, struct gltf_values *values)
{
    if (!gltf_read_attribute(&g->file, attributes, name, least, most, attributes == p->attributes ? p->draco : NULL, p->draco_ids,
                             values)) {
        return false;
    }
    if (!values->at || p->part->vertex_count == 0 || values->count == (size_t)p->part->vertex_count) {
        return true;
    }
    const size_t count = values->count;
    free(values->at);
    values->at = NULL;
    return gltf_fail(&g->file, GLTF_MESHES, p->mesh, "%.30s has %zu elements for %d vertices", name, count, p->part->vertex_count);
}

/* Adds the morph targets of an attribute by their weights. */
static bool add_targets(struct gltf_scene *g, const struct primitive *p, const char *name, struct gltf_values *values)
{
    const cJSON *target, *weight = p->weights ? p->weights->child : NULL;
    cJSON_ArrayForEach(target, p->targets) {
        const double share = cJSON_IsNumber(weight) && isfinite(weight->valuedouble) ? weight->valuedouble : 0.0;
        struct gltf_values offsets;
        int accessor;
        weight = weight ? weight->next : NULL;
        if (!gltf_reference(&g->file, target, name, GLTF_ACCESSORS, &accessor)) {
            return false;
        }
        if (share == 0.0) {
            continue;
        }
        if (!read_attribute(g, p, target, name, 3, 3, &offsets)) {
            return false;
        }
        for (size_t i = 0; offsets.at && i < 3 * values->count; ++i) {
            values->at[i] += share * offsets.at[i];
        }
        free(offsets.at);
    }
    return true;
}

/* Makes floats of the first `keep` numbers of each element; frees the values. */
static float *to_floats(struct gltf_values *values, int keep)
{
    float *made = malloc((values->count * (size_t)keep + 1) * sizeof *made);
    for (size_t e = 0; made && e < values->count; ++e) {
        for (int i = 0; i < keep; ++i) {
            const double value = values->at[e * (size_t)values->width + (size_t)i];
            made[e * (size_t)keep + (size_t)i] = fabs(value) <= 3e38 ? (float)value : NAN;
        }
    }
    free(values->at);
    values->at = NULL;
    return made;
}

/* Reads an attribute of three numbers a vertex, perhaps with its morph targets; *to stays NULL where there is none. The first to be
 * read is POSITION, which gives the number of vertices. */
static bool read_vectors(struct gltf_scene *g, const struct primitive *p, const char *name, int most, bool morphs, float **to)
{
    struct gltf_values values;
    if (!read_attribute(g, p, p->attributes, name, 3, most, &values)) {
        return false;
    }
    if (!values.at) {
        return true;
    }
    p->part->vertex_count = (int)values.count;
    if (morphs && !add_targets(g, p, name, &values)) {
        free(values.at);
        return false;
    }
    *to = to_floats(&values, 3);
    return *to || gltf_no_memory(g);
}

static bool read_uvs(struct gltf_scene *g, const struct primitive *p)
{
    const int material = p->part->material;
    struct gltf_values values;
    char name[32];
    snprintf(name, sizeof name, "TEXCOORD_%d", g->uv_set[material]);
    if (!read_attribute(g, p, p->attributes, name, 2, 2, &values)) {
        return false;
    }
    if (!values.at) {
        return true;
    }
    p->part->uvs = to_floats(&values, 2);
    for (size_t v = 0; p->part->uvs && v < (size_t)p->part->vertex_count; ++v) {
        float *uv = p->part->uvs + 2 * v;
        uv_map_apply(&g->uv_map[material], uv[0], uv[1], uv);
    }
    return p->part->uvs || gltf_no_memory(g);
}

/* Returns corner k of triangle t of a strip, a fan or a list of triangles, 3.7.2.1. */
static size_t corner_of(int mode, size_t t, size_t k)
{
    if (mode == 5) {
        return k == 0 ? t : t + (t % 2 ? 3 - k : k);
    }
    return mode == 6 ? (k == 0 ? 0 : t + k) : 3 * t + k;
}

/* Makes triangles of `count` corners; at: the vertex of each, NULL: they are the vertices. Corners that a list of triangles has too
 * many stay out. */
static bool make_triangles(struct gltf_scene *g, const struct primitive *p, int mode, const double *at, size_t count)
{
    struct scene_part *part = p->part;
    const size_t triangles = mode == 4 ? count / 3 : count >= 3 ? count - 2 : 0;
    part->triangles = count <= MOST ? malloc((3 * triangles + 1) * sizeof *part->triangles) : NULL;
    if (!part->triangles) {
        return count > MOST ? gltf_fail(&g->file, GLTF_MESHES, p->mesh, "too many triangles") : gltf_no_memory(g);
    }
    for (size_t i = 0; i < 3 * triangles; ++i) {
        const size_t corner = corner_of(mode, i / 3, i % 3);
        const double vertex = at ? at[corner] : (double)corner;
        if (!(vertex >= 0.0 && vertex < (double)part->vertex_count)) {
            return gltf_fail(&g->file, GLTF_MESHES, p->mesh, "a face names vertex %.0f of %d", vertex, part->vertex_count);
        }
        part->triangles[i] = (int)vertex;
    }
    part->triangle_count = (int)triangles;
    return true;
}

static bool read_triangles(struct gltf_scene *g, const struct primitive *p, int mode)
{
    struct gltf_values indices = {0};
    if (p->draco) {
        const size_t count = gltf_draco_triangles(p->draco);
        p->part->triangles = count <= MOST / 3 ? malloc((3 * count + 1) * sizeof *p->part->triangles) : NULL;
        if (!p->part->triangles) {
            return gltf_no_memory(g);
        }
        p->part->triangle_count = (int)count;
        gltf_draco_corners(p->draco, p->part->triangles);
        return (int)gltf_draco_vertices(p->draco) == p->part->vertex_count
            || gltf_fail(&g->file, GLTF_MESHES, p->mesh, "POSITION is not in its KHR_draco_mesh_compression");
    }
    if (!gltf_read_attribute(&g->file, p->item, "indices", 1, 1, NULL, NULL, &indices)) {
        return false;
    }
    const bool good = make_triangles(g, p, mode, indices.at, indices.at ? indices.count : (size_t)p->part->vertex_count);
    free(indices.at);
    return good;
}

/* ---- bones ---- */

/* Reads the bones of a skin into a part. */
static bool read_bones(struct gltf_scene *g, int skin, struct scene_part *part)
{
    const cJSON *item = g->file.items[GLTF_SKINS][skin], *joints = gltf_member(item, "joints"), *joint;
    const int count = cJSON_GetArraySize(joints);
    struct gltf_values matrices;
    int root;
    if (!gltf_reference(&g->file, item, "skeleton", GLTF_NODES, &root)
        || !gltf_read_attribute(&g->file, item, "inverseBindMatrices", 16, 16, NULL, NULL, &matrices)) {
        return false;
    }
    if (matrices.at && matrices.count < (size_t)count) {
        free(matrices.at);
        return gltf_fail(&g->file, GLTF_SKINS, skin, "%zu inverse bind matrices for %d joints", matrices.count, count);
    }
    part->bones = malloc(((size_t)count + 1) * sizeof *part->bones);
    bool good = part->bones || gltf_no_memory(g);
    cJSON_ArrayForEach(joint, joints) {
        if (!good) { break; }
        const double node = cJSON_IsNumber(joint) ? joint->valuedouble : -1.0;
        struct scene_bone bone = {node >= 0.0 && node < g->file.counts[GLTF_NODES] ? g->node_of[(int)node] : -1, affine_identity()};
        for (int i = 0; matrices.at && i < 12; ++i) {
            bone.offset.m[i] = matrices.at[16 * part->bone_count + 4 * (i % 4) + i / 4];
        }
        if (bone.node < 0) {
            good = gltf_fail(&g->file, GLTF_SKINS, skin, "joint %d is no node of the scene", part->bone_count);
        }
        part->bones[part->bone_count++] = bone;
    }
    free(matrices.at);
    return good;
}

/* Adds a set of four bones a vertex. */
static bool add_weights(struct gltf_scene *g, const struct primitive *p, const struct gltf_values *joints,
                        const struct gltf_values *weights)
{
    struct scene_part *part = p->part;
    const size_t count = 4 * (size_t)part->vertex_count;
    struct scene_weight *more = realloc(part->weights, ((size_t)part->weight_count + count + 1) * sizeof *more);
    if (!more) {
        return gltf_no_memory(g);
    }
    part->weights = more;
    for (size_t i = 0; i < count; ++i) {
        const double weight = weights->at[i], bone = joints->at[i];
        if (!isfinite(weight) || weight < 0.0) {
            return gltf_fail(&g->file, GLTF_MESHES, p->mesh, "a weight is negative or not finite");
        }
        if (weight > 0.0 && !(bone >= 0.0 && bone < part->bone_count && bone == floor(bone))) {
            return gltf_fail(&g->file, GLTF_MESHES, p->mesh, "vertex %zu names joint %.0f of %d", i / 4, bone, part->bone_count);
        }
        if (weight > 0.0) {
            const struct scene_weight one = {(int)(i / 4), (int)bone, (float)weight};
            part->weights[part->weight_count++] = one;
        }
    }
    return true;
}

/* Reads all sets of bones and weights; a part without any is in its node's space. */
static bool read_skin(struct gltf_scene *g, const struct primitive *p, int skin)
{
    enum { MOST_SETS = 8 };
    bool good = true;
    for (int set = 0; good && set < MOST_SETS; ++set) {
        char names[2][32];
        struct gltf_values joints, weights = {0};
        snprintf(names[0], sizeof names[0], "JOINTS_%d", set);
        snprintf(names[1], sizeof names[1], "WEIGHTS_%d", set);
        good = read_attribute(g, p, p->attributes, names[0], 4, 4, &joints)
            && read_attribute(g, p, p->attributes, names[1], 4, 4, &weights);
        const bool there = joints.at && weights.at;
        if (good && there && set == 0) {
            good = read_bones(g, skin, p->part);
        }
        good = good && (!there || add_weights(g, p, &joints, &weights));
        free(joints.at);
        free(weights.at);
        if (!there) {
            break;
        }
    }
    return good;
}

static bool read_primitive(struct gltf_scene *g, struct primitive *p, int node, int skin)
{
    const double mode = gltf_whole(p->item, "mode", 4.0);
    if (mode < 0.0 || mode > 6.0) {
        return gltf_fail(&g->file, GLTF_MESHES, p->mesh, "mode %.0f is none of glTF's", mode);
    }
    if (mode < 4.0 || !gltf_member(gltf_member(p->item, "attributes"), "POSITION")) {
        return true; /* points and lines; or nothing */
    }
    p->part = &g->to->parts[g->to->part_count++];
    p->part->node = node;
    p->attributes = gltf_member(p->item, "attributes");
    p->targets = gltf_member(p->item, "targets");
    bool good = gltf_reference(&g->file, p->item, "material", GLTF_MATERIALS, &p->part->material);
    p->part->material = p->part->material >= 0 ? p->part->material : g->to->material_count - 1;
    good = good && decode_draco(g, p) && read_vectors(g, p, "POSITION", 3, true, &p->part->positions)
        && read_vectors(g, p, "NORMAL", 3, true, &p->part->normals) && read_vectors(g, p, "COLOR_0", 4, false, &p->part->colors)
        && read_uvs(g, p) && read_triangles(g, p, (int)mode) && (skin < 0 || read_skin(g, p, skin));
    gltf_draco_free(p->draco);
    return good;
}

static int primitives_of(struct gltf_scene *g, int mesh)
{
    return cJSON_GetArraySize(gltf_member(g->file.items[GLTF_MESHES][mesh], "primitives"));
}

/* Reads the mesh of a node. */
static bool read_mesh(struct gltf_scene *g, int number)
{
    const cJSON *node = g->file.items[GLTF_NODES][number], *primitive;
    int mesh, skin;
    if (!gltf_reference(&g->file, node, "mesh", GLTF_MESHES, &mesh) || !gltf_reference(&g->file, node, "skin", GLTF_SKINS, &skin)) {
        return false;
    }
    const cJSON *item = mesh >= 0 ? g->file.items[GLTF_MESHES][mesh] : NULL, *own = gltf_member(node, "weights");
    bool good = true;
    cJSON_ArrayForEach(primitive, gltf_member(item, "primitives")) {
        struct primitive p = {.item = primitive, .weights = own ? own : gltf_member(item, "weights"), .mesh = mesh};
        good = good && read_primitive(g, &p, g->node_of[number], skin);
    }
    return good;
}

/* Reads the meshes of all nodes, in the order of the scene. */
static bool read_parts(struct gltf_scene *g)
{
    const int count = g->file.counts[GLTF_NODES];
    int *file_node = malloc(((size_t)g->to->node_count + 1) * sizeof *file_node);
    size_t parts = 0;
    bool good = file_node != NULL;
    for (int n = 0; good && n < g->to->node_count; ++n) {
        file_node[n] = -1;
    }
    for (int n = 0; good && n < count; ++n) {
        const double mesh = gltf_whole(g->file.items[GLTF_NODES][n], "mesh", -1.0);
        if (g->node_of[n] >= 0) {
            file_node[g->node_of[n]] = n;
            parts += mesh >= 0.0 && mesh < g->file.counts[GLTF_MESHES] ? (size_t)primitives_of(g, (int)mesh) : 0;
        }
    }
    g->to->parts = good ? calloc(parts + 1, sizeof *g->to->parts) : NULL;
    good = g->to->parts || gltf_no_memory(g);
    for (int n = 0; good && n < g->to->node_count; ++n) {
        good = file_node[n] < 0 || read_mesh(g, file_node[n]);
    }
    free(file_node);
    return good;
}

bool gltf_scene_read(const struct gltf_file *file, enum scene_extent extent, struct scene *scene)
{
    struct gltf_scene g = {.file = *file, .extent = extent, .to = scene};
    const bool good = read_nodes(&g) && gltf_read_materials(&g) && read_parts(&g)
        && (extent == SCENE_SHAPE || gltf_read_animations(&g));
    gltf_close(&g.file);
    free(g.node_of);
    free(g.picture_of);
    free(g.uv_set);
    free(g.uv_map);
    return good;
}
