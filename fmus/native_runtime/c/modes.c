/* What needs no shapes: a body at rest, its rates and accelerations, and coordinates of the multibody
   model from its modes. */
#include "body.h"

#include <string.h>

void body_at_rest(const Body *body, const double *g, double *x)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    memset(x, 0, m->states * sizeof(double));
    for (size_t j = 0; j <= m->segments; j++) {
        const Segment *s = &m->segment[j];
        body->kernels->add(s->size, body->flexibility + s->to, body->flexibility + n + s->to,
                           g + s->in, g + m->drives + s->in, x + s->to, x + n + s->to);
    }
}

double body_coordinate(const Body *body, size_t c, const double *x)
{
    const Model *m = body->model;
    const double *re = m->coordinate.re + c * m->ring, *im = m->coordinate.im + c * m->ring;
    const int odd = c >= m->even_coordinates;
    double sum = 0;
    for (size_t r = odd ? m->even : 0; r < (odd ? m->ring : m->even); r++)
        sum += re[r] * x[r] - im[r] * x[m->modes + r];
    for (size_t j = odd ? m->even_rigid : 0; j < (odd ? m->rigid : m->even_rigid); j++)
        sum += m->rigid_shape[c * m->rigid + j] * x[2 * m->modes + j];
    return sum;
}

double body_through(const Body *body, size_t c, const double *force)
{
    const Model *m = body->model;
    double sum = 0;
    body_split(m, force, &body->split[0]);
    const double *own = body->split[0].of[c >= m->even_coordinates];
    for (size_t k = 0; k < m->rows; k++)
        sum += m->through[c * m->rows + k] * own[k];
    return sum;
}

void body_rate(const Body *body, const double *x, const double *g, double *rate)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    const double *v = x + 2 * n + m->rigid;
    double *rate_v = rate + 2 * n + m->rigid;
    memset(rate, 0, m->states * sizeof(double));
    for (size_t j = 0; j <= m->segments && g != NULL; j++) {
        const Segment *s = &m->segment[j];
        memcpy(rate + s->to, g + s->in, s->size * sizeof(double));
        memcpy(rate + n + s->to, g + m->drives + s->in, s->size * sizeof(double));
    }
    if (g != NULL)
        memcpy(rate_v, g + 2 * m->drives, m->rigid * sizeof(double));
    body->kernels->add(n, m->pole.re, m->pole.im, x, x + n, rate, rate + n);
    memcpy(rate + 2 * n, v, m->rigid * sizeof(double));
}

void body_acceleration(const Body *body, const double *x, double *acceleration)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    memset(acceleration, 0, m->states * sizeof(double));
    for (size_t r = 0; r < n; r++) {
        const double a = m->pole.re[r], b = m->pole.im[r];
        const double square_re = a * a - b * b, square_im = 2 * a * b;
        acceleration[r] = square_re * x[r] - square_im * x[n + r];
        acceleration[n + r] = square_re * x[n + r] + square_im * x[r];
    }
}
