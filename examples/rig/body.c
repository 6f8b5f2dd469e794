/* body.c - from a file to a body with the template's joints and weights. */
#include "rig/rig.h"

#include "base/vec3.h"
#include "character/sheets.h"
#include "pictures/raycast.h"
#include "surface/mesh_check.h"

#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double OPEN_SHARE = 0.05; /* of edges: a mesh with more boundary edges is no body */
static const float UNLIKE = 0.65f;     /* cost of roles from which the limbs may not be what they are taken for */
static const double BRIDGE = 0.1;      /* of the longest side: the longest bridge between parts */
static const float FUSED = 0.3f;       /* of the template's length over the height: a shorter limb is fused with the body */
static const float SHORT = 0.75f;      /* of the same: a shorter limb may be, if it grows by... */
static const float PARTED = 1.15f;     /* ...this factor in a thinner body */
static const float WORSE = 0.15f;      /* by less than this may the cost of roles grow there */
static const float SAME = 0.1f;        /* of the height: two ends as near as this are one */
static const float OPENINGS[] = {0.5f, 1.0f}; /* voxels by which a body is thinner where limbs that touch it are searched */

bool rig_find_template(const char *name, const char *program, char *path, size_t size)
{
    const char *slash = strrchr(program, '/');
    const bool is_file = strchr(name, '.') != NULL;
    FILE *file = NULL;
    for (int k = 0; k < (is_file ? 1 : 2) && !file; ++k) {
        if (is_file) {
            snprintf(path, size, "%s", name);
        } else if (k == 0) {
            snprintf(path, size, "examples/rig/%s.json", name);
        } else {
            snprintf(path, size, "%.*s../examples/rig/%s.json", slash ? (int)(slash - program + 1) : 0, program, name);
        }
        file = fopen(path, "rb");
    }
    if (!file && is_file) { return rig_fail("--template %s: %s", name, strerror(errno)); }
    if (!file) { return rig_fail("--template %s: biped, quadruped or a JSON file", name); }
    fclose(file);
    return true;
}

static bool grid_around(const struct rig *rig, const struct character *body, struct solid_grid *grid)
{
    float lo[3] = {INFINITY, INFINITY, INFINITY}, hi[3] = {-INFINITY, -INFINITY, -INFINITY};
    raycast_grow_box(body->positions, (size_t)body->vertex_count, lo, hi);
    return solid_grid_around(lo, hi, rig->settings.common.grid, grid);
}

static bool set_mesh(const struct rig *rig, const char *path, struct rig_body *body)
{
    const struct character *c = &body->character;
    springls_params params = rig->params;
    springls_desc desc;
    springls_mesh_report report;
    memset(&desc, 0, sizeof desc);
    for (int k = 0; k < 3; ++k) {
        desc.grid.size[k] = body->grid.size[k];
        desc.grid.origin[k] = body->grid.origin[k];
        desc.grid.spacing[k] = body->grid.spacing;
    }
    params.split_input = 0;
    desc.params = &params;
    if (run_create("rig", &desc, &body->ctx) != CLI_CONTINUE) { return false; }
    int *triangles = malloc(3 * ((size_t)c->triangle_count + 1) * sizeof *triangles), count = c->triangle_count;
    if (!triangles) { return rig_fail("not enough memory"); }
    memcpy(triangles, c->triangles, 3 * (size_t)count * sizeof *triangles);
    const int skins = mesh_drop_inner_skins(c->positions, c->vertex_count, triangles, &count);
    if (skins > 0 && !rig->settings.common.quiet) {
        fprintf(stderr, "rig: %s: an inner skin: the body is taken as full\n", path);
    }
    const springls_status status = springls_set_mesh(body->ctx, c->positions, c->vertex_count, 0, triangles, count, &report);
    free(triangles);
    if (skins < 0) { return rig_fail("not enough memory"); }
    if (status == SPRINGLS_BAD_MESH) {
        return rig_fail("%s: the mesh encloses nothing; a body is closed, and only its sheets, such as capes, may be open (--thicken)",
                        path);
    }
    body->boundary_edges = report.boundary_edges;
    return run_check("rig", body->ctx, status, path)
        && (report.boundary_edges <= OPEN_SHARE * 1.5 * c->triangle_count || rig->settings.thicken > 0.0f
            || rig_fail("%s: the mesh is open: %d boundary edges of %d triangles; a body is closed "
                        "(--thicken 1: its sheets become solid)", path, report.boundary_edges, c->triangle_count));
}

/* Makes sheets solid, such as capes, which have no inside; with a note where that was not asked for. */
static bool thicken_sheets(const struct rig *rig, const char *path, const struct rig_body *body, float *phi)
{
    const struct character *c = &body->character;
    const float thicken = rig->settings.thicken;
    unsigned char *sheet = malloc((size_t)c->triangle_count + 1);
    struct sheets found;
    bool good = sheet && sheets_find(&body->grid, phi, c, sheet, &found);
    if (good && found.triangles > 0 && thicken < 0.0f && !rig->settings.common.quiet) {
        fprintf(stderr, "rig: %s: sheets without an inside (%d, of %d triangles) are made one voxel thick; --thicken X for another "
                "thickness, 0 to leave them out\n", path, found.found, found.triangles);
    }
    good = good && (thicken == 0.0f || sheets_thicken(&body->grid, phi, c, sheet, thicken < 0.0f ? 1.0f : thicken));
    free(sheet);
    return good || rig_fail("not enough memory");
}

/* Returns the length of a limb in a body, from its end to its first joint. */
static float limb_length(const struct skeleton_template *s, int pair, int side, const float (*places)[3])
{
    float length = 0.0f;
    for (int j = s->limb_end[pair][side]; j != s->limb_root[pair][side]; j = s->joints[j].parent) {
        float way[3];
        vec3_sub(places[j], places[s->joints[j].parent], way);
        length += vec3_length(way);
    }
    return length;
}

/* Returns the length of the shorter limb of a pair over the height, as a share of the template's. */
static float share_of_length(const struct skeleton_template *s, int pair, const struct skeleton_embedding *e)
{
    float rest[TEMPLATE_JOINTS][3], share = INFINITY;
    for (int j = 0; j < s->count; ++j) { memcpy(rest[j], s->joints[j].position, sizeof rest[j]); }
    for (int side = 0; side < 2; ++side) {
        const float own = limb_length(s, pair, side, (const float (*)[3])e->place) / e->height;
        share = fminf(share, own / (limb_length(s, pair, side, (const float (*)[3])rest) / s->height));
    }
    return share;
}

/* Finds whether the limbs of a pair are so short that what was found is only the part of them that stands out. */
static bool is_fused(const struct skeleton_template *s, int pair, const struct skeleton_embedding *e)
{
    return share_of_length(s, pair, e) < FUSED;
}

static bool has_limbs_below(const struct skeleton_template *s, const struct skeleton_embedding *e, float share)
{
    bool below = false;
    for (int pair = 0; pair < s->limbs; ++pair) { below = below || share_of_length(s, pair, e) < share; }
    return below;
}

static bool has_fused_limbs(const struct skeleton_template *s, const struct skeleton_embedding *e)
{
    return has_limbs_below(s, e, FUSED);
}

/* Finds whether the limbs of a pair become much longer in a thinner body, as those do that touch each other or the trunk. */
static bool comes_apart(const struct skeleton_template *s, int pair, const struct skeleton_embedding *whole,
                        const struct skeleton_embedding *thin)
{
    const float share = share_of_length(s, pair, whole);
    return share < SHORT && share_of_length(s, pair, thin) > PARTED * share;
}

/* Returns the pair of limbs that a joint belongs to, -1: the trunk. */
static int pair_of(const struct skeleton_template *s, int joint)
{
    for (int pair = 0; pair < s->limbs; ++pair) {
        for (int side = 0; side < 2; ++side) {
            const int root = s->limb_root[pair][side];
            if (joint == root || skeleton_template_below(s, joint, root)) { return pair; }
        }
    }
    return -1;
}

/* Takes all that was not parted from the embedding in the whole body, which is more exact, if both have the same head and sides. Where
 * legs have parted the trunk ends elsewhere too. */
static void take_limbs(const struct skeleton_template *s, const struct skeleton_embedding *whole, const bool parted[2],
                       struct skeleton_embedding *found)
{
    const int head = s->trunk_end[0];
    const bool legs = (parted[0] && s->ground[0]) || (parted[1] && s->ground[1]);
    float way[3];
    vec3_sub(whole->place[head], found->place[head], way);
    const bool same = vec3_length(way) < SAME * whole->height && vec3_dot(whole->left, found->left) > 0.7f;
    for (int j = 0; same && j < s->count; ++j) {
        const int pair = pair_of(s, j);
        if (pair < 0 ? !legs : !parted[pair]) { memcpy(found->place[j], whole->place[j], sizeof found->place[j]); }
    }
    found->height = whole->height;
}

/* Finds which pairs of limbs a thinner body has parted from what they are fused with in the whole one; false: it is of no use. */
static bool has_parted(const struct skeleton_template *s, const struct skeleton_embedding *whole, const struct skeleton_embedding *best,
                       const struct skeleton_embedding *found, bool parted[2])
{
    bool any = false, fused = has_fused_limbs(s, whole);
    for (int pair = 0; pair < 2; ++pair) {
        parted[pair] = pair < s->limbs && (is_fused(s, pair, whole) || comes_apart(s, pair, whole, found));
        any = any || (parted[pair] && comes_apart(s, pair, best, found));
    }
    if (has_fused_limbs(s, found)) { return false; }
    return fused ? found->roles.cost < best->roles.cost || has_fused_limbs(s, best) : any && found->roles.cost < whole->roles.cost + WORSE;
}

/* Limbs that a thinner body has made longer touch over an unknown part of their length: they are a guess. */
static void doubt(const struct skeleton_template *s, const bool parted[2], const struct skeleton_embedding *whole,
                  struct skeleton_embedding *found, bool doubted[2])
{
    for (int pair = 0; pair < s->limbs; ++pair) {
        doubted[pair] = parted[pair] && !is_fused(s, pair, whole);
        if (doubted[pair]) { found->roles.confidence[SKELETON_FIRST_PAIR + pair] = 0.0f; }
    }
}

/* Where limbs are short, as they seem where arms touch the hips or knees touch each other, embeds the template in a thinner body, in
 * which they are not: what touches is less deep than what it belongs to. doubted: pairs found so that are a guess. Returns false if
 * memory is short. */
static bool part_limbs(const struct rig *rig, const float *phi, float band, const float *up, const float *facing,
                       struct rig_body *body, bool doubted[2])
{
    const size_t count = (size_t)body->grid.size[0] * (size_t)body->grid.size[1] * (size_t)body->grid.size[2];
    const struct skeleton_template *s = &rig->skeleton;
    const struct skeleton_embedding whole = body->embedding;
    bool good = true;
    if (!has_limbs_below(s, &whole, SHORT)) { return true; }
    float *thin = malloc(count * sizeof *thin);
    good = thin != NULL;
    for (size_t k = 0; good && k < sizeof OPENINGS / sizeof *OPENINGS; ++k) {
        struct solid_repair repair;
        struct solid solid;
        struct skeleton_embedding found;
        char error[CHARACTER_TEXT];
        bool inside = false, parted[2];
        for (size_t n = 0; n < count; ++n) {
            thin[n] = phi[n] + OPENINGS[k];
            inside = inside || thin[n] < 0.0f;
        }
        if (!inside) { break; }
        good = solid_repair(&body->grid, thin, NULL, (int)(BRIDGE * rig->settings.common.grid), false, &repair)
            && solid_create(&body->grid, thin, band, &solid);
        if (!good) { break; }
        if (skeleton_embed(s, &solid, up, facing, &found, error) && has_parted(s, &whole, &body->embedding, &found, parted)) {
            take_limbs(s, &whole, parted, &found);
            doubt(s, parted, &whole, &found, doubted);
            body->embedding = found;
        }
        solid_free(&solid);
    }
    free(thin);
    return good;
}

/* Names limbs that are still fused, or touch each other; where they begin is a guess. */
static void note_fused(const struct rig *rig, const char *path, const bool doubted[2], struct skeleton_embedding *e)
{
    const struct skeleton_template *s = &rig->skeleton;
    for (int pair = 0; pair < s->limbs; ++pair) {
        const bool fused = is_fused(s, pair, e);
        if (fused) { e->roles.confidence[SKELETON_FIRST_PAIR + pair] = 0.0f; }
        if (!(fused || doubted[pair]) || rig->settings.common.quiet) { continue; }
        fprintf(stderr, "rig: %s: %s and its partner are short, or touch: they may be fused; look at rigged.png; --pin JOINT=X,Y,Z "
                "moves joints, a finer --grid may part them\n", path, s->joints[s->limb_root[pair][0]].name);
    }
}

/* Samples phi, makes one body of it and embeds the template. */
static bool embed(const struct rig *rig, const char *path, const float *up, const float *facing,
                  struct rig_body *body)
{
    const size_t count = (size_t)body->grid.size[0] * (size_t)body->grid.size[1] * (size_t)body->grid.size[2];
    const float band = springls_get_params(body->ctx).band_half_width;
    char error[CHARACTER_TEXT] = "not enough memory";
    bool doubted[2] = {false, false};
    float *phi = malloc(count * sizeof *phi);
    bool good = phi || rig_fail("not enough memory");
    good = good && run_check("rig", body->ctx, springls_copy_level_set(body->ctx, phi), path)
        && thicken_sheets(rig, path, body, phi);
    good = good
        && ((solid_repair(&body->grid, phi, NULL, (int)(BRIDGE * rig->settings.common.grid), false, &body->repair)
             && solid_create(&body->grid, phi, band, &body->solid))
            || rig_fail("not enough memory"));
    good = good && run_check("rig", body->ctx, springls_set_level_set(body->ctx, phi), path);
    good = good
        && (skeleton_embed(&rig->skeleton, &body->solid, up, facing, &body->embedding, error)
            || rig_fail("%s: %s", path, error))
        && (part_limbs(rig, phi, band, up, facing, body, doubted) || rig_fail("not enough memory"));
    if (good) { note_fused(rig, path, doubted, &body->embedding); }
    free(phi);
    return good;
}

static bool read_character(const struct rig *rig, const char *path, struct character *character)
{
    char error[CHARACTER_TEXT];
    if (!character_read(path, NULL, character, error)) { return rig_fail("%s", error); }
    if (character->missing_pictures > 0 && !rig->settings.common.quiet) {
        fprintf(stderr, "rig: %s: textures that cannot be read, and are left out: %d\n", path, character->missing_pictures);
    }
    return true;
}

/* Keeps the joints that the file has, which only the report shows. */
static bool keep_joints(struct rig_body *body)
{
    const struct character *c = &body->character;
    body->theirs = calloc((size_t)c->joint_count + 1, sizeof *body->theirs);
    for (int j = 0; c->skinned && body->theirs && j < c->joint_count; ++j) {
        bool inner = c->joints[j].bone;
        for (int k = j + 1; k < c->joint_count; ++k) { inner = inner || c->joints[k].parent == j; }
        if (!inner) { continue; }
        struct file_joint *to = &body->theirs[body->their_count++];
        memcpy(to->name, c->joints[j].name, sizeof to->name);
        joint_place(&c->joints[j], to->place);
    }
    return body->theirs || rig_fail("not enough memory");
}

/* Notes that the limbs of a body are unlike those of the template. */
static void note_unlike(const struct rig *rig, const char *path, const struct skeleton_roles *roles)
{
    if (roles->cost > UNLIKE && !rig->settings.accept && !rig->settings.common.quiet) {
        fprintf(stderr, "rig: %s: limbs are unlike those of the template %s (cost %.2f): look at rigged.png; --accept if they are right, "
                "--pin JOINT=X,Y,Z moves joints\n", path, rig->skeleton.name, (double)roles->cost);
    }
}

/* Embeds the template in the body's surface. */
static bool fit_template(const struct rig *rig, const char *path, const float *up, const float *facing, struct rig_body *body)
{
    const bool good = (grid_around(rig, &body->character, &body->grid) || rig_fail("%s: the body has no size", path))
        && set_mesh(rig, path, body) && embed(rig, path, up, facing, body);
    if (good) { note_unlike(rig, path, &body->embedding.roles); }
    return good;
}

bool rig_body_read(const struct rig *rig, const char *path, const float *up, const float *facing,
                   struct rig_body *body)
{
    memset(body, 0, sizeof *body);
    return read_character(rig, path, &body->character) && keep_joints(body) && fit_template(rig, path, up, facing, body);
}

static int find_template_joint(const struct skeleton_template *skeleton, const char *name, size_t length)
{
    for (int t = 0; t < skeleton->count; ++t) {
        if (strlen(skeleton->joints[t].name) == length && strncmp(skeleton->joints[t].name, name, length) == 0) { return t; }
    }
    return -1;
}

bool rig_pin(struct rig *rig)
{
    struct skeleton_embedding *e = &rig->body.embedding;
    for (const char *at = rig->settings.pins; *at;) {
        const size_t name = strcspn(at, "="), length = strcspn(at, ";");
        const int joint = find_template_joint(&rig->skeleton, at, name);
        float place[3];
        char end = '\0';
        const int read = name < length ? sscanf(at + name + 1, "%f,%f,%f%c", &place[0], &place[1], &place[2], &end) : 0;
        if (joint < 0) { return rig_fail("--pin: the template %s has no joint %.*s", rig->skeleton.name, (int)name, at); }
        if (read < 3 || (read == 4 && end != ';')) { return rig_fail("--pin %.*s: JOINT=X,Y,Z is wanted", (int)length, at); }
        for (int i = 0; i < 3; ++i) {
            const double from = (double)place[i] - (double)rig->body.grid.origin[i];
            if (!(from >= 0.0 && from <= (double)rig->body.grid.spacing * (rig->body.grid.size[i] - 1))) {
                return rig_fail("--pin %.*s: that is not in the body", (int)length, at);
            }
        }
        memcpy(e->place[joint], place, sizeof place);
        e->present[joint] = true;
        at += length + (at[length] == ';');
    }
    return true;
}

void rig_body_free(struct rig_body *body)
{
    character_free(&body->character);
    solid_free(&body->solid);
    free(body->theirs);
    springls_destroy(body->ctx);
    memset(body, 0, sizeof *body);
}

/* Lists bones: from each joint to those below it. Ends are on the surface: bones go four fifths of the way to them. */
static int list_bones(const struct rig *rig, struct bone *bones, int *joints)
{
    const struct skeleton_template *s = &rig->skeleton;
    const struct skeleton_embedding *e = &rig->body.embedding;
    int count = 0;
    for (int t = 1; t < s->count; ++t) {
        const int up = s->joints[t].parent;
        if (!e->present[t] || !e->present[up]) { continue; }
        float d[3];
        vec3_sub(e->place[t], e->place[up], d);
        memcpy(bones[count].from, e->place[up], sizeof bones[count].from);
        vec3_add_scaled(e->place[up], s->joints[t].end ? 0.8f : 1.0f, d, bones[count].to);
        joints[count++] = rig->joint_of[up];
    }
    return count;
}

bool rig_skin(struct rig *rig)
{
    struct rig_body *body = &rig->body;
    struct bone bones[TEMPLATE_JOINTS];
    int joints[TEMPLATE_JOINTS];
    if (!skeleton_make_joints(&rig->skeleton, &body->embedding, &body->character, rig->joint_of)) {
        return rig_fail("not enough memory");
    }
    const int count = list_bones(rig, bones, joints);
    if (!run_check("rig", body->ctx, springls_extract_mesh(body->ctx, &rig->surface), rig->settings.mesh)) {
        return false;
    }
    const struct skin_surface surface = {rig->surface.positions, rig->surface.triangles, rig->surface.vertex_count,
                                         rig->surface.triangle_count};
    rig->influences = malloc(((size_t)surface.vertex_count + 1) * sizeof *rig->influences);
    return (rig->influences || rig_fail("not enough memory"))
        && (skin_weights_heat(&surface, bones, joints, count, rig->influences, &rig->heat)
            || rig_fail("%s: no bone is seen from the body's surface", rig->settings.mesh))
        && rig_part_sides(rig)
        && (skin_weights_transfer(&surface, rig->influences, &body->character) || rig_fail("not enough memory"))
        && rig_check_sides(rig);
}

bool rig_motion_read(struct rig *rig)
{
    const struct rig_settings *set = &rig->settings;
    const struct character *other = &rig->other;
    if (!read_character(rig, set->animation, &rig->other)) { return false; }
    if (!other->skinned || other->animation_count == 0) { return rig_fail("%s: no skeleton that moves", set->animation); }
    rig->motion = character_animation(other, set->motion);
    return rig->motion >= 0 || rig_fail("%s: no animation %s (--motion)", set->animation, set->motion);
}

bool rig_move(struct rig *rig)
{
    const struct rig_settings *set = &rig->settings;
    struct rig_body other = {.character = rig->other};
    memset(&rig->other, 0, sizeof rig->other); /* its owner is the body, until it is fitted */
    bool good = fit_template(rig, set->animation, NULL, NULL, &other);
    if (good) {
        rig->theirs = other.embedding;
        rig->pairs = skeleton_pair(&rig->skeleton, &other.embedding, &other.character, rig->pair);
        good = (rig->pairs >= 5
                || rig_fail("%s: only %d joints have a partner in the template", set->animation, rig->pairs))
            && (skeleton_retarget(&rig->skeleton, &rig->body.embedding, rig->joint_of, &other.character,
                                  &other.embedding, rig->pair, rig->motion, set->fps, &rig->body.character)
                || rig_fail("not enough memory"));
        rig->other = other.character;
        memset(&other.character, 0, sizeof other.character);
    }
    rig_body_free(&other);
    return good;
}
