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
    Place place = {far < 4096 ? nearbyint(position / GRID) * GRID : position, 0, 0, 0, 0};
    double around = fmod(place.position, m->length);
    if (around < 0)
        around += m->length;
    const double c = fmin(floor(around / m->cell_length), (double)(m->cells - 1));
    const double in_cell = fmax(around - c * m->cell_length, 0.0);
    const Stretch *stretch = m->stretch;
    while (in_cell >= stretch->end)
        stretch++;
    const double inside = (in_cell - stretch->begin) / stretch->element;
    const double e = fmin(floor(inside), (double)(stretch->elements - 1));
    place.cell = (size_t)c;
    place.node = (size_t)m->begins[stretch->first + (size_t)e];
    place.xi = inside - e;
    place.element = stretch->element;
    return place;
}

double body_rounded(const Model *m, double position) { return locate(m, position).position; }

/* Weights of [w_a, w_b, dw_a, dw_b] at the nodes of an element: Hermite's cubic, and its derivative
   along x. No kinks at nodes. */
static void shape_functions(double xi, double length, double w[4], double dw[4])
{
    const double xi2 = xi * xi, xi3 = xi2 * xi;
    w[1] = -2 * xi3 + 3 * xi2;
    w[0] = 1 - w[1];
    w[2] = length * (xi3 - 2 * xi2 + xi);
    w[3] = length * (xi3 - xi2);
    dw[1] = 6 / length * (xi - xi2);
    dw[0] = -dw[1];
    dw[2] = 3 * xi2 - 4 * xi + 1;
    dw[3] = 3 * xi2 - 2 * xi;
}

static int same_element(const Place *a, const Place *b)
{
    return a->cell == b->cell && a->node == b->node;
}

/* Shapes of a wheelset in an element, for a chunk, by two sets of weights: X and Y. */
static void evaluate_both(const Body *body, const Place *place, const Chunk *chunk,
                          const double w[4], const double v[4], double *X_re, double *X_im,
                          double *Y_re, double *Y_im)
{
    const Model *m = body->model;
    const size_t last = place->node + 1 == m->nodes; /* the next node is the next cell's first */
    const double *phase_a = m->phase + 2 * place->cell * m->segments;
    const double *phase_b = m->phase + 2 * ((place->cell + last) % m->cells) * m->segments;
    for (size_t d = 0; d < chunk->moving; d++) {
        const float *a = model_node(m, chunk, place->node) + NODE_PARTS * d * chunk->room;
        const float *b = model_node(m, chunk, last ? 0 : place->node + 1) +
                         NODE_PARTS * d * chunk->room;
        for (size_t j = chunk->first; j < chunk->end; j++) {
            const size_t at = m->segment[j].to - chunk->to, to = d * chunk->room + at;
            body->kernels->evaluate_both(whole_lines(m->segment[j].size), chunk->room, a + at,
                                         b + at, phase_a + 2 * j, phase_b + 2 * j, w, v,
                                         X_re + to, X_im + to, Y_re + to, Y_im + to);
        }
    }
}

/* The same by one set. */
static void evaluate(const Body *body, const Place *place, const Chunk *chunk, const double w[4],
                     double *X_re, double *X_im)
{
    evaluate_both(body, place, chunk, w, w, X_re, X_im, body->spare,
                  body->spare + body->model->motions * body->model->width);
}

/* Shapes of the local modes of a wheelset, Hermite's cubic between places of their table; or how
   they change by `change` along the track, m. */
static void local_shapes(const Model *m, size_t wheelset, const Place *place, const double *change,
                         Shapes *to)
{
    const double *re = m->local_shape.re, *im = m->local_shape.im, parts = (double)m->parts;
    const double part = fmin(floor(place->xi * parts), parts - 1), xi = place->xi * parts - part;
    double w[4], dw[4];
    shape_functions(xi, place->element / parts, w, dw);
    if (change != NULL)
        for (size_t j = 0; j < 4; j++)
            w[j] = *change * dw[j];
    const size_t D = m->directions, slope = m->motions * D, at = place->node * m->parts;
    const size_t next = at + (size_t)part + 1 == m->nodes * m->parts ? 0 : at + (size_t)part + 1;
    for (size_t k = 0; k < D * D; k++)
        for (size_t side = 0; side < m->sides; side++) {
            const size_t j = (side * m->side_contacts + wheelset * D) * D + k;
            const size_t own = m->apart ? side * D * D + k : k;
            const size_t a = 2 * (at + (size_t)part) * slope + own, b = 2 * next * slope + own;
            const double sign = side > 0 && !m->apart ? m->mirror[k / D] : 1;
            to->local_re[j] = sign * (w[0] * re[a] + w[1] * re[b] + w[2] * re[a + slope] +
                                      w[3] * re[b + slope]);
            to->local_im[j] = sign * (w[0] * im[a] + w[1] * im[b] + w[2] * im[a + slope] +
                                      w[3] * im[b + slope]);
        }
}

/* Take note of where shapes of a wheelset now are. */
static void arrive(const Model *m, Shapes *shapes, size_t wheelset, const Place *place)
{
    local_shapes(m, wheelset, place, NULL, shapes);
    body_seen_shapes(m, wheelset, place->position, 1, 0, shapes->seen_re, shapes->seen_im);
    shapes->place[wheelset] = *place;
}

/* Of one wheelset, for all chunks. */
static void evaluate_all(const Body *body, const Shapes *shapes, size_t wheelset,
                         const Place *place, const double w[4])
{
    const Model *m = body->model;
    for (size_t j = 0; j < m->chunks; j++) {
        const size_t to = body_place(body, &m->chunk[j], wheelset * m->chunk[j].moving);
        evaluate(body, place, &m->chunk[j], w, shapes->out_re + to, shapes->out_im + to);
    }
}

static const Shapes *shapes_at(Body *body, Shapes *shapes, const double *position)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place place = locate(m, position[k]);
        if (place.position == shapes->place[k].position)
            continue;
        double w[4], dw[4];
        shape_functions(place.xi, place.element, w, dw);
        evaluate_all(body, shapes, k, &place, w);
        arrive(m, shapes, k, &place);
    }
    return shapes;
}

/* Whether these are shapes at positions. */
static int stand(const Model *m, const Shapes *shapes, const double *position)
{
    int there = 1;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        there &= shapes->place[k].position == body_rounded(m, position[k]);
    return there;
}

static void turn(Body *body)
{
    const Shapes now = body->shapes;
    body->shapes = body->before;
    body->before = now;
}

const Shapes *body_keep(Body *body, const double *begin)
{
    if (stand(body->model, &body->before, begin))
        return &body->shapes;
    turn(body);
    return &body->before;
}

const Shapes *body_shapes(Body *body, const double *position)
{
    if (!stand(body->model, &body->shapes, position))
        turn(body);
    return shapes_at(body, &body->shapes, position);
}

const Shapes *body_shapes_between(Body *body, const double *position)
{
    return shapes_at(body, body->model->nodes > 0 ? &body->between : &body->shapes, position);
}

void body_choose_part(Body *body, size_t part)
{
    const size_t n = body->model->wheelsets;
    body->middle = body->middles + part * n;
    body->end = body->ends + part * n;
    body->weights = body->all_weights + 8 * part * n;
}

void body_begin_pass(Body *body, const double *middle, const double *end)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        body->middle[k] = locate(m, middle[k]);
        body->end[k] = locate(m, end[k]);
        double dw[4], *weights = body->weights + 8 * k;
        shape_functions(body->middle[k].xi, body->middle[k].element, weights, dw);
        shape_functions(body->end[k].xi, body->end[k].element, weights + 4, dw);
    }
}

/* Shapes in the middle, from `place` on among those between, and at the end, from row 0 of `at` on. */
static void pass(Body *body, const Chunk *chunk, size_t place, const Shapes *to, size_t at)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place *middle = &body->middle[k], *end = &body->end[k];
        const double *w = body->weights + 8 * k, *v = w + 4;
        const size_t row = k * chunk->moving * chunk->room;
        double *X_re = body->between.out_re + place + row, *X_im = body->between.out_im + place + row;
        double *Y_re = to->out_re + at + row, *Y_im = to->out_im + at + row;
        if (same_element(middle, end)) {
            evaluate_both(body, end, chunk, w, v, X_re, X_im, Y_re, Y_im);
        } else {
            evaluate(body, middle, chunk, w, X_re, X_im);
            evaluate(body, end, chunk, v, Y_re, Y_im);
        }
    }
}

void body_pass(Body *body, const Chunk *chunk, size_t place)
{
    pass(body, chunk, place, &body->shapes, body_place(body, chunk, 0));
}

void body_pass_by(Body *body, const Chunk *chunk, size_t place)
{
    pass(body, chunk, place, &body->slope, 0);
}

void body_end_pass_by(Body *body)
{
    const Model *m = body->model;
    for (size_t k = 0; k < m->wheelsets; k++) {
        arrive(m, &body->slope, k, &body->end[k]);
        arrive(m, &body->between, k, &body->middle[k]);
        body->between.place[k].position = NAN; /* chunk upon chunk: nowhere */
    }
}

void body_end_pass(Body *body, int kept)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
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

int body_stays(const Body *body)
{
    const Model *m = body->model;
    int stays = body_has_passed(body, 1);
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++)
        stays &= body->middle[k].position == body->end[k].position;
    return stays;
}

const Shapes *body_slope(Body *body, const Shapes *shapes, const double *change)
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < m->wheelsets; k++) {
        const Place *place = &shapes->place[k];
        double w[4], dw[4];
        shape_functions(place->xi, place->element, w, dw);
        for (int j = 0; j < 4; j++)
            dw[j] *= change[k];
        evaluate_all(body, &body->slope, k, place, dw);
        local_shapes(m, k, place, &change[k], &body->slope);
        body_seen_shapes(m, k, place->position, 0, change[k], body->slope.seen_re,
                         body->slope.seen_im);
    }
    return &body->slope;
}
