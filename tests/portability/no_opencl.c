/* A program with the OpenCL backend on a machine without OpenCL: one warning, and scalar code does the work. */
#define SPRINGLS_IMPLEMENTATION
#include "springls_cl.h"

static int warnings;

static void count(void *user, int level, const char *message)
{
    (void)user;
    warnings += level == 2 && strstr(message, "no-such-library") != NULL ? 1 : 100;
}

int main(void)
{
    springls_cl_desc cl;
    springls_desc desc;
    springls_sphere ball = { { 8.0f, 8.0f, 8.0f }, 5.0f };
    springls_backend *backend = (springls_backend *)(void *)&cl;
    springls_context *ctx;
    springls_status status;
    bool moved;
    memset(&cl, 0, sizeof cl);
    memset(&desc, 0, sizeof desc);
    cl.library = "no-such-library";
    cl.logger.log = count;
    status = springls_cl_create(&cl, &backend);
    if (status != SPRINGLS_DEVICE_FAILED || backend || warnings != 1) return 1;
    if (springls_cl_name(backend)[0] || springls_cl_exact(backend) || springls_cl_get_counts(backend).kernels) return 2;
    springls_cl_destroy(backend);
    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 17;
    desc.backend = backend;
    if (springls_create(&desc, &ctx) != SPRINGLS_OK) return 3;
    moved = springls_set_implicit(ctx, springls_implicit_sphere, &ball) == SPRINGLS_OK
         && springls_run_stage(ctx, SPRINGLS_STAGE_RELAX) == SPRINGLS_OK && springls_count(ctx) > 0;
    springls_destroy(ctx);
    return moved && warnings == 1 ? 0 : 4;
}
