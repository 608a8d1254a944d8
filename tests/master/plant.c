/* An FMU small enough to be known in closed form: x' = u, x(0) = x0; z = k u.
 *
 * With the parameter `follow` x starts at the value of u: then x depends on u in initialisation,
 * and not later. n and mode are a parameter and an input of type Integer; count is mode + n.
 * A step that ends behind the stop time, however little, is refused: OpenModelica's FMUs do so.
 */
#include <math.h>
#include <stdlib.h>

enum { U, X, Z, K, X0, W, REALS };
enum { N = 10, COUNT, MODE, FOLLOW };

typedef struct {
    double r[REALS], stop;
    int n, mode, follow, initialised;
} Plant;

typedef unsigned int Reference;

static void update(Plant *p)
{
    if (!p->initialised) p->r[X] = p->follow ? p->r[U] : p->r[X0];
    p->r[Z] = p->r[K] * p->r[U];
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *functions, int visible, int logging)
{
    (void)name, (void)type, (void)guid, (void)resources, (void)functions, (void)visible;
    (void)logging;
    Plant *p = calloc(1, sizeof *p);
    if (p) p->r[K] = 1, p->r[U] = 0.5, p->n = 3, p->stop = INFINITY;
    return p;
}

void fmi2FreeInstance(void *c) { free(c); }

int fmi2SetReal(void *c, const Reference vr[], size_t n, const double v[])
{
    for (size_t i = 0; i < n; i++) ((Plant *)c)->r[vr[i]] = v[i];
    return 0;
}

int fmi2GetReal(void *c, const Reference vr[], size_t n, double v[])
{
    update(c);
    for (size_t i = 0; i < n; i++) v[i] = ((Plant *)c)->r[vr[i]];
    return 0;
}

int fmi2SetInteger(void *c, const Reference vr[], size_t n, const int v[])
{
    for (size_t i = 0; i < n; i++) *(vr[i] == N ? &((Plant *)c)->n : &((Plant *)c)->mode) = v[i];
    return 0;
}

int fmi2GetInteger(void *c, const Reference vr[], size_t n, int v[])
{
    const Plant *p = c;
    for (size_t i = 0; i < n; i++)
        v[i] = vr[i] == N ? p->n : vr[i] == MODE ? p->mode : p->n + p->mode;
    return 0;
}

int fmi2SetBoolean(void *c, const Reference vr[], size_t n, const int v[])
{
    (void)vr;
    for (size_t i = 0; i < n; i++) ((Plant *)c)->follow = v[i];
    return 0;
}

int fmi2ExitInitializationMode(void *c)
{
    update(c);
    ((Plant *)c)->initialised = 1;
    return 0;
}

int fmi2DoStep(void *c, double t, double h, int no_return)
{
    (void)no_return;
    Plant *p = c;
    if (t + h > p->stop) return 3;
    p->r[X] += h * p->r[U];
    return 0;
}

int fmi2SetupExperiment(void *c, int has_tolerance, double tolerance, double start, int has_stop,
                        double stop)
{
    (void)has_tolerance, (void)tolerance, (void)start;
    if (has_stop) ((Plant *)c)->stop = stop;
    return 0;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

/* What FMPy looks for when it loads; the description declares none of it. */
#define UNUSED(function) \
    int function(void) { return 0; }
UNUSED(fmi2SetDebugLogging)
UNUSED(fmi2EnterInitializationMode)
UNUSED(fmi2Terminate)
UNUSED(fmi2Reset)
UNUSED(fmi2GetBoolean)
UNUSED(fmi2GetString)
UNUSED(fmi2SetString)
UNUSED(fmi2GetFMUstate)
UNUSED(fmi2SetFMUstate)
UNUSED(fmi2FreeFMUstate)
UNUSED(fmi2SerializedFMUstateSize)
UNUSED(fmi2SerializeFMUstate)
UNUSED(fmi2DeSerializeFMUstate)
UNUSED(fmi2GetDirectionalDerivative)
UNUSED(fmi2SetRealInputDerivatives)
UNUSED(fmi2GetRealOutputDerivatives)
UNUSED(fmi2CancelStep)
UNUSED(fmi2GetStatus)
UNUSED(fmi2GetRealStatus)
UNUSED(fmi2GetIntegerStatus)
UNUSED(fmi2GetBooleanStatus)
UNUSED(fmi2GetStringStatus)
