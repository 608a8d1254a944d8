#include "body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Shapes of a vehicle: the same everywhere, and so are those that receive forces. */
static void set_shapes(Body *body, double *in_re, double *in_im)
{
    const Model *m = body->model;
    for (size_t j = 0; j < m->chunks; j++)
        for (size_t k = 0; k < m->chunk[j].rows; k++) {
            const Chunk *chunk = &m->chunk[j];
            const size_t to = body_place(body, chunk, k);
            const size_t from = chunk->row[k] * m->ring + chunk->to;
            const size_t bytes = chunk->size * sizeof(double);
            memcpy(body->shapes.out_re + to, m->out.re + from, bytes);
            memcpy(body->shapes.out_im + to, m->out.im + from, bytes);
            memcpy(in_re + to, m->in.re + from, bytes);
            memcpy(in_im + to, m->in.im + from, bytes);
        }
    body->shapes.in_re = in_re;
    body->shapes.in_im = in_im;
}

static void lay_out(Body *body, Arrays *arrays)
{
    const Model *m = body->model;
    const size_t R = m->padded_rows, all = m->shapes;
    Shapes *set[4] = {&body->shapes, &body->slope, &body->between, &body->before};
    for (size_t k = 0; k < 4; k++) {
        set[k]->out_re = arrays_take(arrays, all);
        set[k]->out_im = arrays_take(arrays, all);
        set[k]->in_re = set[k]->out_re; /* a track: the wave that runs the other way */
        set[k]->in_im = set[k]->out_im;
        set[k]->local_re = arrays_take(arrays, m->contacts * m->directions);
        set[k]->local_im = arrays_take(arrays, m->contacts * m->directions);
        set[k]->seen_re = arrays_take(arrays, m->seen.own * m->contacts);
        set[k]->seen_im = arrays_take(arrays, m->seen.own * m->contacts);
    }
    /* Of a vehicle the shapes that receive forces. */
    body->receiving = arrays_take(arrays, m->nodes > 0 ? 0 : 2 * all);
    body->spare = arrays_take(arrays, 2 * m->motions * m->width);
    body->all_weights = arrays_take(arrays, 8 * m->wheelsets * TOGETHER);
    body->flexibility = arrays_take(arrays, 2 * m->modes);
    body->rate = arrays_take(arrays, 2 * m->modes);
    body->turned = arrays_take(arrays, m->seen.rows > 0 ? 2 * m->modes : 0);
    for (int odd = 0; odd < 2; odd++) {
        for (size_t k = 0; k < sizeof body->split / sizeof *body->split; k++)
            body->split[k].of[odd] = arrays_take(arrays, R + 1);
        body->G[odd] = arrays_take(arrays, 3 * R * R);
    }
}

static void find_places(Body *body)
{
    const size_t n = body->model->wheelsets;
    body->shapes.place = body->places;
    body->between.place = body->places + n;
    body->slope.place = body->places + 2 * n;
    body->before.place = body->places + 3 * n;
    body->middles = body->places + 4 * n;
    body->ends = body->middles + TOGETHER * n;
    body_choose_part(body, 0);
    for (size_t k = 0; k < n; k++) /* nowhere yet */
        body->shapes.place[k].position = body->between.place[k].position =
            body->before.place[k].position = NAN;
}

int body_create(Body *body, const Model *model, Memory *memory)
{
    memset(body, 0, sizeof *body);
    body->model = model;
    body->kernels = kernels_for_this_processor();
    lay_out(body, &body->arrays);
    body->places = memory_take(memory, (4 + 2 * TOGETHER) * model->wheelsets,
                               sizeof *body->places);
    if (body->places == NULL || !arrays_make(&body->arrays, memory))
        return 0;
    lay_out(body, &body->arrays);
    find_places(body);
    for (size_t r = 0; r < model->modes; r++) {
        const double re = model->pole.re[r], im = model->pole.im[r], size = re * re + im * im;
        body->flexibility[r] = -re / size;
        body->flexibility[model->modes + r] = im / size;
    }
    if (model->nodes == 0)
        set_shapes(body, body->receiving, body->receiving + model->shapes);
    return 1;
}

void body_free(Body *body)
{
    free(body->places);
    free(body->arrays.memory);
    memset(body, 0, sizeof *body);
}

void body_split(const Model *m, const double *force, const ByParity *f)
{
    double *even = f->of[0], *odd = f->of[1];
    for (size_t k = 0; k < m->side_contacts && !m->apart; k++) {
        const double other =
            m->sides > 1 ? m->mirror[k % m->directions] * force[m->side_contacts + k] : 0;
        even[k] = force[k] + other;
        odd[k] = force[k] - other;
    }
    for (size_t k = 0; k < m->contacts && m->apart; k++)
        even[model_row(m, k)] = force[k];
    for (size_t k = m->rows; k <= m->padded_rows; k++)
        even[k] = odd[k] = 0;
}

/* Numbers of a block of a chunk's rows, from `k` on, from those of all rows; and back. */
static void gather(const Chunk *chunk, size_t k, const double *all, double own[BLOCK])
{
    for (size_t i = 0; i < BLOCK; i++)
        own[i] = all[chunk->row[k + i]];
}

static void scatter(const Chunk *chunk, size_t k, const double own[BLOCK], double *all)
{
    for (size_t i = 0; i < BLOCK; i++)
        all[chunk->row[k + i]] = own[i];
}

/* Displacements of the sides from those of even and odd modes. */
static void join(const Model *m, const ByParity *z, double *at_contacts)
{
    const double *even = z->of[0], *odd = z->of[1];
    for (size_t k = 0; k < m->side_contacts && !m->apart; k++) {
        at_contacts[k] = even[k] + odd[k];
        if (m->sides > 1)
            at_contacts[m->side_contacts + k] = m->mirror[k % m->directions] * (even[k] - odd[k]);
    }
    for (size_t k = 0; k < m->contacts && m->apart; k++)
        at_contacts[k] = even[model_row(m, k)];
}

void body_drive_chunk(const Body *body, const Shapes *shapes, size_t place, const Chunk *chunk,
                      const ByParity *f, double *g)
{
    const Model *m = body->model;
    double own[BLOCK];
    for (size_t k = 0; k < chunk->padded_rows; k += BLOCK) {
        const size_t from = place + k * chunk->room;
        gather(chunk, k, f->of[chunk->odd], own);
        body->kernels->drive(chunk->room, chunk->room, shapes->in_re + from, shapes->in_im + from,
                             own, k > 0, g + chunk->at, g + m->drives + chunk->at);
    }
}

void body_drive_both(const Body *body, const Shapes *shapes, const Chunk *chunk, const ByParity *f,
                     const ByParity *e, double *g, double *d)
{
    const Model *m = body->model;
    double one[BLOCK], other[BLOCK];
    for (size_t k = 0; k < chunk->padded_rows; k += BLOCK) {
        const size_t from = body_place(body, chunk, k);
        gather(chunk, k, f->of[chunk->odd], one);
        gather(chunk, k, e->of[chunk->odd], other);
        body->kernels->drive_both(chunk->room, chunk->room, shapes->in_re + from,
                                  shapes->in_im + from, one, other, k > 0, m->drives,
                                  g + chunk->at, d + chunk->at);
    }
}

void body_drive_rest(const Body *body, const Shapes *shapes, const double *force,
                     const ByParity *f, double *g)
{
    const Model *m = body->model;
    const size_t D = m->directions;
    for (size_t k = 0; k < m->local; k++) {
        double re = 0, im = 0;
        for (size_t j = k - k % D; j < k - k % D + D; j++) { /* ports of the same contact */
            re += shapes->local_re[j * D + k % D] * force[j];
            im += shapes->local_im[j * D + k % D] * force[j];
        }
        g[m->width + k] = re;
        g[m->drives + m->width + k] = im;
    }
    for (size_t k = 0; k < m->seen.own; k++) {
        const double *seen_re = shapes->seen_re + k * m->contacts;
        const double *seen_im = shapes->seen_im + k * m->contacts;
        double re = 0, im = 0;
        for (size_t j = 0; j < m->contacts; j++) {
            re += seen_re[j] * force[j];
            im += seen_im[j] * force[j];
        }
        g[m->width + m->local + k] = re;
        g[m->drives + m->width + m->local + k] = im;
    }
    for (size_t j = 0; j < m->rigid; j++) {
        const double *own = f->of[j >= m->even_rigid];
        double sum = 0;
        for (size_t k = 0; k < m->rows; k++)
            sum += own[k] * m->rigid_in[k * m->rigid + j];
        g[2 * m->drives + j] = sum;
    }
}

void body_drive(const Body *body, const Shapes *shapes, const double *force, double *g)
{
    const Model *m = body->model;
    const ByParity *f = &body->split[0];
    body_split(m, force, f);
    for (size_t j = 0; j < m->chunks; j++)
        body_drive_chunk(body, shapes, body_place(body, &m->chunk[j], 0), &m->chunk[j], f, g);
    body_drive_rest(body, shapes, force, f, g);
}

void body_no_motion(const Model *m, const ByParity *z)
{
    for (int odd = 0; odd < 2; odd++)
        memset(z->of[odd], 0, (m->padded_rows + 1) * sizeof(double));
}

void body_observe_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk,
                        const double *x, const ByParity *z)
{
    const Model *m = body->model;
    const double *re = x + chunk->to, *im = re + m->modes;
    double own[BLOCK];
    for (size_t k = 0; k < chunk->padded_rows; k += BLOCK) {
        const size_t from = body_place(body, chunk, k);
        gather(chunk, k, z->of[chunk->odd], own);
        body->kernels->observe(chunk->size, chunk->room, shapes->out_re + from,
                               shapes->out_im + from, re, im, own);
        scatter(chunk, k, own, z->of[chunk->odd]);
    }
}

/* What the local modes add to the motion at their contacts. */
static void observe_local(const Model *m, const Shapes *shapes, const double *re, const double *im,
                          double *at_contacts)
{
    const size_t D = m->directions;
    for (size_t k = 0; k < m->local; k++)
        for (size_t j = 0, first = k - k % D; j < D; j++)
            at_contacts[k] += shapes->local_re[k * D + j] * re[first + j] -
                              shapes->local_im[k * D + j] * im[first + j];
}

void body_observe_rest(const Body *body, const Shapes *shapes, const double *x, const ByParity *z,
                       double *at_contacts)
{
    const Model *m = body->model;
    const double *re = x + m->ring, *im = re + m->modes, *r = x + 2 * m->modes;
    for (size_t k = 0; k < m->rows; k++)
        for (size_t j = 0; j < m->rigid; j++)
            z->of[j >= m->even_rigid][k] += m->rigid_out[k * m->rigid + j] * r[j];
    join(m, z, at_contacts);
    observe_local(m, shapes, re, im, at_contacts);
}

void body_observe(const Body *body, const Shapes *shapes, const double *x, double *z)
{
    const Model *m = body->model;
    const ByParity *sums = &body->split[0];
    body_no_motion(m, sums);
    for (size_t j = 0; j < m->chunks; j++)
        body_observe_chunk(body, shapes, &m->chunk[j], x, sums);
    body_observe_rest(body, shapes, x, sums, z);
}

/* Rates of a chunk, lambda s + g, in body->rate. */
static void find_rate(const Body *body, const Chunk *chunk, const double *x, const double *g)
{
    const Model *m = body->model;
    double *rate = body->rate, *rate_im = rate + m->modes;
    for (size_t j = chunk->first; j < chunk->end; j++) {
        const Segment *s = &m->segment[j];
        memcpy(rate + s->to, g + s->in, s->size * sizeof(double));
        memcpy(rate_im + s->to, g + m->drives + s->in, s->size * sizeof(double));
    }
    body->kernels->add(chunk->size, m->pole.re + chunk->to, m->pole.im + chunk->to, x + chunk->to,
                       x + m->modes + chunk->to, rate + chunk->to, rate_im + chunk->to);
}

void body_observe_both(const Body *body, const Shapes *shapes, const Chunk *chunk, const double *x,
                       const double *y, const ByParity *z, const ByParity *v)
{
    const Model *m = body->model;
    const double *re = x + chunk->to, *im = re + m->modes;
    const double *other = y + chunk->to, *other_im = other + m->modes;
    double own[BLOCK], own_other[BLOCK];
    for (size_t k = 0; k < chunk->padded_rows; k += BLOCK) {
        const size_t from = body_place(body, chunk, k);
        gather(chunk, k, z->of[chunk->odd], own);
        gather(chunk, k, v->of[chunk->odd], own_other);
        body->kernels->look(chunk->size, chunk->room, shapes->out_re + from, shapes->out_im + from,
                            re, im, other, other_im, own, own_other);
        scatter(chunk, k, own, z->of[chunk->odd]);
        scatter(chunk, k, own_other, v->of[chunk->odd]);
    }
}

void body_look_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk, const double *x,
                     const double *g, const ByParity *z, const ByParity *vz)
{
    find_rate(body, chunk, x, g);
    body_observe_both(body, shapes, chunk, x, body->rate, z, vz);
}

void body_look_rest(const Body *body, const Shapes *shapes, const double *x, const double *g,
                    const ByParity *sums, const ByParity *rates, double *z, double *vz)
{
    const Model *m = body->model;
    find_rate(body, &m->chunk[m->chunks], x, g);
    body_observe_rest(body, shapes, x, sums, z);
    join(m, rates, vz);
    observe_local(m, shapes, body->rate + m->ring, body->rate + m->ring + m->modes, vz);
}

void body_look(const Body *body, const Shapes *shapes, const double *x, const double *force,
               int known, double *g, double *z, double *vz)
{
    const Model *m = body->model;
    const ByParity *f = &body->split[0], *sums = &body->split[1], *rates = &body->split[2];
    body_split(m, force, f);
    body_no_motion(m, sums);
    body_no_motion(m, rates);
    for (size_t j = 0; j < m->chunks; j++) {
        const Chunk *chunk = &m->chunk[j];
        if (!known)
            body_drive_chunk(body, shapes, body_place(body, chunk, 0), chunk, f, g);
        body_look_chunk(body, shapes, chunk, x, g, sums, rates);
    }
    if (!known)
        body_drive_rest(body, shapes, force, f, g);
    body_look_rest(body, shapes, x, g, sums, rates, z, vz);
}
