/* The front for FMI 2.0, Co-Simulation and Model Exchange: nothing but translation. */
#include "fmi2_component.h"
#include "resource_path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void log_to_host(void *context, Status status, const char *text)
{
    const Component *c = context;
    if (c->callbacks.logger != NULL)
        c->callbacks.logger(c->callbacks.componentEnvironment, c->name != NULL ? c->name : "",
                            (fmi2Status)status,
                            status == WARNING ? "logStatusWarning" : "logStatusError", "%s", text);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String categories[])
{
    BEGIN(ANY);
    (void)i;
    (void)n;
    (void)categories;
    (void)on;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid,
                              fmi2String location, const fmi2CallbackFunctions *functions,
                              fmi2Boolean visible, fmi2Boolean logging)
{
    (void)visible;
    (void)logging; /* errors are told in any case, and there is nothing else to tell */
    Component *c = calloc(1, sizeof *c);
    if (c == NULL) {
        if (functions != NULL && functions->logger != NULL)
            functions->logger(functions->componentEnvironment, name, fmi2Error, "logStatusError",
                              "not enough memory");
        return NULL;
    }
    if (functions != NULL)
        c->callbacks = *functions;
    if (name != NULL && (c->name = malloc(strlen(name) + 1)) != NULL)
        strcpy(c->name, name);
    char *path = resource_path_from_uri(location);
    if (path == NULL)
        log_to_host(c, ERROR, "the resource location is missing or no file: URI, or memory is");
    else
        c->instance = instance_new(path, guid, type == fmi2ModelExchange, log_to_host, c);
    free(path);
    if (c->instance != NULL)
        return c;
    free(c->name);
    free(c);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c)
{
    if (c == NULL)
        return;
    instance_free(instance_of(c));
    free(((Component *)c)->name);
    free(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    BEGIN(STARTED);
    (void)has_tolerance;
    (void)tolerance;
    return (fmi2Status)instance_set_span(i, start, has_stop ? stop : INFINITY);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    BEGIN(STARTED);
    instance_enter(i, INITIALISING);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    BEGIN(INITIALISING);
    return (fmi2Status)instance_exit_initialisation(i);
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    BEGIN(RUNNING);
    instance_enter(i, TERMINATED);
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c)
{
    BEGIN(ANY);
    return (fmi2Status)instance_reset(i);
}

/* --- values ------------------------------------------------------------------------------------ */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference refs[], size_t n, fmi2Real values[])
{
    BEGIN(ANY);
    DEMAND(n == 0 || (refs != NULL && values != NULL), "no references or values given");
    return (fmi2Status)instance_get(i, refs, n, REAL, values);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                       const fmi2Real values[])
{
    BEGIN(ANY & ~TERMINATED);
    DEMAND(n == 0 || (refs != NULL && values != NULL), "no references or values given");
    return (fmi2Status)instance_set(i, refs, n, REAL, values);
}

/* There are one Integer and one Boolean variable, so one at a time will do. */
#define WHOLE(name, type)                                                                    \
    fmi2Status fmi2Get##name(fmi2Component c, const fmi2ValueReference refs[], size_t n,     \
                             fmi2##name values[])                                            \
    {                                                                                        \
        BEGIN(ANY);                                                                          \
        DEMAND(n == 0 || (refs != NULL && values != NULL), "no references or values given"); \
        for (size_t k = 0; k < n; k++) {                                                     \
            double value;                                                                    \
            if (instance_get(i, &refs[k], 1, type, &value) != OK)                            \
                return fmi2Error;                                                            \
            values[k] = (fmi2##name)value;                                                   \
        }                                                                                    \
        return fmi2OK;                                                                       \
    }                                                                                        \
    fmi2Status fmi2Set##name(fmi2Component c, const fmi2ValueReference refs[], size_t n,     \
                             const fmi2##name values[])                                      \
    {                                                                                        \
        BEGIN(ANY & ~TERMINATED);                                                            \
        DEMAND(n == 0 || (refs != NULL && values != NULL), "no references or values given"); \
        for (size_t k = 0; k < n; k++) {                                                     \
            const double value = type == BOOLEAN ? values[k] != 0 : values[k];               \
            if (instance_set(i, &refs[k], 1, type, &value) != OK)                            \
                return fmi2Error;                                                            \
        }                                                                                    \
        return fmi2OK;                                                                       \
    }

WHOLE(Integer, INTEGER)
WHOLE(Boolean, BOOLEAN)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                         fmi2String values[])
{
    BEGIN(ANY);
    (void)refs;
    (void)values;
    DEMAND(n == 0, "there are no String variables");
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference refs[], size_t n,
                         const fmi2String values[])
{
    BEGIN(ANY);
    (void)refs;
    (void)values;
    DEMAND(n == 0, "there are no String variables");
    return fmi2OK;
}

/* --- state ------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    BEGIN(ANY);
    DEMAND(state != NULL, "no place for the state given");
    Snapshot *snapshot = snapshot_take(i, *state);
    if (snapshot == NULL)
        return fmi2Error;
    *state = snapshot;
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    BEGIN(ANY);
    return (fmi2Status)snapshot_restore(i, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    BEGIN(ANY);
    (void)i;
    if (state != NULL) {
        snapshot_free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    BEGIN(ANY);
    DEMAND(state != NULL && size != NULL, "no state or no place for its size given");
    *size = snapshot_size(state);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    BEGIN(ANY);
    DEMAND(bytes != NULL, "no place for the bytes given");
    return (fmi2Status)snapshot_write(i, state, (unsigned char *)bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    BEGIN(ANY);
    DEMAND(state != NULL, "no place for the state given");
    Snapshot *snapshot = snapshot_read(i, (const unsigned char *)bytes, size);
    if (snapshot == NULL)
        return fmi2Error;
    *state = snapshot;
    return fmi2OK;
}
