/* Directional derivatives of an instance: exact, by differentiating the same statements. */
#include "instance.h"

#include <string.h>

/* Change of everything outputs depend on. */
typedef struct {
    const double *u; /* inputs at which; what changes by is in i->change */
    double time, position, gone; /* s; start_position, m; the way since then, m */
    const double *dx;
} Direction;

/* Seeds of what derivatives are taken by: inputs (in the order of model.input), states, time, and
   in initialisation parameters. */
typedef struct {
    double *du, *dx;
    double time, position, speed, *heights;
    double *law; /* by k_H, then by C, of each wheelset; one of all is the first one's */
} Seeds;

/* Where the seed of a variable of the table goes; NULL: derivatives are not taken by it now. */
static double *seed_of(const Instance *i, Seeds *seeds, uint32_t ref)
{
    const int starting = (instance_phase(i) & (STARTED | INITIALISING)) != 0;
    const Variable *v = &i->model.variable[ref];
    if (v->causality == INPUT)
        return &seeds->du[v->place];
    if (v->role == ROLE_TIME)
        return &seeds->time;
    /* Numbers of rolling contacts are none of these. */
    if (!starting || (i->model.rolls && v->role != ROLE_START_POSITION && v->role != ROLE_START_Z))
        return NULL;
    switch (v->role) {
    case ROLE_SPEED: return &seeds->speed;
    case ROLE_START_POSITION: return &seeds->position;
    case ROLE_START_Z: return &seeds->heights[v->index];
    case ROLE_STIFFNESS: return &seeds->law[v->index];
    case ROLE_HERTZ: return &seeds->law[i->model.wheelsets + v->index];
    default: return NULL;
    }
}

static Status read_seeds(Instance *i, const uint32_t *knowns, size_t n, const double *seed,
                         Seeds *seeds)
{
    const size_t states = i->model_exchange ? i->model.states : 0;
    memset(seeds->du, 0, i->model.inputs * sizeof(double));
    memset(seeds->dx, 0, i->model.states * sizeof(double));
    memset(seeds->heights, 0, i->model.wheelsets * sizeof(double));
    memset(seeds->law, 0, 2 * i->model.wheelsets * sizeof(double));
    for (size_t k = 0; k < n; k++) {
        const size_t ref = knowns[k], at = instance_place(i, knowns[k]);
        double *place = NULL;
        if (at < i->model.variables)
            place = seed_of(i, seeds, (uint32_t)at);
        else if (ref >= FIRST_STATE && ref < FIRST_STATE + states)
            place = &seeds->dx[ref - FIRST_STATE];
        if (place == NULL)
            return instance_fail(i, "reference %lu is no known that derivatives can be taken by "
                                    "now: must be an input, time%s or, in initialisation, a "
                                    "parameter", (unsigned long)ref, states > 0 ? ", a state" : "");
        *place += seed[k]; /* a known may stand there twice */
    }
    return OK;
}

/* A contact law that changes gives forces as surfaces do that are moved: F = C d^1.5 by C as by
   d / (1.5 C) of compression, F = k_H d as by d / k_H. */
static void law_change(Instance *i, const Seeds *seeds, const Inputs *now, Inputs *change)
{
    const Model *m = &i->model;
    const ContactLaw *law = &i->motion.law;
    const size_t first = law->nonlinear ? m->wheelsets : 0;
    double *z = i->z;
    if (m->contact_sign == 0 || m->rolls)
        return;
    body_observe(&i->motion.body, body_shapes(&i->motion.body, now->position), i->x, z);
    for (size_t k = 0; k < m->contacts; k++) {
        const Variable *number = &m->variable[m->law[first + k % m->side_contacts]];
        const double seed = seeds->law[first + number->index];
        const double part = seed / ((law->nonlinear ? 1.5 : 1) * law->number[k]);
        change->load[k] -= part * (z[k] - now->load[k]);
    }
}

/* Change of an output; those of forces, motions and rates are already in the scratch. */
static double output_change(Instance *i, const Variable *v, const Direction *d,
                            const double *dacceleration)
{
    const Body *body = &i->motion.body;
    switch (v->role) {
    case ROLE_OUT_POSITION: return d->position + d->time * instance_speed(i) + d->gone;
    case ROLE_OUT_FORCE: return i->pushed[v->index];
    case ROLE_OUT_CONTACT_Z: return i->z[v->index];
    case ROLE_OUT_CONTACT_VZ: return i->vz[v->index];
    case ROLE_OUT_SEEN: return i->seen[v->index];
    case ROLE_OUT_COORDINATE: return body_coordinate(body, v->index, d->dx);
    case ROLE_OUT_RATE: return body_coordinate(body, v->index, i->motion.drate);
    default: break;
    }
    return body_coordinate(body, v->index, dacceleration) +
           body_through(body, v->index, i->force);
}

/* Changes of the outputs with these references; other references give 0. */
static void outputs_change(Instance *i, const Direction *d, const uint32_t *refs, size_t n,
                           double *dy)
{
    Motion *motion = &i->motion;
    const Model *m = &i->model;
    const Inputs *now = &i->now, *change = &i->change;
    instance_inputs(i, d->u, &i->now);
    motion_forces_change(motion, now, i->x, change, d->dx, i->force);
    if (m->nodes > 0) {
        motion_rate(motion, now, i->x, motion->rate);
        motion_rate_change(motion, now, i->x, change, d->dx, motion->drate);
        const Shapes *shapes = body_shapes(&motion->body, now->position);
        const Shapes *slope = body_slope(&motion->body, shapes, change->position);
        motion_observe_change(motion, shapes, slope, i->x, d->dx, i->z);
        motion_observe_change(motion, shapes, slope, motion->rate, motion->drate, i->vz);
        if (m->seen.outputs > 0)
            body_see(&motion->body, d->dx, motion->drate, i->seen);
    } else {
        const Shapes *shapes = body_shapes(&motion->body, now->position);
        body_rate(&motion->body, d->dx, NULL, motion->drate);
        body_observe(&motion->body, shapes, d->dx, i->z);
        body_observe(&motion->body, shapes, motion->drate, i->vz);
        body_acceleration(&motion->body, d->dx, motion->rate);
    }
    if (m->contact_sign != 0)
        motion_on_other_change(motion, now, motion->z, motion->v, change, i->z, i->vz, i->pushed);
    for (size_t k = 0; k < n; k++) {
        const uint32_t place = instance_place(i, refs[k]);
        if (place < m->variables)
            dy[k] = output_change(i, &m->variable[place], d, motion->rate);
    }
}

/* References must be of outputs or, in Model Exchange, of states' derivatives or (at rest) states. */
static Status check_unknowns(Instance *i, const uint32_t *refs, size_t n)
{
    const size_t states = i->model_exchange ? i->model.states : 0;
    for (size_t k = 0; k < n; k++) {
        const size_t ref = refs[k], place = instance_place(i, refs[k]);
        const int is_output = place < i->model.variables &&
                              i->model.variable[place].causality == OUTPUT;
        const int is_state = ref >= FIRST_STATE && ref < FIRST_STATE + states &&
                             (instance_phase(i) & (STARTED | INITIALISING));
        const int is_rate = ref >= FIRST_DERIVATIVE && ref < FIRST_DERIVATIVE + states;
        if (!is_output && !is_state && !is_rate)
            return instance_fail(i, "reference %lu is no unknown that has derivatives: must be an "
                                    "output%s", (unsigned long)ref,
                                 states > 0 ? " or a state's derivative" : "");
    }
    return OK;
}

/* Change of the state at rest. */
static void rest_change(Instance *i, const Seeds *seeds, const Inputs *now, const Inputs *change,
                        double *dx)
{
    if (i->model.nodes > 0)
        motion_rest_change(&i->motion, now, i->x, change, dx);
    else /* linear in the heights */
        motion_rest(&i->motion, now, seeds->heights, dx);
}

/* Change of the state at the end of the last step by inputs over it. */
static const char *step_change(Instance *i, const double *du, double *dx)
{
    const Inputs *start = &i->over_change.start, *slope = &i->over_change.slope;
    instance_path(i, i->path, &i->over);
    instance_inputs(i, du, &i->over_change.start);
    instance_inputs(i, du, &i->over_change.slope);
    memset(i->over_change.curve.position, 0, inputs_size(&i->model) * sizeof(double));
    for (size_t k = 0; k < inputs_size(&i->model); k++) {
        start->position[k] *= i->clock->before;
        slope->position[k] *= i->clock->change;
    }
    memcpy(i->next, i->x_before, i->model.states * sizeof(double));
    return motion_step_change(&i->motion, &i->over, &i->over_change, i->clock->step, i->next, dx);
}

/* Changes of the states' derivatives and, at rest, of the states. */
static void states_change(Instance *i, const Direction *d, const uint32_t *refs, size_t n,
                          double *changes)
{
    int rates = 0;
    instance_inputs(i, d->u, &i->now);
    for (size_t k = 0; k < n; k++) {
        if (refs[k] >= FIRST_DERIVATIVE) {
            if (!rates)
                motion_rate_change(&i->motion, &i->now, i->x, &i->change, d->dx, i->motion.drate);
            rates = 1;
            changes[k] = i->motion.drate[refs[k] - FIRST_DERIVATIVE];
        } else if (refs[k] >= FIRST_STATE) {
            changes[k] = d->dx[refs[k] - FIRST_STATE];
        }
    }
}

/* By how much further wheels come by inputs over the last step; at the start, by a speed, since time 0. */
static double gone_change(const Instance *i, const Seeds *seeds, const double *du, int stepped)
{
    const uint32_t ref = i->model.of_role[ROLE_IN_SPEED];
    const double t = i->clock->time, step = i->clock->step;
    const double faster = ref == UINT32_MAX ? seeds->speed : du[i->model.variable[ref].place];
    if (instance_phase(i) & (STARTED | INITIALISING))
        return faster * t;
    return stepped && ref != UINT32_MAX
               ? faster * step * (i->clock->before + 0.5 * i->clock->change * step) : 0;
}

Status instance_directional(Instance *i, const uint32_t *unknowns, size_t n_unknowns,
                            const uint32_t *knowns, size_t n_knowns, const double *seed,
                            double *sensitivity)
{
    Seeds seeds = {i->plan[0], i->dx, 0, 0, 0, i->dheights, i->dlaw};
    const int stepped = !i->model_exchange && i->clock->step > 0 &&
                        instance_parameter(i, ROLE_DERIVATIVES_OF_STEP) != 0;
    const double *end = stepped ? i->u_end : i->shown;
    double *du = seeds.du;
    const char *failed = NULL;
    if (read_seeds(i, knowns, n_knowns, seed, &seeds) != OK ||
        check_unknowns(i, unknowns, n_unknowns) != OK || instance_settle(i) != OK)
        return ERROR;
    const double gone = gone_change(i, &seeds, du, stepped);
    if (stepped) {
        failed = step_change(i, du, i->dx);
        for (size_t k = 0; k < i->model.inputs; k++)
            du[k] *= i->clock->before + i->clock->change * i->clock->step;
    }
    instance_inputs(i, end, &i->now);
    instance_inputs(i, du, &i->change);
    if (instance_phase(i) & (STARTED | INITIALISING)) {
        law_change(i, &seeds, &i->now, &i->change);
        rest_change(i, &seeds, &i->now, &i->change, i->dx);
    }
    if (failed != NULL)
        return instance_fail(i, "derivative of the last step: %s", failed);
    const Direction d = {end, seeds.time, seeds.position, gone, i->dx};
    outputs_change(i, &d, unknowns, n_unknowns, sensitivity);
    states_change(i, &d, unknowns, n_unknowns, sensitivity); /* uses the same scratch */
    return OK;
}

Status instance_output_slopes(Instance *i, const uint32_t *refs, size_t n, double *slopes)
{
    if (check_unknowns(i, refs, n) != OK || instance_settle(i) != OK)
        return ERROR;
    for (size_t k = 0; k < i->model.inputs; k++)
        i->plan[0][k] = i->path[1][k] + i->clock->step * i->path[2][k];
    instance_inputs(i, i->u_end, &i->now);
    instance_inputs(i, i->plan[0], &i->change);
    motion_rate(&i->motion, &i->now, i->x, i->dx);
    const Direction d = {i->u_end, 1, 0, 0, i->dx};
    outputs_change(i, &d, refs, n, slopes);
    return OK;
}
