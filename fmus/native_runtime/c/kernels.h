/* Loops over modes: where the time goes. Plain loops over separate real and imaginary arrays, so
   that a compiler makes vector code of them; sums go in LANES parts, in a fixed order. */
#ifndef RAILCOSIM_KERNELS_H
#define RAILCOSIM_KERNELS_H

#include <stddef.h>

/* Every kernel is compiled for the oldest processor and, on x86-64, for AVX2 as well. */
typedef struct {
    /* out = phase_a (w0 a0 + w1 a1) + phase_b (w2 b0 + w3 b1), phases being cos + i sin; a and b
       point to the real parts of two rows, `stride` apart, imaginary parts `im` further on. */
    void (*interpolate)(size_t n, size_t stride, ptrdiff_t im, const float *restrict a,
                        const float *restrict b, const double w[4], const double phase_a[2],
                        const double phase_b[2], double *restrict out_re,
                        double *restrict out_im);
    /* g = f0 X0 + ... + f3 X3; rows of X are `stride` apart. */
    void (*drive)(size_t n, size_t stride, const double *restrict X_re,
                  const double *restrict X_im, const double f[4], double *restrict g_re,
                  double *restrict g_im);
    /* z[k] += Re sum X_k s. */
    void (*observe)(size_t n, size_t stride, const double *restrict X_re,
                    const double *restrict X_im, const double *restrict s_re,
                    const double *restrict s_im, double z[4]);
    /* G[j][k] += Re sum X_k w S_j for k >= j; rows of S are `stride` apart, too. */
    void (*respond)(size_t n, size_t stride, const double *restrict X_re,
                    const double *restrict X_im, const double *restrict w_re,
                    const double *restrict w_im, const double *restrict S_re,
                    const double *restrict S_im, double G[4][4]);
    /* y = a x + b u: complex, elementwise. */
    void (*combine)(size_t n, const double *restrict a_re, const double *restrict a_im,
                    const double *restrict x_re, const double *restrict x_im,
                    const double *restrict b_re, const double *restrict b_im,
                    const double *restrict u_re, const double *restrict u_im,
                    double *restrict y_re, double *restrict y_im);
    /* y += a x: complex, elementwise. */
    void (*add)(size_t n, const double *restrict a_re, const double *restrict a_im,
                const double *restrict x_re, const double *restrict x_im, double *restrict y_re,
                double *restrict y_im);
} Kernels;

/* The fastest that this processor runs. */
const Kernels *kernels_for_this_processor(void);

#endif
