/* FMI 2.0 for driver.c. */
#include "driver.h"
#include "fmi2Functions.h"

typedef fmi2Component Instance;
typedef fmi2FMUstate State;
typedef fmi2Boolean Boolean;
typedef fmi2Integer Integer;

static void log_fmi2(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                     fmi2String category, fmi2String message, ...)
{
    char text[2000];
    va_list rest;
    (void)environment;
    (void)instance;
    va_start(rest, message);
    vsnprintf(text, sizeof text, message, rest);
    va_end(rest);
    tell(status, category, text);
}

static Instance create(int exchange, const char *guid, const char *resources, int logging)
{
    static const fmi2CallbackFunctions callbacks = {log_fmi2, calloc, free, NULL, NULL};
    return CALL(fmi2Instantiate)("driver", exchange ? fmi2ModelExchange : fmi2CoSimulation, guid,
                                 resources, &callbacks, fmi2False, logging);
}

static void destroy(Instance c) { CALL(fmi2FreeInstance)(c); }

static int enter(Instance c, double start, int stop_defined, double stop)
{
    const int status = CALL(fmi2SetupExperiment)(c, fmi2False, 0, start, stop_defined, stop);
    return status > fmi2Warning ? status : (int)CALL(fmi2EnterInitializationMode)(c);
}

static int leave(Instance c) { return CALL(fmi2ExitInitializationMode)(c); }
static int terminate(Instance c) { return CALL(fmi2Terminate)(c); }
static int reset(Instance c) { return CALL(fmi2Reset)(c); }

static int debug(Instance c, int on, size_t n, const char *const *categories)
{
    return CALL(fmi2SetDebugLogging)(c, on, n, categories);
}

static int set_reals(Instance c, const Ref *refs, size_t n, const double *values, size_t m)
{
    (void)m; /* every value is a scalar */
    return CALL(fmi2SetReal)(c, refs, n, values);
}

static int get_reals(Instance c, const Ref *refs, size_t n, double *values, size_t m)
{
    (void)m;
    return CALL(fmi2GetReal)(c, refs, n, values);
}

static int set_integers(Instance c, const Ref *refs, size_t n, const Integer *values)
{
    return CALL(fmi2SetInteger)(c, refs, n, values);
}

static int get_integers(Instance c, const Ref *refs, size_t n, Integer *values)
{
    return CALL(fmi2GetInteger)(c, refs, n, values);
}

static int set_booleans(Instance c, const Ref *refs, size_t n, const Boolean *values)
{
    return CALL(fmi2SetBoolean)(c, refs, n, values);
}

static int get_booleans(Instance c, const Ref *refs, size_t n, Boolean *values)
{
    return CALL(fmi2GetBoolean)(c, refs, n, values);
}

static int get_strings(Instance c, const Ref *refs, size_t n, const char **values)
{
    return CALL(fmi2GetString)(c, refs, n, values);
}

static int set_strings(Instance c, const Ref *refs, size_t n, const char *const *values)
{
    return CALL(fmi2SetString)(c, refs, n, values);
}

static int step(Instance c, double t, double h)
{
    return CALL(fmi2DoStep)(c, t, h, fmi2True);
}

static int input_derivatives(Instance c, const Ref *refs, size_t n, const Integer *orders,
                             const double *values)
{
    return CALL(fmi2SetRealInputDerivatives)(c, refs, n, orders, values);
}

static int output_derivatives(Instance c, const Ref *refs, size_t n, const Integer *orders,
                              double *values)
{
    return CALL(fmi2GetRealOutputDerivatives)(c, refs, n, orders, values);
}

static int save(Instance c, State *state) { return CALL(fmi2GetFMUstate)(c, state); }
static int restore(Instance c, State state) { return CALL(fmi2SetFMUstate)(c, state); }
static int free_state(Instance c, State *state) { return CALL(fmi2FreeFMUstate)(c, state); }

static int state_size(Instance c, State state, size_t *size)
{
    return CALL(fmi2SerializedFMUstateSize)(c, state, size);
}

static int serialize(Instance c, State state, unsigned char *bytes, size_t size)
{
    return CALL(fmi2SerializeFMUstate)(c, state, (fmi2Byte *)bytes, size);
}

static int deserialize(Instance c, const unsigned char *bytes, size_t size, State *state)
{
    return CALL(fmi2DeSerializeFMUstate)(c, (const fmi2Byte *)bytes, size, state);
}

static int directional(Instance c, const Ref *unknowns, size_t n, const Ref *knowns, size_t m,
                       const double *seed, size_t n_seed, double *result, size_t n_result)
{
    (void)n_seed; /* every value is a scalar */
    (void)n_result;
    return CALL(fmi2GetDirectionalDerivative)(c, unknowns, n, knowns, m, seed, result);
}

static int set_time(Instance c, double t) { return CALL(fmi2SetTime)(c, t); }
static int event_mode(Instance c) { return CALL(fmi2EnterEventMode)(c); }
static int continuous_mode(Instance c) { return CALL(fmi2EnterContinuousTimeMode)(c); }

static int discrete(Instance c)
{
    fmi2EventInfo info;
    memset(&info, 0, sizeof info);
    return CALL(fmi2NewDiscreteStates)(c, &info);
}

static int completed(Instance c)
{
    fmi2Boolean event, stop;
    return CALL(fmi2CompletedIntegratorStep)(c, fmi2True, &event, &stop);
}

static int set_states(Instance c, const double *x, size_t n)
{
    return CALL(fmi2SetContinuousStates)(c, x, n);
}

static int get_states(Instance c, double *x, size_t n)
{
    return CALL(fmi2GetContinuousStates)(c, x, n);
}

static int get_rates(Instance c, double *rate, size_t n)
{
    return CALL(fmi2GetDerivatives)(c, rate, n);
}

static int nominals(Instance c, double *x, size_t n)
{
    return CALL(fmi2GetNominalsOfContinuousStates)(c, x, n);
}

static int indicators(Instance c, double *z, size_t n)
{
    return CALL(fmi2GetEventIndicators)(c, z, n);
}
