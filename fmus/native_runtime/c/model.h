/* A linear body in modal form, and the interface of its FMU, as the resource file has them.

   ds/dt = lambda s + g for every mode (complex), d2r/dt2 = g for every rigid-body coordinate.
   The state vector is x = [Re s, Im s, r, dr/dt]; generalised forces are g = [Re g, Im g, g_r].
   Wheels are in the order left 1..4, right 1..4. */
#ifndef RAILCOSIM_MODEL_H
#define RAILCOSIM_MODEL_H

#include "resource.h"

enum { WHEELSETS = 4, WHEELS = 8 };

/* Complex numbers as two arrays: compilers make vector code of them. */
typedef struct {
    const double *re, *im;
} Complexes;

/* What a variable of the interface is; the numbers stand in the resource file (resource.py). */
typedef enum {
    ROLE_TIME = 0,
    ROLE_IN_POSITION = 1,   /* of a wheelset */
    ROLE_IN_LOAD = 2,       /* of a wheel: force, or height of the surface the contact presses on */
    ROLE_IN_LOAD_LESS = 3,  /* the same, taken off */
    ROLE_OUT_POSITION = 4,  /* of a wheelset: the vehicle runs */
    ROLE_OUT_FORCE = 5,     /* of a wheel's own contact */
    ROLE_OUT_CONTACT_Z = 6, /* of a wheel: deflection of the body there */
    ROLE_OUT_CONTACT_VZ = 7,
    ROLE_OUT_COORDINATE = 8, /* of the multibody model */
    ROLE_OUT_RATE = 9,
    ROLE_OUT_ACCELERATION = 10,
    ROLE_HOLD = 11,
    ROLE_INTERNAL_STEP = 12,
    ROLE_NONLINEAR = 13,
    ROLE_STIFFNESS = 14,
    ROLE_HERTZ = 15,
    ROLE_SPEED = 16,
    ROLE_START_POSITION = 17,
    ROLE_START_Z = 18, /* of a wheelset */
    ROLES
} Role;

typedef enum { REAL = 0, INTEGER = 1, BOOLEAN = 2 } ValueType;
typedef enum { INDEPENDENT = 0, INPUT = 1, OUTPUT = 2, PARAMETER = 3 } Causality;

typedef struct {
    ValueType type;
    Causality causality;
    int tunable; /* may change during a run */
    Role role;
    size_t index; /* wheelset, wheel or coordinate */
    double start, minimum, maximum;
    const char *name;
} Variable;

/* Modes of one wavenumber: `size` of them from `to` on receive their force by the shapes from
   `from` on. From cell to cell they turn by mu. */
typedef struct {
    size_t to, from, size;
    double mu;
} Segment;

typedef struct {
    Resource resource;
    const char *guid;
    /* Modes: even ones (both wheels or rails move alike), odd ones, one local one a wheel. */
    size_t even, odd, ring, local, modes;
    size_t rigid, coordinates, states;
    const double *nominals; /* of Re s, Im s and, with rigid coordinates, r and dr/dt */
    Complexes pole;
    size_t even_segments, segments; /* of even modes, of all; those of odd ones follow */
    size_t longest;                 /* modes in a segment */
    Segment *segment;
    /* Shapes of a track: a table along one cell, (nodes, w and dw/dx, ring). The node after the
       last is the first one of the next cell. */
    size_t nodes, cells;
    const float *table_re, *table_im;
    Complexes local_shape;
    double *phase; /* cos and sin of mu times the cell, (cells, segments, 2) */
    double cell_length, length, element;
    /* Shapes of a vehicle: the same everywhere, (4, modes), out and in. */
    Complexes out, in, coordinate, start_s;
    const double *rigid_shape; /* (coordinates, rigid); the wheelsets are the last four */
    const double *inverse_mass, *wheelset_x, *start_r;
    double preload;   /* contact force that loads nothing: the vehicle's own weight, N */
    int contact_sign; /* 0: forces from outside; 1: moving down presses; -1: it relieves */
    /* Interface. */
    size_t variables, inputs, outputs;
    Variable *variable;
    uint32_t *input, *output; /* references */
    uint32_t of_role[ROLES];  /* reference of a parameter; UINT32_MAX if there is none */
} Model;

/* Return 1, or 0 with a sentence in `why`; then nothing is left to free. */
int model_load(Model *model, const char *path, char *why, size_t room);
/* The same from a resource that has been checked; the model owns it from now on. */
int model_read(Model *model, Resource resource, char *why, size_t room);
void model_free(Model *model);

#endif
