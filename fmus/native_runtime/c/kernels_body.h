/* Bodies of the kernels; included by kernels.c once for each instruction set, with NAME(kernel)
   and TARGET (a function attribute) defined. */

TARGET static void NAME(interpolate)(size_t n, size_t stride, const float *restrict rows_re,
                                     const float *restrict rows_im, const double w[4],
                                     const double phase[2], double *restrict out_re,
                                     double *restrict out_im)
{
    const double w0 = w[0], w1 = w[1], w2 = w[2], w3 = w[3], c = phase[0], s = phase[1];
    const float *restrict re1 = rows_re + stride, *restrict im1 = rows_im + stride;
    const float *restrict re2 = re1 + stride, *restrict im2 = im1 + stride;
    const float *restrict re3 = re2 + stride, *restrict im3 = im2 + stride;
    for (size_t r = 0; r < n; r++) {
        const double re = w0 * (double)rows_re[r] + w1 * (double)re1[r] + w2 * (double)re2[r] +
                          w3 * (double)re3[r];
        const double im = w0 * (double)rows_im[r] + w1 * (double)im1[r] + w2 * (double)im2[r] +
                          w3 * (double)im3[r];
        out_re[r] = c * re - s * im;
        out_im[r] = c * im + s * re;
    }
}

TARGET static void NAME(drive)(size_t n, size_t stride, const double *restrict X_re,
                               const double *restrict X_im, const double f[4],
                               double *restrict g_re, double *restrict g_im)
{
    const double f0 = f[0], f1 = f[1], f2 = f[2], f3 = f[3];
    const double *restrict X1_re = X_re + stride, *restrict X1_im = X_im + stride;
    const double *restrict X2_re = X1_re + stride, *restrict X2_im = X1_im + stride;
    const double *restrict X3_re = X2_re + stride, *restrict X3_im = X2_im + stride;
    for (size_t r = 0; r < n; r++) {
        g_re[r] = f0 * X_re[r] + f1 * X1_re[r] + f2 * X2_re[r] + f3 * X3_re[r];
        g_im[r] = f0 * X_im[r] + f1 * X1_im[r] + f2 * X2_im[r] + f3 * X3_im[r];
    }
}

TARGET static void NAME(observe)(size_t n, size_t stride, const double *restrict X_re,
                                 const double *restrict X_im, const double *restrict s_re,
                                 const double *restrict s_im, double z[4])
{
    Lanes positive[4] = {{0}}, negative[4] = {{0}};
    const size_t whole = n - n % LANES;
    for (size_t r = 0; r < whole; r += LANES) {
        const Lanes re = AT(s_re, r), im = AT(s_im, r);
        for (size_t k = 0; k < 4; k++) {
            positive[k] += AT(X_re, k * stride + r) * re;
            negative[k] += AT(X_im, k * stride + r) * im;
        }
    }
    for (size_t k = 0; k < 4; k++) {
        for (size_t r = whole; r < n; r++)
            z[k] += X_re[k * stride + r] * s_re[r] - X_im[k * stride + r] * s_im[r];
        for (size_t l = 0; l < LANES; l++)
            z[k] += positive[k][l] - negative[k][l];
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
    NAME(interpolate), NAME(drive), NAME(observe), NAME(combine), NAME(add),
};

#undef NAME
#undef TARGET
