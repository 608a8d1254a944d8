/* How contact forces drive a body's modes, and how its wheels or rails move with them. */
#ifndef RAILCOSIM_BODY_H
#define RAILCOSIM_BODY_H

#include "kernels.h"
#include "model.h"

/* Mode shapes at the four wheelsets: (4, ring) each, and the local modes' at the 8 wheels. */
typedef struct {
    double *out_re, *out_im;       /* as displacements */
    const double *in_re, *in_im;   /* as forces receive them, before the segments' exchange */
    double local_re[WHEELS], local_im[WHEELS];
    double position[WHEELSETS];
    int known; /* whether `position` is what they are for */
} Shapes;

typedef struct {
    const Model *model;
    const Kernels *kernels;
    Shapes shapes, slope; /* at the last position asked for; and their change */
    double *flexibility;  /* -1 / lambda, 2 * modes */
    double *work;         /* 2 * longest segment */
    double *memory;
} Body;

int body_create(Body *body, const Model *model); /* 0: no memory */
void body_free(Body *body);

/* Shapes at positions (m, any finite: the ring wraps). */
const Shapes *body_shapes(Body *body, const double position[WHEELSETS]);
/* Their derivative along `change` of the positions last asked for. */
const Shapes *body_slope(Body *body, const double change[WHEELSETS]);
/* Generalised forces g (2 modes + rigid) of forces beyond the preload. */
void body_drive(const Body *body, const Shapes *shapes, const double force[WHEELS], double *g);
/* Displacements at the contacts of the displacements in x (2 modes + rigid). */
void body_observe(const Body *body, const Shapes *shapes, const double *x, double z[WHEELS]);
/* For a track: displacements at the contacts, and velocities there under forces. */
void body_observe_moving(const Body *body, const Shapes *shapes, const double *x,
                         const double force[WHEELS], double z[WHEELS], double vz[WHEELS]);
/* Displacement per force where a force moves a mode by `weight`, a rigid coordinate by
   `rigid_weight`: (8, 8). */
void body_compliance(const Body *body, const Shapes *shapes, const double *weight, double rigid_weight,
                     double G[WHEELS * WHEELS]);
/* The state at rest under generalised forces. */
void body_at_rest(const Body *body, const double *g, double *x);
/* Coordinate of the multibody model from the displacements in x. */
double body_coordinate(const Body *body, size_t coordinate, const double *x);
/* d2x/dt2 of the modes, without what forces do at once. */
void body_acceleration(const Body *body, const double *x, double *acceleration);
/* dx/dt under generalised forces; g may be NULL: none. */
void body_rate(const Body *body, const double *x, const double *g, double *rate);

#endif
