/* Derivative of motion_contact.c, statement by statement. */
#include "motion.h"

#include <string.h>

/* Of `begin` and of the generalised forces that are kept: dinside; d0, dm and d1; dseen[0]. */
static void begin_change(Motion *motion, const double *x, const double *dx)
{
    Body *body = &motion->body;
    double *force = motion->inside, *dforce = motion->dinside;
    const Shapes *shapes = body_shapes(body, motion->now.position);
    const Shapes *slope = body_slope(body, shapes, motion->dnow.position);
    motion_observe_change(motion, shapes, slope, x, dx, motion->dseen[0]);
    motion_known_forces_change(motion, shapes, slope, &motion->now, x, force, motion->seen[0],
                               &motion->dnow, dx, motion->dseen[0], dforce);
    motion_drive_change(motion, shapes, slope, force, dforce, motion->d0);
    shapes = body_shapes_between(body, motion->middle.position);
    slope = body_slope(body, shapes, motion->dmiddle.position);
    motion_drive_change(motion, shapes, slope, force, dforce, motion->dm);
    shapes = body_shapes(body, motion->end.position);
    slope = body_slope(body, shapes, motion->dend.position);
    motion_drive_change(motion, shapes, slope, force, dforce, motion->d1);
}

/* Of the motions on average and at the end under the forces at the beginning; dx at the end is
   in motion->drate, x is in motion->rate. */
static void free_change(Motion *motion, const Coefficients *c, const double *x, const double *dx)
{
    Body *body = &motion->body;
    begin_change(motion, x, dx);
    step_and_average(body, c, dx, motion->d0, motion->dm, motion->d1, motion->drate,
                     motion->dpart);
    const Shapes *shapes = &body->shapes, *slope = &body->slope; /* at the end */
    motion_observe_change(motion, shapes, slope, motion->rate, motion->drate, motion->dseen[1]);
    shapes = body_shapes_between(body, motion->middle.position);
    slope = body_slope(body, shapes, motion->dmiddle.position);
    motion_observe_change(motion, shapes, slope, motion->part, motion->dpart, motion->dseen[2]);
    if (motion->law.of_rates) {
        motion_observe_change(motion, shapes, slope, x, dx, motion->passed[0]);
        motion_observe_change(motion, shapes, slope, motion->rate, motion->drate,
                              motion->passed[1]);
        motion_rolled(motion, motion->dseen, motion->passed, motion->drolled);
    }
    motion_average(motion, motion->dseen, motion->dfree);
    motion_average_load(motion, &motion->dnow, &motion->dmiddle, &motion->dend,
                        motion->dmean_load);
}

/* Generalised forces of what forces over the step [means, slopes] are beyond those at the
   beginning. */
static void drive_line(Motion *motion, const Shapes *shapes, const double *over,
                       const double *inside, double *mean, double *slope)
{
    const size_t n = motion->body.model->contacts;
    double *beyond = motion->beyond[0];
    for (size_t k = 0; k < n; k++)
        beyond[k] = over[k] - inside[k];
    body_drive(&motion->body, shapes, beyond, mean);
    body_drive(&motion->body, shapes, over + n, slope);
}

/* Of what the line of forces beyond those at the beginning does to motions, where the shapes
   change but it does not; and that, itself and its change, added to the states at the end. */
static void line_change(Motion *motion, const Coefficients *c)
{
    Body *body = &motion->body;
    const size_t n = body->model->contacts, bytes = body->model->states * sizeof(double);
    const Shapes *shapes = body_shapes_between(body, motion->middle.position);
    const Shapes *slope = &body->slope;
    double *part = motion->part, *dpart = motion->dpart;
    drive_line(motion, shapes, motion->over, motion->inside, motion->dm, motion->d1);
    memset(motion->d0, 0, (2 * body->model->drives + body->model->rigid) * sizeof(double));
    memset(motion->gm, 0, (2 * body->model->drives + body->model->rigid) * sizeof(double));
    if (body->model->nodes > 0)
        drive_line(motion, slope, motion->over, motion->inside, motion->d0, motion->gm);
    for (int end = 0; end < 2; end++) {
        memset(part, 0, bytes);
        memset(dpart, 0, bytes);
        step_add(body, c, !end, motion->dm, motion->d1, part);
        step_add(body, c, !end, motion->d0, motion->gm, dpart);
        motion_observe_change(motion, shapes, slope, part, dpart, motion->dz);
        for (size_t k = 0; k < n; k++)
            motion->dfree[(end ? n : 0) + k] += motion->dz[k];
    }
    for (size_t r = 0; r < body->model->states; r++) {
        motion->rate[r] += part[r];
        motion->drate[r] += dpart[r];
    }
}

int motion_contact_step_change(Motion *motion, const Coefficients *c, double *x, double *dx)
{
    Body *body = &motion->body;
    const size_t bytes = body->model->states * sizeof(double);
    body_observe(body, body_shapes(body, motion->now.position), x, motion->seen[0]);
    motion_forget(motion); /* the last step is made once more */
    const int found = motion_find_forces(motion, c, motion->seen[0], x, motion->rate);
    motion_forget(motion);
    if (!found)
        return 0;
    free_change(motion, c, x, dx);
    line_change(motion, c);
    if (!motion_balance_change(motion, c))
        return 0;
    drive_line(motion, body_shapes_between(body, motion->middle.position), motion->dover,
               motion->dinside, motion->dm, motion->d1);
    step_add(body, c, 0, motion->dm, motion->d1, motion->drate);
    memcpy(x, motion->rate, bytes);
    memcpy(dx, motion->drate, bytes);
    return 1;
}
