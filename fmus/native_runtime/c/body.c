#include "body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The next part of a block of numbers. */
static double *take(double **at, size_t n)
{
    double *part = *at;
    *at += n;
    return part;
}

/* Shapes of a vehicle: the same everywhere, and so are those that receive forces. */
static void set_shapes(Body *body, double *in_re, double *in_im)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->rows; k++) {
        const size_t to = k * m->width, from = k * m->ring, bytes = m->ring * sizeof(double);
        memcpy(body->shapes.out_re + to, m->out.re + from, bytes);
        memcpy(body->shapes.out_im + to, m->out.im + from, bytes);
        memcpy(in_re + to, m->in.re + from, bytes);
        memcpy(in_im + to, m->in.im + from, bytes);
    }
    body->shapes.in_re = in_re;
    body->shapes.in_im = in_im;
}

int body_create(Body *body, const Model *model)
{
    const size_t n = model->width, all = model->padded_rows * n, c = model->contacts;
    const size_t pairs = model->padded_rows * model->padded_rows;
    /* A track's table where its wheelsets are; of a vehicle the shapes that receive forces. */
    const size_t element = model->nodes > 0 ? ELEMENT_PARTS * model->rows * n : 2 * all;
    memset(body, 0, sizeof *body);
    body->model = model;
    body->kernels = kernels_for_this_processor();
    const size_t sets = model->nodes > 0 && model->contact_sign != 0 ? 3 : 2;
    body->memory = calloc(2 * sets * all + element + 2 * model->modes + 6 * model->padded_rows +
                          2 * pairs + 8 * c + 2 * model->modes, sizeof(double));
    body->places = calloc(5 * model->wheelsets, sizeof *body->places);
    if (body->memory == NULL || body->places == NULL)
        return 0;
    body->shapes.place = body->places;
    body->between.place = body->places + 4 * model->wheelsets;
    body->entered = body->places + model->wheelsets;
    body->middle = body->entered + model->wheelsets;
    body->end = body->middle + model->wheelsets;
    for (size_t k = 0; k < model->wheelsets; k++) {
        body->shapes.place[k].position = body->between.place[k].position = NAN; /* nowhere yet */
        body->entered[k].node = SIZE_MAX;
    }
    double *at = body->memory;
    Shapes *set[3] = {&body->shapes, &body->slope, &body->between};
    for (size_t k = 0; k < sets; k++) {
        set[k]->out_re = take(&at, all);
        set[k]->out_im = take(&at, all);
        set[k]->in_re = set[k]->out_re; /* a track: the wave that runs the other way */
        set[k]->in_im = set[k]->out_im;
        set[k]->local_re = take(&at, c);
        set[k]->local_im = take(&at, c);
    }
    body->element = take(&at, element);
    body->flexibility = take(&at, 2 * model->modes);
    for (int k = 0; k < 6; k++)
        body->by_parity[k] = take(&at, model->padded_rows);
    body->even = body->by_parity[0];
    body->odd = body->by_parity[1];
    body->G_even = take(&at, pairs);
    body->G_odd = take(&at, pairs);
    body->local = take(&at, 2 * c);
    body->work = take(&at, 2 * model->modes);
    for (size_t r = 0; r < model->modes; r++) {
        const double re = model->pole.re[r], im = model->pole.im[r], size = re * re + im * im;
        body->flexibility[r] = -re / size;
        body->flexibility[model->modes + r] = im / size;
    }
    if (model->nodes == 0)
        set_shapes(body, body->element, body->element + all);
    return 1;
}

void body_free(Body *body)
{
    free(body->places);
    free(body->memory);
    memset(body, 0, sizeof *body);
}

void body_split(const Model *m, const double *force, double *even, double *odd)
{
    for (size_t k = 0; k < m->rows; k++) {
        const double other = m->sides > 1 ? m->mirror[k % m->directions] * force[m->rows + k] : 0;
        even[k] = force[k] + other;
        odd[k] = force[k] - other;
    }
    for (size_t k = m->rows; k < m->padded_rows; k++)
        even[k] = odd[k] = 0;
}

/* Displacements of the sides from those of even and odd modes. */
static void join(const Model *m, const double *even, const double *odd, double *z)
{
    for (size_t k = 0; k < m->rows; k++) {
        z[k] = even[k] + odd[k];
        if (m->sides > 1)
            z[m->rows + k] = m->mirror[k % m->directions] * (even[k] - odd[k]);
    }
}

void body_drive_modes(const Body *body, const Shapes *shapes, size_t from, size_t size,
                        const double *f, double *g)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->padded_rows; k += BLOCK)
        body->kernels->drive(size, m->width, shapes->in_re + k * m->width + from,
                             shapes->in_im + k * m->width + from, f + k, k > 0, g + from,
                             g + m->drives + from);
}

void body_drive_local(const Model *m, const double *re, const double *im, const double *force,
                        double *g)
{
    for (size_t k = 0; k < m->local; k++) {
        g[m->width + k] = re[k] * force[k];
        g[m->drives + m->width + k] = im[k] * force[k];
    }
}

void body_drive(const Body *body, const Shapes *shapes, const double *force, double *g)
{
    const Model *m = body->model;
    body_split(m, force, body->even, body->odd);
    body_drive_modes(body, shapes, 0, m->odd_at, body->even, g);
    body_drive_modes(body, shapes, m->odd_at, m->width - m->odd_at, body->odd, g);
    body_drive_local(m, shapes->local_re, shapes->local_im, force, g);
    for (size_t j = 0; j < m->rigid; j++) {
        double sum = 0;
        for (size_t k = 0; k < m->rows; k++)
            sum += body->even[k] * m->rigid_in[k * m->rigid + j];
        g[2 * m->drives + j] = sum;
    }
}

/* z of all even modes, then of all odd ones: Re sum over modes of shapes times s. */
static void observe_modes(const Body *body, const Shapes *shapes, const double *re,
                          const double *im, double *even, double *odd)
{
    const Model *m = body->model;
    const size_t e = m->even, odd_at = m->odd_at;
    for (size_t k = 0; k < m->padded_rows; k += BLOCK) {
        const double *X_re = shapes->out_re + k * m->width, *X_im = shapes->out_im + k * m->width;
        body->kernels->observe(e, m->width, X_re, X_im, re, im, even + k);
        body->kernels->observe(m->odd, m->width, X_re + odd_at, X_im + odd_at, re + e, im + e,
                               odd + k);
    }
}

void body_observe(const Body *body, const Shapes *shapes, const double *x, double *z)
{
    const Model *m = body->model;
    const double *re = x, *im = x + m->modes, *r = x + 2 * m->modes;
    memset(body->even, 0, m->padded_rows * sizeof(double));
    memset(body->odd, 0, m->padded_rows * sizeof(double));
    observe_modes(body, shapes, re, im, body->even, body->odd);
    for (size_t k = 0; k < m->rows; k++)
        for (size_t j = 0; j < m->rigid; j++)
            body->even[k] += m->rigid_out[k * m->rigid + j] * r[j];
    join(m, body->even, body->odd, z);
    for (size_t k = 0; k < m->local; k++)
        z[k] += shapes->local_re[k] * re[m->ring + k] - shapes->local_im[k] * im[m->ring + k];
}

void body_velocity(const Body *body, const Shapes *shapes, const double *x, const double *g,
                   double *vz)
{
    const Model *m = body->model;
    const double *re = x, *im = x + m->modes;
    double *rate_re = body->work, *rate_im = rate_re + m->modes;
    for (size_t j = 0; j <= m->segments; j++) {
        const Segment *s = &m->segment[j];
        memcpy(rate_re + s->to, g + s->in, s->size * sizeof(double));
        memcpy(rate_im + s->to, g + m->drives + s->in, s->size * sizeof(double));
        body->kernels->add(s->size, m->pole.re + s->to, m->pole.im + s->to, re + s->to, im + s->to,
                           rate_re + s->to, rate_im + s->to);
    }
    memset(body->even, 0, m->padded_rows * sizeof(double));
    memset(body->odd, 0, m->padded_rows * sizeof(double));
    observe_modes(body, shapes, rate_re, rate_im, body->even, body->odd);
    join(m, body->even, body->odd, vz);
    for (size_t k = 0; k < m->local; k++)
        vz[k] += shapes->local_re[k] * rate_re[m->ring + k] -
                 shapes->local_im[k] * rate_im[m->ring + k];
}

/* G[j][k] += Re sum X_k weight X'_j over the modes of one segment, of the wheelsets of one block
   for k >= j. */
static void own_compliance(const Body *body, const Shapes *shapes, const double *weight,
                           const Segment *s, size_t block, double *G)
{
    const Model *m = body->model;
    const size_t at = block * m->width, R = m->padded_rows;
    double G4[BLOCK][BLOCK] = {{0}};
    body->kernels->respond(s->size, m->width, shapes->out_re + at + s->out,
                           shapes->out_im + at + s->out, weight + s->to,
                           weight + m->modes + s->to, shapes->in_re + at + s->in,
                           shapes->in_im + at + s->in, G4);
    for (size_t j = 0; j < BLOCK; j++)
        for (size_t k = j; k < BLOCK; k++)
            G[(block + j) * R + block + k] += G4[j][k];
}

/* The same for wheelsets k of later blocks, for row j, over all modes. */
static void far_compliance(const Body *body, const Shapes *shapes, const double *weight, size_t j)
{
    const Model *m = body->model;
    const size_t R = m->padded_rows, at = j * m->width, ring = m->ring, e = m->even;
    double *re = body->work, *im = re + ring;
    memset(re, 0, 2 * ring * sizeof(double));
    for (size_t q = 0; q < m->segments; q++) {
        const Segment *s = &m->segment[q];
        body->kernels->add(s->size, weight + s->to, weight + m->modes + s->to,
                           shapes->in_re + at + s->in, shapes->in_im + at + s->in, re + s->to,
                           im + s->to);
    }
    for (size_t k = (j / BLOCK + 1) * BLOCK; k < R; k += BLOCK) {
        const double *X_re = shapes->out_re + k * m->width, *X_im = shapes->out_im + k * m->width;
        body->kernels->observe(e, m->width, X_re, X_im, re, im, body->G_even + j * R + k);
        body->kernels->observe(m->odd, m->width, X_re + m->odd_at, X_im + m->odd_at, re + e,
                               im + e, body->G_odd + j * R + k);
    }
}

void body_compliance(const Body *body, const Shapes *shapes, const double *weight,
                     double rigid_weight, double *G)
{
    const Model *m = body->model;
    const size_t R = m->padded_rows, C = m->contacts, rows = m->rows;
    memset(body->G_even, 0, R * R * sizeof(double));
    memset(body->G_odd, 0, R * R * sizeof(double));
    for (size_t q = 0; q < m->segments; q++)
        for (size_t block = 0; block < R; block += BLOCK)
            own_compliance(body, shapes, weight, &m->segment[q], block,
                           m->segment[q].to < m->even ? body->G_even : body->G_odd);
    for (size_t j = 0; j < rows && rows > BLOCK; j++)
        far_compliance(body, shapes, weight, j);
    for (size_t k = 0; k < rows; k++)
        for (size_t j = 0; j < rows; j++) {
            const size_t low = j < k ? j : k, high = j < k ? k : j; /* Betti's law */
            const int here = m->mirror[k % m->directions], there = m->mirror[j % m->directions];
            const double odd = body->G_odd[low * R + high];
            double even = body->G_even[low * R + high];
            for (size_t i = 0; i < m->rigid; i++)
                even += rigid_weight * m->rigid_out[k * m->rigid + i] *
                        m->rigid_in[j * m->rigid + i];
            G[k * C + j] = even + odd;
            if (m->sides > 1) {
                G[(rows + k) * C + rows + j] = here * there * (even + odd);
                G[k * C + rows + j] = there * (even - odd);
                G[(rows + k) * C + j] = here * (even - odd);
            }
        }
    for (size_t k = 0; k < m->local; k++) {
        const double re = shapes->local_re[k], im = shapes->local_im[k];
        G[k * C + k] += (re * re - im * im) * weight[m->ring + k] -
                        2 * re * im * weight[m->modes + m->ring + k];
    }
}

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
    double sum = 0;
    for (size_t r = 0; r < m->ring; r++)
        sum += re[r] * x[r] - im[r] * x[m->modes + r];
    for (size_t j = 0; j < m->rigid; j++)
        sum += m->rigid_shape[c * m->rigid + j] * x[2 * m->modes + j];
    return sum;
}

double body_through(const Body *body, size_t c, const double *force)
{
    const Model *m = body->model;
    double sum = 0;
    body_split(m, force, body->even, body->odd);
    for (size_t k = 0; k < m->rows; k++)
        sum += m->through[c * m->rows + k] * body->even[k];
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
