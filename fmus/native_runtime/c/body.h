/* How contact forces drive a body's modes, and how its wheels or rails move with them.

   Generalised forces g = [Re, Im, rigid] stand in the order of the shapes that receive them
   (model.drives complex ones); a segment says which mode each of them moves. */
#ifndef RAILCOSIM_BODY_H
#define RAILCOSIM_BODY_H

#include "kernels.h"
#include "model.h"

/* Where a wheelset stands: cell, first node of the element, and how far into it (0..1). */
typedef struct {
    double position; /* m, as rounded */
    size_t cell, node;
    double xi;
} Place;

/* Mode shapes at the wheelsets: (padded_rows, width) each, and the local modes' at the contacts. */
typedef struct {
    double *out_re, *out_im;       /* as displacements */
    const double *in_re, *in_im;   /* as forces receive them, before the segments' exchange */
    double *local_re, *local_im;
    Place *place; /* of each wheelset, what they are for */
} Shapes;

typedef struct {
    const Model *model;
    const Kernels *kernels;
    Shapes shapes, slope;       /* at the last position asked for; and a change of shapes */
    Shapes between;             /* in the middle of a step, for contacts inside */
    Place *places;              /* all that follow */
    Place *entered;             /* and in which element `element` is */
    Place *middle, *end;        /* scratch of body_roll */
    double *element;            /* (rows, ELEMENT_PARTS, width): the table where wheelsets are */
    double *flexibility;        /* -1 / lambda, 2 * modes */
    double *by_parity[6];       /* scratch of padded_rows each: even, odd, and for body_roll more */
    double *even, *odd;         /* the first two */
    double *G_even, *G_odd;     /* scratch: (padded_rows, padded_rows) each */
    double *local;              /* scratch: 2 contacts */
    double *work;               /* scratch: 2 * modes */
    double *memory;
} Body;

int body_create(Body *body, const Model *model); /* 0: no memory */
void body_free(Body *body);

/* Shapes at positions (m, any finite: the ring wraps), one a wheelset; kept beside those that
   body_shapes_between gives until it is asked again. */
const Shapes *body_shapes(Body *body, const double *position);
const Shapes *body_shapes_between(Body *body, const double *position);
/* Both at once: of a step that passes `middle` on its way to `end`. */
void body_pass(Body *body, const double *middle, const double *end);
/* Derivative of shapes along `change` of the positions that they are for. */
const Shapes *body_slope(Body *body, const Shapes *shapes, const double *change);
/* Shapes at the end of a step that passes `middle`, and the generalised forces there and, if `g0`
   is not NULL, under the shapes as they are now; of forces beyond the preload. */
const Shapes *body_roll(Body *body, const double *force0, const double *middle,
                        const double *force_m, const double *end, const double *force1,
                        double *g0, double *gm, double *g1);
/* Generalised forces g of forces beyond the preload, one a contact. */
void body_drive(const Body *body, const Shapes *shapes, const double *force, double *g);
/* Displacements at the contacts of the displacements in x (2 modes + rigid). */
void body_observe(const Body *body, const Shapes *shapes, const double *x, double *z);
/* Of a track: velocities at the contacts under generalised forces g. */
void body_velocity(const Body *body, const Shapes *shapes, const double *x, const double *g,
                   double *vz);
/* Displacement per force where a force moves a mode by `weight`, a rigid coordinate by
   `rigid_weight`: (contacts, contacts). */
void body_compliance(const Body *body, const Shapes *shapes, const double *weight, double rigid_weight,
                     double *G);
/* The state at rest under generalised forces. */
void body_at_rest(const Body *body, const double *g, double *x);
/* Coordinate of the multibody model from the displacements in x. */
double body_coordinate(const Body *body, size_t coordinate, const double *x);
/* Acceleration of a coordinate by what forces do at once. */
double body_through(const Body *body, size_t coordinate, const double *force);
/* d2x/dt2 of the modes, without what forces do at once. */
void body_acceleration(const Body *body, const double *x, double *acceleration);
/* dx/dt under generalised forces; g may be NULL: none. */
void body_rate(const Body *body, const double *x, const double *g, double *rate);

/* --- for each other ---------------------------------------------------------------------------- */

/* Forces that move even and odd modes. */
void body_split(const Model *model, const double *force, double *even, double *odd);
/* Modes `from` to `from` + `size` among the shapes, which are of one parity, driven by f. */
void body_drive_modes(const Body *body, const Shapes *shapes, size_t from, size_t size,
                      const double *f, double *g);
/* Local modes driven by the forces at their contacts. */
void body_drive_local(const Model *model, const double *shape_re, const double *shape_im,
                      const double *force, double *g);

#endif
