#include "exponential.h"

#include <math.h>
#include <string.h>

/* |z| below which the series beats the quotients: by 20 terms it is exact to rounding, and at 1
   cancellation in phi_3 costs half a digit. */
#define SERIES_BELOW 1.0
#define TERMS 20

/* Not <complex.h>: Microsoft's compiler has none of C99's, and wine's C library no cexp. */
typedef struct {
    double re, im;
} Complex;

/* (a - b) / z */
static Complex quotient(Complex a, double b, Complex z)
{
    const double size = z.re * z.re + z.im * z.im, re = a.re - b;
    const Complex q = {(re * z.re + a.im * z.im) / size, (a.im * z.re - re * z.im) / size};
    return q;
}

/* b + z a */
static Complex product(double b, Complex z, Complex a)
{
    const Complex p = {b + (z.re * a.re - z.im * a.im), z.re * a.im + z.im * a.re};
    return p;
}

/* phi_k(z) = sum z^j / (j + k)!, k = 1..3: Hochbruck & Ostermann (2010), Acta Numerica 19. */
static void phi_functions(Complex z, Complex phi[4])
{
    const double size = exp(z.re);
    phi[0].re = size * cos(z.im);
    phi[0].im = size * sin(z.im);
    if (z.re * z.re + z.im * z.im >= SERIES_BELOW * SERIES_BELOW) {
        phi[1] = quotient(phi[0], 1, z);
        phi[2] = quotient(phi[1], 1, z);
        phi[3] = quotient(phi[2], 0.5, z);
        return;
    }
    Complex sum = {1, 0};
    for (int j = TERMS; j > 0; j--) {
        const Complex part = {z.re / (j + 3), z.im / (j + 3)};
        sum = product(1, part, sum);
    }
    phi[3].re = sum.re / 6;
    phi[3].im = sum.im / 6;
    phi[2] = product(0.5, z, phi[3]);
    phi[1] = product(1, z, phi[2]);
}

void coefficients_make(Coefficients *c, const Model *model, double h)
{
    const size_t n = model->modes;
    const int held = model->contact_sign != 0;
    for (size_t r = 0; r < n; r++) {
        const Complex z = {model->pole.re[r] * h, model->pole.im[r] * h};
        Complex phi[4];
        phi_functions(z, phi);
        c->E[r] = phi[0].re;
        c->E[n + r] = phi[0].im;
        const Complex end = {held ? phi[1].re / 2 : phi[2].re, held ? phi[1].im / 2 : phi[2].im};
        c->P0[r] = h * (phi[1].re - end.re);
        c->P0[n + r] = h * (phi[1].im - end.im);
        c->P1[r] = h * end.re;
        c->P1[n + r] = h * end.im;
        c->Q[r] = 4 * h * (phi[2].re - 2 * phi[3].re);
        c->Q[n + r] = 4 * h * (phi[2].im - 2 * phi[3].im);
    }
    c->h = h;
    c->R0 = held ? h * h / 4 : h * h / 3;
    c->R1 = held ? h * h / 4 : h * h / 6;
}

/* Displacements and velocities of the rigid coordinates. */
static void add_rigid(const Model *m, double a, double b, const double *g, double *next)
{
    double *r = next + 2 * m->modes, *v = r + m->rigid;
    for (size_t j = 0; j < m->rigid; j++) {
        r[j] += a * g[2 * m->drives + j];
        v[j] += b * g[2 * m->drives + j];
    }
}

/* The rigid coordinates without forces. */
static void move_rigid(const Model *m, double h, const double *x, double *next)
{
    const double *r = x + 2 * m->modes, *v = r + m->rigid;
    double *next_r = next + 2 * m->modes, *next_v = next_r + m->rigid;
    for (size_t j = 0; j < m->rigid; j++) {
        next_r[j] = r[j] + h * v[j];
        next_v[j] = v[j];
    }
}

void step_free(const Body *body, const Coefficients *c, const double *x, const double *g0,
               double *next)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    for (size_t k = 0; k <= m->segments; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, im = n + to, in_im = m->drives + s->in;
        body->kernels->combine(s->size, c->E + to, c->E + im, x + to, x + im, c->P0 + to,
                               c->P0 + im, g0 + s->in, g0 + in_im, next + to, next + im);
    }
    move_rigid(m, c->h, x, next);
    add_rigid(m, c->R0, c->h / 2, g0, next);
}

void step_add_end(const Body *body, const Coefficients *c, const double *g1, double *next)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    for (size_t k = 0; k <= m->segments; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, im = n + to;
        body->kernels->add(s->size, c->P1 + to, c->P1 + im, g1 + s->in, g1 + m->drives + s->in,
                           next + to, next + im);
    }
    add_rigid(m, c->R1, c->h / 2, g1, next);
}

void step_add_bulge(const Body *body, const Coefficients *c, const double *q, double *next)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    for (size_t k = 0; k <= m->segments; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, im = n + to;
        body->kernels->add(s->size, c->Q + to, c->Q + im, q + s->in, q + m->drives + s->in,
                           next + to, next + im);
    }
    add_rigid(m, c->h * c->h / 3, 2 * c->h / 3, q, next);
}

void step_whole(const Body *body, const Coefficients *c, const double *x, const double *g0,
                const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    const double a = c->h * c->h / 3, b = 2 * c->h / 3;
    for (size_t k = 0; k <= m->segments; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in;
        body->kernels->advance(s->size, m->modes, m->drives, c->E + to, c->P0 + to, c->P1 + to,
                               c->Q + to, x + to, g0 + in, gm + in, g1 + in, next + to);
    }
    move_rigid(m, c->h, x, next);
    add_rigid(m, c->R0 - 0.5 * a, 0.5 * c->h - 0.5 * b, g0, next);
    add_rigid(m, c->R1 - 0.5 * a, 0.5 * c->h - 0.5 * b, g1, next);
    add_rigid(m, a, b, gm, next);
}
