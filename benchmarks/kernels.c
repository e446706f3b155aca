/* The record loops of two kernels as one would write them in C; p, u and y as in the kernel's declarations. */
#include <math.h>

/* MSSP 2015 Eqs (9), (10a): p = c, beta, alpha, x_0, x_h_0; u = x_in; y = x_out, x_h */
void coleman_hodgdon(const double *p, long rows, const double *t, const double *u, double *y)
{
    const double c = p[0], beta = p[1], alpha = p[2], x_0 = p[3];
    double x_h = p[4], before = u[0];
    (void)t;
    for (long k = 0; k < rows; ++k) {
        const double dx = u[k] - before;
        if (dx != 0.0) {
            const double asymptote = copysign(beta / alpha, beta * dx);
            x_h = asymptote + (x_h - asymptote) * exp(-alpha * fabs(dx));
        }
        before = u[k];
        y[2 * k] = c * u[k] + x_h + x_0;
        y[2 * k + 1] = x_h;
    }
}

/* AME 2020 Eq (40): p = sigma0, sigma1, sigma2, F_c, F_s, v_s; u = v; y = F, P_loss */
void lugre(const double *p, long rows, const double *t, const double *u, double *y)
{
    const double sigma0 = p[0], sigma1 = p[1], sigma2 = p[2], f_c = p[3], f_s = p[4], v_s = p[5];
    double z = 0.0;
    for (long k = 0; k < rows; ++k) {
        const double v = u[k], r = v / v_s;
        const double s = (f_c + (f_s - f_c) * exp(-r * r)) / sigma0;
        if (k > 0 && v != 0.0) {
            const double steady = copysign(s, v);
            z = steady + (z - steady) * exp(-fabs(v) * (t[k] - t[k - 1]) / s);
        }
        const double f = sigma0 * z + sigma1 * (v - fabs(v) * z / s) + sigma2 * v;
        y[2 * k] = f;
        y[2 * k + 1] = f * v;
    }
}
