/* An FMI 3.0 FMU that does what anybody's may do; its token says what: see anybody3.py.
 *
 * x' = u, exactly for u held, or a parabola where it may ask for it within a step; f_out = 2 f; every whole
 * number comes back plus one; w = gain v, of n elements; s' = v - gain s in Model Exchange. Trouble in a step
 * comes in the one that ends behind 0.45 s. `ticks` counts a clock of 0.2 s, `held` is u when it ticked, `rings`
 * counts a countdown that the third tick sets off, or a level above 6, to end 0.05 s later.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

#define MOST 8
enum { TIME, U, X, F, F_OUT, INTS = 10, B = 30, NOT_B, CHOICE, CHOSEN, LABEL, LENGTH, DATA, SUM, STEPS,
       V = 40, W, N, GAIN, S, DS, OF_STEP, DISCRETE, CLOCK = 50, TICKS, HELD, COUNTDOWN, RINGS, EVENTS, SAID = 60, COPIED };

static const char *const MODES[] = {"plain", "errs", "ends", "ends early", "early", "stuck", "nan", "warns",
                                    "clocks", "between", "event", "stuck in events"};
enum { PLAIN, ERRS, ENDS, ENDS_EARLY, EARLY, STUCK, GIVES_NAN, WARNS, CLOCKS, BETWEEN, EVENT, STUCK_IN_EVENTS, ALL };

typedef struct {
    int mode, configuring, in_events;
    double t, u, x, held, level, v[MOST], gain[MOST], s[MOST];
    float f;
    fmi3Int64 whole[8];
    int ticks, rings, events, steps, ticking, ringing, counting, chosen;
    fmi3Boolean b, of_step;
    fmi3UInt64 n;
    char label[64];
    size_t n_data;
    unsigned char data[64];
} Model;

typedef struct {
    Model m;
    double stop;
    void *environment;
    fmi3LogMessageCallback log;
    fmi3IntermediateUpdateCallback update;
} Anybody;

static fmi3Instance make(fmi3String token, void *environment, fmi3LogMessageCallback log)
{
    Anybody *a = calloc(1, sizeof *a);
    if (!a) return NULL;
    while (a->m.mode < ALL && strcmp(token, MODES[a->m.mode])) a->m.mode++;
    if (a->m.mode == ALL) return free(a), NULL;
    a->environment = environment, a->log = log;
    a->m.u = 0.5, a->m.n = 3, a->m.chosen = 1;
    a->m.f = 0.25f;
    for (int k = 0; k < MOST; k++) a->m.gain[k] = a->m.v[k] = k + 1, a->m.whole[k] = 3;
    return a;
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    (void)name, (void)resources, (void)visible, (void)logging;
    return make(token, environment, log);
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean events,
                                         fmi3Boolean early, const fmi3ValueReference vr[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)early;
    Anybody *a = make(token, environment, log);
    if (a) a->update = update;
    const int has_clocks = a && (a->m.mode == CLOCKS || a->m.mode == EVENT || a->m.mode == STUCK_IN_EVENTS);
    const int wants_u = a && a->m.mode == BETWEEN && !(n == 1 && vr[0] == U);
    if (a && (wants_u || has_clocks != events)) return free(a), NULL;
    return a;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop)
{
    Anybody *a = c;
    (void)has_tolerance, (void)tolerance;
    a->m.t = start, a->stop = has_stop ? stop : INFINITY;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c)
{
    ((Anybody *)c)->m.in_events = 1;
    return fmi3OK;
}

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) { ((Anybody *)c)->m.configuring = 1; return fmi3OK; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) { ((Anybody *)c)->m.configuring = 0; return fmi3OK; }
fmi3Status fmi3EnterEventMode(fmi3Instance c) { ((Anybody *)c)->m.in_events = 1; return fmi3OK; }
fmi3Status fmi3EnterStepMode(fmi3Instance c) { ((Anybody *)c)->m.in_events = 0; return fmi3OK; }
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) { ((Anybody *)c)->m.in_events = 0; return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { (void)c; return fmi3OK; }

/* --- values --- */

static double *numbers(Anybody *a, fmi3ValueReference vr, size_t *n)
{
    Model *m = &a->m;
    *n = vr == V || vr == W || vr == GAIN || vr == S || vr == DS ? m->n : 1;
    static double w[MOST];
    for (size_t k = 0; k < m->n; k++)
        w[k] = vr == W ? m->gain[k] * m->v[k] : m->v[k] - m->gain[k] * m->s[k];
    return vr == U ? &m->u : vr == X ? &m->x : vr == HELD ? &m->held : vr == DISCRETE ? &m->level : vr == V ? m->v : vr == GAIN ? m->gain
         : vr == S ? m->s : vr == W || vr == DS ? w : vr == TIME ? &m->t : NULL;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t n_v)
{
    size_t at = 0, size;
    for (size_t j = 0; j < n; j++, at += size) {
        const double *from = numbers(c, vr[j], &size);
        if (!from || at + size > n_v) return fmi3Error;
        memcpy(v + at, from, size * sizeof *v);
    }
    return at == n_v ? fmi3OK : fmi3Error;
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 v[],
                          size_t n_v)
{
    size_t at = 0, size;
    for (size_t j = 0; j < n; j++, at += size) {
        double *to = numbers(c, vr[j], &size);
        const Model *m = &((Anybody *)c)->m;
        if (!to || at + size > n_v || vr[j] == W || vr[j] == DS) return fmi3Error;
        if (vr[j] == DISCRETE && m->mode == CLOCKS && !m->in_events && m->t > 0) return fmi3Error;
        memcpy(to, v + at, size * sizeof *v);
        if (vr[j] == DISCRETE && v[at] > 6) ((Anybody *)c)->m.counting = 1;
    }
    return at == n_v ? fmi3OK : fmi3Error;
}

fmi3Status fmi3GetFloat32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float32 v[], size_t n_v)
{
    if (n != 1 || n_v != 1 || vr[0] != F_OUT) return fmi3Error;
    v[0] = 2 * ((Anybody *)c)->m.f;
    return fmi3OK;
}

fmi3Status fmi3SetFloat32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float32 v[],
                          size_t n_v)
{
    if (n != 1 || n_v != 1 || vr[0] != F) return fmi3Error;
    ((Anybody *)c)->m.f = v[0];
    return fmi3OK;
}

static fmi3Status get_whole(Anybody *a, fmi3ValueReference vr, fmi3Int64 *v)
{
    Model *m = &a->m;
    if (vr >= INTS && vr < INTS + 16) return *v = m->whole[(vr - INTS) / 2] + 1, fmi3OK;
    switch (vr) {
    case CHOSEN: *v = m->chosen; break;
    case N: *v = (fmi3Int64)m->n; break;
    case LENGTH: *v = (fmi3Int64)strlen(m->label); break;
    case SUM: *v = 0; for (size_t k = 0; k < m->n_data; k++) *v += m->data[k]; break;
    case STEPS: *v = m->steps; break;
    case TICKS: *v = m->ticks; break;
    case RINGS: *v = m->rings; break;
    case EVENTS: *v = m->events; break;
    default: return fmi3Error;
    }
    return fmi3OK;
}

static fmi3Status set_whole(Anybody *a, fmi3ValueReference vr, fmi3Int64 v)
{
    Model *m = &a->m;
    if (m->mode == CLOCKS && !m->in_events && m->t > 0) return fmi3Error; /* discrete: at events only */
    if (vr == N) return !m->configuring || v > MOST ? fmi3Error : (m->n = (fmi3UInt64)v, fmi3OK);
    if (vr == CHOICE) return v < 1 || v > 7 ? fmi3Error : (m->chosen = (int)v, fmi3OK);
    if (vr < INTS || vr >= INTS + 16) return fmi3Error;
    m->whole[(vr - INTS) / 2] = v;
    return fmi3OK;
}

#define WHOLE(name)                                                                                              \
    fmi3Status fmi3Get##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3##name v[], size_t n_v)  \
    {                                                                                                            \
        fmi3Int64 one;                                                                                           \
        for (size_t j = 0; j < n; j++) {                                                                         \
            if (n != n_v || get_whole(c, vr[j], &one) != fmi3OK) return fmi3Error;                                 \
            v[j] = (fmi3##name)one;                                                                              \
        }                                                                                                        \
        return fmi3OK;                                                                                           \
    }                                                                                                            \
    fmi3Status fmi3Set##name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3##name v[],         \
                             size_t n_v)                                                                          \
    {                                                                                                            \
        for (size_t j = 0; j < n; j++)                                                                           \
            if (n != n_v || set_whole(c, vr[j], (fmi3Int64)v[j]) != fmi3OK) return fmi3Error;                      \
        return fmi3OK;                                                                                           \
    }

WHOLE(Int8) WHOLE(UInt8) WHOLE(Int16) WHOLE(UInt16) WHOLE(Int32) WHOLE(UInt32) WHOLE(Int64) WHOLE(UInt64)

fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Boolean v[], size_t n_v)
{
    if (n != 1 || n_v != 1 || vr[0] != NOT_B) return fmi3Error;
    v[0] = !((Anybody *)c)->m.b;
    return fmi3OK;
}

fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Boolean v[],
                          size_t n_v)
{
    if (n != 1 || n_v != 1 || (vr[0] != B && vr[0] != OF_STEP)) return fmi3Error;
    *(vr[0] == B ? &((Anybody *)c)->m.b : &((Anybody *)c)->m.of_step) = v[0];
    return fmi3OK;
}

fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3String v[],
                         size_t n_v)
{
    const Model *m = &((Anybody *)c)->m;
    if (n != 1 || n_v != 1 || vr[0] != LABEL || (m->mode == CLOCKS && !m->in_events && m->t > 0)) return fmi3Error;
    strncpy(((Anybody *)c)->m.label, v[0], 63);
    return fmi3OK;
}

fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[],
                         const fmi3Binary v[], size_t n_v)
{
    Model *m = &((Anybody *)c)->m;
    if (n != 1 || n_v != 1 || vr[0] != DATA || sizes[0] > sizeof m->data) return fmi3Error;
    memcpy(m->data, v[0], m->n_data = sizes[0]);
    return fmi3OK;
}

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String v[], size_t n_v)
{
    if (n != 1 || n_v != 1 || vr[0] != SAID) return fmi3Error;
    v[0] = ((Anybody *)c)->m.label;
    return fmi3OK;
}

fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary v[],
                         size_t n_v)
{
    Model *m = &((Anybody *)c)->m;
    if (n != 1 || n_v != 1 || vr[0] != COPIED) return fmi3Error;
    v[0] = m->data, sizes[0] = m->n_data;
    return fmi3OK;
}

static double slope(Anybody *a, fmi3ValueReference of, size_t i, fmi3ValueReference by, size_t j)
{
    if (of == X && by == U) return a->m.of_step ? 0.25 : 0; /* the length of all steps in the tests */
    if (i != j) return 0;
    return of == W && by == V ? a->m.gain[i] : of == DS && by == V ? 1 : of == DS && by == S ? -a->m.gain[i] : 0;
}

static fmi3Status derive(Anybody *a, const fmi3ValueReference of[], size_t n_of, const fmi3ValueReference by[],
                         size_t n_by, const double seed[], size_t n_seed, double out[], size_t n_out, int adjoint)
{
    for (size_t k = 0; k < n_out; k++) out[k] = 0;
    size_t row = 0, column, rows, columns;
    for (size_t p = 0; p < n_of; p++, row += rows) {
        numbers(a, of[p], &rows);
        column = 0;
        for (size_t q = 0; q < n_by; q++, column += columns) {
            numbers(a, by[q], &columns);
            for (size_t i = 0; i < rows; i++)
                for (size_t j = 0; j < columns; j++) {
                    const double d = slope(a, of[p], i, by[q], j);
                    if (adjoint) out[column + j] += d * seed[row + i];
                    else out[row + i] += d * seed[column + j];
                }
        }
    }
    return adjoint ? (row == n_seed && column == n_out ? fmi3OK : fmi3Error)
                   : (row == n_out && column == n_seed ? fmi3OK : fmi3Error);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference of[], size_t n_of,
                                        const fmi3ValueReference by[], size_t n_by, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 out[], size_t n_out)
{
    return derive(c, of, n_of, by, n_by, seed, n_seed, out, n_out, 0);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference of[], size_t n_of,
                                    const fmi3ValueReference by[], size_t n_by, const fmi3Float64 seed[],
                                    size_t n_seed, fmi3Float64 out[], size_t n_out)
{
    return derive(c, of, n_of, by, n_by, seed, n_seed, out, n_out, 1);
}

/* --- steps and events --- */

static double u_at(Anybody *a, double t)
{
    fmi3Boolean early = fmi3True;
    double when = 0;
    a->update(a->environment, t, fmi3True, fmi3False, fmi3False, fmi3False, &early, &when);
    return a->m.u;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean final, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last)
{
    Anybody *a = c;
    Model *m = &a->m;
    (void)final;
    *event = *terminate = *early = fmi3False;
    if (m->in_events && (m->mode == CLOCKS || m->mode == EVENT)) return fmi3Error;
    if (fabs(t - m->t) > 1e-12 || t + h > a->stop) return fmi3Error;
    if (m->mode == WARNS && a->log) a->log(a->environment, fmi3Warning, "w", "a step of 100%s");
    if (m->mode == EARLY && h > 0.1) h /= 2, *early = fmi3True;
    if ((m->mode == STUCK || m->mode == STUCK_IN_EVENTS) && t + h > 0.45) h = 0, *early = fmi3True;
    if (m->mode == EVENT && t < 0.3 && t + h > 0.3) h = 0.3 - t, *early = *event = fmi3True;
    if (t + h > 0.45) {
        if (m->mode == ERRS) return fmi3Error;
        if (m->mode == GIVES_NAN) m->x = NAN;
        if (m->mode == ENDS) *terminate = fmi3True;
        if (m->mode == ENDS_EARLY) h = 0.1, *terminate = *early = fmi3True;
    }
    if ((m->mode == BETWEEN || m->mode == CLOCKS) && a->update) {
        const double u0 = u_at(a, t), u1 = u_at(a, t + h / 2), u2 = u_at(a, t + h);
        m->x += h / 6 * (u0 + 4 * u1 + u2);
    } else {
        m->x += h * m->u;
    }
    m->steps++;
    *last = m->t = t + h;
    return m->mode == WARNS ? fmi3Warning : fmi3OK;
}

fmi3Status fmi3SetClock(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock v[])
{
    Model *m = &((Anybody *)c)->m;
    if (!m->in_events) return fmi3Error;
    for (size_t j = 0; j < n; j++) {
        if (vr[j] == CLOCK) m->ticking = v[j];
        if (vr[j] == COUNTDOWN) m->ringing = v[j];
    }
    return fmi3OK;
}

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 interval[],
                                  fmi3IntervalQualifier qualifier[])
{
    Model *m = &((Anybody *)c)->m;
    if (n != 1 || vr[0] != COUNTDOWN) return fmi3Error;
    qualifier[0] = m->counting ? fmi3IntervalChanged : fmi3IntervalNotYetKnown;
    interval[0] = 0.05;
    m->counting = 0;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals, fmi3Boolean *values, fmi3Boolean *has_next,
                                    fmi3Float64 *next)
{
    Model *m = &((Anybody *)c)->m;
    *terminate = *nominals = *values = *has_next = fmi3False;
    *next = 0;
    if (m->ticking) m->held = m->u + m->level, m->counting = ++m->ticks == 3;
    m->rings += m->ringing;
    *again = m->ticking; /* once more */
    m->ticking = m->ringing = 0;
    m->events += !*again;
    return fmi3OK;
}

/* --- states --- */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    if (!*state) *state = malloc(sizeof(Model));
    if (!*state) return fmi3Error;
    memcpy(*state, &((Anybody *)c)->m, sizeof(Model));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    memcpy(&((Anybody *)c)->m, state, sizeof(Model));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *n)
{
    (void)c, (void)state;
    *n = sizeof(Model);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t n)
{
    (void)c;
    memcpy(bytes, state, n);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t n, fmi3FMUState *state)
{
    (void)c;
    if (n != sizeof(Model) || !(*state = malloc(n))) return fmi3Error;
    memcpy(*state, bytes, n);
    return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n)
{
    memcpy(((Anybody *)c)->m.s, x, n * sizeof *x);
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    memcpy(x, ((Anybody *)c)->m.s, n * sizeof *x);
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n)
{
    (void)c;
    for (size_t k = 0; k < n; k++) x[k] = 1;
    return fmi3OK;
}
