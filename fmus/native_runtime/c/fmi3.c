/* The front for FMI 3.0, Co-Simulation and Model Exchange: nothing but translation. States and
   their derivatives are arrays here; a reference of an array stands for those of its elements. */
#include "fmi3_component.h"
#include "resource_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void log_to_host(void *context, Status status, const char *text)
{
    const Component *c = context;
    if (c->log != NULL) /* errors are told even when logging is off */
        c->log(c->environment, (fmi3Status)status,
               status == WARNING ? "logStatusWarning" : "logStatusError", text);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n,
                               const fmi3String categories[])
{
    BEGIN(ANY);
    (void)i;
    (void)on;
    (void)n;
    (void)categories;
    return fmi3OK;
}

static fmi3Instance instantiate(fmi3String token, fmi3String folder, int model_exchange,
                                fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    Component *c = calloc(1, sizeof *c);
    if (c == NULL) {
        if (log != NULL)
            log(environment, fmi3Error, "logStatusError", "not enough memory");
        return NULL;
    }
    c->environment = environment;
    c->log = log;
    char *path = resource_path(folder);
    if (path == NULL)
        log_to_host(c, ERROR, "the path of the resources is missing, or memory is");
    else
        c->instance = instance_new(path, token, model_exchange, log_to_host, c);
    free(path);
    if (c->instance != NULL) {
        /* OMSimulator takes references for numbers from 1 on in the order of the XML. */
        c->instance->first = 1;
        return c;
    }
    free(c);
    return NULL;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String folder,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log)
{
    (void)name;
    (void)visible;
    (void)logging;
    return instantiate(token, folder, 1, environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String folder,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[],
                                         size_t n_intermediate,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    (void)name;
    (void)visible;
    (void)logging;
    (void)early_return;
    (void)intermediate;
    (void)n_intermediate;
    (void)update;
    if (events) {
        if (log != NULL)
            log(environment, fmi3Error, "logStatusError", "there is no event mode");
        return NULL;
    }
    return instantiate(token, folder, 0, environment, log);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token,
                                               fmi3String folder, fmi3Boolean visible,
                                               fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback log,
                                               fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock)
{
    (void)name;
    (void)token;
    (void)folder;
    (void)visible;
    (void)logging;
    (void)clock;
    (void)lock;
    (void)unlock;
    if (log != NULL)
        log(environment, fmi3Error, "logStatusError", "there is no scheduled execution");
    return NULL;
}

void fmi3FreeInstance(fmi3Instance c)
{
    if (c == NULL)
        return;
    instance_free(instance_of(c));
    free(c);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    BEGIN(STARTED);
    (void)has_tolerance;
    (void)tolerance;
    const Status status = instance_set_span(i, start, has_stop ? stop : INFINITY);
    if (status == OK)
        instance_enter(i, INITIALISING);
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    BEGIN(INITIALISING);
    return (fmi3Status)instance_exit_initialisation(i);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c)
{
    BEGIN(EVENT | CONTINUOUS);
    instance_enter(i, EVENT);
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c)
{
    BEGIN(RUNNING);
    instance_enter(i, TERMINATED);
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c)
{
    BEGIN(ANY);
    return (fmi3Status)instance_reset(i);
}

/* --- values ------------------------------------------------------------------------------------ */

/* Elements a reference stands for, and the first one's own; 1 for a scalar, 0 for no array. */
static size_t elements(const Instance *i, fmi3ValueReference ref, uint32_t *first)
{
    const size_t modes = i->model.modes, rigid = i->model.rigid;
    const uint32_t begin = ref >= FIRST_DERIVATIVE ? FIRST_DERIVATIVE : FIRST_STATE;
    *first = ref;
    if (ref < FIRST_STATE)
        return 1;
    if (ref - begin > 3)
        return 0;
    const size_t starts[] = {0, modes, 2 * modes, 2 * modes + rigid};
    *first = begin + (uint32_t)starts[ref - begin];
    return ref - begin < 2 ? modes : rigid;
}

/* References of all elements, to be freed; NULL, with a sentence, if they are not `n_values`. */
static uint32_t *expanded(Instance *i, const fmi3ValueReference refs[], size_t n, size_t n_values)
{
    size_t count = 0;
    uint32_t first;
    for (size_t k = 0; k < n; k++) {
        const size_t size = elements(i, refs[k], &first);
        if (size == 0) {
            instance_fail(i, "there is no variable with reference %lu", (unsigned long)refs[k]);
            return NULL;
        }
        count += size;
    }
    uint32_t *all = count == n_values ? malloc((count + 1) * sizeof *all) : NULL;
    if (count != n_values)
        instance_fail(i, "%lu values for variables with %lu elements", (unsigned long)n_values,
                      (unsigned long)count);
    else if (all == NULL)
        instance_fail(i, "not enough memory");
    for (size_t k = 0, at = 0; all != NULL && k < n; k++) {
        const size_t size = elements(i, refs[k], &first);
        for (size_t e = 0; e < size; e++)
            all[at++] = first + (uint32_t)e;
    }
    return all;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference refs[], size_t n,
                          fmi3Float64 values[], size_t n_values)
{
    BEGIN(ANY);
    DEMAND(n == 0 || (refs != NULL && values != NULL), "no references or values given");
    uint32_t *all = expanded(i, refs, n, n_values);
    const Status status = all == NULL ? ERROR : instance_get(i, all, n_values, REAL, values);
    free(all);
    return (fmi3Status)status;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference refs[], size_t n,
                          const fmi3Float64 values[], size_t n_values)
{
    BEGIN(ANY & ~TERMINATED);
    DEMAND(n == n_values && (n == 0 || (refs != NULL && values != NULL)),
           "there must be as many values as references: what can be set is scalar");
    return (fmi3Status)instance_set(i, refs, n, REAL, values);
}

/* There are one Int32 and one Boolean variable, so one at a time will do. */
#define WHOLE(name, number, type)                                                             \
    fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference refs[], size_t n,       \
                             number values[], size_t n_values)                                \
    {                                                                                         \
        BEGIN(ANY);                                                                           \
        DEMAND(n == n_values && (n == 0 || (refs != NULL && values != NULL)),                 \
               "there must be as many values as references");                                 \
        for (size_t k = 0; k < n; k++) {                                                      \
            double value;                                                                     \
            if (instance_get(i, &refs[k], 1, type, &value) != OK)                             \
                return fmi3Error;                                                             \
            values[k] = (number)value;                                                        \
        }                                                                                     \
        return fmi3OK;                                                                        \
    }                                                                                         \
    fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference refs[], size_t n,       \
                             const number values[], size_t n_values)                          \
    {                                                                                         \
        BEGIN(ANY & ~TERMINATED);                                                             \
        DEMAND(n == n_values && (n == 0 || (refs != NULL && values != NULL)),                 \
               "there must be as many values as references");                                 \
        for (size_t k = 0; k < n; k++) {                                                      \
            const double value = values[k];                                                   \
            if (instance_set(i, &refs[k], 1, type, &value) != OK)                             \
                return fmi3Error;                                                             \
        }                                                                                     \
        return fmi3OK;                                                                        \
    }

WHOLE(Int32, fmi3Int32, INTEGER)
WHOLE(Boolean, fmi3Boolean, BOOLEAN)

/* Types of which there are no variables. */
#define NONE(name, number)                                                                    \
    fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference refs[], size_t n,       \
                             number values[], size_t n_values)                                \
    {                                                                                         \
        BEGIN(ANY);                                                                           \
        (void)refs;                                                                           \
        (void)values;                                                                         \
        DEMAND(n == 0 && n_values == 0, "there are no variables of this type");               \
        return fmi3OK;                                                                        \
    }                                                                                         \
    fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference refs[], size_t n,       \
                             const number values[], size_t n_values)                          \
    {                                                                                         \
        BEGIN(ANY);                                                                           \
        (void)refs;                                                                           \
        (void)values;                                                                         \
        DEMAND(n == 0 && n_values == 0, "there are no variables of this type");               \
        return fmi3OK;                                                                        \
    }

NONE(Float32, fmi3Float32)
NONE(Int8, fmi3Int8)
NONE(UInt8, fmi3UInt8)
NONE(Int16, fmi3Int16)
NONE(UInt16, fmi3UInt16)
NONE(UInt32, fmi3UInt32)
NONE(Int64, fmi3Int64)
NONE(UInt64, fmi3UInt64)
NONE(String, fmi3String)

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[],
                                        size_t n_unknowns, const fmi3ValueReference knowns[],
                                        size_t n_knowns, const fmi3Float64 seed[], size_t n_seed,
                                        fmi3Float64 sensitivity[], size_t n_sensitivity)
{
    BEGIN(ANY & ~STARTED);
    DEMAND((n_unknowns == 0 || (unknowns != NULL && sensitivity != NULL)) &&
           (n_knowns == 0 || (knowns != NULL && seed != NULL)), "references or values are missing");
    uint32_t *rows = expanded(i, unknowns, n_unknowns, n_sensitivity);
    uint32_t *columns = expanded(i, knowns, n_knowns, n_seed);
    Status status = ERROR;
    if (rows != NULL && columns != NULL)
        status = instance_directional(i, rows, n_sensitivity, columns, n_seed, seed, sensitivity);
    free(rows);
    free(columns);
    return (fmi3Status)status;
}

/* --- state ------------------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    BEGIN(ANY);
    DEMAND(state != NULL, "no place for the state given");
    Snapshot *snapshot = snapshot_take(i, *state);
    if (snapshot == NULL)
        return fmi3Error;
    *state = snapshot;
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    BEGIN(ANY);
    return (fmi3Status)snapshot_restore(i, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    BEGIN(ANY);
    (void)i;
    if (state != NULL) {
        snapshot_free(*state);
        *state = NULL;
    }
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    BEGIN(ANY);
    DEMAND(state != NULL && size != NULL, "no state or no place for its size given");
    *size = snapshot_size(state);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    BEGIN(ANY);
    DEMAND(bytes != NULL, "no place for the bytes given");
    return (fmi3Status)snapshot_write(i, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    BEGIN(ANY);
    DEMAND(state != NULL, "no place for the state given");
    Snapshot *snapshot = snapshot_read(i, bytes, size);
    if (snapshot == NULL)
        return fmi3Error;
    *state = snapshot;
    return fmi3OK;
}
