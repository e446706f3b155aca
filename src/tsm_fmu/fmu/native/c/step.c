/* The calls of a running simulation: step, set, get. Compiled for speed, the rest of the layer for size. */
#include "slave.h"

#include <float.h>
#include <stdint.h>
#include <string.h>

static const double TIME_TOLERANCE = 1e-3;  /* how far a step may begin from the end of the last one, per step... */
static const double ROUNDING = 1e-15;       /* ... and per time: hosts add up their clocks in different ways */
static const double SMALLER = 1.0 / 1024.0; /* the step that is tried to tell whether a smaller one helps */

/* ---- step */

COLD static Status wrong_time(Slave *slave, double time, double step)
{
    if (!(step > 0.0 && step <= DBL_MAX)) {
        return slave_tell(slave, STATUS_ERROR,
            "step size %r s at t = %r s -- expected a positive finite number -- correct it", step, time);
    }
    return slave_tell(slave, STATUS_ERROR,
        "step from t = %r s -- expected t = %r s -- go on where the last step ended", time, slave->memory.time);
}

/* Position of the first number that is none; -1 if all are. */
static int first_not_finite(const Values *values, int first, int end)
{
    int k;
    for (k = first; k < end; k++) {
        if (!isfinite(value_get(values, k))) {
            return k;
        }
    }
    return -1;
}

/* Whether a step may begin at that time with that size. */
static bool right_time(const Memory *m, double time, double step)
{
    return step > 0.0 && step <= DBL_MAX && fabs(time - m->time) <= TIME_TOLERANCE * step + ROUNDING * fabs(time);
}

/* Whether two numbers are the same bits: cheaper than ==, and what it misses (-0.0) goes the long way. */
static inline bool same(double a, double b)
{
    uint64_t first, second;
    memcpy(&first, &a, sizeof first);
    memcpy(&second, &b, sizeof second);
    return first == second;
}

/* A step of another size than the last, or at a time that a host has rounded otherwise. */
COLD static Status step_anew(Slave *slave, const char *function, double time, double step)
{
    Memory *m = &slave->memory;
    const double last_time = m->time, last_step = m->last_step;
    Status status;
    if (!right_time(m, time, step)) {
        return wrong_time(slave, time, step);
    }
    m->time = time;
    m->last_step = step;
    status = slave_step(slave, function, time, step);
    if (status != STATUS_OK) {
        m->time = last_time;
        m->last_step = last_step;
    }
    return status;
}

/* A step in another mode than STEPPING. */
COLD static Status step_from(Slave *slave, const char *function, double time, double step)
{
    Memory *m;
    int wrong;
    if (SLAVE_REFUSES(slave, RUNNING, function)) {
        return STATUS_ERROR;
    }
    m = &slave->memory;
    if (!right_time(m, time, step)) {
        return wrong_time(slave, time, step);
    }
    wrong = first_not_finite(&m->values, FIRST_INPUT, FIRST_OUTPUT);
    if (wrong >= 0) {
        return slave_tell(slave, STATUS_ERROR, "input %s = %r at t = %r s -- expected a finite number -- " MEND,
            model_variables[wrong].name, value_get(&m->values, wrong), time);
    }
    m->mode = STEPPING;
    return slave_step(slave, function, time, step);
}

/* What a step has gone wrong in: VARIABLES for a fault, else the position of the output that is no number; -1 if the
 * sum of the outputs was none, but each of them is. */
COLD static int wrong_output(const Slave *slave, Outputs y)
{
    Values next = model_start_values;
    next.y = y;
    return slave->fault.raised ? VARIABLES : first_not_finite(&next, FIRST_OUTPUT, VARIABLES);
}

/* A step that went wrong is a discard where a far smaller one succeeds, else an error: the host need not try. */
COLD static Status refused(Slave *slave, double step, int wrong, Outputs y)
{
    State after;
    Values next = model_start_values;
    Status status;
    double time = slave->memory.time;
    char inputs[1024];
    slave_inputs_text(slave, inputs, sizeof inputs);
    if (wrong < VARIABLES) {
        next.y = y;
        slave_note(slave, "output %s = %r at t = %r s with %s -- expected a finite number -- reduce the step",
            model_variables[wrong].name, value_get(&next, wrong), time, inputs);
    } else {
        slave_note(slave, "step at t = %r s with %s failed: %s", time, inputs, slave->fault.text);
    }
    slave->fault.raised = false;
    model_step(&slave->memory.values.p, &slave->memory.state, &slave->memory.values.u, SMALLER * step, &after, &y,
        &slave->fault);
    status = slave->fault.raised ? STATUS_ERROR : STATUS_DISCARD;
    if (status == STATUS_ERROR) {
        slave->memory.mode = FAILED;
    }
    return slave_pass_on(slave, status);
}

/* A tendon that would have to push; where T_in stays 0 the host uses the other direction, and T_out means nothing. */
static void watch_slack(Slave *slave)
{
    Memory *m = &slave->memory;
    if (MEASURED_TENSION >= 0 && !m->slack_told) {
        double tension = value_get(&m->values, DISTAL_TENSION);
        if (tension < 0.0 && value_get(&m->values, MEASURED_TENSION) != 0.0) {
            m->slack_told = true;
            slave_tell(slave, STATUS_WARNING, "T_out = %r N at t = %r s: the tendon would push -- slack is not in this model "
                "(said once)", tension, m->time);
        }
    }
}

/* Each test here is paid at each step: what is rare is put off to the functions above. `y` leaves by value, so that it
 * stays in registers. */
Status slave_step(Slave *slave, const char *function, double time, double step)
{
    Memory *m;
    State after;
    Outputs y;
    if (RARELY(slave == NULL || slave->memory.mode != STEPPING)) {
        return step_from(slave, function, time, step);
    }
    m = &slave->memory;
    if (RARELY(!same(time, m->time) || !same(step, m->last_step))) {
        return step_anew(slave, function, time, step);
    }
    slave->fault.raised = false;
    model_within_bounds(&m->values.p);
    model_step(&m->values.p, &m->state, &m->values.u, step, &after, &y, &slave->fault);
    if (RARELY(slave->fault.raised || !(fabs(model_outputs_sum(&y)) <= DBL_MAX))) {
        const int wrong = wrong_output(slave, y);
        if (wrong >= 0) {
            return refused(slave, m->last_step, wrong, y);
        }
    }
    m->before = m->state;
    m->held = m->values.u;
    m->state = after;
    m->values.y = y;
    m->time += m->last_step;  /* time + step: both are these, and need not outlast the call of model_step */
    watch_slack(slave);
    return STATUS_OK;
}

/* ---- values */

static const char *const KINDS[] = {"Real", "Integer", "Enumeration", "this type"};

Status slave_wrong(Slave *slave, unsigned reference, const char *what)
{
    if (reference < VARIABLES) {
        return slave_tell(slave, STATUS_ERROR, "variable %s %s", model_variables[reference].name, what);
    }
    return slave_tell(slave, STATUS_ERROR, "value reference %.0f %s", (double)reference, what);
}

COLD static Status wrong_read(Slave *slave, Kind kind, unsigned reference)
{
    char what[96];
    sentence_put(what, sizeof what, "read as %s -- expected a variable of that type -- " NEXT, KINDS[kind]);
    return slave_wrong(slave, reference, what);
}

COLD static Status wrong_write(Slave *slave, Kind kind, unsigned reference, double value, const char *why)
{
    char what[160];
    sentence_put(what, sizeof what, kind == REAL ? "set to %r -- %s" : "set to %.0f -- %s", value, why);
    return slave_wrong(slave, reference, what);
}

size_t slave_count(const unsigned *references, size_t n)
{
    size_t k, total = 0;
    for (k = 0; k < n; k++) {
        size_t count = references[k] < VARIABLES ? model_variables[references[k]].count : 1;
        total += count == 0 ? 1 : count;
    }
    return total;
}

/* Error with a message where a call may not go on to its values. */
static Status unready(
    Slave *slave, const char *function, int modes, const unsigned *references, size_t n, const void *numbers, size_t count)
{
    if (SLAVE_REFUSES(slave, modes, function)) {
        return STATUS_ERROR;
    }
    if (n > 0 && references == NULL) {
        return slave_null(slave, function, "valueReferences");
    }
    if (n > 0 && numbers == NULL) {
        return slave_null(slave, function, "values");
    }
    if (slave_count(references, n) != count) {
        return slave_unsupported(slave, function, "number of values -- expected one for each element of each variable");
    }
    return STATUS_OK;
}

static inline Status values_read(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, void *numbers, size_t count)
{
    size_t k, j, many, at = 0;
    Status status = unready(slave, function, READABLE, references, n, numbers, count);
    if (status != STATUS_OK) {
        return status;
    }
    status = slave_refresh(slave);
    for (k = 0; k < n; k++) {
        unsigned first = slave_found(kind, references[k], &many);
        if (first == VARIABLES) {
            status = wrong_read(slave, kind, references[k]);
            at += slave_count(&references[k], 1);
            continue;
        }
        for (j = 0; j < many; j++, at++) {
            double number = value_get(&slave->memory.values, (int)(first + j));
            if (kind == REAL) {
                ((double *)numbers)[at] = number;
            } else if (kind == INTEGER) {
                ((int *)numbers)[at] = (int)number;
            } else {
                ((int64_t *)numbers)[at] = (int64_t)number;
            }
        }
    }
    return status;
}

static inline Status values_write(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, const void *numbers, size_t count)
{
    Memory *m;
    size_t k, j, many, at = 0;
    Status status = unready(slave, function, WRITABLE, references, n, numbers, count);
    if (status != STATUS_OK) {
        return status;
    }
    m = &slave->memory;
    for (k = 0; k < n; k++) {
        unsigned first = slave_found(kind, references[k], &many);
        for (j = 0; j < many; j++, at++) {
            double number = kind == REAL ? ((const double *)numbers)[at]
                : kind == INTEGER ? (double)((const int *)numbers)[at]
                : kind == ENUMERATION ? (double)((const int64_t *)numbers)[at] : NAN;
            if (RARELY(first >= FIRST_OUTPUT)) {
                return wrong_write(slave, kind, references[k], number,
                    "expected an input or parameter of this type -- " NEXT);
            }
            if (RARELY(first < FIRST_INPUT && (m->mode & RUNNING))) {
                return wrong_write(slave, kind, references[k], number,
                    "it is fixed after initialisation -- reset the instance");
            }
            value_put(&m->values, (int)(first + j), number);
            if (!(m->mode & RUNNING)) {
                m->stale = true;
            } else if (RARELY(!(fabs(number) <= DBL_MAX))) {
                m->mode = STALLED;
            }
        }
    }
    return STATUS_OK;
}

Status slave_read(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, void *numbers, size_t count)
{
    return values_read(slave, function, kind, references, n, numbers, count);
}

Status slave_write(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, const void *numbers, size_t count)
{
    return values_write(slave, function, kind, references, n, numbers, count);
}

Status slave_read_real(
    Slave *slave, const char *function, const unsigned *references, size_t n, double *numbers, size_t count)
{
    return values_read(slave, function, REAL, references, n, numbers, count);
}

Status slave_write_real(
    Slave *slave, const char *function, const unsigned *references, size_t n, const double *numbers, size_t count)
{
    return values_write(slave, function, REAL, references, n, numbers, count);
}
