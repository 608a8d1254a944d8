/* Forces of a wheel that rolls on a rail, from where they touch and how they slide. */
#include "rolling_parts.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

/* Forces that do work on the coordinates, those of a contact that is closed; and derivatives. */
typedef struct {
    double force[SIX], by_q[SIX][SIX], by_v[SIX][SIX];
} Forces;

/* Creepages and their derivatives by the coordinates; and by their rates, a row each. */
static void creepages(const Slip *slip, const double v[SIX], double speed, Known creepage[3],
                      double by_rates[3][SIX])
{
    const double slow = 1 / speed; /* a division takes as long as all else of a coordinate */
    memset(by_rates, 0, 3 * SIX * sizeof(double));
    for (int i = 0; i < 3; i++) {
        creepage[i] = slip->rolling[i];
        for (int k = 0; k < SLIPS[i]; k++) {
            const int a = SLIPPING[i][k];
            const Known *J = &slip->J[i][a];
            const double part = v[a] * slow;
            by_rates[i][a] = J->at * slow;
            creepage[i].at += J->at * part;
            for (int b = 0; b < FIVE; b++)
                creepage[i].by[b] += J->by[b] * part;
        }
    }
}

static void add_normal(const Press *press, const Known *N, Forces *f)
{
    for (int a = 0; a < FIVE; a++) {
        f->force[a] -= N->at * press->overlap.by[a];
        for (int b = 0; b < FIVE; b++)
            f->by_q[a][b] -= press->overlap.by[a] * N->by[b] + N->at * press->second[a][b];
    }
}

/* `patch` is NULL where what the contact does is the same wherever it is. */
static void add_creep(const RollingLaw *law, double speed, const Patch *patch, const Slip *slip,
                      const Known *N, const double v[SIX], int asked, Forces *f)
{
    Known creepage[3];
    double force[3], by[3][CREEP_BY_ALL], by_rates[3][SIX], own[CREEP_NUMBERS];
    creepages(slip, v, speed, creepage, by_rates);
    const double at[3] = {creepage[0].at, creepage[1].at, creepage[2].at};
    for (int j = 0; patch != NULL && j < CREEP_NUMBERS; j++)
        own[j] = patch->creep[j].at;
    law->creep(law->friction, patch == NULL ? law->patch : own, N->at, at, asked, force,
               by);
    for (int i = 0; i < 3; i++) {
        double by_q[FIVE], by_v[SIX]; /* of this part of the force */
        for (int b = 0; b < FIVE; b++)
            by_q[b] = by[i][0] * N->by[b] + by[i][1] * creepage[0].by[b] +
                      by[i][2] * creepage[1].by[b] + by[i][3] * creepage[2].by[b];
        for (int j = 0; patch != NULL && j < CREEP_NUMBERS; j++)
            for (int b = 0; b < FIVE; b++)
                by_q[b] += by[i][CREEP_BY + j] * patch->creep[j].by[b];
        for (int b = 0; b < SIX; b++)
            by_v[b] = by[i][1] * by_rates[0][b] + by[i][2] * by_rates[1][b] +
                      by[i][3] * by_rates[2][b];
        for (int k = 0; k < SLIPS[i]; k++) {
            const int a = SLIPPING[i][k];
            const Known *J = &slip->J[i][a];
            f->force[a] += J->at * force[i];
            for (int b = 0; b < FIVE; b++)
                f->by_q[a][b] += J->by[b] * force[i] + J->at * by_q[b];
            for (int b = 0; b < SIX; b++)
                f->by_v[a][b] += J->at * by_v[b];
        }
    }
}

/* N = C closed^1.5 */
static Known normal_force(Known C, Known closed)
{
    const double root = sqrt(closed.at);
    return known_product(C, known_of(closed, closed.at * root, 1.5 * root));
}

/* Without numbers where the wheel is beyond the table of its profile. */
static void nowhere(Forces *f)
{
    for (int a = 0; a < SIX; a++)
        f->force[a] = NAN;
}

static void add_contact(const RollingLaw *law, double speed, double side, const double q[SIX],
                        const double v[SIX], int asked, Forces *f)
{
    Press press;
    Slip slip;
    Patch own, *patch = NULL;
    Known hertz = known_constant(law->hertz);
    if (law->profile == NULL)
        rolling_place(law, side, q, &press, &slip);
    else if (rolling_place_profile(law->profile, side, q, &press, &slip, &own)) {
        patch = &own;
        hertz = own.hertz;
    } else {
        nowhere(f);
        return;
    }
    if (!(press.overlap.at > 0))
        return;
    const Known N = normal_force(hertz, press.overlap);
    add_normal(&press, &N, f);
    add_creep(law, speed, patch, &slip, &N, v, asked, f);
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

/* Half the moments of the axle that turns by -speed/r0, as a gyroscope; closed or not. */
static void add_turning(const RollingLaw *law, double speed, const double v[SIX], Forces *f)
{
    const double momentum = 0.5 * law->axle_inertia * speed / law->radius;
    f->force[ROLL] -= momentum * v[YAW];
    f->force[YAW] += momentum * v[ROLL];
    f->by_v[ROLL][YAW] -= momentum;
    f->by_v[YAW][ROLL] += momentum;
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

/* What does work on the coordinates, as what does work at the ports; `n` numbers of each. */
static void to_ports(const RollingLaw *law, double side, size_t n, const double *f,
                     double *at_ports)
{
    const double middle = side * law->half_distance, r0 = law->radius, by_r0 = 1 / r0;
    const double *y = f + Y * n, *z = f + Z * n, *roll = f + ROLL * n, *spin = f + SPIN * n;
    const double *yaw = f + YAW * n, *rail_roll = f + RAIL_ROLL * n;
    for (size_t k = 0; k < n; k++) {
        at_ports[k] = z[k];
        at_ports[n + k] = y[k];
        at_ports[2 * n + k] = roll[k] + r0 * y[k] - middle * z[k];
        at_ports[3 * n + k] = spin[k] * by_r0;
        at_ports[4 * n + k] = yaw[k] + middle * (spin[k] * by_r0);
        at_ports[5 * n + k] = -z[k];
        at_ports[6 * n + k] = -y[k];
        at_ports[7 * n + k] = rail_roll[k];
    }
    for (size_t k = 0; k < ROLLING_WHEEL * n; k++) /* what the wheel does to the rail */
        at_ports[k] = -at_ports[k];
}

static void matrix_to_ports(const RollingLaw *law, double side, double f[SIX][SIX],
                            double at_ports[ROLLING_MOTIONS][ROLLING_MOTIONS])
{
    double half[SIX][ROLLING_MOTIONS];
    for (int a = 0; a < SIX; a++) {
        to_ports(law, side, 1, f[a], half[a]);
        for (int j = 0; j < ROLLING_WHEEL; j++) /* a motion, not a force */
            half[a][j] = -half[a][j];
    }
    to_ports(law, side, ROLLING_MOTIONS, half[0], at_ports[0]);
}

void rolling_force(const RollingLaw *law, double speed, double side,
                   const double q[ROLLING_MOTIONS], const double v[ROLLING_MOTIONS],
                   double force[ROLLING_MOTIONS], double by_q[ROLLING_MOTIONS][ROLLING_MOTIONS],
                   double by_v[ROLLING_MOTIONS][ROLLING_MOTIONS])
{
    double six[SIX], rates[SIX];
    Forces f;
    memset(&f, 0, sizeof f);
    coordinates_of(law, side, q, six);
    coordinates_of(law, side, v, rates);
    add_contact(law, speed, side, six, rates, by_q != NULL || by_v != NULL, &f);
    add_flange(law, side, six, &f);
    add_turning(law, speed, rates, &f);
    to_ports(law, side, 1, f.force, force);
    if (by_q != NULL)
        matrix_to_ports(law, side, f.by_q, by_q);
    if (by_v != NULL)
        matrix_to_ports(law, side, f.by_v, by_v);
}

/* Creep knows rates over the speed, v / V; what an axle's momentum makes of them grows with it: by
   rates these are all but that, and that, which by the speed have opposite signs. */
void rolling_by_speed(const RollingLaw *law, double speed, const double v[ROLLING_MOTIONS],
                      const double *by_v, double by_speed[ROLLING_MOTIONS])
{
    const double momentum = 0.5 * law->axle_inertia * speed / law->radius, slow = 1 / speed;
    for (int i = 0; i < ROLLING_MOTIONS; i++) {
        by_speed[i] = 0;
        for (int j = 0; j < ROLLING_MOTIONS; j++)
            by_speed[i] -= by_v[i * ROLLING_MOTIONS + j] * v[j];
    }
    by_speed[2] += 2 * momentum * v[4]; /* about the forward axis, by the yaw, and the reverse */
    by_speed[4] -= 2 * momentum * v[2];
    for (int i = 0; i < ROLLING_MOTIONS; i++)
        by_speed[i] *= slow;
}
