/* fusion_correction.c - what votes get wrong, learned from the subjects.
 *
 * The probability that a voxel is inside is a linear function of features of the votes and the image, and of HIDDEN random
 * combinations of them bent by x / (1 + |x|): random features and ridge regression (Huang et al. 2006, "Extreme learning
 * machine"). Its normal equations are a sum over subjects. Only voxels about which the votes are not sure take part. */
#include "atlas/fusion.h"

#include "base/threads.h"
#include "registration/vgrid.h"

#include <lapacke.h>

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

enum { NEAR = 26, FAR = 12, BESIDE = 6, FEATURES = 8 + NEAR + FAR + BESIDE + 3, HIDDEN = 900, TERMS = 1 + FEATURES + HIDDEN };
enum { EVERY = 3 }; /* of the voxels that take part, one in three is learned from */

const int fusion_terms = TERMS;

static const float unsure = 0.02f;        /* votes from here to 1 - here take part */
static const float hidden_scale = 1.5f;
static const double ridge = 1.0;

/* ---- features ---- */

enum { SOFT_1, SOFT_2, IMAGE_SOFT, IMAGE_1, IMAGE_2, MAPS };

struct maps {
    const struct fusion_votes *votes;
    const int *dims;
    float *map[MAPS]; /* Gaussian of `voted` by 1 and 2 voxels; of the image by 0.7, 1 and 2 */
};

static bool maps_create(const struct fusion_template *template, const struct fusion_votes *votes, struct maps *maps)
{
    static const float sigma[MAPS] = {1.0f, 2.0f, 0.7f, 1.0f, 2.0f};
    const size_t voxels = volume_voxels(&template->image);
    float *all = malloc((MAPS + 1) * voxels * sizeof *all);
    bool good = all != NULL;
    maps->votes = votes;
    maps->dims = template->image.dims;
    maps->map[0] = all;
    for (size_t m = 0; good && m < MAPS; ++m) {
        maps->map[m] = all + m * voxels;
        memcpy(maps->map[m], m <= SOFT_2 ? votes->voted : votes->target, voxels * sizeof *all);
        good = vgrid_smooth(maps->dims, 1, sigma[m], maps->map[m], all + MAPS * voxels);
    }
    return good;
}

static float half_logit(float p)
{
    p = fmaxf(0.02f, fminf(0.98f, p));
    return 0.5f * logf(p / (1.0f - p));
}

/* Returns the voxel `offset` from `place`, or the nearest one of the grid. */
static size_t neighbor(const int dims[3], const int place[3], int x, int y, int z)
{
    const int at[3] = {place[0] + x, place[1] + y, place[2] + z};
    size_t n = 0;
    for (int a = 2; a >= 0; --a) {
        n = n * (size_t)dims[a] + (size_t)(at[a] < 0 ? 0 : at[a] >= dims[a] ? dims[a] - 1 : at[a]);
    }
    return n;
}

static void take_features(const struct maps *maps, size_t n, float *features)
{
    static const int reach[4] = {-3, -2, 2, 3};
    const struct fusion_votes *votes = maps->votes;
    const int *dims = maps->dims;
    float *f = features;
    int place[3];
    volume_place(dims, n, place);
    *f++ = half_logit(votes->mean[n]);
    *f++ = half_logit(votes->voted[n]);
    *f++ = half_logit(maps->map[SOFT_1][n]);
    *f++ = half_logit(maps->map[SOFT_2][n]);
    *f++ = votes->target[n];
    *f++ = maps->map[IMAGE_1][n];
    *f++ = maps->map[IMAGE_2][n];
    *f++ = votes->expected[n];
    for (int o = 0; o < NEAR + 1; ++o) {
        if (o != NEAR / 2) {
            *f++ = votes->target[neighbor(dims, place, o % 3 - 1, o / 3 % 3 - 1, o / 9 - 1)];
        }
    }
    for (int axis = 0; axis < 3; ++axis) {
        for (int r = 0; r < 4; ++r) {
            const size_t at = neighbor(dims, place, axis == 0 ? reach[r] : 0, axis == 1 ? reach[r] : 0, axis == 2 ? reach[r] : 0);
            *f++ = maps->map[IMAGE_SOFT][at];
            if (r == 1 || r == 2) {
                *f++ = half_logit(votes->voted[at]);
            }
        }
        *f++ = 3.46f * ((float)place[axis] / (float)(dims[axis] > 1 ? dims[axis] - 1 : 1) - 0.5f); /* deviation 1 */
    }
}

/* Makes the random combinations: uniform numbers of deviation hidden_scale / sqrt(FEATURES), the same for all atlases. All
 * combinations' weights of one feature lie together. */
static void make_hidden(float *weights)
{
    uint64_t state = 1;
    const float gain = hidden_scale * sqrtf(12.0f / (float)FEATURES);
    for (int i = 0; i < HIDDEN * (FEATURES + 1); ++i) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        weights[i] = gain * ((float)(state >> 40) / 16777216.0f - 0.5f);
    }
}

/* Computes the terms of the regression: 1, the features, their bent random combinations. */
static void take_terms(const struct maps *maps, const float *hidden, size_t n, float *terms)
{
    float *sums = terms + 1 + FEATURES;
    terms[0] = 1.0f;
    take_features(maps, n, terms + 1);
    memset(sums, 0, HIDDEN * sizeof *sums);
    for (int i = 0; i <= FEATURES; ++i) {
        const float *weights = hidden + (size_t)i * HIDDEN, term = terms[i];
        for (int h = 0; h < HIDDEN; ++h) {
            sums[h] += weights[h] * term;
        }
    }
    for (int h = 0; h < HIDDEN; ++h) {
        sums[h] /= 1.0f + fabsf(sums[h]);
    }
}

static bool is_unsure(float voted) { return voted > unsure && voted < 1.0f - unsure; }

/* ---- regression ---- */

/* The normal equations: matrix (TERMS x TERMS, its lower half) and right side. */
struct equations {
    float *hidden;
    double *matrix, *right;
};

static void equations_free(struct equations *equations)
{
    free(equations->hidden);
    free(equations->matrix);
    free(equations->right);
}

static bool equations_create(struct equations *equations)
{
    equations->hidden = malloc(HIDDEN * (FEATURES + 1) * sizeof *equations->hidden);
    equations->matrix = calloc((size_t)TERMS * TERMS, sizeof *equations->matrix);
    equations->right = calloc(TERMS, sizeof *equations->right);
    if (!equations->hidden || !equations->matrix || !equations->right) {
        return false;
    }
    make_hidden(equations->hidden);
    for (size_t i = 0; i < TERMS; ++i) {
        equations->matrix[i * TERMS + i] = ridge;
    }
    return true;
}

enum { BATCH = 64, TOGETHER = 4 };

struct batch_loop {
    struct equations *equations;
    const float *terms;
    const float *truth;
    int count;
};

static void run_batch_loop(void *arg, int begin, int end)
{
    const struct batch_loop *loop = arg;
    struct equations *equations = loop->equations;
    const float *terms = loop->terms;
    const float *truth = loop->truth;
    const int count = loop->count;
    for (int i = begin; i < end; ++i) {
        float row[TERMS] = {0.0f}, right = 0.0f;
        for (int b = 0; b < BATCH; b += TOGETHER) {
            const float *t = terms + (size_t)b * TERMS, *u = t + TERMS, *v = u + TERMS, *w = v + TERMS;
            const float ti = t[i], ui = u[i], vi = v[i], wi = w[i];
            for (int j = 0; j <= i; ++j) {
                row[j] += ti * t[j] + ui * u[j] + vi * v[j] + wi * w[j];
            }
        }
        for (int b = 0; b < count; ++b) {
            right += terms[(size_t)b * TERMS + (size_t)i] * truth[b];
        }
        for (int j = 0; j <= i; ++j) {
            equations->matrix[(size_t)i * TERMS + (size_t)j] += (double)row[j];
        }
        equations->right[i] += (double)right;
    }
}

/* Adds BATCH voxels; those beyond `count` have terms of zero. Single precision within a batch, double between them. */
static void add_batch(struct equations *equations, float *terms, const float *truth, int count)
{
    memset(terms + (size_t)count * TERMS, 0, (size_t)(BATCH - count) * TERMS * sizeof *terms);
    struct batch_loop loop = {equations, terms, truth, count};
    threads_for(TERMS, 8, run_batch_loop, &loop);
}

static bool add_subject(const struct fusion_template *template, int s, const struct fusion_votes *votes,
                        struct equations *equations)
{
    const size_t voxels = volume_voxels(&template->image);
    const float *mask = template->masks + (size_t)s * voxels;
    struct maps maps;
    float *terms = malloc((size_t)BATCH * TERMS * sizeof *terms), truth[BATCH];
    const bool good = maps_create(template, votes, &maps) && terms;
    int count = 0, seen = 0;
    for (size_t n = 0; good && n < voxels; ++n) {
        if (is_unsure(votes->voted[n]) && seen++ % EVERY == 0) {
            take_terms(&maps, equations->hidden, n, terms + (size_t)count * TERMS);
            truth[count++] = mask[n];
            if (count == BATCH) {
                add_batch(equations, terms, truth, count);
                count = 0;
            }
        }
    }
    if (good) {
        add_batch(equations, terms, truth, count);
    }
    free(maps.map[0]);
    free(terms);
    return good;
}

static bool solve(struct equations *equations, float **correction)
{
    *correction = malloc(TERMS * sizeof **correction);
    if (!*correction || LAPACKE_dposv(LAPACK_ROW_MAJOR, 'L', TERMS, 1, equations->matrix, TERMS, equations->right, 1) != 0) {
        return false;
    }
    for (int i = 0; i < TERMS; ++i) {
        (*correction)[i] = (float)equations->right[i];
    }
    return true;
}

struct correct_loop {
    const struct fusion_template *template;
    const struct fusion_votes *votes;
    float *probability;
    const struct maps *maps;
    const float *hidden;
};

static void run_correct_loop(void *arg, int begin, int end)
{
    const struct correct_loop *loop = arg;
    const struct fusion_template *template = loop->template;
    const struct fusion_votes *votes = loop->votes;
    float *probability = loop->probability;
    const struct maps *maps = loop->maps;
    const float *hidden = loop->hidden;
    for (size_t n = (size_t)begin; n < (size_t)end; ++n) {
        probability[n] = votes->voted[n];
        if (is_unsure(votes->voted[n])) {
            float terms[TERMS];
            double sum = 0.0;
            take_terms(maps, hidden, n, terms);
            for (int i = 0; i < TERMS; ++i) {
                sum += (double)template->correction[i] * (double)terms[i];
            }
            probability[n] = (float)fmax(0.0, fmin(1.0, sum));
        }
    }
}

bool fusion_correct(const struct fusion_template *template, const struct fusion_votes *votes, float *probability)
{
    const size_t voxels = volume_voxels(&template->image);
    if (!template->correction) {
        memcpy(probability, votes->voted, voxels * sizeof *probability);
        return true;
    }
    struct maps maps;
    float *hidden = malloc(HIDDEN * (FEATURES + 1) * sizeof *hidden);
    const bool good = maps_create(template, votes, &maps) && hidden;
    if (good) {
        make_hidden(hidden);
    }
    struct correct_loop loop = {template, votes, probability, &maps, hidden};
    threads_for((int)(good ? voxels : 0), 1024, run_correct_loop, &loop);
    free(maps.map[0]);
    free(hidden);
    return good;
}

/* ---- level ---- */

enum { CLASSES = 100 };

/* Finds the level above which there are as many voxels in all subjects together as are inside. above[c]: voxels of
 * probability c / CLASSES or more. */
static float level_of(const double above[CLASSES + 1], double inside)
{
    for (int c = CLASSES; c > 0; --c) {
        if (above[c - 1] >= inside) {
            const double t = (inside - above[c]) / fmax(1e-9, above[c - 1] - above[c]);
            return ((float)c - (float)fmax(0.0, fmin(1.0, t))) / CLASSES;
        }
    }
    return 0.5f;
}

/* Counts between the voxels, at the middle of every eight: an image's places lie anywhere between them, and interpolation there
 * takes volume from what is convex. */
static void count_levels(const int dims[3], const float *probability, const float *mask, double above[CLASSES + 1], double *inside)
{
    const size_t up[3] = {1, (size_t)dims[0], (size_t)dims[0] * (size_t)dims[1]}, voxels = vgrid_voxels(dims);
    for (size_t n = 0; n < voxels; ++n) {
        int at[3];
        float sum = 0.0f;
        volume_place(dims, n, at);
        *inside += (double)mask[n];
        for (int corner = 0; corner < 8; ++corner) {
            size_t to = n;
            for (int a = 0; a < 3; ++a) {
                to += corner >> a & 1 && at[a] + 1 < dims[a] ? up[a] : 0;
            }
            sum += 0.125f * probability[to];
        }
        for (int c = 0; c <= (int)(sum * CLASSES); ++c) {
            above[c] += 1.0;
        }
    }
}

/* Votes on each of the subjects with include[s] by the others. */
static bool vote_on_each(const struct fusion_template *template, const bool *include, struct fusion_votes *votes, int *subjects)
{
    const size_t voxels = volume_voxels(&template->image);
    bool *others = malloc((size_t)template->count * sizeof *others), good = others != NULL;
    *subjects = 0;
    for (int s = 0; good && s < template->count; ++s) {
        if (include[s]) {
            memcpy(others, include, (size_t)template->count * sizeof *others);
            others[s] = false;
            good = fusion_vote(template, template->images + (size_t)s * voxels, others, false, &votes[s]);
            ++*subjects;
        }
    }
    free(others);
    return good;
}

static bool learn_correction(struct fusion_template *template, const struct fusion_votes *votes)
{
    struct equations equations = {NULL, NULL, NULL};
    bool good = equations_create(&equations);
    for (int s = 0; good && s < template->count; ++s) {
        good = !votes[s].mean || add_subject(template, s, &votes[s], &equations);
    }
    good = good && solve(&equations, &template->correction);
    template->corrected = good;
    equations_free(&equations);
    return good;
}

static bool learn_level(struct fusion_template *template, const struct fusion_votes *votes)
{
    const size_t voxels = volume_voxels(&template->image);
    float *probability = malloc(voxels * sizeof *probability);
    double above[CLASSES + 1] = {0.0}, inside = 0.0;
    bool good = probability != NULL;
    for (int s = 0; good && s < template->count; ++s) {
        if (votes[s].mean) {
            good = fusion_correct(template, &votes[s], probability);
            count_levels(template->image.dims, probability, template->masks + (size_t)s * voxels, above, &inside);
        }
    }
    template->level = fmaxf(0.3f, fminf(0.7f, level_of(above, inside)));
    free(probability);
    return good;
}

bool fusion_learn(struct fusion_template *template, const bool *include)
{
    struct fusion_votes *votes = calloc((size_t)template->count, sizeof *votes);
    int subjects = 0;
    free(template->correction);
    template->correction = NULL;
    template->corrected = false;
    const bool good = votes && vote_on_each(template, include, votes, &subjects)
                   && (subjects < FUSION_MIN_LEARNED || learn_correction(template, votes)) && learn_level(template, votes);
    for (int s = 0; votes && s < template->count; ++s) {
        fusion_votes_free(&votes[s]);
    }
    free(votes);
    return good;
}
