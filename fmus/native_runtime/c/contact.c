#include "contact.h"

#include <math.h>
#include <string.h>

enum { MAX_ITERATIONS = 50 }; /* Newton takes 3 or 4 */
static const double RELATIVE_TOLERANCE = 1e-12; /* four digits above rounding */

double contact_force(const ContactLaw *law, size_t k, double compression)
{
    if (!law->nonlinear)
        return law->number[k] * compression;
    return compression > 0 ? law->number[k] * compression * sqrt(compression) : 0.0;
}

double contact_stiffness(const ContactLaw *law, size_t k, double compression)
{
    if (!law->nonlinear)
        return law->number[k];
    return compression > 0 ? 1.5 * law->number[k] * sqrt(compression) : 0.0;
}

/* Nodes (0..1) and weights of Gauss's rule: exact for a line times a parabola. */
static const double NODE[3] = {0.11270166537925831, 0.5, 0.88729833462074169};
static const double WEIGHT[3] = {5.0 / 18, 8.0 / 18, 5.0 / 18};

void contact_over_step(const ContactLaw *law, size_t k, const double d[3], double force[2],
                       double tangent[2][3])
{
    memset(force, 0, 2 * sizeof(double));
    memset(tangent, 0, 6 * sizeof(double));
    for (int j = 0; j < 3; j++) {
        const double theta = NODE[j], bow = 6 * theta * (theta - 1) + 1, odd = 2 * theta - 1;
        /* Of the parabola with the ends d[0] and d[2], and d[1] on average. */
        const double by[3] = {-0.5 * odd + 0.5 * bow, 1 - bow, 0.5 * odd + 0.5 * bow};
        const double compression = by[0] * d[0] + by[1] * d[1] + by[2] * d[2];
        const double f = WEIGHT[j] * contact_force(law, k, compression);
        const double slope = WEIGHT[j] * contact_stiffness(law, k, compression);
        force[0] += f;
        force[1] += 3 * odd * f;
        for (int i = 0; i < 3; i++) {
            tangent[0][i] += slope * by[i];
            tangent[1][i] += 3 * odd * slope * by[i];
        }
    }
}

int solve_linear(size_t n, double *A, double *b)
{
    for (size_t k = 0; k < n; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(A[i * n + k]) > fabs(A[best * n + k]))
                best = i;
        const double pivot = A[best * n + k];
        if (pivot == 0 || !isfinite(pivot))
            return 0;
        for (size_t j = k; j < n && best != k; j++) {
            const double swap = A[k * n + j];
            A[k * n + j] = A[best * n + j];
            A[best * n + j] = swap;
        }
        const double swap = b[k];
        b[k] = b[best];
        b[best] = swap;
        for (size_t i = k + 1; i < n; i++) {
            const double factor = A[i * n + k] / pivot;
            for (size_t j = k; j < n; j++)
                A[i * n + j] -= factor * A[k * n + j];
            b[i] -= factor * b[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; j++)
            b[k] -= A[k * n + j] * b[j];
        b[k] /= A[k * n + k];
    }
    return 1;
}

int contact_solve(const ContactLaw *law, size_t n, const double *G, const double *gap,
                  double *delta, double *work)
{
    double *A = work, *change = A + n * n, *force = change + n, *stiffness = force + n;
    memcpy(delta, gap, n * sizeof(double));
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        double largest = 0, size = 0;
        for (size_t j = 0; j < n; j++) {
            force[j] = contact_force(law, j, delta[j]);
            stiffness[j] = contact_stiffness(law, j, delta[j]);
        }
        for (size_t k = 0; k < n; k++) {
            change[k] = delta[k] - gap[k];
            for (size_t j = 0; j < n; j++) {
                change[k] += G[k * n + j] * force[j];
                A[k * n + j] = (k == j) + G[k * n + j] * stiffness[j];
            }
        }
        if (!solve_linear(n, A, change))
            return 0;
        for (size_t k = 0; k < n; k++) {
            delta[k] -= change[k];
            size = fmax(size, fabs(change[k]));
            largest = fmax(largest, fabs(delta[k]));
            if (!isfinite(delta[k]))
                return 0;
        }
        if (size <= RELATIVE_TOLERANCE * largest)
            return 1;
    }
    return 0;
}

/* Compressions on average and at the end under forces: those without, and G. */
static void compress(size_t n, const double *G, const double *free, const double *force,
                     double *compression)
{
    const size_t pairs = n * n;
    for (size_t k = 0; k < 2 * n; k++)
        compression[k] = free[k];
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++) {
            const double *at = G + k * n + j;
            compression[k] += at[0] * force[j] + at[pairs] * force[n + j];
            compression[n + k] += at[2 * pairs] * force[j] + at[3 * pairs] * force[n + j];
        }
}

/* A = 1 - tangent G, for forces [means, slopes]. */
static void soften(size_t n, const double *G, size_t k, double tangent[2][3], double *A)
{
    const size_t pairs = n * n;
    for (size_t part = 0; part < 2; part++) {
        double *row = A + (part * n + k) * 2 * n;
        const double average = tangent[part][1], end = tangent[part][2];
        for (size_t j = 0; j < n; j++) {
            const double *at = G + k * n + j;
            row[j] = -(average * at[0] + end * at[2 * pairs]);
            row[n + j] = -(average * at[pairs] + end * at[3 * pairs]);
        }
        row[part * n + k] += 1;
    }
}

int contact_change(const ContactLaw *law, size_t n, const double *G, const double *begin,
                   const double *compression, const double *dbegin, const double *dfree,
                   double *dforce, double *work)
{
    for (size_t k = 0; k < n; k++) {
        const double d[3] = {begin[k], compression[k], compression[n + k]};
        double force[2], tangent[2][3];
        contact_over_step(law, k, d, force, tangent);
        soften(n, G, k, tangent, work);
        for (size_t part = 0; part < 2; part++)
            dforce[part * n + k] = tangent[part][0] * dbegin[k] + tangent[part][1] * dfree[k] +
                                   tangent[part][2] * dfree[n + k];
    }
    return solve_linear(2 * n, work, dforce);
}

int contact_balance(const ContactLaw *law, size_t n, const double *G, const double *begin,
                    const double *free, double *force, double *compression, double *work)
{
    double *change = work + 4 * n * n;
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        double largest = 0, size = 0;
        compress(n, G, free, force, compression);
        for (size_t k = 0; k < n; k++) {
            const double d[3] = {begin[k], compression[k], compression[n + k]};
            double found[2], tangent[2][3];
            contact_over_step(law, k, d, found, tangent);
            soften(n, G, k, tangent, work);
            change[k] = force[k] - found[0];
            change[n + k] = force[n + k] - found[1];
        }
        if (!solve_linear(2 * n, work, change))
            return 0;
        for (size_t k = 0; k < 2 * n; k++) {
            force[k] -= change[k];
            size = fmax(size, fabs(change[k]));
            largest = fmax(largest, fabs(force[k]));
            if (!isfinite(force[k]))
                return 0;
        }
        if (size <= RELATIVE_TOLERANCE * largest) {
            compress(n, G, free, force, compression);
            return 1;
        }
    }
    return 0;
}
