/* Derivatives of motion.c, statement by statement. */
#include "motion.h"

#include <math.h>
#include <string.h>

/* dg = drive of a change of the forces, and of forces on shapes that change. */
static void drive_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                         const double force[WHEELS], const double dforce[WHEELS], double *dg)
{
    const Model *m = motion->body.model;
    const size_t n = 2 * m->modes + m->rigid;
    double beyond[WHEELS], *more = motion->dg;
    for (size_t k = 0; k < WHEELS; k++)
        beyond[k] = force[k] - m->preload;
    body_drive(&motion->body, shapes, dforce, dg);
    if (m->nodes == 0)
        return;
    body_drive(&motion->body, slope, beyond, more);
    for (size_t r = 0; r < n; r++)
        dg[r] += more[r];
}

void motion_observe_change(const Motion *motion, const Shapes *shapes, const Shapes *slope,
                           const double *x, const double *dx, double dz[WHEELS])
{
    double moved[WHEELS];
    body_observe(&motion->body, shapes, dx, dz);
    if (motion->body.model->nodes == 0)
        return;
    body_observe(&motion->body, slope, x, moved);
    for (size_t k = 0; k < WHEELS; k++)
        dz[k] += moved[k];
}

/* Change of contact forces that deflect the body by G: df = k sign (dz + G df - dload). */
static void balance_change(const Motion *motion, const double G[WHEELS * WHEELS],
                           const double z[WHEELS], const double load[WHEELS],
                           const double dz[WHEELS], const double dload[WHEELS], double df[WHEELS])
{
    const int sign = motion->body.model->contact_sign;
    double A[WHEELS * WHEELS];
    for (size_t k = 0; k < WHEELS; k++) {
        const double tangent = sign * contact_stiffness(&motion->law, sign * (z[k] - load[k]));
        df[k] = tangent * (dz[k] - dload[k]);
        for (size_t j = 0; j < WHEELS; j++)
            A[k * WHEELS + j] = (k == j) - tangent * G[k * WHEELS + j];
    }
    solve_wheels(A, df);
}

void motion_forces_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                          const double *dx, double dforce[WHEELS])
{
    static const double NONE[WHEELS * WHEELS] = {0};
    memcpy(dforce, change->load, WHEELS * sizeof(double));
    if (motion->body.model->contact_sign == 0)
        return;
    double z[WHEELS], dz[WHEELS];
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    body_observe(&motion->body, shapes, x, z);
    motion_observe_change(motion, shapes, slope, x, dx, dz);
    balance_change(motion, NONE, z, now->load, dz, change->load, dforce);
}

void motion_rate_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        const double *dx, double *drate)
{
    double force[WHEELS], dforce[WHEELS];
    motion_forces(motion, now, x, force);
    motion_forces_change(motion, now, x, change, dx, dforce);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    drive_change(motion, shapes, slope, force, dforce, motion->g1);
    body_rate(&motion->body, dx, motion->g1, drate);
}

void motion_rest_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        double *dx)
{
    const Model *m = motion->body.model;
    if (m->nodes == 0) { /* held at its heights, whatever the inputs */
        memset(dx, 0, m->states * sizeof(double));
        return;
    }
    double force[WHEELS], dforce[WHEELS], z[WHEELS], dz[WHEELS], G[WHEELS * WHEELS];
    motion_forces(motion, now, x, force);
    memcpy(dforce, change->load, sizeof dforce);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    if (m->contact_sign != 0) {
        static const double NONE[WHEELS] = {0};
        body_compliance(&motion->body, shapes, motion->body.flexibility, 0, G);
        drive_change(motion, shapes, slope, force, NONE, motion->g1);
        body_at_rest(&motion->body, motion->g1, dx);
        body_observe(&motion->body, shapes, x, z);
        motion_observe_change(motion, shapes, slope, x, dx, dz);
        balance_change(motion, G, z, now->load, dz, change->load, dforce);
    }
    drive_change(motion, shapes, slope, force, dforce, motion->g1);
    body_at_rest(&motion->body, motion->g1, dx);
}

/* Forces and their change at the end of a step that so far went without them; `x` and `dx` are
   moved on by them, and half of what they do to the modes is taken off the bulges. */
static const char *end_change(Motion *motion, const Coefficients *c, const Inputs *now,
                              const Inputs *change, double *x, double *dx, double force[WHEELS],
                              double dforce[WHEELS])
{
    static const double NONE[WHEELS] = {0};
    Body *body = &motion->body;
    const Shapes *shapes = body_shapes(body, now->position);
    const Shapes *slope = body_slope(body, change->position);
    if (!motion_forces_at_end(motion, c, now, x, force))
        return MOTION_NO_CONTACT;
    motion_drive(motion, shapes, force, motion->g1);
    step_add_end(body, c, motion->g1, x);
    motion_gather(motion, -0.5, motion->g1, motion->q);
    drive_change(motion, shapes, slope, force, NONE, motion->g1);
    step_add_end(body, c, motion->g1, dx);
    motion_gather(motion, -0.5, motion->g1, motion->dq);
    memcpy(dforce, change->load, WHEELS * sizeof(double));
    if (body->model->contact_sign != 0) {
        double G[WHEELS * WHEELS], z[WHEELS], dz[WHEELS];
        body_compliance(body, shapes, c->P1, c->R1, G);
        body_observe(body, shapes, x, z);
        motion_observe_change(motion, shapes, slope, x, dx, dz);
        balance_change(motion, G, z, now->load, dz, change->load, dforce);
    }
    body_drive(body, shapes, dforce, motion->g1);
    step_add_end(body, c, motion->g1, dx);
    motion_gather(motion, -0.5, motion->g1, motion->dq);
    return NULL;
}

/* Forces on modes and their change at the start of a step, which so far is free of all others. */
static void start_change(Motion *motion, const Coefficients *c, const Inputs *now,
                         const Inputs *change, double *x, double *dx, const double force[WHEELS],
                         const double dforce[WHEELS])
{
    Body *body = &motion->body;
    const size_t bytes = body->model->states * sizeof(double);
    const size_t g_bytes = (2 * body->model->modes + body->model->rigid) * sizeof(double);
    const Shapes *shapes = body_shapes(body, now->position);
    const Shapes *slope = body_slope(body, change->position);
    memset(motion->q, 0, g_bytes);
    memset(motion->dq, 0, g_bytes);
    motion_drive(motion, shapes, force, motion->g1);
    motion_gather(motion, -0.5, motion->g1, motion->q);
    step_free(body, c, x, motion->g1, motion->rate);
    memcpy(x, motion->rate, bytes);
    drive_change(motion, shapes, slope, force, dforce, motion->g1);
    motion_gather(motion, -0.5, motion->g1, motion->dq);
    step_free(body, c, dx, motion->g1, motion->rate);
    memcpy(dx, motion->rate, bytes);
}

/* Forces from outside in the middle of a step, and their change. */
static void middle_change(Motion *motion, const Inputs *now, const Inputs *change)
{
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, change->position);
    motion_drive(motion, shapes, now->load, motion->g1);
    motion_gather(motion, 1, motion->g1, motion->q);
    drive_change(motion, shapes, slope, now->load, change->load, motion->g1);
    motion_gather(motion, 1, motion->g1, motion->dq);
}

const char *motion_step_change(Motion *motion, const InputPath *path, const InputPath *change,
                               double h, double *x, double *dx)
{
    const int still = motion_still(path) && motion_still(change);
    const int bulges = motion_bulges(motion, path, still) || motion_bulges(motion, change, still);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    double force[WHEELS], dforce[WHEELS];
    Inputs now = path_at(path, 0), dnow = path_at(change, 0);
    motion_forces(motion, &now, x, force);
    motion_forces_change(motion, &now, x, &dnow, dx, dforce);
    for (double k = 1; k <= parts; k++) {
        start_change(motion, c, &now, &dnow, x, dx, force, dforce);
        if (bulges) {
            now = path_at(path, (k - 0.5) / parts * h);
            dnow = path_at(change, (k - 0.5) / parts * h);
            middle_change(motion, &now, &dnow);
        }
        now = path_at(path, k / parts * h);
        dnow = path_at(change, k / parts * h);
        const char *failed = end_change(motion, c, &now, &dnow, x, dx, force, dforce);
        if (failed != NULL)
            return failed;
        if (bulges) {
            step_add_bulge(&motion->body, c, motion->q, x);
            step_add_bulge(&motion->body, c, motion->dq, dx);
        }
    }
    return NULL;
}
