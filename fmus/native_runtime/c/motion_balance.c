/* Contact forces over an internal step.

   Contacts of a block of rows (four wheelsets one behind the other) answer each other by matrices of
   compliance. Those of other blocks are metres away, and over an internal step hardly answer: by
   1e-4 of their own compliance at 2.5 m over 0.1 ms, by less at greater distance. So there is no
   matrix of all contacts, which would cost the square of their number. What other blocks add is found
   by moving the body by the forces found so far, and the forces are found again; each time the
   difference is a thousandth of the last one, until it is rounding. Where blocks do answer each
   other so much that this does not settle, the step is refused. */
#include "motion.h"

#include <math.h>
#include <string.h>

enum { MAX_ROUNDS = 50 }; /* 3 do */
/* Of the largest force: what is left of the forces of other blocks when rounds end. */
static const double LEFT = 1e-11;

static double *compliance_of(const Motion *motion, size_t block)
{
    const size_t most = MOST_IN_BLOCK(motion->body.model);
    return motion->G + block * 4 * most * most;
}

Weights motion_weights(const Coefficients *c)
{
    Weights weights = {{c->end.by[0], c->end.by[1], c->end.by[2]}, {0}};
    rigid_effects(c->h, 0, weights.rigid);
    return weights;
}

/* What forces over the step do on average is known from what the three do to the end: h phi_2 is
   by[1] / 2 + by[2], and h (2 phi_3 - phi_2) is -by[1] / 4. */
void motion_find_compliances(Motion *motion, const Coefficients *c)
{
    const Body *body = &motion->body;
    const Weights weights = motion_weights(c);
    for (size_t block = 0; block < body_blocks(body->model); block++) {
        size_t contact[MOST_PORTS];
        const size_t n = body_block(body->model, block, contact), pairs = n * n;
        double *of_average = compliance_of(motion, block), *by_slope = of_average + pairs;
        double *of_end = by_slope + pairs, *end_by_slope = of_end + pairs;
        body_respond_rest(body, body_between(body), weights.modes, weights.rigid, n, contact,
                          of_average);
        for (size_t k = 0; k < pairs; k++) {
            const double begin = of_average[k], middle = by_slope[k], end = of_end[k];
            of_average[k] = 0.5 * middle + end;
            by_slope[k] = -0.25 * middle;
            of_end[k] = begin + middle + end;
            end_by_slope[k] = end - begin;
        }
    }
    motion->G_of = c->h;
}

/* Numbers of a block's contacts, once or twice (`parts`), from those of all, or back. */
static void gather(size_t parts, size_t n, const size_t *contact, size_t all, const double *whole,
                   double *own)
{
    for (size_t part = 0; part < parts; part++)
        for (size_t k = 0; k < n; k++)
            own[part * n + k] = whole[part * all + contact[k]];
}

static void scatter(size_t n, const size_t *contact, size_t all, const double *own, double *whole)
{
    for (size_t part = 0; part < 2; part++)
        for (size_t k = 0; k < n; k++)
            whole[part * all + contact[k]] = own[part * n + k];
}

/* Add, times `sign`, what a block's forces, means and (NULL: none) slopes, do to its motions. */
static void add_own(size_t n, const double *G, double sign, const double *mean,
                    const double *slope, double *motions)
{
    const size_t pairs = n * n;
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++) {
            const double *at = G + k * n + j;
            motions[k] += sign * at[0] * mean[j];
            motions[n + k] += sign * at[2 * pairs] * mean[j];
            if (slope != NULL) {
                motions[k] += sign * at[pairs] * slope[j];
                motions[n + k] += sign * at[3 * pairs] * slope[j];
            }
        }
}

static void no_state(double *x, const Model *m, const Chunk *chunk)
{
    memset(x + chunk->to, 0, chunk->size * sizeof(double));
    memset(x + m->modes + chunk->to, 0, chunk->size * sizeof(double));
}

Way motion_way(const Motion *motion, const Coefficients *c)
{
    const Way way = {c->h, motion->seen[0],
                     {motion->rolled[0], motion->rolled[1], motion->rolled[2]},
                     {motion->now.load, motion->mean_load, motion->end.load}};
    return way;
}

Way motion_way_change(const Motion *motion, const Coefficients *c)
{
    const Way way = {c->h, motion->dseen[0],
                     {motion->drolled[0], motion->drolled[1], motion->drolled[2]},
                     {motion->dnow.load, motion->dmean_load, motion->dend.load}};
    return way;
}

/* What forces [means, slopes] do to all motions, [averages, ends]. */
static void move(Motion *motion, const Coefficients *c, const double *force, double *motions)
{
    Body *body = &motion->body;
    const Model *m = body->model;
    const Shapes *between = body_between(body);
    const ByParity *mean = &body->split[0], *slope = &body->split[1];
    const size_t C = m->contacts;
    body_split(m, force, mean);
    body_split(m, force + C, slope);
    body_no_motion(m, &body->split[2]);
    body_no_motion(m, &body->split[3]);
    for (size_t k = 0; k < m->chunks; k++) {
        const Chunk *chunk = &m->chunk[k];
        body_drive_both(body, between, chunk, mean, slope, motion->dm, motion->d1);
        for (int end = 0; end < 2; end++) {
            no_state(motion->line[end], m, chunk);
            step_add_chunk(body, c, chunk, !end, motion->dm, motion->d1, motion->line[end]);
            body_observe_chunk(body, between, chunk, motion->line[end], &body->split[2 + end]);
        }
    }
    body_drive_rest(body, between, force, mean, motion->dm);
    body_drive_rest(body, between, force + C, slope, motion->d1);
    for (int end = 0; end < 2; end++) {
        double *z = motions + (end ? C : 0);
        no_state(motion->line[end], m, &m->chunk[m->chunks]);
        memset(motion->line[end] + 2 * m->modes, 0, 2 * m->rigid * sizeof(double));
        step_add_rest(body, c, !end, motion->dm, motion->d1, motion->line[end]);
        body_observe_rest(body, between, motion->line[end], &body->split[2 + end], z);
    }
}

/* What forces `over` the step beyond those at the beginning do to motions of other blocks, in
   motion->far. */
static void find_far(Motion *motion, const Coefficients *c, const double *over,
                     const double *inside)
{
    const Model *m = motion->body.model;
    const size_t C = m->contacts;
    double *beyond = motion->line_force;
    for (size_t k = 0; k < C; k++) {
        beyond[k] = over[k] - inside[k];
        beyond[C + k] = over[C + k];
    }
    move(motion, c, beyond, motion->far);
    for (size_t block = 0; block < body_blocks(m); block++) {
        size_t contact[MOST_PORTS];
        double force[2 * MOST_PORTS], moved[2 * MOST_PORTS];
        const size_t n = body_block(m, block, contact);
        gather(2, n, contact, C, beyond, force);
        gather(2, n, contact, C, motion->far, moved);
        add_own(n, compliance_of(motion, block), -1, force, force + n, moved);
        scatter(n, contact, C, moved, motion->far);
    }
}

/* Compressions of a block that its forces are to be added to: of none, and with what others do. */
static void without_own(const Motion *motion, size_t block, size_t n, const size_t *contact,
                        const double *free, const double *inside, double *own)
{
    const size_t C = motion->body.model->contacts;
    double mean[MOST_PORTS], far[2 * MOST_PORTS];
    gather(2, n, contact, C, free, own);
    gather(2, n, contact, C, motion->far, far);
    gather(1, n, contact, C, inside, mean);
    add_own(n, compliance_of(motion, block), -1, mean, NULL, own);
    for (size_t k = 0; k < 2 * n; k++)
        own[k] += far[k];
}

/* Solved for at once are about as many numbers as contacts of four wheelsets have in one direction. */
static Question over_step(const Motion *motion, size_t n, const size_t *contact, const Way *way)
{
    const size_t own = motion->law.own;
    const Question question = {motion->body.kernels, &motion->law, n, contact, 2,
                               own < BLOCK ? BLOCK / own : 1, balance_over_step, NULL, NULL, way};
    return question;
}

static int balance_block(Motion *motion, const Coefficients *c, size_t block)
{
    const size_t C = motion->body.model->contacts;
    size_t contact[MOST_PORTS];
    double free[2 * MOST_PORTS], force[2 * MOST_PORTS], moves[2 * MOST_PORTS];
    const size_t n = body_block(motion->body.model, block, contact);
    const Way way = motion_way(motion, c);
    const Question question = over_step(motion, n, contact, &way);
    gather(2, n, contact, C, motion->over, force);
    without_own(motion, block, n, contact, motion->free, motion->inside, free);
    if (!balance(&question, compliance_of(motion, block), free, force, moves, motion->solving))
        return 0;
    scatter(n, contact, C, force, motion->over);
    scatter(n, contact, C, moves, motion->moves);
    return 1;
}

static int change_block(Motion *motion, const Coefficients *c, size_t block)
{
    const size_t C = motion->body.model->contacts, own = motion->law.own;
    size_t contact[MOST_PORTS];
    double moves[2 * MOST_PORTS], dfree[2 * MOST_PORTS], dforce[2 * MOST_PORTS];
    const size_t n = body_block(motion->body.model, block, contact);
    const Way way = motion_way(motion, c), change = motion_way_change(motion, c);
    const Question question = over_step(motion, n, contact, &way);
    gather(2, n, contact, C, motion->moves, moves);
    without_own(motion, block, n, contact, motion->dfree, motion->dinside, dfree);
    for (size_t port = 0; port < n; port += own) {
        double x[2 * MOST_OWN], dx[2 * MOST_OWN], found[2 * MOST_OWN];
        for (size_t part = 0; part < 2; part++) {
            memcpy(x + part * own, moves + part * n + port, own * sizeof(double));
            memcpy(dx + part * own, dfree + part * n + port, own * sizeof(double));
        }
        contact_over_step_change(&motion->law, contact[port] / own, &way, x, &change, dx, found);
        for (size_t part = 0; part < 2; part++)
            memcpy(dforce + part * n + port, found + part * own, own * sizeof(double));
    }
    if (!balance_change(&question, compliance_of(motion, block), moves, dforce, motion->solving))
        return 0;
    scatter(n, contact, C, dforce, motion->dover);
    return 1;
}

/* How much forces [means, slopes] have changed since `before`, and the largest of them. */
static double change_of(size_t n, const double *force, const double *before, double *largest)
{
    double change = 0;
    *largest = 0;
    for (size_t k = 0; k < n; k++) {
        change = fmax(change, fabs(force[k] - before[k]));
        *largest = fmax(*largest, fabs(force[k]));
    }
    return change;
}

/* Find the forces of all blocks, again and again until what they do to each other is in them. */
static int settle(Motion *motion, const Coefficients *c,
                  int (*solve)(Motion *, const Coefficients *, size_t), double *over,
                  const double *inside)
{
    const Model *m = motion->body.model;
    const size_t C = m->contacts, bytes = 2 * C * sizeof(double);
    double last = INFINITY;
    memset(motion->far, 0, bytes);
    memcpy(over, inside, bytes / 2);
    memset(over + C, 0, bytes / 2);
    for (int round = 0; round < MAX_ROUNDS; round++) {
        double largest;
        memcpy(motion->last_over, over, bytes);
        for (size_t block = 0; block < body_blocks(m); block++)
            if (!solve(motion, c, block))
                return 0;
        if (body_blocks(m) == 1)
            return 1;
        const double change = change_of(2 * C, over, motion->last_over, &largest);
        /* The next change would be smaller again by as much as this one is than the last. */
        const double next = round > 0 && change < last ? change * (change / last) : change;
        if (next <= LEFT * largest)
            return 1;
        last = change;
        find_far(motion, c, over, inside);
    }
    return 0;
}

int motion_balance(Motion *motion, const Coefficients *c)
{
    return settle(motion, c, balance_block, motion->over, motion->inside);
}

int motion_balance_change(Motion *motion, const Coefficients *c)
{
    return settle(motion, c, change_block, motion->dover, motion->dinside);
}
