#include "exponential.h"

#include <math.h>
#include <string.h>

/* |z| below which the series beats the quotients: by 20 terms it is exact to rounding, and at 1
   cancellation in phi_4 costs a digit. */
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

/* phi_k(z) = sum z^j / (j + k)!, k = 1..4: Hochbruck & Ostermann (2010), Acta Numerica 19. */
static void phi_functions(Complex z, Complex phi[PHIS])
{
    const double size = exp(z.re);
    phi[0].re = size * cos(z.im);
    phi[0].im = size * sin(z.im);
    if (z.re * z.re + z.im * z.im >= SERIES_BELOW * SERIES_BELOW) {
        phi[1] = quotient(phi[0], 1, z);
        phi[2] = quotient(phi[1], 1, z);
        phi[3] = quotient(phi[2], 0.5, z);
        phi[4] = quotient(phi[3], 1.0 / 6, z);
        return;
    }
    Complex sum = {1, 0};
    for (int j = TERMS; j > 0; j--) {
        const Complex part = {z.re / (j + 4), z.im / (j + 4)};
        sum = product(1, part, sum);
    }
    phi[4].re = sum.re / 24;
    phi[4].im = sum.im / 24;
    phi[3] = product(1.0 / 6, z, phi[4]);
    phi[2] = product(0.5, z, phi[3]);
    phi[1] = product(1, z, phi[2]);
}

void coefficients_make(Coefficients *c, const Model *model, double h)
{
    const size_t n = model->modes;
    for (size_t r = 0; r < n; r++) {
        const Complex z = {model->pole.re[r] * h, model->pole.im[r] * h};
        Complex phi[PHIS];
        phi_functions(z, phi);
        for (int k = 0; k < PHIS; k++) {
            c->phi[k][r] = phi[k].re;
            c->phi[k][n + r] = phi[k].im;
        }
    }
    c->h = h;
}

double rigid_weight(const Coefficients *c, int k)
{
    static const double FACTORIAL[] = {1, 1, 2, 6, 24, 120};
    return c->h * c->h / FACTORIAL[k + 1];
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

/* Rigid coordinates after a step: integrals of the parabola. */
static void rigid_along(const Model *m, double h, const double *x, const double *g0,
                        const double *gm, const double *g1, double *next)
{
    move_rigid(m, h, x, next);
    add_rigid(m, h * h / 6, h / 6, g0, next);
    add_rigid(m, h * h / 3, 2 * h / 3, gm, next);
    add_rigid(m, 0, h / 6, g1, next);
}

void step_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, const double *x,
                const double *g0, const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    double *const *phi = c->phi;
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in, pole = s->pole;
        const double *const p[PHIS] = {phi[0] + pole, phi[1] + pole, phi[2] + pole,
                                       phi[3] + pole};
        body->kernels->advance(s->size, m->modes, m->drives, c->h, p, x + to, g0 + in, gm + in,
                               g1 + in, next + to);
    }
}

void step_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
               const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    step_chunk(body, c, &m->chunk[m->chunks], x, g0, gm, g1, next);
    rigid_along(m, c->h, x, g0, gm, g1, next);
}

void step_along(const Body *body, const Coefficients *c, const double *x, const double *g0,
                const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->chunks; k++)
        step_chunk(body, c, &m->chunk[k], x, g0, gm, g1, next);
    step_rest(body, c, x, g0, gm, g1, next);
}

void average_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, const double *x,
                   const double *g0, const double *gm, const double *g1, double *next,
                   double *differs)
{
    const Model *m = body->model;
    double *const *phi = c->phi;
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in, pole = s->pole;
        const double *const p[PHIS] = {phi[0] + pole, phi[1] + pole, phi[2] + pole,
                                       phi[3] + pole, phi[4] + pole};
        body->kernels->advance_both(s->size, m->modes, m->drives, c->h, p, x + to, g0 + in,
                                    gm + in, g1 + in, next + to, differs + to);
    }
}

void average_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
                  const double *gm, const double *g1, double *next, double *differs)
{
    const Model *m = body->model;
    const double h = c->h;
    average_chunk(body, c, &m->chunk[m->chunks], x, g0, gm, g1, next, differs);
    rigid_along(m, h, x, g0, gm, g1, next);
    move_rigid(m, h / 2, x, differs);
    add_rigid(m, 3 * h * h / 40, 0, g0, differs);
    add_rigid(m, h * h / 10, 0, gm, differs);
    add_rigid(m, -h * h / 120, 0, g1, differs);
    for (size_t r = 2 * m->modes; r < m->states; r++)
        differs[r] -= (x[r] + next[r]) / 6;
}

void step_and_average(const Body *body, const Coefficients *c, const double *x, const double *g0,
                      const double *gm, const double *g1, double *next, double *differs)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->chunks; k++)
        average_chunk(body, c, &m->chunk[k], x, g0, gm, g1, next, differs);
    average_rest(body, c, x, g0, gm, g1, next, differs);
}

void step_add_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, int average,
                    const double *mean, const double *slope, double *next)
{
    const Model *m = body->model;
    double *const *phi = c->phi + average;
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in;
        body->kernels->add_line(s->size, m->modes, m->drives, c->h, phi[1] + s->pole,
                                phi[2] + s->pole, mean + in, slope + in, next + to);
    }
}

void step_add_rest(const Body *body, const Coefficients *c, int average, const double *mean,
                   const double *slope, double *next)
{
    const Model *m = body->model;
    const double first = rigid_weight(c, 1 + average), second = rigid_weight(c, 2 + average);
    step_add_chunk(body, c, &m->chunk[m->chunks], average, mean, slope, next);
    add_rigid(m, first, average ? 0 : c->h, mean, next);
    add_rigid(m, 2 * second - first, 0, slope, next);
}

void step_add(const Body *body, const Coefficients *c, int average, const double *mean,
              const double *slope, double *next)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->chunks; k++)
        step_add_chunk(body, c, &m->chunk[k], average, mean, slope, next);
    step_add_rest(body, c, average, mean, slope, next);
}
