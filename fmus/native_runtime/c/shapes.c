/* Mode shapes of a body at its wheelsets, and how they change along the track. */
#include "body.h"

#include <math.h>

/* Places (m) are rounded to this. A position extrapolated and the same position set from outside
   then are one place, whose shapes need not be computed twice; shapes change by 1e-11 of
   themselves over it. */
static const double GRID = 1.0 / (1ll << 40);

/* Where on the ring: cell, first node of the element, and how far into the element (0..1). */
static void locate(const Model *m, double x, size_t *cell, size_t *node, double *xi)
{
    double around = fmod(x, m->length);
    if (around < 0)
        around += m->length;
    const double c = fmin(floor(around / m->cell_length), (double)(m->cells - 1));
    const double inside = fmax(around - c * m->cell_length, 0.0) / m->element;
    const double e = fmin(floor(inside), (double)(m->nodes - 1));
    *cell = (size_t)c;
    *node = (size_t)e;
    *xi = inside - e;
}

/* Hermite's cubic from [w_a, dw_a, w_b, dw_b], and its derivative along x: no kinks at nodes. */
static void shape_functions(double xi, double length, double w[4], double dw[4])
{
    const double xi2 = xi * xi, xi3 = xi2 * xi;
    w[0] = 2 * xi3 - 3 * xi2 + 1;
    w[1] = length * (xi3 - 2 * xi2 + xi);
    w[2] = -2 * xi3 + 3 * xi2;
    w[3] = length * (xi3 - xi2);
    dw[0] = 6 / length * (xi2 - xi);
    dw[1] = 3 * xi2 - 4 * xi + 1;
    dw[2] = 6 / length * (xi - xi2);
    dw[3] = 3 * xi2 - 2 * xi;
}

/* Shapes of one wheelset with given weights of the nodes' values. */
static void interpolate(Body *body, Shapes *shapes, size_t k, size_t cell, size_t node,
                        const double w[4], const double local[2])
{
    const Model *m = body->model;
    const size_t n = m->ring, last = node + 1 == m->nodes;
    const size_t next_cell = (cell + last) % m->cells, next = last ? 0 : node + 1;
    const double *phase_a = m->phase + 2 * cell * m->segments;
    const double *phase_b = m->phase + 2 * next_cell * m->segments;
    for (size_t j = 0; j < m->segments; j++) {
        const size_t to = m->segment[j].to;
        body->kernels->interpolate(m->segment[j].size, n, m->table_im - m->table_re,
                                   m->table_re + 2 * node * n + to, m->table_re + 2 * next * n + to,
                                   w, phase_a + 2 * j, phase_b + 2 * j,
                                   shapes->out_re + k * n + to, shapes->out_im + k * n + to);
    }
    const double *re = m->local_shape.re, *im = m->local_shape.im;
    shapes->local_re[k] = shapes->local_re[k + 4] = local[0] * re[node] + local[1] * re[next];
    shapes->local_im[k] = shapes->local_im[k + 4] = local[0] * im[node] + local[1] * im[next];
}

const Shapes *body_shapes(Body *body, const double position[WHEELSETS])
{
    const Model *m = body->model;
    Shapes *shapes = &body->shapes;
    if (m->nodes == 0)
        return shapes;
    for (size_t k = 0; k < WHEELSETS; k++) {
        /* Far away a double is coarser than the grid, and too large for the rounding. */
        const double far = fabs(position[k]);
        const double x = far < 4096 ? nearbyint(position[k] / GRID) * GRID : position[k];
        if (shapes->known && x == shapes->position[k])
            continue;
        size_t cell, node;
        double xi, w[4], dw[4];
        locate(m, x, &cell, &node, &xi);
        shape_functions(xi, m->element, w, dw);
        const double local[2] = {1 - xi, xi};
        interpolate(body, shapes, k, cell, node, w, local);
        shapes->position[k] = x;
    }
    shapes->known = 1;
    return shapes;
}

const Shapes *body_slope(Body *body, const double change[WHEELSETS])
{
    const Model *m = body->model;
    for (size_t k = 0; m->nodes > 0 && k < WHEELSETS; k++) {
        size_t cell, node;
        double xi, w[4], dw[4];
        locate(m, body->shapes.position[k], &cell, &node, &xi);
        shape_functions(xi, m->element, w, dw);
        for (int j = 0; j < 4; j++)
            dw[j] *= change[k];
        const double local[2] = {-change[k] / m->element, change[k] / m->element};
        interpolate(body, &body->slope, k, cell, node, dw, local);
    }
    return &body->slope;
}
