#include "instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

Status instance_fail(Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(instance->text, sizeof instance->text, format, arguments);
    va_end(arguments);
    instance->log(instance->context, ERROR, instance->text);
    return ERROR;
}

Status instance_warn(Instance *instance, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(instance->text, sizeof instance->text, format, arguments);
    va_end(arguments);
    instance->log(instance->context, WARNING, instance->text);
    return WARNING;
}

/* Lay the arrays out in one block. */
static int make_live(Instance *i)
{
    const size_t u = i->model.inputs, v = i->model.variables;
    const size_t clock = sizeof(Clock) / sizeof(double);
    i->live_size = clock + v + 7 * u;
    i->live = memory_take(&i->model.memory, i->live_size + 4 * u, sizeof(double));
    if (i->live == NULL)
        return 0;
    double *at = i->live + clock;
    double **parts[] = {&i->u_end,   &i->shown,   &i->u_slope, &i->u_curve,
                        &i->path[0], &i->path[1], &i->path[2]};
    i->clock = (Clock *)i->live;
    i->value = at;
    at += v;
    for (size_t k = 0; k < sizeof parts / sizeof *parts; k++, at += u)
        *parts[k] = at;
    for (size_t k = 0; k < 4; k++)
        i->plan[k] = at + k * u;
    return 1;
}

static void lay_out_states(Instance *i)
{
    double **of_x[] = {&i->x, &i->x_before, &i->next, &i->dx};
    for (size_t k = 0; k < sizeof of_x / sizeof *of_x; k++)
        *of_x[k] = arrays_take(&i->states, i->model.states);
}

static int make_states(Instance *i)
{
    lay_out_states(i);
    if (!arrays_make(&i->states, &i->model.memory))
        return 0;
    lay_out_states(i);
    return 1;
}

/* Arrays as long as there are wheelsets and contacts. */
static int make_scratch(Instance *i)
{
    const Model *m = &i->model;
    const size_t u = inputs_size(m), n = m->wheelsets, c = m->contacts;
    Inputs *of_u[] = {&i->now, &i->change, &i->over.start, &i->over.slope, &i->over.curve,
                      &i->over_change.start, &i->over_change.slope, &i->over_change.curve};
    const size_t us = sizeof of_u / sizeof *of_u;
    i->scratch = memory_take(&i->model.memory,
                             us * u + 4 * n + 3 * c + MOST_OWN * m->sides * n + m->seen.outputs,
                             sizeof(double));
    if (i->scratch == NULL)
        return 0;
    for (size_t k = 0; k < us; k++)
        *of_u[k] = inputs_in(m, i->scratch + k * u);
    i->heights = i->scratch + us * u;
    i->dheights = i->heights + n;
    i->dlaw = i->dheights + n;
    i->force = i->dlaw + 2 * n;
    i->z = i->force + c;
    i->vz = i->z + c;
    i->pushed = i->vz + c;
    i->seen = i->pushed + MOST_OWN * m->sides * n;
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
    if (i->model_exchange && (i->model.contact_sign != 0 || i->model.gaps.count > 0)) {
        instance_fail(i, "with a contact of its own this FMU is for co-simulation only");
        return 0;
    }
    if (!make_live(i) || !make_states(i) || !make_scratch(i) ||
        !motion_create(&i->motion, &i->model, &i->model.memory)) {
        instance_fail(i, "not enough memory, or more is needed than a model of this size may take");
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
    free(instance->states.memory);
    free(instance->scratch);
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
    memset(i->x, 0, i->model.states * sizeof(double));
    memset(i->x_before, 0, i->model.states * sizeof(double));
    motion_forget(&i->motion);
    for (size_t k = 0; k < i->model.variables; k++)
        i->value[k] = i->model.variable[k].start;
    for (size_t k = 0; k < i->model.inputs; k++)
        i->u_end[k] = i->shown[k] = i->path[0][k] = i->value[i->model.input[k]];
    i->stop = INFINITY;
    i->clock->before = 1;
    i->clock->stale = 1;
    instance_enter(i, STARTED);
    return OK;
}
