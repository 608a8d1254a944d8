/* Creep by Kalker's simplified theory, with derivatives (mechanics/contact/fastsim.py).

   Kalker, J. J. (1982), A fast algorithm for the simplified theory of rolling contact, Vehicle System
   Dynamics 11, 1-13.

   With lengths over the semi-axes, and tractions over the greatest bound, four numbers decide what a
   patch does: how much it is strained along and across, and by the spin along and across. */
#include "rolling_parts.h"

#include <math.h>
#include <string.h>

enum { ALONG, ACROSS, SPIN_ALONG, SPIN_ACROSS, STRAINS };
enum { SLICES = 40, STRIPS = 20 }; /* those of the Python law */

static const double PI = 3.14159265358979323846;
static const double NO_LOAD = 1e-3; /* N: a contact that presses less has no creep */

/* Of every strip: half its length, that squared, where it is across, and how much it weighs. */
typedef struct {
    double half[STRIPS], square[STRIPS], place[STRIPS], weight[STRIPS];
} Strips;

/* Tractions of all strips, or sums of them, along and across, and their derivatives by the strains. */
typedef struct {
    double x[STRIPS], y[STRIPS], x_by[STRAINS][STRIPS], y_by[STRAINS][STRIPS];
} Tractions;

/* Of a whole patch: forces along and across, what those across turn by their places along, and those
   along by theirs across; and derivatives. */
enum { FORCE_X, FORCE_Y, TURNED_Y, TURNED_X, SUMS };
typedef struct {
    double at[SUMS], by[SUMS][STRAINS];
} Whole;

/* Cosine and sine of an angle that a small one is added to. */
static void turn(double c, double s, double *cosine, double *sine)
{
    const double turned = *cosine * c - *sine * s;
    *sine = *sine * c + *cosine * s;
    *cosine = turned;
}

/* Equal parts of the angle, from one end of the ellipse to the other. */
static void lay_strips(Strips *strips)
{
    const double part = PI / STRIPS, c = cos(part), s = sin(part);
    double half = sin(part / 2), place = -cos(part / 2);
    for (int j = 0; j < STRIPS; j++) {
        strips->place[j] = place;
        strips->half[j] = half;
        strips->square[j] = half * half;
        strips->weight[j] = half * half * part;
        turn(c, s, &half, &place);
    }
}

/* Strained over a slice of length h about `middle`, both over half a strip, as if nothing slipped. */
static inline void strain(const Strips *strips, const double by[STRAINS], double h, double middle,
                   int asked, Tractions *p)
{
    for (int j = 0; j < STRIPS; j++) {
        const double way = h * strips->half[j], x = middle * strips->half[j];
        const double y = strips->place[j];
        p->x[j] -= way * (by[ALONG] - by[SPIN_ALONG] * y);
        p->y[j] -= way * (by[ACROSS] + by[SPIN_ACROSS] * x);
        if (!asked)
            continue;
        p->x_by[ALONG][j] -= way;
        p->x_by[SPIN_ALONG][j] += way * y;
        p->y_by[ACROSS][j] -= way;
        p->y_by[SPIN_ACROSS][j] -= way * x;
    }
}

/* Brought back to the bound, `share` of the greatest in the middle of each strip. */
static inline void slip(const Strips *strips, double share, int asked, Tractions *p)
{
    for (int j = 0; j < STRIPS; j++) {
        const double bound = share * strips->square[j], x = p->x[j], y = p->y[j];
        const double size2 = x * x + y * y;
        if (!(size2 > bound * bound))
            continue;
        const double back = bound / sqrt(size2), less = 1 / size2;
        for (int k = 0; asked && k < STRAINS; k++) {
            const double out = (x * p->x_by[k][j] + y * p->y_by[k][j]) * less;
            p->x_by[k][j] = back * (p->x_by[k][j] - x * out);
            p->y_by[k][j] = back * (p->y_by[k][j] - y * out);
        }
        p->x[j] = back * x;
        p->y[j] = back * y;
    }
}

/* What a slice adds to sums of tractions, and of those across times their places: see `Whole`. */
static inline void add(double weight, double at, int asked, const Tractions *p, Tractions *sum,
                Tractions *turned)
{
    const double more = weight * at;
    for (int j = 0; j < STRIPS; j++) {
        sum->x[j] += weight * p->x[j];
        sum->y[j] += weight * p->y[j];
        turned->y[j] += more * p->y[j];
        for (int k = 0; asked && k < STRAINS; k++) {
            sum->x_by[k][j] += weight * p->x_by[k][j];
            sum->y_by[k][j] += weight * p->y_by[k][j];
            turned->y_by[k][j] += more * p->y_by[k][j];
        }
    }
}

static double over(const double weight[STRIPS], const double f[STRIPS])
{
    double sum = 0;
    for (int j = 0; j < STRIPS; j++)
        sum += weight[j] * f[j];
    return sum;
}

static Whole add_strips(const Strips *strips, const Tractions *sum, const Tractions *turned)
{
    double across[STRIPS], along[STRIPS];
    Whole whole;
    for (int j = 0; j < STRIPS; j++) {
        across[j] = strips->weight[j] * strips->place[j];
        along[j] = strips->weight[j] * strips->half[j];
    }
    whole.at[FORCE_X] = over(strips->weight, sum->x);
    whole.at[FORCE_Y] = over(strips->weight, sum->y);
    whole.at[TURNED_Y] = over(along, turned->y);
    whole.at[TURNED_X] = over(across, sum->x);
    for (int k = 0; k < STRAINS; k++) {
        whole.by[FORCE_X][k] = over(strips->weight, sum->x_by[k]);
        whole.by[FORCE_Y][k] = over(strips->weight, sum->y_by[k]);
        whole.by[TURNED_Y][k] = over(along, turned->y_by[k]);
        whole.by[TURNED_X][k] = over(across, sum->x_by[k]);
    }
    return whole;
}

/* From the leading to the trailing edge, both without traction; slices are shorter towards them. */
static inline Whole roll_over(const double strains[STRAINS], int asked)
{
    const double c = cos(PI / SLICES), s = sin(PI / SLICES);
    double at = 1, sine = 0;
    Strips strips;
    Tractions p, sum, turned;
    lay_strips(&strips);
    memset(&p, 0, sizeof p);
    memset(&sum, 0, sizeof sum);
    memset(&turned, 0, sizeof turned);
    for (int k = 1; k < SLICES; k++) {
        const double before = at;
        turn(c, s, &at, &sine);
        strain(&strips, strains, before - at, (before + at) / 2, asked, &p);
        slip(&strips, sine * sine, asked, &p);
        add(sine * s, at, asked, &p, &sum, &turned); /* half of the slices before and behind */
    }
    return add_strips(&strips, &sum, &turned);
}

void creep_fastsim(double friction, const double c[CREEP_NUMBERS], double N,
                   const double creepage[3], int asked, double force[3],
                   double by[3][CREEP_BY_ALL])
{
    memset(by, 0, 3 * sizeof *by);
    memset(force, 0, 3 * sizeof *force);
    if (!(N > NO_LOAD))
        return;
    const double root = cbrt(N), narrow = c[CREEP_B] / c[CREEP_A];
    const double straining = 3 * PI / 16 / (friction * root), turning = 2 / friction;
    const double strains[STRAINS] = {
        straining * c[CREEP_F11] * creepage[0], straining * c[CREEP_F22] * creepage[1],
        turning * c[CREEP_F23] * creepage[2] * narrow, turning * c[CREEP_F23] * creepage[2]};
    const double spin = turning * creepage[2];
    /* By the force, the creepages and the numbers of the patch. */
    const double slope[STRAINS][CREEP_BY_ALL] = {
        [ALONG] = {-strains[ALONG] / (3 * N), straining * c[CREEP_F11],
                   [CREEP_BY + CREEP_F11] = straining * creepage[0]},
        [ACROSS] = {[0] = -strains[ACROSS] / (3 * N), [2] = straining * c[CREEP_F22],
                    [CREEP_BY + CREEP_F22] = straining * creepage[1]},
        [SPIN_ALONG] = {[3] = turning * c[CREEP_F23] * narrow,
                        [CREEP_BY + CREEP_F23] = spin * narrow,
                        [CREEP_BY + CREEP_A] = -strains[SPIN_ALONG] / c[CREEP_A],
                        [CREEP_BY + CREEP_B] = strains[SPIN_ACROSS] / c[CREEP_A]},
        [SPIN_ACROSS] = {[3] = turning * c[CREEP_F23], [CREEP_BY + CREEP_F23] = spin}};
    const Whole whole = asked ? roll_over(strains, 1) : roll_over(strains, 0);
    /* Tractions of the greatest bound over the rectangle of the semi-axes; and these. */
    const double size = 2 * friction * N / PI, a = c[CREEP_A] * root, b = c[CREEP_B] * root;
    const double part[3][SUMS] = {
        {[FORCE_X] = size}, {[FORCE_Y] = size}, {[TURNED_Y] = size * a, [TURNED_X] = -size * b}};
    const double power[3] = {1, 1, 4.0 / 3}; /* of the normal force in `part` */
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < SUMS; k++) {
            force[i] += part[i][k] * whole.at[k];
            for (int n = 0; n < STRAINS; n++)
                for (int j = 0; j < CREEP_BY_ALL; j++)
                    by[i][j] += part[i][k] * whole.by[k][n] * slope[n][j];
        }
        by[i][0] += power[i] * force[i] / N;
    }
    by[2][CREEP_BY + CREEP_A] += size * root * whole.at[TURNED_Y];
    by[2][CREEP_BY + CREEP_B] -= size * root * whole.at[TURNED_X];
}
