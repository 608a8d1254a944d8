/* Steps of a body under forces from outside, in parts: over each, forces on the modes go along a parabola
   through those at the ends and in the middle. It is the memory that takes time, not the sums: so
   many parts are made of one chunk of modes, while it is near, before the next chunk. Shapes on the
   way are looked at once; only those where a step ends are kept. */
#include "motion.h"

#include <string.h>

/* Parts of a step that are made together. */
typedef struct {
    const Coefficients *c;
    const double *x;    /* before them */
    double *next;       /* see motion_after */
    double before, all; /* parts of the step before them, and in all */
    size_t parts;
    int known;          /* whether g0 are those of the beginning */
    int rolls[TOGETHER]; /* whether wheels are elsewhere than where shapes are */
    const Shapes *begin; /* those shapes */
} Lot;

static double *after(const Motion *motion, const Lot *lot, size_t part)
{
    return motion_after(motion, lot->before + 1 + (double)part, lot->all, lot->next);
}

static int is_last(const Lot *lot, size_t part)
{
    return lot->before + 1 + (double)part == lot->all;
}

/* Shapes at the end of a part. */
static const Shapes *at_end(const Body *body, const Lot *lot, size_t part)
{
    if (!lot->rolls[part])
        return lot->begin;
    return is_last(lot, part) ? &body->shapes : &body->slope;
}

static void swap(double **a, double **b)
{
    double *kept = *a;
    *a = *b;
    *b = kept;
}

/* All parts of a chunk; whether shapes that are nobody's, in the middle and at ends on the way, stand
   one chunk's where another's stood. g[0] and g[1] are generalised forces at the ends. */
static void move_chunk(Motion *motion, const Lot *lot, const Chunk *chunk, double *g[2])
{
    Body *body = &motion->body;
    const size_t place = body_place(body, chunk, 0);
    const double *x = lot->x;
    double *g0 = g[0], *g1 = g[1];
    if (!lot->known)
        body_drive_chunk(body, lot->begin, place, chunk, &body->split[0], g0);
    for (size_t k = 0; k < lot->parts; k++, swap(&g0, &g1)) {
        const ByParity *middle = &motion->split_of[2 * k], *end = middle + 1;
        const Shapes *shapes = at_end(body, lot, k);
        double *to = after(motion, lot, k);
        body_choose_part(body, k);
        if (lot->rolls[k]) {
            (is_last(lot, k) ? body_pass : body_pass_by)(body, chunk, 0);
            body_drive_chunk(body, &body->between, 0, chunk, middle, motion->gm);
        } else
            body_drive_chunk(body, lot->begin, place, chunk, middle, motion->gm);
        body_drive_chunk(body, shapes, shapes == &body->slope ? 0 : place, chunk, end, g1);
        step_chunk(body, lot->c, chunk, x, g0, motion->gm, g1, to);
        x = to;
    }
}

/* The same of what is not of chunks: local modes, rigid coordinates. */
static void move_others(Motion *motion, const Lot *lot, double *g[2])
{
    Body *body = &motion->body;
    const double *x = lot->x;
    double *g0 = g[0], *g1 = g[1];
    if (!lot->known)
        body_drive_rest(body, lot->begin, motion->beyond[0], &body->split[0], g0);
    for (size_t k = 0; k < lot->parts; k++, swap(&g0, &g1)) {
        const ByParity *middle = &motion->split_of[2 * k], *end = middle + 1;
        double *const *beyond = &motion->beyond_of[2 * k], *to = after(motion, lot, k);
        body_choose_part(body, k);
        if (lot->rolls[k] && is_last(lot, k))
            body_end_pass(body, 0);
        else if (lot->rolls[k])
            body_end_pass_by(body);
        body_drive_rest(body, lot->rolls[k] ? &body->between : lot->begin, beyond[0], middle,
                        motion->gm);
        body_drive_rest(body, at_end(body, lot, k), beyond[1], end, g1);
        step_rest(body, lot->c, x, g0, motion->gm, g1, to);
        x = to;
    }
}

/* Whether g1 are generalised forces of those at the beginning, which need no shapes then. */
static int knows_begin(const Motion *motion)
{
    const Model *m = motion->body.model;
    int same = 1;
    for (size_t k = 0; k < m->contacts; k++)
        same &= motion->driven[k] == motion->now.load[k];
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->driven_at[k] == body_rounded(m, motion->now.position[k]);
    return same;
}

static void split(Motion *motion, const double *load, size_t at)
{
    body_split(motion->body.model, motion_beyond_preload(motion, load, motion->beyond_of[at]),
               &motion->split_of[at]);
}

/* Forces and places of all parts, and of the beginning; in motion->force those at the end. */
static void plan(Motion *motion, const InputPath *path, double h, Lot *lot)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    for (size_t k = lot->parts; k-- > 0;) { /* so `now` is then the beginning */
        path_part(m, path, h, lot->before + 1 + (double)k, lot->all, &motion->now, &motion->middle,
                  &motion->end);
        body_choose_part(body, k);
        body_begin_pass(body, motion->middle.position, motion->end.position);
        split(motion, motion->middle.load, 2 * k);
        split(motion, motion->end.load, 2 * k + 1);
        if (k + 1 == lot->parts)
            memcpy(motion->force, motion->end.load, m->contacts * sizeof(double));
    }
    lot->known = knows_begin(motion);
    if (!lot->known)
        body_shapes(body, motion->now.position);
    body_split(m, motion_beyond_preload(motion, motion->now.load, motion->beyond[0]),
               &body->split[0]);
    for (size_t k = 0; k < lot->parts; k++) {
        body_choose_part(body, k);
        lot->rolls[k] = !body_has_passed(body, 0);
    }
    const int passes = lot->rolls[lot->parts - 1] && is_last(lot, lot->parts - 1);
    lot->begin = passes ? body_keep(body, motion->now.position) : &body->shapes;
}

static void move(Motion *motion, const InputPath *path, double h, Lot *lot)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    double *g[2] = {motion->g1, motion->g0};
    plan(motion, path, h, lot);
    for (size_t k = 0; k < m->chunks; k++)
        move_chunk(motion, lot, &m->chunk[k], g);
    move_others(motion, lot, g);
    motion->g1 = g[lot->parts % 2];
    motion->g0 = g[1 - lot->parts % 2];
    memcpy(motion->driven, motion->force, m->contacts * sizeof(double));
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) /* where shapes may not be */
        motion->driven_at[k] = body->end[k].position;
    lot->x = after(motion, lot, lot->parts - 1);
    lot->before += (double)lot->parts;
}

void motion_outside_step(Motion *motion, const InputPath *path, double h, double before,
                         double until, double parts, const double *x, double *next)
{
    Lot lot = {motion_coefficients(motion, h / parts), x, next, before, parts, 0, 0, {0}, NULL};
    while (lot.before < until) {
        lot.parts = (size_t)fmin(TOGETHER, until - lot.before);
        move(motion, path, h, &lot);
    }
    motion_forget(motion);
}
