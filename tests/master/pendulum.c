/* A Model Exchange FMU of somebody who is strict and says little: a pendulum on a motor.
 *
 * phi' = omega, omega' = -(g / l) sin phi - d omega + M / (m l^2), with m = 2, l = 0.5, d = 0.3.
 * No directional derivatives, no dependencies. States are set through fmi2SetContinuousStates
 * only, inputs not before initialisation, the motor's gear (a discrete input) at events only.
 * It wants three event iterations; with `rest` = 1 they never end, with 2 it ends the simulation.
 */
#include <math.h>
#include <stdlib.h>

enum { PHI, OMEGA, DPHI, DOMEGA, X, TORQUE, GEAR, PHI0, REALS };
enum { INSTANTIATED, INITIALISING, EVENT, CONTINUOUS };
enum { OK = 0, ERROR = 3 };

typedef struct {
    double r[REALS];
    int rest, mode, iterations;
} Pendulum;

typedef struct {
    int needed, terminate, nominals, values, defined;
    double next;
} EventInfo;

typedef unsigned int Reference;

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *functions, int visible, int logging)
{
    (void)name, (void)guid, (void)resources, (void)functions, (void)visible, (void)logging;
    Pendulum *p = type == 0 ? calloc(1, sizeof *p) : NULL; /* 0: Model Exchange */
    if (p) p->r[GEAR] = 1;
    return p;
}

void fmi2FreeInstance(void *c) { free(c); }

int fmi2SetReal(void *c, const Reference vr[], size_t n, const double v[])
{
    Pendulum *p = c;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] < TORQUE || (vr[i] == GEAR && p->mode == CONTINUOUS)) return ERROR;
        if (vr[i] == PHI0 && p->mode > INITIALISING) return ERROR;
        p->r[vr[i]] = v[i];
    }
    return OK;
}

static void evaluate(Pendulum *p)
{
    if (p->mode <= INITIALISING) p->r[PHI] = p->r[PHI0];
    p->r[DPHI] = p->r[OMEGA];
    p->r[DOMEGA] = -9.81 / 0.5 * sin(p->r[PHI]) - 0.3 * p->r[OMEGA]
                   + p->r[GEAR] * p->r[TORQUE] / (2.0 * 0.25);
    p->r[X] = 0.5 * sin(p->r[PHI]);
}

int fmi2GetReal(void *c, const Reference vr[], size_t n, double v[])
{
    Pendulum *p = c;
    if (p->mode == INSTANTIATED) return ERROR;
    evaluate(p);
    for (size_t i = 0; i < n; i++) v[i] = p->r[vr[i]];
    return OK;
}

int fmi2SetInteger(void *c, const Reference vr[], size_t n, const int v[])
{
    (void)vr;
    if (n) ((Pendulum *)c)->rest = v[0];
    return OK;
}

int fmi2EnterInitializationMode(void *c)
{
    ((Pendulum *)c)->mode = INITIALISING;
    return OK;
}

int fmi2ExitInitializationMode(void *c)
{
    evaluate(c);
    ((Pendulum *)c)->mode = EVENT;
    return OK;
}

int fmi2NewDiscreteStates(void *c, EventInfo *info)
{
    Pendulum *p = c;
    if (p->mode != EVENT) return ERROR;
    info->needed = p->rest == 1 || ++p->iterations < 3;
    info->terminate = p->rest == 2;
    info->nominals = info->values = info->defined = 0;
    return OK;
}

int fmi2EnterContinuousTimeMode(void *c)
{
    Pendulum *p = c;
    if (p->mode != EVENT || p->iterations < 3) return ERROR;
    p->mode = CONTINUOUS;
    return OK;
}

int fmi2SetContinuousStates(void *c, const double x[], size_t n)
{
    Pendulum *p = c;
    if (p->mode != CONTINUOUS || n != 2) return ERROR;
    p->r[PHI] = x[0], p->r[OMEGA] = x[1];
    return OK;
}

int fmi2GetContinuousStates(void *c, double x[], size_t n)
{
    const Pendulum *p = c;
    if (n != 2) return ERROR;
    x[0] = p->r[PHI], x[1] = p->r[OMEGA];
    return OK;
}

int fmi2GetNominalsOfContinuousStates(void *c, double x[], size_t n)
{
    (void)c;
    for (size_t i = 0; i < n; i++) x[i] = i ? 0.5 : 0.1;
    return OK;
}

int fmi2GetDirectionalDerivative(void *c, const Reference u[], size_t nu, const Reference k[],
                                 size_t nk, const double dk[], double du[])
{
    (void)c, (void)u, (void)nu, (void)k, (void)nk, (void)dk, (void)du;
    return ERROR;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }

/* What FMPy looks for when it loads. */
#define UNUSED(function) \
    int function(void) { return OK; }
UNUSED(fmi2SetupExperiment)
UNUSED(fmi2SetDebugLogging)
UNUSED(fmi2Terminate)
UNUSED(fmi2Reset)
UNUSED(fmi2GetInteger)
UNUSED(fmi2GetBoolean)
UNUSED(fmi2SetBoolean)
UNUSED(fmi2GetString)
UNUSED(fmi2SetString)
UNUSED(fmi2GetFMUstate)
UNUSED(fmi2SetFMUstate)
UNUSED(fmi2FreeFMUstate)
UNUSED(fmi2SerializedFMUstateSize)
UNUSED(fmi2SerializeFMUstate)
UNUSED(fmi2DeSerializeFMUstate)
UNUSED(fmi2EnterEventMode)
UNUSED(fmi2CompletedIntegratorStep)
UNUSED(fmi2SetTime)
UNUSED(fmi2GetDerivatives)
UNUSED(fmi2GetEventIndicators)
