/* Exact steps of modes and rigid bodies under forces that are quadratic in time. */
#ifndef RAILCOSIM_EXPONENTIAL_H
#define RAILCOSIM_EXPONENTIAL_H

#include "body.h"

/* For s' = lambda s + g over a step h, with g on the parabola through g0, gm in the middle and g1:
   s is what is left of it and what the three forces did, own s + by[0] g0 + by[1] gm + by[2] g1.
   Each is 2 * modes numbers, real parts first. What a line of forces, mean + slope (2 theta - 1),
   does is (by[0] + by[1] + by[2]) mean + (by[2] - by[0]) slope. */
typedef struct {
    double *own, *by[3];
} Effects;

typedef struct {
    double h; /* 0: not made */
    Effects end, average; /* on s at the end of the step; on average over it, if contacts ask */
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
/* The three forces' effects on the displacement of a rigid coordinate. */
void rigid_effects(double h, int average, double by[3]);

#endif
