/* Values of an instance: inputs and parameters set, outputs computed when somebody asks. */
#include "instance.h"

#include <math.h>
#include <string.h>

void instance_inputs(const Instance *i, const double *u, Inputs *inputs)
{
    memset(inputs->position, 0, inputs_size(&i->model) * sizeof(double));
    for (size_t k = 0; k < i->model.inputs; k++) {
        const Variable *v = &i->model.variable[i->model.input[k]];
        if (v->role == ROLE_IN_POSITION)
            inputs->position[v->index] = u[k];
        else if (v->role == ROLE_IN_SPEED)
            for (size_t at = ROLLING_SPEED; at < i->model.sides * i->model.wheelsets * i->model.given;
                 at += i->model.given)
                inputs->load[at] = u[k];
        else
            inputs->load[v->index] += v->role == ROLE_IN_LOAD ? u[k] : -u[k];
    }
}

void instance_path(const Instance *i, double *const u[3], InputPath *path)
{
    instance_inputs(i, u[0], &path->start);
    instance_inputs(i, u[1], &path->slope);
    instance_inputs(i, u[2], &path->curve);
}

int instance_inputs_are_finite(Instance *i, const double *u)
{
    for (size_t k = 0; k < i->model.inputs; k++)
        if (!isfinite(u[k])) {
            instance_fail(i, "input %s = %g: must be finite",
                          i->model.variable[i->model.input[k]].name, u[k]);
            return 0;
        }
    return 1;
}

int instance_creeps(Instance *i, const double *u)
{
    const uint32_t ref = i->model.of_role[ROLE_IN_SPEED];
    if (ref == UINT32_MAX)
        return 1;
    const Variable *v = &i->model.variable[ref];
    if (u[v->place] >= v->minimum)
        return 1;
    instance_fail(i, "input %s = %g: must be at least %g, also at the end of a step: standing "
                     "wheels do not creep, they hold", v->name, u[v->place], v->minimum);
    return 0;
}

Status instance_settle(Instance *i)
{
    if (!instance_inputs_are_finite(i, i->shown) || !instance_creeps(i, i->shown))
        return ERROR;
    instance_configure(i);
    if (instance_phase(i) & (RUNNING | TERMINATED))
        return OK;
    memset(i->heights, 0, i->model.wheelsets * sizeof(double));
    for (size_t k = 0; k < i->model.variables; k++)
        if (i->model.variable[k].role == ROLE_START_Z)
            i->heights[i->model.variable[k].index] = i->value[k];
    instance_inputs(i, i->shown, &i->now);
    motion_forget(&i->motion);
    if (!motion_rest(&i->motion, &i->now, i->heights, i->x))
        return instance_fail(i, "there is no state at rest under these inputs: %s",
                             MOTION_NO_CONTACT);
    return OK;
}

static double output(Instance *i, const Variable *v, const double *acceleration)
{
    const Model *m = &i->model;
    switch (v->role) {
    case ROLE_OUT_POSITION:
        return instance_parameter(i, ROLE_START_POSITION) + m->wheelset_x[v->index] -
               m->wheelset_x[m->wheelsets - 1] + instance_speed(i) * i->clock->time -
               i->clock->behind;
    case ROLE_OUT_FORCE: return i->pushed[v->index];
    case ROLE_OUT_CONTACT_Z: return i->z[v->index];
    case ROLE_OUT_CONTACT_VZ: return i->vz[v->index];
    case ROLE_OUT_SEEN: return i->seen[v->index];
    case ROLE_OUT_COORDINATE: return body_coordinate(&i->motion.body, v->index, i->x);
    case ROLE_OUT_RATE: return body_coordinate(&i->motion.body, v->index, i->motion.rate);
    default: break;
    }
    return body_coordinate(&i->motion.body, v->index, acceleration) +
           motion_through(&i->motion, v->index, i->force);
}

/* What is seen at fixed places, under the contact forces that are known. */
static void see(Instance *i)
{
    Motion *motion = &i->motion;
    if (i->model.seen.rates) {
        const Shapes *shapes = body_shapes(&motion->body, i->now.position);
        body_rate(&motion->body, i->x, motion_driven(motion, shapes, i->force), motion->rate);
    }
    body_see(&motion->body, i->x, motion->rate, i->seen);
}

/* Forces and motions of contacts, rates and accelerations, as far as outputs show them. */
static int find_motion(Instance *i)
{
    Motion *motion = &i->motion;
    instance_inputs(i, i->shown, &i->now);
    if (i->model.nodes > 0) {
        if (!motion_see(motion, &i->now, i->x, i->force, i->z, i->vz))
            return 0;
        motion_on_other(motion, &i->now, i->z, i->vz, i->pushed);
        if (i->model.seen.outputs > 0)
            see(i);
        return 1;
    }
    /* All modes are there, so a force changes no velocity at once. */
    if (!motion_forces(motion, &i->now, i->x, i->force))
        return 0;
    const Shapes *shapes = body_shapes(&motion->body, i->now.position);
    body_rate(&motion->body, i->x, NULL, motion->rate);
    body_observe(&motion->body, shapes, i->x, i->z);
    body_observe(&motion->body, shapes, motion->rate, i->vz);
    motion_on_other(motion, &i->now, i->z, i->vz, i->pushed);
    body_acceleration(&motion->body, i->x, motion->drate);
    return 1;
}

static Status refresh(Instance *i)
{
    if (!i->clock->stale)
        return OK;
    const Status status = instance_settle(i);
    if (status != OK)
        return status;
    const Model *m = &i->model;
    if (!find_motion(i))
        return instance_fail(i, "%s", MOTION_NO_CONTACT);
    for (size_t k = 0; k < m->outputs; k++)
        i->value[m->output[k]] = output(i, &m->variable[m->output[k]], i->motion.drate);
    i->clock->stale = 0;
    return OK;
}

/* --- states ------------------------------------------------------------------------------------ */

Status instance_states(Instance *i, double *x, size_t n)
{
    if (n != i->model.states)
        return instance_fail(i, "%lu states asked for, there are %lu", (unsigned long)n,
                             (unsigned long)i->model.states);
    const Status status = instance_settle(i);
    if (status == OK)
        memcpy(x, i->x, n * sizeof(double));
    return status;
}

Status instance_set_states(Instance *i, const double *x, size_t n)
{
    if (n != i->model.states)
        return instance_fail(i, "%lu states given, there are %lu", (unsigned long)n,
                             (unsigned long)i->model.states);
    for (size_t k = 0; k < n; k++)
        if (!isfinite(x[k]))
            return instance_fail(i, "state %lu = %g: must be finite", (unsigned long)k, x[k]);
    memcpy(i->x, x, n * sizeof(double));
    motion_forget(&i->motion);
    i->clock->stale = 1;
    return OK;
}

Status instance_derivatives(Instance *i, double *rate, size_t n)
{
    if (n != i->model.states)
        return instance_fail(i, "%lu derivatives asked for, there are %lu", (unsigned long)n,
                             (unsigned long)i->model.states);
    const Status status = instance_settle(i);
    if (status != OK)
        return status;
    instance_inputs(i, i->shown, &i->now);
    if (!motion_rate(&i->motion, &i->now, i->x, rate))
        return instance_fail(i, "%s", MOTION_NO_CONTACT);
    return OK;
}

Status instance_nominals(Instance *i, double *nominals, size_t n)
{
    const size_t modes = i->model.modes, rigid = i->model.rigid;
    if (n != i->model.states)
        return instance_fail(i, "%lu nominals asked for, there are %lu", (unsigned long)n,
                             (unsigned long)i->model.states);
    for (size_t k = 0; k < n; k++)
        nominals[k] = i->model.nominals[k < 2 * modes ? k / modes : 2 + (k - 2 * modes) / rigid];
    return OK;
}

/* --- by reference ------------------------------------------------------------------------------- */

/* A variable of the table, or NULL with a sentence. */
static const Variable *variable(Instance *i, uint32_t ref, ValueType type)
{
    static const char *const NAMES[] = {"Real", "Integer", "Boolean"};
    const uint32_t place = instance_place(i, ref);
    if (place < i->model.variables && i->model.variable[place].type == type)
        return &i->model.variable[place];
    instance_fail(i, "there is no %s variable with reference %lu", NAMES[type],
                  (unsigned long)ref);
    return NULL;
}

Status instance_get(Instance *i, const uint32_t *refs, size_t n, ValueType type, double *values)
{
    const size_t states = i->model.states;
    int settled = 0, rates = 0; /* whether i->x and i->next hold states and their derivatives */
    for (size_t k = 0; k < n; k++) {
        const size_t ref = refs[k];
        if (type == REAL && ref >= FIRST_STATE && ref < FIRST_STATE + states) {
            if (!settled && instance_settle(i) != OK)
                return ERROR;
            settled = 1;
            values[k] = i->x[ref - FIRST_STATE];
        } else if (type == REAL && ref >= FIRST_DERIVATIVE && ref < FIRST_DERIVATIVE + states) {
            if (!rates && instance_derivatives(i, i->next, states) != OK)
                return ERROR;
            rates = 1;
            values[k] = i->next[ref - FIRST_DERIVATIVE];
        } else {
            const Variable *v = variable(i, refs[k], type);
            if (v == NULL || (v->causality == OUTPUT && refresh(i) != OK))
                return ERROR;
            values[k] = v->causality == INDEPENDENT ? i->clock->time
                                                    : i->value[v - i->model.variable];
        }
    }
    return OK;
}

static Status check_new(Instance *i, uint32_t ref, ValueType type, double value)
{
    const Variable *v = variable(i, ref, type);
    if (v == NULL)
        return ERROR;
    const int running = !(instance_phase(i) & (STARTED | INITIALISING));
    if (v->causality == OUTPUT || v->causality == INDEPENDENT)
        return instance_fail(i, "%s cannot be set: it is computed", v->name);
    if (v->causality == PARAMETER && running && !v->tunable)
        return instance_fail(i, "%s cannot be set: it is fixed once the FMU is initialised",
                             v->name);
    /* Inputs that are no numbers are refused where they are used: some may be set meanwhile. */
    if (v->causality == PARAMETER && !(isfinite(value) && value >= v->minimum &&
                                       value <= v->maximum))
        return instance_fail(i, "%s = %g: must be finite, at least %g and at most %g", v->name,
                             value, v->minimum, v->maximum);
    return OK;
}

Status instance_set(Instance *i, const uint32_t *refs, size_t n, ValueType type,
                    const double *values)
{
    for (size_t k = 0; k < n; k++)
        if (check_new(i, refs[k], type, values[k]) != OK)
            return ERROR;
    for (size_t k = 0; k < n; k++) {
        const uint32_t place = instance_place(i, refs[k]);
        const Variable *v = &i->model.variable[place];
        i->value[place] = values[k];
        if (v->causality == INPUT)
            i->shown[v->place] = values[k]; /* the others stay where the last step took them */
    }
    i->clock->stale = 1;
    return OK;
}
