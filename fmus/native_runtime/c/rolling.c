/* Forces of a wheel that rolls on a rail, from where they touch and how they slide. */
#include "rolling_parts.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Forces that do work on the coordinates, those of a contact that is closed; and derivatives. */
typedef struct {
    double force[SIX], by_q[SIX][SIX], by_v[SIX][SIX];
} Forces;

/* Creepages and their derivatives by the coordinates. */
static void creepages(const Slip *slip, const double v[SIX], double speed, Known creepage[3])
{
    for (int i = 0; i < 3; i++) {
        creepage[i] = slip->rolling[i];
        for (int a = 0; a < SIX; a++) {
            const Known *J = &slip->J[i][a];
            creepage[i].at += J->at * (v[a] / speed);
            for (int b = 0; b < SIX; b++)
                creepage[i].by[b] += J->by[b] * (v[a] / speed);
        }
    }
}

static void add_normal(const Press *press, const Known *N, Forces *f)
{
    for (int a = 0; a < SIX; a++) {
        f->force[a] -= N->at * press->overlap.by[a];
        for (int b = 0; b < SIX; b++)
            f->by_q[a][b] -= press->overlap.by[a] * N->by[b] + N->at * press->second[a][b];
    }
}

static void add_creep(const RollingLaw *law, const Slip *slip, const Known *N, const double v[SIX],
                      Forces *f)
{
    Known creepage[3];
    creepages(slip, v, law->speed, creepage);
    const double at[3] = {creepage[0].at, creepage[1].at, creepage[2].at};
    double force[3], by[3][4];
    rolling_creep(law, N->at, at, force, by);
    for (int i = 0; i < 3; i++) {
        double by_q[SIX], by_v[SIX]; /* of this part of the force */
        for (int b = 0; b < SIX; b++) {
            by_q[b] = by[i][0] * N->by[b] + by[i][1] * creepage[0].by[b] +
                      by[i][2] * creepage[1].by[b] + by[i][3] * creepage[2].by[b];
            by_v[b] = (by[i][1] * slip->J[0][b].at + by[i][2] * slip->J[1][b].at +
                       by[i][3] * slip->J[2][b].at) /
                      law->speed;
        }
        for (int a = 0; a < SIX; a++) {
            const Known *J = &slip->J[i][a];
            f->force[a] += J->at * force[i];
            for (int b = 0; b < SIX; b++) {
                f->by_q[a][b] += J->by[b] * force[i] + J->at * by_q[b];
                f->by_v[a][b] += J->at * by_v[b];
            }
        }
    }
}

static void add_contact(const RollingLaw *law, double side, const double q[SIX],
                        const double v[SIX], Forces *f)
{
    Press press;
    Slip slip;
    rolling_place(law, side, q, &press, &slip);
    const double closed = press.overlap.at;
    if (!(closed > 0))
        return;
    Known N = {law->hertz * closed * sqrt(closed), {0}};
    for (int b = 0; b < SIX; b++)
        N.by[b] = 1.5 * law->hertz * sqrt(closed) * press.overlap.by[b];
    add_normal(&press, &N, f);
    add_creep(law, &slip, &N, v, f);
}

/* A stiff stop across, without friction. */
static void add_flange(const RollingLaw *law, double side, const double q[SIX], Forces *f)
{
    const double depth = law->flange_depth;
    const double way[SIX] = {
        [Y] = side, [ROLL] = -(law->radius + depth) * side, [RAIL_ROLL] = depth * side};
    const double gone = way[Y] * q[Y] + way[ROLL] * q[ROLL] + way[RAIL_ROLL] * q[RAIL_ROLL];
    if (!(gone > law->flange_clearance))
        return;
    for (int a = 0; a < SIX; a++) {
        f->force[a] -= law->flange_stiffness * (gone - law->flange_clearance) * way[a];
        for (int b = 0; b < SIX; b++)
            f->by_q[a][b] -= law->flange_stiffness * way[a] * way[b];
    }
}

/* The coordinates by motions at the ports. */
static void coordinates_of(const RollingLaw *law, double side,
                           const double at_ports[ROLLING_MOTIONS], double q[SIX])
{
    const double middle = side * law->half_distance;
    q[Y] = at_ports[1] + law->radius * at_ports[2] - at_ports[6];
    q[Z] = at_ports[0] - middle * at_ports[2] - at_ports[5];
    q[ROLL] = at_ports[2];
    q[SPIN] = (at_ports[3] + middle * at_ports[4]) / law->radius;
    q[YAW] = at_ports[4];
    q[RAIL_ROLL] = at_ports[7];
}

/* What does work on the coordinates, as what does work at the ports; numbers are `stride` apart. */
static void to_ports(const RollingLaw *law, double side, size_t stride, const double *f,
                     double *at_ports)
{
    const double middle = side * law->half_distance, r0 = law->radius;
    const double y = f[Y * stride], z = f[Z * stride], spin = f[SPIN * stride] / r0;
    at_ports[0] = z;
    at_ports[1 * stride] = y;
    at_ports[2 * stride] = f[ROLL * stride] + r0 * y - middle * z;
    at_ports[3 * stride] = spin;
    at_ports[4 * stride] = f[YAW * stride] + middle * spin;
    at_ports[5 * stride] = -z;
    at_ports[6 * stride] = -y;
    at_ports[7 * stride] = f[RAIL_ROLL * stride];
}

static void matrix_to_ports(const RollingLaw *law, double side, double f[SIX][SIX],
                            double at_ports[ROLLING_MOTIONS][ROLLING_MOTIONS])
{
    double half[SIX][ROLLING_MOTIONS];
    for (int a = 0; a < SIX; a++)
        to_ports(law, side, 1, f[a], half[a]);
    for (int j = 0; j < ROLLING_MOTIONS; j++)
        to_ports(law, side, ROLLING_MOTIONS, &half[0][j], &at_ports[0][j]);
    for (int i = 0; i < ROLLING_WHEEL; i++) /* numbers are what the wheel does to the rail */
        for (int j = 0; j < ROLLING_MOTIONS; j++)
            at_ports[i][j] = -at_ports[i][j];
}

void rolling_force(const RollingLaw *law, double side, const double q[ROLLING_MOTIONS],
                   const double v[ROLLING_MOTIONS], double force[ROLLING_MOTIONS],
                   double by_q[ROLLING_MOTIONS][ROLLING_MOTIONS],
                   double by_v[ROLLING_MOTIONS][ROLLING_MOTIONS])
{
    double six[SIX], rates[SIX];
    Forces f;
    memset(&f, 0, sizeof f);
    coordinates_of(law, side, q, six);
    coordinates_of(law, side, v, rates);
    add_contact(law, side, six, rates, &f);
    add_flange(law, side, six, &f);
    to_ports(law, side, 1, f.force, force);
    for (int i = 0; i < ROLLING_WHEEL; i++)
        force[i] = -force[i];
    if (by_q != NULL)
        matrix_to_ports(law, side, f.by_q, by_q);
    if (by_v != NULL)
        matrix_to_ports(law, side, f.by_v, by_v);
}
