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
    const size_t each = 2 * model->modes, u = inputs_size(model);
    const size_t pairs = model->contact_sign != 0 ? c * c : 0;
    const size_t solving = model->contact_sign != 0 ? BALANCE_WORK(c) : 0; /* CONTACT_WORK is less */
    double **of_g[] = {&motion->g0, &motion->gm, &motion->g1, &motion->d0,
                       &motion->dm, &motion->d1, &motion->more};
    double **of_x[] = {&motion->rate, &motion->drate, &motion->dx, &motion->part, &motion->dpart};
    double **of_c[] = {&motion->force,     &motion->dforce,    &motion->driven, &motion->none,
                       &motion->beyond[0], &motion->beyond[1], &motion->beyond[2],
                       &motion->z,         &motion->dz,        &motion->moved,
                       &motion->begin,     &motion->dbegin,    &motion->inside, &motion->dinside,
                       &motion->seen[0],   &motion->seen[1],   &motion->seen[2],
                       &motion->dseen[0],  &motion->dseen[1],  &motion->dseen[2],
                        &motion->law.number};
    double **of_2c[] = {&motion->over, &motion->dover, &motion->free, &motion->dfree,
                        &motion->pressed};
    Inputs *of_u[] = {&motion->now,  &motion->middle,  &motion->end,
                      &motion->dnow, &motion->dmiddle, &motion->dend};
    const size_t gs = sizeof of_g / sizeof *of_g, xs = sizeof of_x / sizeof *of_x;
    const size_t cs = sizeof of_c / sizeof *of_c, us = sizeof of_u / sizeof *of_u;
    const size_t twos = sizeof of_2c / sizeof *of_2c;
    motion->memory = calloc(gs * g + xs * x + (cs + 2 * twos) * c + us * u + model->wheelsets +
                            4 * pairs + solving + KEPT_STEPS * PHIS * each,
                            sizeof(double));
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
    for (size_t k = 0; k < twos; k++)
        *of_2c[k] = take(&at, 2 * c);
    for (size_t k = 0; k < us; k++)
        *of_u[k] = inputs_in(model, take(&at, u));
    motion->driven_at = take(&at, model->wheelsets);
    motion->driven[0] = NAN; /* nothing yet */
    motion->G = take(&at, 4 * pairs);
    motion->solving = take(&at, solving);
    for (int k = 0; k < KEPT_STEPS; k++) {
        for (int j = 0; j < PHIS; j++)
            motion->kept[k].phi[j] = take(&at, each);
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

void path_part(const Model *model, const InputPath *path, double h, double k, double parts,
               Inputs *begin, Inputs *middle, Inputs *end)
{
    path_at(model, path, (k - 1) / parts * h, begin);
    path_at(model, path, (k - 0.5) / parts * h, middle);
    path_at(model, path, k / parts * h, end);
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
int motion_is_driven(const Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    int same = 1;
    for (size_t k = 0; k < m->contacts; k++)
        same &= force[k] == motion->driven[k];
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->driven_at[k] == motion->body.shapes.place[k].position;
    return same;
}

void motion_note_driven(Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    memcpy(motion->driven, force, m->contacts * sizeof(double));
    for (size_t k = 0; k < m->wheelsets; k++)
        motion->driven_at[k] = motion->body.shapes.place[k].position;
}

const double *motion_driven(Motion *motion, const Shapes *shapes, const double *force)
{
    if (!motion_is_driven(motion, force)) {
        motion_drive(motion, shapes, force, motion->g1);
        motion_note_driven(motion, force);
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
        force[k] = contact_force(&motion->law, k, sign * (motion->z[k] - now->load[k]));
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

const char MOTION_TOO_MANY[] = "takes over 10 million internal steps; use a shorter step";
const char MOTION_NO_CONTACT[] = "the contact forces could not be found: the wheel or rail motions "
                                 "set from outside are far off";

/* Generalised forces of forces from outside at the ends and in the middle of an internal step. */
static void drive_along(Motion *motion, int bulges)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const double *start = motion->now.load, *end = motion->end.load;
    double *g0 = motion->g1, *const *beyond = motion->beyond;
    const int known = motion_is_driven(motion, start);
    motion->g1 = motion->g0;
    motion->g0 = g0;
    if (bulges) {
        body_roll(body, beyond_preload(motion, start, beyond[0]), motion->middle.position,
                  beyond_preload(motion, motion->middle.load, beyond[1]), motion->end.position,
                  beyond_preload(motion, end, beyond[2]), known ? NULL : g0, motion->gm,
                  motion->g1);
    } else {
        if (!known)
            motion_drive(motion, &body->shapes, start, g0);
        motion_drive(motion, &body->shapes, end, motion->g1);
        for (size_t r = 0; r < 2 * m->drives + m->rigid; r++)
            motion->gm[r] = 0.5 * (g0[r] + motion->g1[r]);
    }
    motion_note_driven(motion, end);
}

const char *motion_step(Motion *motion, const InputPath *path, double h, const double *x,
                        double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const int still = motion_still(m, path), bulges = motion_bulges(motion, path, still);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    for (double k = 1; k <= parts; k++) {
        double *to = fmod(parts - k, 2) == 0 ? next : motion->dx; /* the last one is `next` */
        path_part(m, path, h, k, parts, &motion->now, &motion->middle, &motion->end);
        if (m->contact_sign != 0) {
            if (!motion_contact_step(motion, c, x, to))
                return MOTION_NO_CONTACT;
        } else {
            body_shapes(body, motion->now.position);
            drive_along(motion, bulges);
            step_along(body, c, x, motion->g0, motion->gm, motion->g1, to);
        }
        x = to;
    }
    return NULL;
}

int motion_rest(Motion *motion, const Inputs *now, const double *heights, double *x)
{
    const Model *m = motion->body.model;
    double *force = motion->force, *delta = motion->begin;
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
        if (!contact_solve(&motion->law, m->contacts, motion->G, now->load, delta,
                           motion->solving))
            return 0;
        for (size_t k = 0; k < m->contacts; k++)
            force[k] = contact_force(&motion->law, k, delta[k]);
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
