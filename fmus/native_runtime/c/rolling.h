/* A wheel that rolls on a rail: forces of motions and of their rates, with exact derivatives. */
#ifndef RAILCOSIM_ROLLING_H
#define RAILCOSIM_ROLLING_H

/* Motions of a contact: z, y, roll, x, yaw of the wheel's datum, then z, y, roll of the rail's; and
   the forces of the wheel on the rail that do work on them (mechanics/contact/at_ports.py). */
enum { ROLLING_WHEEL = 5, ROLLING_MOTIONS = 8 };
#define ROLLING_REFERENCE 1e5 /* normal force at which creep coefficients are told, N */

typedef struct {
    double radius, half_distance; /* r0 of the wheel; b, of the datum from the middle, m */
    double conicity, head_radius; /* of the cone; R of the rail's head across, m */
    int textbook;                 /* springs are vertical, and gravity stiffness is put in by hand */
    double hertz;                 /* C of N = C delta^1.5 */
    double creep[4];              /* f11 and f22 over N^(2/3), f23 over N, f33 over N^(4/3) */
    double friction;              /* 0: creep without bound */
    double flange_stiffness, flange_clearance, flange_depth; /* N/m (0: none), m, m */
    double speed;                                            /* m/s, above 0 */
} RollingLaw;

/* Forces of the contact on a side (-1 left, 1 right), and (NULL: not asked for) their derivatives by
   motions and by rates. */
void rolling_force(const RollingLaw *law, double side, const double q[ROLLING_MOTIONS],
                   const double v[ROLLING_MOTIONS], double force[ROLLING_MOTIONS],
                   double by_q[ROLLING_MOTIONS][ROLLING_MOTIONS],
                   double by_v[ROLLING_MOTIONS][ROLLING_MOTIONS]);

#endif
