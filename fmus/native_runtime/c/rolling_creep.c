/* Creep: Kalker's linear theory, and what friction leaves of it.

   Shen, Z. Y., Hedrick, J. K. & Elkins, J. A. (1983), A comparison of alternative creep force models
   for rail vehicle dynamic analysis, Vehicle System Dynamics 12, 79-83. */
#include "rolling.h"

#include <math.h>

static const double WHOLE = 3;       /* linear force over friction's where all of a contact slides */
static const double NO_LOAD = 1e-3;  /* N: friction is not less; avoids a division by nothing */

void creep_linear(double friction, const double c[CREEP_NUMBERS], double N, const double x[3],
                  int asked, double force[3], double by[3][CREEP_BY_ALL])
{
    (void)friction, (void)asked; /* derivatives take less than to ask whether they are needed */
    const double root = cbrt(N), square = root * root, more = N * root;
    const double f11 = c[CREEP_F11] * square, f22 = c[CREEP_F22] * square;
    const double f23 = c[CREEP_F23] * N, f33 = c[CREEP_F33] * more;
    const double found[3] = {-f11 * x[0], -f22 * x[1] - f23 * x[2], f23 * x[1] - f33 * x[2]};
    const double slope[3][CREEP_BY_ALL] = {
        {-2 * f11 * x[0] / (3 * N), -f11, 0, 0, -square * x[0], 0, 0, 0},
        {(-2 * f22 * x[1] / 3 - f23 * x[2]) / N, 0, -f22, -f23, 0, -square * x[1], -N * x[2], 0},
        {(f23 * x[1] - 4 * f33 * x[2] / 3) / N, 0, f23, -f33, 0, 0, N * x[1], -more * x[2]},
    };
    for (int i = 0; i < 3; i++) {
        force[i] = found[i];
        for (int j = 0; j < CREEP_BY_ALL; j++)
            by[i][j] = slope[i][j];
    }
}

/* All three are taken down by what is left of the resultant along and across. */
static void saturate(double friction, double N, double force[3], double by[3][CREEP_BY_ALL])
{
    const double bound = friction * (N > NO_LOAD ? N : NO_LOAD);
    const double resultant = sqrt(force[0] * force[0] + force[1] * force[1]);
    const double ratio = resultant / bound;
    const int slides = ratio >= WHOLE;
    const double share = slides ? 1 / ratio : 1 - ratio / 3 + ratio * ratio / 27;
    const double slope = slides ? -1 / (ratio * ratio) : 2 * ratio / 27 - 1.0 / 3;
    double change[CREEP_BY_ALL]; /* of the share */
    for (int j = 0; j < CREEP_BY_ALL; j++)
        change[j] = resultant > 0 ? slope * (force[0] * by[0][j] + force[1] * by[1][j]) /
                                        (resultant * bound)
                                  : 0;
    if (N > NO_LOAD)
        change[0] -= slope * ratio / N;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < CREEP_BY_ALL; j++)
            by[i][j] = share * by[i][j] + force[i] * change[j];
        force[i] *= share;
    }
}

void creep_saturated(double friction, const double c[CREEP_NUMBERS], double N,
                     const double creepage[3], int asked, double force[3],
                     double by[3][CREEP_BY_ALL])
{
    creep_linear(friction, c, N, creepage, asked, force, by);
    saturate(friction, N, force, by);
}
