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
    const double hold = instance_parameter(i, ROLE_HOLD);
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
    if (!instance_inputs_are_finite(i, i->plan[3]))
        return ERROR;
    instance_configure(i);
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
