/* A wheel that rolls on a rail: forces of motions and of their rates, with exact derivatives. */
#ifndef RAILCOSIM_ROLLING_H
#define RAILCOSIM_ROLLING_H

#include <stddef.h>

/* Motions of a contact: z, y, roll, x, yaw of the wheel's datum, then z, y, roll of the rail's; and
   the forces of the wheel on the rail that do work on them (mechanics/contact/at_ports.py). */
enum { ROLLING_WHEEL = 5, ROLLING_MOTIONS = 8 };
/* What forces follow from: motions, their rates, and the speed, m/s, above 0. */
enum { ROLLING_GIVEN = 2 * ROLLING_MOTIONS + 1, ROLLING_SPEED = ROLLING_GIVEN - 1 };
#define ROLLING_REFERENCE 1e5 /* normal force at which creep coefficients are told, N */

/* Where a wheel touches its rail and how, a row every `step` of how far it has gone outwards on it
   (mechanics/contact/profiles.py). */
enum {
    PROFILE_HEIGHT, PROFILE_SLOPE, PROFILE_Y, PROFILE_Z, PROFILE_LEVER, PROFILE_TRAVEL, PROFILE_BOW,
    PROFILE_SINKING, PROFILE_ALONG, PROFILE_ACROSS, PROFILE_C, PROFILE_C11, PROFILE_C22,
    PROFILE_C23, PROFILE_C33, PROFILE_COLUMNS
};
typedef struct {
    size_t rows; /* at least 2; 0: there is no table */
    const double *table; /* (rows, PROFILE_COLUMNS) */
    double reference;    /* radius of the wheel at its profile's reference point, m */
    double half_distance, first, step, shear_modulus;
    double radius, apart; /* found: r0; the reference point below the rail's datum in the middle */
} RollingProfile;

/* Find what is to be found in a table that has been filled; 0: it makes no sense. */
int rolling_profile_ready(RollingProfile *profile);

/* Numbers of a patch: linear creep's f11 and f22 over N^(2/3), f23 over N and f33 over N^(4/3);
   semi-axes along rolling and across over N^(1/3). */
enum { CREEP_F11, CREEP_F22, CREEP_F23, CREEP_F33, CREEP_A, CREEP_B, CREEP_NUMBERS };
/* Forces of creep on the wheel, along and across, and the moment about the normal, by a normal force
   N > 0, three creepages and the numbers of a patch; and their derivatives by N, by the three and by
   the numbers, which may be none where they are not `asked` for. */
enum { CREEP_BY = 4, CREEP_BY_ALL = CREEP_BY + CREEP_NUMBERS };
typedef void Creep(double friction, const double c[CREEP_NUMBERS], double N,
                   const double creepage[3], int asked, double force[3],
                   double by[3][CREEP_BY_ALL]);
/* Kalker's linear theory, whatever the friction; bounded as by Shen, Hedrick & Elkins; and FASTSIM. */
Creep creep_linear, creep_saturated, creep_fastsim;

typedef struct {
    const RollingProfile *profile; /* NULL: a cone */
    double radius, half_distance; /* r0 of the wheel; b, of the datum from the middle, m */
    double conicity, head_radius; /* of the cone; R of the rail's head across, m */
    int textbook;                 /* springs are vertical, and gravity stiffness is put in by hand */
    double hertz;                 /* C of N = C delta^1.5 */
    double patch[CREEP_NUMBERS];  /* of a cone */
    double friction;
    Creep *creep;
    double flange_stiffness, flange_clearance, flange_depth; /* N/m (0: none), m, m */
    double axle_inertia;                                     /* of the wheelset, kg m2 */
} RollingLaw;

/* Forces of the contact on a side (-1 left, 1 right), and (NULL: not asked for) their derivatives by
   motions and by rates; no numbers where the wheel is beyond the table of its profile. */
void rolling_force(const RollingLaw *law, double speed, double side,
                   const double q[ROLLING_MOTIONS], const double v[ROLLING_MOTIONS],
                   double force[ROLLING_MOTIONS], double by_q[ROLLING_MOTIONS][ROLLING_MOTIONS],
                   double by_v[ROLLING_MOTIONS][ROLLING_MOTIONS]);
/* Their derivatives by the speed, from those by rates, row after row. */
void rolling_by_speed(const RollingLaw *law, double speed, const double v[ROLLING_MOTIONS],
                      const double *by_v, double by_speed[ROLLING_MOTIONS]);

#endif
