/* Exact steps of modes and rigid bodies under forces that are quadratic in time. */
#ifndef RAILCOSIM_EXPONENTIAL_H
#define RAILCOSIM_EXPONENTIAL_H

#include "body.h"

enum { PHIS = 5 };

/* phi_0 .. phi_4 of lambda h for every mode, 2 * modes numbers each, real parts first. For
   s' = lambda s + g over a step h, theta = t / h, g = u1 + u2 theta + u3 theta^2 / 2:
   s1 = phi_0 s0 + h (phi_1 u1 + phi_2 u2 + phi_3 u3), and on average s is the same of the next
   phis. For rigid coordinates, r'' = g, h phi_k becomes h^2 / (k + 1)!. */
typedef struct {
    double h; /* 0: not made */
    double *phi[PHIS];
} Coefficients;

void coefficients_make(Coefficients *c, const Model *model, double h);

/* next = x after a step through g0, gm in its middle, and g1. */
void step_along(const Body *body, const Coefficients *c, const double *x, const double *g0,
                const double *gm, const double *g1, double *next);
/* The same, and how the average over the step differs from a sixth of both ends. */
void step_and_average(const Body *body, const Coefficients *c, const double *x, const double *g0,
                      const double *gm, const double *g1, double *next, double *differs);
/* Parts of both: modes of a chunk, and what is left: local modes, rigid coordinates. */
void step_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, const double *x,
                const double *g0, const double *gm, const double *g1, double *next);
void step_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
               const double *gm, const double *g1, double *next);
void average_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, const double *x,
                   const double *g0, const double *gm, const double *g1, double *next,
                   double *differs);
void average_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
                  const double *gm, const double *g1, double *next, double *differs);
/* Add what forces mean + slope (2 theta - 1) do to the state at the end, or on `average`. */
void step_add(const Body *body, const Coefficients *c, int average, const double *mean,
              const double *slope, double *next);
void step_add_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, int average,
                    const double *mean, const double *slope, double *next);
void step_add_rest(const Body *body, const Coefficients *c, int average, const double *mean,
                   const double *slope, double *next);
/* Displacement of a rigid coordinate by a force as phi_k weighs it, s^2. */
double rigid_weight(const Coefficients *c, int k);

#endif
