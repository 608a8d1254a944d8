/* Loops over modes, and the small systems of equations of contacts: where the time goes. Loops over
   separate real and imaginary arrays, in vectors of LANES numbers; sums go in LANES parts, in a fixed
   order. */
#ifndef RAILCOSIM_KERNELS_H
#define RAILCOSIM_KERNELS_H

#include <stddef.h>

/* Where rows begin. */
typedef struct {
    const double *re, *im;
} Rows;

/* Every kernel is compiled for the oldest processor and, on x86-64, for AVX2 as well. Shapes are
   rows, four at a time where there are four of something, `stride` apart; what evaluates them
   and drive take whole cache lines. */
typedef struct {
    /* Shapes in an element by weights of [w_a, w_b, dw_a, dw_b], X by w and Y by v: where a wheelset
       is in the middle and at the end. a and b are parts of its nodes, `stride` apart, each node
       turned by its phase, cos + i sin; n is whole lines. */
    void (*evaluate_both)(size_t n, size_t stride, const float *restrict a,
                          const float *restrict b, const double phase_a[2],
                          const double phase_b[2], const double w[4], const double v[4],
                          double *restrict X_re, double *restrict X_im, double *restrict Y_re,
                          double *restrict Y_im);
    /* g = f0 X0 + ... + f3 X3, or (`more`) that much more. */
    void (*drive)(size_t n, size_t stride, const double *restrict X_re,
                  const double *restrict X_im, const double f[4], int more,
                  double *restrict g_re, double *restrict g_im);
    /* The same twice, g by f and d by e; imaginary parts are `im` further on. */
    void (*drive_both)(size_t n, size_t stride, const double *restrict X_re,
                       const double *restrict X_im, const double f[4], const double e[4],
                       int more, size_t im, double *restrict g, double *restrict d);
    /* z[k] += Re sum X_k s. */
    void (*observe)(size_t n, size_t stride, const double *restrict X_re,
                    const double *restrict X_im, const double *restrict s_re,
                    const double *restrict s_im, double z[4]);
    /* The same, bit for bit, and v[k] += Re sum X_k d. */
    void (*look)(size_t n, size_t stride, const double *restrict X_re,
                 const double *restrict X_im, const double *restrict s_re,
                 const double *restrict s_im, const double *restrict d_re,
                 const double *restrict d_im, double z[4], double v[4]);
    /* G[i][k] += Re sum w_i (X_k T + Y_k S) for three weights w and `rows` (1 to 4) rows of X and
       Y; imaginary parts of w are `im` behind the real ones. */
    void (*respond)(size_t n, size_t stride, size_t rows, const Rows *X, const Rows *Y,
                    const Rows *S, const Rows *T, const double *const w[3], size_t im,
                    double G[3][4]);
    /* y += a x: complex, elementwise. */
    void (*add)(size_t n, const double *restrict a_re, const double *restrict a_im,
                const double *restrict x_re, const double *restrict x_im, double *restrict y_re,
                double *restrict y_im);
    /* y = p0 x + p1 g0 + p2 gm + p3 g1: complex, elementwise. Imaginary parts of g are `im_g` behind
       the real ones, of the others `im`. */
    void (*advance)(size_t n, size_t im, size_t im_g, const double *const p[4], const double *x,
                    const double *g0, const double *gm, const double *g1, double *y);
    /* The same, and w = q0 x + q1 g0 + q2 gm + q3 g1 - (x + y) / 6. */
    void (*advance_both)(size_t n, size_t im, size_t im_g, const double *const p[4],
                         const double *const q[4], const double *x, const double *g0,
                         const double *gm, const double *g1, double *y, double *w);
    /* y += (p0 + p1 + p2) mean + (p2 - p0) slope. */
    void (*add_line)(size_t n, size_t im, size_t im_g, const double *const p[3],
                     const double *mean, const double *slope, double *y);
    /* y += A x: A is (rows, n). */
    void (*add_product)(size_t rows, size_t n, const double *restrict A, const double *restrict x,
                        double *restrict y);
    /* C -= A B: A is (rows, k), B (k, n). */
    void (*take_product)(size_t rows, size_t k, size_t n, const double *restrict A,
                         const double *restrict B, double *restrict C);
    /* Factors of A, (n, n), in its place, by elimination with pivoting: step k took row[k]. 0: A is
       singular or not finite. */
    int (*factor)(size_t n, double *restrict A, size_t *restrict row);
    /* x of A x = b, in place of b, by these. */
    void (*substitute)(size_t n, const double *restrict A, const size_t *restrict row,
                       double *restrict b);
    /* 0 if all x are finite; else no number. */
    double (*finite)(size_t n, const double *x);
} Kernels;

/* The fastest that this processor runs. */
const Kernels *kernels_for_this_processor(void);

#endif
