/* An FMU that does what anybody's FMU may do; its GUID says what: see anybody.py.
 *
 * x' = u exactly, for u held or a polynomial; x(0) = x0; z = k u; twice = 2 n; not_b = !b; chosen = choice; length is that
 * of the text `label`. What a master told it are outputs, too: -1 if it was not told. Value references
 * are counted for each type, as FMI 2 allows. Trouble in a step comes in the one that ends behind 0.45 s.
 */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "fmi2Functions.h"

enum { U, X, Z, K, X0, START, STOP, TOLERANCE, FINAL, LENGTH_OF_STEP, REALS };
enum { N, TWICE, CHOICE, CHOSEN, M, LENGTH, STEPS, TERMINATED, INTEGERS };
enum { B, NOT_B, FLAG, BOOLEANS };

static const char *const MODES[] = {
    "plain",    "needs stop", "needs tolerance", "errs",   "ends",  "discards", "pends",
    "nan",      "crashes",    "exits",           "hangs",  "strict", "fixed step", "warns",
    "changes",  "once",       "crashes late",    "past",   "forgets",
};
enum { PLAIN, NEEDS_STOP, NEEDS_TOLERANCE, ERRS, ENDS, DISCARDS, PENDS, GIVES_NAN, CRASHES, EXITS, HANGS,
       STRICT, FIXED_STEP, WARNS, CHANGES, ONCE, CRASHES_LATE, PAST, FORGETS, ALL };

typedef struct {
    int mode, initialised, set_since_step, pending;
    double r[REALS], slope[3];
    int i[INTEGERS], b[BOOLEANS];
    char label[64];
    char name[64];
    const fmi2CallbackFunctions *host;
} Anybody;

static int instances;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *host, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)type, (void)resources, (void)visible, (void)logging;
    Anybody *a = calloc(1, sizeof *a);
    if (!a) return NULL;
    while (a->mode < ALL && strcmp(guid, MODES[a->mode])) a->mode++;
    if (a->mode == ALL || (a->mode == ONCE && instances)) return free(a), NULL;
    instances++;
    a->host = host;
    a->r[K] = 1, a->r[START] = a->r[STOP] = a->r[TOLERANCE] = a->r[FINAL] = -1;
    a->r[U] = 0.5, a->i[N] = 3, a->i[CHOICE] = 1;
    strncpy(a->name, name, sizeof a->name - 1);
    strcpy(a->label, "none");
    return a;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    Anybody *a = c;
    a->r[START] = start;
    if (has_stop) a->r[STOP] = stop;
    if (has_tolerance) a->r[TOLERANCE] = tolerance;
    if (a->mode == NEEDS_STOP && !has_stop) return fmi2Error;
    return a->mode == NEEDS_TOLERANCE && !has_tolerance ? fmi2Error : fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Anybody *a = c;
    a->r[X] = a->mode == CHANGES ? 10 : a->r[X0];
    a->initialised = 1, a->set_since_step = 0;
    return fmi2OK;
}

static fmi2Status got(const Anybody *a)
{
    return a->mode == STRICT && a->initialised && a->set_since_step ? fmi2Error : fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[])
{
    Anybody *a = c;
    if (!a->initialised) a->r[X] = a->r[X0];
    a->r[Z] = a->r[K] * a->r[U];
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= REALS) return fmi2Error;
        v[j] = a->r[vr[j]];
    }
    return got(a);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer v[])
{
    Anybody *a = c;
    a->i[TWICE] = 2 * a->i[N], a->i[CHOSEN] = a->i[CHOICE], a->i[LENGTH] = (int)strlen(a->label);
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= INTEGERS) return fmi2Error;
        v[j] = a->i[vr[j]];
    }
    return got(a);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean v[])
{
    Anybody *a = c;
    a->b[NOT_B] = !a->b[B];
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= BOOLEANS) return fmi2Error;
        v[j] = a->b[vr[j]];
    }
    return got(a);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real v[])
{
    Anybody *a = c;
    a->set_since_step = 1;
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= REALS) return fmi2Error;
        a->r[vr[j]] = v[j];
    }
    return fmi2OK;
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer v[])
{
    Anybody *a = c;
    a->set_since_step = 1;
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= INTEGERS || (vr[j] == CHOICE && (v[j] < 1 || v[j] > 7))) return fmi2Error;
        a->i[vr[j]] = v[j];
    }
    return fmi2OK;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean v[])
{
    Anybody *a = c;
    a->set_since_step = 1;
    for (size_t j = 0; j < n; j++) {
        if (vr[j] >= BOOLEANS) return fmi2Error;
        a->b[vr[j]] = v[j];
    }
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String v[])
{
    (void)vr;
    for (size_t j = 0; j < n; j++) strncpy(((Anybody *)c)->label, v[j], 63);
    return fmi2OK;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real v[])
{
    for (size_t j = 0; j < n; j++) {
        if (vr[j] != U || order[j] < 1 || order[j] > 2) return fmi2Error;
        ((Anybody *)c)->slope[order[j]] = v[j];
    }
    return fmi2OK;
}

static void take(Anybody *a, double h)
{
    /* One who believes that nobody goes back throws its past away, and else lags behind by it. */
    const double u = a->r[U] + h / 2 * (a->slope[1] + h / 3 * a->slope[2]);
    a->r[X] += h * (a->mode == PAST && !a->r[FINAL] ? 0.5 : 1.0) * u;
    a->slope[1] = a->slope[2] = 0;
    a->i[STEPS]++;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean final)
{
    Anybody *a = c;
    a->set_since_step = 0;
    a->r[FINAL] = final;
    if (a->mode == FIXED_STEP && fabs(h - 0.125) > 1e-12) return fmi2Error;
    if (a->r[STOP] >= 0 && t + h > a->r[STOP]) return fmi2Error;
    a->r[LENGTH_OF_STEP] = h;
    if (a->mode == WARNS) {
        a->host->logger(a->host->componentEnvironment, a->name, fmi2Warning, "w", "step of %g s", h);
        take(a, h);
        return fmi2Warning;
    }
    if (a->mode == PENDS) {
        a->pending = 3, take(a, h);
        return fmi2Pending;
    }
    if (t + h > 0.45) {
        switch (a->mode) {
        case ERRS: return fmi2Error;
        case ENDS: a->i[TERMINATED] = 1; return fmi2Discard;
        case DISCARDS: return fmi2Discard;
        case GIVES_NAN: a->r[X0] = a->r[X] = NAN; return fmi2OK;
        case CRASHES: raise(SIGSEGV); break;
        case EXITS: exit(3);
        case HANGS: while (1) pause();
        }
    }
    take(a, h);
    return fmi2OK;
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    (void)kind;
    *value = ((Anybody *)c)->pending-- > 0 ? fmi2Pending : fmi2OK;
    return fmi2OK;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = ((Anybody *)c)->i[TERMINATED];
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    if (((Anybody *)c)->mode == CRASHES_LATE) raise(SIGSEGV);
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(Anybody));
    if (!*state) return fmi2Error;
    memcpy(*state, c, sizeof(Anybody));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    Anybody *a = c;
    const double x = a->r[X];
    memcpy(c, state, sizeof(Anybody));
    if (a->mode == FORGETS) a->r[X] = x;
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *n)
{
    (void)c, (void)state;
    *n = sizeof(Anybody);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t n)
{
    (void)c;
    memcpy(bytes, state, n);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t n, fmi2FMUstate *state)
{
    const fmi2CallbackFunctions *const host = ((Anybody *)c)->host;
    if (n != sizeof(Anybody) || !(*state = malloc(n))) return fmi2Error;
    memcpy(*state, bytes, n);
    ((Anybody *)*state)->host = host;
    return fmi2OK;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

/* What has nothing to do, or what nobody calls for the description declares it not. */
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return fmi2Error; }
fmi2Status fmi2CancelStep(fmi2Component c) { (void)c; return fmi2Error; }
