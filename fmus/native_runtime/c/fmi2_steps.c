/* FMI 2.0: derivatives, steps, Model Exchange. */
#include "fmi2_component.h"

#include <string.h>

/* --- derivatives ------------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t n_unknowns, const fmi2ValueReference knowns[],
                                        size_t n_knowns, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    BEGIN(ANY & ~STARTED);
    DEMAND((n_unknowns == 0 || (unknowns != NULL && sensitivity != NULL)) &&
           (n_knowns == 0 || (knowns != NULL && seed != NULL)), "references or values are missing");
    return (fmi2Status)instance_directional(i, unknowns, n_unknowns, knowns, n_knowns, seed,
                                            sensitivity);
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                                       const fmi2Integer orders[], const fmi2Real values[])
{
    BEGIN(STARTED | INITIALISING | STEPPING);
    DEMAND(n == 0 || (refs != NULL && orders != NULL && values != NULL), "something is missing");
    return (fmi2Status)instance_set_slopes(i, refs, n, orders, values);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                                        const fmi2Integer orders[], fmi2Real values[])
{
    BEGIN(STEPPING | TERMINATED);
    DEMAND(n == 0 || (refs != NULL && orders != NULL && values != NULL), "something is missing");
    for (size_t k = 0; k < n; k++)
        DEMAND(orders[k] == 1, "only first derivatives of outputs are known");
    return (fmi2Status)instance_output_slopes(i, refs, n, values);
}

/* --- Co-Simulation ----------------------------------------------------------------------------- */

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step, fmi2Boolean no_return)
{
    BEGIN(STEPPING);
    (void)no_return;
    return (fmi2Status)instance_step(i, time, step);
}

fmi2Status fmi2CancelStep(fmi2Component c)
{
    BEGIN(ANY);
    DEMAND(0, "steps are never left unfinished");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    BEGIN(ANY);
    (void)kind;
    (void)value;
    (void)i;
    return fmi2Discard; /* for FMUs that step asynchronously */
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    BEGIN(ANY);
    if (kind != fmi2LastSuccessfulTime || value == NULL)
        return fmi2Discard;
    *value = i->clock->time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    BEGIN(ANY);
    (void)kind;
    (void)value;
    (void)i;
    return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    BEGIN(ANY);
    (void)i;
    if (kind != fmi2Terminated || value == NULL)
        return fmi2Discard;
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    BEGIN(ANY);
    (void)kind;
    (void)value;
    (void)i;
    return fmi2Discard;
}

/* --- Model Exchange ---------------------------------------------------------------------------- */

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    BEGIN(EVENT | CONTINUOUS);
    instance_enter(i, EVENT);
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    BEGIN(EVENT);
    DEMAND(info != NULL, "no place for the event's information given");
    memset(info, 0, sizeof *info); /* no events, ever */
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    BEGIN(EVENT);
    instance_enter(i, CONTINUOUS);
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_return, fmi2Boolean *event,
                                       fmi2Boolean *terminate)
{
    BEGIN(CONTINUOUS);
    (void)no_return;
    DEMAND(event != NULL && terminate != NULL, "no place for the answers given");
    *event = *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    BEGIN(EVENT | CONTINUOUS);
    return (fmi2Status)instance_set_time(i, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n)
{
    BEGIN(CONTINUOUS);
    DEMAND(n == 0 || x != NULL, "no states given");
    return (fmi2Status)instance_set_states(i, x, n);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rates[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || rates != NULL), "for Model Exchange only");
    return (fmi2Status)instance_derivatives(i, rates, n);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n)
{
    BEGIN(ANY);
    (void)indicators;
    DEMAND(n == 0, "there are no event indicators");
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || x != NULL), "for Model Exchange only");
    return (fmi2Status)instance_states(i, x, n);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t n)
{
    BEGIN(ANY & ~STARTED);
    DEMAND(i->model_exchange && (n == 0 || nominals != NULL), "for Model Exchange only");
    return (fmi2Status)instance_nominals(i, nominals, n);
}
