#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int motion_create(Motion *motion, const Model *model)
{
    memset(motion, 0, sizeof *motion);
    const size_t g = 2 * model->modes + model->rigid, x = model->states;
    const size_t each = 8 * model->modes;
    motion->memory = calloc(5 * g + 3 * x + KEPT_STEPS * each, sizeof(double));
    if (motion->memory == NULL || !body_create(&motion->body, model)) {
        motion_free(motion);
        return 0;
    }
    double *at = motion->memory;
    motion->g0 = at;
    motion->g1 = at += g;
    motion->dg = at += g;
    motion->q = at += g;
    motion->dq = at += g;
    motion->rate = at += g;
    motion->drate = at += x;
    motion->dx = at += x;
    at += x;
    for (int k = 0; k < KEPT_STEPS; k++, at += each) {
        motion->kept[k].E = at;
        motion->kept[k].P0 = at + each / 4;
        motion->kept[k].P1 = at + each / 2;
        motion->kept[k].Q = at + 3 * each / 4;
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

Inputs path_at(const InputPath *path, double t)
{
    Inputs now;
    for (size_t k = 0; k < WHEELSETS; k++)
        now.position[k] = along(path->start.position[k], path->slope.position[k],
                                path->curve.position[k], t);
    for (size_t k = 0; k < WHEELS; k++)
        now.load[k] = along(path->start.load[k], path->slope.load[k], path->curve.load[k], t);
    return now;
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

void motion_drive(Motion *motion, const Shapes *shapes, const double force[WHEELS], double *g)
{
    double beyond[WHEELS];
    for (size_t k = 0; k < WHEELS; k++)
        beyond[k] = force[k] - motion->body.model->preload;
    body_drive(&motion->body, shapes, beyond, g);
}

void motion_forces(Motion *motion, const Inputs *now, const double *x, double force[WHEELS])
{
    const int sign = motion->body.model->contact_sign;
    if (sign == 0) {
        memcpy(force, now->load, WHEELS * sizeof(double));
        return;
    }
    double z[WHEELS];
    body_observe(&motion->body, body_shapes(&motion->body, now->position), x, z);
    for (size_t k = 0; k < WHEELS; k++)
        force[k] = contact_force(&motion->law, sign * (z[k] - now->load[k]));
}

int motion_forces_at_end(Motion *motion, const Coefficients *c, const Inputs *now, const double *x,
                         double force[WHEELS])
{
    const Model *m = motion->body.model;
    if (m->contact_sign == 0) {
        memcpy(force, now->load, WHEELS * sizeof(double));
        return 1;
    }
    double G[WHEELS * WHEELS], z[WHEELS], gap[WHEELS], delta[WHEELS];
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    /* Displacement at the end of a step per force at its end. */
    body_compliance(&motion->body, shapes, c->P1, c->R1, G);
    body_observe(&motion->body, shapes, x, z);
    for (size_t k = 0; k < WHEELS; k++) {
        gap[k] = m->contact_sign * (z[k] - now->load[k]);
        for (size_t j = 0; j < WHEELS; j++) {
            G[k * WHEELS + j] *= -m->contact_sign;
            gap[k] += G[k * WHEELS + j] * m->preload;
        }
    }
    if (!contact_solve(&motion->law, G, gap, delta))
        return 0;
    for (size_t k = 0; k < WHEELS; k++)
        force[k] = contact_force(&motion->law, delta[k]);
    return 1;
}

int motion_still(const InputPath *path)
{
    for (size_t k = 0; k < WHEELSETS; k++)
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
    if (motion->body.model->contact_sign != 0)
        return 0;
    int curved = !is_still && motion->body.model->nodes > 0;
    for (size_t k = 0; k < WHEELS; k++)
        curved |= path->curve.load[k] != 0;
    return curved;
}

void motion_gather(const Motion *motion, double a, const double *g, double *q)
{
    const size_t n = 2 * motion->body.model->modes + motion->body.model->rigid;
    for (size_t r = 0; r < n; r++)
        q[r] += a * g[r];
}

/* Forces on modes in the middle of a step, in motion->q: with those at its ends they say how far
   the forces bulge. */
static void drive_middle(Motion *motion, const Inputs *middle)
{
    motion_drive(motion, body_shapes(&motion->body, middle->position), middle->load, motion->q);
}

const char MOTION_TOO_MANY[] = "takes over 10 million internal steps; use a shorter step";
const char MOTION_NO_CONTACT[] = "the contact forces could not be found: the wheel or rail motions "
                                 "set from outside are far off";

const char *motion_step(Motion *motion, const InputPath *path, double h, const double *x,
                        double *next)
{
    Body *body = &motion->body;
    const int still = motion_still(path), bulges = motion_bulges(motion, path, still);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    double force[WHEELS];
    Inputs now = path_at(path, 0);
    const Shapes *shapes = body_shapes(body, now.position);
    motion_forces(motion, &now, x, force);
    motion_drive(motion, shapes, force, motion->g1);
    for (double k = 1; k <= parts; k++) {
        double *to = fmod(parts - k, 2) == 0 ? next : motion->dx; /* the last one is `next` */
        double *g0 = motion->g1;
        motion->g1 = motion->g0;
        motion->g0 = g0;
        if (bulges) {
            now = path_at(path, (k - 0.5) / parts * h);
            drive_middle(motion, &now);
        }
        now = path_at(path, k / parts * h);
        step_free(body, c, x, motion->g0, to);
        shapes = body_shapes(body, now.position);
        if (!motion_forces_at_end(motion, c, &now, to, force))
            return MOTION_NO_CONTACT;
        motion_drive(motion, shapes, force, motion->g1);
        step_add_end(body, c, motion->g1, to);
        if (bulges) {
            motion_gather(motion, -0.5, motion->g0, motion->q);
            motion_gather(motion, -0.5, motion->g1, motion->q);
            step_add_bulge(body, c, motion->q, to);
        }
        x = to;
    }
    return NULL;
}

int motion_rest(Motion *motion, const Inputs *now, const double heights[WHEELSETS], double *x)
{
    const Model *m = motion->body.model;
    double force[WHEELS], G[WHEELS * WHEELS], delta[WHEELS];
    if (m->nodes == 0) {
        memset(x, 0, m->states * sizeof(double));
        for (size_t k = 0; k < WHEELSETS; k++) {
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
    memcpy(force, now->load, sizeof force);
    if (m->contact_sign != 0) {
        body_compliance(&motion->body, shapes, motion->body.flexibility, 0, G);
        if (!contact_solve(&motion->law, G, now->load, delta))
            return 0;
        for (size_t k = 0; k < WHEELS; k++)
            force[k] = contact_force(&motion->law, delta[k]);
    }
    motion_drive(motion, shapes, force, motion->g1);
    body_at_rest(&motion->body, motion->g1, x);
    return 1;
}

void motion_rate(Motion *motion, const Inputs *now, const double *x, double *rate)
{
    double force[WHEELS];
    motion_forces(motion, now, x, force);
    motion_drive(motion, body_shapes(&motion->body, now->position), force, motion->g1);
    body_rate(&motion->body, x, motion->g1, rate);
}
