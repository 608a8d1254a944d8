/* The geometry of a rolling contact, and its creep: parts of rolling.c. */
#ifndef RAILCOSIM_ROLLING_PARTS_H
#define RAILCOSIM_ROLLING_PARTS_H

#include "rolling.h"

/* Coordinates of the wheelset against the rail: y and z, which only differ; the wheelset's roll and
   yaw; the rail's roll; and the wheelset's spin, on which nothing depends but by its rate. */
enum { Y, Z, ROLL, YAW, RAIL_ROLL, FIVE, SPIN = FIVE, SIX };

/* A number and its derivatives by the coordinates. */
typedef struct {
    double at, by[FIVE];
} Known;

/* How the undeformed bodies overlap, m, with first and second derivatives. */
typedef struct {
    Known overlap;
    double second[FIVE][FIVE];
} Press;

/* Rates of slip, along, across and about the normal: J v + speed times rolling. J has entries only
   where a rate makes its slip: `SLIPS[i]` columns, SLIPPING[i]. */
typedef struct {
    Known J[3][SIX], rolling[3];
} Slip;
static const int SLIPS[3] = {2, SIX, 2};
static const int SLIPPING[3][SIX] = {{YAW, SPIN}, {Y, Z, ROLL, YAW, RAIL_ROLL, SPIN}, {YAW, SPIN}};

/* How a contact at coordinates q is pressed and, if it is closed, how it slides. */
void rolling_place(const RollingLaw *law, double side, const double q[SIX], Press *press,
                   Slip *slip);
/* Forces of creep on the wheel, along and across, and the moment about the normal, by a normal force
   N > 0 and creepages; and their derivatives by N and by the three. */
void rolling_creep(const RollingLaw *law, double N, const double creepage[3], double force[3],
                   double by[3][4]);

#endif
