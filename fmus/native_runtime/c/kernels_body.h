/* Bodies of the kernels; included by kernels.c once for each instruction set, with NAME(kernel)
   and TARGET (a function attribute) defined. */

/* The other three rows of X, each with a pointer of its own. */
#define ROWS                                                                                 \
    const double *restrict X1_re = X_re + stride, *restrict X1_im = X_im + stride;           \
    const double *restrict X2_re = X1_re + stride, *restrict X2_im = X1_im + stride;         \
    const double *restrict X3_re = X2_re + stride, *restrict X3_im = X2_im + stride

TARGET static void NAME(interpolate)(size_t n, size_t stride, ptrdiff_t im,
                                     const float *restrict a, const float *restrict b,
                                     const double w[4], const double phase_a[2],
                                     const double phase_b[2], double *restrict out_re,
                                     double *restrict out_im)
{
    const double w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3];
    const double ca = phase_a[0], sa = phase_a[1], cb = phase_b[0], sb = phase_b[1];
    const float *restrict a_im = a + im, *restrict b_im = b + im;
    for (size_t r = 0; r < n; r++) {
        const double a_r = w0 * (double)a[r] + w1 * (double)a[stride + r];
        const double a_i = w0 * (double)a_im[r] + w1 * (double)a_im[stride + r];
        const double b_r = w2 * (double)b[r] + w3 * (double)b[stride + r];
        const double b_i = w2 * (double)b_im[r] + w3 * (double)b_im[stride + r];
        out_re[r] = ca * a_r - sa * a_i + cb * b_r - sb * b_i;
        out_im[r] = ca * a_i + sa * a_r + cb * b_i + sb * b_r;
    }
}

TARGET static void NAME(drive)(size_t n, size_t stride, const double *restrict X_re,
                               const double *restrict X_im, const double f[4],
                               double *restrict g_re, double *restrict g_im)
{
    const double f0 = f[0], f1 = f[1], f2 = f[2], f3 = f[3];
    ROWS;
    for (size_t r = 0; r < n; r++) {
        g_re[r] = f0 * X_re[r] + f1 * X1_re[r] + f2 * X2_re[r] + f3 * X3_re[r];
        g_im[r] = f0 * X_im[r] + f1 * X1_im[r] + f2 * X2_im[r] + f3 * X3_im[r];
    }
}

/* Sums of four rows, in LANES parts each: real parts of products, and what is taken off them. */
#define ADD_TO_SUMS(re, im)       \
    p0 += AT(X_re, r) * (re);     \
    p1 += AT(X1_re, r) * (re);    \
    p2 += AT(X2_re, r) * (re);    \
    p3 += AT(X3_re, r) * (re);    \
    q0 += AT(X_im, r) * (im);     \
    q1 += AT(X1_im, r) * (im);    \
    q2 += AT(X2_im, r) * (im);    \
    q3 += AT(X3_im, r) * (im)
#define SUMS Lanes p0 = {0}, p1 = {0}, p2 = {0}, p3 = {0}, q0 = {0}, q1 = {0}, q2 = {0}, q3 = {0}
#define TAKE_SUMS(z)                                                           \
    const Lanes sums[4] = {p0 - q0, p1 - q1, p2 - q2, p3 - q3};                \
    for (size_t k = 0; k < 4; k++)                                             \
        for (size_t l = 0; l < LANES; l++)                                     \
            z[k] += LANE(sums[k], l)

TARGET static void NAME(observe)(size_t n, size_t stride, const double *restrict X_re,
                                 const double *restrict X_im, const double *restrict s_re,
                                 const double *restrict s_im, double z[4])
{
    ROWS;
    SUMS;
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        const Lanes re = AT(s_re, r), im = AT(s_im, r);
        ADD_TO_SUMS(re, im);
    }
    TAKE_SUMS(z);
    for (; r < n; r++)
        for (size_t k = 0; k < 4; k++)
            z[k] += X_re[k * stride + r] * s_re[r] - X_im[k * stride + r] * s_im[r];
}

/* w times row j of S, and what rows of X from j on make of it. */
#define WEIGH(j)                                                                                  \
    const Lanes s##j##_re = AT(S_re, j * stride + r), s##j##_im = AT(S_im, j * stride + r);       \
    const Lanes re##j = a * s##j##_re - b * s##j##_im, im##j = a * s##j##_im + b * s##j##_re
#define MEET(j, k) g##j##k += AT(X##k##_re, r) * re##j - AT(X##k##_im, r) * im##j
#define TAKE_SUM(j, k)                                                                            \
    for (size_t l = 0; l < LANES; l++)                                                            \
        G[j][k] += LANE(g##j##k, l)
#define UPPER(each)                                                                               \
    each(0, 0); each(0, 1); each(0, 2); each(0, 3); each(1, 1);                                   \
    each(1, 2); each(1, 3); each(2, 2); each(2, 3); each(3, 3)

TARGET static void NAME(respond)(size_t n, size_t stride, const double *restrict X_re,
                                 const double *restrict X_im, const double *restrict w_re,
                                 const double *restrict w_im, const double *restrict S_re,
                                 const double *restrict S_im, double G[4][4])
{
    ROWS;
    const double *restrict X0_re = X_re, *restrict X0_im = X_im;
    Lanes g00 = {0}, g01 = {0}, g02 = {0}, g03 = {0}, g11 = {0};
    Lanes g12 = {0}, g13 = {0}, g22 = {0}, g23 = {0}, g33 = {0};
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        const Lanes a = AT(w_re, r), b = AT(w_im, r);
        WEIGH(0);
        WEIGH(1);
        WEIGH(2);
        WEIGH(3);
        UPPER(MEET);
    }
    UPPER(TAKE_SUM);
    for (; r < n; r++)
        for (size_t j = 0; j < 4; j++) {
            const double s_re = S_re[j * stride + r], s_im = S_im[j * stride + r];
            const double re = w_re[r] * s_re - w_im[r] * s_im;
            const double im = w_re[r] * s_im + w_im[r] * s_re;
            for (size_t k = j; k < 4; k++)
                G[j][k] += X_re[k * stride + r] * re - X_im[k * stride + r] * im;
        }
}

TARGET static void NAME(combine)(size_t n, const double *restrict a_re,
                                 const double *restrict a_im, const double *restrict x_re,
                                 const double *restrict x_im, const double *restrict b_re,
                                 const double *restrict b_im, const double *restrict u_re,
                                 const double *restrict u_im, double *restrict y_re,
                                 double *restrict y_im)
{
    for (size_t r = 0; r < n; r++) {
        y_re[r] = a_re[r] * x_re[r] - a_im[r] * x_im[r] + b_re[r] * u_re[r] - b_im[r] * u_im[r];
        y_im[r] = a_re[r] * x_im[r] + a_im[r] * x_re[r] + b_re[r] * u_im[r] + b_im[r] * u_re[r];
    }
}

TARGET static void NAME(add)(size_t n, const double *restrict a_re, const double *restrict a_im,
                             const double *restrict x_re, const double *restrict x_im,
                             double *restrict y_re, double *restrict y_im)
{
    for (size_t r = 0; r < n; r++) {
        y_re[r] += a_re[r] * x_re[r] - a_im[r] * x_im[r];
        y_im[r] += a_re[r] * x_im[r] + a_im[r] * x_re[r];
    }
}

static const Kernels NAME(kernels) = {
    NAME(interpolate), NAME(drive), NAME(observe), NAME(respond), NAME(combine), NAME(add),
};

#undef ADD_TO_SUMS
#undef MEET
#undef ROWS
#undef SUMS
#undef TAKE_SUM
#undef TAKE_SUMS
#undef UPPER
#undef WEIGH
#undef NAME
#undef TARGET
