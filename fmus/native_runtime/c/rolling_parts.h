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

/* a f + b g */
static inline Known known_sum(double a, Known f, double b, Known g)
{
    f.at = a * f.at + b * g.at;
    for (int j = 0; j < FIVE; j++)
        f.by[j] = a * f.by[j] + b * g.by[j];
    return f;
}

static inline Known known_product(Known f, Known g)
{
    for (int j = 0; j < FIVE; j++)
        f.by[j] = f.at * g.by[j] + f.by[j] * g.at;
    f.at *= g.at;
    return f;
}

static inline Known known_constant(double at)
{
    const Known found = {at, {0}};
    return found;
}

/* A function of x, by its value and its slope there. */
static inline Known known_of(Known x, double at, double slope)
{
    x.at = at;
    for (int j = 0; j < FIVE; j++)
        x.by[j] *= slope;
    return x;
}

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

/* What a contact does where it is: C of N = C delta^1.5, and what its creep follows from. */
typedef struct {
    Known hertz, creep[CREEP_NUMBERS];
} Patch;

/* How a contact at coordinates q is pressed and, if it is closed, how it slides: of a cone; and by a
   table of profiles, with its patch. 0: the wheel is beyond the table. */
void rolling_place(const RollingLaw *law, double side, const double q[SIX], Press *press,
                   Slip *slip);
int rolling_place_profile(const RollingProfile *profile, double side, const double q[SIX],
                          Press *press, Slip *slip, Patch *patch);

#endif
