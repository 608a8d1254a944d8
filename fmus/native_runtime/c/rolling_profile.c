/* A wheel and a rail by a table of their profiles (mechanics/contact/profiled.py), with derivatives.

   The table is of a right wheel; a left one is its mirror image. */
#include "rolling_parts.h"

#include <math.h>
#include <string.h>

/* Between two rows: how far towards the second, of `step`, by the displacement outwards. */
typedef struct {
    const double *begin, *end;
    double part, step;
    Known outwards;
} Between;

/* 0: beyond the table. */
static int between_rows(const RollingProfile *p, Known outwards, Between *at)
{
    const double along = (outwards.at - p->first) / p->step, last = (double)(p->rows - 1);
    if (!(along >= 0 && along <= last))
        return 0;
    const size_t row = along < last ? (size_t)along : p->rows - 2;
    at->begin = p->table + row * PROFILE_COLUMNS;
    at->end = at->begin + PROFILE_COLUMNS;
    at->part = along - (double)row;
    at->step = p->step;
    at->outwards = outwards;
    return 1;
}

static double slope_of(const Between *at, int column)
{
    return (at->end[column] - at->begin[column]) / at->step;
}

/* A column, a line from row to row. */
static Known column_of(const Between *at, int column)
{
    const double begin = at->begin[column];
    return known_of(at->outwards, begin + at->part * (at->end[column] - begin),
                    slope_of(at, column));
}

/* Height, slope and bend, by Hermite's cubic: slopes are known. */
static void heights(const Between *at, Known height[3])
{
    const double h = at->step, t = at->part;
    const double z0 = at->begin[PROFILE_HEIGHT], s0 = at->begin[PROFILE_SLOPE];
    const double mean = (at->end[PROFILE_HEIGHT] - z0) / h, s1 = at->end[PROFILE_SLOPE];
    const double c2 = 3 * mean - 2 * s0 - s1, c3 = s0 + s1 - 2 * mean;
    const double slope = s0 + t * (2 * c2 + 3 * t * c3), bend = (2 * c2 + 6 * t * c3) / h;
    height[0] = known_of(at->outwards, z0 + h * t * (s0 + t * (c2 + t * c3)), slope);
    height[1] = known_of(at->outwards, slope, bend);
    height[2] = known_of(at->outwards, bend, 6 * c3 / (h * h));
}

int rolling_profile_ready(RollingProfile *p)
{
    Between at;
    Known height[3];
    if (p->rows < 2 || !(p->step > 0) || !(p->shear_modulus > 0) || !(p->half_distance > 0) ||
        !between_rows(p, known_constant(0), &at))
        return 0;
    for (size_t row = 0; row < p->rows; row++)
        for (size_t column = PROFILE_ALONG; column < PROFILE_COLUMNS; column++)
            if (!(p->table[row * PROFILE_COLUMNS + column] > 0))
                return 0;
    heights(&at, height);
    p->apart = height[0].at;
    p->radius = p->reference + column_of(&at, PROFILE_Z).at;
    return p->radius > 0;
}

/* The wheel's reference point as the rail sees it, and how coordinates move it. */
typedef struct {
    Known y, z, roll;           /* from the datum, in the frame that rolls with the rail */
    Known across, down;         /* the same in the track's frame */
    Known arm_y, arm_z;         /* reference point from the wheelset's middle */
    Known cos_roll, sin_roll, cos_rail, sin_rail;
} Pose;

static Pose pose_of(const RollingProfile *p, double side, const double q[SIX])
{
    const double y = side * p->half_distance, z = p->reference;
    const double half = sin(q[ROLL] / 2), less = 2 * half * half, s = sin(q[ROLL]), c = 1 - less;
    const double rail_half = sin(q[RAIL_ROLL] / 2), rail_less = 2 * rail_half * rail_half;
    const double rail_s = sin(q[RAIL_ROLL]), rail_c = 1 - rail_less;
    Pose at;
    memset(&at, 0, sizeof at);
    at.cos_roll.at = c;
    at.cos_roll.by[ROLL] = -s;
    at.sin_roll.at = s;
    at.sin_roll.by[ROLL] = c;
    at.cos_rail.at = rail_c;
    at.cos_rail.by[RAIL_ROLL] = -rail_s;
    at.sin_rail.at = rail_s;
    at.sin_rail.by[RAIL_ROLL] = rail_c;
    at.roll.at = q[ROLL] - q[RAIL_ROLL];
    at.roll.by[ROLL] = 1;
    at.roll.by[RAIL_ROLL] = -1;
    /* Micrometres beside half a metre: what a roll changes is formed by itself. */
    const double by_roll_y = -less * y - s * z, by_roll_z = s * y - less * z;
    at.across.at = q[Y] + by_roll_y;
    at.across.by[Y] = 1;
    at.across.by[ROLL] = -s * y - c * z;
    at.down.at = q[Z] + by_roll_z + p->apart;
    at.down.by[Z] = 1;
    at.down.by[ROLL] = c * y - s * z;
    at.arm_y = known_of(at.sin_roll, y + by_roll_y, 0);
    at.arm_y.by[ROLL] = at.across.by[ROLL];
    at.arm_z = known_of(at.sin_roll, z + by_roll_z, 0);
    at.arm_z.by[ROLL] = at.down.by[ROLL];
    at.y = known_sum(1, known_product(at.cos_rail, at.across), 1,
                     known_product(at.sin_rail, at.down));
    at.y.at = at.across.at + (-rail_less * at.across.at + rail_s * at.down.at);
    at.z = known_sum(1, known_product(at.cos_rail, at.down), -1,
                     known_product(at.sin_rail, at.across));
    at.z.at = at.down.at + (-rail_s * at.across.at - rail_less * at.down.at);
    return at;
}

/* A contact: its place on the wheel, from the axle and from the middle, and on the rail, from its
   datum; its slope as the wheelset sees it. */
typedef struct {
    Known slope, y, radius, rail_y, rail_z;
} Touch;

static void set_row(Press *press, int a, Known gradient)
{
    press->overlap.by[a] = gradient.at;
    memcpy(press->second[a], gradient.by, sizeof gradient.by);
}

/* Overlap and its gradient by those in the rail's frame, along the normal of length 1, and by yaw. */
static void press_by(const Pose *at, Known overlap, Known by_y, Known by_z, Known by_roll,
                     Known by_yaw, Press *press)
{
    const Known n_y = known_sum(1, known_product(by_y, at->cos_rail), -1,
                                known_product(by_z, at->sin_rail));
    const Known n_z = known_sum(1, known_product(by_y, at->sin_rail), 1,
                                known_product(by_z, at->cos_rail));
    const Known turned = known_sum(-1, known_product(n_y, at->arm_z), 1,
                                   known_product(n_z, at->arm_y));
    const Known back = known_sum(1, known_product(by_y, at->z), -1, known_product(by_z, at->y));
    press->overlap = overlap;
    set_row(press, Y, n_y);
    set_row(press, Z, n_z);
    set_row(press, ROLL, known_sum(1, by_roll, 1, turned));
    set_row(press, YAW, by_yaw);
    set_row(press, RAIL_ROLL, known_sum(1, back, -1, by_roll));
}

static Touch touch_of(const RollingProfile *p, double side, const double q[SIX], const Pose *at,
                      const Between *in, Press *press)
{
    const Known roll = known_of(at->roll, side * at->roll.at, side);
    const Known half_square = known_of(roll, roll.at * roll.at / 2, roll.at);
    const Known yaw = {q[YAW], {[YAW] = 1}};
    const Known half_yaw = known_of(yaw, yaw.at * yaw.at / 2, yaw.at);
    Known z[3];
    heights(in, z);
    const Known lever = column_of(in, PROFILE_LEVER), bow = column_of(in, PROFILE_BOW);
    const Known travel = column_of(in, PROFILE_TRAVEL), sinking = column_of(in, PROFILE_SINKING);
    /* The height goes on with a roll as a parabola, whose derivatives are all that follows. */
    const Known more = known_sum(-1, known_product(roll, lever), 1, known_product(half_square, bow));
    const Known below = known_sum(1, known_sum(1, at->z, -1, z[0]), 1, more);
    const Known by_u = known_sum(-1, z[1], 1, known_sum(-slope_of(in, PROFILE_LEVER), roll,
                                                        slope_of(in, PROFILE_BOW), half_square));
    const Known by_roll = known_sum(-1, lever, 1, known_product(roll, bow));
    const double cosine = 1 / sqrt(1 + z[1].at * z[1].at);
    const Known down = known_of(z[1], cosine, -z[1].at * cosine * cosine * cosine);
    const Known down2 = known_product(down, down);
    const Known leaning = known_product(known_product(down2, z[1]), below);
    const Known bent = known_product(known_product(leaning, down), z[2]);
    const Known across = known_sum(
        1, known_sum(1, known_product(by_u, down), -1, bent), -slope_of(in, PROFILE_SINKING),
        half_yaw);
    press_by(at, known_sum(1, known_product(below, down), -1, known_product(sinking, half_yaw)),
             known_sum(side, across, 0, across), down,
             known_sum(side, known_product(by_roll, down), 0, down),
             known_sum(-1, known_product(sinking, yaw), 0, yaw), press);
    /* They touch where they would if they went apart along the normal. */
    const Known moved = known_product(roll, travel);
    const Known y = known_sum(1, column_of(in, PROFILE_Y), 1,
                              known_sum(1, moved, slope_of(in, PROFILE_Y), leaning));
    const Known depth = known_sum(1, column_of(in, PROFILE_Z), 1,
                                  known_sum(1, known_product(moved, z[1]),
                                            slope_of(in, PROFILE_Z), leaning));
    Touch t;
    const Known angle = known_of(by_u, atan(by_u.at), 1 / (1 + by_u.at * by_u.at));
    t.slope = known_sum(side, known_sum(1, angle, 1, roll), 0, roll);
    const Known out = known_sum(side, y, 0, y);
    t.y = out;
    t.y.at += side * p->half_distance;
    t.radius = depth;
    t.radius.at += p->reference;
    t.rail_y = known_sum(1, at->across, 1, known_sum(1, known_product(at->cos_roll, out), -1,
                                                     known_product(at->sin_roll, depth)));
    t.rail_z = known_sum(1, at->down, 1, known_sum(1, known_product(at->sin_roll, out), 1,
                                                   known_product(at->cos_roll, depth)));
    return t;
}

/* As `slip` of mechanics/contact/rolling.py. */
static void slide(const Touch *t, const Pose *at, double r0, const double q[SIX], Slip *slip)
{
    const Known yaw = {q[YAW], {[YAW] = 1}};
    Known alpha = t->slope; /* of the normal in the track's frame */
    alpha.at -= q[ROLL];
    alpha.by[ROLL] -= 1;
    const Known c = known_of(alpha, cos(alpha.at), -sin(alpha.at));
    const Known s = known_of(alpha, sin(alpha.at), cos(alpha.at));
    const double cosine = cos(t->slope.at), sine = sin(t->slope.at);
    const Known sin_slope = known_of(t->slope, sine, cosine);
    const Known cos_slope = known_of(t->slope, cosine, -sine);
    const Known tangent = known_of(t->slope, sine / cosine, 1 / (cosine * cosine));
    const Known secant = known_of(t->slope, 1 / cosine, sine / (cosine * cosine));
    const Known out = known_sum(1, known_product(at->cos_roll, t->y), -1,
                                known_product(at->sin_roll, t->radius));
    const Known behind = known_sum(1, t->y, -1, known_product(t->radius, tangent));
    const Known turned = known_product(known_product(yaw, t->radius), secant);
    const Known above = known_sum(1, known_product(sin_slope, t->y), 1,
                                  known_product(cos_slope, t->radius));
    slip->J[0][SPIN] = t->radius;
    slip->J[0][YAW] = known_sum(-1, out, 0, out);
    slip->J[1][Y] = c;
    slip->J[1][Z] = known_sum(-1, s, 0, s);
    slip->J[1][ROLL] = known_sum(-1, above, 0, above);
    slip->J[1][SPIN] = turned;
    slip->J[1][YAW] = known_sum(-1, known_product(c, known_product(behind, yaw)), 0, c);
    slip->J[1][RAIL_ROLL] = known_sum(1, known_product(c, t->rail_z), 1,
                                      known_product(s, t->rail_y));
    slip->J[2][SPIN] = sin_slope;
    slip->J[2][YAW] = c;
    slip->rolling[0] = known_sum(-1 / r0, t->radius, 1, known_constant(1));
    slip->rolling[1] = known_sum(-1 / r0, turned, 0, turned);
    slip->rolling[2] = known_sum(-1 / r0, sin_slope, 0, sin_slope);
}

static void patch_of(const RollingProfile *p, const Between *in, Patch *patch)
{
    const Known area = known_product(column_of(in, PROFILE_ALONG), column_of(in, PROFILE_ACROSS));
    const double root = sqrt(area.at), G = p->shear_modulus;
    const Known of[4] = {area, area, known_of(area, area.at * root, 1.5 * root),
                         known_product(area, area)};
    static const int column[4] = {PROFILE_C11, PROFILE_C22, PROFILE_C23, PROFILE_C33};
    patch->hertz = column_of(in, PROFILE_C);
    for (int j = CREEP_F11; j <= CREEP_F33; j++) {
        const Known f = known_product(column_of(in, column[j]), of[j]);
        patch->creep[j] = known_sum(G, f, 0, f);
    }
    patch->creep[CREEP_A] = column_of(in, PROFILE_ALONG);
    patch->creep[CREEP_B] = column_of(in, PROFILE_ACROSS);
}

int rolling_place_profile(const RollingProfile *p, double side, const double q[SIX], Press *press,
                          Slip *slip, Patch *patch)
{
    const Pose pose = pose_of(p, side, q);
    Between in;
    if (!between_rows(p, known_of(pose.y, side * pose.y.at, side), &in))
        return 0;
    memset(press, 0, sizeof *press);
    const Touch touch = touch_of(p, side, q, &pose, &in, press);
    if (press->overlap.at > 0) {
        slide(&touch, &pose, p->radius, q, slip);
        patch_of(p, &in, patch);
    }
    return 1;
}
