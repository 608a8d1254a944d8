/* Internal steps of a body under forces from outside: forces on the modes go along a parabola through
   those at the ends and in the middle. All that a step does with a chunk of modes it does while they
   are near; it is the memory that takes time, not the sums. */
#include "motion.h"

/* Generalised forces of a chunk; whether wheels `roll`, and g0 are `known`. */
static void drive_chunk(Motion *motion, const Chunk *chunk, int roll, int known)
{
    Body *body = &motion->body;
    const ByParity *f = body->split;
    const size_t place = body_place(body, chunk, 0);
    if (!known)
        body_drive_chunk(body, &body->shapes, place, chunk, &f[0], motion->g0);
    if (roll) { /* shapes in the middle are nobody's: one chunk may stand where another stood */
        body_pass(body, chunk, 0);
        body_drive_chunk(body, &body->between, 0, chunk, &f[1], motion->gm);
    } else
        body_drive_chunk(body, &body->shapes, place, chunk, &f[1], motion->gm);
    body_drive_chunk(body, &body->shapes, place, chunk, &f[2], motion->g1);
}

/* What is not of chunks: local modes, rigid coordinates. */
static void step_others(Motion *motion, const Coefficients *c, int roll, int known,
                        const double *x, double *next)
{
    Body *body = &motion->body;
    const ByParity *f = body->split;
    if (!known)
        body_drive_rest(body, &body->shapes, motion->beyond[0], &f[0], motion->g0);
    if (roll)
        body_end_pass(body, 0);
    body_drive_rest(body, roll ? &body->between : &body->shapes, motion->beyond[1], &f[1],
                    motion->gm);
    body_drive_rest(body, &body->shapes, motion->beyond[2], &f[2], motion->g1);
    step_rest(body, c, x, motion->g0, motion->gm, motion->g1, next);
}

void motion_outside_step(Motion *motion, const Coefficients *c, const double *x, double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const double *start = motion->now.load, *end = motion->end.load;
    double *g0 = motion->g1, *const *beyond = motion->beyond;
    body_shapes(body, motion->now.position);
    const int known = motion_is_driven(motion, start);
    motion->g1 = motion->g0;
    motion->g0 = g0;
    body_split(m, motion_beyond_preload(motion, start, beyond[0]), &body->split[0]);
    body_split(m, motion_beyond_preload(motion, motion->middle.load, beyond[1]), &body->split[1]);
    body_split(m, motion_beyond_preload(motion, end, beyond[2]), &body->split[2]);
    body_begin_pass(body, motion->middle.position, motion->end.position);
    const int roll = !body_has_passed(body, 0);
    for (size_t k = 0; k < m->chunks; k++) {
        drive_chunk(motion, &m->chunk[k], roll, known);
        step_chunk(body, c, &m->chunk[k], x, g0, motion->gm, motion->g1, next);
    }
    step_others(motion, c, roll, known, x, next);
    motion_note_driven(motion, end);
    motion_forget(motion);
}
