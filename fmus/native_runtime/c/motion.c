#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static double *take(double **at, size_t n)
{
    double *part = *at;
    *at += n;
    return part;
}

size_t inputs_size(const Model *model) { return model->wheelsets + model->contacts; }

Inputs inputs_in(const Model *model, double *block)
{
    const Inputs inputs = {block, block + model->wheelsets};
    return inputs;
}

int motion_create(Motion *motion, const Model *model)
{
    memset(motion, 0, sizeof *motion);
    const size_t g = 2 * model->drives + model->rigid, x = model->states, c = model->contacts;
    const size_t each = 8 * model->modes, u = inputs_size(model);
    const size_t pairs = model->contact_sign != 0 ? c * c : 0;
    const size_t solving = model->contact_sign != 0 ? CONTACT_WORK(c) : 0;
    double **of_g[] = {&motion->g0, &motion->gm, &motion->g1, &motion->more,
                       &motion->dg, &motion->q,  &motion->dq};
    double **of_x[] = {&motion->rate, &motion->drate, &motion->dx};
    double **of_c[] = {&motion->force,     &motion->dforce,    &motion->driven, &motion->none,
                       &motion->beyond[0], &motion->beyond[1], &motion->beyond[2],
                       &motion->z,         &motion->dz,        &motion->moved,
                       &motion->gap,       &motion->delta};
    Inputs *of_u[] = {&motion->now, &motion->dnow, &motion->middle};
    const size_t gs = sizeof of_g / sizeof *of_g, xs = sizeof of_x / sizeof *of_x;
    const size_t cs = sizeof of_c / sizeof *of_c, us = sizeof of_u / sizeof *of_u;
    motion->memory = calloc(gs * g + xs * x + cs * c + us * u + model->wheelsets + pairs +
                            solving + KEPT_STEPS * each, sizeof(double));
    if (motion->memory == NULL || !body_create(&motion->body, model)) {
        motion_free(motion);
        return 0;
    }
    double *at = motion->memory;
    for (size_t k = 0; k < gs; k++)
        *of_g[k] = take(&at, g);
    for (size_t k = 0; k < xs; k++)
        *of_x[k] = take(&at, x);
    for (size_t k = 0; k < cs; k++)
        *of_c[k] = take(&at, c);
    for (size_t k = 0; k < us; k++)
        *of_u[k] = inputs_in(model, take(&at, u));
    motion->driven_at = take(&at, model->wheelsets);
    motion->driven[0] = NAN; /* nothing yet */
    motion->G = take(&at, pairs);
    motion->solving = take(&at, solving);
    for (int k = 0; k < KEPT_STEPS; k++) {
        motion->kept[k].E = take(&at, each / 4);
        motion->kept[k].P0 = take(&at, each / 4);
        motion->kept[k].P1 = take(&at, each / 4);
        motion->kept[k].Q = take(&at, each / 4);
    }
    return 1;
}

void motion_free(Motion *motion)
{
    body_free(&motion->body);
    free(motion->memory);
    memset(motion, 0, sizeof *motion);
}

static double along(double start, double slope, double curve, double t)
{
    return start + t * (slope + 0.5 * t * curve);
}

void path_at(const Model *model, const InputPath *path, double t, Inputs *now)
{
    for (size_t k = 0; k < inputs_size(model); k++)
        now->position[k] = along(path->start.position[k], path->slope.position[k],
                                 path->curve.position[k], t);
}

const Coefficients *motion_coefficients(Motion *motion, double h)
{
    for (int k = 0; k < KEPT_STEPS; k++)
        if (motion->kept[k].h == h)
            return &motion->kept[k];
    Coefficients *c = &motion->kept[motion->next];
    motion->next = (motion->next + 1) % KEPT_STEPS;
    coefficients_make(c, motion->body.model, h);
    return c;
}

/* Forces less what loads nothing. */
static const double *beyond_preload(const Motion *motion, const double *force, double *beyond)
{
    const Model *m = motion->body.model;
    for (size_t k = 0; k < m->contacts; k++)
        beyond[k] = force[k] - m->preloads[k];
    return beyond;
}

void motion_drive(Motion *motion, const Shapes *shapes, const double *force, double *g)
{
    body_drive(&motion->body, shapes, beyond_preload(motion, force, motion->beyond[0]), g);
}

/* Whether g1 are of these forces, with wheelsets where the shapes are. */
static int is_driven(const Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    int same = 1;
    for (size_t k = 0; k < m->contacts; k++)
        same &= force[k] == motion->driven[k];
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->driven_at[k] == motion->body.place[k].position;
    return same;
}

static void note_driven(Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    memcpy(motion->driven, force, m->contacts * sizeof(double));
    for (size_t k = 0; k < m->wheelsets; k++)
        motion->driven_at[k] = motion->body.place[k].position;
}

const double *motion_driven(Motion *motion, const Shapes *shapes, const double *force)
{
    if (!is_driven(motion, force)) {
        motion_drive(motion, shapes, force, motion->g1);
        note_driven(motion, force);
    }
    return motion->g1;
}

void motion_forces(Motion *motion, const Inputs *now, const double *x, double *force)
{
    const Model *m = motion->body.model;
    const int sign = m->contact_sign;
    if (sign == 0) {
        memcpy(force, now->load, m->contacts * sizeof(double));
        return;
    }
    body_observe(&motion->body, body_shapes(&motion->body, now->position), x, motion->z);
    for (size_t k = 0; k < m->contacts; k++)
        force[k] = contact_force(&motion->law, sign * (motion->z[k] - now->load[k]));
}

int motion_forces_at_end(Motion *motion, const Coefficients *c, const Inputs *now, const double *x,
                         double *force)
{
    const Model *m = motion->body.model;
    const size_t n = m->contacts;
    if (m->contact_sign == 0) {
        memcpy(force, now->load, n * sizeof(double));
        return 1;
    }
    double *G = motion->G, *gap = motion->gap;
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    /* Displacement at the end of a step per force at its end. */
    body_compliance(&motion->body, shapes, c->P1, c->R1, G);
    body_observe(&motion->body, shapes, x, motion->z);
    for (size_t k = 0; k < n; k++) {
        gap[k] = m->contact_sign * (motion->z[k] - now->load[k]);
        for (size_t j = 0; j < n; j++) {
            G[k * n + j] *= -m->contact_sign;
            gap[k] += G[k * n + j] * m->preloads[j];
        }
    }
    if (!contact_solve(&motion->law, n, G, gap, motion->delta, motion->solving))
        return 0;
    for (size_t k = 0; k < n; k++)
        force[k] = contact_force(&motion->law, motion->delta[k]);
    return 1;
}

int motion_still(const Model *model, const InputPath *path)
{
    for (size_t k = 0; k < model->wheelsets; k++)
        if (path->slope.position[k] != 0 || path->curve.position[k] != 0)
            return 0;
    return 1;
}

double motion_internal_steps(const Motion *motion, int is_still, double h)
{
    if (motion->body.model->contact_sign == 0 && (is_still || motion->body.model->nodes == 0))
        return 1;
    return fmax(1, ceil(h / motion->internal_step * (1 - 1e-9)));
}

int motion_bulges(const Motion *motion, const InputPath *path, int is_still)
{
    const Model *m = motion->body.model;
    if (m->contact_sign != 0)
        return 0;
    int curved = !is_still && m->nodes > 0;
    for (size_t k = 0; k < m->contacts; k++)
        curved |= path->curve.load[k] != 0;
    return curved;
}

void motion_gather(const Motion *motion, double a, const double *g, double *q)
{
    const size_t n = 2 * motion->body.model->drives + motion->body.model->rigid;
    for (size_t r = 0; r < n; r++)
        q[r] += a * g[r];
}

const char MOTION_TOO_MANY[] = "takes over 10 million internal steps; use a shorter step";
const char MOTION_NO_CONTACT[] = "the contact forces could not be found: the wheel or rail motions "
                                 "set from outside are far off";

/* Generalised forces at the ends and in the middle of a step between instants whose forces leave
   the line between; `force` are those at its start, and then at its end. */
static void drive_along(Motion *motion, const Inputs *middle, const Inputs *end, double *force)
{
    Body *body = &motion->body;
    const int known = is_driven(motion, force);
    double *g0 = motion->g1, *const *beyond = motion->beyond;
    motion->g1 = motion->g0;
    motion->g0 = g0;
    body_roll(body, beyond_preload(motion, force, beyond[0]), middle->position,
              beyond_preload(motion, middle->load, beyond[1]), end->position,
              beyond_preload(motion, end->load, beyond[2]), known ? NULL : g0, motion->gm,
              motion->g1);
    memcpy(force, end->load, body->model->contacts * sizeof(double));
    note_driven(motion, force);
}

/* Generalised forces at the end of a step that so far went without them. */
static int drive_end(Motion *motion, const Coefficients *c, const Inputs *end, const double *x,
                     double *force)
{
    const Shapes *shapes = body_shapes(&motion->body, end->position);
    if (!motion_forces_at_end(motion, c, end, x, force))
        return 0;
    motion_drive(motion, shapes, force, motion->g1);
    note_driven(motion, force);
    return 1;
}

const char *motion_step(Motion *motion, const InputPath *path, double h, const double *x,
                        double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    Inputs *now = &motion->now, *middle = &motion->middle;
    const int still = motion_still(m, path), bulges = motion_bulges(motion, path, still);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    path_at(m, path, 0, now);
    const Shapes *shapes = body_shapes(body, now->position);
    motion_forces(motion, now, x, motion->force);
    if (!bulges)
        motion_driven(motion, shapes, motion->force);
    for (double k = 1; k <= parts; k++) {
        double *to = fmod(parts - k, 2) == 0 ? next : motion->dx; /* the last one is `next` */
        path_at(m, path, k / parts * h, now);
        if (bulges) {
            path_at(m, path, (k - 0.5) / parts * h, middle);
            drive_along(motion, middle, now, motion->force);
            step_whole(body, c, x, motion->g0, motion->gm, motion->g1, to);
        } else {
            step_free(body, c, x, motion->g1, to);
            if (!drive_end(motion, c, now, to, motion->force))
                return MOTION_NO_CONTACT;
            step_add_end(body, c, motion->g1, to);
        }
        x = to;
    }
    return NULL;
}

int motion_rest(Motion *motion, const Inputs *now, const double *heights, double *x)
{
    const Model *m = motion->body.model;
    double *force = motion->force;
    if (m->nodes == 0) {
        memset(x, 0, m->states * sizeof(double));
        for (size_t k = 0; k < m->wheelsets; k++) {
            for (size_t r = 0; r < m->ring; r++) {
                x[r] += m->start_s.re[k * m->ring + r] * heights[k];
                x[m->modes + r] += m->start_s.im[k * m->ring + r] * heights[k];
            }
            for (size_t j = 0; j < m->rigid; j++)
                x[2 * m->modes + j] += m->start_r[k * m->rigid + j] * heights[k];
        }
        return 1;
    }
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    memcpy(force, now->load, m->contacts * sizeof(double));
    if (m->contact_sign != 0) {
        body_compliance(&motion->body, shapes, motion->body.flexibility, 0, motion->G);
        if (!contact_solve(&motion->law, m->contacts, motion->G, now->load, motion->delta,
                           motion->solving))
            return 0;
        for (size_t k = 0; k < m->contacts; k++)
            force[k] = contact_force(&motion->law, motion->delta[k]);
    }
    body_at_rest(&motion->body, motion_driven(motion, shapes, force), x);
    return 1;
}

double motion_through(Motion *motion, size_t coordinate, const double *force)
{
    return body_through(&motion->body, coordinate,
                        beyond_preload(motion, force, motion->beyond[0]));
}

void motion_rate(Motion *motion, const Inputs *now, const double *x, double *rate)
{
    motion_forces(motion, now, x, motion->force);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    body_rate(&motion->body, x, motion_driven(motion, shapes, motion->force), rate);
}
