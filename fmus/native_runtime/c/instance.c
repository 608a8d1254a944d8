#include "instance.h"

#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { CONSTANT = 0, EXTRAPOLATE = 1, INTERPOLATE = 2 }; /* values of input_hold */

Status instance_fail(Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(instance->text, sizeof instance->text, format, arguments);
    va_end(arguments);
    instance->log(instance->context, ERROR, instance->text);
    return ERROR;
}

/* Lay the arrays out in one block. */
static int make_live(Instance *i)
{
    const size_t u = i->model.inputs, x = i->model.states, v = i->model.variables;
    const size_t clock = sizeof(Clock) / sizeof(double);
    i->live_size = clock + v + 7 * u + 2 * x;
    i->live = calloc(i->live_size + 2 * x + 4 * u, sizeof(double));
    if (i->live == NULL)
        return 0;
    double *at = i->live + clock;
    double **parts[] = {&i->u_before, &i->shown,   &i->u_slope, &i->u_curve,
                        &i->path[0],  &i->path[1], &i->path[2]};
    i->clock = (Clock *)i->live;
    i->value = at;
    at += v;
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++, at += u)
        *parts[k] = at;
    i->x = at;
    i->x_before = at + x;
    i->next = at + 2 * x;
    i->dx = at + 3 * x;
    for (size_t k = 0; k < 4; k++)
        i->plan[k] = at + 4 * x + k * u;
    return 1;
}

static int open_model(Instance *i, const char *resource, const char *guid)
{
    char why[256];
    if (!model_load(&i->model, resource, why, sizeof why)) {
        instance_fail(i, "%s %s; export the FMU again", resource, why);
        return 0;
    }
    if (guid == NULL || strcmp(guid, i->model.guid) != 0) {
        instance_fail(i, "the GUID asked for is %s, that of the model is %s",
                      guid == NULL ? "missing" : guid, i->model.guid);
        return 0;
    }
    if (i->model_exchange && i->model.contact_sign != 0) {
        instance_fail(i, "with a contact of its own this FMU is for co-simulation only");
        return 0;
    }
    if (!make_live(i) || !motion_create(&i->motion, &i->model)) {
        instance_fail(i, "not enough memory");
        return 0;
    }
    return 1;
}

Instance *instance_new(const char *resource, const char *guid, int model_exchange, Log log,
                       void *context)
{
    Instance *i = calloc(1, sizeof *i);
    if (i == NULL) {
        log(context, ERROR, "not enough memory");
        return NULL;
    }
    i->model_exchange = model_exchange;
    i->log = log;
    i->context = context;
    if (!open_model(i, resource, guid)) {
        instance_free(i);
        return NULL;
    }
    instance_reset(i);
    return i;
}

void instance_free(Instance *instance)
{
    motion_free(&instance->motion);
    model_free(&instance->model);
    free(instance->live);
    free(instance);
}

Phase instance_phase(const Instance *instance)
{
    return (Phase)(int)instance->clock->phase;
}

void instance_enter(Instance *instance, Phase phase)
{
    instance->clock->phase = phase;
}

int instance_allows(Instance *instance, Phase phases, const char *call)
{
    if (instance_phase(instance) & phases)
        return 1;
    instance_fail(instance, "%s may not be called now: %s", call,
                  instance_phase(instance) == STARTED        ? "the FMU is not initialised"
                  : instance_phase(instance) == INITIALISING ? "the FMU is being initialised"
                  : instance_phase(instance) == TERMINATED   ? "the FMU was terminated"
                                                             : "the FMU is in another mode");
    return 0;
}

Status instance_reset(Instance *i)
{
    memset(i->live, 0, i->live_size * sizeof(double));
    for (size_t k = 0; k < i->model.variables; k++)
        i->value[k] = i->model.variable[k].start;
    for (size_t k = 0; k < i->model.inputs; k++)
        i->u_before[k] = i->shown[k] = i->path[0][k] = i->value[i->model.input[k]];
    i->clock->before = 1;
    i->clock->stale = 1;
    instance_enter(i, STARTED);
    return OK;
}

/* --- values ------------------------------------------------------------------------------------ */

Inputs instance_inputs(const Instance *i, const double *u)
{
    Inputs now = {{0}, {0}};
    for (size_t k = 0; k < i->model.inputs; k++) {
        const Variable *v = &i->model.variable[i->model.input[k]];
        if (v->role == ROLE_IN_POSITION)
            now.position[v->index] = u[k];
        else
            now.load[v->index] += v->role == ROLE_IN_LOAD ? u[k] : -u[k];
    }
    return now;
}

static int inputs_are_finite(Instance *i, const double *u)
{
    for (size_t k = 0; k < i->model.inputs; k++)
        if (!isfinite(u[k])) {
            instance_fail(i, "input %s = %g: must be finite",
                          i->model.variable[i->model.input[k]].name, u[k]);
            return 0;
        }
    return 1;
}

static double parameter(const Instance *i, Role role)
{
    const uint32_t ref = i->model.of_role[role];
    return ref == UINT32_MAX ? 0 : i->value[ref];
}

static void configure(Instance *i)
{
    i->motion.law.nonlinear = parameter(i, ROLE_NONLINEAR) != 0;
    i->motion.law.C = parameter(i, ROLE_HERTZ);
    i->motion.law.k_H = parameter(i, ROLE_STIFFNESS);
    i->motion.internal_step = parameter(i, ROLE_INTERNAL_STEP);
}

Status instance_settle(Instance *i)
{
    if (!inputs_are_finite(i, i->shown))
        return ERROR;
    configure(i);
    if (instance_phase(i) & (RUNNING | TERMINATED))
        return OK;
    double heights[WHEELSETS] = {0};
    for (size_t k = 0; k < i->model.variables; k++)
        if (i->model.variable[k].role == ROLE_START_Z)
            heights[i->model.variable[k].index] = i->value[k];
    const Inputs now = instance_inputs(i, i->shown);
    if (!motion_rest(&i->motion, &now, heights, i->x))
        return instance_fail(i, "there is no state at rest under these inputs: %s",
                             MOTION_NO_CONTACT);
    return OK;
}

static double output(Instance *i, const Variable *v, const double force[WHEELS],
                     const double z[WHEELS], const double vz[WHEELS], const double *acceleration)
{
    const Model *m = &i->model;
    switch (v->role) {
    case ROLE_OUT_POSITION:
        return parameter(i, ROLE_START_POSITION) + m->wheelset_x[v->index] -
               m->wheelset_x[WHEELSETS - 1] + parameter(i, ROLE_SPEED) * i->clock->time;
    case ROLE_OUT_FORCE: return force[v->index];
    case ROLE_OUT_CONTACT_Z: return z[v->index];
    case ROLE_OUT_CONTACT_VZ: return vz[v->index];
    case ROLE_OUT_COORDINATE: return body_coordinate(&i->motion.body, v->index, i->x);
    case ROLE_OUT_RATE: return body_coordinate(&i->motion.body, v->index, i->motion.rate);
    default: break;
    }
    const size_t first = m->coordinates - WHEELSETS;
    double a = body_coordinate(&i->motion.body, v->index, acceleration);
    if (v->index >= first) { /* a force acts at once on its own body only */
        const size_t k = v->index - first;
        a -= m->inverse_mass[k] * (force[k] + force[k + WHEELSETS] - 2 * m->preload);
    }
    return a;
}

static Status refresh(Instance *i)
{
    if (!i->clock->stale)
        return OK;
    const Status status = instance_settle(i);
    if (status != OK)
        return status;
    const Model *m = &i->model;
    const Inputs now = instance_inputs(i, i->shown);
    double force[WHEELS], z[WHEELS] = {0}, vz[WHEELS] = {0}, *acceleration = i->motion.drate;
    motion_forces(&i->motion, &now, i->x, force);
    if (m->nodes > 0) {
        body_observe_moving(&i->motion.body, body_shapes(&i->motion.body, now.position), i->x,
                            force, z, vz);
    } else { /* all modes are there, so a force changes no velocity at once */
        body_rate(&i->motion.body, i->x, NULL, i->motion.rate);
        body_acceleration(&i->motion.body, i->x, acceleration);
    }
    for (size_t k = 0; k < m->outputs; k++)
        i->value[m->output[k]] =
            output(i, &m->variable[m->output[k]], force, z, vz, acceleration);
    i->clock->stale = 0;
    return OK;
}

/* A variable of the table, or NULL with a sentence. */
static const Variable *variable(Instance *i, uint32_t ref, ValueType type)
{
    static const char *const NAMES[] = {"Real", "Integer", "Boolean"};
    if (ref < i->model.variables && i->model.variable[ref].type == type)
        return &i->model.variable[ref];
    instance_fail(i, "there is no %s variable with reference %lu", NAMES[type],
                  (unsigned long)ref);
    return NULL;
}

Status instance_get(Instance *i, const uint32_t *refs, size_t n, ValueType type, double *values)
{
    const size_t states = i->model.states;
    int rates = 0; /* whether i->next holds them */
    for (size_t k = 0; k < n; k++) {
        const size_t ref = refs[k];
        if (type == REAL && ref >= FIRST_STATE && ref < FIRST_STATE + states) {
            if (instance_settle(i) != OK)
                return ERROR;
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
            values[k] = v->causality == INDEPENDENT ? i->clock->time : i->value[ref];
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
    for (size_t k = 0; k < n; k++)
        i->value[refs[k]] = values[k];
    for (size_t k = 0; k < i->model.inputs; k++)
        i->shown[k] = i->value[i->model.input[k]];
    i->clock->stale = 1;
    return OK;
}

Status instance_set_slope(Instance *i, uint32_t ref, int order, double value)
{
    for (size_t k = 0; k < i->model.inputs; k++)
        if (i->model.input[k] == ref) {
            if (order < 1 || order > 2 || !isfinite(value))
                return instance_fail(i, "derivative %d of %s = %g: must be finite, of order 1 or 2",
                                     order, i->model.variable[ref].name, value);
            (order == 1 ? i->u_slope : i->u_curve)[k] = value;
            i->clock->has_slopes = 1;
            return OK;
        }
    return instance_fail(i, "there is no Real input with reference %lu", (unsigned long)ref);
}

/* --- life -------------------------------------------------------------------------------------- */

Status instance_set_time(Instance *i, double time)
{
    if (!isfinite(time))
        return instance_fail(i, "time = %g s: must be finite", time);
    i->clock->time = time;
    i->clock->stale = 1;
    return OK;
}

Status instance_exit_initialisation(Instance *i)
{
    const Status status = instance_settle(i);
    if (status != OK)
        return status;
    memcpy(i->u_before, i->shown, i->model.inputs * sizeof(double));
    memcpy(i->x_before, i->x, i->model.states * sizeof(double));
    i->clock->stale = 1;
    instance_enter(i, i->model_exchange ? EVENT : STEPPING);
    return OK;
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
    const Inputs now = instance_inputs(i, i->shown);
    motion_rate(&i->motion, &now, i->x, rate);
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

/* Inputs over the next step, into i->plan, and how they follow the values set. */
static void plan(Instance *i, double step, double *before, double *change)
{
    const double hold = parameter(i, ROLE_HOLD);
    const int given = i->clock->has_slopes != 0;
    const int extrapolates = !given && hold == EXTRAPOLATE && i->clock->step > 0;
    const int interpolates = !given && hold == INTERPOLATE;
    *before = interpolates ? 0 : 1;
    *change = interpolates ? 1 / step : extrapolates ? 1 / i->clock->step : 0;
    for (size_t k = 0; k < i->model.inputs; k++) {
        const double u = i->plan[3][k];
        i->plan[0][k] = interpolates ? i->u_before[k] : u;
        i->plan[1][k] = given ? i->u_slope[k] : (u - i->u_before[k]) * *change;
        i->plan[2][k] = given ? i->u_curve[k] : 0;
    }
}

static int all_finite(const double *x, size_t n)
{
    int bad = 0; /* without an early end, so that it is vector code */
    for (size_t k = 0; k < n; k++)
        bad |= !(fabs(x[k]) <= DBL_MAX);
    return !bad;
}

/* The step itself, into i->next; a sentence if it fails. */
static const char *move(Instance *i, double step)
{
    for (int order = 0; order < 3; order++)
        if (!all_finite(i->plan[order], i->model.inputs))
            return "the inputs change too fast for numbers";
    const InputPath path = {instance_inputs(i, i->plan[0]), instance_inputs(i, i->plan[1]),
                            instance_inputs(i, i->plan[2])};
    const char *failed = motion_step(&i->motion, &path, step, i->x, i->next);
    if (failed == NULL && !all_finite(i->next, i->model.states))
        return "the result is not finite: the inputs are far off";
    return failed;
}

Status instance_step(Instance *i, double time, double step)
{
    const Model *m = &i->model;
    const size_t u = m->inputs, bytes = u * sizeof(double);
    double before, change;
    if (!(isfinite(step) && step > 0))
        return instance_fail(i, "step size %g s: must be finite and > 0", step);
    if (!isfinite(time + step))
        return instance_fail(i, "time %g s: must be finite", time);
    for (size_t k = 0; k < u; k++)
        i->plan[3][k] = i->value[m->input[k]];
    if (!inputs_are_finite(i, i->plan[3]))
        return ERROR;
    configure(i);
    plan(i, step, &before, &change);
    const char *failed = move(i, step);
    if (failed != NULL)
        return instance_fail(i, "step of %g s at t = %g s: %s", step, time, failed);
    memcpy(i->x_before, i->x, m->states * sizeof(double));
    memcpy(i->x, i->next, m->states * sizeof(double));
    memcpy(i->u_before, i->plan[3], bytes);
    for (int order = 0; order < 3; order++)
        memcpy(i->path[order], i->plan[order], bytes);
    for (size_t k = 0; k < u; k++) /* an interpolated path ends at the value set, to the bit */
        i->shown[k] = before == 0 ? i->plan[3][k]
                                  : i->plan[0][k] + step * (i->plan[1][k] +
                                                            0.5 * step * i->plan[2][k]);
    memset(i->u_slope, 0, bytes);
    memset(i->u_curve, 0, bytes);
    i->clock->has_slopes = 0;
    i->clock->before = before;
    i->clock->change = change;
    i->clock->time = time + step;
    i->clock->step = step;
    i->clock->stale = 1;
    return OK;
}
