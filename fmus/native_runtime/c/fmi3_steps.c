/* FMI 3.0: derivatives, steps, Model Exchange. */
#include "fmi3_component.h"

/* --- derivatives ------------------------------------------------------------------------------- */

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference refs[], size_t n,
                                    const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t n_values)
{
    BEGIN(STEPPING | TERMINATED);
    DEMAND(n == n_values && (n == 0 || (refs != NULL && orders != NULL && values != NULL)),
           "something is missing");
    for (size_t k = 0; k < n; k++)
        DEMAND(orders[k] == 1, "only first derivatives of outputs are known");
    return (fmi3Status)instance_output_slopes(i, refs, n, values);
}

/* --- Co-Simulation ----------------------------------------------------------------------------- */

fmi3Status fmi3EnterStepMode(fmi3Instance c)
{
    BEGIN(ANY);
    DEMAND(0, "there is no event mode that could be left");
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step, fmi3Boolean no_return,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *last)
{
    BEGIN(STEPPING);
    (void)no_return;
    DEMAND(event != NULL && terminate != NULL && early != NULL && last != NULL,
           "no place for the answers given");
    *event = *terminate = *early = fmi3False;
    const Status status = instance_step(i, time, step);
    *last = i->clock->time;
    return (fmi3Status)status;
}

/* --- Model Exchange ---------------------------------------------------------------------------- */

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *need_update,
                                    fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next)
{
    BEGIN(EVENT);
    DEMAND(need_update != NULL && terminate != NULL && nominals != NULL && values != NULL &&
           has_next != NULL && next != NULL, "no place for the answers given");
    *need_update = *terminate = *nominals = *values = *has_next = fmi3False; /* no events, ever */
    *next = 0;
    return fmi3OK;
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c)
{
    BEGIN(EVENT);
    instance_enter(i, CONTINUOUS);
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_return, fmi3Boolean *event,
                                       fmi3Boolean *terminate)
{
    BEGIN(CONTINUOUS);
    (void)no_return;
    DEMAND(event != NULL && terminate != NULL, "no place for the answers given");
    *event = *terminate = fmi3False;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time)
{
    BEGIN(EVENT | CONTINUOUS);
    return (fmi3Status)instance_set_time(i, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    BEGIN(CONTINUOUS);
    DEMAND(n == 0 || x != NULL, "no states given");
    return (fmi3Status)instance_set_states(i, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 rates[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || rates != NULL), "for Model Exchange only");
    return (fmi3Status)instance_derivatives(i, rates, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || x != NULL), "for Model Exchange only");
    return (fmi3Status)instance_states(i, x, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || nominals != NULL), "for Model Exchange only");
    return (fmi3Status)instance_nominals(i, nominals, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n)
{
    BEGIN(ANY);
    (void)indicators;
    DEMAND(n == 0, "there are no event indicators");
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n)
{
    BEGIN(ANY);
    DEMAND(n != NULL, "no place for the number given");
    *n = 0;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n)
{
    BEGIN(ANY);
    DEMAND(n != NULL, "no place for the number given");
    *n = i->model_exchange ? i->model.states : 0;
    return fmi3OK;
}
