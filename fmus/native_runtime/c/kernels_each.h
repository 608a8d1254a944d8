/* Kernels that do the same with each mode, whatever their order; included by kernels.c once for each
   instruction set, with NAME(kernel), TARGET (a function attribute) and the vectors defined. */

/* The other three rows of X, each with a pointer of its own. */
#define ROWS                                                                                 \
    const double *restrict X1_re = X_re + stride, *restrict X1_im = X_im + stride;           \
    const double *restrict X2_re = X1_re + stride, *restrict X2_im = X1_im + stride;         \
    const double *restrict X3_re = X2_re + stride, *restrict X3_im = X2_im + stride

/* Of four modes or LANES of them: shapes by weights k of the parts of nodes, turned by c + i s. */
#define SHAPE(k, to_re, to_im)                                                                    \
    {                                                                                             \
        const Lanes re = k##0 * w_a + k##1 * w_b + k##2 * dw_a + k##3 * dw_b;                     \
        const Lanes im = k##0 * w_a_im + k##1 * w_b_im + k##2 * dw_a_im + k##3 * dw_b_im;         \
        PUT(to_re, r) = c * re - s * im;                                                          \
        PUT(to_im, r) = c * im + s * re;                                                          \
    }

TARGET static void NAME(evaluate_both)(size_t n, size_t stride, const float *restrict a,
                                       const float *restrict b, const double phase_a[2],
                                       const double phase_b[2], const double w[4],
                                       const double v[4], double *restrict X_re,
                                       double *restrict X_im, double *restrict Y_re,
                                       double *restrict Y_im)
{
    const double w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3];
    const double v0 = v[0], v1 = v[1], v2 = v[2], v3 = v[3], c = phase_a[0], s = phase_a[1];
    const float *restrict a_im = a + stride, *restrict da = a_im + stride;
    const float *restrict b_im = b + stride, *restrict db = b_im + stride;
    const float *restrict da_im = da + stride, *restrict db_im = db + stride;
    if (phase_a == phase_b) {
        for (size_t r = 0; r < n; r += LANES) {
            const Lanes w_a = WIDE(a, r), w_a_im = WIDE(a_im, r);
            const Lanes dw_a = WIDE(da, r), dw_a_im = WIDE(da_im, r);
            const Lanes w_b = WIDE(b, r), w_b_im = WIDE(b_im, r);
            const Lanes dw_b = WIDE(db, r), dw_b_im = WIDE(db_im, r);
            SHAPE(w, X_re, X_im)
            SHAPE(v, Y_re, Y_im)
        }
        return;
    }
    /* From a to b, of this cell and the next one. */
    const double C = c * phase_b[0] + s * phase_b[1], S = c * phase_b[1] - s * phase_b[0];
    for (size_t r = 0; r < n; r += LANES) {
        const Lanes w_a = WIDE(a, r), w_a_im = WIDE(a_im, r);
        const Lanes dw_a = WIDE(da, r), dw_a_im = WIDE(da_im, r);
        const Lanes e = WIDE(b, r), e_im = WIDE(b_im, r), de = WIDE(db, r), de_im = WIDE(db_im, r);
        const Lanes w_b = C * e - S * e_im, w_b_im = C * e_im + S * e;
        const Lanes dw_b = C * de - S * de_im, dw_b_im = C * de_im + S * de;
        SHAPE(w, X_re, X_im)
        SHAPE(v, Y_re, Y_im)
    }
}

TARGET static void NAME(drive)(size_t n, size_t stride, const double *restrict X_re,
                               const double *restrict X_im, const double f[4], int more,
                               double *restrict g_re, double *restrict g_im)
{
    const double f0 = f[0], f1 = f[1], f2 = f[2], f3 = f[3];
    ROWS;
    for (size_t r = 0; r < n; r += LANES) {
        Lanes re = f0 * AT(X_re, r) + f1 * AT(X1_re, r) + f2 * AT(X2_re, r) + f3 * AT(X3_re, r);
        Lanes im = f0 * AT(X_im, r) + f1 * AT(X1_im, r) + f2 * AT(X2_im, r) + f3 * AT(X3_im, r);
        if (more) {
            re += AT(g_re, r);
            im += AT(g_im, r);
        }
        PUT(g_re, r) = re;
        PUT(g_im, r) = im;
    }
}

TARGET static void NAME(drive_both)(size_t n, size_t stride, const double *restrict X_re,
                                    const double *restrict X_im, const double f[4],
                                    const double e[4], int more, size_t im, double *restrict g,
                                    double *restrict d)
{
    const double f0 = f[0], f1 = f[1], f2 = f[2], f3 = f[3];
    const double e0 = e[0], e1 = e[1], e2 = e[2], e3 = e[3];
    ROWS;
    for (size_t part = 0; part < 2; part++) { /* real, imaginary */
        for (size_t r = 0; r < n; r += LANES) {
            const Lanes x0 = AT(X_re, r), x1 = AT(X1_re, r), x2 = AT(X2_re, r), x3 = AT(X3_re, r);
            Lanes by_f = f0 * x0 + f1 * x1 + f2 * x2 + f3 * x3;
            Lanes by_e = e0 * x0 + e1 * x1 + e2 * x2 + e3 * x3;
            if (more) {
                by_f += AT(g, r);
                by_e += AT(d, r);
            }
            PUT(g, r) = by_f;
            PUT(d, r) = by_e;
        }
        X_re = X_im;
        X1_re = X1_im;
        X2_re = X2_im;
        X3_re = X3_im;
        g += im;
        d += im;
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

/* Of one mode or LANES of them: `to` = p0 s + p1 a + p2 b + p3 c, where READ has put s, a, b and c.
   `Number` is their type, `GET` reads one. */
#define READ(Number, GET)                                                                         \
    const Number s = GET(x, r), s_im = GET(x, im + r);                                            \
    const Number a = GET(g0, r), a_im = GET(g0, im_g + r), b = GET(gm, r);                        \
    const Number b_im = GET(gm, im_g + r), c = GET(g1, r), c_im = GET(g1, im_g + r)
#define SUM(Number, GET, p, to)                                                                   \
    const Number p##0 = GET(p[0], r), p##0_im = GET(p[0], im + r);                                \
    const Number p##1 = GET(p[1], r), p##1_im = GET(p[1], im + r);                                \
    const Number p##2 = GET(p[2], r), p##2_im = GET(p[2], im + r);                                \
    const Number p##3 = GET(p[3], r), p##3_im = GET(p[3], im + r);                                \
    const Number to = RE(p##0, s) + RE(p##1, a) + RE(p##2, b) + RE(p##3, c);                      \
    const Number to##_im = IM(p##0, s) + IM(p##1, a) + IM(p##2, b) + IM(p##3, c)
#define RE(p, u) (p * u - p##_im * u##_im)
#define IM(p, u) (p * u##_im + p##_im * u)

TARGET static void NAME(advance)(size_t n, size_t im, size_t im_g, const double *const p[4],
                                 const double *x, const double *g0, const double *gm,
                                 const double *g1, double *y)
{
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        READ(Lanes, AT);
        SUM(Lanes, AT, p, end);
        PUT(y, r) = end;
        PUT(y, im + r) = end_im;
    }
    for (; r < n; r++) {
        READ(double, ONE);
        SUM(double, ONE, p, end);
        y[r] = end;
        y[im + r] = end_im;
    }
}

TARGET static void NAME(advance_both)(size_t n, size_t im, size_t im_g, const double *const p[4],
                                      const double *const q[4], const double *x,
                                      const double *g0, const double *gm, const double *g1,
                                      double *y, double *w)
{
    const double sixth = 1.0 / 6;
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        READ(Lanes, AT);
        SUM(Lanes, AT, p, end);
        SUM(Lanes, AT, q, own);
        PUT(y, r) = end;
        PUT(y, im + r) = end_im;
        PUT(w, r) = own - sixth * (s + end);
        PUT(w, im + r) = own_im - sixth * (s_im + end_im);
    }
    for (; r < n; r++) {
        READ(double, ONE);
        SUM(double, ONE, p, end);
        SUM(double, ONE, q, own);
        y[r] = end;
        y[im + r] = end_im;
        w[r] = own - sixth * (s + end);
        w[im + r] = own_im - sixth * (s_im + end_im);
    }
}

#define LINE_OF(Number, GET)                                                                      \
    const Number a = GET(mean, r), a_im = GET(mean, im_g + r);                                    \
    const Number b = GET(slope, r), b_im = GET(slope, im_g + r);                                  \
    const Number p0 = GET(p[0], r), p0_im = GET(p[0], im + r);                                    \
    const Number p2 = GET(p[2], r), p2_im = GET(p[2], im + r);                                    \
    const Number q = p0 + GET(p[1], r) + p2, q_im = p0_im + GET(p[1], im + r) + p2_im;            \
    const Number d = p2 - p0, d_im = p2_im - p0_im;                                               \
    const Number re = GET(y, r) + (RE(q, a) + RE(d, b));                                          \
    const Number turned = GET(y, im + r) + (IM(q, a) + IM(d, b))

TARGET static void NAME(add_line)(size_t n, size_t im, size_t im_g, const double *const p[3],
                                  const double *mean, const double *slope, double *y)
{
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        LINE_OF(Lanes, AT);
        PUT(y, r) = re;
        PUT(y, im + r) = turned;
    }
    for (; r < n; r++) {
        LINE_OF(double, ONE);
        y[r] = re;
        y[im + r] = turned;
    }
}

#undef IM
#undef LINE_OF
#undef RE
#undef READ
#undef ROWS
#undef SHAPE
#undef SUM
