#include "gaps.h"

#include <math.h>
#include <string.h>

/* As in mechanics/gaps.py. */
enum { MOST_STEPS = 50 };
static const double SMALLEST_PART = 1e-3, ROUNDING = 1e-13;

void gaps_lay_out(GapWork *work, const Model *m, Arrays *arrays)
{
    const size_t n = m->gaps.count;
    double **each[] = {&work->begin, &work->end,  &work->force,  &work->slope,  &work->off,
                       &work->step,  &work->free, &work->dbegin, &work->dforce, &work->closed};
    double **square[] = {&work->G, &work->S, &work->A};
    for (size_t k = 0; k < sizeof each / sizeof *each; k++)
        *each[k] = arrays_take(arrays, n);
    for (size_t k = 0; k < sizeof square / sizeof *square; k++)
        *square[k] = arrays_take(arrays, n * n);
    work->row = (size_t *)arrays_take(arrays, n);
    work->weight = arrays_take(arrays, n > 0 ? 2 * m->modes : 0);
    work->R = arrays_take(arrays, n * m->contacts);
    work->part = arrays_take(arrays, n * (m->contacts + 1));
}

void gaps_stretch(const Model *m, const double *x, double *stretch)
{
    for (size_t k = 0; k < m->gaps.count; k++) {
        const double *re = m->gaps.shown.re + k * m->ring, *im = m->gaps.shown.im + k * m->ring;
        double sum = 0;
        for (size_t r = 0; r < m->ring; r++)
            sum += re[r] * x[r] - im[r] * x[m->modes + r];
        stretch[k] = sum;
    }
}

/* Add what forces that press move the modes by, which a weight says, real parts first. */
static void press(const Model *m, const double *weight, const double *force, double *x)
{
    const double *w_re = weight, *w_im = weight + m->modes;
    for (size_t k = 0; k < m->gaps.count; k++) {
        const double *re = m->gaps.shown.re + k * m->ring, *im = m->gaps.shown.im + k * m->ring;
        for (size_t r = 0; r < m->ring && force[k] != 0; r++) {
            x[r] -= force[k] * (w_re[r] * re[r] - w_im[r] * im[r]);
            x[m->modes + r] -= force[k] * (w_re[r] * im[r] + w_im[r] * re[r]);
        }
    }
}

/* Stretches by forces that move modes by a weight. */
static void compliance(const Model *m, const double *weight, double *G)
{
    const size_t n = m->gaps.count;
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j <= k; j++) {
            const double *a = m->gaps.shown.re + k * m->ring, *b = m->gaps.shown.im + k * m->ring;
            const double *c = m->gaps.shown.re + j * m->ring, *d = m->gaps.shown.im + j * m->ring;
            double sum = 0;
            for (size_t r = 0; r < m->ring; r++)
                sum += (a[r] * c[r] - b[r] * d[r]) * weight[r] -
                       (a[r] * d[r] + b[r] * c[r]) * weight[m->modes + r];
            G[k * n + j] = G[j * n + k] = sum;
        }
}

/* Forces and their derivatives by stretches at the end; h = 0: at rest. */
static void law(const Model *m, const GapWork *work, double h, const double *end, double *force,
                double *slope)
{
    for (size_t i = 0; i < m->gaps.count; i++) {
        const double k = m->gaps.stiffness[i], gap = m->gaps.gap[i];
        const double q = fmax(end[i] - gap, 0.0);
        if (h == 0) {
            force[i] = k * q;
            slope[i] = q > 0 ? k : 0;
            continue;
        }
        const double c = m->gaps.damping[i] / h, p = fmax(work->begin[i] - gap, 0.0);
        const int mixed = (p > 0) != (q > 0);
        const double part = mixed ? (q - p) / (end[i] - work->begin[i]) : p > 0;
        const double f = k * part * (p + q) / 2 + c * (q - p);
        const double closing = (p > 0 ? k / 2 : k * part * (1 - part / 2)) + c;
        force[i] = fmax(f, 0.0);
        slope[i] = f > 0 ? (q > 0 ? closing : k * part * part / 2) : 0;
    }
}

/* How far stretches at the end are from what forces leave of the free ones; the largest. */
static double find_off(size_t n, const double *G, GapWork *work)
{
    double largest = 0;
    for (size_t k = 0; k < n; k++) {
        double sum = work->end[k] - work->free[k];
        for (size_t j = 0; j < n; j++)
            sum += G[k * n + j] * work->force[j];
        work->off[k] = sum;
        largest = fmax(largest, fabs(sum));
    }
    return largest;
}

/* x of A x = b, in place. */
static int eliminate(const Body *body, size_t n, GapWork *work, double *b)
{
    if (!body->kernels->factor(n, work->A, work->row))
        return 0;
    body->kernels->substitute(n, work->A, work->row, b);
    return 1;
}

/* x of (1 + G slope) x = b, in place. */
static int solve(const Body *body, size_t n, const double *G, GapWork *work, double *b)
{
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++)
            work->A[k * n + j] = (k == j) + G[k * n + j] * work->slope[j];
    return eliminate(body, n, work, b);
}

/* Forces that agree with the stretches they leave of work->free. */
static int balance_gaps(const Body *body, GapWork *work, double h, const double *G)
{
    const Model *m = body->model;
    const size_t n = m->gaps.count;
    memcpy(work->end, work->free, n * sizeof(double));
    law(m, work, h, work->end, work->force, work->slope);
    double wrong = find_off(n, G, work);
    for (int step = 0; step < MOST_STEPS; step++) {
        memcpy(work->step, work->off, n * sizeof(double));
        if (!solve(body, n, G, work, work->step))
            return 0;
        double part = 1, taken = 0, most = 0, size = 0, now;
        for (;; part /= 2) {
            for (size_t k = 0; k < n; k++)
                work->end[k] -= (part - taken) * work->step[k];
            taken = part;
            law(m, work, h, work->end, work->force, work->slope);
            now = find_off(n, G, work);
            if (now <= wrong || part < SMALLEST_PART)
                break;
        }
        wrong = now;
        for (size_t k = 0; k < n; k++) {
            most = fmax(most, fabs(work->step[k]));
            size = fmax(size, fabs(work->end[k]));
        }
        if (most <= ROUNDING * size)
            break;
    }
    return body->kernels->finite(n, work->force) == 0;
}

/* Compliance over a step, of one force for all of it. */
static void prepare(const Model *m, GapWork *work, const Coefficients *c)
{
    if (work->h == c->h)
        return;
    for (size_t r = 0; r < 2 * m->modes; r++)
        work->weight[r] = c->end.by[0][r] + c->end.by[1][r] + c->end.by[2][r];
    compliance(m, work->weight, work->G);
    work->h = c->h;
}

int gaps_step(const Body *body, GapWork *work, const Coefficients *c, const double *x,
              double *next)
{
    const Model *m = body->model;
    prepare(m, work, c);
    gaps_stretch(m, x, work->begin);
    gaps_stretch(m, next, work->free);
    if (!balance_gaps(body, work, c->h, work->G))
        return 0;
    press(m, work->weight, work->force, next);
    return 1;
}

int gaps_step_change(const Body *body, GapWork *work, const Coefficients *c, const double *begin,
                     const double *dbegin, double *next, double *dnext)
{
    const Model *m = body->model;
    const size_t n = m->gaps.count;
    prepare(m, work, c);
    memmove(work->begin, begin, n * sizeof(double));
    gaps_stretch(m, next, work->free);
    if (!balance_gaps(body, work, c->h, work->G))
        return 0;
    press(m, work->weight, work->force, next);
    /* By the beginning forces change as they do by the end, turned round but for the spring. */
    for (size_t i = 0; i < n; i++) {
        const double k = m->gaps.stiffness[i], damping = m->gaps.damping[i] / c->h;
        const double p = fmax(work->begin[i] - m->gaps.gap[i], 0.0);
        const double q = fmax(work->end[i] - m->gaps.gap[i], 0.0);
        const int mixed = (p > 0) != (q > 0);
        const double part = mixed ? (q - p) / (work->end[i] - work->begin[i]) : p > 0;
        const double opening = (q > 0 ? k / 2 : k * part * (1 - part / 2)) - damping;
        const double slope = p > 0 ? opening : k * part * part / 2;
        work->dforce[i] = work->force[i] > 0 ? slope * dbegin[i] : 0;
    }
    gaps_stretch(m, dnext, work->off);
    for (size_t k = 0; k < n; k++)
        for (size_t j = 0; j < n; j++)
            work->off[k] -= work->G[k * n + j] * work->dforce[j];
    if (!solve(body, n, work->G, work, work->off))
        return 0;
    for (size_t k = 0; k < n; k++)
        work->dforce[k] += work->slope[k] * work->off[k];
    press(m, work->weight, work->dforce, dnext);
    return 1;
}

static void prepare_rest(const Body *body, GapWork *work)
{
    if (!work->known)
        compliance(body->model, body->flexibility, work->S);
    work->known = 1;
}

int gaps_rest(const Body *body, GapWork *work, double *x)
{
    prepare_rest(body, work);
    gaps_stretch(body->model, x, work->free);
    if (!balance_gaps(body, work, 0, work->S))
        return 0;
    press(body->model, body->flexibility, work->force, x);
    for (size_t k = 0; k < body->model->gaps.count; k++)
        work->closed[k] = work->force[k] > 0;
    return 1;
}

int gaps_rest_change(const Body *body, GapWork *work, double *dx)
{
    const Model *m = body->model;
    const size_t n = m->gaps.count;
    prepare_rest(body, work);
    for (size_t k = 0; k < n; k++)
        work->slope[k] = m->gaps.stiffness[k] * work->closed[k];
    gaps_stretch(m, dx, work->off);
    if (!solve(body, n, work->S, work, work->off))
        return 0;
    for (size_t k = 0; k < n; k++)
        work->dforce[k] = work->slope[k] * work->off[k];
    press(m, body->flexibility, work->dforce, dx);
    return 1;
}

/* x of (1 / k + S) x = b for those closed, and x = 0 for others, in place. */
static void of_closed(const Body *body, GapWork *work, double *b)
{
    const size_t n = body->model->gaps.count;
    for (size_t k = 0; k < n; k++) {
        const int closed = work->closed[k] != 0;
        b[k] = closed ? b[k] : 0;
        for (size_t j = 0; j < n; j++)
            work->A[k * n + j] =
                (k == j) * (closed ? 1 / body->model->gaps.stiffness[k] : 1) +
                (closed && work->closed[j] != 0 ? work->S[k * n + j] : 0);
    }
    eliminate(body, n, work, b);
}

void gaps_soften(const Body *body, const Shapes *shapes, GapWork *work, double *G, double *lifted)
{
    const Model *m = body->model;
    const size_t n = m->gaps.count, C = m->contacts;
    double *x = work->weight; /* as the displacements of a state */
    prepare_rest(body, work);
    for (size_t k = 0; k < n; k++) {
        memset(x, 0, 2 * m->modes * sizeof(double));
        memset(work->off, 0, n * sizeof(double));
        work->off[k] = -1;
        press(m, body->flexibility, work->off, x);
        body_observe(body, shapes, x, work->R + k * C);
    }
    work->h = 0;
    for (size_t c = 0; c <= C; c++) { /* of a unit force at each contact; of the gaps themselves */
        double *own = work->part + c * n;
        for (size_t k = 0; k < n; k++)
            own[k] = c < C ? work->R[k * C + c] : m->gaps.gap[k];
        of_closed(body, work, own);
    }
    for (size_t c = 0; c < C; c++)
        for (size_t d = 0; d <= C; d++) {
            double sum = 0;
            for (size_t k = 0; k < n; k++)
                sum += work->R[k * C + c] * work->part[d * n + k];
            if (d < C)
                G[c * C + d] -= sum;
            else
                lifted[c] = sum;
        }
}

int gaps_stay(const Body *body, GapWork *work, const double *force)
{
    const Model *m = body->model;
    const size_t n = m->gaps.count;
    int same = 1;
    for (size_t k = 0; k < n; k++) {
        work->free[k] = 0;
        for (size_t c = 0; c < m->contacts; c++)
            work->free[k] += work->R[k * m->contacts + c] * force[c];
        work->off[k] = work->free[k] - m->gaps.gap[k];
    }
    of_closed(body, work, work->off);
    for (size_t k = 0; k < n; k++) {
        double stretch = work->free[k];
        for (size_t j = 0; j < n; j++)
            stretch -= work->S[k * n + j] * work->off[j];
        work->step[k] = stretch > m->gaps.gap[k];
        same &= work->step[k] == work->closed[k];
    }
    memcpy(work->closed, work->step, n * sizeof(double));
    return same;
}
