/* morph.c - a walking character becomes another one (paper, section 5.8).
 *
 *   morph --out result                                            # two built-in bodies
 *   morph Knight.glb Mage.glb --animation Walking_A --out result
 *   morph Fox.glb CesiumMan.glb --out result                      # different skeletons
 *   morph Knight.glb --list
 *   morph body.obj --weights --donor RiggedFigure.glb --out result # bone weights for a body that has none
 *
 * The source is rescaled onto the target's skeleton; both become springls' bodies on one grid. In each frame linear blend
 * skinning, as a batch of affine forces, moves the springls in a step of Algorithm 2, and an active contour pushes them to a
 * shape between the two in the same pose: in that step, and in more iterations where the model lags. Bone weights, texture
 * coordinates and colors stay with the springls. */
#include "morph/morph.h"

#include <stdio.h>
#include <string.h>

static int read_command_line(struct morph_settings *set, int argc, char **argv)
{
    const struct cli_option options[] = {
        {"animation", CLI_STRING, &set->animation, "NAME", "name or number, of the target (default: the first)", 0, 0, NULL},
        {"list", CLI_FLAG, &set->list, NULL, "list animations and joints, and end", 0, 0, NULL},
        {"map", CLI_STRING, &set->map, "FILE", "joints of the source and of the target, a pair a line", 0, 0, NULL},
        {"frames", CLI_INT, &set->frames, "N", "at most; fewer when the two coincide before", 2, MORPH_MAX_FRAMES, NULL},
        {"fps", CLI_INT, &set->fps, "N", "frames a second of the animation", 1, 120, NULL},
        {"iterations", CLI_INT, &set->iterations, "N",
         "iterations of the active contour a frame at least, the first in the step of skinning; up to ten while the model lags", 1,
         1000, NULL},
        {"pace", CLI_FLOAT, &set->pace, "X",
         "voxels that the contour moves in an iteration; up to half as much again where the model lags, and somewhat further in a "
         "frame of several sub-steps", 0.001, 1, NULL},
        {"blend", CLI_INT, &set->blend, "N", "frames in which the source becomes the target", 1, 1000, NULL},
        {"thicken", CLI_FLOAT, &set->thicken, "X",
         "voxels of thickness that sheets get, such as capes (default 1, with a note); 0: leave them out", 0, 10, NULL},
        {"limbs", CLI_FLOAT, &set->limbs, "X",
         "voxels of thickness that thinner limbs and sheets get, at most 2 * band_half_width; 0: as they are", 0, 6, NULL},
        {"reach", CLI_INT, &set->reach, "N", "voxels: longest bridge to a body that touches nothing", 0, 1000, NULL},
        {"props", CLI_STRING, &set->props, "NAMES", "rigid parts that hang on bones too: parts of their names, or all", 0, 0,
         NULL},
        {"weights", CLI_FLAG, &set->weights, NULL, "only bone weights for SOURCE, by heat; as if it had none", 0, 0, NULL},
        {"donor", CLI_STRING, &set->donor, "FILE", "whose skeleton a body without bones gets (else the other's)", 0, 0, NULL},
        {"preserve", CLI_FLAG, &set->preserve, NULL, "active contours that keep the topology", 0, 0, NULL},
        {"channel", CLI_FLAG, &set->channel, NULL, "springls carry bone weights too; compare them with those looked up (--json)", 0,
         0, NULL},
        {"size", CLI_INT, &set->size, "N", "height of the pictures, pixels", 32, 4096, NULL},
        {"texture", CLI_INT, &set->texture, "N", "texels of a frame's texture a side; 0: colors at vertices", 0, 4096, NULL},
        {"view", CLI_FLOAT3, set->view, "X,Y,Z", "direction from the body to the eye; up is y", 0, 0, NULL},
        {"set", CLI_STRING, &set->overrides, "LIST", RUN_OPTIONS_SET_HELP, 0, 0, NULL},
    };
    const struct cli_positional files[] = {
        {"SOURCE", &set->source, "a rigged character (glTF 2.0 and what assimp reads)", false},
        {"TARGET", &set->target, "what it becomes", false}};
    const struct cli_rule rules[] = {
        {.given = "list", .only = "SOURCE|TARGET|quiet"},
        {.given = "weights", .only = "SOURCE|donor|props|map|thicken|reach|size|view|grid|params|set|threads|json|out|quiet"},
        {.given = "size", .needs = "out"},
        {.given = "view", .needs = "out"},
        {.given = "texture", .needs = "out"},
        {.given = "channel", .needs = "json"},
    };
    static const struct cli_writes writes[] = {
        {.files = "frame[0-9]*.png|morph.png|strip.png|morph.glb|skinned.glb", .without = "weights"},
        {.files = "weights.png|rigged.glb", .with = "weights"},
    };
    const struct cli_program program = {.name = "morph",
                                        .summary = "a walking character becomes another one",
                                        .common = &set->common,
                                        .options = options,
                                        .option_count = (int)(sizeof options / sizeof *options),
                                        .positionals = files,
                                        .positional_count = 2,
                                        .rules = rules,
                                        .rule_count = (int)(sizeof rules / sizeof *rules),
                                        .writes = writes,
                                        .writes_count = (int)(sizeof writes / sizeof *writes)};
    const int status = cli_parse(&program, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (set->source && !set->target && !set->list && !set->weights) {
        return cli_fail("morph", CLI_EXIT_USAGE, "one character alone: which is the other? (see --help)");
    }
    return cli_grid("morph", &set->common, 96, 24, 4096);
}

static int list(const char *path)
{
    struct character character;
    char error[CHARACTER_TEXT];
    if (path ? !character_read(path, NULL, &character, error) : !character_build(1, &character, error)) {
        return cli_fail("morph", CLI_EXIT_FAILURE, "%s", error);
    }
    printf("%s: %d parts, %d triangles, %d joints, %d rigid parts on bones\n", morph_name(path), character.part_count,
           character.triangle_count, character.joint_count, character.prop_count);
    for (int a = 0; a < character.animation_count; ++a) {
        printf("  animation %d: %s, %.2f s\n", a, character.animations[a].name, character.animations[a].duration);
    }
    for (int p = 0; p < character.prop_count; ++p) {
        printf("  prop: %s\n", character.props[p]);
    }
    for (int j = 0; j < character.joint_count; ++j) {
        if (character.joints[j].bone) {
            printf("  bone: %s\n", character.joints[j].name);
        }
    }
    character_free(&character);
    return CLI_EXIT_OK;
}

int main(int argc, char **argv)
{
    struct morph morph = {.settings = {.frames = 60,
                                       .fps = 24,
                                       .iterations = 1,
                                       .pace = 1.0f,
                                       .blend = 40,
                                       .reach = 60,
                                       .thicken = -1.0f,
                                       .limbs = 2.5f,
                                       .size = 480,
                                       .texture = 512,
                                       .view = {0.45f, 0.12f, 1.0f}}};
    struct morph_settings *set = &morph.settings;
    set->common = cli_common_defaults();
    int status = read_command_line(set, argc, argv);
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (set->list) {
        status = list(set->source);
        return status == CLI_EXIT_OK && set->target ? list(set->target) : status;
    }
    status = run_options("morph", &set->common, strcmp(set->common.params, "paper") == 0 ? NULL : MORPH_SET, &morph.params);
    status = status == CLI_CONTINUE ? run_set_members("morph", set->overrides, &morph.params) : status;
    if (status != CLI_CONTINUE) {
        return status;
    }
    if (set->preserve) {
        morph.params.topology = SPRINGLS_TOPOLOGY_PRESERVED;
    }
    if (set->weights) {
        return morph_weights(&morph) ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
    }
    if (set->limbs > 2.0f * morph.params.band_half_width) { /* half of it is a depth, which phi has as far as its band goes */
        return cli_fail("morph", CLI_EXIT_USAGE, "--limbs %g: more than twice band_half_width, which is %g", (double)set->limbs,
                        (double)morph.params.band_half_width);
    }
    const bool done = morph_read(&morph) && morph_prepare(&morph) && morph_run(&morph);
    if (done) {
        morph_print(&morph);
    }
    const bool good =
        done && (!set->common.out || morph_write(&morph)) && (!set->common.json || morph_report(&morph, set->common.json));
    morph_free(&morph);
    return good ? CLI_EXIT_OK : CLI_EXIT_FAILURE;
}
