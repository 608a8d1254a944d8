/* Directional derivatives of an instance: exact, by differentiating the same statements. */
#include "instance.h"

#include <string.h>

/* Change of everything outputs depend on. */
typedef struct {
    const double *u; /* inputs at which */
    Inputs change;
    double time;
    const double *dx;
} Direction;

/* Seeds of inputs (in the order of model.input) and states. */
static Status read_seeds(Instance *i, const uint32_t *knowns, size_t n, const double *seed,
                         double *du, double *dx)
{
    const size_t states = i->model_exchange ? i->model.states : 0;
    memset(du, 0, i->model.inputs * sizeof(double));
    memset(dx, 0, i->model.states * sizeof(double));
    for (size_t k = 0; k < n; k++) {
        const size_t ref = knowns[k];
        size_t input = 0;
        while (input < i->model.inputs && i->model.input[input] != ref)
            input++;
        if (input < i->model.inputs)
            du[input] = seed[k];
        else if (ref >= FIRST_STATE && ref < FIRST_STATE + states)
            dx[ref - FIRST_STATE] = seed[k];
        else
            return instance_fail(i, "reference %lu is no known that derivatives can be taken by: "
                                    "must be an input%s", (unsigned long)ref,
                                 states > 0 ? " or a state" : "");
    }
    return OK;
}

/* Change of an output; forces, rates and accelerations are already in motion's scratch. */
static double output_change(Instance *i, const Variable *v, const Direction *d,
                            const double dforce[WHEELS], const double dz[WHEELS],
                            const double dvz[WHEELS], const double *dacceleration)
{
    const Model *m = &i->model;
    const Body *body = &i->motion.body;
    switch (v->role) {
    case ROLE_OUT_POSITION: {
        const uint32_t speed = m->of_role[ROLE_SPEED];
        return d->time * i->value[speed];
    }
    case ROLE_OUT_FORCE: return dforce[v->index];
    case ROLE_OUT_CONTACT_Z: return dz[v->index];
    case ROLE_OUT_CONTACT_VZ: return dvz[v->index];
    case ROLE_OUT_COORDINATE: return body_coordinate(body, v->index, d->dx);
    case ROLE_OUT_RATE: return body_coordinate(body, v->index, i->motion.drate);
    default: break;
    }
    const size_t first = m->coordinates - WHEELSETS;
    double a = body_coordinate(body, v->index, dacceleration);
    if (v->index >= first)
        a -= m->inverse_mass[v->index - first] *
             (dforce[v->index - first] + dforce[v->index - first + WHEELSETS]);
    return a;
}

/* Displacements of the contacts and their change. */
static void contact_change(Instance *i, const Inputs *now, const Direction *d, const double *x,
                           const double *dx, double dz[WHEELS])
{
    Body *body = &i->motion.body;
    double moved[WHEELS];
    const Shapes *shapes = body_shapes(body, now->position);
    const Shapes *slope = body_slope(body, d->change.position);
    body_observe(body, shapes, dx, dz);
    body_observe(body, slope, x, moved);
    for (size_t k = 0; k < WHEELS; k++)
        dz[k] += moved[k];
}

/* Changes of the outputs with these references; other references give 0. */
static void outputs_change(Instance *i, const Direction *d, const uint32_t *refs, size_t n,
                           double *dy)
{
    Motion *motion = &i->motion;
    const Model *m = &i->model;
    const Inputs now = instance_inputs(i, d->u);
    double dforce[WHEELS], dz[WHEELS] = {0}, dvz[WHEELS] = {0};
    motion_forces_change(motion, &now, i->x, &d->change, d->dx, dforce);
    if (m->nodes > 0) {
        motion_rate(motion, &now, i->x, motion->rate);
        motion_rate_change(motion, &now, i->x, &d->change, d->dx, motion->drate);
        contact_change(i, &now, d, i->x, d->dx, dz);
        contact_change(i, &now, d, motion->rate, motion->drate, dvz);
    } else {
        body_rate(&motion->body, d->dx, NULL, motion->drate);
        body_acceleration(&motion->body, d->dx, motion->rate);
    }
    for (size_t k = 0; k < n; k++)
        if (refs[k] < m->variables)
            dy[k] = output_change(i, &m->variable[refs[k]], d, dforce, dz, dvz, motion->rate);
}

/* References must be of outputs or, in Model Exchange, of states' derivatives or (at rest) states. */
static Status check_unknowns(Instance *i, const uint32_t *refs, size_t n)
{
    const size_t states = i->model_exchange ? i->model.states : 0;
    for (size_t k = 0; k < n; k++) {
        const size_t ref = refs[k];
        const int is_output = ref < i->model.variables &&
                              i->model.variable[ref].causality == OUTPUT;
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

/* Change of the state by inputs: of that at rest, or over the last step. x is that at its end. */
static const char *state_change(Instance *i, const double *du, double *dx)
{
    const size_t bytes = i->model.states * sizeof(double);
    if (instance_phase(i) & (STARTED | INITIALISING)) {
        const Inputs now = instance_inputs(i, i->shown), change = instance_inputs(i, du);
        motion_rest_change(&i->motion, &now, i->x, &change, dx);
        return NULL;
    }
    if (i->model_exchange || i->clock->step == 0)
        return NULL;
    const InputPath path = {instance_inputs(i, i->path[0]), instance_inputs(i, i->path[1]),
                            instance_inputs(i, i->path[2])};
    InputPath change = {instance_inputs(i, du), instance_inputs(i, du), {{0}, {0}}};
    for (size_t k = 0; k < WHEELSETS; k++) {
        change.start.position[k] *= i->clock->before;
        change.slope.position[k] *= i->clock->change;
    }
    for (size_t k = 0; k < WHEELS; k++) {
        change.start.load[k] *= i->clock->before;
        change.slope.load[k] *= i->clock->change;
    }
    memcpy(i->next, i->x_before, bytes);
    return motion_step_change(&i->motion, &path, &change, i->clock->step, i->next, dx);
}

Status instance_directional(Instance *i, const uint32_t *unknowns, size_t n_unknowns,
                            const uint32_t *knowns, size_t n_knowns, const double *seed,
                            double *sensitivity)
{
    double *du = i->plan[0], *end = i->plan[1];
    if (read_seeds(i, knowns, n_knowns, seed, du, i->dx) != OK ||
        check_unknowns(i, unknowns, n_unknowns) != OK || instance_settle(i) != OK)
        return ERROR;
    const int stepped = !i->model_exchange && i->clock->step > 0;
    const char *failed = state_change(i, du, i->dx);
    if (failed != NULL)
        return instance_fail(i, "derivative of the last step: %s", failed);
    const double grown = stepped ? i->clock->before + i->clock->change * i->clock->step : 1;
    for (size_t k = 0; k < i->model.inputs; k++) {
        end[k] = stepped ? i->path[0][k] + i->clock->step * (i->path[1][k] +
                           0.5 * i->clock->step * i->path[2][k]) : i->shown[k];
        du[k] *= grown;
    }
    const Direction d = {end, instance_inputs(i, du), 0, i->dx};
    outputs_change(i, &d, unknowns, n_unknowns, sensitivity);
    const Inputs now = instance_inputs(i, end);
    int rates = 0;
    for (size_t k = 0; k < n_unknowns; k++) {
        if (unknowns[k] >= FIRST_DERIVATIVE) {
            if (!rates) /* after outputs_change, which uses the same scratch */
                motion_rate_change(&i->motion, &now, i->x, &d.change, i->dx, i->motion.drate);
            rates = 1;
            sensitivity[k] = i->motion.drate[unknowns[k] - FIRST_DERIVATIVE];
        } else if (unknowns[k] >= FIRST_STATE) {
            sensitivity[k] = i->dx[unknowns[k] - FIRST_STATE];
        }
    }
    return OK;
}

Status instance_output_slopes(Instance *i, const uint32_t *refs, size_t n, double *slopes)
{
    if (check_unknowns(i, refs, n) != OK || instance_settle(i) != OK)
        return ERROR;
    for (size_t k = 0; k < i->model.inputs; k++)
        i->plan[0][k] = i->path[1][k] + i->clock->step * i->path[2][k];
    if (instance_derivatives(i, i->dx, i->model.states) != OK)
        return ERROR;
    const Direction d = {i->shown, instance_inputs(i, i->plan[0]), 1, i->dx};
    outputs_change(i, &d, refs, n, slopes);
    return OK;
}
