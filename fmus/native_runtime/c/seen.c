/* What is seen of a track at fixed places, while wheels pass. */
#include "body.h"

#include <math.h>
#include <string.h>

void model_fill_seen(Model *m, const double *re, const double *im)
{
    const double *const parts[2] = {re, im};
    const size_t used = m->seen.rows * m->ring, all = m->seen.padded_rows * m->ring;
    for (int part = 0; part < 2; part++) {
        memcpy(m->seen.shown[part], parts[part], used * sizeof(double));
        memset(m->seen.shown[part] + used, 0, (all - used) * sizeof(double));
    }
}

/* Places from the first of an oscillator's table to a position round the ring; of the last place on, there
   is nothing. */
static double along_table(const Model *m, size_t own, double position)
{
    double around = fmod(position - m->seen.begin[own], m->length);
    if (around < 0)
        around += m->length;
    return around / m->seen.spacing;
}

void body_seen_shapes(const Model *m, size_t wheelset, double position, double here, double along,
                      double *to_re, double *to_im)
{
    const Observed *seen = &m->seen;
    const size_t D = m->directions, values = m->sides * D;
    for (size_t k = 0; k < seen->own; k++) {
        const double at = along_table(m, k, position);
        const int near = at < (double)(seen->places - 1);
        const size_t first = near ? (size_t)at : 0;
        const double part = near ? at - (double)first : 0, slope = along / seen->spacing;
        const double w[2] = {near ? here * (1 - part) - slope : 0, near ? here * part + slope : 0};
        const double *re = seen->into.re + (k * seen->places + first) * values;
        const double *im = seen->into.im + (k * seen->places + first) * values;
        for (size_t j = 0; j < values; j++) {
            const size_t to = k * m->contacts + j / D * m->side_contacts + wheelset * D + j % D;
            to_re[to] = w[0] * re[j] + w[1] * re[values + j];
            to_im[to] = w[0] * im[j] + w[1] * im[values + j];
        }
    }
}

/* Of a block of rows: y, dy/dt and d2y/dt2, by modes of the ring. */
static void see_block(const Body *body, size_t from, const double *x, const double *rate,
                      double y[3][BLOCK])
{
    const Model *m = body->model;
    const double *re = m->seen.shown[0] + from * m->ring, *im = m->seen.shown[1] + from * m->ring;
    const double *turned = body->turned;
    body->kernels->observe(m->ring, m->ring, re, im, x, x + m->modes, y[0]);
    if (m->seen.rates)
        body->kernels->look(m->ring, m->ring, re, im, rate, rate + m->modes, turned,
                            turned + m->modes, y[1], y[2]);
}

void body_see(const Body *body, const double *x, const double *rate, double *outputs)
{
    const Model *m = body->model;
    const Observed *seen = &m->seen;
    const size_t each = seen->rows > 0 ? seen->own / seen->rows : 0;
    double *turned = body->turned;
    memset(outputs, 0, seen->outputs * sizeof(double));
    if (seen->rates) {
        memset(turned, 0, 2 * m->modes * sizeof(double));
        body->kernels->add(m->modes, m->pole.re, m->pole.im, rate, rate + m->modes, turned,
                           turned + m->modes);
    }
    for (size_t from = 0; from < seen->rows; from += BLOCK) {
        double y[3][BLOCK] = {{0}};
        see_block(body, from, x, rate, y);
        for (size_t k = from * each; k < seen->own && k < (from + BLOCK) * each; k++) {
            const size_t mode = m->ring + m->local + k, of = k / each - from;
            y[0][of] += seen->size[k] * x[mode];
            if (seen->rates) {
                y[1][of] += seen->size[k] * rate[mode];
                y[2][of] += seen->size[k] * turned[mode];
            }
        }
        for (size_t j = 0; j < seen->outputs; j++) {
            const size_t row = (size_t)seen->row[j];
            if (row / BLOCK * BLOCK == from)
                for (size_t order = 0; order < 3; order++)
                    outputs[j] += seen->weight[3 * j + order] * y[order][row - from];
        }
    }
}
