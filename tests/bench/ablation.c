/* ablation - what each improvement of springls_default_params() over springls_paper_params() is worth on LeVeque's test: the
 * paper's set with this one alone, and the default set without it.
 *
 *   GRID=128 PERIOD=2.5 make ablation     another grid than 64^3, another period than 2
 *   ORDERS=1 make ablation                quick: one order of the springls instead of the mean over three
 *
 * Prints tables; build/bench/ablation.json has every figure of every run. */
#include "springls.h"

#include "motion.h"
#include "table.h"

#include "examples/common/springls/exact_flows.h"
#include "examples/common/springls/run_options.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* ---- improvements ---- */

/* The two sets, each with the steps that go with it: as many of equal time as the paper takes, and steps of two voxels. */
static struct motion_setting paper_setting(void)
{
    struct motion_setting setting;
    memset(&setting, 0, sizeof setting);
    setting.params = springls_paper_params();
    return setting;
}

static struct motion_setting default_setting(void)
{
    struct motion_setting setting;
    memset(&setting, 0, sizeof setting);
    setting.params = springls_default_params();
    setting.max_displacement = 2.0f;
    return setting;
}

enum { MAX_MEMBERS = 8 };

/* Members that make sense only together are one improvement. It is applied by taking them from the default set, and taken
   back by taking them from the paper's. */
struct improvement {
    const char *name;
    struct member {
        size_t size, offset;
    } members[MAX_MEMBERS];
};

#define SETTING(member) {sizeof(((struct motion_setting *)NULL)->member), offsetof(struct motion_setting, member)}
#define P(member) SETTING(params.member)

static const struct improvement improvements[] = {
    {"springls from marching cubes on every voxel", {P(initial_stride)}},
    {"triangles of their share of the surface", {P(cover)}},
    {"internal springs stronger than external", {P(kappa_int)}},
    {"one iteration of relax, of twice the gain", {P(relax_iterations), P(relax_step_length), P(relax_step_rotation)}},
    {"bad triangles get a good shape", {P(reshape), P(min_area)}},
    {"the younger of two close particles goes", {P(merge_distance)}},
    {"springls of thin sheets stay", {P(keep_thin)}},
    {"contract and resample after the level set", {P(resample_last)}},
    {"split by the longest edge", {P(split_edge), P(split_area)}},
    {"new springls on a quadratic fit", {P(placement)}},
    {"springls fill holes among them", {P(fill_from_springls)}},
    {"springls carry phi instead of eq. 23; projected",
     {P(carry_level_set), P(evolve_iterations), P(project_level_set)}}, /* carried alone it decays */
    {"phi follows when springls have moved far or turned", {P(lazy_distance)}},
    {"level set projected onto springls", {P(project_level_set)}},
    {"springls put lost sheets back into phi", {P(nucleate)}},
    {"sharp edges stay (a ball has none)", {P(keep_edges)}},
    {"specks are joined or go", {P(min_component)}},
    {"large triangles of a mesh are divided (a ball has none)", {P(split_input)}},
    {"vertices have their own velocity", {P(vertex_velocity)}},
    {"steps of two voxels", {SETTING(max_displacement)}},
};
enum { IMPROVEMENTS = (int)(sizeof improvements / sizeof *improvements), CASES = 2 + 2 * IMPROVEMENTS };

static void take_members(const struct improvement *improvement, const struct motion_setting *from, struct motion_setting *to)
{
    for (const struct member *m = improvement->members; m < improvement->members + MAX_MEMBERS && m->size > 0; ++m) {
        memcpy((char *)to + m->offset, (const char *)from + m->offset, m->size);
    }
}

/* Whoever adds a switch to the library adds a row above: all of them together must make the default set of the paper's, and
   each must make a difference. */
static bool improvements_are_complete(void)
{
    const struct motion_setting paper = paper_setting(), wanted = default_setting();
    struct motion_setting all = paper;
    bool complete = true;
    for (int i = 0; i < IMPROVEMENTS; ++i) {
        struct motion_setting one = paper;
        take_members(&improvements[i], &wanted, &one);
        take_members(&improvements[i], &wanted, &all);
        if (memcmp(&one, &paper, sizeof one) == 0) {
            fprintf(stderr, "ablation: \"%s\" is the same in both sets: take its row out\n", improvements[i].name);
            complete = false;
        }
    }
    for (size_t at = 0; at < sizeof all; ++at) {
        if (((const char *)&all)[at] != ((const char *)&wanted)[at]) {
            fprintf(stderr, "ablation: the sets differ in a member that is no row of the table: %s\n",
                    at < sizeof(springls_params) ? run_member_at(at) : "max_displacement");
            at |= 3; /* members are of four bytes: on to the next */
            complete = false;
        }
    }
    return complete;
}

/* ---- LeVeque's test ---- */

static void exact_velocity(const void *flow, const double x[3], double factor, double v[3])
{
    struct exact_flow still = *(const struct exact_flow *)flow;
    const float at[3] = {(float)x[0], (float)x[1], (float)x[2]};
    float out[3];
    exact_flow_velocity(&still, at, 1, 0.0f, out);
    for (int c = 0; c < 3; ++c) {
        v[c] = factor * (double)out[c];
    }
}

static double time_factor(const void *flow, double time)
{
    return cos(3.14159265358979 * time / (double)((const struct exact_flow *)flow)->period);
}

/* ---- tables ---- */

static void case_row(struct table *table, const struct motion_case *c, int orders)
{
#define MEAN(figure) motion_mean(c, orders, MOTION_##figure)
    const struct motion_spread tracking = motion_spread(c, orders, MOTION_tracking_mean);
    table_row(table, "%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s|%s", c->name,
              cell2("%.4f / %.2f", MEAN(deformation_mean), MEAN(deformation_max)),
              cell2("%.4f / %.2f", MEAN(tracking_mean), MEAN(tracking_max)), cell2("%.4f..%.4f", tracking.least, tracking.most),
              cell2("%.4f / %.2f", MEAN(halfway_mean), MEAN(halfway_max)), cell("%.4f", MEAN(surface_mean)),
              cell("%+.3f %%", MEAN(volume_end)), cell("%.3g", MEAN(components_end)), cell("%.3g", MEAN(euler_end)),
              cell2("%.2f..%.2f", motion_spread(c, orders, MOTION_coverage_least).least,
                    motion_spread(c, orders, MOTION_coverage_most).most),
              cell("%.0f %%", 100.0 * MEAN(covered_mean)), cell("%.0f", MEAN(springls_mean)), cell("%.0f", MEAN(steps)),
              cell("%.2f", MEAN(cpu_ms_a_step)), cell("%.2f", MEAN(cpu_seconds)));
#undef MEAN
}

static void print_cases(const char *title, const struct motion_case *whole, const struct motion_case *cases, int orders)
{
    static struct table table;
    table_begin(&table);
    table_row(&table, "%s|deformation mean / max|tracking mean / max|tracking, orders|halfway mean / max|surface mean|"
                      "volume change|parts|Euler|springls' area|covered|springls|steps|ms a step|s", title);
    case_row(&table, whole, orders);
    for (int i = 0; i < IMPROVEMENTS; ++i) {
        case_row(&table, &cases[i], orders);
    }
    table_print(&table, stdout);
    printf("\n");
}

static bool write_json(const struct motion *motion, const struct motion_case *cases, int orders)
{
    static const char *const groups[2] = {"paper and", "default without"};
    struct json_writer json;
    if (!make_folder("build/bench") || !json_open(&json, "build/bench/ablation.json")) {
        return false;
    }
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", motion->problem.grid);
    json_number(&json, "period", motion->problem.period);
    json_array_begin(&json, "cases");
    for (int i = 0; i < CASES; ++i) {
        json_object_begin(&json, NULL);
        json_string(&json, "set", i < 2 ? "whole" : groups[(i - 2) / IMPROVEMENTS]);
        motion_json(&json, &cases[i], orders);
        json_object_end(&json);
    }
    json_array_end(&json);
    json_object_end(&json);
    return json_close(&json);
}

int main(void)
{
    static struct motion_case cases[CASES]; /* paper, default, paper with each, default without each */
    const int grid = (int)environment_number("GRID", 64.0), orders = (int)environment_number("ORDERS", MOTION_ORDERS);
    const double period = environment_number("PERIOD", 2.0);
    const float n = (float)grid;
    const struct motion_setting paper = paper_setting(), wanted = default_setting();
    if (grid < 16 || grid > 1024 || !(period > 0.0 && period <= 100.0) || orders < 1 || orders > MOTION_ORDERS) {
        fprintf(stderr, "ablation: GRID is 16..1024, PERIOD up to 100, ORDERS 1..%d\n", (int)MOTION_ORDERS);
        return 2;
    }
    if (!improvements_are_complete()) {
        return 1;
    }
    springls_sphere sphere = {{0.35f * n, 0.35f * n, 0.35f * n}, 0.15f * n};
    struct exact_flow flow = EXACT_DEFORMATION(n, (float)period);
    const struct motion motion = {.problem = {.name = "leveque",
                                              .grid = grid,
                                              .steps = 2 * (int)fmax(1.0, floor(period * grid / 1.28 + 0.5)),
                                              .period = period,
                                              .duration = period,
                                              .reverses = true,
                                              .shape = springls_implicit_sphere,
                                              .shape_data = &sphere,
                                              .velocity = exact_flow_velocity,
                                              .velocity_source = exact_flow_source(),
                                              .flow_bytes = sizeof flow,
                                              .flow = &flow,
                                              .exact_velocity = exact_velocity,
                                              .exact_time_factor = time_factor},
                                  .halfway_volume = 1.0};
    for (int i = 0; i < CASES; ++i) {
        const bool with = i == 0 || (i >= 2 && i < 2 + IMPROVEMENTS);
        cases[i].motion = &motion;
        cases[i].setting = with ? paper : wanted;
        cases[i].name = i == 0 ? "paper" : i == 1 ? "default" : improvements[(i - 2) % IMPROVEMENTS].name;
        if (i >= 2) {
            take_members(&improvements[(i - 2) % IMPROVEMENTS], with ? &wanted : &paper, &cases[i].setting);
        }
    }
    printf("LeVeque's test, %d^3, period %g. Lengths in voxels; every figure is the mean over %d orders of the springls, which\n"
           "differ by chance alone: the column of orders shows by how much. ms and s are processor time of the steps.\n\n",
           grid, period, orders);
    fflush(stdout);
    motion_run_all(cases, CASES, orders);
    print_cases("paper and", &cases[0], cases + 2, orders);
    print_cases("default without", &cases[1], cases + 2 + IMPROVEMENTS, orders);
    motion_print_failures(cases, CASES, orders);
    if (!write_json(&motion, cases, orders)) {
        fprintf(stderr, "ablation: cannot write build/bench/ablation.json\n");
        return 1;
    }
    return 0;
}
