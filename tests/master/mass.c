/* A mass of 1 kg on a spring and a damper, for Model Exchange and Co-Simulation; its GUID says which.
 *
 * alone: u1 is a force; y1, y2 are place and speed.
 * owner: u1, u2 are place and speed of a neighbour on the spring kc and damper cc that it owns; y1 is the force on
 * that neighbour, y2 its own place.
 * Steps are 40 of Runge and Kutta's, exact to 1e-9 where they are short; inputs are held over them. With EULER they
 * are one of Euler's rule, or PARTS_OF_EULER.
 */
#include <stdlib.h>
#include <string.h>

enum { U1, U2, Y1, Y2, X, V, DX, DV, K, C, KC, CC, REALS };

typedef struct {
    int owner;
    double r[REALS];
} Mass;

typedef unsigned int Reference;

typedef struct {
    int needed, terminate, nominals, values, defined;
    double next;
} EventInfo;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *functions, int visible, int logging)
{
    (void)name, (void)type, (void)resources, (void)functions, (void)visible, (void)logging;
    Mass *m = calloc(1, sizeof *m);
    if (m) m->owner = !strcmp(guid, "owner"), m->r[K] = 20, m->r[C] = 0.3, m->r[KC] = 50, m->r[CC] = 0.5;
    return m;
}

void fmi2FreeInstance(void *c) { free(c); }

static void evaluate(Mass *m)
{
    double *r = m->r;
    const double away = r[X] - r[U1], apart = r[V] - r[U2], force = r[KC] * away + r[CC] * apart;
    r[DX] = r[V];
    r[DV] = -r[K] * r[X] - r[C] * r[V] + (m->owner ? -force : r[U1]);
    r[Y1] = m->owner ? force : r[X];
    r[Y2] = m->owner ? r[X] : r[V];
}

int fmi2SetReal(void *c, const Reference vr[], size_t n, const double v[])
{
    for (size_t i = 0; i < n; i++) ((Mass *)c)->r[vr[i]] = v[i];
    return 0;
}

int fmi2GetReal(void *c, const Reference vr[], size_t n, double v[])
{
    evaluate(c);
    for (size_t i = 0; i < n; i++) v[i] = ((Mass *)c)->r[vr[i]];
    return 0;
}

int fmi2DoStep(void *c, double t, double h, int final)
{
#ifdef EULER
#ifndef PARTS_OF_EULER
#define PARTS_OF_EULER 1
#endif
    enum { PARTS = PARTS_OF_EULER };
    static const double at[] = {0, 0, 0, 0}, weight[] = {6, 0, 0, 0};
#else
    enum { PARTS = 40 };
    static const double at[] = {0, 0.5, 0.5, 1}, weight[] = {1, 2, 2, 1};
#endif
    Mass *m = c;
    (void)t, (void)final;
    h /= PARTS;
    for (int part = 0; part < PARTS; part++) {
        const double x = m->r[X], v = m->r[V];
        double dx = 0, dv = 0, sum_x = 0, sum_v = 0;
        for (int k = 0; k < 4; k++) {
            m->r[X] = x + at[k] * h * dx, m->r[V] = v + at[k] * h * dv;
            evaluate(m);
            dx = m->r[DX], dv = m->r[DV];
            sum_x += weight[k] * dx, sum_v += weight[k] * dv;
        }
        m->r[X] = x + h / 6 * sum_x, m->r[V] = v + h / 6 * sum_v;
    }
    return 0;
}

int fmi2SetContinuousStates(void *c, const double x[], size_t n)
{
    (void)n;
    ((Mass *)c)->r[X] = x[0], ((Mass *)c)->r[V] = x[1];
    return 0;
}

int fmi2GetContinuousStates(void *c, double x[], size_t n)
{
    (void)n;
    x[0] = ((Mass *)c)->r[X], x[1] = ((Mass *)c)->r[V];
    return 0;
}

int fmi2GetNominalsOfContinuousStates(void *c, double x[], size_t n)
{
    (void)c;
    for (size_t k = 0; k < n; k++) x[k] = 1;
    return 0;
}

int fmi2NewDiscreteStates(void *c, EventInfo *info)
{
    (void)c;
    memset(info, 0, sizeof *info);
    return 0;
}

int fmi2GetFMUstate(void *c, void **state)
{
    if (!*state) *state = malloc(sizeof(Mass));
    memcpy(*state, c, sizeof(Mass));
    return 0;
}

int fmi2SetFMUstate(void *c, void *state)
{
    memcpy(c, state, sizeof(Mass));
    return 0;
}

int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return 0;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

/* What has nothing to do. */
int fmi2SetupExperiment(void *c, int has, double x, double start, int ends, double stop)
{
    (void)c, (void)has, (void)x, (void)start, (void)ends, (void)stop;
    return 0;
}
int fmi2EnterInitializationMode(void *c) { return (void)c, 0; }
int fmi2ExitInitializationMode(void *c) { return (void)c, 0; }
int fmi2EnterContinuousTimeMode(void *c) { return (void)c, 0; }
int fmi2Terminate(void *c) { return (void)c, 0; }
int fmi2Reset(void *c) { return (void)c, 0; }
