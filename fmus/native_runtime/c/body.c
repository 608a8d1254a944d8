#include "body.h"

#include <stdlib.h>
#include <string.h>

int body_create(Body *body, const Model *model)
{
    const size_t n = model->ring;
    memset(body, 0, sizeof *body);
    body->model = model;
    body->kernels = kernels_for_this_processor();
    body->memory = calloc(16 * n + 2 * model->modes + 2 * model->longest, sizeof(double));
    if (body->memory == NULL)
        return 0;
    double *at = body->memory;
    Shapes *both[2] = {&body->shapes, &body->slope};
    for (int k = 0; k < 2; k++, at += 8 * n) {
        both[k]->out_re = at;
        both[k]->out_im = at + 4 * n;
        both[k]->in_re = both[k]->out_re; /* a track: the wave that runs the other way */
        both[k]->in_im = both[k]->out_im;
    }
    body->flexibility = at;
    body->work = at + 2 * model->modes;
    for (size_t r = 0; r < model->modes; r++) {
        const double re = model->pole.re[r], im = model->pole.im[r], size = re * re + im * im;
        body->flexibility[r] = -re / size;
        body->flexibility[model->modes + r] = im / size;
    }
    if (model->nodes == 0) { /* a vehicle: the same everywhere; the slope stays zero */
        memcpy(body->shapes.out_re, model->out.re, 4 * n * sizeof(double));
        memcpy(body->shapes.out_im, model->out.im, 4 * n * sizeof(double));
        body->shapes.in_re = model->in.re;
        body->shapes.in_im = model->in.im;
    }
    return 1;
}

void body_free(Body *body)
{
    free(body->memory);
    memset(body, 0, sizeof *body);
}

void body_drive(const Body *body, const Shapes *shapes, const double force[WHEELS], double *g)
{
    const Model *m = body->model;
    const size_t n = m->ring;
    double even[WHEELSETS], odd[WHEELSETS], *re = g, *im = g + m->modes;
    for (size_t k = 0; k < WHEELSETS; k++) {
        even[k] = force[k] + force[k + WHEELSETS];
        odd[k] = force[k] - force[k + WHEELSETS];
    }
    for (size_t j = 0; j < m->segments; j++) {
        const Segment *s = &m->segment[j];
        body->kernels->drive(s->size, n, shapes->in_re + s->from, shapes->in_im + s->from,
                             j < m->even_segments ? even : odd, re + s->to, im + s->to);
    }
    for (size_t k = 0; k < m->local; k++) {
        re[n + k] = shapes->local_re[k] * force[k];
        im[n + k] = shapes->local_im[k] * force[k];
    }
    for (size_t j = 0; j < m->rigid; j++) {
        const double *row = m->rigid_shape + (m->coordinates - WHEELSETS) * m->rigid + j;
        double sum = 0;
        for (size_t k = 0; k < WHEELSETS; k++)
            sum -= even[k] * row[k * m->rigid]; /* a contact force lifts the wheels */
        g[2 * m->modes + j] = sum;
    }
}

void body_observe(const Body *body, const Shapes *shapes, const double *x, double z[WHEELS])
{
    const Model *m = body->model;
    const size_t n = m->ring, e = m->even;
    const double *re = x, *im = x + m->modes, *r = x + 2 * m->modes;
    double even[WHEELSETS] = {0}, odd[WHEELSETS] = {0};
    body->kernels->observe(e, n, shapes->out_re, shapes->out_im, re, im, even);
    body->kernels->observe(n - e, n, shapes->out_re + e, shapes->out_im + e, re + e, im + e, odd);
    for (size_t k = 0; k < WHEELSETS; k++) {
        for (size_t j = 0; j < m->rigid; j++)
            even[k] += m->rigid_shape[(m->coordinates - WHEELSETS + k) * m->rigid + j] * r[j];
        z[k] = even[k] + odd[k];
        z[k + WHEELSETS] = even[k] - odd[k];
    }
    for (size_t k = 0; k < m->local; k++)
        z[k] += shapes->local_re[k] * re[n + k] - shapes->local_im[k] * im[n + k];
}

/* z and vz of one segment. A segment at a time stays in the processor's nearest memory. */
static void observe_segment(const Body *body, const Shapes *shapes, const Segment *s,
                            const double *x, const double force[WHEELSETS], double z[WHEELSETS],
                            double vz[WHEELSETS])
{
    const Model *m = body->model;
    const Kernels *kernels = body->kernels;
    const size_t n = m->ring;
    const double *re = x + s->to, *im = x + m->modes + s->to;
    const double *out_re = shapes->out_re + s->to, *out_im = shapes->out_im + s->to;
    double *rate_re = body->work, *rate_im = rate_re + s->size;
    kernels->drive(s->size, n, shapes->in_re + s->from, shapes->in_im + s->from, force, rate_re,
                   rate_im);
    kernels->add(s->size, m->pole.re + s->to, m->pole.im + s->to, re, im, rate_re, rate_im);
    kernels->observe(s->size, n, out_re, out_im, re, im, z);
    kernels->observe(s->size, n, out_re, out_im, rate_re, rate_im, vz);
}

void body_observe_moving(const Body *body, const Shapes *shapes, const double *x,
                         const double force[WHEELS], double z[WHEELS], double vz[WHEELS])
{
    const Model *m = body->model;
    const double *re = x + m->ring, *im = re + m->modes;
    double f[2][WHEELSETS], all_z[2][WHEELSETS] = {{0}}, all_vz[2][WHEELSETS] = {{0}};
    for (size_t k = 0; k < WHEELSETS; k++) {
        f[0][k] = force[k] + force[k + WHEELSETS];
        f[1][k] = force[k] - force[k + WHEELSETS];
    }
    for (size_t j = 0; j < m->segments; j++) {
        const int odd = j >= m->even_segments;
        observe_segment(body, shapes, &m->segment[j], x, f[odd], all_z[odd], all_vz[odd]);
    }
    for (size_t k = 0; k < WHEELS; k++) {
        const size_t w = k % WHEELSETS;
        const double sign = k < WHEELSETS ? 1 : -1;
        const double shape_re = shapes->local_re[k], shape_im = shapes->local_im[k];
        const double a = m->pole.re[m->ring + k], b = m->pole.im[m->ring + k];
        const double rate_re = a * re[k] - b * im[k] + shape_re * force[k];
        const double rate_im = a * im[k] + b * re[k] + shape_im * force[k];
        z[k] = all_z[0][w] + sign * all_z[1][w] + shape_re * re[k] - shape_im * im[k];
        vz[k] = all_vz[0][w] + sign * all_vz[1][w] + shape_re * rate_re - shape_im * rate_im;
    }
}

/* G4[j][k] += Re sum out_k weight in_j over the modes of one segment, for k >= j. */
static void segment_compliance(const Body *body, const Shapes *shapes, const double *weight,
                               const Segment *s, double G4[WHEELSETS][WHEELSETS])
{
    const size_t n = body->model->ring;
    const double *weight_im = weight + body->model->modes;
    body->kernels->respond(s->size, n, shapes->out_re + s->to, shapes->out_im + s->to,
                           weight + s->to, weight_im + s->to, shapes->in_re + s->from,
                           shapes->in_im + s->from, G4);
}

void body_compliance(const Body *body, const Shapes *shapes, const double *weight,
                     double rigid_weight, double G[WHEELS * WHEELS])
{
    const Model *m = body->model;
    const size_t n = m->ring;
    double even[WHEELSETS][WHEELSETS] = {{0}}, odd[WHEELSETS][WHEELSETS] = {{0}};
    for (size_t j = 0; j < m->segments; j++)
        segment_compliance(body, shapes, weight, &m->segment[j],
                           j < m->even_segments ? even : odd);
    for (size_t k = 0; k < WHEELSETS; k++)
        for (size_t j = 0; j < WHEELSETS; j++) {
            const size_t first = m->rigid > 0 ? m->coordinates - WHEELSETS : 0;
            const size_t low = j < k ? j : k, high = j < k ? k : j; /* Betti's law */
            double same = even[low][high];
            for (size_t i = 0; i < m->rigid; i++)
                same -= rigid_weight * m->rigid_shape[(first + k) * m->rigid + i] *
                        m->rigid_shape[(first + j) * m->rigid + i];
            G[k * WHEELS + j] = G[(k + 4) * WHEELS + j + 4] = same + odd[low][high];
            G[k * WHEELS + j + 4] = G[(k + 4) * WHEELS + j] = same - odd[low][high];
        }
    for (size_t k = 0; k < m->local; k++) {
        const double re = shapes->local_re[k], im = shapes->local_im[k];
        G[k * WHEELS + k] += (re * re - im * im) * weight[n + k] -
                             2 * re * im * weight[m->modes + n + k];
    }
}

void body_at_rest(const Body *body, const double *g, double *x)
{
    const size_t n = body->model->modes;
    memset(x, 0, body->model->states * sizeof(double));
    body->kernels->add(n, body->flexibility, body->flexibility + n, g, g + n, x, x + n);
}

double body_coordinate(const Body *body, size_t c, const double *x)
{
    const Model *m = body->model;
    const double *re = m->coordinate.re + c * m->ring, *im = m->coordinate.im + c * m->ring;
    double sum = 0;
    for (size_t r = 0; r < m->ring; r++)
        sum += re[r] * x[r] - im[r] * x[m->modes + r];
    for (size_t j = 0; j < m->rigid; j++)
        sum += m->rigid_shape[c * m->rigid + j] * x[2 * m->modes + j];
    return sum;
}

void body_rate(const Body *body, const double *x, const double *g, double *rate)
{
    const Model *m = body->model;
    const size_t n = m->modes;
    const double *v = x + 2 * n + m->rigid;
    double *rate_v = rate + 2 * n + m->rigid;
    if (g == NULL) {
        memset(rate, 0, 2 * n * sizeof(double));
        memset(rate_v, 0, m->rigid * sizeof(double));
    } else {
        memcpy(rate, g, 2 * n * sizeof(double));
        memcpy(rate_v, g + 2 * n, m->rigid * sizeof(double));
    }
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
