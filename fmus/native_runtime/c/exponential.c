#include "exponential.h"

#include <complex.h>
#include <math.h>
#include <string.h>

/* |z| below which the series beats the quotients: by 20 terms it is exact to rounding, and at 1
   cancellation in phi_3 costs half a digit. */
#define SERIES_BELOW 1.0
#define TERMS 20

/* phi_k(z) = sum z^j / (j + k)!, k = 1..3: Hochbruck & Ostermann (2010), Acta Numerica 19. */
static void phi_functions(double complex z, double complex phi[4])
{
    phi[0] = cexp(z);
    if (cabs(z) >= SERIES_BELOW) {
        phi[1] = (phi[0] - 1) / z;
        phi[2] = (phi[1] - 1) / z;
        phi[3] = (phi[2] - 0.5) / z;
        return;
    }
    double complex sum = 1;
    for (int j = TERMS; j > 0; j--)
        sum = 1 + z / (j + 3) * sum;
    phi[3] = sum / 6;
    phi[2] = 0.5 + z * phi[3];
    phi[1] = 1 + z * phi[2];
}

void coefficients_make(Coefficients *c, const Model *model, double h)
{
    const size_t n = model->modes;
    for (size_t r = 0; r < n; r++) {
        double complex phi[4];
        phi_functions((model->pole.re[r] + model->pole.im[r] * I) * h, phi);
        const double complex P0 = h * (phi[1] - phi[2]), P1 = h * phi[2];
        const double complex Q = 4 * h * (phi[2] - 2 * phi[3]);
        c->E[r] = creal(phi[0]);
        c->E[n + r] = cimag(phi[0]);
        c->P0[r] = creal(P0);
        c->P0[n + r] = cimag(P0);
        c->P1[r] = creal(P1);
        c->P1[n + r] = cimag(P1);
        c->Q[r] = creal(Q);
        c->Q[n + r] = cimag(Q);
    }
    c->h = h;
}

/* Displacements and velocities of the rigid coordinates. */
static void add_rigid(const Model *m, double a, double b, const double *g, double *next)
{
    double *r = next + 2 * m->modes, *v = r + m->rigid;
    for (size_t j = 0; j < m->rigid; j++) {
        r[j] += a * g[2 * m->modes + j];
        v[j] += b * g[2 * m->modes + j];
    }
}

void step_free(const Body *body, const Coefficients *c, const double *x, const double *g0,
               double *next)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    body->kernels->combine(n, c->E, c->E + n, x, x + n, c->P0, c->P0 + n, g0, g0 + n, next,
                           next + n);
    const double *r = x + 2 * n, *v = r + m->rigid;
    for (size_t j = 0; j < m->rigid; j++) {
        next[2 * n + j] = r[j] + c->h * v[j];
        next[2 * n + m->rigid + j] = v[j];
    }
    add_rigid(m, c->h * c->h / 3, c->h / 2, g0, next);
}

void step_add_end(const Body *body, const Coefficients *c, const double *g1, double *next)
{
    const size_t n = body->model->modes;
    body->kernels->add(n, c->P1, c->P1 + n, g1, g1 + n, next, next + n);
    add_rigid(body->model, c->h * c->h / 6, c->h / 2, g1, next);
}

void step_add_bulge(const Body *body, const Coefficients *c, const double *q, double *next)
{
    const size_t n = body->model->modes;
    body->kernels->add(n, c->Q, c->Q + n, q, q + n, next, next + n);
    add_rigid(body->model, c->h * c->h / 3, 2 * c->h / 3, q, next);
}
