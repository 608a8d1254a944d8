/* The geometry of a rolling contact, and its creep: parts of rolling.c. */
#ifndef RAILCOSIM_ROLLING_PARTS_H
#define RAILCOSIM_ROLLING_PARTS_H

#include "rolling.h"

/* Coordinates of the wheelset against the rail: y and z, which only differ; the wheelset's roll, spin
   and yaw; the rail's roll. */
enum { Y, Z, ROLL, SPIN, YAW, RAIL_ROLL, SIX };

/* A number and its derivatives by the coordinates. */
typedef struct {
    double at, by[SIX];
} Known;

/* How the undeformed bodies overlap, m, with first and second derivatives. */
typedef struct {
    Known overlap;
    double second[SIX][SIX];
} Press;

/* Rates of slip, along, across and about the normal: J v + speed times rolling. */
typedef struct {
    Known J[3][SIX], rolling[3];
} Slip;

/* How a contact at coordinates q is pressed and, if it is closed, how it slides. */
void rolling_place(const RollingLaw *law, double side, const double q[SIX], Press *press,
                   Slip *slip);
/* Forces of creep on the wheel, along and across, and the moment about the normal, by a normal force
   N > 0 and creepages; and their derivatives by N and by the three. */
void rolling_creep(const RollingLaw *law, double N, const double creepage[3], double force[3],
                   double by[3][4]);

#endif
