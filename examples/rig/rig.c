/* rig.c - a skeleton for any mesh (paper, section 5.8: the part of Pinocchio).
 *
 *   rig man.off --out result                                   # rigged.glb and rigged.png
 *   rig armadillo.off --out armadillo.glb --animation CesiumMan.glb
 *   rig fox.obj --template quadruped --facing 0,0,1 --json -
 *
 * The body's phi is sampled, a tree of medial curves is traced inside, and the joints of a template are placed on it
 * (skeleton_embed.h). Weights are heat in equilibrium on the closed surface. With --animation the skeleton moves as another
 * character's does. */
#include "rig/rig.h"

#include "base/progress.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool rig_fail(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    const bool failed = cli_failed("rig", format, arguments);
    va_end(arguments);
    return failed;
}

/* Makes a direction of length 1; returns false for zero. */
static bool unit(float v[3])
{
    const float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int i = 0; i < 3; ++i) { v[i] = length > 0.0f ? v[i] / length : 0.0f; }
    return length > 0.0f;
}

static bool ends_with(const char *text, const char *end)
{
    const size_t length = strlen(text), tail = strlen(end);
    return length >= tail && strcmp(text + length - tail, end) == 0;
}

static int read_command_line(struct rig_settings *set, int argc, char **argv)
{
    const struct cli_option options[] = {
        {"template", CLI_STRING, &set->skeleton, "NAME", "biped, quadruped or a JSON file", 0, 0, NULL},
        {"facing", CLI_FLOAT3, set->facing, "X,Y,Z", "where the body looks (default: where its feet point)", 0, 0,
         NULL},
        {"up", CLI_FLOAT3, set->up, "X,Y,Z", "upwards (default: as the body stands)", 0, 0, NULL},
        {"accept", CLI_FLAG, &set->accept, NULL, "the limbs are right: no note where they are unlike those of the template", 0, 0, NULL},
        {"pin", CLI_STRING, &set->pins, "LIST", "joints that are elsewhere: JOINT=X,Y,Z;..., in the unit of MESH", 0, 0, NULL},
        {"animation", CLI_STRING, &set->animation, "FILE", "a rigged character that the body moves like", 0, 0, NULL},
        {"motion", CLI_STRING, &set->motion, "NAME", "name or number of its animation (default: the first)", 0, 0,
         NULL},
        {"fps", CLI_INT, &set->fps, "N", "frames a second of the animation", 1, 120, NULL},
        {"thicken", CLI_FLOAT, &set->thicken, "X", "voxels of thickness that sheets get, such as capes (default 1, with a note)",
         0, 10, NULL},
        {"size", CLI_INT, &set->size, "N", "height of the picture, pixels", 32, 4096, NULL},
        {"view", CLI_FLOAT3, set->view, "F,L,U", "direction from the body to the eye: forward, left, up", 0, 0, NULL},
        {"set", CLI_STRING, &set->overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    const struct cli_positional files[] = {
        {"MESH", &set->mesh, "a closed body (glTF 2.0 and what assimp reads)", true}};
    const struct cli_rule rules[] = {
        {.given = "motion", .needs = "animation"}, {.given = "fps", .needs = "animation"},
        {.given = "size", .needs = "out"},         {.given = "size+out=.glb"},
        {.given = "view", .needs = "out"},         {.given = "view+out=.glb"},
    };
    static const struct cli_writes writes[] = {{.files = "rigged.glb|rigged.png"}};
    const struct cli_program program = {.name = "rig",
                                        .summary = "a skeleton and bone weights for a body that has none",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = files,
                                        .positional_count = 1,
                                        .without = "backend",
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) { return status; }
    if (cli_grid("rig", &set->common, 112, 48, 512) != CLI_CONTINUE) { return CLI_EXIT_USAGE; }
    if (set->common.out && ends_with(set->common.out, ".glb")) {
        set->glb = set->common.out;
        set->common.out = NULL;
    }
    return CLI_CONTINUE;
}

int main(int argc, char **argv)
{
    struct rig *rig = calloc(1, sizeof *rig);
    char path[1200], error[CHARACTER_TEXT];
    if (!rig) { return cli_fail("rig", CLI_EXIT_FAILURE, "not enough memory"); }
    struct rig_settings *set = &rig->settings;
    *set = (struct rig_settings){.skeleton = "biped", .fps = 24, .thicken = -1.0f, .size = 420, .view = {1.0f, 0.45f, 0.15f}};
    set->common = cli_common_defaults();
    int status = read_command_line(set, argc, argv);
    /* The skeleton is fitted to the zero level: what tests/bench/rigs.py measures. */
    status = status == CLI_CONTINUE ? run_options("rig", &set->common, "contouring=0", &rig->params) : status;
    status = status == CLI_CONTINUE ? run_set_members("rig", set->overrides, &rig->params) : status;
    status = status == CLI_CONTINUE && set->glb ? run_check_output("rig", set->glb) : status;
    if (status != CLI_CONTINUE) {
        free(rig);
        return status;
    }
    const double start = elapsed_seconds();
    const bool up = unit(set->up), facing = unit(set->facing);
    bool good = rig_find_template(set->skeleton, argv[0], path, sizeof path)
        && (skeleton_template_read(path, &rig->skeleton, error) || rig_fail("%s", error))
        && (!set->animation || rig_motion_read(rig))
        && rig_body_read(rig, set->mesh, up ? set->up : NULL, facing ? set->facing : NULL, &rig->body)
        && (!set->pins || rig_pin(rig)) && rig_skin(rig) && (!set->animation || rig_move(rig));
    rig->seconds = elapsed_seconds() - start;
    if (good && cli_may_print(&set->common)) { rig_print(rig); }
    good = good && ((!set->common.out && !set->glb) || rig_write(rig))
        && (!set->common.json || rig_report(rig, set->common.json));
    springls_mesh_free(rig->body.ctx, &rig->surface);
    free(rig->influences);
    character_free(&rig->other);
    rig_body_free(&rig->body);
    free(rig);
    return good ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
