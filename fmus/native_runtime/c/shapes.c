/* Mode shapes of a body at its wheelsets, how they change along the track, and what rolling
   wheelsets do over a step. */
#include "body.h"

#include <math.h>
#include <string.h>

/* Places (m) are rounded to this. A position extrapolated and the same position set from outside
   then are one place, whose shapes need not be computed twice; shapes change by 1e-11 of
   themselves over it. */
static const double GRID = 1.0 / (1ll << 40);

enum { CHUNK = 128 }; /* modes whose shapes at four wheelsets stay in the nearest memory */

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

static double *element_of(const Body *body, size_t row)
{
    return body->element + row * ELEMENT_PARTS * body->model->width;
}

static int same_element(const Place *a, const Place *b)
{
    return a->cell == b->cell && a->node == b->node;
}

/* Take a wheelset's element from the table, unless it is there. */
static void enter(Body *body, size_t wheelset, const Place *place)
{
    const Model *m = body->model;
    Place *entered = &body->entered[wheelset];
    if (same_element(entered, place))
        return;
    *entered = *place;
    const size_t n = m->ring, last = place->node + 1 == m->nodes, values = 2 * m->directions;
    const size_t next_cell = (place->cell + last) % m->cells, next = last ? 0 : place->node + 1;
    const double *phase_a = m->phase + 2 * place->cell * m->segments;
    const double *phase_b = m->phase + 2 * next_cell * m->segments;
    for (size_t d = 0; d < m->directions; d++) {
        double *element = element_of(body, wheelset * m->directions + d);
        const float *a = m->table_re + (values * place->node + 2 * d) * n;
        const float *b = m->table_re + (values * next + 2 * d) * n;
        for (size_t j = 0; j < m->segments; j++) {
            const Segment *s = &m->segment[j];
            body->kernels->enter(s->size, n, m->table_im - m->table_re, a + s->to, b + s->to,
                                 phase_a + 2 * j, phase_b + 2 * j, m->width, element + s->out);
        }
    }
}

/* Shapes of the local modes of a wheelset with given weights of the values at both nodes. */
static void local_shapes(const Model *m, size_t wheelset, const Place *place,
                         const double weight[2], double *to_re, double *to_im)
{
    const double *re = m->local_shape.re, *im = m->local_shape.im;
    const size_t D = m->directions, next = place->node + 1 == m->nodes ? 0 : place->node + 1;
    for (size_t d = 0; d < D; d++)
        for (size_t side = 0; side < m->sides; side++) {
            const size_t to = side * m->rows + wheelset * D + d;
            to_re[to] = weight[0] * re[place->node * D + d] + weight[1] * re[next * D + d];
            to_im[to] = weight[0] * im[place->node * D + d] + weight[1] * im[next * D + d];
        }
}

/* Shapes of one wheelset, whose element is there, for modes `from` to `from` + `size`. */
static void evaluate(Body *body, Shapes *shapes, size_t wheelset, const Place *place, size_t from,
                     size_t size)
{
    const Model *m = body->model;
    double w[4], dw[4];
    shape_functions(place->xi, m->element, w, dw);
    for (size_t d = 0; d < m->directions; d++) {
        const size_t row = wheelset * m->directions + d, to = row * m->width + from;
        body->kernels->evaluate(size, m->width, element_of(body, row) + from, w + 1,
                                shapes->out_re + to, shapes->out_im + to);
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
        evaluate(body, shapes, k, &place, 0, m->width);
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

void body_pass(Body *body, const double *middle, const double *end)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place between = locate(m, middle[k]), at = locate(m, end[k]);
        if (!same_element(&between, &at) || between.position == at.position)
            continue; /* one after the other, or but one */
        enter(body, k, &at);
        for (size_t from = 0; from < m->width; from += CHUNK) {
            const size_t left = m->width - from, size = left < CHUNK ? left : CHUNK;
            evaluate(body, &body->between, k, &between, from, size);
            evaluate(body, &body->shapes, k, &at, from, size);
        }
        arrive(m, &body->between, k, &between);
        arrive(m, &body->shapes, k, &at);
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
        for (size_t d = 0; d < m->directions; d++) {
            const size_t row = k * m->directions + d, to = row * m->width;
            body->kernels->mix(m->width, m->width, element_of(body, row), dw, 0,
                               body->slope.out_re + to, body->slope.out_im + to);
        }
        const double local[2] = {-change[k] / m->element, change[k] / m->element};
        local_shapes(m, k, place, local, body->slope.local_re, body->slope.local_im);
    }
    return &body->slope;
}

/* Of one parity, modes `from` to `from` + `size`: what moves them at the start, if g0 is not NULL,
   and in the middle. */
static void roll_to_middle(Body *body, size_t from, size_t size, const double *f0,
                           const double *fm, double *g0, double *gm)
{
    const Model *m = body->model;
    if (g0 != NULL)
        body_drive_modes(body, &body->shapes, from, size, f0, g0);
    for (size_t row = 0; row < m->rows; row++) {
        double w[4], dw[4];
        shape_functions(body->middle[row / m->directions].xi, m->element, w, dw);
        for (int j = 0; j < 4; j++)
            w[j] *= fm[row];
        body->kernels->mix(size, m->width, element_of(body, row) + from, w, row > 0, gm + from,
                           gm + m->drives + from);
    }
}

/* The same at the end, and its shapes. */
static void roll_to_end(Body *body, size_t from, size_t size, const double *f1, double *g1)
{
    for (size_t k = 0; k < body->model->wheelsets; k++)
        evaluate(body, &body->shapes, k, &body->end[k], from, size);
    body_drive_modes(body, &body->shapes, from, size, f1, g1);
}

const Shapes *body_roll(Body *body, const double *force0, const double *middle,
                        const double *force_m, const double *end, const double *force1,
                        double *g0, double *gm, double *g1)
{
    const Model *m = body->model;
    if (m->nodes == 0) { /* shapes that are the same everywhere */
        if (g0 != NULL)
            body_drive(body, &body->shapes, force0, g0);
        body_drive(body, &body->shapes, force_m, gm);
        body_drive(body, &body->shapes, force1, g1);
        return &body->shapes;
    }
    double *const *f0 = body->by_parity, *const *fm = f0 + 2, *const *f1 = f0 + 4;
    const size_t begin[3] = {0, m->odd_at, m->width};
    int together = 1; /* in the middle and at the end wheelsets are in the same elements */
    if (g0 != NULL)
        body_drive_local(m, body->shapes.local_re, body->shapes.local_im, force0, g0);
    for (size_t k = 0; k < m->wheelsets; k++) {
        body->middle[k] = locate(m, middle[k]);
        body->end[k] = locate(m, end[k]);
        together &= same_element(&body->middle[k], &body->end[k]);
        enter(body, k, &body->middle[k]);
        const double local[2] = {1 - body->middle[k].xi, body->middle[k].xi};
        local_shapes(m, k, &body->middle[k], local, body->local, body->local + m->contacts);
    }
    body_drive_local(m, body->local, body->local + m->contacts, force_m, gm);
    if (g0 != NULL)
        body_split(m, force0, f0[0], f0[1]);
    body_split(m, force_m, fm[0], fm[1]);
    body_split(m, force1, f1[0], f1[1]);
    /* By chunks that stay in the nearest memory, unless elements change between. */
    for (int odd = 0; odd < 2; odd++)
        for (size_t from = begin[odd]; from < begin[odd + 1]; from += CHUNK) {
            const size_t left = begin[odd + 1] - from, size = left < CHUNK ? left : CHUNK;
            roll_to_middle(body, from, size, f0[odd], fm[odd], g0, gm);
            if (together)
                roll_to_end(body, from, size, f1[odd], g1);
        }
    for (size_t k = 0; k < m->wheelsets; k++) {
        enter(body, k, &body->end[k]);
        arrive(m, &body->shapes, k, &body->end[k]);
    }
    for (int odd = 0; odd < 2 && !together; odd++)
        roll_to_end(body, begin[odd], begin[odd + 1] - begin[odd], f1[odd], g1);
    body_drive_local(m, body->shapes.local_re, body->shapes.local_im, force1, g1);
    return &body->shapes;
}
