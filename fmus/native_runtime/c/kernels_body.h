/* Bodies of the kernels; included by kernels.c once for each instruction set, with NAME(kernel)
   and TARGET (a function attribute) defined. */

/* The other three rows of X, each with a pointer of its own. */
#define ROWS                                                                                 \
    const double *restrict X1_re = X_re + stride, *restrict X1_im = X_im + stride;           \
    const double *restrict X2_re = X1_re + stride, *restrict X2_im = X1_im + stride;         \
    const double *restrict X3_re = X2_re + stride, *restrict X3_im = X2_im + stride

TARGET static void NAME(enter)(size_t n, size_t stride_table, ptrdiff_t im,
                               const float *restrict a, const float *restrict b,
                               const double phase_a[2], const double phase_b[2], size_t stride,
                               double *restrict element)
{
    const double ca = phase_a[0], sa = phase_a[1], cb = phase_b[0], sb = phase_b[1];
    const float *restrict a_im = a + im, *restrict b_im = b + im;
    const float *restrict da = a + stride_table, *restrict da_im = a_im + stride_table;
    const float *restrict db = b + stride_table, *restrict db_im = b_im + stride_table;
    double *restrict e0 = element, *restrict e1 = e0 + stride, *restrict e2 = e1 + stride;
    double *restrict e3 = e2 + stride, *restrict e4 = e3 + stride, *restrict e5 = e4 + stride;
    double *restrict e6 = e5 + stride, *restrict e7 = e6 + stride;
    for (size_t r = 0; r < n; r++) {
        const double re = ca * (double)a[r] - sa * (double)a_im[r];
        const double turned = ca * (double)a_im[r] + sa * (double)a[r];
        e0[r] = re;
        e1[r] = turned;
        e2[r] = cb * (double)b[r] - sb * (double)b_im[r] - re;
        e3[r] = cb * (double)b_im[r] + sb * (double)b[r] - turned;
    }
    for (size_t r = 0; r < n; r++) {
        e4[r] = ca * (double)da[r] - sa * (double)da_im[r];
        e5[r] = ca * (double)da_im[r] + sa * (double)da[r];
        e6[r] = cb * (double)db[r] - sb * (double)db_im[r];
        e7[r] = cb * (double)db_im[r] + sb * (double)db[r];
    }
}

/* The parts of an element, each with a pointer of its own. */
#define PARTS                                                                                \
    const double *restrict e0 = element, *restrict e1 = e0 + stride;                         \
    const double *restrict e2 = e1 + stride, *restrict e3 = e2 + stride;                     \
    const double *restrict e4 = e3 + stride, *restrict e5 = e4 + stride;                     \
    const double *restrict e6 = e5 + stride, *restrict e7 = e6 + stride

TARGET static void NAME(evaluate)(size_t n, size_t stride, const double *restrict element,
                                  const double w[3], double *restrict X_re,
                                  double *restrict X_im)
{
    const double w0 = w[0], w1 = w[1], w2 = w[2];
    PARTS;
    for (size_t r = 0; r < n; r++) {
        X_re[r] = e0[r] + w0 * e2[r] + w1 * e4[r] + w2 * e6[r];
        X_im[r] = e1[r] + w0 * e3[r] + w1 * e5[r] + w2 * e7[r];
    }
}

TARGET static void NAME(mix)(size_t n, size_t stride, const double *restrict element,
                             const double w[4], int more, double *restrict g_re,
                             double *restrict g_im)
{
    const double w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3];
    PARTS;
    if (more)
        for (size_t r = 0; r < n; r++) {
            g_re[r] += w0 * e0[r] + w1 * e2[r] + w2 * e4[r] + w3 * e6[r];
            g_im[r] += w0 * e1[r] + w1 * e3[r] + w2 * e5[r] + w3 * e7[r];
        }
    else
        for (size_t r = 0; r < n; r++) {
            g_re[r] = w0 * e0[r] + w1 * e2[r] + w2 * e4[r] + w3 * e6[r];
            g_im[r] = w0 * e1[r] + w1 * e3[r] + w2 * e5[r] + w3 * e7[r];
        }
}

TARGET static void NAME(drive)(size_t n, size_t stride, const double *restrict X_re,
                               const double *restrict X_im, const double f[4], int more,
                               double *restrict g_re, double *restrict g_im)
{
    const double f0 = f[0], f1 = f[1], f2 = f[2], f3 = f[3];
    ROWS;
    if (more)
        for (size_t r = 0; r < n; r++) {
            g_re[r] += f0 * X_re[r] + f1 * X1_re[r] + f2 * X2_re[r] + f3 * X3_re[r];
            g_im[r] += f0 * X_im[r] + f1 * X1_im[r] + f2 * X2_im[r] + f3 * X3_im[r];
        }
    else
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

TARGET static void NAME(add)(size_t n, const double *restrict a_re, const double *restrict a_im,
                             const double *restrict x_re, const double *restrict x_im,
                             double *restrict y_re, double *restrict y_im)
{
    for (size_t r = 0; r < n; r++) {
        y_re[r] += a_re[r] * x_re[r] - a_im[r] * x_im[r];
        y_im[r] += a_re[r] * x_im[r] + a_im[r] * x_re[r];
    }
}

/* Imaginary parts of generalised forces and of what belongs to modes; and the parabola
   u1 + u2 theta + u3 theta^2 / 2 through g0, gm and g1, times h. */
#define FORCES                                                                               \
    const double *restrict g0_im = g0 + im_g, *restrict gm_im = gm + im_g;                   \
    const double *restrict g1_im = g1 + im_g, *restrict x_im = x + im;                       \
    const double *restrict p0_im = p0 + im, *restrict p1_im = p1 + im;                       \
    const double *restrict p2_im = p2 + im, *restrict p3_im = p3 + im
#define PARABOLA                                                                             \
    const double u1 = h * g0[r], u1_im = h * g0_im[r];                                       \
    const double u2 = h * (4 * gm[r] - 3 * g0[r] - g1[r]);                                   \
    const double u2_im = h * (4 * gm_im[r] - 3 * g0_im[r] - g1_im[r]);                       \
    const double u3 = 4 * h * (g0[r] + g1[r] - 2 * gm[r]);                                   \
    const double u3_im = 4 * h * (g0_im[r] + g1_im[r] - 2 * gm_im[r])
#define RE(a, b) (a[r] * b - a##_im[r] * b##_im)
#define IM(a, b) (a[r] * b##_im + a##_im[r] * b)

TARGET static void NAME(advance)(size_t n, size_t im, size_t im_g, double h,
                                 const double *restrict p0, const double *restrict p1,
                                 const double *restrict p2, const double *restrict p3,
                                 const double *restrict x, const double *restrict g0,
                                 const double *restrict gm, const double *restrict g1,
                                 double *restrict y)
{
    FORCES;
    double *restrict y_im = y + im;
    for (size_t r = 0; r < n; r++) {
        PARABOLA;
        const double s = x[r], s_im = x_im[r];
        y[r] = RE(p0, s) + RE(p1, u1) + RE(p2, u2) + RE(p3, u3);
        y_im[r] = IM(p0, s) + IM(p1, u1) + IM(p2, u2) + IM(p3, u3);
    }
}

TARGET static void NAME(advance_both)(size_t n, size_t im, size_t im_g, double h,
                                      const double *restrict p0, const double *restrict p1,
                                      const double *restrict p2, const double *restrict p3,
                                      const double *restrict p4, const double *restrict x,
                                      const double *restrict g0, const double *restrict gm,
                                      const double *restrict g1, double *restrict y,
                                      double *restrict w)
{
    FORCES;
    const double *restrict p4_im = p4 + im, sixth = 1.0 / 6;
    double *restrict y_im = y + im, *restrict w_im = w + im;
    for (size_t r = 0; r < n; r++) {
        PARABOLA;
        const double s = x[r], s_im = x_im[r];
        const double re = RE(p0, s) + RE(p1, u1) + RE(p2, u2) + RE(p3, u3);
        const double turned = IM(p0, s) + IM(p1, u1) + IM(p2, u2) + IM(p3, u3);
        y[r] = re;
        y_im[r] = turned;
        w[r] = RE(p1, s) + RE(p2, u1) + RE(p3, u2) + RE(p4, u3) - sixth * (s + re);
        w_im[r] = IM(p1, s) + IM(p2, u1) + IM(p3, u2) + IM(p4, u3) - sixth * (s_im + turned);
    }
}

TARGET static void NAME(add_line)(size_t n, size_t im, size_t im_g, double h,
                                  const double *restrict p1, const double *restrict p2,
                                  const double *restrict mean, const double *restrict slope,
                                  double *restrict y)
{
    const double *restrict p1_im = p1 + im, *restrict p2_im = p2 + im;
    const double *restrict mean_im = mean + im_g, *restrict slope_im = slope + im_g;
    double *restrict y_im = y + im;
    for (size_t r = 0; r < n; r++) {
        const double u1 = h * (mean[r] - slope[r]), u1_im = h * (mean_im[r] - slope_im[r]);
        const double u2 = 2 * h * slope[r], u2_im = 2 * h * slope_im[r];
        y[r] += RE(p1, u1) + RE(p2, u2);
        y_im[r] += IM(p1, u1) + IM(p2, u2);
    }
}

static const Kernels NAME(kernels) = {
    NAME(enter), NAME(evaluate), NAME(mix), NAME(drive), NAME(observe),
    NAME(respond), NAME(add), NAME(advance), NAME(advance_both), NAME(add_line),
};

#undef ADD_TO_SUMS
#undef FORCES
#undef IM
#undef MEET
#undef PARABOLA
#undef PARTS
#undef RE
#undef ROWS
#undef SUMS
#undef TAKE_SUM
#undef TAKE_SUMS
#undef UPPER
#undef WEIGH
#undef NAME
#undef TARGET
