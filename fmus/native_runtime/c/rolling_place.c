/* A cone on a rail's head that is a circle across (mechanics/contact/geometry.py and rolling.py).

   Second derivatives of the compression, and derivatives of how the contact slides, are written down;
   the tests hold them against those of the Python law by the complex step. */
#include "rolling_parts.h"

#include <math.h>
#include <string.h>

/* Where wheel and rail are to each other. The slope is the cone's, up to the right of the rail. */
typedef struct {
    double middle;           /* of the datum from the wheelset's middle, to the right */
    double sin_slope, cos_slope, sin_roll, cos_roll;
    double sin_tilt, cos_tilt;           /* of the wheelset's roll beyond the rail's */
    double half_tilt;                    /* sin of half of it */
    double arm;              /* of the datum from the axle's middle, along the cone */
    double above;            /* likewise off the cone */
    Known c, s;              /* of the normal, from straight down to the right */
    Known off;               /* the wheel's datum from the rail's, along the normal */
    Known along;             /* the contact from the wheel's datum, along the cone */
} Place;

static Place place_of(const RollingLaw *law, double side, const double q[SIX])
{
    const double R = law->head_radius, r0 = law->radius;
    const double half = sin(q[ROLL] / 2), less = 2 * half * half;
    const double half_tilt = sin((q[ROLL] - q[RAIL_ROLL]) / 2);
    Place p = {.middle = side * law->half_distance, .half_tilt = half_tilt};
    p.cos_slope = 1 / sqrt(1 + law->conicity * law->conicity);
    p.sin_slope = side * law->conicity * p.cos_slope;
    p.sin_roll = 2 * half * cos(q[ROLL] / 2);
    p.cos_roll = 1 - less;
    p.sin_tilt = 2 * half_tilt * cos((q[ROLL] - q[RAIL_ROLL]) / 2);
    p.cos_tilt = 1 - 2 * half_tilt * half_tilt;
    p.arm = p.middle * p.cos_slope - r0 * p.sin_slope;
    p.above = p.middle * p.sin_slope + r0 * p.cos_slope;
    p.s.at = p.sin_slope * p.cos_roll - p.cos_slope * p.sin_roll;
    p.c.at = p.cos_slope * p.cos_roll + p.sin_slope * p.sin_roll;
    p.s.by[ROLL] = -p.c.at;
    p.c.by[ROLL] = p.s.at;
    /* Micrometres beside half a metre: what a roll changes is formed by itself. */
    const double across = q[Y] - (less * p.middle + p.sin_roll * r0);
    const double down = q[Z] + (p.sin_roll * p.middle - less * r0);
    const double beside = across * p.c.at - down * p.s.at;
    p.off.at = across * p.s.at + down * p.c.at;
    p.off.by[Y] = p.s.at;
    p.off.by[Z] = p.c.at;
    p.off.by[ROLL] = p.arm - beside;
    p.along.at = R * p.sin_tilt - beside;
    p.along.by[Y] = -p.c.at;
    p.along.by[Z] = p.s.at;
    p.along.by[ROLL] = R * p.cos_tilt + p.above - p.off.at;
    p.along.by[RAIL_ROLL] = -R * p.cos_tilt;
    return p;
}

/* Springs along the normal: a cone on a circle. */
static void press_cone(const RollingLaw *law, const Place *p, const double q[SIX], Press *press)
{
    const double R = law->head_radius;
    /* A wheelset that yaws goes down on the rails. */
    const double sinking = (law->half_distance - law->radius * law->conicity) * law->conicity *
                           p->cos_slope;
    Known *d = &press->overlap;
    d->at = 2 * R * p->half_tilt * p->half_tilt + p->off.at - sinking * q[YAW] * q[YAW] / 2;
    d->by[Y] = p->s.at;
    d->by[Z] = p->c.at;
    d->by[ROLL] = p->along.at + p->arm;
    d->by[YAW] = -sinking * q[YAW];
    d->by[RAIL_ROLL] = -R * p->sin_tilt;
    for (int j = 0; j < FIVE; j++)
        press->second[ROLL][j] = press->second[j][ROLL] = p->along.by[j];
    press->second[YAW][YAW] = -sinking;
    press->second[RAIL_ROLL][RAIL_ROLL] = R * p->cos_tilt;
}

/* Springs straight down, and the gravity stiffness of textbooks by hand: eqs 4 and 5 of Xu & Lu. */
static void press_textbook(const RollingLaw *law, const Place *p, const double q[SIX],
                           Press *press)
{
    const double b = law->half_distance, rise = law->conicity / b, turn = law->conicity * b;
    Known *d = &press->overlap;
    d->at = q[Z] + p->middle * q[ROLL] + rise * q[Y] * q[Y] / 2 - turn * q[YAW] * q[YAW] / 2;
    d->by[Y] = rise * q[Y];
    d->by[Z] = 1;
    d->by[ROLL] = p->middle;
    d->by[YAW] = -turn * q[YAW];
    press->second[Y][Y] = rise;
    press->second[YAW][YAW] = -turn;
}

static void slip_of(const RollingLaw *law, const Place *p, const double q[SIX], Slip *slip)
{
    const double r0 = law->radius;
    const Known one = known_constant(1), cos_roll = {p->cos_roll, {[ROLL] = -p->sin_roll}};
    const Known sin_roll = {p->sin_roll, {[ROLL] = p->cos_roll}};
    const Known yaw = {q[YAW], {[YAW] = 1}};
    /* The contact from the axle, the rolling radius; and from the middle, along the axle. */
    const Known r = known_sum(-p->sin_slope, p->along, r0, one);
    const Known y = known_sum(p->cos_slope, p->along, p->middle, one);
    const Known in = known_product(cos_roll, y), less = known_product(sin_roll, r);
    const Known out = known_sum(1, in, -1, less); /* from the middle, across the track */
    const Known behind = known_sum(1, y, -p->sin_slope / p->cos_slope, r);
    const Known x = known_product(behind, yaw), turned = known_product(r, yaw);
    const Known forward = known_product(p->c, x);
    slip->J[0][SPIN] = r;
    slip->J[0][YAW] = known_sum(-1, out, 0, one);
    slip->J[1][Y] = p->c;
    slip->J[1][Z] = known_sum(-1, p->s, 0, one);
    slip->J[1][ROLL] = known_constant(-p->above);
    slip->J[1][SPIN] = known_sum(1 / p->cos_slope, turned, 0, one);
    slip->J[1][YAW] = known_sum(-1, forward, 0, one);
    slip->J[1][RAIL_ROLL] = p->off;
    slip->J[2][SPIN] = known_constant(p->sin_slope);
    slip->J[2][YAW] = p->c;
    slip->rolling[0] = known_sum(p->sin_slope / r0, p->along, 0, one);
    slip->rolling[1] = known_sum(-1 / (p->cos_slope * r0), turned, 0, one);
    slip->rolling[2] = known_constant(-p->sin_slope / r0);
}

void rolling_place(const RollingLaw *law, double side, const double q[SIX], Press *press,
                   Slip *slip)
{
    const Place place = place_of(law, side, q);
    memset(press, 0, sizeof *press);
    (law->textbook ? press_textbook : press_cone)(law, &place, q, press);
    if (press->overlap.at > 0)
        slip_of(law, &place, q, slip);
}
