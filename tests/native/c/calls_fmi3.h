/* FMI 3.0 for driver.c. */
#include "driver.h"
#include "fmi3Functions.h"

typedef fmi3Instance Instance;
typedef fmi3FMUState State;
typedef fmi3Boolean Boolean;
typedef fmi3Int32 Integer;

static void log_fmi3(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category,
                     fmi3String message)
{
    (void)environment;
    tell(status, category, message);
}

static Instance create(int exchange, const char *token, const char *resources, int logging)
{
    if (exchange)
        return CALL(fmi3InstantiateModelExchange)("driver", token, resources, fmi3False,
                                                  logging != 0, NULL, log_fmi3);
    return CALL(fmi3InstantiateCoSimulation)("driver", token, resources, fmi3False, logging != 0,
                                             fmi3False, fmi3False, NULL, 0, NULL, log_fmi3, NULL);
}

static void destroy(Instance c) { CALL(fmi3FreeInstance)(c); }

static int enter(Instance c, double start, int stop_defined, double stop)
{
    return CALL(fmi3EnterInitializationMode)(c, fmi3False, 0, start, stop_defined != 0, stop);
}

static int leave(Instance c) { return CALL(fmi3ExitInitializationMode)(c); }
static int terminate(Instance c) { return CALL(fmi3Terminate)(c); }
static int reset(Instance c) { return CALL(fmi3Reset)(c); }

static int debug(Instance c, int on, size_t n, const char *const *categories)
{
    return CALL(fmi3SetDebugLogging)(c, on != 0, n, categories);
}

static int set_reals(Instance c, const Ref *refs, size_t n, const double *values, size_t m)
{
    return CALL(fmi3SetFloat64)(c, refs, n, values, m);
}

static int get_reals(Instance c, const Ref *refs, size_t n, double *values, size_t m)
{
    return CALL(fmi3GetFloat64)(c, refs, n, values, m);
}

static int set_integers(Instance c, const Ref *refs, size_t n, const Integer *values)
{
    return CALL(fmi3SetInt32)(c, refs, n, values, n);
}

static int get_integers(Instance c, const Ref *refs, size_t n, Integer *values)
{
    return CALL(fmi3GetInt32)(c, refs, n, values, n);
}

static int set_booleans(Instance c, const Ref *refs, size_t n, const Boolean *values)
{
    return CALL(fmi3SetBoolean)(c, refs, n, values, n);
}

static int get_booleans(Instance c, const Ref *refs, size_t n, Boolean *values)
{
    return CALL(fmi3GetBoolean)(c, refs, n, values, n);
}

static int get_strings(Instance c, const Ref *refs, size_t n, const char **values)
{
    return CALL(fmi3GetString)(c, refs, n, values, n);
}

static int set_strings(Instance c, const Ref *refs, size_t n, const char *const *values)
{
    return CALL(fmi3SetString)(c, refs, n, values, n);
}

static int step(Instance c, double t, double h)
{
    fmi3Boolean event, stop, early;
    fmi3Float64 last;
    return CALL(fmi3DoStep)(c, t, h, fmi3True, &event, &stop, &early, &last);
}

static int output_derivatives(Instance c, const Ref *refs, size_t n, const Integer *orders,
                              double *values)
{
    return CALL(fmi3GetOutputDerivatives)(c, refs, n, orders, values, n);
}

static int save(Instance c, State *state) { return CALL(fmi3GetFMUState)(c, state); }
static int restore(Instance c, State state) { return CALL(fmi3SetFMUState)(c, state); }
static int free_state(Instance c, State *state) { return CALL(fmi3FreeFMUState)(c, state); }

static int state_size(Instance c, State state, size_t *size)
{
    return CALL(fmi3SerializedFMUStateSize)(c, state, size);
}

static int serialize(Instance c, State state, unsigned char *bytes, size_t size)
{
    return CALL(fmi3SerializeFMUState)(c, state, bytes, size);
}

static int deserialize(Instance c, const unsigned char *bytes, size_t size, State *state)
{
    return CALL(fmi3DeserializeFMUState)(c, bytes, size, state);
}

static int directional(Instance c, const Ref *unknowns, size_t n, const Ref *knowns, size_t m,
                       const double *seed, size_t n_seed, double *result, size_t n_result)
{
    return CALL(fmi3GetDirectionalDerivative)(c, unknowns, n, knowns, m, seed, n_seed, result,
                                              n_result);
}

static int set_time(Instance c, double t) { return CALL(fmi3SetTime)(c, t); }
static int event_mode(Instance c) { return CALL(fmi3EnterEventMode)(c); }
static int continuous_mode(Instance c) { return CALL(fmi3EnterContinuousTimeMode)(c); }

static int discrete(Instance c)
{
    fmi3Boolean update, stop, nominal, values, defined;
    fmi3Float64 next;
    return CALL(fmi3UpdateDiscreteStates)(c, &update, &stop, &nominal, &values, &defined, &next);
}

static int completed(Instance c)
{
    fmi3Boolean event, stop;
    return CALL(fmi3CompletedIntegratorStep)(c, fmi3True, &event, &stop);
}

static int set_states(Instance c, const double *x, size_t n)
{
    return CALL(fmi3SetContinuousStates)(c, x, n);
}

static int get_states(Instance c, double *x, size_t n)
{
    return CALL(fmi3GetContinuousStates)(c, x, n);
}

static int get_rates(Instance c, double *rate, size_t n)
{
    return CALL(fmi3GetContinuousStateDerivatives)(c, rate, n);
}

static int nominals(Instance c, double *x, size_t n)
{
    return CALL(fmi3GetNominalsOfContinuousStates)(c, x, n);
}

static int indicators(Instance c, double *z, size_t n)
{
    return CALL(fmi3GetEventIndicators)(c, z, n);
}
