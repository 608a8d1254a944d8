/* Mode shapes of a body at its wheelsets, and how they change along the track. */
#include "body.h"

#include <math.h>
#include <string.h>

/* Places (m) are rounded to this. A position extrapolated and the same position set from outside
   then are one place, whose shapes need not be computed twice; shapes change by 1e-11 of
   themselves over it. */
static const double GRID = 1.0 / (1ll << 40);

/* Where on the ring. */
static Place locate(const Model *m, double position)
{
    /* Far away a double is coarser than the grid, and too large for the rounding. */
    const double far = fabs(position);
    Place place = {far < 4096 ? nearbyint(position / GRID) * GRID : position, 0, 0, 0};
    double around = fmod(place.position, m->length);
    if (around < 0)
        around += m->length;
    const double c = fmin(floor(around / m->cell_length), (double)(m->cells - 1));
    const double inside = fmax(around - c * m->cell_length, 0.0) / m->element;
    const double e = fmin(floor(inside), (double)(m->nodes - 1));
    place.cell = (size_t)c;
    place.node = (size_t)e;
    place.xi = inside - e;
    return place;
}

/* Weights of an element's parts: Hermite's cubic from the shapes [w_a, w_b - w_a, dw_a, dw_b] at
   its nodes, and its derivative along x. No kinks at nodes. */
static void shape_functions(double xi, double length, double w[4], double dw[4])
{
    const double xi2 = xi * xi, xi3 = xi2 * xi;
    w[0] = 1;
    w[1] = -2 * xi3 + 3 * xi2;
    w[2] = length * (xi3 - 2 * xi2 + xi);
    w[3] = length * (xi3 - xi2);
    dw[0] = 0;
    dw[1] = 6 / length * (xi - xi2);
    dw[2] = 3 * xi2 - 4 * xi + 1;
    dw[3] = 3 * xi2 - 2 * xi;
}

static double *element_of(const Body *body, const Chunk *chunk, size_t row)
{
    return body->element + ELEMENT_PARTS * body_place(body, chunk, row);
}

static int same_element(const Place *a, const Place *b)
{
    return a->cell == b->cell && a->node == b->node;
}

/* Take a wheelset's element from the table, for the modes of a chunk. */
static void enter_chunk(Body *body, size_t wheelset, const Place *place, const Chunk *chunk)
{
    const Model *m = body->model;
    const size_t n = m->ring, last = place->node + 1 == m->nodes, values = 2 * m->directions;
    const size_t next_cell = (place->cell + last) % m->cells, next = last ? 0 : place->node + 1;
    const double *phase_a = m->phase + 2 * place->cell * m->segments;
    const double *phase_b = m->phase + 2 * next_cell * m->segments;
    for (size_t d = 0; d < m->directions; d++) {
        double *element = element_of(body, chunk, wheelset * m->directions + d) - chunk->at;
        const float *a = m->table_re + (values * place->node + 2 * d) * n;
        const float *b = m->table_re + (values * next + 2 * d) * n;
        for (size_t j = chunk->first; j < chunk->end; j++) {
            const Segment *s = &m->segment[j];
            body->kernels->enter(s->size, n, m->table_im - m->table_re, a + s->to, b + s->to,
                                 phase_a + 2 * j, phase_b + 2 * j, chunk->room,
                                 element + s->out);
        }
    }
}

/* The whole, unless it is there. */
static void enter(Body *body, size_t wheelset, const Place *place)
{
    const Model *m = body->model;
    if (same_element(&body->entered[wheelset], place))
        return;
    for (size_t j = 0; j < m->chunks; j++)
        enter_chunk(body, wheelset, place, &m->chunk[j]);
    body->entered[wheelset] = *place;
}

/* Shapes of the local modes of a wheelset with given weights of the values at both nodes. */
static void local_shapes(const Model *m, size_t wheelset, const Place *place,
                         const double weight[2], double *to_re, double *to_im)
{
    const double *re = m->local_shape.re, *im = m->local_shape.im;
    const size_t D = m->directions, next = place->node + 1 == m->nodes ? 0 : place->node + 1;
    for (size_t k = 0; k < D * D; k++)
        for (size_t side = 0; side < m->sides; side++) {
            const size_t to = (side * m->rows + wheelset * D) * D + k;
            const size_t here = place->node * D * D + k, there = next * D * D + k;
            const double sign = side > 0 ? m->mirror[k / D] : 1;
            to_re[to] = sign * (weight[0] * re[here] + weight[1] * re[there]);
            to_im[to] = sign * (weight[0] * im[here] + weight[1] * im[there]);
        }
}

/* Shapes of one wheelset, whose element is there, for a chunk, whose shapes begin at `to`. */
static void evaluate(Body *body, Shapes *shapes, size_t wheelset, const Place *place,
                     const Chunk *chunk, size_t to)
{
    const Model *m = body->model;
    double w[4], dw[4];
    shape_functions(place->xi, m->element, w, dw);
    for (size_t d = 0; d < m->directions; d++) {
        const size_t row = wheelset * m->directions + d, at = to + row * chunk->room;
        body->kernels->evaluate(chunk->room, chunk->room, element_of(body, chunk, row), w + 1,
                                shapes->out_re + at, shapes->out_im + at);
    }
}

/* Take note of where shapes of a wheelset now are. */
static void arrive(const Model *m, Shapes *shapes, size_t wheelset, const Place *place)
{
    const double local[2] = {1 - place->xi, place->xi};
    local_shapes(m, wheelset, place, local, shapes->local_re, shapes->local_im);
    shapes->place[wheelset] = *place;
}

static const Shapes *shapes_at(Body *body, Shapes *shapes, const double *position)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place place = locate(m, position[k]);
        if (place.position == shapes->place[k].position)
            continue;
        enter(body, k, &place);
        for (size_t j = 0; j < m->chunks; j++)
            evaluate(body, shapes, k, &place, &m->chunk[j], body_place(body, &m->chunk[j], 0));
        arrive(m, shapes, k, &place);
    }
    return shapes;
}

const Shapes *body_shapes(Body *body, const double *position)
{
    return shapes_at(body, &body->shapes, position);
}

const Shapes *body_shapes_between(Body *body, const double *position)
{
    return shapes_at(body, body->model->nodes > 0 ? &body->between : &body->shapes, position);
}

void body_begin_pass(Body *body, const double *middle, const double *end)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        body->middle[k] = locate(m, middle[k]);
        body->end[k] = locate(m, end[k]);
        double w[4], v[4], dw[4];
        shape_functions(body->middle[k].xi, m->element, w, dw);
        shape_functions(body->end[k].xi, m->element, v, dw);
        memcpy(body->weights + 6 * k, w + 1, 3 * sizeof(double));
        memcpy(body->weights + 6 * k + 3, v + 1, 3 * sizeof(double));
    }
}

/* Both shapes of one wheelset, from the element that it is in all the time. */
static void evaluate_both(Body *body, size_t wheelset, const Chunk *chunk, size_t place)
{
    const Model *m = body->model;
    const double *w = body->weights + 6 * wheelset;
    for (size_t d = 0; d < m->directions; d++) {
        const size_t row = wheelset * m->directions + d;
        const size_t middle = place + row * chunk->room, end = body_place(body, chunk, row);
        body->kernels->evaluate_both(chunk->room, chunk->room, element_of(body, chunk, row), w,
                                     w + 3, body->between.out_re + middle,
                                     body->between.out_im + middle, body->shapes.out_re + end,
                                     body->shapes.out_im + end);
    }
}

void body_pass(Body *body, const Chunk *chunk, size_t place)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place *middle = &body->middle[k], *end = &body->end[k];
        if (!same_element(&body->entered[k], middle))
            enter_chunk(body, k, middle, chunk);
        if (same_element(middle, end)) {
            evaluate_both(body, k, chunk, place);
            continue;
        }
        evaluate(body, &body->between, k, middle, chunk, place);
        enter_chunk(body, k, end, chunk);
        evaluate(body, &body->shapes, k, end, chunk, body_place(body, chunk, 0));
    }
}

void body_end_pass(Body *body, int kept)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        body->entered[k] = body->end[k];
        arrive(m, &body->shapes, k, &body->end[k]);
        arrive(m, &body->between, k, &body->middle[k]);
        if (!kept)
            body->between.place[k].position = NAN; /* chunk upon chunk: nowhere */
    }
}

int body_has_passed(const Body *body, int kept)
{
    const Model *m = body->model;
    int there = 1;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        there &= body->shapes.place[k].position == body->end[k].position;
        /* Out and back is not at rest: without `kept` the middle counts as well. */
        const double middle = body->middle[k].position;
        there &= middle == (kept ? body->between.place[k].position : body->end[k].position);
    }
    return there;
}

/* The slope of a chunk: the element's parts, weighed. */
static void mix(Body *body, const Chunk *chunk, size_t wheelset, const double weight[4])
{
    const size_t D = body->model->directions;
    for (size_t row = wheelset * D; row < (wheelset + 1) * D; row++) {
        const size_t to = body_place(body, chunk, row);
        body->kernels->mix(chunk->room, chunk->room, element_of(body, chunk, row), weight,
                           body->slope.out_re + to, body->slope.out_im + to);
    }
}

const Shapes *body_slope(Body *body, const Shapes *shapes, const double *change)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place *place = &shapes->place[k];
        double w[4], dw[4];
        enter(body, k, place);
        shape_functions(place->xi, m->element, w, dw);
        for (int j = 0; j < 4; j++)
            dw[j] *= change[k];
        for (size_t j = 0; j < m->chunks; j++)
            mix(body, &m->chunk[j], k, dw);
        const double local[2] = {-change[k] / m->element, change[k] / m->element};
        local_shapes(m, k, place, local, body->slope.local_re, body->slope.local_im);
    }
    return &body->slope;
}
