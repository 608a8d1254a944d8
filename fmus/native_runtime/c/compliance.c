/* How far forces at the contacts move them. */
#include "body.h"

#include <string.h>

void body_no_compliance(const Body *body)
{
    const size_t R = body->model->padded_rows;
    for (int odd = 0; odd < 2; odd++)
        memset(body->G[odd], 0, 3 * R * R * sizeof(double));
}

/* Modes of segment `a` and its partner: what row `row` does to a few rows from `from` on. */
static void respond(const Body *body, const Shapes *shapes, const Chunk *chunk, const Segment *a,
                    const double *const weight[3], size_t row, size_t from, size_t rows)
{
    const Model *m = body->model;
    const Segment *b = &m->segment[a->partner];
    const size_t R = m->padded_rows;
    const size_t x = body_place(body, chunk, from) - chunk->at; /* of column 0 */
    const size_t s = body_place(body, chunk, row) - chunk->at;
    const Rows X = {shapes->out_re + x + a->out, shapes->out_im + x + a->out};
    const Rows Y = {shapes->out_re + x + b->out, shapes->out_im + x + b->out};
    const Rows S = {shapes->in_re + s + a->out, shapes->in_im + s + a->out};
    const Rows T = {shapes->in_re + s + b->out, shapes->in_im + s + b->out};
    const double *const w[3] = {weight[0] + a->to, weight[1] + a->to, weight[2] + a->to};
    const double part = a == b ? 0.5 : 1; /* its own partner counts twice in the kernel */
    double sums[3][BLOCK] = {{0}};
    body->kernels->respond(a->size, chunk->room, rows, &X, &Y, &S, &T, w, m->modes, sums);
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < rows; k++)
            body->G[chunk->odd][i * R * R + row * R + from + k] += part * sums[i][k];
}

void body_respond_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk,
                        const double *const weight[3])
{
    const Model *m = body->model;
    for (size_t j = chunk->first; j < chunk->end; j++)
        for (size_t row = 0; row < m->rows && m->segment[j].partner >= j; row++) {
            const size_t next = (row / BLOCK + 1) * BLOCK;
            const Segment *segment = &m->segment[j];
            respond(body, shapes, chunk, segment, weight, row, row, next - row);
            for (size_t from = next; from < m->padded_rows; from += BLOCK)
                respond(body, shapes, chunk, segment, weight, row, from, BLOCK);
        }
}

/* Both sides of two rows, from what even and odd modes do. */
static void join(const Model *m, size_t k, size_t j, double even, double odd, double *G)
{
    const size_t C = m->contacts, rows = m->rows;
    const int here = m->mirror[k % m->directions], there = m->mirror[j % m->directions];
    G[k * C + j] = even + odd;
    if (m->sides > 1) {
        G[(rows + k) * C + rows + j] = here * there * (even + odd);
        G[k * C + rows + j] = there * (even - odd);
        G[(rows + k) * C + j] = here * (even - odd);
    }
}

void body_respond_rest(const Body *body, const Shapes *shapes, const double *const weight[3],
                       const double rigid_weight[3], double *G)
{
    const Model *m = body->model;
    const size_t R = m->padded_rows, C = m->contacts;
    for (size_t i = 0; i < 3; i++, G += C * C) {
        for (size_t k = 0; k < m->rows; k++)
            for (size_t j = 0; j < m->rows; j++) {
                const size_t low = j < k ? j : k, high = j < k ? k : j; /* Betti's law */
                const size_t at = i * R * R + low * R + high;
                double even = body->G[0][at];
                for (size_t q = 0; q < m->rigid; q++)
                    even += rigid_weight[i] * m->rigid_out[k * m->rigid + q] *
                            m->rigid_in[j * m->rigid + q];
                join(m, k, j, even, body->G[1][at], G);
            }
        for (size_t k = 0; k < m->local; k++) {
            const double re = shapes->local_re[k], im = shapes->local_im[k];
            G[k * C + k] += (re * re - im * im) * weight[i][m->ring + k] -
                            2 * re * im * weight[i][m->modes + m->ring + k];
        }
    }
}

void body_compliance(const Body *body, const Shapes *shapes, const double *const weight[3],
                     const double rigid_weight[3], double *G)
{
    const Model *m = body->model;
    body_no_compliance(body);
    for (size_t j = 0; j < m->chunks; j++)
        body_respond_chunk(body, shapes, &m->chunk[j], weight);
    body_respond_rest(body, shapes, weight, rigid_weight, G);
}
