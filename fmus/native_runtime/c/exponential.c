#include "exponential.h"

#include <math.h>
#include <string.h>

/* |z| below which the series beats the quotients: by 20 terms it is exact to rounding, and at 1
   cancellation in phi_4 costs a digit. */
#define SERIES_BELOW 1.0
#define TERMS 20
enum { PHIS = 5 };

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

/* Effects of phi_k .. phi_k+3: the parabola is u1 + u2 theta + u3 theta^2 / 2, with u1 = g0,
   u2 = 4 gm - 3 g0 - g1 and u3 = 4 (g0 - 2 gm + g1), and moves s by h phi_k+j uj. */
static void set_effects(const Effects *e, size_t r, size_t n, double h, const Complex phi[4])
{
    const Complex p1 = phi[1], p2 = phi[2], p3 = phi[3];
    e->own[r] = phi[0].re;
    e->own[n + r] = phi[0].im;
    e->by[0][r] = h * (p1.re - 3 * p2.re + 4 * p3.re);
    e->by[0][n + r] = h * (p1.im - 3 * p2.im + 4 * p3.im);
    e->by[1][r] = 4 * h * (p2.re - 2 * p3.re);
    e->by[1][n + r] = 4 * h * (p2.im - 2 * p3.im);
    e->by[2][r] = h * (4 * p3.re - p2.re);
    e->by[2][n + r] = h * (4 * p3.im - p2.im);
}

void coefficients_make(Coefficients *c, const Model *model, double h)
{
    const size_t n = model->modes;
    for (size_t r = 0; r < n; r++) {
        const Complex z = {model->pole.re[r] * h, model->pole.im[r] * h};
        Complex phi[PHIS];
        phi_functions(z, phi);
        set_effects(&c->end, r, n, h, phi);
        if (model->contact_sign != 0)
            set_effects(&c->average, r, n, h, phi + 1);
    }
    c->h = h;
}

/* The same with h^2 / (k + 1)! for h phi_k. */
void rigid_effects(double h, int average, double by[3])
{
    static const double PARTS[2][3] = {{20, 40, 0}, {9, 12, -1}};
    for (int k = 0; k < 3; k++)
        by[k] = h * h * PARTS[average][k] / 120;
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

/* Rigid coordinates after a step, or on average, of whose velocities nothing is said. */
static void rigid_along(const Model *m, double h, int average, const double *x, const double *g0,
                        const double *gm, const double *g1, double *next)
{
    double by[3];
    rigid_effects(h, average, by);
    move_rigid(m, average ? h / 2 : h, x, next);
    add_rigid(m, by[0], average ? 0 : h / 6, g0, next);
    add_rigid(m, by[1], average ? 0 : 2 * h / 3, gm, next);
    add_rigid(m, by[2], average ? 0 : h / 6, g1, next);
}

/* Effects on a segment. */
typedef struct {
    const double *p[4];
} OnSegment;

static OnSegment on_segment(const Effects *e, const Segment *s)
{
    const OnSegment on = {{e->own + s->pole, e->by[0] + s->pole, e->by[1] + s->pole,
                           e->by[2] + s->pole}};
    return on;
}

void step_chunk(const Body *body, const Coefficients *c, const Chunk *chunk, const double *x,
                const double *g0, const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in;
        const OnSegment end = on_segment(&c->end, s);
        body->kernels->advance(s->size, m->modes, m->drives, end.p, x + to, g0 + in, gm + in,
                               g1 + in, next + to);
    }
}

void step_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
               const double *gm, const double *g1, double *next)
{
    const Model *m = body->model;
    step_chunk(body, c, &m->chunk[m->chunks], x, g0, gm, g1, next);
    rigid_along(m, c->h, 0, x, g0, gm, g1, next);
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
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const size_t to = s->to, in = s->in;
        const OnSegment end = on_segment(&c->end, s), average = on_segment(&c->average, s);
        body->kernels->advance_both(s->size, m->modes, m->drives, end.p, average.p, x + to,
                                    g0 + in, gm + in, g1 + in, next + to, differs + to);
    }
}

void average_rest(const Body *body, const Coefficients *c, const double *x, const double *g0,
                  const double *gm, const double *g1, double *next, double *differs)
{
    const Model *m = body->model;
    average_chunk(body, c, &m->chunk[m->chunks], x, g0, gm, g1, next, differs);
    rigid_along(m, c->h, 0, x, g0, gm, g1, next);
    rigid_along(m, c->h, 1, x, g0, gm, g1, differs);
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
    for (size_t k = chunk->first; k < chunk->end; k++) {
        const Segment *s = &m->segment[k];
        const OnSegment on = on_segment(average ? &c->average : &c->end, s);
        body->kernels->add_line(s->size, m->modes, m->drives, on.p + 1, mean + s->in,
                                slope + s->in, next + s->to);
    }
}

void step_add_rest(const Body *body, const Coefficients *c, int average, const double *mean,
                   const double *slope, double *next)
{
    const Model *m = body->model;
    double by[3];
    rigid_effects(c->h, average, by);
    step_add_chunk(body, c, &m->chunk[m->chunks], average, mean, slope, next);
    add_rigid(m, by[0] + by[1] + by[2], average ? 0 : c->h, mean, next);
    add_rigid(m, by[2] - by[0], 0, slope, next);
}

void step_add(const Body *body, const Coefficients *c, int average, const double *mean,
              const double *slope, double *next)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->chunks; k++)
        step_add_chunk(body, c, &m->chunk[k], average, mean, slope, next);
    step_add_rest(body, c, average, mean, slope, next);
}
