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
    double *G = body->G[chunk->odd] + chunk->row[row] * R;
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < rows && from + k < chunk->rows; k++)
            G[i * R * R + chunk->row[from + k]] += part * sums[i][k];
}

void body_respond_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk,
                        const double *const weight[3], int far)
{
    const Model *m = body->model;
    const size_t rows = BLOCK * chunk->moving; /* of four wheelsets */
    for (size_t j = chunk->first; j < chunk->end; j++)
        for (size_t row = 0; row < chunk->rows && m->segment[j].partner >= j; row++) {
            const size_t next = (row / BLOCK + 1) * BLOCK, last = (row / rows + 1) * rows;
            const size_t end = far || last > chunk->padded_rows ? chunk->padded_rows : last;
            const Segment *segment = &m->segment[j];
            respond(body, shapes, chunk, segment, weight, row, row, next - row);
            for (size_t from = next; from < end; from += BLOCK)
                respond(body, shapes, chunk, segment, weight, row, from, BLOCK);
        }
}

/* Displacement of contact k by the force at contact j, by each of `count` weights, `apart` from each
   other; from what even and odd modes of their rows do. */
static void between(const Body *body, const Shapes *shapes, size_t count,
                    const double *const *weight, const double *rigid_weight, size_t k, size_t j,
                    size_t apart, double *G)
{
    const Model *m = body->model;
    const size_t R = m->padded_rows, D = m->directions, first = k - k % D;
    const int left = m->apart || k < m->side_contacts, local = j - j % D == first;
    const int other_left = m->apart || j < m->side_contacts; /* apart, no side is another's image */
    const size_t row = model_row(m, k), other = model_row(m, j);
    const size_t at = row < other ? row * R + other : other * R + row; /* Betti's law */
    const int here = left ? 1 : m->mirror[k % D], there = other_left ? 1 : m->mirror[j % D];
    /* Forces of one side alone move both. */
    const double odd = left == other_left ? 1 : -1;
    for (size_t i = 0; i < count; i++) {
        double by[2] = {body->G[0][i * R * R + at], body->G[1][i * R * R + at]}, own = 0;
        for (size_t q = 0; q < m->rigid; q++)
            by[q >= m->even_rigid] += rigid_weight[i] * m->rigid_out[row * m->rigid + q] *
                                      m->rigid_in[other * m->rigid + q];
        for (size_t q = 0; q < D && local && first < m->local; q++) {
            const double re = shapes->local_re[k * D + q], im = shapes->local_im[k * D + q];
            const double to_re = shapes->local_re[j * D + q], to_im = shapes->local_im[j * D + q];
            own += (re * to_re - im * to_im) * weight[i][m->ring + first + q] -
                   (re * to_im + im * to_re) * weight[i][m->modes + m->ring + first + q];
        }
        G[i * apart] = here * there * (by[0] + odd * by[1]) + own;
    }
}

void body_respond_rest(const Body *body, const Shapes *shapes, const double *const weight[3],
                       const double rigid_weight[3], size_t n, const size_t *contact, double *G)
{
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++)
            between(body, shapes, 3, weight, rigid_weight, contact[k], contact[j], n * n,
                    G + k * n + j);
}

size_t body_block(const Model *m, size_t block, size_t *contact)
{
    size_t n = 0;
    const size_t first = block * BLOCK * m->directions, next = first + BLOCK * m->directions;
    for (size_t side = 0; side < m->sides; side++)
        for (size_t k = first; k < next && k < m->side_contacts; k++)
            contact[n++] = side * m->side_contacts + k;
    return n;
}

void body_compliance(const Body *body, const Shapes *shapes, const double *weight, double *G)
{
    const Model *m = body->model;
    const double *const weights[3] = {weight, weight, weight}, none[1] = {0};
    const size_t C = m->contacts;
    body_no_compliance(body);
    for (size_t j = 0; j < m->chunks; j++)
        body_respond_chunk(body, shapes, &m->chunk[j], weights, 1);
    for (size_t k = 0; k < C; k++)
        for (size_t j = 0; j < C; j++)
            between(body, shapes, 1, weights, none, k, j, 0, G + k * C + j);
}

/* Rates of a block of rows from `from` on by a force at row `row`, which reach the modes through their
   partners. */
static void set_off(const Body *body, const Shapes *shapes, const Chunk *chunk, size_t row,
                    size_t from, double rates[BLOCK])
{
    const Model *m = body->model;
    const size_t x = body_place(body, chunk, from) - chunk->at; /* of column 0 */
    const size_t s = body_place(body, chunk, row) - chunk->at;
    for (size_t j = chunk->first; j < chunk->end; j++) {
        const Segment *segment = &m->segment[j];
        body->kernels->observe(segment->size, chunk->room, shapes->out_re + x + segment->out,
                               shapes->out_im + x + segment->out, shapes->in_re + s + segment->in,
                               shapes->in_im + s + segment->in, rates);
    }
}

void body_through_chunk(const Body *body, const Shapes *shapes, const Chunk *chunk)
{
    const size_t R = body->model->padded_rows;
    for (size_t row = 0; row < chunk->rows; row++) {
        double *G = body->G[chunk->odd] + chunk->row[row] * R;
        for (size_t from = row / BLOCK * BLOCK; from < chunk->rows; from += BLOCK) {
            double rates[BLOCK] = {0};
            set_off(body, shapes, chunk, row, from, rates);
            for (size_t k = 0; k < BLOCK && from + k < chunk->rows; k++)
                G[chunk->row[from + k]] += rates[k];
        }
    }
}

void body_through_rest(const Body *body, const Shapes *shapes, const double *ones, double *through)
{
    const size_t C = body->model->contacts;
    const double none[1] = {0};
    for (size_t k = 0; k < C; k++)
        for (size_t j = 0; j < C; j++)
            between(body, shapes, 1, &ones, none, k, j, 0, through + k * C + j);
}
