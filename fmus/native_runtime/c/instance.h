/* One instance of an FMU, without anything of FMI 2 or FMI 3: values, life, steps, snapshots. */
#ifndef RAILCOSIM_INSTANCE_H
#define RAILCOSIM_INSTANCE_H

#include "motion.h"

/* The numbers are those of fmi2Status and fmi3Status. */
typedef enum { OK = 0, WARNING = 1, DISCARD = 2, ERROR = 3, FATAL = 4 } Status;

typedef enum {
    STARTED = 1,
    INITIALISING = 2,
    EVENT = 4,
    CONTINUOUS = 8,
    STEPPING = 16,
    TERMINATED = 32,
    ANY = STARTED | INITIALISING | EVENT | CONTINUOUS | STEPPING | TERMINATED,
    RUNNING = EVENT | CONTINUOUS | STEPPING
} Phase;

/* References of the continuous states and their derivatives, beside those of the table. Between
   them there is room for all states a model may have (model.c: below 2^23). */
enum { FIRST_STATE = 1 << 16, FIRST_DERIVATIVE = 1 << 24 };

typedef void (*Log)(void *context, Status status, const char *text);

/* Everything that decides the future begins with this: a snapshot is a copy of `live` and of the states
   now and before. */
typedef struct {
    double time, phase;
    double stale;          /* outputs are older than what they depend on */
    double has_slopes;     /* input derivatives were set for the next step */
    double step;           /* length of the last step, s; 0: none yet */
    double before, change; /* u over the last step follows the value set by before + change t */
    double behind;         /* the sum of t dV, m: wheels have come V t less this */
} Clock;

typedef struct {
    Model model;
    Motion motion;
    int model_exchange;
    uint32_t first; /* the reference of the first variable of the table */
    double stop; /* that was announced, s; no step ends behind it */
    Log log;
    void *context;
    char text[512];
    size_t live_size; /* numbers in `live`, without the states */
    double *live;     /* Clock, then the arrays below */
    Clock *clock;
    double *value;                /* of every variable, by reference */
    double *u_end;                /* inputs at the end of the last step */
    double *shown;                /* those that outputs are for: u_end, or as set since then */
    double *u_slope, *u_curve;    /* input derivatives for the next step */
    double *path[3];              /* inputs over the last step: value, slope, curvature */
    /* Not in `live`: each step takes the next one of these for its result, and copies nothing. */
    double *x;                    /* state */
    double *x_before;             /* at the beginning of the last step */
    double *next, *dx;            /* scratch: as x */
    Arrays states;
    double *plan[4];              /* scratch: path of the next step, and the inputs set */
    double *scratch;              /* the arrays that follow */
    Inputs now, change;
    InputPath over, over_change;            /* the last or the next step */
    double *heights, *dheights;             /* of wheelsets at the start */
    double *dlaw;                           /* of wheelsets: changes of k_H, then of C */
    double *force, *z, *vz;                 /* of contacts, and their changes */
    double *pushed;                         /* forces at the ports of what the body meets */
    double *seen;                           /* outputs of what is seen at fixed places */
} Instance;

/* NULL: the log says why. */
Instance *instance_new(const char *resource, const char *guid, int model_exchange, Log log,
                       void *context);
void instance_free(Instance *instance);
/* Log a sentence and return ERROR. */
Status instance_fail(Instance *instance, const char *format, ...);
/* Log a sentence and return WARNING. */
Status instance_warn(Instance *instance, const char *format, ...);
/* Whether `call` may be made in the present phase; if not, it is logged. */
int instance_allows(Instance *instance, Phase phases, const char *call);
Phase instance_phase(const Instance *instance);
void instance_enter(Instance *instance, Phase phase);

Status instance_reset(Instance *instance);

/* --- values, in values.c ---------------------------------------------------------------------- */

Status instance_get(Instance *instance, const uint32_t *refs, size_t n, ValueType type,
                    double *values);
Status instance_set(Instance *instance, const uint32_t *refs, size_t n, ValueType type,
                    const double *values);
Status instance_states(Instance *instance, double *x, size_t n);
Status instance_set_states(Instance *instance, const double *x, size_t n);
Status instance_derivatives(Instance *instance, double *rate, size_t n);
Status instance_nominals(Instance *instance, double *nominals, size_t n);

/* --- time, in steps.c -------------------------------------------------------------------------- */

/* Take the span of a run; a stop of INFINITY is none. */
Status instance_set_span(Instance *instance, double start, double stop);
/* Set the time, at the start or in Model Exchange. */
Status instance_set_time(Instance *instance, double time);
Status instance_exit_initialisation(Instance *instance);
/* Derivatives of inputs for the next step. */
Status instance_set_slopes(Instance *instance, const uint32_t *refs, size_t n, const int *orders,
                           const double *values);
Status instance_step(Instance *instance, double time, double step);

/* --- derivatives, in linear.c ------------------------------------------------------------------ */

/* dy = J dv: in Model Exchange of outputs and state derivatives by states and inputs; in
   Co-Simulation of outputs by inputs at once, the state being what it is, or with the parameter
   derivatives_of_step of outputs at the end of the last step by inputs over it; in initialisation
   of what is at rest by inputs and parameters. */
Status instance_directional(Instance *instance, const uint32_t *unknowns, size_t n_unknowns,
                            const uint32_t *knowns, size_t n_knowns, const double *seed,
                            double *sensitivity);
/* First time derivatives of outputs at the end of the last step. */
Status instance_output_slopes(Instance *instance, const uint32_t *refs, size_t n, double *slopes);

/* --- snapshots, in snapshot.c ------------------------------------------------------------------ */

typedef struct Snapshot Snapshot;
Snapshot *snapshot_take(Instance *instance, Snapshot *reused); /* NULL: no memory */
Status snapshot_restore(Instance *instance, const Snapshot *snapshot);
void snapshot_free(Snapshot *snapshot);
size_t snapshot_size(const Snapshot *snapshot);
Status snapshot_write(Instance *instance, const Snapshot *snapshot, unsigned char *bytes,
                      size_t size);
Snapshot *snapshot_read(Instance *instance, const unsigned char *bytes, size_t size);

/* Where in the table a reference leads, beyond its end if nowhere; those of states stay. */
static inline uint32_t instance_place(const Instance *i, uint32_t ref)
{
    return ref >= FIRST_STATE ? ref : ref >= i->first ? ref - i->first : UINT32_MAX;
}

/* --- for each other ---------------------------------------------------------------------------- */

/* Inputs of the model from a vector in the order of model.input. */
void instance_inputs(const Instance *instance, const double *u, Inputs *inputs);
/* The same over a step, from vectors of values, slopes and curvatures. */
void instance_path(const Instance *instance, double *const u[3], InputPath *path);
/* Whether all inputs are finite; if not, it is logged. */
int instance_inputs_are_finite(Instance *instance, const double *u);
/* Whether wheels creep at the speed among the inputs; if not, it is logged. */
int instance_creeps(Instance *instance, const double *u);
double instance_parameter(const Instance *instance, Role role);
/* The speed at the end of the last step. */
double instance_speed(const Instance *instance);
/* Take the parameters. */
void instance_configure(Instance *instance);
/* Take the parameters, and find the state at rest unless the FMU runs. */
Status instance_settle(Instance *instance);

#endif
