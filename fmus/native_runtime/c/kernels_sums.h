/* Kernels that sum over modes, in LANES parts whatever the processor, and solve equations; included as
   kernels_each.h is. */

/* The other three rows of X, each with a pointer of its own. */
#define ROWS                                                                                 \
    const double *restrict X1_re = X_re + stride, *restrict X1_im = X_im + stride;           \
    const double *restrict X2_re = X1_re + stride, *restrict X2_im = X1_im + stride;         \
    const double *restrict X3_re = X2_re + stride, *restrict X3_im = X2_im + stride

/* Real part of a complex product. */
#define REAL_OF(X, re, im) AT(X##_re, r) * (re) - AT(X##_im, r) * (im)
/* Sums in LANES parts of four rows, which stand in p0 .. p3, as numbers. */
#define TAKE_SUMS(p, z)                                                        \
    const Lanes p##_sums[4] = {p##0, p##1, p##2, p##3};                        \
    for (size_t k = 0; k < 4; k++)                                             \
        for (size_t l = 0; l < LANES; l++)                                     \
            z[k] += LANE(p##_sums[k], l)

TARGET static void NAME(observe)(size_t n, size_t stride, const double *restrict X_re,
                                 const double *restrict X_im, const double *restrict s_re,
                                 const double *restrict s_im, double z[4])
{
    ROWS;
    Lanes p0 = {0}, p1 = {0}, p2 = {0}, p3 = {0};
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        const Lanes re = AT(s_re, r), im = AT(s_im, r);
        p0 += REAL_OF(X, re, im);
        p1 += REAL_OF(X1, re, im);
        p2 += REAL_OF(X2, re, im);
        p3 += REAL_OF(X3, re, im);
    }
    TAKE_SUMS(p, z);
    for (; r < n; r++)
        for (size_t k = 0; k < 4; k++)
            z[k] += X_re[k * stride + r] * s_re[r] - X_im[k * stride + r] * s_im[r];
}

TARGET static void NAME(look)(size_t n, size_t stride, const double *restrict X_re,
                              const double *restrict X_im, const double *restrict s_re,
                              const double *restrict s_im, const double *restrict d_re,
                              const double *restrict d_im, double z[4], double v[4])
{
    ROWS;
    Lanes p0 = {0}, p1 = {0}, p2 = {0}, p3 = {0}, q0 = {0}, q1 = {0}, q2 = {0}, q3 = {0};
    size_t r = 0;
    for (; r + LANES <= n; r += LANES) {
        const Lanes re = AT(s_re, r), im = AT(s_im, r), a = AT(d_re, r), b = AT(d_im, r);
        p0 += REAL_OF(X, re, im);
        q0 += REAL_OF(X, a, b);
        p1 += REAL_OF(X1, re, im);
        q1 += REAL_OF(X1, a, b);
        p2 += REAL_OF(X2, re, im);
        q2 += REAL_OF(X2, a, b);
        p3 += REAL_OF(X3, re, im);
        q3 += REAL_OF(X3, a, b);
    }
    TAKE_SUMS(p, z);
    TAKE_SUMS(q, v);
    for (; r < n; r++)
        for (size_t k = 0; k < 4; k++) {
            const double re = X_re[k * stride + r], im = X_im[k * stride + r];
            z[k] += re * s_re[r] - im * s_im[r];
            v[k] += re * d_re[r] - im * d_im[r];
        }
}

/* What row k of X and Y with S and T add to three sums g##k##0 .. g##k##2. */
#define MEET(k)                                                                                   \
    {                                                                                             \
        const Lanes x = AT(X->re + k * stride, r), x_im = AT(X->im + k * stride, r);              \
        const Lanes y = AT(Y->re + k * stride, r), y_im = AT(Y->im + k * stride, r);              \
        const Lanes a = x * t - x_im * t_im + (y * s - y_im * s_im);                              \
        const Lanes b = x * t_im + x_im * t + (y * s_im + y_im * s);                              \
        g##k##0 += AT(w0, r) * a - AT(w0_im, r) * b;                                              \
        g##k##1 += AT(w1, r) * a - AT(w1_im, r) * b;                                              \
        g##k##2 += AT(w2, r) * a - AT(w2_im, r) * b;                                              \
    }
#define BEGIN(k) Lanes g##k##0 = {0}, g##k##1 = {0}, g##k##2 = {0}
#define END(k)                                                                                    \
    for (size_t l = 0; l < LANES; l++) {                                                          \
        G[0][k] += LANE(g##k##0, l);                                                              \
        G[1][k] += LANE(g##k##1, l);                                                              \
        G[2][k] += LANE(g##k##2, l);                                                              \
    }
#define OVER_MODES(meet)                                                                          \
    for (; r + LANES <= n; r += LANES) {                                                          \
        const Lanes s = AT(S->re, r), s_im = AT(S->im, r);                                        \
        const Lanes t = AT(T->re, r), t_im = AT(T->im, r);                                        \
        meet                                                                                      \
    }

TARGET static void NAME(respond)(size_t n, size_t stride, size_t rows, const Rows *X,
                                 const Rows *Y, const Rows *S, const Rows *T,
                                 const double *const w[3], size_t im, double G[3][4])
{
    const double *w0 = w[0], *w1 = w[1], *w2 = w[2];
    const double *w0_im = w0 + im, *w1_im = w1 + im, *w2_im = w2 + im;
    size_t r = 0;
    BEGIN(0); BEGIN(1); BEGIN(2); BEGIN(3);
    switch (rows) {
    case 4: OVER_MODES(MEET(0) MEET(1) MEET(2) MEET(3)) break;
    case 3: OVER_MODES(MEET(0) MEET(1) MEET(2)) break;
    case 2: OVER_MODES(MEET(0) MEET(1)) break;
    default: OVER_MODES(MEET(0)) break;
    }
    END(0); END(1); END(2); END(3);
    for (; r < n; r++)
        for (size_t k = 0; k < rows; k++) {
            const double x = X->re[k * stride + r], x_im = X->im[k * stride + r];
            const double y = Y->re[k * stride + r], y_im = Y->im[k * stride + r];
            const double a = x * T->re[r] - x_im * T->im[r] + (y * S->re[r] - y_im * S->im[r]);
            const double b = x * T->im[r] + x_im * T->re[r] + (y * S->im[r] + y_im * S->re[r]);
            for (size_t i = 0; i < 3; i++)
                G[i][k] += w[i][r] * a - w[i][im + r] * b;
        }
}

TARGET static void NAME(add_product)(size_t rows, size_t n, const double *restrict A,
                                     const double *restrict x, double *restrict y)
{
    for (size_t i = 0; i < rows; i++, A += n) {
        Lanes sums = {0};
        double sum = 0;
        size_t j = 0;
        for (; j + LANES <= n; j += LANES)
            sums += AT(A, j) * AT(x, j);
        for (; j < n; j++)
            sum += A[j] * x[j];
        for (size_t l = 0; l < LANES; l++)
            sum += LANE(sums, l);
        y[i] += sum;
    }
}

TARGET static void NAME(take_product)(size_t rows, size_t k, size_t n, const double *restrict A,
                                      const double *restrict B, double *restrict C)
{
    for (size_t i = 0; i < rows; i++, A += k, C += n) {
        size_t j = 0;
        for (; j + LANES <= n; j += LANES) {
            Lanes sum = AT(C, j);
            for (size_t l = 0; l < k; l++)
                sum -= A[l] * AT(B, l * n + j);
            PUT(C, j) = sum;
        }
        for (; j < n; j++)
            for (size_t l = 0; l < k; l++)
                C[j] -= A[l] * B[l * n + j];
    }
}

/* Row i less its part of row k, which stays in its place, of columns behind k. */
TARGET static void NAME(eliminate)(size_t n, size_t k, size_t i, double *restrict A)
{
    const double *restrict from = A + k * n;
    double *restrict to = A + i * n;
    const double factor = to[k] / from[k];
    size_t j = k + 1;
    for (; j + LANES <= n; j += LANES)
        PUT(to, j) = AT(to, j) - factor * AT(from, j);
    for (; j < n; j++)
        to[j] -= factor * from[j];
    to[k] = factor;
}

static void NAME(swap)(double *restrict a, double *restrict b)
{
    const double kept = *a;
    *a = *b;
    *b = kept;
}

TARGET static int NAME(factor)(size_t n, double *restrict A, size_t *restrict row)
{
    for (size_t k = 0; k < n; k++) {
        size_t best = k;
        for (size_t i = k + 1; i < n; i++)
            if (fabs(A[i * n + k]) > fabs(A[best * n + k]))
                best = i;
        const double pivot = A[best * n + k];
        if (pivot == 0 || !isfinite(pivot))
            return 0;
        row[k] = best;
        for (size_t j = 0; j < n && best != k; j++)
            NAME(swap)(A + k * n + j, A + best * n + j);
        for (size_t i = k + 1; i < n; i++)
            NAME(eliminate)(n, k, i, A);
    }
    return 1;
}

TARGET static void NAME(substitute)(size_t n, const double *restrict A,
                                    const size_t *restrict row, double *restrict b)
{
    for (size_t k = 0; k < n; k++)
        if (row[k] != k)
            NAME(swap)(b + k, b + row[k]);
    for (size_t k = 0; k < n; k++)
        for (size_t i = k + 1; i < n; i++)
            b[i] -= A[i * n + k] * b[k];
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; j++)
            b[k] -= A[k * n + j] * b[j];
        b[k] /= A[k * n + k];
    }
}

TARGET static double NAME(finite)(size_t n, const double *x)
{
    Lanes sum = {0};
    double all = 0;
    size_t r = 0;
    for (; r + LANES <= n; r += LANES)
        sum += AT(x, r) * 0;
    for (; r < n; r++)
        all += x[r] * 0;
    for (size_t l = 0; l < LANES; l++)
        all += LANE(sum, l);
    return all;
}

#undef BEGIN
#undef END
#undef MEET
#undef OVER_MODES
#undef REAL_OF
#undef ROWS
#undef TAKE_SUMS
