/* Python's arithmetic on floats in C: what raises an exception there notes a fault here, with the same sentence.
 *
 * A function that may fail gets a pointer to the fault; its caller looks at it after the statement and returns. The
 * first fault stays. Values after a fault mean nothing.
 */
#ifndef TSM_FMU_CHECKED_H
#define TSM_FMU_CHECKED_H

#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>

#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF  /* gcc has it off with -std=c99 */
#endif

#if defined(__GNUC__)
#define RARELY(condition) __builtin_expect(condition, 0)
#define COLD __attribute__((cold, noinline))
#define NEVER(condition) do { if (condition) __builtin_unreachable(); } while (0)
#else
#define RARELY(condition) (condition)
#define COLD
#define NEVER(condition) ((void)(condition))
#endif

typedef struct {
    bool raised;
    char text[1024];
} Fault;

/* Note a fault unless there is one; like printf, with %r for a double as Python's repr prints it. */
COLD void fault_raise(Fault *fault, const char *format, ...);

/* Write such a sentence into `text` of `size` characters. */
void sentence_put(char *text, size_t size, const char *format, ...);
void sentence_write(char *text, size_t size, const char *format, va_list values);

static inline double checked_div(double a, double b, Fault *fault)
{
    if (RARELY(b == 0.0)) {
        fault_raise(fault, "float division by zero");
        return 0.0;
    }
    return a / b;
}

/* a % b, with the sign of b. */
static inline double float_mod(double a, double b)
{
    double rest = fmod(a, b);
    if (rest == 0.0) {
        return copysign(0.0, b);
    }
    return (b < 0.0) != (rest < 0.0) ? rest + b : rest;
}

static inline double checked_mod(double a, double b, Fault *fault)
{
    if (RARELY(b == 0.0)) {
        fault_raise(fault, "float modulo by zero");
        return 0.0;
    }
    return float_mod(a, b);
}

static inline int int_mod(int a, int b)
{
    int rest = a % b;
    return rest != 0 && (rest < 0) != (b < 0) ? rest + b : rest;
}

/* Result of a function of the math library: no NaN out of a number, no infinity out of a finite one. */
COLD double checked_not_finite(double result, double argument, bool can_overflow, Fault *fault);

static inline double checked_result(double result, double argument, bool can_overflow, Fault *fault)
{
    return RARELY(!(fabs(result) <= DBL_MAX)) ? checked_not_finite(result, argument, can_overflow, fault) : result;
}

static inline double checked_exp(double x, Fault *fault)
{
    double result = exp(x);  /* never below 0 */
    return RARELY(!(result <= DBL_MAX)) ? checked_not_finite(result, x, true, fault) : result;
}

static inline double checked_acos(double x, Fault *fault) { return checked_result(acos(x), x, false, fault); }
static inline double checked_asin(double x, Fault *fault) { return checked_result(asin(x), x, false, fault); }
static inline double checked_atanh(double x, Fault *fault) { return checked_result(atanh(x), x, false, fault); }
static inline double checked_cos(double x, Fault *fault) { return checked_result(cos(x), x, false, fault); }
static inline double checked_cosh(double x, Fault *fault) { return checked_result(cosh(x), x, true, fault); }
static inline double checked_expm1(double x, Fault *fault) { return checked_result(expm1(x), x, true, fault); }
static inline double checked_log(double x, Fault *fault) { return checked_result(log(x), x, false, fault); }
static inline double checked_log1p(double x, Fault *fault) { return checked_result(log1p(x), x, false, fault); }
static inline double checked_sin(double x, Fault *fault) { return checked_result(sin(x), x, false, fault); }
static inline double checked_sinh(double x, Fault *fault) { return checked_result(sinh(x), x, true, fault); }
static inline double checked_sqrt(double x, Fault *fault) { return checked_result(sqrt(x), x, false, fault); }
static inline double checked_tan(double x, Fault *fault) { return checked_result(tan(x), x, false, fault); }

/* math.pow: its special cases are those of C's standard, which C's libraries keep. */
static inline double checked_pow(double x, double y, Fault *fault)
{
    double result = pow(x, y);
    if (isfinite(x) && isfinite(y)) {
        if (isnan(result) || (isinf(result) && x == 0.0)) {
            fault_raise(fault, "math domain error");
            return 0.0;
        }
        if (isinf(result)) {
            fault_raise(fault, "math range error");
            return 0.0;
        }
    }
    return result;
}

/* x ** y */
static inline double checked_power(double x, double y, Fault *fault)
{
    double result = pow(x, y);
    if (isfinite(x) && isfinite(y)) {
        if (x == 0.0 && y < 0.0) {
            fault_raise(fault, "0.0 cannot be raised to a negative power");
            return 0.0;
        }
        if (isnan(result)) {  /* a complex number in Python, of which a kernel can make nothing */
            fault_raise(fault, "a negative number cannot be raised to a fractional power");
            return 0.0;
        }
        if (isinf(result)) {
            fault_raise(fault, "(34, 'Numerical result out of range')");
            return 0.0;
        }
    }
    return result;
}

/* math.floor: a whole number, without a minus zero. */
static inline double checked_floor(double x, Fault *fault)
{
    if (!isfinite(x)) {
        fault_raise(fault, "cannot convert float %s to integer", isnan(x) ? "NaN" : "infinity");
        return 0.0;
    }
    return floor(x) + 0.0;
}

/* int(x): Python has integers of any size, C has not. */
static inline int checked_int(double x, Fault *fault)
{
    if (!(x > -1.0 + INT_MIN && x < 1.0 + INT_MAX)) {
        fault_raise(fault, isfinite(x) ? "%r is beyond the integers of C" : "cannot convert float %r to integer", x);
        return 0;
    }
    return (int)x;
}

/* Index into a tuple of n items; below 0 it counts from the end. */
static inline int checked_index(int k, int n, Fault *fault)
{
    int place = k < 0 ? k + n : k;
    if (place < 0 || place >= n) {
        fault_raise(fault, "tuple index out of range");
        return 0;
    }
    return place;
}

static inline double degrees(double x) { return x * (180.0 / 3.141592653589793); }
static inline double radians(double x) { return x * (3.141592653589793 / 180.0); }

/* min and max as Python chooses between equal numbers and beside NaN. */
static inline double lesser(double a, double b) { return b < a ? b : a; }
static inline double greater(double a, double b) { return b > a ? b : a; }
static inline int int_lesser(int a, int b) { return b < a ? b : a; }
static inline int int_greater(int a, int b) { return b > a ? b : a; }

#endif
