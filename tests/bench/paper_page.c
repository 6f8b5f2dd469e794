/* paper_page.c - fixed text and sections become a page. */
#include "paper_page.h"

#include "springls.h"

#include "examples/common/springls/exact_flows.h"
#include "examples/common/springls/run_options.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* Returns the state of LeVeque's ball on 64^3 after the flow of period 1.25, in steps of `limit` voxels at most (0: as they are);
   0 after a failure. */
static uint64_t small_run(const springls_params *params, int steps, float limit)
{
    enum { GRID = 64 };
    springls_desc desc = springls_default_desc();
    springls_forces forces = springls_default_forces();
    springls_step_desc step = springls_default_step_desc();
    springls_sphere ball = {{0.35f * GRID, 0.35f * GRID, 0.35f * GRID}, 0.15f * GRID};
    struct exact_flow flow = EXACT_DEFORMATION(GRID, 1.25f);
    springls_context *ctx;
    uint64_t hash = 0;
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = GRID;
    desc.params = params;
    forces.velocity = exact_flow_velocity;
    forces.user = &flow;
    step.forces = &forces;
    step.dt = flow.period / (float)steps;
    step.max_displacement = limit;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        return 0;
    }
    if (springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
        && springls_run(ctx, &step, steps) == SPRINGLS_OK) {
        hash = springls_state_hash(ctx);
    }
    springls_destroy(ctx);
    return hash;
}

void paper_stamp(char stamp[PAPER_STAMP])
{
    const springls_params sets[2] = {springls_paper_params(), springls_default_params()};
    const uint64_t states[2] = {small_run(&sets[0], 125, -1.0f), small_run(&sets[1], 24, 2.0f)};
    stamp[0] = '\0';
    if (states[0] != 0 && states[1] != 0) {
        snprintf(stamp, PAPER_STAMP, "paper %08x %016llx, default %08x %016llx", (unsigned)run_params_hash(&sets[0]),
                 (unsigned long long)states[0], (unsigned)run_params_hash(&sets[1]), (unsigned long long)states[1]);
    }
}

void paper_section_begin(FILE *file, const char *part, const char *stamp)
{
    fprintf(file, "<!-- %s: %s -->\n\n", part, stamp);
}

void paper_section_end(FILE *file, const char *part)
{
    fprintf(file, "\n<!-- end of %s -->\n", part);
}

size_t paper_section_find(const char *page, const char *part, const char **section)
{
    char begin[80], end[80];
    snprintf(begin, sizeof begin, "<!-- %s: ", part);
    snprintf(end, sizeof end, "\n<!-- end of %s -->\n", part);
    *section = strstr(page, begin);
    const char *last = *section ? strstr(*section, end) : NULL;
    return last ? (size_t)(last - *section) + strlen(end) : 0;
}

bool paper_section_stamp(const char *section, char stamp[PAPER_STAMP])
{
    const char *from = strstr(section, ": "), *to = from ? strstr(from, " -->") : NULL;
    const size_t length = to ? (size_t)(to - from) - 2 : 0;
    stamp[0] = '\0';
    if (length == 0 || length >= PAPER_STAMP) {
        return false;
    }
    memcpy(stamp, from + 2, length);
    stamp[length] = '\0';
    return true;
}

/* Adds text to a string that is reallocated; false: memory is short. */
static bool add(char **page, const char *text, size_t length)
{
    const size_t used = *page ? strlen(*page) : 0;
    char *larger = realloc(*page, used + length + 1);
    if (!larger) {
        return false;
    }
    memcpy(larger + used, text, length);
    larger[used + length] = '\0';
    *page = larger;
    return true;
}

/* Copies the name of the part that a line stands for; false: it is text. */
static bool is_place(const char *line, char part[40])
{
    int length = 0;
    return sscanf(line, "<!-- part %39[a-z0-9] -->%n", part, &length) == 1 && length > 0 && (line[length] == '\n' || !line[length]);
}

char *paper_page(const char *text, paper_section_fn section_of, void *user)
{
    char *page = NULL;
    bool good = add(&page, "", 0);
    while (good && *text) {
        const size_t length = strcspn(text, "\n") + (text[strcspn(text, "\n")] == '\n');
        char part[40];
        if (is_place(text, part)) {
            char *section = section_of(user, part), missing[120];
            snprintf(missing, sizeof missing, "(Not run yet: `make paper PAPER=%s`.)\n", part);
            good = add(&page, section ? section : missing, strlen(section ? section : missing));
            free(section);
        } else {
            good = add(&page, text, length);
        }
        text += length;
    }
    if (!good) {
        free(page);
        return NULL;
    }
    return page;
}
