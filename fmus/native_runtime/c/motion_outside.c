/* Internal steps of a body under forces from outside: forces on the modes go along a parabola through
   those at the ends and in the middle. Shapes on the way are looked at once: only those where a
   communication step ends are kept. All that a step does with a chunk of modes it does while they
   are near; it is the memory that takes time, not the sums. */
#include "motion.h"

#include <string.h>

/* How an internal step goes: whether g0 are known; whether wheels roll; and whether shapes at its end
   are kept, as they are behind the last. */
typedef struct {
    int known, roll, kept;
} Going;

/* Shapes at the end; `place` of a chunk's. */
static const Shapes *at_end(const Body *body, const Going *going)
{
    return going->roll && !going->kept ? &body->slope : &body->shapes;
}

/* Generalised forces of a chunk. */
static void drive_chunk(Motion *motion, const Chunk *chunk, const Going *going)
{
    Body *body = &motion->body;
    const ByParity *f = body->split;
    const Shapes *end = at_end(body, going);
    const size_t place = body_place(body, chunk, 0);
    if (!going->known)
        body_drive_chunk(body, &body->shapes, place, chunk, &f[0], motion->g0);
    if (going->roll) { /* shapes in the middle are nobody's: one chunk may stand where another stood */
        (going->kept ? body_pass : body_pass_by)(body, chunk, 0);
        body_drive_chunk(body, &body->between, 0, chunk, &f[1], motion->gm);
    } else
        body_drive_chunk(body, &body->shapes, place, chunk, &f[1], motion->gm);
    body_drive_chunk(body, end, end == &body->shapes ? place : 0, chunk, &f[2], motion->g1);
}

/* What is not of chunks: local modes, rigid coordinates. */
static void step_others(Motion *motion, const Coefficients *c, const Going *going, const double *x,
                        double *next)
{
    Body *body = &motion->body;
    const ByParity *f = body->split;
    if (!going->known)
        body_drive_rest(body, &body->shapes, motion->beyond[0], &f[0], motion->g0);
    if (going->roll && going->kept)
        body_end_pass(body, 0);
    else if (going->roll)
        body_end_pass_by(body);
    body_drive_rest(body, going->roll ? &body->between : &body->shapes, motion->beyond[1], &f[1],
                    motion->gm);
    body_drive_rest(body, at_end(body, going), motion->beyond[2], &f[2], motion->g1);
    step_rest(body, c, x, motion->g0, motion->gm, motion->g1, next);
}

/* Whether g1 are generalised forces of those at the beginning, which need no shapes then. */
static int knows_begin(const Motion *motion)
{
    const Model *m = motion->body.model;
    int same = memcmp(motion->driven, motion->now.load, m->contacts * sizeof(double)) == 0;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->driven_at[k] == body_rounded(m, motion->now.position[k]);
    return same;
}

void motion_outside_step(Motion *motion, const Coefficients *c, int last, const double *x,
                         double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const double *start = motion->now.load, *end = motion->end.load;
    double *g0 = motion->g1, *const *beyond = motion->beyond;
    Going going = {knows_begin(motion), 0, last};
    if (!going.known)
        body_shapes(body, motion->now.position);
    motion->g1 = motion->g0;
    motion->g0 = g0;
    body_split(m, motion_beyond_preload(motion, start, beyond[0]), &body->split[0]);
    body_split(m, motion_beyond_preload(motion, motion->middle.load, beyond[1]), &body->split[1]);
    body_split(m, motion_beyond_preload(motion, end, beyond[2]), &body->split[2]);
    body_begin_pass(body, motion->middle.position, motion->end.position);
    going.roll = !body_has_passed(body, 0);
    for (size_t k = 0; k < m->chunks; k++) {
        drive_chunk(motion, &m->chunk[k], &going);
        step_chunk(body, c, &m->chunk[k], x, g0, motion->gm, motion->g1, next);
    }
    step_others(motion, c, &going, x, next);
    motion_note_driven(motion, end);
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) /* where shapes may not be */
        motion->driven_at[k] = body->end[k].position;
    motion_forget(motion);
}
