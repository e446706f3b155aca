/* A C host of FMI 2.0 co-simulation units, told on its command line which calls to make.

       c_host LIBPYTHON LIBRARY GUID URI CALL...

   LIBPYTHON is loaded first, "-" for none. Each CALL prints itself and the status it got; log messages print as they come.
       logging=0|1            for the next instantiate
       reload                 unload the library and load it again
       logger=0|1             whether the host has a logger
       instantiate setup enter exit terminate reset free
       step=TIME,STEP         doStep
       set=REFERENCE,VALUE    get=REFERENCE          setReal, getReal
       refused=N              N steps of size 0; prints the memory that each keeps
       threads=M,N,IN,OUT     M threads with an instance each, N times set, step, get; prints CPU time per step and the sums
       passing=M,IN,OUT       M threads one after the other make one step of one instance; prints the memory each keeps */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

typedef void *Unit;
typedef void (*Logger)(void *, const char *, int, const char *, const char *, ...);
typedef struct {
    Logger logger;
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void *finished, *environment;
} Callbacks;

static Unit (*instantiate)(const char *, int, const char *, const char *, const Callbacks *, int, int);
static int (*setup)(Unit, int, double, double, int, double);
static int (*enter)(Unit), (*leave)(Unit), (*terminate)(Unit), (*reset)(Unit);
static int (*step)(Unit, double, double, int);
static int (*set_real)(Unit, const unsigned *, size_t, const double *);
static int (*get_real)(Unit, const unsigned *, size_t, double *);
static void (*release)(Unit);
static const char *guid, *uri, *path;
static void *library;
static int logging = 0, told = 1;

static void log_line(void *environment, const char *name, int status, const char *category, const char *text, ...) {
    va_list more;
    (void)environment;
    if (!told) return;
    printf("log %s %d %s ", name, status, category ? category : "-");
    va_start(more, text);
    vprintf(text, more);
    va_end(more);
    printf("\n");
    fflush(stdout);
}

static Callbacks callbacks = {log_line, calloc, free, NULL, NULL};

static void *found(const char *name) {
    void *symbol = dlsym(library, name);
    if (!symbol) {
        fprintf(stderr, "%s\n", dlerror());
        exit(2);
    }
    return symbol;
}

static void load(void) {
    library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (!library) {
        printf("cannot load: %s\n", dlerror());
        exit(3);
    }
    *(void **)&instantiate = found("fmi2Instantiate");
    *(void **)&setup = found("fmi2SetupExperiment");
    *(void **)&enter = found("fmi2EnterInitializationMode");
    *(void **)&leave = found("fmi2ExitInitializationMode");
    *(void **)&terminate = found("fmi2Terminate");
    *(void **)&reset = found("fmi2Reset");
    *(void **)&step = found("fmi2DoStep");
    *(void **)&set_real = found("fmi2SetReal");
    *(void **)&get_real = found("fmi2GetReal");
    *(void **)&release = found("fmi2FreeInstance");
}

static long resident(void) {
    long pages = 0, all = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &all, &pages) != 2) exit(4);
    fclose(file);
    return pages * sysconf(_SC_PAGESIZE);
}

static Unit started(const char *name) {
    Unit unit = instantiate(name, 1, guid, uri, &callbacks, 0, logging);
    if (!unit || setup(unit, 0, 0, 0, 0, 0) || enter(unit) || leave(unit)) {
        printf("cannot start %s\n", name);
        exit(5);
    }
    return unit;
}

typedef struct {
    Unit unit;
    long steps, first;
    unsigned in, out;
    double seconds, sum;
    int worst;
} Run;

static void *run(void *given) {
    Run *r = given;
    struct timespec before, after;
    const double size = 1.0 / 1024;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &before);
    for (long n = r->first; n < r->first + r->steps; n++) {
        double u = 0.5 * ((n % 2000) - 1000) / 1000, y = 0;
        int status = set_real(r->unit, &r->in, 1, &u);
        if (!status) status = step(r->unit, n * size, size, 1);
        if (!status) status = get_real(r->unit, &r->out, 1, &y);
        if (status > r->worst) r->worst = status;
        r->sum += y;
    }
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &after);
    r->seconds = (after.tv_sec - before.tv_sec) + 1e-9 * (after.tv_nsec - before.tv_nsec);
    return NULL;
}

static void threads(const char *numbers) {
    int many;
    long steps;
    unsigned in, out;
    if (sscanf(numbers, "%d,%ld,%u,%u", &many, &steps, &in, &out) != 4) exit(6);
    Run *runs = calloc(many, sizeof *runs);
    pthread_t *ids = calloc(many, sizeof *ids);
    for (int m = 0; m < many; m++) runs[m] = (Run){started("of_a_thread"), steps, 0, in, out, 0, 0, 0};
    for (int m = 0; m < many; m++) pthread_create(&ids[m], NULL, run, &runs[m]);
    for (int m = 0; m < many; m++) pthread_join(ids[m], NULL);
    for (int m = 0; m < many; m++) {
        printf("thread %d %.3f us %.17g\n", runs[m].worst, 1e6 * runs[m].seconds / steps, runs[m].sum);
        terminate(runs[m].unit);
        release(runs[m].unit);
    }
    free(runs);
    free(ids);
}

static void passing(const char *numbers) {
    int many;
    Run r = {0};
    if (sscanf(numbers, "%d,%u,%u", &many, &r.in, &r.out) != 3) exit(6);
    r.unit = started("passed_on");
    r.steps = 1;
    long before = 0;
    for (int m = 0; m < many; m++, r.first++) {
        pthread_t id;
        if (m == many / 2) before = resident();
        pthread_create(&id, NULL, run, &r);
        pthread_join(id, NULL);
    }
    printf("passing %d %ld B %.17g\n", r.worst, (resident() - before) / (many - many / 2), r.sum);
    terminate(r.unit);
    release(r.unit);
}

static void refused(Unit unit, long many) {
    int worst = 0;
    long before = 0;
    told = 0;
    for (long n = 0; n < many; n++) {
        if (n == many / 2) before = resident();
        int status = step(unit, 0, 0, 1);
        if (status > worst) worst = status;
    }
    told = 1;
    printf("refused %d %ld B\n", worst, (resident() - before) / (many - many / 2));
}

static void call(Unit *unit, const char *text) {
    const char *value = strchr(text, '=');
    double a = 0, b = 0;
    unsigned reference;
    int status = -1;
    if (value) value++;
    if (!strncmp(text, "logging=", 8)) { logging = atoi(value); return; }
    if (!strcmp(text, "reload")) { dlclose(library); load(); return; }
    if (!strncmp(text, "logger=", 7)) { callbacks.logger = atoi(value) ? log_line : NULL; return; }
    if (!strncmp(text, "refused=", 8)) { refused(*unit, atol(value)); return; }
    if (!strncmp(text, "threads=", 8)) { threads(value); return; }
    if (!strncmp(text, "passing=", 8)) { passing(value); return; }
    if (!strcmp(text, "instantiate")) {
        *unit = instantiate("one", 1, guid, uri, &callbacks, 0, logging);
        status = *unit ? 0 : 4;
    } else if (!strcmp(text, "setup")) status = setup(*unit, 0, 0, 0, 0, 0);
    else if (!strcmp(text, "enter")) status = enter(*unit);
    else if (!strcmp(text, "exit")) status = leave(*unit);
    else if (!strcmp(text, "terminate")) status = terminate(*unit);
    else if (!strcmp(text, "reset")) status = reset(*unit);
    else if (!strcmp(text, "free")) { release(*unit); status = 0; }
    else if (sscanf(text, "step=%lf,%lf", &a, &b) == 2) status = step(*unit, a, b, 1);
    else if (sscanf(text, "set=%u,%lf", &reference, &a) == 2) status = set_real(*unit, &reference, 1, &a);
    else if (sscanf(text, "get=%u", &reference) == 1) {
        status = get_real(*unit, &reference, 1, &a);
        printf("value %.17g\n", a);
    }
    printf("%s %d\n", text, status);
    fflush(stdout);
}

int main(int many, char **words) {
    Unit unit = NULL;
    if (many < 5) return 1;
    if (strcmp(words[1], "-") && !dlopen(words[1], RTLD_NOW | RTLD_GLOBAL)) {
        printf("cannot load: %s\n", dlerror());
        return 3;
    }
    guid = words[3];
    uri = words[4];
    path = words[2];
    load();
    for (int n = 5; n < many; n++) call(&unit, words[n]);
    return 0;
}
