/* What the libraries for Windows need beside the Universal C Runtime, which is part of Windows 10 and later.
 *
 * MinGW's own start-up code and printf would be 45 kB in each library, and a minute to compile at the first build. None
 * of it is needed: there is nothing to start up. Only tsm-fmu's own builds compile this file, in place of all.c.
 */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved);

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library, (void)reason, (void)reserved;
    return 1;
}

/* Functions that MinGW's headers call. */
int __isnan(double x) { return __builtin_isnan(x); }
int __signbit(double x) { return __builtin_signbit(x); }

int __fpclassify(double x)
{
    return __builtin_fpclassify(FP_NAN, FP_INFINITE, FP_NORMAL, FP_SUBNORMAL, FP_ZERO, x);
}

/* The compiler joins the sine and the cosine of one number; by these names it does not know them. */
double plain_sin(double x) __asm__("sin");
double plain_cos(double x) __asm__("cos");
void sincos(double x, double *sine, double *cosine);

void sincos(double x, double *sine, double *cosine)
{
    *sine = plain_sin(x);
    *cosine = plain_cos(x);
}

int snprintf(char *text, size_t size, const char *format, ...)
{
    int length;
    va_list values;
    va_start(values, format);
    length = __stdio_common_vsprintf(2 /* as in C99 */, text, size, format, NULL, values);
    va_end(values);
    return length;
}

/* Touch each page of a large frame, rax bytes, as the compiler expects it: Windows grows a stack page by page. */
__asm__(
    ".globl ___chkstk_ms\n"
    "___chkstk_ms:\n"
    "  pushq %rcx\n"
    "  pushq %rax\n"
    "  cmpq $0x1000, %rax\n"
    "  leaq 24(%rsp), %rcx\n"
    "  jb 1f\n"
    "2:\n"
    "  subq $0x1000, %rcx\n"
    "  testq %rcx, (%rcx)\n"
    "  subq $0x1000, %rax\n"
    "  cmpq $0x1000, %rax\n"
    "  ja 2b\n"
    "1:\n"
    "  subq %rax, %rcx\n"
    "  testq %rcx, (%rcx)\n"
    "  popq %rax\n"
    "  popq %rcx\n"
    "  retq\n");

#include "all.c"
