#include "imaging/resample.h"

#include "base/threads.h"

void resample_map(const struct volume *to, const double world[3][4], const struct volume *from, float map[3][4])
{
    const float corners[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}};
    float place[4][3], there[3];
    for (int c = 0; c < 4; ++c) {
        volume_index_to_world(to, corners[c], there);
        if (world) {
            volume_apply(world, there, there);
        }
        volume_world_to_index(from, there, place[c]);
    }
    for (int r = 0; r < 3; ++r) {
        map[r][3] = place[3][r];
        for (int c = 0; c < 3; ++c) {
            map[r][c] = place[c][r] - place[3][r];
        }
    }
}

struct resample_loop {
    const struct volume *from;
    const float *values;
    const struct volume *to;
    float *result;
    unsigned char *valid;
    const float (*map)[4];
};

static void run_resample_loop(void *arg, int begin, int end)
{
    const struct resample_loop *loop = arg;
    const struct volume *from = loop->from;
    const float *values = loop->values;
    const struct volume *to = loop->to;
    float *result = loop->result;
    unsigned char *valid = loop->valid;
    const float (*map)[4] = loop->map;
    for (int k = begin; k < end; ++k) {
        size_t n = (size_t)k * (size_t)to->dims[0] * (size_t)to->dims[1];
        for (int j = 0; j < to->dims[1]; ++j) {
            for (int i = 0; i < to->dims[0]; ++i, ++n) {
                float x[3];
                resample_place(map, i, j, k, x);
                result[n] = resample_at(from->dims, values, x);
                if (valid) {
                    valid[n] = resample_in_box(from->dims, x);
                }
            }
        }
    }
}

void resample_volume(const struct volume *from, const float *values, const double world[3][4], const struct volume *to, float *result,
                     unsigned char *valid)
{
    float map[3][4];
    resample_map(to, world, from, map);
    struct resample_loop loop = {from, values, to, result, valid, (const float(*)[4])map};
    threads_for(to->dims[2], 1, run_resample_loop, &loop);
}
