/* A body moved over one communication step by forces from outside or by its own contacts, and the
   derivative of that. */
#ifndef RAILCOSIM_MOTION_H
#define RAILCOSIM_MOTION_H

#include "balance.h"
#include "exponential.h"
#include "gaps.h"

#include <math.h>

enum { KEPT_STEPS = 8 }; /* step sizes whose coefficients are kept */
#define MAX_INTERNAL_STEPS 1e7

/* What comes from outside at one instant: positions (m) of the wheelsets, and loads of the
   contacts, which are forces (N) or, for a body with contacts of its own, what their law is given.
   Both are parts of one block of inputs_size numbers. */
typedef struct {
    double *position, *load;
} Inputs;

size_t inputs_size(const Model *model);
Inputs inputs_in(const Model *model, double *block);

/* Inputs over a step: start + slope t + curve t^2 / 2. */
typedef struct {
    Inputs start, slope, curve;
} InputPath;

/* What is seen at the contacts in the state that a step ended in: displacements; velocities under
   some forces; of forces that depend on rates, velocities without any, and what the law was given. */
typedef struct {
    int known, rates, free; /* whether displacements, velocities, those without forces are */
    double *at;             /* wheelsets, as they are rounded */
    double *under;          /* forces of the contacts */
    double *z, *vz, *vz_free, *given;
} Seen;

typedef struct {
    Body body;
    ContactLaw law;
    Seen last;
    double internal_step;
    Coefficients kept[KEPT_STEPS];
    size_t next; /* of `kept` to be overwritten */
    /* Generalised forces at the ends and in the middle of a step; g1 are those that `driven` gave
       with wheelsets at `driven_at`. */
    double *g0, *gm, *g1, *driven, *driven_at;
    double *rate, *drate, *dx, *part, *dpart, *line[2]; /* scratch: as x */
    double *d0, *dm, *d1, *more; /* scratch: as g */
    /* Scratch of one number a contact, of two, or what solving takes. */
    double *force, *dforce, *beyond[3], *z, *dz, *moved, *inside, *dinside,
        *none;
    double *seen[3], *dseen[3], *rolled[3], *drolled[3], *passed[2], *v, *dv;
    double *over, *dover, *free, *dfree, *moves, *far;
    double *mean_load, *dmean_load; /* as loads */
    double *line_force, *last_over;
    double *G, *through, *solving;
    double *ones, *no_g; /* weights of modes that let a force through to a velocity at once */
    double *through_at;  /* wheelsets for which `through` is */
    double G_of; /* step whose compliances G are, where body->between is; 0: of something else */
    Inputs now, middle, end, dnow, dmiddle, dend;
    GapWork gaps;
    /* Of parts of a step that are made together, in the middle and at the end of each: forces beyond
       the preload, and those that move even and odd modes. */
    double *beyond_of[2 * TOGETHER];
    ByParity split_of[2 * TOGETHER];
    Arrays arrays;
} Motion;

int motion_create(Motion *motion, const Model *model, Memory *memory); /* 0: there is none */
void motion_free(Motion *motion);

void path_at(const Model *model, const InputPath *path, double t, Inputs *now);
/* Contact forces in state x at the body's own ports; those that depend on rates agree with the rates
   that they make. 0: there are none. */
int motion_forces(Motion *motion, const Inputs *now, const double *x, double *force);
/* The same in the state that the last step ended in, and what is seen there: in motion->last. */
int motion_last_forces(Motion *motion, const Inputs *now, const double *x);
/* That of a contact k which is only pressed, from displacements. */
double motion_pressed(const Motion *motion, size_t k, const double *z, const double *load);
/* Those at the ports of what the body meets, from motions and rates of its own. */
void motion_on_other(const Motion *motion, const Inputs *now, const double *z, const double *vz,
                     double *force);
/* The state at rest under `now`; for a vehicle with wheelsets at `heights`. 0: none was found. */
int motion_rest(Motion *motion, const Inputs *now, const double *heights, double *x);
/* Contact forces, and displacements and velocities of the contacts of a track, in the state that the
   last step ended in, if it has not been forgotten, or in any state x. 0: there are none. */
int motion_see(Motion *motion, const Inputs *now, const double *x, double *force, double *z,
                double *vz);
/* The state is another one than that in which the last step ended. */
void motion_forget(Motion *motion);
/* Generalised forces of contact forces; valid until the next call. */
const double *motion_driven(Motion *motion, const Shapes *shapes, const double *force);
/* next = state after a step h. Returns a sentence if that fails, else NULL. */
const char *motion_step(Motion *motion, const InputPath *path, double h, const double *x,
                        double *next);
/* Acceleration of a coordinate of the multibody model by what forces do at once. */
double motion_through(Motion *motion, size_t coordinate, const double *force);
/* dx/dt, in `rate`; 0: there are no contact forces. */
int motion_rate(Motion *motion, const Inputs *now, const double *x, double *rate);

/* --- parts of a step, for motion_change.c ------------------------------------------------------ */

extern const char MOTION_TOO_MANY[], MOTION_NO_CONTACT[], MOTION_NO_GAPS[];

const Coefficients *motion_coefficients(Motion *motion, double h);
/* Whether no wheel moves. */
int motion_still(const Model *model, const InputPath *path);
/* The law at rest. */
Question motion_at_rest(const Motion *motion, const double *given);
/* Displacements by contact forces at rest, in motion->G. */
void motion_static_compliance(Motion *motion, const Shapes *shapes);
/* Into how many internal steps a step is cut: one that is exact where forces come from outside and
   no wheel moves; otherwise some over each of which the forces on the modes go along a parabola
   or, where the body's own contacts make them, along a line. */
double motion_internal_steps(const Motion *motion, int is_still, double h);
/* Generalised forces of contact forces. */
void motion_drive(Motion *motion, const Shapes *shapes, const double *force, double *g);
/* Whether g1 are generalised forces of these, with wheelsets where the shapes are; and that they
   now are. */
int motion_is_driven(const Motion *motion, const double *force);
void motion_note_driven(Motion *motion, const double *force);
/* Where the state is after part k of `parts` of a step, that after the last in `next`. */
static inline double *motion_after(const Motion *motion, double k, double parts, double *next)
{
    return fmod(parts - k, 2) == 0 ? next : motion->dx;
}
/* Inputs at the beginning, in the middle and at the end of part k of `parts` of a step. */
void path_part(const Model *model, const InputPath *path, double h, double k, double parts,
               Inputs *begin, Inputs *middle, Inputs *end);

/* Forces less what loads nothing; in `beyond`. */
const double *motion_beyond_preload(const Motion *motion, const double *force, double *beyond);
/* Displacements that were seen in the last state with wheelsets where body->shapes are; NULL: none. */
const double *motion_seen(const Motion *motion);
/* Take note of what is seen at the end of a step, in motion->last already: with wheelsets where the
   shapes are, velocities (`rates`) under forces if they are. */
void motion_note_seen(Motion *motion, int rates, const double *force);

/* --- steps of a body under forces from outside, in motion_outside.c ---------------------------- */

/* The parts of a step h behind the first `before`, up to `until` of all `parts`: from x to
   motion_after(until). */
void motion_outside_step(Motion *motion, const InputPath *path, double h, double before,
                         double until, double parts, const double *x, double *next);

/* --- steps of a body with contacts of its own, in motion_contact.c ----------------------------- */

/* next = state after an internal step between motion->now, middle and end. 0: no forces found. */
int motion_contact_step(Motion *motion, const Coefficients *c, const double *x, double *next);
/* The same, and its derivative along dnow, dmiddle, dend and dx; x and dx are moved on. */
int motion_contact_step_change(Motion *motion, const Coefficients *c, double *x, double *dx);
/* Parts of both. Motions, on average over a step and at its end, of what is seen. */
void motion_average(const Motion *motion, double *const z[3], double *motions);
/* What the law is given on average over a step. */
void motion_average_load(const Motion *motion, const Inputs *begin, const Inputs *middle,
                         const Inputs *end, double *load);
/* By how much motions where the wheels are differ from those in the middle of their way, at the
   beginning, on average and at the end; of both ends, in the middle, in `passed`. */
void motion_rolled(const Motion *motion, double *const z[3], double *const passed[2],
                   double *const rolled[3]);
/* next = state after the step under the forces at the beginning, and the forces over the step,
   [means, slopes], in motion->over; z are displacements at the beginning. */
int motion_find_forces(Motion *motion, const Coefficients *c, const double *z, const double *x,
                       double *next);

/* Whether what forces add to rates at once is known where shapes are; and take it from what chunks have
   added. */
int motion_has_through(const Motion *motion, const Shapes *shapes);
void motion_take_through(Motion *motion, const Shapes *shapes);

/* --- forces over an internal step, in motion_balance.c ----------------------------------------- */

/* What forces at the beginning of a step, in its middle and at its end do to the end. */
typedef struct {
    const double *modes[3];
    double rigid[3];
} Weights;
Weights motion_weights(const Coefficients *c);
/* Compliances of all blocks, from those that chunks have added, in motion->G. */
void motion_find_compliances(Motion *motion, const Coefficients *c);
/* The way over a step, of what motion->seen and the loads have; and its change. */
Way motion_way(const Motion *motion, const Coefficients *c);
Way motion_way_change(const Motion *motion, const Coefficients *c);
/* Forces in motion->over, [means, slopes], and motions in motion->moves, from motion->free under the
   forces at the beginning. 0: they did not settle. */
int motion_balance(Motion *motion, const Coefficients *c);
/* Their change, motion->dover, from the way's and motion->dfree; 0: there is none. */
int motion_balance_change(Motion *motion, const Coefficients *c);

/* --- derivatives along changes dx of the state and `change` of the inputs --------------------- */

/* Derivative of generalised forces. */
void motion_drive_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                         const double *force, const double *dforce, double *dg);
/* Derivative of the displacements (or velocities) at the contacts. */
void motion_observe_change(const Motion *motion, const Shapes *shapes, const Shapes *slope,
                           const double *x, const double *dx, double *dz);
/* Derivative of the forces; `force` as motion_forces gives it. */
void motion_forces_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                          const double *dx, double *dforce);
/* The same where forces and displacements, and motion->v and through, are those that motion_forces
   found; dz are changes of the displacements. */
void motion_known_forces_change(Motion *motion, const Shapes *shapes, const Shapes *slope,
                                const Inputs *now, const double *x, const double *force,
                                const double *z, const Inputs *change, const double *dx,
                                const double *dz, double *dforce);
/* The same of a body that does not move, whose displacements do not answer. */
void motion_still_change(const Motion *motion, const Inputs *now, const double *z,
                         const Inputs *change, const double *dz, double *dforce);
/* Derivative of motion_on_other along changes of motions and rates as well. */
void motion_on_other_change(const Motion *motion, const Inputs *now, const double *z,
                            const double *vz, const Inputs *change, const double *dz,
                            const double *dvz, double *dforce);
/* Derivative of motion_rate. */
void motion_rate_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        const double *dx, double *drate);
/* Derivative of motion_rest, 0 for a vehicle. */
void motion_rest_change(Motion *motion, const Inputs *now, const double *x, const Inputs *change,
                        double *dx);
/* Derivative of motion_step along `change` of the path; x and dx go from its start to its end. */
const char *motion_step_change(Motion *motion, const InputPath *path, const InputPath *change,
                               double h, double *x, double *dx);

#endif
