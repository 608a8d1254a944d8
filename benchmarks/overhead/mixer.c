/* The mixer (mixer.h) by FMI 2.0. */
#include "fmi2Functions.h"

#include "mixer.h"

/* Value references: inputs from 0, outputs behind them. */
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real v[])
{
    Mixer *m = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= INPUTS) return fmi2Error;
        m->u[vr[i]] = v[i];
    }
    m->set += (long)n;
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[])
{
    Mixer *m = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] >= INPUTS + OUTPUTS) return fmi2Error;
        v[i] = vr[i] < INPUTS ? m->u[vr[i]] : m->y[vr[i] - INPUTS];
    }
    m->got += (long)n;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_return)
{
    (void)t, (void)h, (void)no_return;
    Mixer *m = c;
    m->steps++;
    mix(m);
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *f, fmi2Boolean visible, fmi2Boolean log)
{
    (void)guid, (void)resources, (void)f, (void)visible, (void)log;
    Mixer *m = type == fmi2CoSimulation ? calloc(1, sizeof *m) : NULL;
    if (m) {
        strncpy(m->name, name, sizeof m->name - 1);
        mix(m);
    }
    return m;
}

void fmi2FreeInstance(fmi2Component c)
{
    if (c) tell(c);
    free(c);
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(Mixer));
    if (!*state) return fmi2Error;
    memcpy(*state, c, sizeof(Mixer));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Mixer));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

/* What importers look for when they load. Most of it the FMU does not declare: never called. */
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

#define DOES_NOTHING(function, ...) \
    fmi2Status function(__VA_ARGS__) { return fmi2OK; }
#define HAS_NONE(Type) \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             fmi2##Type v[]) \
    { (void)c, (void)vr, (void)v; return n ? fmi2Error : fmi2OK; } \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             const fmi2##Type v[]) \
    { (void)c, (void)vr, (void)v; return n ? fmi2Error : fmi2OK; }
#define REFUSES(function, Type) \
    fmi2Status function(fmi2Component c, const fmi2StatusKind kind, Type *v) \
    { (void)c, (void)kind, (void)v; return fmi2Discard; }

DOES_NOTHING(fmi2SetupExperiment, fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
             fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
DOES_NOTHING(fmi2SetDebugLogging, fmi2Component c, fmi2Boolean on, size_t n, const fmi2String s[])
DOES_NOTHING(fmi2EnterInitializationMode, fmi2Component c)
DOES_NOTHING(fmi2ExitInitializationMode, fmi2Component c)
DOES_NOTHING(fmi2Terminate, fmi2Component c)
DOES_NOTHING(fmi2Reset, fmi2Component c)
DOES_NOTHING(fmi2CancelStep, fmi2Component c)
DOES_NOTHING(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate state, size_t *n)
DOES_NOTHING(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate state, fmi2Byte b[], size_t n)
DOES_NOTHING(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n,
             fmi2FMUstate *state)
DOES_NOTHING(fmi2GetDirectionalDerivative, fmi2Component c, const fmi2ValueReference z[], size_t nz,
             const fmi2ValueReference v[], size_t nv, const fmi2Real dv[], fmi2Real dz[])
DOES_NOTHING(fmi2SetRealInputDerivatives, fmi2Component c, const fmi2ValueReference vr[], size_t n,
             const fmi2Integer order[], const fmi2Real v[])
DOES_NOTHING(fmi2GetRealOutputDerivatives, fmi2Component c, const fmi2ValueReference vr[], size_t n,
             const fmi2Integer order[], fmi2Real v[])
HAS_NONE(Integer)
HAS_NONE(Boolean)
HAS_NONE(String)
REFUSES(fmi2GetStatus, fmi2Status)
REFUSES(fmi2GetRealStatus, fmi2Real)
REFUSES(fmi2GetIntegerStatus, fmi2Integer)
REFUSES(fmi2GetBooleanStatus, fmi2Boolean)
REFUSES(fmi2GetStringStatus, fmi2String)
