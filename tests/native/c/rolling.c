/* Reads a rolling law, then contacts: a side, motions and rates of each; writes forces, and their
   derivatives by motions and by rates. */
#include <stdio.h>

#include "rolling.h"

enum { N = ROLLING_MOTIONS };

static int read(size_t n, double *numbers)
{
    for (size_t k = 0; k < n; k++)
        if (scanf("%lf", &numbers[k]) != 1)
            return 0;
    return 1;
}

static void write(size_t n, const double *numbers)
{
    for (size_t k = 0; k < n; k++)
        printf("%.17g ", numbers[k]);
}

int main(void)
{
    double n[15], side, q[N], v[N], force[N], alone[N], by_q[N][N], by_v[N][N];
    if (!read(15, n))
        return 1;
    const RollingLaw law = {n[0], n[1], n[2], n[3], n[4] != 0, n[5], {n[6], n[7], n[8], n[9]},
                            n[10], n[11], n[12], n[13], n[14]};
    while (read(1, &side) && read(N, q) && read(N, v)) {
        rolling_force(&law, side, q, v, force, by_q, by_v);
        rolling_force(&law, side, q, v, alone, NULL, NULL);
        for (size_t k = 0; k < N; k++)
            if (force[k] != alone[k])
                return 2;
        write(N, force);
        write(N * N, by_q[0]);
        write(N * N, by_v[0]);
        printf("\n");
    }
    return 0;
}
