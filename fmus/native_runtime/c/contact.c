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

int solve_wheels(double A[WHEELS * WHEELS], double b[WHEELS])
{
    for (size_t k = 0; k < WHEELS; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < WHEELS; i++)
            if (fabs(A[i * WHEELS + k]) > fabs(A[best * WHEELS + k]))
                best = i;
        const double pivot = A[best * WHEELS + k];
        if (pivot == 0 || !isfinite(pivot))
            return 0;
        for (size_t j = k; j < WHEELS && best != k; j++) {
            const double swap = A[k * WHEELS + j];
            A[k * WHEELS + j] = A[best * WHEELS + j];
            A[best * WHEELS + j] = swap;
        }
        const double swap = b[k];
        b[k] = b[best];
        b[best] = swap;
        for (size_t i = k + 1; i < WHEELS; i++) {
            const double factor = A[i * WHEELS + k] / pivot;
            for (size_t j = k; j < WHEELS; j++)
                A[i * WHEELS + j] -= factor * A[k * WHEELS + j];
            b[i] -= factor * b[k];
        }
    }
    for (size_t k = WHEELS; k-- > 0;) {
        for (size_t j = k + 1; j < WHEELS; j++)
            b[k] -= A[k * WHEELS + j] * b[j];
        b[k] /= A[k * WHEELS + k];
    }
    return 1;
}

int contact_solve(const ContactLaw *law, const double G[WHEELS * WHEELS],
                  const double gap[WHEELS], double delta[WHEELS])
{
    memcpy(delta, gap, WHEELS * sizeof(double));
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        double A[WHEELS * WHEELS], change[WHEELS], force[WHEELS];
        double largest = 0, size = 0;
        for (size_t j = 0; j < WHEELS; j++)
            force[j] = contact_force(law, delta[j]);
        for (size_t k = 0; k < WHEELS; k++) {
            change[k] = delta[k] - gap[k];
            for (size_t j = 0; j < WHEELS; j++) {
                change[k] += G[k * WHEELS + j] * force[j];
                A[k * WHEELS + j] = (k == j) + G[k * WHEELS + j] * contact_stiffness(law, delta[j]);
            }
        }
        if (!solve_wheels(A, change))
            return 0;
        for (size_t k = 0; k < WHEELS; k++) {
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
