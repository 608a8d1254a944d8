/* Internal steps of a body with contacts of its own.

   Over a step the body first goes on under the forces that its contacts have at the beginning, while
   the wheelsets roll. What the forces change by is a line in time, whose effects are those of
   wheelsets that stay where they are in the middle of the step. It is the line nearest to the law
   along the parabola with the compressions at the beginning, at the end and on average over the
   step. Where wheels do not roll these are exact for that line, so linear springs give up what its
   work on the body is, whatever the step: nothing grows, however stiff they are. Wheels at rest are
   stepped to fourth order, rolling ones to third.

   E. Hairer, Energy-preserving variant of collocation methods, JNAIAM 5 (2010) 73-84: the same for
   free masses. */
#include "motion.h"

#include <string.h>

/* z[0] and z[1] are displacements at the ends, z[2] those in the middle of how the state on average
   differs from a sixth of both: where wheels do not roll it is exact, elsewhere Simpson's rule finds
   what the shapes' change adds. */
void motion_average(const Motion *motion, double *const z[3], double *motions)
{
    const size_t n = motion->body.model->contacts;
    for (size_t k = 0; k < n; k++) {
        motions[k] = z[2][k] + (z[0][k] + z[1][k]) / 6;
        motions[n + k] = z[1][k];
    }
}

void motion_average_load(const Motion *motion, const Inputs *begin, const Inputs *middle,
                         const Inputs *end, double *load)
{
    const Model *m = motion->body.model;
    for (size_t k = 0; k < inputs_size(m) - m->wheelsets; k++)
        load[k] = (begin->load[k] + 4 * middle->load[k] + end->load[k]) / 6;
}

void motion_rolled(const Motion *motion, double *const z[3], double *const passed[2],
                   double *const rolled[3])
{
    for (size_t k = 0; k < motion->body.model->contacts; k++) {
        rolled[0][k] = z[0][k] - passed[0][k];
        rolled[2][k] = z[1][k] - passed[1][k];
        rolled[1][k] = (rolled[0][k] + rolled[2][k]) / 6;
    }
}

/* Forces at the beginning, motion->inside; z are the displacements then. */
static int begin(Motion *motion, const double *z, const double *x)
{
    const size_t n = motion->body.model->contacts;
    if (motion->law.of_rates) {
        if (!motion_last_forces(motion, &motion->now, x))
            return 0;
        memcpy(motion->inside, motion->last.under, n * sizeof(double));
        memcpy(motion->seen[0], motion->last.z, n * sizeof(double));
        memcpy(motion->v, motion->last.vz, n * sizeof(double));
        return 1;
    }
    memmove(motion->seen[0], z, n * sizeof(double));
    for (size_t k = 0; k < n; k++)
        motion->inside[k] = motion_pressed(motion, k, motion->seen[0], motion->now.load);
    return 1;
}

/* The forces at the beginning kept over the step. */
typedef struct {
    const Coefficients *c;
    const double *x;
    double *next;
    int known, passed, responds; /* whether g0 are known, and the shapes; and G is asked for */
    int stays;                   /* whether all shapes are those at the beginning */
} Kept;

/* Generalised forces in the middle and at the end, which g0 are as well where wheels stay. */
static double *gm_of(const Motion *motion, const Kept *kept)
{
    return kept->stays ? motion->g0 : motion->gm;
}

static double *g1_of(const Motion *motion, const Kept *kept)
{
    return kept->stays ? motion->g0 : motion->g1;
}

static void keep_chunk(Motion *motion, const Kept *kept, const Chunk *chunk)
{
    Body *body = &motion->body;
    const Coefficients *c = kept->c;
    const Shapes *shapes = &body->shapes, *between = kept->stays ? shapes : body_between(body);
    const ByParity *f = &body->split[0];
    const size_t place = body_place(body, chunk, 0);
    if (!kept->known)
        body_drive_chunk(body, shapes, place, chunk, f, motion->g0);
    if (!kept->passed)
        body_pass(body, chunk, place);
    if (!kept->stays) {
        body_drive_chunk(body, between, place, chunk, f, motion->gm);
        body_drive_chunk(body, shapes, place, chunk, f, motion->g1);
    }
    average_chunk(body, c, chunk, kept->x, motion->g0, gm_of(motion, kept), g1_of(motion, kept),
                  kept->next, motion->part);
    body_observe_chunk(body, shapes, chunk, kept->next, &body->split[1]);
    body_observe_chunk(body, between, chunk, motion->part, &body->split[2]);
    if (motion->law.of_rates)
        body_observe_both(body, between, chunk, kept->x, kept->next, &body->split[3],
                          &body->split[4]);
    if (kept->responds) {
        const Weights weights = motion_weights(c);
        body_respond_chunk(body, between, chunk, weights.modes, 0);
    }
}

static void keep_others(Motion *motion, const Kept *kept)
{
    Body *body = &motion->body;
    const ByParity *f = &body->split[0];
    const double *beyond = motion->beyond[0];
    if (!kept->known)
        body_drive_rest(body, &body->shapes, beyond, f, motion->g0);
    if (!kept->passed)
        body_end_pass(body, 1);
    if (!kept->stays) {
        body_drive_rest(body, body_between(body), beyond, f, motion->gm);
        body_drive_rest(body, &body->shapes, beyond, f, motion->g1);
    }
    average_rest(body, kept->c, kept->x, motion->g0, gm_of(motion, kept), g1_of(motion, kept),
                 kept->next, motion->part);
    body_observe_rest(body, &body->shapes, kept->next, &body->split[1], motion->seen[1]);
    body_observe_rest(body, body_between(body), motion->part, &body->split[2], motion->seen[2]);
    for (int end = 0; motion->law.of_rates && end < 2; end++)
        body_observe_rest(body, body_between(body), end ? kept->next : kept->x,
                          &body->split[3 + end], motion->passed[end]);
    if (kept->responds)
        motion_find_compliances(motion, kept->c);
}

/* next = state after the step under the forces at the beginning, with generalised ones in g0, gm and
   g1; how the average differs in motion->part; what is seen of both in motion->seen; and G. The
   shapes then are those at the end. */
static void keep_forces(Motion *motion, const Coefficients *c, const double *x, double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    double *g0 = motion->g1;
    body_begin_pass(body, motion->middle.position, motion->end.position);
    const int passed = body_has_passed(body, 1);
    const int responds = motion->G_of != c->h || !passed;
    const Kept kept = {c, x, next, motion_is_driven(motion, motion->inside), passed, responds,
                       body_stays(body)};
    motion->g1 = motion->g0;
    motion->g0 = g0;
    body_split(m, motion_beyond_preload(motion, motion->inside, motion->beyond[0]),
               &body->split[0]);
    for (size_t k = 1; k < sizeof body->split / sizeof *body->split; k++)
        body_no_motion(m, &body->split[k]);
    if (responds)
        body_no_compliance(body);
    for (size_t k = 0; k < m->chunks; k++)
        keep_chunk(motion, &kept, &m->chunk[k]);
    keep_others(motion, &kept);
    if (kept.stays) {
        motion->g0 = motion->g1;
        motion->g1 = g0;
    }
    motion_note_driven(motion, motion->inside);
}

/* next = state after the step under the forces at the beginning, and the forces over the step,
   [means, slopes], in motion->over. */
int motion_find_forces(Motion *motion, const Coefficients *c, const double *z, const double *x,
                       double *next)
{
    if (!begin(motion, z, x))
        return 0;
    keep_forces(motion, c, x, next);
    motion_average(motion, motion->seen, motion->free);
    motion_average_load(motion, &motion->now, &motion->middle, &motion->end, motion->mean_load);
    if (motion->law.of_rates)
        motion_rolled(motion, motion->seen, motion->passed, motion->rolled);
    return motion_balance(motion, c);
}

/* What is seen of a chunk at the end of a step while it is near; of forces that depend on rates,
   velocities without any as well and, if they are looked `through`, what forces add to them. */
static void see_chunk(Motion *motion, const Chunk *chunk, const double *next, int through,
                      const ByParity *z, const ByParity *vz)
{
    const Body *body = &motion->body;
    if (through)
        body_through_chunk(body, &body->shapes, chunk);
    if (motion->law.of_rates)
        body_look_chunk(body, &body->shapes, chunk, next, motion->no_g, z, vz);
    else
        body_observe_chunk(body, &body->shapes, chunk, next, z);
}

static void see_rest(Motion *motion, const double *next, const ByParity *z, const ByParity *vz)
{
    const Body *body = &motion->body;
    Seen *last = &motion->last;
    if (motion->law.of_rates)
        body_look_rest(body, &body->shapes, next, motion->no_g, z, vz, last->z, last->vz_free);
    else
        body_observe_rest(body, &body->shapes, next, z, last->z);
    motion_note_seen(motion, 0, motion->none);
    last->free = motion->law.of_rates;
}

/* The line of forces added to `next`, and what is seen at its end, in motion->last. */
static void add_line(Motion *motion, const Coefficients *c, double *next)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const Shapes *between = body_between(body);
    const ByParity *mean = &body->split[0], *slope = &body->split[1];
    const ByParity *z = &body->split[2], *vz = &body->split[3];
    double *beyond = motion->beyond[0];
    const int through = motion->law.of_rates && !motion_has_through(motion, &body->shapes);
    if (through)
        body_no_compliance(body);
    for (size_t k = 0; k < m->contacts; k++)
        beyond[k] = motion->over[k] - motion->inside[k];
    body_split(m, beyond, mean);
    body_split(m, motion->over + m->contacts, slope);
    body_no_motion(m, z);
    body_no_motion(m, vz);
    for (size_t k = 0; k < m->chunks; k++) {
        const Chunk *chunk = &m->chunk[k];
        body_drive_both(body, between, chunk, mean, slope, motion->dm, motion->d1);
        step_add_chunk(body, c, chunk, 0, motion->dm, motion->d1, next);
        if (m->nodes > 0)
            see_chunk(motion, chunk, next, through, z, vz);
    }
    body_drive_rest(body, between, beyond, mean, motion->dm);
    body_drive_rest(body, between, motion->over + m->contacts, slope, motion->d1);
    step_add_rest(body, c, 0, motion->dm, motion->d1, next);
    if (m->nodes > 0)
        see_rest(motion, next, z, vz);
    if (through)
        motion_take_through(motion, &body->shapes);
}

int motion_contact_step(Motion *motion, const Coefficients *c, const double *x, double *next)
{
    const Shapes *shapes = body_shapes(&motion->body, motion->now.position);
    const double *z = motion_seen(motion);
    if (z == NULL && !motion->law.of_rates)
        body_observe(&motion->body, shapes, x, motion->seen[0]);
    if (!motion_find_forces(motion, c, z == NULL ? motion->seen[0] : z, x, next))
        return 0;
    add_line(motion, c, next);
    return 1;
}
