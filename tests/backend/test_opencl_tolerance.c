/* test_opencl_tolerance.c - scenarios on a device that does not divide as C does, against the same ones without it: within the
   tolerance that docs/opencl.md states. Skipped where the first device has the scalar bits, or there is none (make rusticl). */
#include "springls_under_test.h"
#include "scenarios.h"

static springls_backend *test_inexact;

/* Runs a scenario and measures its end. backend NULL: scalar. */
FIXTURE springls_status tolerance_measure(int which, springls_backend *backend, springls_measures *measures)
{
    springls_context *ctx;
    springls_status status = SPRINGLS_OK;
    scenario s;
    int i;
    scenario_make(&s, which);
    ctx = scenario_context(&s, backend);
    if (!ctx) return SPRINGLS_OUT_OF_MEMORY;
    for (i = 0; i < s.steps && status == SPRINGLS_OK; i++) status = scenario_step(ctx, &s);
    if (status == SPRINGLS_OK) status = springls_measure(ctx, measures);
    if (status != SPRINGLS_OK) fprintf(stderr, "%s: %s\n", scenario_name(which), springls_last_error(ctx));
    springls_destroy(ctx);
    return status;
}

/* Stages one by one, among them those that no step has. */
TEST ends_within_tolerance(int which)
{
    const double volume = 5e-4, area = 5e-3; /* parts of the whole */
    springls_measures scalar, device;
    if (!test_inexact) SKIPm("there is no OpenCL device here that rounds in another way than C");
    ASSERT_OK(tolerance_measure(which, NULL, &scalar));
    ASSERT_OK(tolerance_measure(which, test_inexact, &device));
    printf("%s: volume %.3f, scalar %.3f; area %.3f, scalar %.3f; components %d, scalar %d\n", scenario_name(which), device.volume,
           scalar.volume, device.area, scalar.area, device.components, scalar.components);
    ASSERT_IN_RANGE(scalar.volume, device.volume, volume * scalar.volume);
    ASSERT_IN_RANGE(scalar.area, device.area, area * scalar.area);
    ASSERT_EQ(scalar.components, device.components);
    PASS();
}

GREATEST_MAIN_DEFS();

int main(int argc, char **argv)
{
    static const int which[] = { SCENARIO_STAGES, SCENARIO_BOX, SCENARIO_ELASTIC };
    springls_cl_desc desc = fixture_device_desc();
    size_t i;
    GREATEST_MAIN_BEGIN();
    if (springls_cl_create(&desc, &test_inexact) == SPRINGLS_OK && springls_cl_exact(test_inexact)) {
        springls_cl_destroy(test_inexact);
        test_inexact = NULL;
    }
    for (i = 0; i < sizeof which / sizeof *which; i++) {
        greatest_set_test_suffix(scenario_name(which[i]));
        RUN_TESTp(ends_within_tolerance, which[i]);
    }
    springls_cl_destroy(test_inexact);
    GREATEST_MAIN_END();
}
