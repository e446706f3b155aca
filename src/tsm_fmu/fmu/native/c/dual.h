/* Numbers with a derivative: forward differentiation of the model's own equations.
 *
 * v is the value, computed as without derivative; d is its derivative along the direction that the caller chose. Where
 * a function has a kink, d is that of the branch which the value takes. Nothing is checked (checked.h): derivatives are
 * asked for where the same step has succeeded in plain numbers.
 */
#ifndef TSM_FMU_DUAL_H
#define TSM_FMU_DUAL_H

#include "checked.h"

typedef struct {
    double v;
    double d;
} Dual;

static inline Dual dual_of(double v, double d) { Dual made; made.v = v; made.d = d; return made; }
static inline Dual dual(double v) { return dual_of(v, 0.0); }

/* slope times derivative; a constant has none, even where the slope is infinite. */
static inline double along(double slope, double d) { return d == 0.0 ? 0.0 : slope * d; }

static inline Dual dual_add(Dual a, Dual b) { return dual_of(a.v + b.v, a.d + b.d); }
static inline Dual dual_sub(Dual a, Dual b) { return dual_of(a.v - b.v, a.d - b.d); }
static inline Dual dual_mul(Dual a, Dual b) { return dual_of(a.v * b.v, along(b.v, a.d) + along(a.v, b.d)); }
static inline Dual dual_neg(Dual a) { return dual_of(-a.v, -a.d); }

static inline Dual dual_div(Dual a, Dual b)
{
    double v = a.v / b.v;
    return dual_of(v, (a.d - along(v, b.d)) / b.v);
}

static inline Dual dual_mod(Dual a, Dual b)
{
    double v = float_mod(a.v, b.v);
    return dual_of(v, a.d - along(floor(a.v / b.v), b.d));
}

/* Derivative of x to the power y. */
static inline double power_slope(Dual x, Dual y, double v)
{
    double d = x.d == 0.0 || y.v == 0.0 ? 0.0 : y.v * pow(x.v, y.v - 1.0) * x.d;
    return y.d == 0.0 || x.v == 0.0 ? d : d + v * log(x.v) * y.d;
}

static inline Dual dual_pow(Dual x, Dual y)
{
    double v = pow(x.v, y.v);
    return dual_of(v, power_slope(x, y, v));
}

static inline Dual dual_exp(Dual x)
{
    double v = exp(x.v);
    return dual_of(v, along(v, x.d));
}

static inline Dual dual_expm1(Dual x)
{
    return dual_of(expm1(x.v), along(exp(x.v), x.d));
}

static inline Dual dual_sqrt(Dual x)
{
    double v = sqrt(x.v);
    return dual_of(v, along(0.5 / v, x.d));
}

static inline Dual dual_tan(Dual x)
{
    double v = tan(x.v);
    return dual_of(v, along(1.0 + v * v, x.d));
}

static inline Dual dual_tanh(Dual x)
{
    double v = tanh(x.v);
    return dual_of(v, along(1.0 - v * v, x.d));
}

static inline Dual dual_acos(Dual x)
{
    return dual_of(acos(x.v), along(-1.0 / sqrt(1.0 - x.v * x.v), x.d));
}

static inline Dual dual_asin(Dual x)
{
    return dual_of(asin(x.v), along(1.0 / sqrt(1.0 - x.v * x.v), x.d));
}

static inline Dual dual_asinh(Dual x) { return dual_of(asinh(x.v), along(1.0 / sqrt(1.0 + x.v * x.v), x.d)); }
static inline Dual dual_atan(Dual x) { return dual_of(atan(x.v), along(1.0 / (1.0 + x.v * x.v), x.d)); }

static inline Dual dual_atanh(Dual x)
{
    return dual_of(atanh(x.v), along(1.0 / (1.0 - x.v * x.v), x.d));
}

static inline Dual dual_atan2(Dual y, Dual x)
{
    double square = x.v * x.v + y.v * y.v;
    return dual_of(atan2(y.v, x.v), along(x.v / square, y.d) - along(y.v / square, x.d));
}

static inline Dual dual_cos(Dual x)
{
    return dual_of(cos(x.v), along(-sin(x.v), x.d));
}

static inline Dual dual_cosh(Dual x)
{
    return dual_of(cosh(x.v), along(sinh(x.v), x.d));
}

static inline Dual dual_log(Dual x) { return dual_of(log(x.v), along(1.0 / x.v, x.d)); }

static inline Dual dual_log1p(Dual x)
{
    return dual_of(log1p(x.v), along(1.0 / (1.0 + x.v), x.d));
}

static inline Dual dual_sin(Dual x)
{
    return dual_of(sin(x.v), along(cos(x.v), x.d));
}

static inline Dual dual_sinh(Dual x)
{
    return dual_of(sinh(x.v), along(cosh(x.v), x.d));
}

static inline Dual dual_degrees(Dual x) { return dual_of(degrees(x.v), degrees(x.d)); }
static inline Dual dual_radians(Dual x) { return dual_of(radians(x.v), radians(x.d)); }
static inline Dual dual_abs(Dual x) { return x.v < 0.0 ? dual_of(-x.v, -x.d) : dual_of(fabs(x.v), x.d); }
static inline Dual dual_min(Dual a, Dual b) { return b.v < a.v ? b : a; }
static inline Dual dual_max(Dual a, Dual b) { return b.v > a.v ? b : a; }

static inline Dual dual_copysign(Dual x, Dual sign)
{
    double v = copysign(x.v, sign.v);
    return dual_of(v, signbit(v) == signbit(x.v) ? x.d : -x.d);
}

#endif
