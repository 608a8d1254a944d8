/* How contact forces drive a body's modes, and how its wheels or rails move with them.

   Generalised forces g = [Re, Im, rigid] stand in the order of the shapes that receive them
   (model.drives complex ones); a segment says which mode each of them moves. */
#ifndef RAILCOSIM_BODY_H
#define RAILCOSIM_BODY_H

#include "arrays.h"
#include "kernels.h"
#include "model.h"

/* Where a wheelset stands: cell, first node of the element, how far into it (0..1), and how long that
   is (m). */
typedef struct {
    double position; /* m, as rounded */
    size_t cell, node;
    double xi, element;
} Place;

/* Mode shapes at the wheelsets, (padded_rows, room) of each chunk, one after the other, so that a
   chunk is one piece of memory; and of the local modes
   at the contacts: (contacts, directions), of a contact's oscillators one behind the other. */
typedef struct {
    double *out_re, *out_im;       /* as displacements */
    const double *in_re, *in_im;   /* as forces receive them, before the segments' exchange */
    double *local_re, *local_im;
    double *seen_re, *seen_im;     /* of oscillators of what is seen: (own, contacts) */
    Place *place; /* of each wheelset, what they are for */
} Shapes;

enum { TOGETHER = 16 }; /* so many parts of a step are made of one chunk before the next */

/* One number a row, padded_rows of them, for even modes and for odd ones; and one behind that is
   nobody's. */
typedef struct {
    double *of[2];
} ByParity;

typedef struct {
    const Model *model;
    const Kernels *kernels;
    Shapes shapes, slope;       /* at the last position asked for; and a change of shapes */
    Shapes before;              /* at the position before that */
    Shapes between;             /* in the middle of a step */
    Place *places;              /* all that follow */
    Place *middle, *end;        /* of a part of a step that is being made */
    Place *middles, *ends;      /* of all parts that are made together */
    double *receiving;          /* of a vehicle: Shapes.in_re and in_im */
    double *weights, *all_weights; /* of the table, in the middle and at the end: (wheelsets, 8) */
    double *spare;              /* scratch: a row of shapes, real and imaginary, for each direction */
    double *flexibility;        /* -1 / lambda, 2 * modes */
    ByParity split[6];          /* scratch: one number a row */
    double *G[2];               /* scratch, of even and odd modes: 3 of (padded_rows, padded_rows) */
    double *rate;               /* scratch: 2 * modes */
    double *turned;             /* scratch: 2 * modes, where something is seen */
    Arrays arrays;
} Body;

int body_create(Body *body, const Model *model, Memory *memory); /* 0: there is none */
void body_free(Body *body);

/* Of a track: a position as shapes are for it. */
double body_rounded(const Model *model, double position);
/* Shapes at positions (m, any finite: the ring wraps), one a wheelset; kept until it is asked again,
   beside those that body_shapes_between gives. Those asked for before are found again: who steps and
   steps back, and looks where it was, goes to and fro between two places. */
const Shapes *body_shapes(Body *body, const double *position);
/* Keep the shapes where a step begins: those where it ends shall be written over others. */
const Shapes *body_keep(Body *body, const double *begin);
const Shapes *body_shapes_between(Body *body, const double *position);
/* Derivative of shapes along `change` of the positions that they are for. */
const Shapes *body_slope(Body *body, const Shapes *shapes, const double *change);
/* Generalised forces g of forces beyond the preload, one a contact. */
void body_drive(const Body *body, const Shapes *shapes, const double *force, double *g);
/* Displacements at the contacts of the displacements in x (2 modes + rigid). */
void body_observe(const Body *body, const Shapes *shapes, const double *x, double *z);
/* The same of a track, and velocities under forces beyond the preload, whose generalised ones are in
   g, if they are `known`, or will be. */
void body_look(const Body *body, const Shapes *shapes, const double *x, const double *force,
               int known, double *g, double *z, double *vz);
/* Displacements per force where forces move modes by a weight: (contacts, contacts). */
void body_compliance(const Body *body, const Shapes *shapes, const double *weight, double *G);
/* Velocities per force at once, likewise: begin with no compliance, add chunks, then make a matrix of
   it; `ones` are 2 * modes numbers, ones then zeros. */
void body_through_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk);
void body_through_rest(const Body *body, const Shapes *shapes, const double *ones, double *through);
/* The state at rest under generalised forces. */
void body_at_rest(const Body *body, const double *g, double *x);
/* Coordinate of the multibody model from the displacements in x. */
double body_coordinate(const Body *body, size_t coordinate, const double *x);
/* Acceleration of a coordinate by what forces do at once. */
double body_through(const Body *body, size_t coordinate, const double *force);
/* d2x/dt2 of the modes, without what forces do at once. */
void body_acceleration(const Body *body, const double *x, double *acceleration);
/* Outputs of what is seen at fixed places, from a state (or its change) and its rate. */
void body_see(const Body *body, const double *x, const double *rate, double *outputs);
/* Shapes of the oscillators of what is seen for a wheelset: by `here` of values at its place, and by
   `along` of their change along the track. */
void body_seen_shapes(const Model *model, size_t wheelset, double position, double here,
                      double along, double *to_re, double *to_im);
/* dx/dt under generalised forces; g may be NULL: none. */
void body_rate(const Body *body, const double *x, const double *g, double *rate);

/* --- chunk by chunk ---------------------------------------------------------------------------- */

/* Where shapes of a chunk begin, and one row of it. */
static inline size_t body_place(const Body *body, const Chunk *chunk, size_t row)
{
    (void)body;
    return chunk->shapes + row * chunk->room;
}
/* A step of a track to `end` that passes `middle` (m). Then, for each chunk, shapes in the middle, at
   `place` of body->between, and at the end. */
void body_begin_pass(Body *body, const double *middle, const double *end);
/* Of parts below TOGETHER that have begun, the one that is passed next. */
void body_choose_part(Body *body, size_t part);
void body_pass(Body *body, const Chunk *chunk, size_t place);
/* The same, with shapes at the end at the beginning of body->slope: they are not looked at again. */
void body_pass_by(Body *body, const Chunk *chunk, size_t place);
/* After all chunks: what is left of both shapes. Whether those in the middle are kept, each chunk in
   its own place. */
void body_end_pass(Body *body, int kept);
void body_end_pass_by(Body *body);
/* Whether shapes of the ring are already where a step ends and, if they are kept, passes. */
int body_has_passed(const Body *body, int kept);
/* Whether shapes are the same at the beginning, in the middle (kept) and at the end. */
int body_stays(const Body *body);
/* Shapes in the middle; of a vehicle they are the same everywhere. */
static inline const Shapes *body_between(const Body *body)
{
    return body->model->nodes > 0 ? &body->between : &body->shapes;
}

/* Forces that move even and odd modes, of forces at contacts. */
void body_split(const Model *model, const double *force, const ByParity *f);
/* Generalised forces of a chunk, whose shapes are at `place`. */
void body_drive_chunk(const Body *body, const Shapes *shapes, size_t place, const Chunk *chunk,
                      const ByParity *f, double *g);
/* The same twice: g by f, d by e. */
void body_drive_both(const Body *body, const Shapes *shapes, const Chunk *chunk, const ByParity *f,
                     const ByParity *e, double *g, double *d);
/* And of what is left: local modes, rigid coordinates. */
void body_drive_rest(const Body *body, const Shapes *shapes, const double *force,
                     const ByParity *f, double *g);
/* Add displacements of a chunk to those of even and odd modes. */
void body_observe_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk,
                        const double *x, const ByParity *z);
/* The same, and of other ones y to v. */
void body_observe_both(const Body *body, const Shapes *shapes, const Chunk *chunk, const double *x,
                       const double *y, const ByParity *z, const ByParity *v);
void body_no_motion(const Model *model, const ByParity *z);
/* Displacements at the contacts of those of even and odd modes, and of what is left. */
void body_observe_rest(const Body *body, const Shapes *shapes, const double *x, const ByParity *z,
                       double *at_contacts);
/* body_look where g are known: a chunk, and what is left. */
void body_look_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk, const double *x,
                     const double *g, const ByParity *z, const ByParity *vz);
void body_look_rest(const Body *body, const Shapes *shapes, const double *x, const double *g,
                    const ByParity *sums, const ByParity *rates, double *z, double *vz);
/* Blocks are of so many wheelsets, which stand one behind the other. */
static inline size_t body_blocks(const Model *model)
{
    return (model->wheelsets + BLOCK - 1) / BLOCK;
}
/* Contacts of a block, at most so many; returns how many. */
#define MOST_IN_BLOCK(model) (2 * BLOCK * (model)->directions)
enum { MOST_PORTS = 2 * BLOCK * MOST_DIRECTIONS };
size_t body_block(const Model *model, size_t block, size_t *contact);
/* Compliance by three weights of modes: begin with none, add chunks, of rows of one block or (`far`)
   all; then make three matrices of it, between `n` contacts. */
void body_no_compliance(const Body *body);
void body_respond_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk,
                        const double *const weight[3], int far);
void body_respond_rest(const Body *body, const Shapes *shapes, const double *const weight[3],
                       const double rigid_weight[3], size_t n, const size_t *contact, double *G);

#endif
