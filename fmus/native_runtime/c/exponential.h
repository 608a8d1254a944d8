/* Exact steps of modes and rigid bodies under forces that are quadratic in time. */
#ifndef RAILCOSIM_EXPONENTIAL_H
#define RAILCOSIM_EXPONENTIAL_H

#include "body.h"

/* For s' = lambda s + g, g going from g0 to g1 in a step h along a line, with a bulge of q in the
   middle: s1 = E s0 + P0 g0 + P1 g1 + Q q. Each has 2 * modes numbers, real parts first. Forces of
   contacts inside are held at the mean of g0 and g1 instead: along a line, a stiff contact would
   drive modes that turn by half and more in a step (8 GN/m, 0.1 ms: 240/s). */
typedef struct {
    double h; /* 0: not made */
    double R0, R1; /* of a rigid body's displacement, by g0 and g1, s^2 */
    double *E, *P0, *P1, *Q;
} Coefficients;

void coefficients_make(Coefficients *c, const Model *model, double h);

/* next = x after the step with what g0 does to it. */
void step_free(const Body *body, const Coefficients *c, const double *x, const double *g0,
               double *next);
/* Add what g1 does. */
void step_add_end(const Body *body, const Coefficients *c, const double *g1, double *next);
/* Add the effect of a bulge 4 q theta (1 - theta), theta = t / h. */
void step_add_bulge(const Body *body, const Coefficients *c, const double *q, double *next);
/* All at once: next = x after a step through g0, gm in its middle, and g1. */
void step_whole(const Body *body, const Coefficients *c, const double *x, const double *g0,
                const double *gm, const double *g1, double *next);

#endif
