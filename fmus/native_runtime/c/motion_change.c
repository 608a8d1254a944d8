/* Derivatives of motion.c, statement by statement. */
#include "motion.h"

#include <math.h>
#include <string.h>

/* dg = drive of a change of the forces, and of forces on shapes that change. */
void motion_drive_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                         const double *force, const double *dforce, double *dg)
{
    const Model *m = motion->body.model;
    const size_t n = 2 * m->drives + m->rigid;
    double *more = motion->more;
    body_drive(&motion->body, shapes, dforce, dg);
    if (m->nodes == 0)
        return;
    motion_drive(motion, slope, force, more);
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

void motion_rate_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        const double *dx, double *drate)
{
    double *force = motion->force, *dforce = motion->dforce;
    motion_forces(motion, now, x, force);
    motion_forces_change(motion, now, x, change, dx, dforce);
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, shapes, change->position);
    motion_drive_change(motion, shapes, slope, force, dforce, motion->d0);
    body_rate(&motion->body, dx, motion->d0, drate);
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
    const Shapes *slope = body_slope(&motion->body, shapes, change->position);
    if (m->contact_sign != 0) {
        motion_static_compliance(motion, shapes);
        if (m->gaps.count > 0) /* those that are closed; nothing is lifted more */
            gaps_soften(&motion->body, shapes, &motion->gaps, motion->G, motion->moved);
        motion_drive_change(motion, shapes, slope, force, motion->none, motion->d0);
        body_at_rest(&motion->body, motion->d0, dx);
        if (m->gaps.count > 0)
            gaps_rest_change(&motion->body, &motion->gaps, dx);
        body_observe(&motion->body, shapes, x, motion->z);
        motion_observe_change(motion, shapes, slope, x, dx, motion->dz);
        const Question question = motion_at_rest(motion, now->load);
        motion_still_change(motion, now, motion->z, change, motion->dz, dforce);
        balance_change(&question, motion->G, motion->z, dforce, motion->solving);
    }
    motion_drive_change(motion, shapes, slope, force, dforce, motion->d0);
    body_at_rest(&motion->body, motion->d0, dx);
    if (m->gaps.count > 0)
        gaps_rest_change(&motion->body, &motion->gaps, dx);
}

/* Generalised forces of forces from outside, and their change. */
static void drive_both(Motion *motion, const Inputs *now, const Inputs *change, double *g,
                       double *dg)
{
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const Shapes *slope = body_slope(&motion->body, shapes, change->position);
    motion_drive(motion, shapes, now->load, g);
    motion_drive_change(motion, shapes, slope, now->load, change->load, dg);
}

/* An internal step under forces from outside. */
static void step_change(Motion *motion, const Coefficients *c, double *x, double *dx)
{
    const Body *body = &motion->body;
    const size_t bytes = body->model->states * sizeof(double);
    motion->driven[0] = NAN; /* g1 is used for something else */
    drive_both(motion, &motion->now, &motion->dnow, motion->g0, motion->d0);
    drive_both(motion, &motion->middle, &motion->dmiddle, motion->gm, motion->dm);
    drive_both(motion, &motion->end, &motion->dend, motion->g1, motion->d1);
    step_along(body, c, x, motion->g0, motion->gm, motion->g1, motion->rate);
    memcpy(x, motion->rate, bytes);
    step_along(body, c, dx, motion->d0, motion->dm, motion->d1, motion->rate);
    memcpy(dx, motion->rate, bytes);
}

const char *motion_step_change(Motion *motion, const InputPath *path, const InputPath *change,
                               double h, double *x, double *dx)
{
    const Model *m = motion->body.model;
    const int still = motion_still(m, path) && motion_still(m, change);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    const Coefficients *c = motion_coefficients(motion, h / parts);
    for (double k = 1; k <= parts; k++) {
        path_part(m, path, h, k, parts, &motion->now, &motion->middle, &motion->end);
        path_part(m, change, h, k, parts, &motion->dnow, &motion->dmiddle, &motion->dend);
        double *begin = motion->gaps.step, *dbegin = motion->gaps.dbegin;
        gaps_stretch(m, x, begin);
        gaps_stretch(m, dx, dbegin);
        if (m->contact_sign == 0)
            step_change(motion, c, x, dx);
        else if (!motion_contact_step_change(motion, c, x, dx))
            return MOTION_NO_CONTACT;
        if (m->gaps.count > 0 &&
            !gaps_step_change(&motion->body, &motion->gaps, c, begin, dbegin, x, dx))
            return MOTION_NO_GAPS;
    }
    return NULL;
}
