#include "viewer/app.h"

#include "base/vec3.h"
#include "viewer/file.h"
#include "viewer/solid.h"

#include <stdio.h>
#include <string.h>

#define PUSH_SPEED 1.0f     /* radii of the brush a second */
#define SMOOTH_SPEED 60.0f  /* full steps a second */
#define MASK_SPEED 8.0f     /* whole masks a second */
#define SLAB 3.0f           /* voxels that a cut takes away */
#define MIN_BRUSH_RADIUS 3.0f    /* voxels: the effect of a smaller brush is invisible in phi */

const char *const viewer_tool_names[VIEWER_TOOLS] = {"drag", "push", "inflate", "smooth", "cut", "merge", "mask"};
const char *const viewer_view_names[VIEWER_VIEWS] = {"surface", "springls", "texture", "wireframe"};

const char *const viewer_falloff_names[VIEWER_FALLOFFS] = {"smooth", "pointed", "flat"};
const char *const viewer_symmetry_names[4] = {"no symmetry", "symmetry x", "symmetry y", "symmetry z"};

const char viewer_manual[] =
    "left button    the tool; beside the body: turn the camera\n"
    "right button   turn the camera; middle button, or shift and right: shift it\n"
    "wheel          nearer, further; with ctrl, or [ and ]: size of the brush\n"
    "- and =        strength of the brush; O: its falloff; X: symmetry\n"
    "1 drag         what is in the brush follows the pointer\n"
    "2 push         inward; shift: outward\n"
    "3 inflate      in the brush, shift: deflate; ctrl: the whole body\n"
    "4 smooth       in the brush; ctrl: the whole body\n"
    "5 cut          a slab along the stroke; shift: all to the right of it\n"
    "6 merge        click: a ball, drag it; enter: merge, escape: not\n"
    "7 mask         what is masked stays; shift: unmask; C: clear, I: invert\n"
    "V              next view: surface, springls, texture, wireframe\n"
    "ctrl Z, ctrl Y undo, redo\n"
    "ctrl S         save; drop a file: open it (tool merge: to merge)\n"
    "R begin again, F whole body in view, H this help, Q quit\n";

static void show_message(struct viewer_app *app, const char *text)
{
    snprintf(app->message, sizeof app->message, "%s", text);
    ++app->looks;
}

/* Shows the model's error if there is one; returns `good`. */
static bool done(struct viewer_app *app, bool good)
{
    ++app->looks;
    if (!good) {
        show_message(app, app->model.error);
    }
    return good;
}

/* Sets the camera's scene, which is all that may be drawn; returns its radius. */
static float frame_scene(struct viewer_app *app)
{
    float lower[3], upper[3], half[3];
    if (!viewer_model_box(&app->model, lower, upper)) {
        return app->camera.scene_radius;
    }
    vec3_sub(upper, lower, half);
    for (int a = 0; a < 3; ++a) {
        half[a] *= 0.5f;
        app->camera.middle[a] = lower[a] + half[a];
    }
    app->camera.scene_radius = vec3_length(half) + app->model.voxel * (float)app->model.grid;
    app->framed_version = app->model.version;
    return vec3_length(half);
}

static void fit(struct viewer_app *app)
{
    const float radius = frame_scene(app);
    viewer_camera_fit(&app->camera, app->camera.middle, 0.8f * radius, app->camera.scene_radius);
    ++app->looks;
}

static void begin_view(struct viewer_app *app)
{
    app->brush.radius = 0.08f * app->model.voxel * (float)app->model.grid;
    app->hand = VIEWER_IDLE;
    app->hover = false;
    fit(app);
}

/* Opens a file, or a ball; the model before can be had back by undo. */
static bool begin(struct viewer_app *app, const char *path)
{
    struct viewer_model made = {0};
    bool good = path ? viewer_model_file(&made, &app->desc, path) : viewer_model_ball(&made, &app->desc);
    if (!good) {
        memcpy(app->model.error, made.error, sizeof made.error);
    } else if (app->model.ctx && !viewer_history_keep(&app->history, &app->model)) {
        good = false;
        viewer_model_free(&made);
    }
    if (done(app, good)) {
        viewer_model_replace(&app->model, &made, true);
        viewer_model_free(&app->second);
        begin_view(app);
    }
    return good;
}

bool viewer_app_open(struct viewer_app *app, const springls_desc *desc, int width, int height)
{
    app->desc = *desc;
    app->width = width;
    app->height = height;
    app->brush.strength = 1.0f;
    const bool good = begin(app, app->load);
    viewer_history_clear(&app->history);
    return good;
}

void viewer_app_close(struct viewer_app *app)
{
    viewer_history_clear(&app->history);
    viewer_model_free(&app->model);
    viewer_model_free(&app->second);
}

void viewer_app_resize(struct viewer_app *app, int width, int height)
{
    app->width = width > 0 ? width : 1;
    app->height = height > 0 ? height : 1;
    ++app->looks;
}

static struct viewer_ray ray_at(const struct viewer_app *app, const float pointer[2])
{
    return viewer_camera_ray(&app->camera, pointer[0], pointer[1], app->width, app->height);
}

static void look_under_pointer(struct viewer_app *app)
{
    const struct viewer_ray ray = ray_at(app, app->pointer);
    app->hover = app->tool != VIEWER_CUT && viewer_pick(&app->model, &ray, &app->brush);
}

/* Computes the pointer's place in the plane of the view at `held_depth`. */
static void place_at_depth(const struct viewer_app *app, float place[3])
{
    float eye[3];
    const struct viewer_ray ray = ray_at(app, app->pointer);
    const struct raycast_frame frame = viewer_camera_frame(&app->camera, 1.0f, eye);
    vec3_add_scaled(eye, app->held_depth / vec3_dot(ray.direction, frame.forward), ray.direction, place);
}

static void hold(struct viewer_app *app, const float place[3])
{
    float eye[3], from_eye[3];
    const struct raycast_frame frame = viewer_camera_frame(&app->camera, 1.0f, eye);
    vec3_sub(place, eye, from_eye);
    app->held_depth = vec3_dot(from_eye, frame.forward);
    memcpy(app->goal, place, sizeof app->goal);
}

/* ---- the second body ---- */

static bool over_second(struct viewer_app *app, struct viewer_brush *spot)
{
    struct viewer_ray ray = ray_at(app, app->pointer);
    if (!app->second.ctx) {
        return false;
    }
    vec3_sub(ray.origin, app->offset, ray.origin);
    const bool hit = viewer_pick(&app->second, &ray, spot);
    vec3_add_scaled(spot->center, 1.0f, app->offset, spot->center);
    return hit;
}

/* Makes the second body at its place, from its file or as a ball. */
static bool make_second(struct viewer_app *app)
{
    const float *at = app->second_place, radius = app->second_radius;
    const bool good = *app->second_path ? viewer_model_second_file(&app->second, &app->model, at, radius, app->second_path)
                                        : viewer_model_second_ball(&app->second, &app->model, at, radius);
    memset(app->offset, 0, sizeof app->offset);
    show_message(app, good ? "drag the second body; enter merges it, escape takes it away" : app->second.error);
    return good;
}

static bool place_second(struct viewer_app *app, const char *path)
{
    memcpy(app->second_place, app->camera.middle, sizeof app->second_place);
    if (app->hover) {
        memcpy(app->second_place, app->brush.center, sizeof app->second_place);
    }
    app->second_radius = (path ? 2.0f : 1.0f) * app->brush.radius;
    snprintf(app->second_path, sizeof app->second_path, "%s", path ? path : "");
    return make_second(app);
}

/* Ends a change made in one call; a failed one is reverted, because it may leave the model empty. */
static void change(struct viewer_app *app, bool good)
{
    char error[VIEWER_TEXT];
    if (!done(app, good)) {
        snprintf(error, sizeof error, "%s", app->model.error);
        done(app, viewer_history_revert(&app->history, &app->model));
        show_message(app, error);
    }
}

/* Makes the second body again at the place to which it was dragged and merges it: moving a level set would lose accuracy. */
static void merge_second(struct viewer_app *app)
{
    if (!app->second.ctx) {
        return;
    }
    vec3_add_scaled(app->second_place, 1.0f, app->offset, app->second_place);
    if (make_second(app) && done(app, viewer_history_keep(&app->history, &app->model))) {
        app->message[0] = '\0';
        change(app, viewer_merge(&app->model, &app->second));
        viewer_model_free(&app->second);
    }
}

/* ---- events ---- */

/* Starts dragging; returns false if nothing is under the pointer. */
static bool take_hold(struct viewer_app *app)
{
    struct viewer_brush spot;
    app->holds_second = over_second(app, &spot);
    if (app->tool == VIEWER_CUT) {
        for (int i = 0; i < 4; ++i) {
            app->stroke[i] = app->pointer[i % 2];
        }
        return true;
    }
    look_under_pointer(app);
    if (app->tool == VIEWER_MERGE && !app->holds_second) {
        if (!app->hover || app->second.ctx || !place_second(app, NULL)) {
            return false;
        }
        app->holds_second = true;
        spot = app->brush;
    }
    if (app->holds_second) {
        hold(app, spot.center);
        return true;
    }
    hold(app, app->brush.center);
    return app->hover;
}

static void let_go(struct viewer_app *app)
{
    if (app->hand == VIEWER_WORK && app->tool == VIEWER_CUT) {
        const struct viewer_ray from = ray_at(app, app->stroke), to = ray_at(app, app->stroke + 2);
        struct viewer_cut cut;
        if (viewer_cut_between(&from, &to, SLAB * app->model.voxel, (app->modifiers & VIEWER_SHIFT) != 0, &cut)) {
            if (done(app, viewer_history_keep(&app->history, &app->model))) {
                change(app, viewer_subtract(&app->model, &cut));
            }
        }
    }
    app->hand = VIEWER_IDLE;
    look_under_pointer(app);
    ++app->looks;
}

void viewer_app_button(struct viewer_app *app, int button, bool down, int modifiers)
{
    if (!down) {
        let_go(app);
    } else if (app->hand == VIEWER_IDLE) {
        app->modifiers = modifiers;
        if (button == VIEWER_LEFT) {
            app->message[0] = '\0';
            app->kept = false;
            app->hand = take_hold(app) ? VIEWER_WORK : VIEWER_ORBIT;
        } else {
            app->hand = button == VIEWER_MIDDLE || modifiers & VIEWER_SHIFT ? VIEWER_PAN : VIEWER_ORBIT;
        }
        ++app->looks;
    }
}

void viewer_app_move(struct viewer_app *app, float x, float y)
{
    const float dx = (x - app->pointer[0]) / (float)app->height, dy = (y - app->pointer[1]) / (float)app->height;
    float place[3];
    app->pointer[0] = x;
    app->pointer[1] = y;
    ++app->looks;
    if (app->hand == VIEWER_ORBIT) {
        viewer_camera_orbit(&app->camera, dx, dy);
    } else if (app->hand == VIEWER_PAN) {
        viewer_camera_pan(&app->camera, dx, dy);
    } else if (app->hand == VIEWER_WORK && app->tool == VIEWER_CUT) {
        app->stroke[2] = x;
        app->stroke[3] = y;
    } else if (app->hand == VIEWER_WORK && (app->holds_second || app->tool == VIEWER_DRAG)) {
        place_at_depth(app, place);
        if (app->holds_second) {
            vec3_sub(place, app->goal, app->goal);
            vec3_add_scaled(app->offset, 1.0f, app->goal, app->offset);
        }
        memcpy(app->goal, place, sizeof place);
    } else {
        look_under_pointer(app);
    }
}

static void size_brush(struct viewer_app *app, float notches)
{
    const float voxel = app->model.voxel, allowed = 0.5f * voxel * (float)app->model.grid;
    app->brush.radius = fmaxf(MIN_BRUSH_RADIUS * voxel, fminf(allowed, app->brush.radius * powf(1.15f, notches)));
    ++app->looks;
}

static void strengthen_brush(struct viewer_app *app, float difference)
{
    app->brush.strength = fmaxf(0.1f, fminf(1.0f, app->brush.strength + difference));
}

void viewer_app_scroll(struct viewer_app *app, float notches, int modifiers)
{
    if (modifiers & VIEWER_CTRL) {
        size_brush(app, notches);
    } else {
        viewer_camera_zoom(&app->camera, notches);
        look_under_pointer(app);
        ++app->looks;
    }
}

bool viewer_app_save(struct viewer_app *app, const char *path)
{
    char text[VIEWER_TEXT];
    app->save_failed = !done(app, viewer_save(&app->model, path, app->texture));
    if (!app->save_failed) {
        snprintf(text, sizeof text, "saved %.250s", path);
        show_message(app, text);
    }
    return !app->save_failed;
}

/* Changes the mask as a whole: clears or inverts it. */
static void change_mask(struct viewer_app *app, bool invert)
{
    if (app->hand == VIEWER_IDLE && (invert || app->model.mask >= 0)
        && done(app, viewer_history_keep(&app->history, &app->model))) {
        done(app, invert ? viewer_model_invert_mask(&app->model) : viewer_model_set_mask(&app->model, NULL));
    }
}

/* Undoes or redoes a change, unless a button is down. */
static void go_back(struct viewer_app *app, bool forward)
{
    const char *what = forward ? "redone" : "undone";
    const float voxel = app->model.voxel;
    char text[VIEWER_TEXT] = "nothing more";
    if (app->hand != VIEWER_IDLE) {
        return;
    }
    if (forward ? viewer_history_redo(&app->history, &app->model) : viewer_history_undo(&app->history, &app->model)) {
        snprintf(text, sizeof text, "%s", what);
    } else if (*app->model.error) {
        snprintf(text, sizeof text, "not %s: %.240s", what, app->model.error);
    }
    show_message(app, text);
    if (fabsf(app->model.voxel - voxel) > 0.0f) { /* of another file */
        begin_view(app);
    }
    look_under_pointer(app);
}

void viewer_app_key(struct viewer_app *app, int key, int modifiers)
{
    ++app->looks;
    if (key >= '1' && key < '1' + VIEWER_TOOLS && app->hand == VIEWER_IDLE) {
        app->tool = (enum viewer_tool)(key - '1');
        look_under_pointer(app);
        return;
    }
    switch (key) {
    case 'V': {
        const unsigned step = modifiers & VIEWER_SHIFT ? VIEWER_VIEWS - 1 : 1;
        app->view = (enum viewer_view)((app->view + step) % VIEWER_VIEWS);
        break;
    }
    case '[': size_brush(app, -1.0f); break;
    case ']': size_brush(app, 1.0f); break;
    case 'F': fit(app); break;
    case 'H': app->help = !app->help; break;
    case '-': strengthen_brush(app, -0.1f); break;
    case '=': strengthen_brush(app, 0.1f); break;
    case 'O': app->brush.falloff = (enum viewer_falloff)((app->brush.falloff + 1) % VIEWER_FALLOFFS); break;
    case 'X': app->brush.symmetry = (app->brush.symmetry + 1) % 4; break;
    case 'C': change_mask(app, false); break;
    case 'I': change_mask(app, true); break;
    case 'R': begin(app, app->load); break;
    case 'S':
        if (modifiers & VIEWER_CTRL) {
            viewer_app_save(app, app->save);
        }
        break;
    case 'Z':
    case 'Y':
        if (modifiers & VIEWER_CTRL) {
            go_back(app, key == 'Y' || modifiers & VIEWER_SHIFT);
        }
        break;
    case VIEWER_ENTER: merge_second(app); break;
    case VIEWER_ESCAPE:
        viewer_model_free(&app->second);
        app->message[0] = '\0';
        app->hand = VIEWER_IDLE;
        break;
    case 'Q': app->quit = true; break;
    default: break;
    }
}

bool viewer_app_drop(struct viewer_app *app, const char *path)
{
    return app->tool == VIEWER_MERGE ? place_second(app, path) : begin(app, path);
}

/* ---- work ---- */

/* Moves the brush towards the pointer, as far as one step may go: this bounds the work of a frame. */
static bool drag_on(struct viewer_app *app)
{
    float displacement[3];
    vec3_sub(app->goal, app->brush.center, displacement);
    const float length = vec3_length(displacement);
    const float allowed = app->brush.strength * viewer_max_displacement(&app->model, &app->brush);
    for (int a = 0; a < 3; ++a) {
        displacement[a] *= length > allowed ? allowed / length : 1.0f;
    }
    return viewer_drag(&app->model, &app->brush, displacement);
}

static bool drag_is_due(const struct viewer_app *app)
{
    float displacement[3];
    vec3_sub(app->goal, app->brush.center, displacement);
    return vec3_length(displacement) > 0.01f * app->model.voxel;
}

static bool works(const struct viewer_app *app)
{
    const bool stays = app->tool == VIEWER_CUT || app->tool == VIEWER_MERGE || (app->tool == VIEWER_DRAG && !drag_is_due(app));
    return app->hand == VIEWER_WORK && !app->holds_second && !stays;
}

static bool use_tool(struct viewer_app *app, float seconds)
{
    const bool shift = (app->modifiers & VIEWER_SHIFT) != 0;
    const bool everywhere = app->tool != VIEWER_PUSH && (app->modifiers & VIEWER_CTRL) != 0;
    if (app->tool == VIEWER_DRAG) {
        return drag_on(app);
    }
    look_under_pointer(app);
    if (!app->hover && !everywhere) {
        return true;
    }
    const struct viewer_brush *brush = everywhere ? NULL : &app->brush;
    const float strength = app->brush.strength, allowed = viewer_max_displacement(&app->model, &app->brush);
    const float distance = strength * fminf(PUSH_SPEED * seconds * app->brush.radius, allowed);
    switch (app->tool) {
    case VIEWER_PUSH: return viewer_push(&app->model, &app->brush, shift ? distance : -distance);
    case VIEWER_INFLATE: return viewer_inflate(&app->model, brush, shift ? -distance : distance);
    case VIEWER_MASK: return viewer_mask(&app->model, brush, (shift ? -strength : strength) * fminf(1.0f, MASK_SPEED * seconds));
    default: return viewer_smooth(&app->model, brush, strength * fminf(1.0f, SMOOTH_SPEED * seconds));
    }
}

bool viewer_app_busy(const struct viewer_app *app)
{
    return works(app) || app->model.chunks_in_progress || !viewer_model_at_rest(&app->model)
        || (app->second.ctx && !viewer_model_at_rest(&app->second));
}

/* Begins the next step that is due. */
static void begin_step(struct viewer_app *app)
{
    if (works(app)) {
        const float seconds = app->seconds;
        app->seconds = 0.0f;
        app->kept = app->kept || done(app, viewer_history_keep(&app->history, &app->model));
        if (app->kept) { /* what cannot be undone is not begun */
            done(app, use_tool(app, seconds));
        }
    } else if (!viewer_model_at_rest(&app->model)) {
        done(app, viewer_model_rest_step(&app->model));
    } else if (app->second.ctx && !viewer_model_at_rest(&app->second)) {
        viewer_model_rest_step(&app->second);
        ++app->looks;
    }
}

void viewer_app_work(struct viewer_app *app, double seconds)
{
    app->model.budget = app->second.budget = app->budget;
    app->seconds = works(app) ? fminf(app->seconds + (float)seconds, 0.1f) : 0.0f;
    if (app->model.stepping) {
        done(app, viewer_model_continue(&app->model));
    } else if (app->model.chunks_in_progress) {
        ++app->looks; /* the picture continues them */
    } else if (app->second.stepping) {
        viewer_model_continue(&app->second);
        ++app->looks;
    } else {
        begin_step(app);
    }
    if (app->framed_version != app->model.version && !app->model.stepping) {
        frame_scene(app);
    }
}
