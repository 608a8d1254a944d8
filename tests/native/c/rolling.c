/* Reads a rolling law, the rows of a table of profiles (0: cones), what is about it and the table, then
   contacts: a side, motions, rates and speed of each; writes forces, and their derivatives by motions,
   by rates and by the speed. */
#include <stdio.h>
#include <stdlib.h>

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

static RollingProfile profile;

/* 0: there should be a table, and is none. */
static int read_profile(double rows)
{
    double about[5];
    double *table = malloc((size_t)rows * PROFILE_COLUMNS * sizeof(double));
    const RollingProfile found = {
        (size_t)rows, table, 0, 0, 0, 0, 0, 0, 0};
    profile = found;
    if (table == NULL || !read(5, about) || !read((size_t)rows * PROFILE_COLUMNS, table))
        return 0;
    profile.reference = about[0];
    profile.half_distance = about[1];
    profile.first = about[2];
    profile.step = about[3];
    profile.shear_modulus = about[4];
    return rolling_profile_ready(&profile);
}

int main(void)
{
    double n[18], rows, side, q[N], v[N], speed, force[N], alone[N], by_q[N][N], by_v[N][N];
    double by_speed[N];
    if (!read(18, n) || !read(1, &rows) || (rows > 0 && !read_profile(rows)))
        return 1;
    static Creep *const creeps[] = {creep_linear, creep_saturated, creep_fastsim};
    RollingLaw law = {NULL, n[0], n[1], n[2], n[3], n[4] != 0, n[5],
                      {n[6], n[7], n[8], n[9], n[10], n[11]}, n[12], creeps[(int)n[13]],
                      n[14], n[15], n[16], n[17]};
    if (rows > 0) {
        law.profile = &profile;
        law.radius = profile.radius;
        law.half_distance = profile.half_distance;
    }
    while (read(1, &side) && read(N, q) && read(N, v) && read(1, &speed)) {
        rolling_force(&law, speed, side, q, v, force, by_q, by_v);
        rolling_force(&law, speed, side, q, v, alone, NULL, NULL);
        rolling_by_speed(&law, speed, v, by_v, by_speed);
        for (size_t k = 0; k < N; k++)
            if (force[k] != alone[k] && force[k] == force[k])
                return 2;
        write(N, force);
        write(N * N, by_q[0]);
        write(N * N, by_v[0]);
        write(N, by_speed);
        printf("\n");
    }
    free((void *)profile.table);
    return 0;
}
