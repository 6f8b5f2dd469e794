/* rig.h - gives a body without a skeleton a template's (paper, section 5.8: the part of Pinocchio).
 *
 *   read    reads the body and samples its phi; embeds the template in it (body.c)
 *   skin    closed surface, bone weights by heat (body.c), which keep to their side (sides.c)
 *   motion  an animation of another character (motion.c)
 *   output  glTF, pictures, report (output.c) */
#ifndef EXAMPLES_RIG_RIG_H
#define EXAMPLES_RIG_RIG_H

#include "character/skeleton_embed.h"
#include "character/skeleton_retarget.h"
#include "character/skin_weights.h"
#include "springls/run_options.h"

struct rig_settings {
    struct cli_common common;
    const char *mesh, *skeleton, *animation, *motion, *overrides;
    const char *pins;       /* joints that the user has placed; NULL: none */
    bool accept;            /* the limbs are right, however unlike the template's */
    const char *glb;        /* --out FILE.glb; NULL: rigged.glb in the folder --out */
    float facing[3], up[3]; /* zero: found from the body */
    float view[3];          /* of pictures: from the body's front, left and top */
    float thicken;          /* voxels: sheets become solids of this thickness; 0: they are left out; negative: 1, with a note */
    int fps, size;
};

/* A joint that the file has: what a skeleton found in the surface is measured by. */
struct file_joint {
    char name[CHARACTER_NAME];
    float place[3];
};

/* A body, its inside as voxels, and the template in it. */
struct rig_body {
    struct character character;
    struct solid_grid grid;
    struct solid_repair repair;
    int boundary_edges;
    struct solid solid;
    struct skeleton_embedding embedding;
    springls_context *ctx; /* the closed body */
    struct file_joint *theirs; /* the file's own joints, those with weights or joints below */
    int their_count;
};

struct rig {
    struct rig_settings settings;
    springls_params params;
    struct skeleton_template skeleton;
    struct rig_body body;
    springls_mesh surface;         /* closed, of the body */
    struct influences *influences; /* one a vertex of it */
    struct heat_report heat;
    int on_both_sides[2];          /* vertices with weights of both sides away from the plane of symmetry: of the surface, by heat
                                    * alone, and of the body, as they are written */
    int joint_of[TEMPLATE_JOINTS]; /* of the body, for each joint of the template */
    struct character other;        /* of --animation */
    int motion;                    /* which of its animations */
    struct skeleton_embedding theirs;
    int pair[TEMPLATE_JOINTS], pairs;
    double seconds;
};

bool rig_fail(const char *format, ...)
#if defined(__GNUC__)
    __attribute__((format(printf, 1, 2)))
#endif
    ; /* prints one line on stderr; returns false */

/* Finds the file of a template: a path, or the name of one that comes with the program. */
bool rig_find_template(const char *name, const char *program, char *path, size_t size);

/* Reads a character or a mesh and embeds the template in its surface. up, facing: known directions, or NULL. */
bool rig_body_read(const struct rig *rig, const char *path, const float *up, const float *facing,
                   struct rig_body *body);
void rig_body_free(struct rig_body *body);
bool rig_pin(struct rig *rig); /* moves the joints of --pin */
bool rig_skin(struct rig *rig);
bool rig_part_sides(struct rig *rig);  /* makes the surface's weights keep to their side (sides.c) */
bool rig_check_sides(struct rig *rig); /* counts the body's vertices whose weights do not */
bool rig_motion_read(struct rig *rig); /* reads the character of --animation and finds its --motion */
bool rig_move(struct rig *rig);        /* by that motion */
bool rig_write(struct rig *rig);
bool rig_report(const struct rig *rig, const char *path);
void rig_print(const struct rig *rig);

#endif
