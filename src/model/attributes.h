/* attributes.h - what springls carry besides themselves. The springls change as they would without; at the end of a stage that
   has added or removed some, the values follow, here on the host: rows are known by `parent` (kernels_embed/model.h), by the
   fate that contract has given (SCRATCH1), and by the springls around, among which BLEND interpolates in material space: as a
   function of the correspondence, on the same side of the surface. All that can fail is done before anything changes. */

SPRINGLS__FN float *springls__attribute_row(const springls__attribute *attribute, int i)
{
    return (float *)attribute->values.data + (size_t)i * (size_t)attribute->channels;
}

SPRINGLS__FN void springls__row_copy(const springls__attribute *attribute, int to, int from)
{
    size_t bytes = (size_t)attribute->channels * sizeof(float);
    if (to != from) memcpy(springls__attribute_row(attribute, to), springls__attribute_row(attribute, from), bytes);
}

SPRINGLS__FN springls_status springls__rows_reserve(springls_context *ctx, springls__attribute *attribute, int rows, int keep)
{
    size_t row = (size_t)attribute->channels * sizeof(float);
    return springls__buffer_grow(ctx, &attribute->values, (size_t)springls__imax(rows, 1), row, (size_t)keep * row);
}

SPRINGLS__FN springls_status springls__attribute_work(springls_context *ctx, int which, size_t count, size_t element)
{
    return springls__buffer_grow(ctx, &ctx->attribute_memory[which], count ? count : 1, element, 0);
}

/* ---- the springls around a place, and their weights ---- */

enum { SPRINGLS__MAX_SOURCES = 24 };

/* index[0] has the nearest correspondence. */
typedef struct springls__interpolation_sources {
    int index[SPRINGLS__MAX_SOURCES], count;
    float d2[SPRINGLS__MAX_SOURCES], weight[SPRINGLS__MAX_SOURCES]; /* squared distance of correspondences */
} springls__interpolation_sources;

typedef struct springls__interpolation_search {
    const springls_context *ctx;   /* its springl_surface holds the springls that are asked */
    const springls__v3 *a;         /* and this their correspondences                        */
    int known;                     /* how many have values                                  */
} springls__interpolation_search;

SPRINGLS__FN void springls__interpolation_sources_add(springls__interpolation_sources *donors, int index, float d2)
{
    int i, last = donors->count - 1;
    if (donors->count == SPRINGLS__MAX_SOURCES
        && (donors->d2[last] < d2 || (donors->d2[last] == d2 && donors->index[last] < index))) return;
    i = donors->count < SPRINGLS__MAX_SOURCES ? donors->count++ : last;
    for (; i > 0 && (donors->d2[i - 1] > d2 || (donors->d2[i - 1] == d2 && donors->index[i - 1] > index)); i--) {
        donors->d2[i] = donors->d2[i - 1];
        donors->index[i] = donors->index[i - 1];
    }
    donors->d2[i] = d2;
    donors->index[i] = index;
}

/* Solves the symmetric positive 3x3 system m x = b. */
SPRINGLS__FN void springls__solve3(double m[3][3], const double b[3], double x[3])
{
    double det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
               + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    int k;
    for (k = 0; k < 3; k++) {
        int u = (k + 1) % 3, v = (k + 2) % 3;
        double c[3];
        c[0] = m[u][1] * m[v][2] - m[u][2] * m[v][1];
        c[1] = m[u][2] * m[v][0] - m[u][0] * m[v][2];
        c[2] = m[u][0] * m[v][1] - m[u][1] * m[v][0];
        x[k] = (c[0] * b[0] + c[1] * b[1] + c[2] * b[2]) / det;
    }
}

/* Sums over the donors, each with its weight: what is needed to fit a plane about the correspondence a. */
typedef struct springls__plane { double weight, mean[3], slope[3]; } springls__plane;

SPRINGLS__FN springls__plane springls__interpolation_plane(const springls__interpolation_sources *donors, double r[SPRINGLS__MAX_SOURCES][3])
{
    const double ridge = 1e-4; /* across the original surface, where the donors have no extent */
    springls__plane plane;
    double m[3][3], trace;
    int i, j, k;
    memset(&plane, 0, sizeof plane);
    memset(m, 0, sizeof m);
    for (i = 0; i < donors->count; i++) {
        plane.weight += (double)donors->weight[i];
        for (k = 0; k < 3; k++) plane.mean[k] += (double)donors->weight[i] * r[i][k];
    }
    for (k = 0; k < 3; k++) plane.mean[k] /= plane.weight;
    for (i = 0; i < donors->count; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) m[j][k] += (double)donors->weight[i] * (r[i][j] - plane.mean[j]) * (r[i][k] - plane.mean[k]);
    trace = m[0][0] + m[1][1] + m[2][2];
    for (k = 0; k < 3; k++) m[k][k] += ridge * trace + 1e-12 * plane.weight;
    springls__solve3(m, plane.mean, plane.slope);
    return plane;
}

/* Moving least squares of degree 1 about the correspondence a: the sum of weight[j] v(a_j) is what the fitted plane says at a,
   exact for linear functions. Donors that would get a negative weight are left out, the worst first, and the plane is fitted
   again; where that does not end, beyond the rim of the donors, the slope is reduced instead. So the result is a mean of
   values, and stays within their range. */
SPRINGLS__FN void springls__interpolation_weigh(springls__interpolation_sources *donors, const springls__v3 *places, springls__v3 a)
{
    double r[SPRINGLS__MAX_SOURCES][3], lean[SPRINGLS__MAX_SOURCES], limit = 1.0, below, lowest = 0.0;
    float range2 = 1.1f * donors->d2[donors->count - 1] + 1e-6f;
    springls__plane plane;
    int i, k, left = donors->count, worst;
    for (i = 0; i < donors->count; i++) {
        float t = donors->d2[i] / range2;
        springls__v3 d = springls__sub(places[donors->index[i]], a);
        donors->weight[i] = (1.0f - t) * (1.0f - t) / (t + 0.02f);
        r[i][0] = (double)d.x; r[i][1] = (double)d.y; r[i][2] = (double)d.z;
    }
    do {
        plane = springls__interpolation_plane(donors, r);
        worst = -1;
        for (i = 0; i < donors->count; i++) {
            lean[i] = 0.0;
            for (k = 0; k < 3; k++) lean[i] += plane.weight * (r[i][k] - plane.mean[k]) * plane.slope[k];
            if (donors->weight[i] == 0.0f || lean[i] <= 1.0) continue;
            below = (double)donors->weight[i] * (lean[i] - 1.0);
            if (worst >= 0 && below <= lowest) continue;
            lowest = below;
            worst = i;
        }
        if (worst >= 0 && left > 3) donors->weight[worst] = 0.0f;
    } while (worst >= 0 && left-- > 3);
    for (i = 0; i < donors->count; i++)
        if (donors->weight[i] > 0.0f && lean[i] * limit > 1.0) limit = 1.0 / lean[i];
    for (i = 0; i < donors->count; i++) donors->weight[i] *= (float)((1.0 - limit * lean[i]) / plane.weight);
}

/* The springls around x that face the way of n (both in model coordinates) with the correspondences nearest to a. Where there
   are none on this side, the nearest of all. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_at(const springls__interpolation_search *search, springls__v3 x, springls__v3 n,
                                                  springls__v3 a, float reach)
{
    const springls__surface *surface = &search->ctx->springl_surface;
    const float alike = 0.3f, stretch = search->ctx->largest_spacing / search->ctx->smallest_spacing;
    springls__interpolation_sources donors;
    float radius = 2.5f * springls__max(1.0f, reach), further2;
    int attempt, j;
    donors.count = 0;
    for (attempt = 0; attempt < 4 && donors.count < 3; attempt++, radius *= 2.0f) {
        springls__near_walk walk = springls__near_walk_begin(surface, x, radius * stretch);
        donors.count = 0;
        while ((j = springls__near_walk_next(&walk)) >= 0) {
            springls__tri t;
            if (j >= search->known) continue;
            t = springls__surface_triangle(surface, j);
            if (springls__dot(springls__tri_normal(t), n) <= alike) continue;
            if (springls__tri_closest(t, x).d2 > radius * radius * stretch * stretch) continue;
            springls__interpolation_sources_add(&donors, j, springls__length2(springls__sub(search->a[j], a)));
        }
    }
    if (donors.count == 0) {
        springls__near_walk walk = springls__near_walk_begin(surface, x, 1e18f);
        float best = FLT_MAX;
        while ((j = springls__near_walk_next(&walk)) >= 0) {
            float d2;
            if (j >= search->known) continue;
            d2 = springls__tri_closest(springls__surface_triangle(surface, j), x).d2;
            if (d2 > best || (d2 == best && donors.count && j > donors.index[0])) continue;
            best = d2;
            donors.index[0] = j;
            donors.count = 1;
        }
        donors.d2[0] = 0.0f;
    }
    radius = 2.5f * springls__max(1.0f, reach);
    further2 = 2.0f * donors.d2[0] + 16.0f * radius * radius; /* met here, but from another part of the original */
    while (donors.count > 1 && donors.d2[donors.count - 1] > further2) donors.count--;
    if (donors.count) springls__interpolation_weigh(&donors, search->a, a);
    return donors;
}

/* donors of a springl that is there now. */
SPRINGLS__FN springls__interpolation_sources springls__interpolation_sources_of_springl(const springls__interpolation_search *search, int i)
{
    const springls_context *ctx = search->ctx;
    springls__springl s = ctx->model.set.s[i];
    springls__tri t;
    t.a = springls__voxel_to_model(ctx, s.q[0]);
    t.b = springls__voxel_to_model(ctx, s.q[1]);
    t.c = springls__voxel_to_model(ctx, s.q[2]);
    return springls__interpolation_sources_at(search, springls__voxel_to_model(ctx, s.p), springls__tri_normal(t), ctx->model.set.a[i], s.bounding_radius);
}

SPRINGLS__FN void springls__interpolate_rows(const springls__attribute *attribute, const springls__interpolation_sources *donors, float *out)
{
    int i, c;
    for (c = 0; c < attribute->channels; c++) out[c] = 0.0f;
    for (i = 0; i < donors->count; i++)
        for (c = 0; c < attribute->channels; c++)
            out[c] += donors->weight[i] * springls__attribute_row(attribute, donors->index[i])[c];
}

/* The values at a place with these neighbours: blended, or of the one with the nearest correspondence; 0 where there is none. */
SPRINGLS__FN void springls__interpolate_value(const springls__attribute *attribute, const springls__interpolation_sources *donors, bool blend,
                                         float *out)
{
    size_t bytes = (size_t)attribute->channels * sizeof *out;
    if (donors->count == 0) memset(out, 0, bytes);
    else if (blend) springls__interpolate_rows(attribute, donors, out);
    else memcpy(out, springls__attribute_row(attribute, donors->index[0]), bytes);
}

/* ---- split ---- */

SPRINGLS__FN int springls__channels_split_by(const springls_context *ctx, springls_policy policy)
{
    int i, channels = 0;
    for (i = 0; i < ctx->attribute_count; i++) channels += ctx->attributes[i].split == policy ? ctx->attributes[i].channels : 0;
    return channels;
}

SPRINGLS__FN springls_status springls__attributes_before_split(springls_context *ctx, int splits)
{
    size_t count = (size_t)ctx->model.set.count, blended = (size_t)springls__channels_split_by(ctx, SPRINGLS_POLICY_BLEND);
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__rows_reserve(ctx, &ctx->attributes[i], ctx->model.set.count + splits, ctx->model.set.count));
    if (!blended) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__OLD_PLACES, count, sizeof(springls__v3)));
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__NEW_VALUES, 2 * (size_t)splits * blended, sizeof(float)));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A), 0));
    SPRINGLS__TRY(springls__model_refresh(ctx));
    memcpy(ctx->attribute_memory[SPRINGLS__OLD_PLACES].data, ctx->model.set.a, count * sizeof(springls__v3));
    return SPRINGLS_OK;
}

/* The springl of an id, among the first `count`: ids ascend. */
SPRINGLS__FN int springls__row_of_id(const springls_context *ctx, uint32_t id, int count)
{
    int low = 0, high = count;
    while (high - low > 1) {
        int middle = low + (high - low) / 2;
        if (ctx->model.set.id[middle] <= id) low = middle;
        else high = middle;
    }
    return low;
}

/* The rows of new springl known + i, and of the springl that it was split from, which is its other half now. */
typedef struct springls__inherit_job {
    springls_context *ctx;
    springls__interpolation_search search;
    int blended; /* channels */
    float *values;
} springls__inherit_job;

SPRINGLS__FN int springls__other_half(const springls__inherit_job *job, int child)
{
    return springls__row_of_id(job->ctx, job->ctx->model.set.parent[child], job->search.known);
}

/* Blended values of both halves, from those that the springls had before. */
SPRINGLS__FN void springls__blend_halves_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    float *out = job->values + 2 * (size_t)begin * (size_t)job->blended;
    int half, i;
    for (; begin < end; begin++)
        for (half = 0; half < 2; half++) {
            int child = job->search.known + begin;
            springls__interpolation_sources donors = springls__interpolation_sources_of_springl(&job->search, half ? child : springls__other_half(job, child));
            for (i = 0; i < job->ctx->attribute_count; i++) {
                const springls__attribute *attribute = &job->ctx->attributes[i];
                if (attribute->split != SPRINGLS_POLICY_BLEND) continue;
                springls__interpolate_value(attribute, &donors, true, out);
                out += attribute->channels;
            }
        }
}

SPRINGLS__FN void springls__split_rows_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    const float *in = job->values + 2 * (size_t)begin * (size_t)job->blended;
    int i, c;
    for (; begin < end; begin++, in += 2 * job->blended) {
        int child = job->search.known + begin, other = springls__other_half(job, child), at = 0;
        for (i = 0; i < job->ctx->attribute_count; i++) {
            const springls__attribute *attribute = &job->ctx->attributes[i];
            float *first = springls__attribute_row(attribute, other), *second = springls__attribute_row(attribute, child);
            for (c = 0; c < attribute->channels; c++) {
                if (attribute->split == SPRINGLS_POLICY_BLEND) first[c] = in[at + c];
                if (attribute->split == SPRINGLS_POLICY_SHARE) first[c] *= 0.5f;
                second[c] = attribute->split == SPRINGLS_POLICY_BLEND ? in[job->blended + at + c] : first[c];
            }
            if (attribute->split == SPRINGLS_POLICY_BLEND) at += attribute->channels;
        }
    }
}

SPRINGLS__FN void springls__attributes_after_split(springls_context *ctx, int known)
{
    springls__inherit_job job;
    springls_status status;
    int added = ctx->model.set.count - known;
    if (!ctx->attribute_count) return;
    status = springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A) | SPRINGLS__BIT(ID) | SPRINGLS__BIT(PARENT), 0);
    if (status != SPRINGLS_OK) return;
    job.ctx = ctx;
    job.search.ctx = ctx;
    job.search.a = (const springls__v3 *)ctx->attribute_memory[SPRINGLS__OLD_PLACES].data;
    job.search.known = known;
    job.blended = springls__channels_split_by(ctx, SPRINGLS_POLICY_BLEND);
    job.values = (float *)ctx->attribute_memory[SPRINGLS__NEW_VALUES].data;
    if (job.blended) springls__parallel(ctx, added, 32, springls__blend_halves_task, &job);
    springls__parallel(ctx, added, 256, springls__split_rows_task, &job);
}

/* ---- fill ---- */

SPRINGLS__FN void springls__fill_rows_task(void *arg, int begin, int end)
{
    const springls__inherit_job *job = (const springls__inherit_job *)arg;
    int i;
    for (; begin < end; begin++) {
        int child = job->search.known + begin;
        springls__interpolation_sources donors = springls__interpolation_sources_of_springl(&job->search, child);
        for (i = 0; i < job->ctx->attribute_count; i++) {
            const springls__attribute *attribute = &job->ctx->attributes[i];
            float *row = springls__attribute_row(attribute, child);
            if (attribute->fill == SPRINGLS_POLICY_SHARE) memset(row, 0, (size_t)attribute->channels * sizeof *row);
            else springls__interpolate_value(attribute, &donors, attribute->fill == SPRINGLS_POLICY_BLEND, row);
        }
    }
}

SPRINGLS__FN springls_status springls__attributes_fill(springls_context *ctx, int known)
{
    springls__inherit_job job;
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        SPRINGLS__TRY(springls__rows_reserve(ctx, &ctx->attributes[i], ctx->model.set.count, known));
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S) | SPRINGLS__BIT(A), 0));
    SPRINGLS__TRY(springls__model_refresh(ctx));
    memset(&job, 0, sizeof job);
    job.ctx = ctx;
    job.search.ctx = ctx;
    job.search.a = ctx->model.set.a;
    job.search.known = known;
    springls__parallel(ctx, ctx->model.set.count - known, 32, springls__fill_rows_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS__FN springls_status springls__attributes_after_fill(springls_context *ctx, int known)
{
    springls_status status;
    if (!ctx->attribute_count || ctx->model.set.count == known) return SPRINGLS_OK;
    status = springls__attributes_fill(ctx, known);
    if (status == SPRINGLS_OK) return SPRINGLS_OK;
    ctx->stats.added -= ctx->model.set.count - known;
    ctx->model.set.count = known;
    springls__constellation_changed(ctx);
    return status;
}

/* ---- merge ---- */

/* Of a springl: its area; and where it is to go, the nearest springl of its side that stays: index -1 when there is none. */
typedef struct springls__merge_target { int index; float distance, area; } springls__merge_target;

SPRINGLS__FN springls__merge_target springls__merge_target_of(const springls_context *ctx, const uint8_t *fate, int i)
{
    const float range = SPRINGLS__FIT_RADIUS, alike = 0.3f;
    const springls__springl *s = ctx->model.set.s;
    springls__near_walk walk = springls__near_walk_begin(&ctx->springl_surface, springls__voxel_to_model(ctx, s[i].p),
                                                         range * ctx->largest_spacing / ctx->smallest_spacing);
    springls__v3 n = springls__springl_normal(s[i]);
    float best = range * range;
    springls__merge_target heir;
    int j;
    heir.index = -1;
    heir.area = 0.5f * springls__length(springls__tri_area2(springls__springl_tri(s[i])));
    while (fate[i] == SPRINGLS__REMOVE && (j = springls__near_walk_next(&walk)) >= 0) {
        float d2 = springls__length2(springls__sub(s[j].p, s[i].p));
        if (fate[j] == SPRINGLS__REMOVE || d2 > best || (d2 == best && heir.index >= 0 && j > heir.index)) continue;
        if (springls__dot(springls__springl_normal(s[j]), n) <= alike) continue;
        best = d2;
        heir.index = j;
    }
    heir.distance = springls__sqrt(best);
    return heir;
}

typedef struct springls__merge_targets_job {
    const springls_context *ctx;
    const uint8_t *fate;
    springls__merge_target *heirs;
} springls__merge_targets_job;

SPRINGLS__FN void springls__merge_targets_task(void *arg, int begin, int end)
{
    const springls__merge_targets_job *job = (const springls__merge_targets_job *)arg;
    for (; begin < end; begin++) job->heirs[begin] = springls__merge_target_of(job->ctx, job->fate, begin);
}

SPRINGLS__FN bool springls__attributes_merge(const springls_context *ctx)
{
    int i;
    for (i = 0; i < ctx->attribute_count; i++)
        if (ctx->attributes[i].merge != SPRINGLS_POLICY_COPY) return true;
    return false;
}

/* SCRATCH1 has the fate of every springl. */
SPRINGLS__FN springls_status springls__attributes_before_removal(springls_context *ctx)
{
    springls__merge_targets_job job;
    size_t count = (size_t)ctx->model.set.count;
    if (!ctx->attribute_count) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(SCRATCH1), 0));
    if (!springls__attributes_merge(ctx)) return SPRINGLS_OK;
    SPRINGLS__TRY(springls__to_host(ctx, SPRINGLS__BIT(S), 0));
    SPRINGLS__TRY(springls__attribute_work(ctx, SPRINGLS__MERGE_TARGETS, count, sizeof(springls__merge_target)));
    SPRINGLS__TRY(springls__model_refresh(ctx));
    job.ctx = ctx;
    job.fate = (const uint8_t *)ctx->model.work.scratch[1];
    job.heirs = (springls__merge_target *)ctx->attribute_memory[SPRINGLS__MERGE_TARGETS].data;
    springls__parallel(ctx, (int)count, 256, springls__merge_targets_task, &job);
    return SPRINGLS_OK;
}

/* To row `heir` comes what row `gone` had: `share` of it, and as much less of its own where a mean is asked for. */
SPRINGLS__FN void springls__merge_row(const springls__attribute *attribute, int heir, int gone, float share)
{
    float *to = springls__attribute_row(attribute, heir), *from = springls__attribute_row(attribute, gone);
    int c;
    for (c = 0; c < attribute->channels; c++)
        to[c] += attribute->merge == SPRINGLS_POLICY_SHARE ? from[c] : share * (from[c] - to[c]);
}

/* What contract removed because another was too close has merged with that one; what it removed for other reasons has not, but
   leaves its share. */
SPRINGLS__FN void springls__merge_rows(springls_context *ctx, int count)
{
    springls__merge_target *heirs = (springls__merge_target *)ctx->attribute_memory[SPRINGLS__MERGE_TARGETS].data;
    int i, k;
    for (i = 0; i < count; i++) {
        springls__merge_target *heir = heirs[i].index < 0 ? NULL : &heirs[heirs[i].index];
        bool merged = heirs[i].distance <= ctx->model.params.merge_distance && heirs[i].area > 0.0f;
        if (!heir) continue;
        for (k = 0; k < ctx->attribute_count; k++)
            if (ctx->attributes[k].merge != SPRINGLS_POLICY_COPY)
                springls__merge_row(&ctx->attributes[k], heirs[i].index, i,
                                    merged ? heirs[i].area / (heirs[i].area + heir->area) : 0.0f);
        if (merged) heir->area += heirs[i].area;
    }
}

SPRINGLS__FN void springls__attributes_after_removal(springls_context *ctx, int count)
{
    const uint8_t *fate = (const uint8_t *)ctx->model.work.scratch[1];
    int i, k, n;
    if (!ctx->attribute_count || ctx->lost) return;
    if (springls__attributes_merge(ctx)) springls__merge_rows(ctx, count);
    for (k = 0; k < ctx->attribute_count; k++)
        for (i = n = 0; i < count; i++)
            if (fate[i] != SPRINGLS__REMOVE) springls__row_copy(&ctx->attributes[k], n++, i);
}

/* ---- public ---- */

SPRINGLS__FN bool springls__policy_known(springls_policy policy)
{
    return policy == SPRINGLS_POLICY_COPY || policy == SPRINGLS_POLICY_BLEND || policy == SPRINGLS_POLICY_SHARE;
}

/* The attribute of a number; NULL, and the reason, where there is none. */
SPRINGLS__FN springls__attribute *springls__attribute_at(springls_context *ctx, int index, const char *call)
{
    if (index >= 0 && index < ctx->attribute_count) return &ctx->attributes[index];
    springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: attribute %d of %d", call, index, ctx->attribute_count);
    return NULL;
}

SPRINGLS__FN springls_status springls__check_attribute(springls_context *ctx, const springls_attribute_desc *desc)
{
    const char *call = "add_attribute";
    size_t length = desc && desc->name ? strlen(desc->name) : 0;
    if (length == 0 || length > SPRINGLS_MAX_NAME)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: a name of 1 to %d characters is wanted", call,
                              SPRINGLS_MAX_NAME);
    if (springls_find_attribute(ctx, desc->name) >= 0)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: there is one named %s", call, desc->name);
    if (desc->channels < 1 || desc->channels > SPRINGLS_MAX_CHANNELS)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: %d channels, not 1 to %d", call, desc->channels,
                              SPRINGLS_MAX_CHANNELS);
    if (!springls__policy_known(desc->split) || !springls__policy_known(desc->fill) || !springls__policy_known(desc->merge))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: an unknown policy", call);
    if (ctx->attribute_count == SPRINGLS_MAX_ATTRIBUTES)
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "%s: more than %d attributes", call, SPRINGLS_MAX_ATTRIBUTES);
    return SPRINGLS_OK;
}

SPRINGLS__FN void springls__attribute_fill(springls_context *ctx, springls__attribute *attribute, const float *values)
{
    size_t bytes = (size_t)ctx->model.set.count * (size_t)attribute->channels * sizeof *values;
    if (values) memcpy(attribute->values.data, values, bytes);
    else memset(attribute->values.data, 0, bytes);
}

SPRINGLS__FN springls_status springls__finite_values(springls_context *ctx, const float *values, size_t count, const char *call)
{
    size_t i;
    for (i = 0; values && i < count; i++)
        if (!(values[i] >= -FLT_MAX && values[i] <= FLT_MAX))
            return springls__fail(ctx, SPRINGLS_NON_FINITE, "%s: value %lu is not finite", call, (unsigned long)i);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_add_attribute(springls_context *ctx, const springls_attribute_desc *desc,
                                                    const float *values, int *index)
{
    springls__attribute *attribute;
    if (index) *index = -1;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    SPRINGLS__TRY(springls__check_attribute(ctx, desc));
    SPRINGLS__TRY(springls__finite_values(ctx, values, (size_t)ctx->model.set.count * (size_t)desc->channels, "add_attribute"));
    attribute = &ctx->attributes[ctx->attribute_count];
    attribute->channels = desc->channels;
    SPRINGLS__TRY(springls__rows_reserve(ctx, attribute, ctx->model.set.count, 0));
    memcpy(attribute->name, desc->name, strlen(desc->name) + 1);
    attribute->split = desc->split;
    attribute->fill = desc->fill;
    attribute->merge = desc->merge;
    springls__attribute_fill(ctx, attribute, values);
    if (index) *index = ctx->attribute_count;
    ctx->attribute_count++;
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_remove_attribute(springls_context *ctx, int index)
{
    springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    attribute = springls__attribute_at(ctx, index, "remove_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    springls__buffer_free(ctx, &attribute->values);
    ctx->attribute_count--;
    for (; index < ctx->attribute_count; index++) ctx->attributes[index] = ctx->attributes[index + 1];
    memset(&ctx->attributes[index].values, 0, sizeof ctx->attributes[index].values);
    return SPRINGLS_OK;
}

SPRINGLS_API int springls_attribute_count(const springls_context *ctx) { return ctx ? ctx->attribute_count : 0; }

SPRINGLS_API springls_status springls_describe_attribute(springls_context *ctx, int index, springls_attribute_desc *out)
{
    const springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    attribute = springls__attribute_at(ctx, index, "describe_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    if (!out) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "describe_attribute: out is NULL");
    out->name = attribute->name;
    out->channels = attribute->channels;
    out->split = attribute->split;
    out->fill = attribute->fill;
    out->merge = attribute->merge;
    return SPRINGLS_OK;
}

SPRINGLS_API int springls_find_attribute(const springls_context *ctx, const char *name)
{
    int i;
    for (i = 0; ctx && name && i < ctx->attribute_count; i++)
        if (strcmp(ctx->attributes[i].name, name) == 0) return i;
    return -1;
}

SPRINGLS_API springls_status springls_set_attribute(springls_context *ctx, int index, const float *values)
{
    springls__attribute *attribute;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finish_step(ctx));
    attribute = springls__attribute_at(ctx, index, "set_attribute");
    if (!attribute) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__finite_values(ctx, values, (size_t)ctx->model.set.count * (size_t)attribute->channels,
                                          "set_attribute"));
    springls__attribute_fill(ctx, attribute, values);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_view springls_view_attribute(const springls_context *ctx, int index)
{
    springls_view view;
    memset(&view, 0, sizeof view);
    if (!ctx || index < 0 || index >= ctx->attribute_count) return view;
    view.count = ctx->model.set.count;
    view.data = view.count ? (const float *)ctx->attributes[index].values.data : NULL;
    view.stride = (size_t)ctx->attributes[index].channels * sizeof(float);
    return view;
}

typedef struct springls__mesh_attribute_job {
    springls__interpolation_search search;
    const springls_mesh *mesh;
    const springls__attribute *attribute;
    float *out;
} springls__mesh_attribute_job;

SPRINGLS__FN void springls__mesh_attribute_task(void *arg, int begin, int end)
{
    const springls__mesh_attribute_job *job = (const springls__mesh_attribute_job *)arg;
    const springls_context *ctx = job->search.ctx;
    float side = springls__is_mirrored(ctx) ? -1.0f : 1.0f; /* the normals of springls point inwards in a mirrored world */
    for (; begin < end; begin++) {
        size_t v = 3 * (size_t)begin;
        springls__v3 n = springls__scale(springls__load3(job->mesh->normals + v), side);
        springls__interpolation_sources donors = springls__interpolation_sources_at(&job->search, springls__world_to_model(ctx, job->mesh->positions + v), n,
                                             springls__world_to_voxel(ctx, job->mesh->correspondences + v), 1.0f);
        springls__interpolate_value(job->attribute, &donors, job->attribute->fill == SPRINGLS_POLICY_BLEND,
                            job->out + (size_t)begin * (size_t)job->attribute->channels);
    }
}

SPRINGLS_API springls_status springls_mesh_attribute(springls_context *ctx, const springls_mesh *mesh, int index, float *out)
{
    springls__mesh_attribute_job job;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    job.attribute = springls__attribute_at(ctx, index, "mesh_attribute");
    if (!job.attribute) return SPRINGLS_INVALID_ARGUMENT;
    if (!mesh || (mesh->vertex_count > 0 && !out))
        return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "mesh_attribute: mesh or out is NULL");
    SPRINGLS__TRY(springls__use_host(ctx, false));
    SPRINGLS__TRY(springls__model_refresh(ctx));
    job.search.ctx = ctx;
    job.search.a = ctx->model.set.a;
    job.search.known = ctx->model.set.count;
    job.mesh = mesh;
    job.out = out;
    springls__parallel(ctx, mesh->vertex_count, 32, springls__mesh_attribute_task, &job);
    return SPRINGLS_OK;
}

SPRINGLS_API springls_status springls_get_provenance(springls_context *ctx, springls_provenance *out)
{
    int i;
    if (!ctx) return SPRINGLS_INVALID_ARGUMENT;
    SPRINGLS__TRY(springls__ensure_on_host(ctx, SPRINGLS__BIT(BIRTH) | SPRINGLS__BIT(GENERATION) | SPRINGLS__BIT(PARENT)));
    if (!out && ctx->model.set.count) return springls__fail(ctx, SPRINGLS_INVALID_ARGUMENT, "get_provenance: out is NULL");
    for (i = 0; i < ctx->model.set.count; i++) {
        uint32_t birth = ctx->model.set.birth[i];
        out[i].kind = (springls_kind)(birth & 3u);
        out[i].age = (int)((ctx->model.set.step - (birth >> 2)) & 0x3fffffffu);
        out[i].generation = ctx->model.set.generation[i];
        out[i].parent = ctx->model.set.parent[i];
    }
    return SPRINGLS_OK;
}
