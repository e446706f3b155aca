/* Steps one native unit, FMI 2.0 or 3.0, on Linux or Windows, and prints its first output every 100 steps.
 *
 * With LIVES given (Linux), so many instances make one step each and are freed; then one makes STEPS steps. Printed is the
 * memory that the process has grown by after the first tenth of the lives.
 * Compiled for each unit with FMI, LIBRARY, TOKEN, VR_IN, VR_OUT, STEPS and STEP given. On Windows there is no start-up
 * code, so that MinGW's need not be compiled.
 */
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#ifdef _WIN32
#include <windows.h>
#define OPEN(path) (void *)LoadLibraryA(path)
#define FIND(library, name) (void *)GetProcAddress((HMODULE)(library), name)
#define SAY(...) do { char line[200]; snprintf(line, sizeof line, __VA_ARGS__); puts(line); fflush(stdout); } while (0)
int snprintf(char *text, size_t size, const char *format, ...)
{
    va_list values;
    int length;
    va_start(values, format);
    length = __stdio_common_vsprintf(2, text, size, format, NULL, values);
    va_end(values);
    return length;
}
#else
#include <dlfcn.h>
#define OPEN(path) dlopen(path, RTLD_NOW)
#define FIND(library, name) dlsym(library, name)
#define SAY(...) (printf(__VA_ARGS__), puts(""))
#endif

#ifndef LIVES
#define LIVES 0
#endif
#ifndef INPUTS  /* 0 for a unit without inputs, else 1 */
#define INPUTS 1
#endif

#if LIVES > 0
static long resident(void)  /* kB, without pages of files: code that is met late is no growth */
{
    long pages = 0, shared = 0, all = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (file == NULL || fscanf(file, "%ld %ld %ld", &all, &pages, &shared) != 3) return -1;
    fclose(file);
    return 4 * (pages - shared);
}
#endif

typedef void *Unit;
typedef struct { void *logger, *allocate, *release, *finished, *environment; } Callbacks;

static int fail(const char *what)
{
    SAY("failed: %s", what);
    return 1;
}

static int run(void)
{
    void *library = OPEN(LIBRARY);
    const unsigned input = VR_IN, output = VR_OUT;
    double y = 0.0;
    int k, worst = 0;
    long life, steps, before = 0;
    Unit unit;
    if (library == NULL) return fail("load");
#if FMI == 2
    static const Callbacks callbacks;
    Unit (*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int);
    int (*setup)(Unit, int, double, double, int, double), (*enter)(Unit), (*leave)(Unit);
    int (*set)(Unit, const unsigned *, size_t, const double *), (*get)(Unit, const unsigned *, size_t, double *);
    int (*step)(Unit, double, double, int);
    *(void **)&instantiate = FIND(library, "fmi2Instantiate");
    *(void **)&setup = FIND(library, "fmi2SetupExperiment");
    *(void **)&enter = FIND(library, "fmi2EnterInitializationMode");
    *(void **)&leave = FIND(library, "fmi2ExitInitializationMode");
    *(void **)&set = FIND(library, "fmi2SetReal");
    *(void **)&get = FIND(library, "fmi2GetReal");
    *(void **)&step = FIND(library, "fmi2DoStep");
    void (*release)(Unit);
    *(void **)&release = FIND(library, "fmi2FreeInstance");
#else
    Unit (*instantiate)(const char *, const char *, const char *, bool, bool, bool, bool, const unsigned *, size_t, void *,
        void *, void *);
    int (*enter)(Unit, bool, double, double, bool, double), (*leave)(Unit);
    int (*set)(Unit, const unsigned *, size_t, const double *, size_t);
    int (*get)(Unit, const unsigned *, size_t, double *, size_t);
    int (*step)(Unit, double, double, bool, bool *, bool *, bool *, double *);
    bool event, end, early;
    double time;
    *(void **)&instantiate = FIND(library, "fmi3InstantiateCoSimulation");
    *(void **)&enter = FIND(library, "fmi3EnterInitializationMode");
    *(void **)&leave = FIND(library, "fmi3ExitInitializationMode");
    *(void **)&set = FIND(library, "fmi3SetFloat64");
    *(void **)&get = FIND(library, "fmi3GetFloat64");
    *(void **)&step = FIND(library, "fmi3DoStep");
    void (*release)(Unit);
    *(void **)&release = FIND(library, "fmi3FreeInstance");
#endif
    for (life = 0; life <= LIVES; life++) {
#if FMI == 2
        unit = instantiate("one", 1, TOKEN, "", &callbacks, 0, 0);
        if (unit == NULL || setup(unit, 0, 0.0, 0.0, 0, 0.0) || enter(unit) || leave(unit)) return fail("start");
#else
        unit = instantiate("one", TOKEN, "", false, false, false, false, NULL, 0, NULL, NULL, NULL);
        if (unit == NULL || enter(unit, false, 0.0, 0.0, false, 0.0) || leave(unit)) return fail("start");
#endif
        steps = life == LIVES ? STEPS : 1;
        for (k = 0; k < steps; k++) {
            double u = (k * 37L % 200) / 400.0 - (LIVES > 0 ? 0.0 : 0.2);
#if FMI == 2
            int status = set(unit, &input, INPUTS, &u) | step(unit, k * STEP, STEP, 1) | get(unit, &output, 1, &y);
#else
            int status = set(unit, &input, INPUTS, &u, INPUTS) | step(unit, k * STEP, STEP, true, &event, &end, &early, &time)
                | get(unit, &output, 1, &y, 1);
#endif
            worst |= status;
            if (LIVES == 0 && k % 100 == 99) SAY("%.17g", y);
        }
        release(unit);
#if LIVES > 0
        if (life == LIVES / 10) before = resident();
    }
    SAY("%ld", resident() - before);
#else
    }
    (void)before;
#endif
    return worst == 0 ? 0 : fail("step");
}

#ifdef _WIN32
void wWinMainCRTStartup(void)  /* the entry that zig asks for */
{
    ExitProcess((unsigned)run());
}
#else
int main(void)
{
    return run();
}
#endif
