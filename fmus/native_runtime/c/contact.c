#include "contact.h"

#include <math.h>
#include <string.h>

enum { MAX_ITERATIONS = 50 }; /* Newton takes 3 or 4 */
static const double RELATIVE_TOLERANCE = 1e-12; /* four digits above rounding */

double contact_force(const ContactLaw *law, double compression)
{
    if (!law->nonlinear)
        return law->k_H * compression;
    return compression > 0 ? law->C * compression * sqrt(compression) : 0.0;
}

double contact_stiffness(const ContactLaw *law, double compression)
{
    if (!law->nonlinear)
        return law->k_H;
    return compression > 0 ? 1.5 * law->C * sqrt(compression) : 0.0;
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
            force[j] = contact_force(law, delta[j]);
            stiffness[j] = contact_stiffness(law, delta[j]);
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
