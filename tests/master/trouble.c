/* An FMU that makes the trouble it is compiled for: x' = -x + u + s, s' = u, by Euler; y = x + u/4.
 *
 * Trouble in a step comes in the one from t = 0.5 s on. The state is x, s and u.
 */
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum {
    NONE, EXITS, ABORTS, SEGFAULTS, HANGS, FAILS, FORGETS, FORGETS_FAR, FORGETS_WRITTEN, CRASHES_BACK, LINGERS
};

typedef struct { double u, x, s; } Plant;
typedef unsigned int Reference;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *functions, int visible, int logging)
{
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible;
    (void)logging;
    Plant *p = calloc(1, sizeof *p);
    if (p) p->x = 1;
    return p;
}

void fmi2FreeInstance(void *c)
{
    while (TROUBLE == LINGERS) pause();
    free(c);
}

int fmi2SetReal(void *c, const Reference vr[], size_t n, const double v[])
{
    for (size_t i = 0; i < n; i++) ((double *)c)[vr[i]] = v[i];
    return 0;
}

int fmi2GetReal(void *c, const Reference vr[], size_t n, double v[])
{
    const Plant *p = c;
    for (size_t i = 0; i < n; i++) v[i] = vr[i] == 3 ? p->x + p->u / 4 : ((double *)c)[vr[i]];
    return 0;
}

int fmi2DoStep(void *c, double t, double h, int no_return)
{
    (void)no_return;
    Plant *p = c;
    if (t >= 0.5) {
        fprintf(stderr, "last words\n");
        if (TROUBLE == EXITS) exit(3);
        if (TROUBLE == ABORTS) abort();
        if (TROUBLE == SEGFAULTS) raise(SIGSEGV);
        while (TROUBLE == HANGS) { }
        if (TROUBLE == FAILS) return 3;
    }
    p->x += h * (p->u + p->s - p->x);
    p->s += h * p->u;
    return 0;
}

int fmi2GetFMUstate(void *c, void **state)
{
    if (!*state) *state = malloc(sizeof(Plant));
    if (!*state) return 3;
    memcpy(*state, c, sizeof(Plant));
    return 0;
}

int fmi2SetFMUstate(void *c, void *state)
{
    if (TROUBLE == CRASHES_BACK) abort();
    const double s = ((Plant *)c)->s;
    memcpy(c, state, sizeof(Plant));
    if (TROUBLE == FORGETS || (TROUBLE == FORGETS_FAR && s >= 1)) ((Plant *)c)->s = s;
    return 0;
}

int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return 0;
}

int fmi2SerializedFMUstateSize(void *c, void *state, size_t *n)
{
    (void)c, (void)state;
    *n = sizeof(Plant);
    return 0;
}

int fmi2SerializeFMUstate(void *c, void *state, char b[], size_t n)
{
    (void)c;
    memcpy(b, state, n);
    return 0;
}

int fmi2DeSerializeFMUstate(void *c, const char b[], size_t n, void **state)
{
    (void)c;
    if (n != sizeof(Plant) || !(*state = malloc(n))) return 3;
    memcpy(*state, b, n);
    if (TROUBLE == FORGETS_WRITTEN) ((Plant *)*state)->s = 0;
    return 0;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

/* What nobody calls, or what has nothing to do; the arguments do not matter to either. */
#define NOTHING(function) int function(void) { return 0; }
NOTHING(fmi2SetupExperiment)
NOTHING(fmi2SetDebugLogging)
NOTHING(fmi2EnterInitializationMode)
NOTHING(fmi2ExitInitializationMode)
NOTHING(fmi2Terminate)
NOTHING(fmi2Reset)
NOTHING(fmi2CancelStep)
NOTHING(fmi2GetDirectionalDerivative)
NOTHING(fmi2SetRealInputDerivatives)
NOTHING(fmi2GetRealOutputDerivatives)
NOTHING(fmi2GetInteger)
NOTHING(fmi2SetInteger)
NOTHING(fmi2GetBoolean)
NOTHING(fmi2SetBoolean)
NOTHING(fmi2GetString)
NOTHING(fmi2SetString)
NOTHING(fmi2GetStatus)
NOTHING(fmi2GetRealStatus)
NOTHING(fmi2GetIntegerStatus)
NOTHING(fmi2GetBooleanStatus)
NOTHING(fmi2GetStringStatus)
