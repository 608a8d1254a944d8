/* The mixer (mixer.h) by FMI 3.0: what an importer of co-simulation calls. */
#include "fmi3Functions.h"

#include "mixer.h"

/* Value references: inputs from 1, outputs behind them. */
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                          const fmi3Float64 v[], size_t n_values)
{
    Mixer *m = c;
    if (n != n_values) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] < 1 || vr[i] > INPUTS) return fmi3Error;
        m->u[vr[i] - 1] = v[i];
    }
    m->set += (long)n;
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                          fmi3Float64 v[], size_t n_values)
{
    Mixer *m = c;
    if (n != n_values) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] < 1 || vr[i] > INPUTS + OUTPUTS) return fmi3Error;
        v[i] = vr[i] <= INPUTS ? m->u[vr[i] - 1] : m->y[vr[i] - 1 - INPUTS];
    }
    m->got += (long)n;
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_return,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *last)
{
    (void)no_return;
    Mixer *m = c;
    m->steps++;
    mix(m);
    *event = *terminate = *early = fmi3False;
    *last = t + h;
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean log,
                                         fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference vr[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback message,
                                         fmi3IntermediateUpdateCallback update)
{
    (void)token, (void)resources, (void)visible, (void)log, (void)early, (void)vr, (void)n;
    (void)environment, (void)message, (void)update;
    Mixer *m = events ? NULL : calloc(1, sizeof *m);
    if (m) {
        strncpy(m->name, name, sizeof m->name - 1);
        mix(m);
    }
    return m;
}

void fmi3FreeInstance(fmi3Instance c)
{
    if (c) tell(c);
    free(c);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    (void)c, (void)has_tolerance, (void)tolerance, (void)start, (void)has_stop, (void)stop;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { (void)c; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }
