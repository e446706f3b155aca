/* What kinds_2.c and kinds_3.c compute: each kind of variable from all others, exact where it is no Real. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    double load, speed, rate;   /* input, output, parameter */
    long long ask, count;
    int held, over;
    long long mode, gear;       /* Enumerations: 0 off, 1 slow, 2 fast; 0 neutral, 1 first, 2 second */
    char call[64], answer[64];
} Kinds;

static Kinds *kinds(void) { Kinds *k = calloc(1, sizeof(Kinds)); k->rate = 0.37; return k; }
static void kinds_text(Kinds *k, const char *text) { snprintf(k->call, sizeof k->call, "%s", text); }
static void kinds_step(Kinds *k, double step) {
    k->speed += step * (1.0 + k->rate * k->load + (double)k->mode - 0.25 * (double)k->ask);
    k->count = k->ask + (k->held ? 2 : 1) - (long long)strlen(k->call) / 5;
    k->over = k->speed > 0.03 * (double)(1 + k->mode);
    k->gear = ((k->count / 2 + k->over + 2 * k->mode) % 3 + 3) % 3;
    snprintf(k->answer, sizeof k->answer, "%.50s%c", k->call, (char)('a' + (k->count + 26000) % 26));
}
