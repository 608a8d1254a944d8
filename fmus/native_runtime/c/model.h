/* A linear body in modal form, and the interface of its FMU, as the resource file has them.

   ds/dt = lambda s + g for every mode (complex), d2r/dt2 = g for every rigid-body coordinate.
   The state vector is x = [Re s, Im s, r, dr/dt]; generalised forces are g = [Re g, Im g, g_r].

   A contact is a wheelset on one side in one of the directions in which it and the track move:
   contact = side * side_contacts + wheelset * directions + direction. A row is a wheelset in a
   direction: both sides of a row move modes of either parity by the sum or the difference of their
   forces. On a track whose sides are `apart`, no mirror images, all modes count as even, and a row is
   one of a side as well: row = wheelset * motions + side * directions + direction. */
#ifndef RAILCOSIM_MODEL_H
#define RAILCOSIM_MODEL_H

#include "memory_rule.h"
#include "resource.h"
#include "rolling.h"

/* Kernels take modes and rows by so many. */
enum { BLOCK = 4 };
enum { MOST_WHEELSETS = 64, MOST_DIRECTIONS = 6, MOST_PARTS = 1024 };
/* Of what rolls: those of a wheel, whose first ones are also the rail's. */
enum { WHEEL_DIRECTIONS = 5, RAIL_DIRECTIONS = 3 };
/* Parts of a node in the table of shapes, each an array over modes: shape, real and imaginary, and
   slope. */
enum { NODE_PARTS = 4 };

/* Complex numbers as two arrays: compilers make vector code of them. */
typedef struct {
    const double *re, *im;
} Complexes;

/* What a variable of the interface is; the numbers stand in the resource file (resource.py). */
typedef enum {
    ROLE_TIME = 0,
    ROLE_IN_POSITION = 1,   /* of a wheelset */
    ROLE_IN_LOAD = 2,       /* of a contact: force, or height of what the body's own presses on */
    ROLE_IN_LOAD_LESS = 3,  /* the same, taken off */
    ROLE_OUT_POSITION = 4,  /* of a wheelset: the vehicle runs */
    ROLE_OUT_FORCE = 5,     /* of a contact of its own */
    ROLE_OUT_CONTACT_Z = 6, /* of a contact: deflection of the body there */
    ROLE_OUT_CONTACT_VZ = 7,
    ROLE_OUT_COORDINATE = 8, /* of the multibody model */
    ROLE_OUT_RATE = 9,
    ROLE_OUT_ACCELERATION = 10,
    ROLE_HOLD = 11,
    ROLE_INTERNAL_STEP = 12,
    ROLE_NONLINEAR = 13,
    ROLE_STIFFNESS = 14, /* of all contacts, or of those of a wheelset */
    ROLE_HERTZ = 15,     /* likewise */
    ROLE_SPEED = 16,
    ROLE_START_POSITION = 17,
    ROLE_START_Z = 18, /* of a wheelset */
    ROLE_RADIUS = 19,  /* this and what follows: of rolling contacts, of all or of a wheelset */
    ROLE_HALF_DISTANCE = 20,
    ROLE_CONICITY = 21,
    ROLE_HEAD_RADIUS = 22,
    ROLE_CREEP_ALONG = 23,
    ROLE_CREEP_ACROSS = 24,
    ROLE_CREEP_SPIN = 25,
    ROLE_CREEP_TURN = 26,
    ROLE_ELLIPSE_ALONG = 27,
    ROLE_ELLIPSE_ACROSS = 28,
    ROLE_FRICTION = 29,
    ROLE_FLANGE_STIFFNESS = 30,
    ROLE_FLANGE_CLEARANCE = 31,
    ROLE_FLANGE_DEPTH = 32,
    ROLE_AXLE_INERTIA = 33,
    ROLE_TEXTBOOK = 34, /* of all */
    ROLE_FASTSIM = 35,  /* of all: friction bounds creep so, else as by Shen, Hedrick & Elkins */
    ROLE_DERIVATIVES_OF_STEP = 36,
    ROLE_OUT_SEEN = 37, /* of an output of what is seen at fixed places */
    ROLE_IN_SPEED = 38, /* of wheels that creep: the last number that each contact is given */
    ROLES
} Role;

/* Parameters of contacts that may be one of all wheelsets or one of each. */
enum { LAW_NUMBERS = 2 + ROLE_AXLE_INERTIA - ROLE_RADIUS + 1 };
/* Which of these a role is; LAW_NUMBERS if none. */
static inline size_t law_number(Role role)
{
    if (role == ROLE_STIFFNESS || role == ROLE_HERTZ)
        return (size_t)(role - ROLE_STIFFNESS);
    return role >= ROLE_RADIUS && role <= ROLE_AXLE_INERTIA ? (size_t)(2 + role - ROLE_RADIUS)
                                                            : LAW_NUMBERS;
}

typedef enum { REAL = 0, INTEGER = 1, BOOLEAN = 2 } ValueType;
typedef enum { INDEPENDENT = 0, INPUT = 1, OUTPUT = 2, PARAMETER = 3 } Causality;

typedef struct {
    ValueType type;
    Causality causality;
    int tunable; /* may change during a run */
    Role role;
    size_t index; /* wheelset, contact, coordinate or output of what is seen */
    size_t place; /* of an input among the inputs */
    double start, minimum, maximum;
    const char *name;
} Variable;

/* Modes of one wavenumber: `size` of them from `to` on receive their force by the shapes from
   `from` on. From cell to cell they turn by mu. */
typedef struct {
    size_t to, from, size;
    size_t out, in; /* `to` and `from` among the columns of shapes */
    size_t partner; /* the segment that begins at `from`, whose force is received from here */
    size_t pole;    /* the first mode with these poles: its own or its partner's, whichever is first */
    unsigned moves; /* directions, a bit each; in others its shapes are zero */
    double mu;
} Segment;

/* Segments of one parity with their partners, whose modes are worked on one kernel after the other
   while they stay in the nearest memory: `size` of them from `to` on, from column `at` on among the
   shapes, where there is `room` for whole cache lines, whatever its last segment begins with. */
typedef struct {
    size_t first, end; /* segments */
    size_t to, at, size, room;
    int odd;
    /* Only directions in which its modes move have rows: `moving` of them. A row is `row` among all;
       those that fill a block stand behind all. */
    size_t moving, rows, padded_rows;
    size_t direction[MOST_DIRECTIONS];
    const size_t *row;
    size_t shapes, table; /* where its shapes begin, and its part of the table */
} Chunk;

/* Equally long elements of a cell, side by side. */
typedef struct {
    double begin, end, element; /* m; the last one ends nowhere */
    size_t first, elements;
} Stretch;

/* What is seen of a track at fixed places: rows y = Re(shown s) + sum of size Re(q), of which the q
   are oscillators of the row's own, as many of each row, that forces drive by a table along the
   ring, at places from `begin` on; and outputs, each a sum of one row's y, dy/dt and d2y/dt2. */
typedef struct {
    size_t rows, padded_rows, own, places, outputs;
    int rates;              /* whether an output takes a derivative */
    double *shown[2];       /* (padded_rows, ring), real and imaginary */
    const double *size, *begin;
    Complexes into;         /* (own, places, sides * directions) */
    double spacing;
    const int32_t *row;     /* of an output */
    const double *weight;   /* (outputs, 3) */
} Observed;

/* Springs with a gap that closes, see gaps.h: stretches by modes, (count, ring). */
typedef struct {
    size_t count;
    Complexes shown;
    const double *stiffness, *damping, *gap;
} ModelGaps;

typedef struct {
    Resource resource;
    Memory memory; /* what the model, and what is made of it, may still take */
    const char *guid;
    size_t wheelsets, sides, directions, side_contacts, contacts;
    int apart;
    size_t motions, rows;  /* of a wheelset that shapes know: directions, or of both sides; of all */
    size_t padded_rows;    /* whole blocks of them */
    const int32_t *mirror; /* of a direction: 1 where even modes move both sides alike, else -1 */
    /* Modes: even ones (of motions that are their own mirror images), odd ones, one local one a
       contact; and those of what is seen. */
    size_t even, odd, ring, local, modes;
    Observed seen;
    ModelGaps gaps;
    size_t width;  /* columns of shapes: those of all chunks */
    size_t shapes; /* numbers in shapes of all chunks, real or imaginary */
    size_t *chunk_rows; /* what the chunks' `row` point to */
    size_t drives; /* complex generalised forces: width + those of other modes, in whole lines */
    size_t rigid, coordinates, states;
    size_t even_rigid, even_coordinates; /* even ones first: no odd mode moves an even coordinate */
    const double *nominals; /* of Re s, Im s and, with rigid coordinates, r and dr/dt */
    Complexes pole;
    size_t segments; /* of even modes, then of odd ones; the local modes stand behind as one more */
    Segment *segment;
    size_t chunks;
    Chunk *chunk; /* the local modes stand behind as one more, which has no shapes */
    /* Shapes of a track: a table along one cell, (nodes, moving, NODE_PARTS, room) for each chunk,
       one after the other. The node after the last is the first one of the next cell. Where shapes
       have a kink two nodes are at one place: each element begins at the second of them. Shapes of
       local modes are told at the ends of `parts` of an element, and their slopes, (nodes, parts, 2,
       motions, directions). */
    size_t nodes, cells, elements, parts;
    const int32_t *begins;
    float *table;
    Complexes local_shape;
    double *phase; /* cos and sin of mu times the cell, (cells, segments, 2) */
    double cell_length, length;
    Stretch *stretch;
    /* Shapes of a vehicle: the same everywhere, (rows, modes), out and in. */
    Complexes out, in, coordinate, start_s;
    const double *rigid_shape;         /* (coordinates, rigid) */
    const double *rigid_out, *rigid_in; /* (rows, rigid) */
    const double *through; /* acceleration of a coordinate by a force at once, (coordinates, rows) */
    const double *wheelset_x, *start_r;
    const double *preloads; /* contact forces that load nothing: a vehicle's own weight, N */
    size_t given; /* loads of a contact: forces; a height; or what rolling follows from */
    int rolls;    /* whether it has contacts of its own that roll */
    RollingProfile profile; /* of its wheels on their rails; without rows they are cones */
    int contact_sign; /* 0: forces from outside; 1: moving down presses; -1: it relieves */
    /* Interface. */
    size_t variables, inputs, outputs;
    Variable *variable;
    uint32_t *input, *output; /* references */
    uint32_t of_role[ROLES];  /* reference of a parameter, or of the speed that is an input;
                                 UINT32_MAX if there is none */
    uint32_t *law;            /* references of the law's numbers, (LAW_NUMBERS, wheelsets) */
} Model;

/* Return 1, or 0 with a sentence in `why`; then nothing is left to free. */
int model_load(Model *model, const char *path, char *why, size_t room);
/* The same from a resource that has been checked; the model owns it from now on. */
int model_read(Model *model, Resource resource, char *why, size_t room);
void model_free(Model *model);

/* Where a contact is among the rows. */
static inline size_t model_row(const Model *m, size_t contact)
{
    const size_t side = contact / m->side_contacts, k = contact % m->side_contacts;
    return m->apart ? k / m->directions * m->motions + side * m->directions + k % m->directions : k;
}

/* A node in the table of shapes of a chunk. */
static inline const float *model_node(const Model *m, const Chunk *chunk, size_t node)
{
    return m->table + chunk->table + NODE_PARTS * chunk->moving * node * chunk->room;
}

/* --- part of reading, in chunks.c -------------------------------------------------------------- */

/* Find the segments' partners and the chunks, `segments` + 1 of which have room, and with them
   columns and rows. 0: there is a segment without a partner that has the same poles. */
int model_find_chunks(Model *model);
/* Fill the table from the file's, (nodes, directions, shape and slope, ring). */
void model_fill_table(Model *model, const float *re, const float *im);
/* Likewise rows of what is seen, in seen.c, where there is room for whole blocks of them. */
void model_fill_seen(Model *model, const double *re, const double *im);

#endif
