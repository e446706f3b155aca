/* What the FMI layers need to know of a model: its variables, in the order of their value references. */
#ifndef TSM_FMU_INTERFACE_H
#define TSM_FMU_INTERFACE_H

#include <stddef.h>

#include "constants.h"
#include "model.h"

/* What a host sets and reads. */
typedef struct {
    Params p;
    Inputs u;
    Outputs y;
} Values;

typedef enum { REAL, INTEGER, ENUMERATION, NO_KIND } Kind;  /* the last: a type that no variable has */

typedef struct {
    const char *name;
    const char *unit;      /* with a space before it; empty for a pure number */
    const char *meaning;
    const char *expected;  /* its bounds in words */
    Kind kind;
    size_t offset;         /* in Values */
    size_t count;          /* of numbers in the variable that begins here; 0 within an array of FMI 3.0 */
    double lo, hi;
    bool open_lo, open_hi; /* the bound itself is not allowed */
} Variable;

/* Parameters, then inputs from FIRST_INPUT on, then outputs from FIRST_OUTPUT on. */
extern const Variable model_variables[VARIABLES];
extern const Values model_start_values;

/* For the compiler: a parameter of a started unit is within its bounds, so that one which may not be 0 is not asked
 * again before it divides. */
void model_within_bounds(const Params *p);

/* Sum of all outputs: not finite if one of them is not, which is the cheapest way to ask. */
double model_outputs_sum(const Outputs *y);

static inline double value_get(const Values *values, int k)
{
    const char *at = (const char *)values + model_variables[k].offset;
    return model_variables[k].kind == REAL ? *(const double *)at : (double)*(const int *)at;
}

static inline void value_put(Values *values, int k, double value)
{
    char *at = (char *)values + model_variables[k].offset;
    if (model_variables[k].kind == REAL) {
        *(double *)at = value;
    } else {
        *(int *)at = (int)value;
    }
}

#endif
