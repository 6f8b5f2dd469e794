#include "imaging/parts.h"

#include <stdlib.h>
#include <string.h>

/* Returns the number of runs in a row; with `runs`, also stores them. */
static int row_runs(const float *values, int width, int first, bool below, struct parts_run *runs)
{
    int count = 0;
    bool before = false;
    for (int i = 0; i < width; ++i) {
        const bool member = (values[first + i] < 0.0f) == below;
        if (member && !before) {
            if (runs) {
                runs[count] = (struct parts_run){.first = first + i};
            }
            ++count;
        }
        if (member && runs) {
            runs[count - 1].count++;
        }
        before = member;
    }
    return count;
}

/* Returns the root of a run, and halves the way to it. */
static int root_of(struct parts_run *runs, int r)
{
    while (runs[r].root != r) {
        runs[r].root = runs[runs[r].root].root;
        r = runs[r].root;
    }
    return r;
}

static void join(struct parts_run *runs, int a, int b)
{
    const int left = root_of(runs, a), right = root_of(runs, b);
    runs[left > right ? left : right].root = left < right ? left : right;
}

/* Joins the runs of a row with those of an earlier one that touch them; `step` voxels lie between the rows. */
static void join_rows(struct parts_run *runs, const int row[2], const int earlier[2], int step)
{
    int a = earlier[0], b = row[0];
    while (a < earlier[1] && b < row[1]) {
        const int a_end = runs[a].first + step + runs[a].count, b_end = runs[b].first + runs[b].count;
        if (runs[a].first + step < b_end && runs[b].first < a_end) {
            join(runs, a, b);
        }
        if (a_end < b_end) {
            ++a;
        } else {
            ++b;
        }
    }
}

/* Makes every run's root the part's own, and counts its voxels. */
static void settle(struct parts *parts)
{
    for (int r = 0; r < parts->count; ++r) {
        parts->runs[r].root = root_of(parts->runs, r);
        parts->runs[parts->runs[r].root].voxels += parts->runs[r].count;
    }
}

bool parts_find(const int dims[3], const float *values, bool below, struct parts *parts)
{
    const int rows = dims[1] * dims[2];
    int *starts = malloc(((size_t)rows + 1) * sizeof *starts); /* of each row's runs */
    memset(parts, 0, sizeof *parts);
    for (int row = 0; starts && row < rows; ++row) {
        starts[row] = parts->count;
        parts->count += row_runs(values, dims[0], row * dims[0], below, NULL);
    }
    parts->runs = starts ? malloc(((size_t)parts->count + 1) * sizeof *parts->runs) : NULL;
    const bool good = parts->runs != NULL;
    if (good) {
        starts[rows] = parts->count;
    }
    for (int row = 0; good && row < rows; ++row) {
        row_runs(values, dims[0], row * dims[0], below, parts->runs + starts[row]);
        for (int r = starts[row]; r < starts[row + 1]; ++r) {
            parts->runs[r].root = r;
        }
        if (row % dims[1] > 0) {
            join_rows(parts->runs, starts + row, starts + row - 1, dims[0]);
        }
        if (row >= dims[1]) {
            join_rows(parts->runs, starts + row, starts + row - dims[1], dims[0] * dims[1]);
        }
    }
    free(starts);
    if (good) {
        settle(parts);
    }
    return good;
}

void parts_free(struct parts *parts)
{
    free(parts->runs);
    memset(parts, 0, sizeof *parts);
}

int parts_largest(const struct parts *parts)
{
    int best = -1;
    for (int r = 0; r < parts->count; ++r) {
        best = parts->runs[r].voxels > (best < 0 ? 0 : parts->runs[best].voxels) ? r : best;
    }
    return best;
}
