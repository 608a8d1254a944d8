/* Derivatives of motion.c, statement by statement. */
#include "motion.h"

#include <math.h>
#include <string.h>

/* dg = drive of a change of the forces, and of forces on shapes that change. */
static void drive_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                         const double *force, const double *dforce, double *dg)
{
    const Model *m = motion->body.model;
    const size_t n = 2 * m->drives + m->rigid;
    double *beyond = motion->beyond[0], *more = motion->more;
    for (size_t k = 0; k < m->contacts; k++)
        beyond[k] = force[k] - m->preloads[k];
    body_drive(&motion->body, shapes, dforce, dg);
    if (m->nodes == 0)
        return;
    body_drive(&motion->body, slope, beyond, more);
    for (size_t r = 0; r < n; r++)
        dg[r] += more[r];
}

void motion_observe_change(const Motion *motion, const Shapes *shapes, const Shapes *slope,
                           const double *x, const double *dx, double *dz)
{
    const Model *m = motion->body.model;
    body_observe(&motion->body, shapes, dx, dz);
    if (m->nodes == 0)
        return;
    body_observe(&motion->body, slope, x, motion->moved);
    for (size_t k = 0; k < m->contacts; k++)
        dz[k] += motion->moved[k];
}

/* Change of contact forces that deflect the body by G (NULL: not at all):
   df = k sign (dz + G df - dload). */
static void balance_change(const Motion *motion, const double *G, const double *z,
                           const double *load, const double *dz, const double *dload, double *df)
{
    const int sign = motion->body.model->contact_sign;
    const size_t n = motion->body.model->contacts;
    double *A = motion->solving;
    for (size_t k = 0; k < n; k++) {
        const double tangent = sign * contact_stiffness(&motion->law, sign * (z[k] - load[k]));
        df[k] = tangent * (dz[k] - dload[k]);
        for (size_t j = 0; j < n && G != NULL; j++)
            A[k * n + j] = (k == j) - tangent * G[k * n + j];
    }
    if (G != NULL)
        solve_linear(n, A, df);
}

void motion_forces_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                          const double *dx, double *dforce)
{
    memcpy(dforce, change->load, motion->body.model->contacts * sizeof(double));
    if (motion->body.model->contact_sign == 0)
        return;
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    body_observe(&motion->body, shapes, x, motion->z);
    motion_observe_change(motion, shapes, slope, x, dx, motion->dz);
    balance_change(motion, NULL, motion->z, now->load, motion->dz, change->load, dforce);
}

void motion_rate_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        const double *dx, double *drate)
{
    double *force = motion->force, *dforce = motion->dforce;
    motion_forces(motion, now, x, force);
    motion_forces_change(motion, now, x, change, dx, dforce);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    drive_change(motion, shapes, slope, force, dforce, motion->dg);
    body_rate(&motion->body, dx, motion->dg, drate);
}

void motion_rest_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        double *dx)
{
    const Model *m = motion->body.model;
    if (m->nodes == 0) { /* held at its heights, whatever the inputs */
        memset(dx, 0, m->states * sizeof(double));
        return;
    }
    double *force = motion->force, *dforce = motion->dforce;
    motion_forces(motion, now, x, force);
    memcpy(dforce, change->load, m->contacts * sizeof(double));
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    if (m->contact_sign != 0) {
        body_compliance(&motion->body, shapes, motion->body.flexibility, 0, motion->G);
        drive_change(motion, shapes, slope, force, motion->none, motion->dg);
        body_at_rest(&motion->body, motion->dg, dx);
        body_observe(&motion->body, shapes, x, motion->z);
        motion_observe_change(motion, shapes, slope, x, dx, motion->dz);
        balance_change(motion, motion->G, motion->z, now->load, motion->dz, change->load, dforce);
    }
    drive_change(motion, shapes, slope, force, dforce, motion->dg);
    body_at_rest(&motion->body, motion->dg, dx);
}

/* Forces and their change at the end of a step that so far went without them; `x` and `dx` are
   moved on by them, and half of what they do to the modes is taken off the bulges. */
static const char *end_change(Motion *motion, const Coefficients *c, const Inputs *now,
                              const Inputs *change, double *x, double *dx, double *force,
                              double *dforce)
{
    Body *body = &motion->body;
    const Shapes *shapes = body_shapes(body, now->position);
    const Shapes *slope = body_slope(body, change->position);
    if (!motion_forces_at_end(motion, c, now, x, force))
        return MOTION_NO_CONTACT;
    motion_drive(motion, shapes, force, motion->dg);
    step_add_end(body, c, motion->dg, x);
    motion_gather(motion, -0.5, motion->dg, motion->q);
    drive_change(motion, shapes, slope, force, motion->none, motion->dg);
    step_add_end(body, c, motion->dg, dx);
    motion_gather(motion, -0.5, motion->dg, motion->dq);
    memcpy(dforce, change->load, body->model->contacts * sizeof(double));
    if (body->model->contact_sign != 0) {
        body_compliance(body, shapes, c->P1, c->R1, motion->G);
        body_observe(body, shapes, x, motion->z);
        motion_observe_change(motion, shapes, slope, x, dx, motion->dz);
        balance_change(motion, motion->G, motion->z, now->load, motion->dz, change->load, dforce);
    }
    body_drive(body, shapes, dforce, motion->dg);
    step_add_end(body, c, motion->dg, dx);
    motion_gather(motion, -0.5, motion->dg, motion->dq);
    return NULL;
}

/* Forces on modes and their change at the start of a step, which so far is free of all others. */
static void start_change(Motion *motion, const Coefficients *c, const Inputs *now,
                         const Inputs *change, double *x, double *dx, const double *force,
                         const double *dforce)
{
    Body *body = &motion->body;
    const size_t bytes = body->model->states * sizeof(double);
    const size_t g_bytes = (2 * body->model->drives + body->model->rigid) * sizeof(double);
    const Shapes *shapes = body_shapes(body, now->position);
    const Shapes *slope = body_slope(body, change->position);
    memset(motion->q, 0, g_bytes);
    memset(motion->dq, 0, g_bytes);
    motion_drive(motion, shapes, force, motion->dg);
    motion_gather(motion, -0.5, motion->dg, motion->q);
    step_free(body, c, x, motion->dg, motion->rate);
    memcpy(x, motion->rate, bytes);
    drive_change(motion, shapes, slope, force, dforce, motion->dg);
    motion_gather(motion, -0.5, motion->dg, motion->dq);
    step_free(body, c, dx, motion->dg, motion->rate);
    memcpy(dx, motion->rate, bytes);
}

/* Forces from outside in the middle of a step, and their change. */
static void middle_change(Motion *motion, const Inputs *now, const Inputs *change)
{
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    motion_drive(motion, shapes, now->load, motion->dg);
    motion_gather(motion, 1, motion->dg, motion->q);
    drive_change(motion, shapes, slope, now->load, change->load, motion->dg);
    motion_gather(motion, 1, motion->dg, motion->dq);
}

const char *motion_step_change(Motion *motion, const InputPath *path, const InputPath *change,
                               double h, double *x, double *dx)
{
    const Model *m = motion->body.model;
    const int still = motion_still(m, path) && motion_still(m, change);
    const int bulges = motion_bulges(motion, path, still) || motion_bulges(motion, change, still);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    double *force = motion->force, *dforce = motion->dforce;
    Inputs *now = &motion->now, *dnow = &motion->dnow;
    path_at(m, path, 0, now);
    path_at(m, change, 0, dnow);
    motion_forces(motion, now, x, force);
    motion_forces_change(motion, now, x, dnow, dx, dforce);
    for (double k = 1; k <= parts; k++) {
        start_change(motion, c, now, dnow, x, dx, force, dforce);
        if (bulges) {
            path_at(m, path, (k - 0.5) / parts * h, now);
            path_at(m, change, (k - 0.5) / parts * h, dnow);
            middle_change(motion, now, dnow);
        }
        path_at(m, path, k / parts * h, now);
        path_at(m, change, k / parts * h, dnow);
        const char *failed = end_change(motion, c, now, dnow, x, dx, force, dforce);
        if (failed != NULL)
            return failed;
        if (bulges) {
            step_add_bulge(&motion->body, c, motion->q, x);
            step_add_bulge(&motion->body, c, motion->dq, dx);
        }
    }
    return NULL;
}
