#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_TURNS = 100 }; /* as in mechanics/gaps.py */

/* Numbers of all contacts of the law, or forces. */
static size_t loads_of(const Model *model)
{
    return model->sides * model->wheelsets * model->given;
}

size_t inputs_size(const Model *model) { return model->wheelsets + loads_of(model); }

Inputs inputs_in(const Model *model, double *block)
{
    const Inputs inputs = {block, block + model->wheelsets};
    return inputs;
}

static void lay_out_effects(Effects *effects, size_t n, Arrays *arrays)
{
    effects->own = arrays_take(arrays, n);
    for (int k = 0; k < 3; k++)
        effects->by[k] = arrays_take(arrays, n);
}

static void lay_out(Motion *motion, const Model *model, Arrays *arrays)
{
    const size_t c = model->contacts;
    const size_t pairs = model->contact_sign != 0 ? c * c : 0;
    const size_t in_block = MOST_IN_BLOCK(model);
    double **of_g[] = {&motion->no_g, &motion->g0, &motion->gm, &motion->g1, &motion->d0,
                       &motion->dm, &motion->d1, &motion->more};
    double **of_x[] = {&motion->rate, &motion->drate,   &motion->dx,     &motion->part,
                       &motion->dpart, &motion->line[0], &motion->line[1]};
    const size_t wheels = model->sides * model->wheelsets;
    double **of_c[] = {&motion->force,      &motion->dforce,    &motion->driven, &motion->none,
                       &motion->beyond[0],  &motion->beyond[1], &motion->beyond[2],
                       &motion->z,          &motion->dz,        &motion->moved,
                       &motion->inside,     &motion->dinside,   &motion->v,      &motion->dv,
                       &motion->rolled[0],  &motion->rolled[1], &motion->rolled[2],
                       &motion->drolled[0], &motion->drolled[1], &motion->drolled[2],
                       &motion->passed[0],  &motion->passed[1],
                       &motion->seen[0],    &motion->seen[1],   &motion->seen[2],
                       &motion->dseen[0],   &motion->dseen[1],  &motion->dseen[2],
                       &motion->last.under, &motion->last.z,    &motion->last.vz,
                       &motion->last.vz_free};
    double **of_2c[] = {&motion->over,    &motion->dover, &motion->free, &motion->dfree,
                        &motion->moves, &motion->far,   &motion->line_force,
                        &motion->last_over};
    Inputs *of_u[] = {&motion->now,  &motion->middle,  &motion->end,
                      &motion->dnow, &motion->dmiddle, &motion->dend};
    for (size_t k = 0; k < sizeof of_g / sizeof *of_g; k++)
        *of_g[k] = arrays_take(arrays, 2 * model->drives + model->rigid);
    for (size_t k = 0; k < sizeof of_x / sizeof *of_x; k++)
        *of_x[k] = arrays_take(arrays, model->states);
    for (size_t k = 0; k < sizeof of_c / sizeof *of_c; k++)
        *of_c[k] = arrays_take(arrays, c);
    for (size_t k = 0; k < sizeof of_2c / sizeof *of_2c; k++)
        *of_2c[k] = arrays_take(arrays, 2 * c);
    for (size_t k = 0; k < sizeof of_u / sizeof *of_u; k++) {
        of_u[k]->position = arrays_take(arrays, inputs_size(model));
        of_u[k]->load = of_u[k]->position == NULL ? NULL : of_u[k]->position + model->wheelsets;
    }
    gaps_lay_out(&motion->gaps, model, arrays);
    const size_t together = model->contact_sign == 0 ? 2 * TOGETHER : 0;
    for (size_t k = 0; k < together; k++) {
        motion->beyond_of[k] = arrays_take(arrays, c);
        for (int odd = 0; odd < 2; odd++)
            motion->split_of[k].of[odd] = arrays_take(arrays, model->padded_rows + 1);
    }
    motion->last.given = arrays_take(arrays, loads_of(model));
    motion->through_at = arrays_take(arrays, model->wheelsets);
    motion->driven_at = arrays_take(arrays, model->wheelsets);
    motion->last.at = arrays_take(arrays, model->wheelsets);
    motion->law = contact_law(model);
    motion->law.number = arrays_take(arrays, wheels);
    motion->law.rolling = (RollingLaw *)arrays_take(
        arrays, sizeof(RollingLaw) / sizeof(double) * wheels);
    motion->mean_load = arrays_take(arrays, loads_of(model));
    motion->dmean_load = arrays_take(arrays, loads_of(model));
    const size_t of_blocks = 4 * in_block * in_block * body_blocks(model);
    motion->G = arrays_take(arrays, pairs > of_blocks ? pairs : of_blocks);
    motion->through = arrays_take(arrays, model->rolls ? pairs : 0);
    motion->ones = arrays_take(arrays, 2 * model->modes);
    const size_t most = c > 2 * in_block ? c : 2 * in_block;
    motion->solving = arrays_take(arrays, pairs > 0 ? BALANCE_WORK(most) : 0);
    for (int k = 0; k < KEPT_STEPS; k++) {
        lay_out_effects(&motion->kept[k].end, 2 * model->modes, arrays);
        lay_out_effects(&motion->kept[k].average, model->contact_sign != 0 ? 2 * model->modes : 0,
                        arrays);
    }
}

int motion_create(Motion *motion, const Model *model, Memory *memory)
{
    memset(motion, 0, sizeof *motion);
    lay_out(motion, model, &motion->arrays);
    if (!arrays_make(&motion->arrays, memory) || !body_create(&motion->body, model, memory)) {
        motion_free(motion);
        return 0;
    }
    lay_out(motion, model, &motion->arrays);
    for (size_t r = 0; r < model->modes; r++)
        motion->ones[r] = 1;
    motion->driven[0] = motion->through_at[0] = NAN; /* nothing yet */
    return 1;
}

void motion_free(Motion *motion)
{
    body_free(&motion->body);
    free(motion->arrays.memory);
    memset(motion, 0, sizeof *motion);
}

static double along(double start, double slope, double curve, double t)
{
    return start + t * (slope + 0.5 * t * curve);
}

void path_at(const Model *model, const InputPath *path, double t, Inputs *now)
{
    for (size_t k = 0; k < inputs_size(model); k++)
        now->position[k] = along(path->start.position[k], path->slope.position[k],
                                 path->curve.position[k], t);
}

void path_part(const Model *model, const InputPath *path, double h, double k, double parts,
               Inputs *begin, Inputs *middle, Inputs *end)
{
    path_at(model, path, (k - 1) / parts * h, begin);
    path_at(model, path, (k - 0.5) / parts * h, middle);
    path_at(model, path, k / parts * h, end);
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

const double *motion_beyond_preload(const Motion *motion, const double *force, double *beyond)
{
    const Model *m = motion->body.model;
    for (size_t k = 0; k < m->contacts; k++)
        beyond[k] = force[k] - m->preloads[k];
    return beyond;
}

void motion_drive(Motion *motion, const Shapes *shapes, const double *force, double *g)
{
    body_drive(&motion->body, shapes, motion_beyond_preload(motion, force, motion->beyond[0]), g);
}

/* Whether g1 are of these forces, with wheelsets where the shapes are. */
int motion_is_driven(const Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    int same = 1;
    for (size_t k = 0; k < m->contacts; k++)
        same &= force[k] == motion->driven[k];
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        same &= motion->driven_at[k] == motion->body.shapes.place[k].position;
    return same;
}

void motion_note_driven(Motion *motion, const double *force)
{
    const Model *m = motion->body.model;
    memcpy(motion->driven, force, m->contacts * sizeof(double));
    for (size_t k = 0; k < m->wheelsets; k++)
        motion->driven_at[k] = motion->body.shapes.place[k].position;
}

const double *motion_driven(Motion *motion, const Shapes *shapes, const double *force)
{
    if (!motion_is_driven(motion, force)) {
        motion_drive(motion, shapes, force, motion->g1);
        motion_note_driven(motion, force);
    }
    return motion->g1;
}

const double *motion_seen(const Motion *motion)
{
    const Model *m = motion->body.model;
    int here = motion->last.known && m->nodes > 0;
    for (size_t k = 0; here && k < m->wheelsets; k++)
        here &= motion->last.at[k] == motion->body.shapes.place[k].position;
    return here ? motion->last.z : NULL;
}

void motion_note_seen(Motion *motion, int rates, const double *force)
{
    const Model *m = motion->body.model;
    for (size_t k = 0; k < m->wheelsets; k++)
        motion->last.at[k] = motion->body.shapes.place[k].position;
    memcpy(motion->last.under, force, m->contacts * sizeof(double));
    motion->last.known = 1;
    motion->last.rates = rates;
    if (!rates)
        motion->last.free = 0;
}

void motion_forget(Motion *motion) { motion->last.known = motion->last.free = 0; }

int motion_see(Motion *motion, const Inputs *now, const double *x, double *force, double *z,
               double *vz)
{
    const Model *m = motion->body.model;
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    const size_t bytes = m->contacts * sizeof(double);
    const double *seen = motion_seen(motion);
    const int known = m->contact_sign != 0 && seen != NULL;
    if (motion->law.of_rates) {
        const int found = motion_last_forces(motion, now, x);
        memcpy(force, motion->last.under, bytes);
        memcpy(z, motion->last.z, bytes);
        memcpy(vz, motion->last.vz, bytes);
        return found;
    }
    if (!known && !motion_forces(motion, now, x, force))
        return 0;
    for (size_t k = 0; known && k < m->contacts; k++)
        force[k] = motion_pressed(motion, k, seen, now->load);
    if (seen == NULL || !motion->last.rates ||
        memcmp(motion->last.under, force, bytes) != 0) {
        body_look(&motion->body, shapes, x, motion_beyond_preload(motion, force, motion->beyond[0]),
                  motion_is_driven(motion, force), motion->g1, motion->last.z, motion->last.vz);
        motion_note_driven(motion, force);
        motion_note_seen(motion, 1, force);
    }
    memcpy(z, motion->last.z, bytes);
    memcpy(vz, motion->last.vz, bytes);
    return 1;
}

int motion_still(const Model *model, const InputPath *path)
{
    for (size_t k = 0; k < model->wheelsets; k++)
        if (path->slope.position[k] != 0 || path->curve.position[k] != 0)
            return 0;
    return 1;
}

double motion_internal_steps(const Motion *motion, int is_still, double h)
{
    const Model *m = motion->body.model;
    if (m->contact_sign == 0 && m->gaps.count == 0 && (is_still || m->nodes == 0))
        return 1;
    return fmax(1, ceil(h / motion->internal_step * (1 - 1e-9)));
}

const char MOTION_TOO_MANY[] = "takes over 10 million internal steps; use a shorter step";
const char MOTION_NO_CONTACT[] = "the contact forces could not be found: the wheel or rail motions "
                                 "set from outside are far off, or a wheel is beyond the table of "
                                 "its profile";

const char MOTION_NO_GAPS[] = "the forces of gaps that close could not be found: the forces set from "
                              "outside are far off";

const char *motion_step(Motion *motion, const InputPath *path, double h, const double *x,
                        double *next)
{
    const Model *m = motion->body.model;
    const int still = motion_still(m, path);
    const double parts = motion_internal_steps(motion, still, h);
    if (parts > MAX_INTERNAL_STEPS)
        return MOTION_TOO_MANY;
    if (m->contact_sign == 0 && m->gaps.count == 0) {
        motion_outside_step(motion, path, h, 0, parts, parts, x, next);
        return NULL;
    }
    const Coefficients *c = motion_coefficients(motion, h / parts);
    for (double k = 1; k <= parts; k++) {
        double *to = motion_after(motion, k, parts, next);
        path_part(m, path, h, k, parts, &motion->now, &motion->middle, &motion->end);
        if (m->contact_sign != 0) {
            if (!motion_contact_step(motion, c, x, to))
                return MOTION_NO_CONTACT;
        } else {
            motion_outside_step(motion, path, h, k - 1, k, parts, x, next);
        }
        if (m->gaps.count > 0) {
            if (!gaps_step(&motion->body, &motion->gaps, c, x, to))
                return MOTION_NO_GAPS;
            motion_forget(motion); /* what was seen is not of the state now */
        }
        x = to;
    }
    return NULL;
}

void motion_static_compliance(Motion *motion, const Shapes *shapes)
{
    body_compliance(&motion->body, shapes, motion->body.flexibility, motion->G);
    motion->G_of = 0;
}

Question motion_at_rest(const Motion *motion, const double *given)
{
    const Model *m = motion->body.model;
    const Question question = {motion->body.kernels, &motion->law, m->contacts, NULL, 1,
                               m->wheelsets, balance_at_rest, NULL, given, NULL};
    return question;
}

/* Forces of contacts of a track at rest, whose gaps close by them and lift them. */
static int rest_on_contacts(Motion *motion, const Shapes *shapes, const Inputs *now,
                            double *force)
{
    const Model *m = motion->body.model;
    const Question question = motion_at_rest(motion, now->load);
    double *lifted = motion->moved;
    memset(lifted, 0, m->contacts * sizeof(double));
    if (m->gaps.count > 0)
        memset(motion->gaps.closed, 0, m->gaps.count * sizeof(double));
    for (int turn = 0; turn < MOST_TURNS; turn++) {
        motion_static_compliance(motion, shapes);
        if (m->gaps.count > 0)
            gaps_soften(&motion->body, shapes, &motion->gaps, motion->G, lifted);
        memset(force, 0, m->contacts * sizeof(double));
        if (!balance(&question, motion->G, lifted, force, motion->moves, motion->solving))
            return 0;
        if (m->gaps.count == 0 || gaps_stay(&motion->body, &motion->gaps, force))
            break;
    }
    return 1;
}

int motion_rest(Motion *motion, const Inputs *now, const double *heights, double *x)
{
    const Model *m = motion->body.model;
    double *force = motion->force;
    if (m->nodes == 0) {
        memset(x, 0, m->states * sizeof(double));
        for (size_t k = 0; k < m->wheelsets; k++) {
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
    memcpy(force, now->load, m->contacts * sizeof(double));
    if (m->contact_sign != 0) {
        if (!rest_on_contacts(motion, shapes, now, force))
            return 0;
    }
    body_at_rest(&motion->body, motion_driven(motion, shapes, force), x);
    return m->gaps.count == 0 || gaps_rest(&motion->body, &motion->gaps, x);
}

double motion_through(Motion *motion, size_t coordinate, const double *force)
{
    return body_through(&motion->body, coordinate,
                        motion_beyond_preload(motion, force, motion->beyond[0]));
}

int motion_rate(Motion *motion, const Inputs *now, const double *x, double *rate)
{
    if (!motion_forces(motion, now, x, motion->force))
        return 0;
    const Shapes *shapes = body_shapes(&motion->body, now->position);
    body_rate(&motion->body, x, motion_driven(motion, shapes, motion->force), rate);
    return 1;
}
