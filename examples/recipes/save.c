/* save.c - a model in a file: a copy that was loaded goes on with the same bits. */
#include "springls.h"
#include <stdio.h>
#include <stdlib.h>

static void ok(springls_context *model, springls_status status)
{
    if (status != SPRINGLS_OK) puts(springls_last_error(model)), exit(1);
}

static void save(springls_context *model, const char *path)
{
    size_t size;
    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, NULL, 0, &size));
    void *block = malloc(size);
    if (!block) exit(1);
    ok(model, springls_snapshot(model, SPRINGLS_SNAPSHOT_KIND_ALL, block, size, &size));
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(block, 1, size, file) != size || fclose(file) != 0) perror(path), exit(1);
    free(block);
}

static void load(springls_context *model, const char *path)
{
    FILE *file = fopen(path, "rb");
    if (!file || fseek(file, 0, SEEK_END) != 0) perror(path), exit(1);
    long size = ftell(file);
    void *block = size > 0 ? malloc((size_t)size) : NULL;
    rewind(file);
    if (!block || fread(block, 1, (size_t)size, file) != (size_t)size) perror(path), exit(1);
    fclose(file);
    ok(model, springls_restore(model, block, (size_t)size)); /* refuses a file that is cut short or damaged */
    free(block);
}

int main(void)
{
    springls_desc desc = springls_default_desc();
    springls_step_desc still = {0};
    springls_box box = {{16, 16, 16}, {8, 6, 4}};
    springls_context *model, *copy;

    desc.grid.size[0] = desc.grid.size[1] = desc.grid.size[2] = 32; /* grid and follow are not in the file: both have the same */
    if (springls_create(&desc, &model) != SPRINGLS_OK || springls_create(&desc, &copy) != SPRINGLS_OK) return 1;
    ok(model, springls_set_implicit(model, springls_implicit_box, &box));
    ok(model, springls_run(model, &still, 3));
    save(model, "box.springls");
    load(copy, "box.springls");
    ok(model, springls_run(model, &still, 3));
    ok(copy, springls_run(copy, &still, 3));
    puts(springls_state_hash(model) == springls_state_hash(copy) ? "the copy has the same bits" : "the copy differs");
    springls_destroy(copy);
    springls_destroy(model);
    return remove("box.springls");
}
