/* The sentence of a fault, with numbers as Python prints them. */
#include "checked.h"

#include <stdio.h>
#include <string.h>

enum { DIGITS = 17, LONGEST = 48 };

/* Digits of a finite number, the fewest that read back as the same number; its decimal exponent is returned. */
static int shortest(double x, char digits[DIGITS + 1])
{
    char text[LONGEST];
    const char *c;
    int count, n = 0;
    for (count = 1; count <= DIGITS; count++) {
        snprintf(text, sizeof text, "%.*e", count - 1, x);
        if (strtod(text, NULL) == x) {
            break;
        }
    }
    for (c = text; *c != 'e'; c++) {
        if (*c >= '0' && *c <= '9') {
            digits[n++] = *c;  /* not the point, which is a comma in some countries */
        }
    }
    digits[n] = '\0';
    return (int)strtod(c + 1, NULL);
}

/* Text of a number as repr() gives it. */
static void python_repr(double x, char text[LONGEST])
{
    char digits[DIGITS + 1];
    char *out = text;
    int exponent, count, k;
    if (!isfinite(x)) {
        strcpy(text, isnan(x) ? "nan" : x > 0.0 ? "inf" : "-inf");
        return;
    }
    exponent = shortest(fabs(x), digits);
    count = (int)strlen(digits);
    if (signbit(x)) {
        *out++ = '-';
    }
    if (exponent < -4 || exponent >= 16) {
        *out++ = digits[0];
        if (count > 1) {
            *out++ = '.';
            strcpy(out, digits + 1);
            out += count - 1;
        }
        snprintf(out, 8, "e%c%02d", exponent < 0 ? '-' : '+', abs(exponent) % 1000);
        return;
    }
    for (k = exponent < 0 ? exponent : 0; k < count || k <= exponent + 1; k++) {
        if (k == exponent + 1) {
            *out++ = '.';
        }
        *out++ = k >= 0 && k < count ? digits[k] : '0';
    }
    *out = '\0';
}

/* One conversion of the format, `width` characters long, such as %.4g. */
static void formatted(const char *conversion, size_t width, double x, char text[LONGEST])
{
    char one[16] = "";
    char *c;
    memcpy(one, conversion, width < sizeof one ? width : sizeof one - 1);
    snprintf(text, LONGEST, one, x);
    for (c = text; *c != '\0'; c++) {
        *c = *c == ',' ? '.' : *c;
    }
}

static size_t appended(char *text, size_t size, size_t at, const char *more)
{
    size_t length = strlen(more);
    length = length < size - 1 - at ? length : size - 1 - at;
    memcpy(text + at, more, length);
    text[at + length] = '\0';
    return at + length;
}

/* Write a sentence; %r is a double as repr() prints it, %d an int, %s a string, and %g, %.3f, ... a double. */
void sentence_write(char *text, size_t size, const char *format, va_list values)
{
    size_t at = 0;
    text[0] = '\0';
    while (*format != '\0') {
        char number[LONGEST] = {format[0], '\0'};
        const char *more = number;
        size_t width = 1;
        if (*format == '%') {
            width += strcspn(format + 1, "rdsgfe%") + 1;
            switch (format[width - 1]) {
            case 'r':
                python_repr(va_arg(values, double), number);
                break;
            case 'd':
                snprintf(number, sizeof number, "%d", va_arg(values, int));
                break;
            case 's':
                more = va_arg(values, const char *);
                break;
            case '%':
                break;
            default:
                formatted(format, width, va_arg(values, double), number);
            }
        }
        at = appended(text, size, at, more);
        format += width;
    }
}

void fault_raise(Fault *fault, const char *format, ...)
{
    va_list values;
    if (fault->raised) {
        return;
    }
    fault->raised = true;
    va_start(values, format);
    sentence_write(fault->text, sizeof fault->text, format, values);
    va_end(values);
}

void sentence_put(char *text, size_t size, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    sentence_write(text, size, format, values);
    va_end(values);
}

double checked_not_finite(double result, double argument, bool can_overflow, Fault *fault)
{
    if (isnan(result) && !isnan(argument)) {
        fault_raise(fault, "math domain error");
        return 0.0;
    }
    if (isinf(result) && isfinite(argument)) {
        fault_raise(fault, can_overflow ? "math range error" : "math domain error");
        return 0.0;
    }
    return result;
}
