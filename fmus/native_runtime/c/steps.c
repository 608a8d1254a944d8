/* Time of an instance: start, steps, and how inputs go on over a step. */
#include "instance.h"

#include <math.h>
#include <string.h>

#define ROUNDING 1e-9

enum { CONSTANT = 0, EXTRAPOLATE = 1, INTERPOLATE = 2 }; /* values of input_hold */

Status instance_set_time(Instance *i, double time)
{
    if (!isfinite(time))
        return instance_fail(i, "time = %g s: must be finite", time);
    i->clock->time = time;
    i->clock->stale = 1;
    return OK;
}

Status instance_set_span(Instance *i, double start, double stop)
{
    if (isnan(stop) || stop < start)
        return instance_fail(i, "stop time %g s: must not be before the start, %g s", stop, start);
    i->stop = stop;
    return instance_set_time(i, start);
}

Status instance_exit_initialisation(Instance *i)
{
    const Status status = instance_settle(i);
    if (status != OK)
        return status;
    memcpy(i->u_end, i->shown, i->model.inputs * sizeof(double));
    memcpy(i->x_before, i->x, i->model.states * sizeof(double));
    i->clock->stale = 1;
    instance_enter(i, i->model_exchange ? EVENT : STEPPING);
    return OK;
}

/* Place of an input among the inputs; their number if it is none. */
static size_t input_place(const Instance *i, uint32_t ref)
{
    const Model *m = &i->model;
    const uint32_t place = instance_place(i, ref);
    const int is_input = place < m->variables && m->variable[place].causality == INPUT;
    return is_input ? m->variable[place].place : m->inputs;
}

Status instance_set_slopes(Instance *i, const uint32_t *refs, size_t n, const int *orders,
                           const double *values)
{
    for (size_t k = 0; k < n; k++) { /* all or nothing */
        if (input_place(i, refs[k]) == i->model.inputs)
            return instance_fail(i, "there is no Real input with reference %lu",
                                 (unsigned long)refs[k]);
        if (orders[k] < 1 || orders[k] > 2 || !isfinite(values[k]))
            return instance_fail(i, "derivative %d of %s = %g: must be finite, of order 1 or 2",
                                 orders[k], i->model.variable[instance_place(i, refs[k])].name, values[k]);
    }
    for (size_t k = 0; k < n; k++)
        (orders[k] == 1 ? i->u_slope : i->u_curve)[input_place(i, refs[k])] = values[k];
    i->clock->has_slopes = n > 0 || i->clock->has_slopes != 0;
    return OK;
}

/* Inputs over the next step, into i->plan, and how they follow the values set. The last step says
   where inputs come from, so that `input_hold` may change: the values it began with are those of a
   step ago, and where it ended the next one goes on. */
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
        const double from = interpolates ? i->u_end[k] : i->path[0][k];
        i->plan[0][k] = interpolates ? from : u;
        i->plan[1][k] = given ? i->u_slope[k] : (u - from) * *change;
        i->plan[2][k] = given ? i->u_curve[k] : 0;
    }
}

/* Inputs at the end of the next step, into i->plan[3]: an interpolated path ends at the value set, to
   the bit. */
static void plan_end(Instance *i, double step, double before)
{
    for (size_t k = 0; before != 0 && k < i->model.inputs; k++)
        i->plan[3][k] = i->plan[0][k] + step * (i->plan[1][k] + 0.5 * step * i->plan[2][k]);
}

/* The integral of t dV from the end of the last step to that of the next one. */
static double falls_behind(const Instance *i, double step)
{
    const uint32_t ref = i->model.of_role[ROLE_IN_SPEED];
    if (ref == UINT32_MAX)
        return 0;
    const size_t k = i->model.variable[ref].place;
    const double slope = i->plan[1][k], curve = i->plan[2][k], t = i->clock->time;
    return t * (i->plan[0][k] - i->u_end[k]) +
           step * (slope * (t + 0.5 * step) + curve * step * (0.5 * t + step / 3));
}

/* The step itself, into i->next; a sentence if it fails. */
static const char *move(Instance *i, double step)
{
    const Kernels *kernels = i->motion.body.kernels;
    for (int order = 0; order < 3; order++)
        if (kernels->finite(i->model.inputs, i->plan[order]) != 0)
            return "the inputs change too fast for numbers";
    instance_path(i, i->plan, &i->over);
    const char *failed = motion_step(&i->motion, &i->over, step, i->x, i->next);
    if (failed == NULL && kernels->finite(i->model.states, i->next) != 0)
        failed = "the result is not finite: the inputs are far off";
    if (failed != NULL)
        motion_forget(&i->motion); /* what is seen is not of the state, which stays */
    return failed;
}

Status instance_step(Instance *i, double time, double step)
{
    const Model *m = &i->model;
    const size_t u = m->inputs, bytes = u * sizeof(double);
    /* Masters sum up times: a small part of a step, or of a time, is rounding. */
    const double rounding = ROUNDING * (step + fabs(time));
    Status status = OK;
    double before, change;
    if (!(isfinite(step) && step > 0))
        return instance_fail(i, "step size %g s: must be finite and > 0", step);
    if (!isfinite(time + step))
        return instance_fail(i, "time %g s: must be finite", time);
    if (time + step > i->stop + rounding)
        return instance_fail(i, "a step of %g s from %g s ends behind the stop time, %g s", step, time,
                             i->stop);
    if (fabs(time - i->clock->time) > rounding)
        status = instance_warn(i, "a step from t = %g s, but the last one ended at %g s", time,
                               i->clock->time);
    for (size_t k = 0; k < u; k++)
        i->plan[3][k] = i->value[m->input[k]];
    if (!instance_inputs_are_finite(i, i->plan[3]) || !instance_creeps(i, i->plan[3]))
        return ERROR;
    instance_configure(i);
    plan(i, step, &before, &change);
    plan_end(i, step, before);
    if (!instance_creeps(i, i->plan[3]))
        return ERROR;
    const char *failed = move(i, step);
    if (failed != NULL)
        return instance_fail(i, "step of %g s at t = %g s: %s", step, time, failed);
    double *oldest = i->x_before;
    i->x_before = i->x;
    i->x = i->next;
    i->next = oldest;
    for (int order = 0; order < 3; order++)
        memcpy(i->path[order], i->plan[order], bytes);
    i->clock->behind += falls_behind(i, step);
    memcpy(i->shown, i->plan[3], bytes);
    memcpy(i->u_end, i->shown, bytes);
    memset(i->u_slope, 0, bytes);
    memset(i->u_curve, 0, bytes);
    i->clock->has_slopes = 0;
    i->clock->before = before;
    i->clock->change = change;
    i->clock->time = time + step;
    i->clock->step = step;
    i->clock->stale = 1;
    return status;
}
