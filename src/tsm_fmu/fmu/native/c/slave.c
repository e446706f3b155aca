#include "slave.h"

#include <stdio.h>
#include <string.h>

static const char *const CATEGORIES[] = {"", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

/* ---- messages */

Status slave_pass_on(Slave *slave, Status status)
{
    if (status > STATUS_WARNING || slave->logging) {
        slave->log(slave, status, CATEGORIES[status], slave->text);
    }
    return status;
}

static void write_text(Slave *slave, const char *format, va_list values)
{
    static const char name[] = MODEL_NAME ": ";
    memcpy(slave->text, name, sizeof name);
    sentence_write(slave->text + sizeof name - 1, sizeof slave->text - sizeof name, format, values);
}

void slave_note(Slave *slave, const char *format, ...)
{
    va_list values;
    va_start(values, format);
    write_text(slave, format, values);
    va_end(values);
}

Status slave_tell(Slave *slave, Status status, const char *format, ...)
{
    va_list values;
    if (slave != NULL) {
        va_start(values, format);
        write_text(slave, format, values);
        va_end(values);
        slave_pass_on(slave, status);
    }
    return status;
}

bool slave_refuses(Slave *slave, int modes, const char *function)
{
    return SLAVE_REFUSES(slave, modes, function);
}

bool slave_disallowed(Slave *slave, const char *function)
{
    const char *mode;
    if (slave == NULL) {
        return true;
    }
    switch (slave->memory.mode) {
    case INSTANTIATED: mode = "before initialisation mode"; break;
    case INITIALIZATION: mode = "in initialisation mode"; break;
    case STEPPING: case STALLED: mode = "after initialisation"; break;
    case TERMINATED: mode = "after termination"; break;
    default: mode = "after an error"; break;
    }
    slave_tell(slave, STATUS_ERROR, "%s -- it is not allowed %s -- follow the call sequence of FMI", function, mode);
    return true;
}

Status slave_unsupported(Slave *slave, const char *function, const char *why)
{
    return slave_tell(slave, STATUS_ERROR, "%s -- %s -- " NEXT, function, why);
}

Status slave_null(Slave *slave, const char *function, const char *argument)
{
    return slave_tell(slave, STATUS_ERROR, "%s of %s is NULL -- expected an address -- correct the host", argument, function);
}

/* Inputs as text: `Inputs(x_in=0.1, tau_out=0.0)`. */
const char *slave_inputs_text(const Slave *slave, char *text, size_t size)
{
    size_t at = (size_t)snprintf(text, size, "Inputs(");
    int k;
    for (k = FIRST_INPUT; k < FIRST_OUTPUT && at < size; k++) {
        sentence_put(text + at, size - at, "%s%s=%r", k == FIRST_INPUT ? "" : ", ", model_variables[k].name,
            value_get(&slave->memory.values, k));
        at += strlen(text + at);
    }
    if (at < size) {
        snprintf(text + at, size - at, ")");
    }
    return text;
}

/* ---- life cycle */

static char *copied(const char *text)
{
    size_t size = strlen(text) + 1;
    char *copy = calloc(1, size);
    return copy == NULL ? NULL : memcpy(copy, text, size);
}

Slave *slave_new(const char *name, const char *guid, bool logging, Log log, void *environment, void *callback)
{
    Slave *slave = calloc(1, sizeof *slave);
    if (slave == NULL) {
        return NULL;
    }
    slave->log = log;
    slave->logging = logging;
    slave->environment = environment;
    slave->callback = callback;
    slave->name = copied(name == NULL ? "" : name);
    if (slave->name == NULL || name == NULL || *name == '\0') {
        slave_tell(slave, STATUS_ERROR, "instance name is missing -- expected a name that is not empty -- give one");
    } else if (guid == NULL || strncmp(guid, MODEL_GUID, sizeof MODEL_GUID) != 0) {
        slave_tell(slave, STATUS_ERROR, "guid %s in modelDescription.xml -- expected %s -- build the FMU again",
            guid == NULL ? "NULL" : guid, MODEL_GUID);
    } else {
        slave_reset(slave);
        return slave;
    }
    slave_free(slave);
    return NULL;
}

void slave_free(Slave *slave)
{
    if (slave != NULL) {
        free(slave->name);
        free(slave);
    }
}

void slave_reset(Slave *slave)
{
    memset(&slave->memory, 0, sizeof slave->memory);
    slave->memory.values = model_start_values;
    slave->memory.mode = INSTANTIATED;
    slave->memory.stale = true;
}

Status slave_setup(Slave *slave, double start)
{
    if (!isfinite(start)) {
        return slave_tell(slave, STATUS_ERROR, "start time %r s -- expected a finite number -- correct it", start);
    }
    slave->memory.time = start;
    return STATUS_OK;
}

Status slave_enter_initialization(Slave *slave)
{
    slave->memory.mode = INITIALIZATION;
    return STATUS_OK;
}

/* ---- start */

static void check_inputs(Slave *slave)
{
    int k;
    for (k = FIRST_INPUT; k < FIRST_OUTPUT; k++) {
        double value = value_get(&slave->memory.values, k);
        if (!isfinite(value)) {
            fault_raise(&slave->fault, "input %s = %r at the start -- expected a finite number -- " MEND,
                model_variables[k].name, value);
        }
    }
}

int slave_out_of_bounds(const Values *values)
{
    int k;
    for (k = 0; k < FIRST_INPUT; k++) {
        const Variable *v = &model_variables[k];
        double value = value_get(values, k);
        bool above = value > v->lo || (value == v->lo && !v->open_lo);
        bool below = value < v->hi || (value == v->hi && !v->open_hi);
        if (!(isfinite(value) && above && below)) {
            return k;
        }
    }
    return -1;
}

static void check_bounds(Slave *slave)
{
    int k = slave_out_of_bounds(&slave->memory.values);
    if (k >= 0) {
        const Variable *v = &model_variables[k];
        const char *format = v->kind == REAL ? "parameter %s = %r%s (%s) -- expected %s -- choose a value inside"
                                             : "parameter %s = %.0f%s (%s) -- expected %s -- choose a value inside";
        fault_raise(&slave->fault, format, v->name, value_get(&slave->memory.values, k), v->unit, v->meaning, v->expected);
    }
}

/* Outputs from parameters and inputs as they are now; NaN where they allow none. */
Status slave_refresh(Slave *slave)
{
    Memory *m = &slave->memory;
    int k;
    if (!m->stale) {
        return STATUS_OK;
    }
    slave->fault.raised = false;
    check_inputs(slave);
    check_bounds(slave);
    if (!slave->fault.raised) {
        model_check(&m->values.p, &slave->fault);
    }
    if (!slave->fault.raised) {
        model_start(&m->values.p, &m->values.u, &m->state, &m->values.y, &slave->fault);
    }
    for (k = FIRST_OUTPUT; k < VARIABLES && !slave->fault.raised; k++) {
        double value = value_get(&m->values, k);
        if (!isfinite(value)) {
            fault_raise(&slave->fault, "output %s = %r at the start -- expected a finite number -- check parameters and "
                "inputs", model_variables[k].name, value);
        }
    }
    m->held = m->values.u;
    m->last_step = 0.0;
    if (slave->fault.raised) {
        for (k = FIRST_OUTPUT; k < VARIABLES; k++) {
            value_put(&m->values, k, model_variables[k].kind == REAL ? NAN : 0.0);
        }
        return slave_tell(slave, STATUS_ERROR, "initialisation failed: %s", slave->fault.text);
    }
    m->stale = false;
    return STATUS_OK;
}

static void tell_warning(void *slave, const char *text)
{
    slave_tell(slave, STATUS_WARNING, "%s", text);
}

Status slave_exit_initialization(Slave *slave)
{
    Status status = slave_refresh(slave);
    if (status != STATUS_OK) {
        slave->memory.mode = FAILED;
        return status;
    }
    model_warnings(&slave->memory.values.p, tell_warning, slave, &slave->fault);
    slave->memory.mode = STEPPING;
    return STATUS_OK;
}
