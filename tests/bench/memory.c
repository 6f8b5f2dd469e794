/* memory GRID RADIUS - what a model of GRID^3 voxels that holds a sphere of RADIUS voxels keeps in memory, and how long it
 * takes to set up. One JSON object on stdout. */
#include "springls.h"

#include "examples/common/base/json.h"
#include "examples/common/base/progress.h"

#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv)
{
    const int grid = argc == 3 ? atoi(argv[1]) : 0;
    const float radius = argc == 3 ? (float)atof(argv[2]) : 0.0f, middle = 0.5f * (float)grid;
    springls_sphere sphere = {{middle, middle, middle}, radius};
    springls_context *ctx;
    springls_desc desc;
    struct json_writer json;
    if (grid < 8 || !(radius > 2.0f)) {
        fprintf(stderr, "usage: memory GRID RADIUS\n");
        return 2;
    }
    memset(&desc, 0, sizeof desc);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = grid;
    const double start = elapsed_seconds();
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) {
        fprintf(stderr, "memory: cannot create a model of %d^3\n", grid);
        return 1;
    }
    const size_t empty = springls_memory_used(ctx);
    if (springls_set_implicit(ctx, springls_implicit_sphere, &sphere) != SPRINGLS_OK) {
        fprintf(stderr, "memory: %s\n", springls_last_error(ctx));
        return 1;
    }
    const double seconds = elapsed_seconds() - start;
    json_open_stream(&json, stdout);
    json_object_begin(&json, NULL);
    json_integer(&json, "grid", grid);
    json_number(&json, "radius", (double)radius);
    json_integer(&json, "springls", springls_count(ctx));
    json_integer(&json, "bricks", springls_get_stats(ctx).bricks);
    json_number(&json, "empty_mib", (double)empty / 1048576.0);
    json_number(&json, "model_mib", (double)springls_memory_used(ctx) / 1048576.0);
    json_number(&json, "peak_rss_mib", peak_rss_mib());
    json_number(&json, "seconds_total", seconds);
    springls_destroy(ctx);
    return json_close(&json) ? 0 : 1;
}
