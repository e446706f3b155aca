#include "slave.h"

#include <float.h>
#include <stdio.h>
#include <string.h>

#define NEXT "see modelDescription.xml"
#define MEND "check what drives it"

static const double TIME_TOLERANCE = 1e-3;  /* how far a step may begin from the end of the last one, per step... */
static const double ROUNDING = 1e-15;       /* ... and per time: hosts add up their clocks in different ways */
static const double SMALLER = 1.0 / 1024.0; /* the step that is tried to tell whether a smaller one helps */

static const char *const CATEGORIES[] = {"", "logStatusWarning", "logStatusDiscard", "logStatusError", "logStatusFatal"};

/* ---- messages */

static Status tell(Slave *slave, Status status)
{
    if (status > STATUS_WARNING || slave->logging) {
        slave->log(slave, status, CATEGORIES[status], slave->text);
    }
    return status;
}

#define TELL(slave, status, ...) \
    (sentence_put((slave)->text, sizeof (slave)->text, MODEL_NAME ": " __VA_ARGS__), tell(slave, status))

bool slave_allowed(Slave *slave, int modes, const char *function)
{
    const char *mode;
    if (slave == NULL) {
        return false;
    }
    if ((int)slave->memory.mode & modes) {
        return true;
    }
    switch (slave->memory.mode) {
    case INSTANTIATED: mode = "before initialisation mode"; break;
    case INITIALIZATION: mode = "in initialisation mode"; break;
    case STEPPING: mode = "after initialisation"; break;
    case TERMINATED: mode = "after termination"; break;
    default: mode = "after an error"; break;
    }
    TELL(slave, STATUS_ERROR, "%s -- it is not allowed %s -- follow the call sequence of FMI", function, mode);
    return false;
}

Status slave_unsupported(Slave *slave, const char *function, const char *why)
{
    return TELL(slave, STATUS_ERROR, "%s -- %s -- " NEXT, function, why);
}

Status slave_null(Slave *slave, const char *function, const char *argument)
{
    return TELL(slave, STATUS_ERROR, "%s of %s is NULL -- expected an address -- correct the host", argument, function);
}

/* Inputs as text: `Inputs(x_in=0.1, tau_out=0.0)`. */
static const char *inputs_text(const Slave *slave, char *text, size_t size)
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
    char *copy = malloc(size);
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
        TELL(slave, STATUS_ERROR, "instance name is missing -- expected a name that is not empty -- give one");
    } else if (guid == NULL || strcmp(guid, MODEL_GUID) != 0) {
        TELL(slave, STATUS_ERROR, "guid %s in modelDescription.xml -- expected %s -- build the FMU again",
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
        return TELL(slave, STATUS_ERROR, "start time %r s -- expected a finite number -- correct it", start);
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

static void check_bounds(Slave *slave)
{
    int k;
    for (k = 0; k < FIRST_INPUT; k++) {
        const Variable *v = &model_variables[k];
        double value = value_get(&slave->memory.values, k);
        bool above = value > v->lo || (value == v->lo && !v->open_lo);
        bool below = value < v->hi || (value == v->hi && !v->open_hi);
        if (!(isfinite(value) && above && below)) {
            const char *format = v->kind == REAL ? "parameter %s = %r%s (%s) -- expected %s -- choose a value inside"
                                                 : "parameter %s = %.0f%s (%s) -- expected %s -- choose a value inside";
            fault_raise(&slave->fault, format, v->name, value, v->unit, v->meaning, v->expected);
        }
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
        return TELL(slave, STATUS_ERROR, "initialisation failed: %s", slave->fault.text);
    }
    m->stale = false;
    return STATUS_OK;
}

static void tell_warning(void *slave, const char *text)
{
    TELL((Slave *)slave, STATUS_WARNING, "%s", text);
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

/* ---- step */

static Status wrong_time(Slave *slave, double time, double step)
{
    if (!(step > 0.0 && step <= DBL_MAX)) {
        return TELL(slave, STATUS_ERROR,
            "step size %r s at t = %r s -- expected a positive finite number -- correct it", step, time);
    }
    return TELL(slave, STATUS_ERROR,
        "step from t = %r s -- expected t = %r s -- go on where the last step ended", time, slave->memory.time);
}

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

/* A step that failed is a discard where a far smaller one succeeds, else an error: the host need not try. */
static Status refused(Slave *slave, double step)
{
    State after;
    Outputs y;
    Status status;
    slave->fault.raised = false;
    model_step(&slave->memory.values.p, &slave->memory.state, &slave->memory.values.u, SMALLER * step, &after, &y,
        &slave->fault);
    status = slave->fault.raised ? STATUS_ERROR : STATUS_DISCARD;
    if (status == STATUS_ERROR) {
        slave->memory.mode = FAILED;
    }
    return tell(slave, status);
}

/* A tendon that would have to push; where T_in stays 0 the host uses the other direction, and T_out means nothing. */
static void watch_slack(Slave *slave)
{
    Memory *m = &slave->memory;
    if (MEASURED_TENSION >= 0 && !m->slack_told) {
        double tension = value_get(&m->values, DISTAL_TENSION);
        if (tension < 0.0 && value_get(&m->values, MEASURED_TENSION) != 0.0) {
            m->slack_told = true;
            TELL(slave, STATUS_WARNING, "T_out = %r N at t = %r s: the tendon would push -- slack is not in this model "
                "(said once)", tension, m->time);
        }
    }
}

Status slave_step(Slave *slave, double time, double step)
{
    Memory *m = &slave->memory;
    Values next;
    State after;
    int wrong;
    char text[1024];
    if (!(step > 0.0 && step <= DBL_MAX) ||
        (time != m->time && !(fabs(time - m->time) <= TIME_TOLERANCE * step + ROUNDING * fabs(time)))) {
        return wrong_time(slave, time, step);
    }
    wrong = isfinite(model_inputs_sum(&m->values.u)) ? -1 : first_not_finite(&m->values, FIRST_INPUT, FIRST_OUTPUT);
    if (wrong >= 0) {
        return TELL(slave, STATUS_ERROR, "input %s = %r at t = %r s -- expected a finite number -- " MEND,
            model_variables[wrong].name, value_get(&m->values, wrong), time);
    }
    slave->fault.raised = false;
    model_step(&m->values.p, &m->state, &m->values.u, step, &after, &next.y, &slave->fault);
    if (slave->fault.raised) {
        sentence_put(slave->text, sizeof slave->text, MODEL_NAME ": step at t = %r s with %s failed: %s", time,
            inputs_text(slave, text, sizeof text), slave->fault.text);
        return refused(slave, step);
    }
    wrong = isfinite(model_outputs_sum(&next.y)) ? -1 : first_not_finite(&next, FIRST_OUTPUT, VARIABLES);
    if (wrong >= 0) {
        sentence_put(slave->text, sizeof slave->text, MODEL_NAME
            ": output %s = %r at t = %r s with %s -- expected a finite number -- reduce the step",
            model_variables[wrong].name, value_get(&next, wrong), time, inputs_text(slave, text, sizeof text));
        return refused(slave, step);
    }
    m->before = m->state;
    m->held = m->values.u;
    m->last_step = step;
    m->state = after;
    m->values.y = next.y;
    m->time = time + step;
    watch_slack(slave);
    return STATUS_OK;
}

/* ---- values */

static Status wrong_access(Slave *slave, unsigned reference, const char *what)
{
    if (reference < VARIABLES) {
        return TELL(slave, STATUS_ERROR, "variable %s %s", model_variables[reference].name, what);
    }
    return TELL(slave, STATUS_ERROR, "value reference %.0f %s", (double)reference, what);
}

Status slave_get(Slave *slave, Kind kind, unsigned reference, double *value)
{
    static const char *const NAMES[] = {"Real", "Integer", "Boolean", "Enumeration", "String"};
    char what[96];
    if (reference < VARIABLES && model_variables[reference].kind == kind) {
        *value = value_get(&slave->memory.values, (int)reference);
        return STATUS_OK;
    }
    sentence_put(what, sizeof what, "read as %s -- expected a variable of that type -- " NEXT, NAMES[kind]);
    return wrong_access(slave, reference, what);
}

Status slave_set(Slave *slave, Kind kind, unsigned reference, double value)
{
    char what[160];
    Memory *m = &slave->memory;
    if (reference >= FIRST_OUTPUT || model_variables[reference].kind != kind) {
        sentence_put(what, sizeof what, kind == REAL
            ? "set to %r -- expected an input or parameter of this type -- " NEXT
            : "set to %.0f -- expected an input or parameter of this type -- " NEXT, value);
        return wrong_access(slave, reference, what);
    }
    if (reference < FIRST_INPUT && m->mode == STEPPING) {
        sentence_put(what, sizeof what, kind == REAL
            ? "set to %r -- it is fixed after initialisation -- reset the instance"
            : "set to %.0f -- it is fixed after initialisation -- reset the instance", value);
        return wrong_access(slave, reference, what);
    }
    value_put(&m->values, (int)reference, value);
    m->stale = m->mode != STEPPING;
    return STATUS_OK;
}

/* ---- derivatives */

Status slave_derivative(
    Slave *slave, const unsigned *unknowns, size_t n_unknowns, const unsigned *knowns, size_t n_knowns,
    const double *seed, double *result)
{
    Memory *m = &slave->memory;
    Values change;
    State still, moved;
    size_t k;
    Status status = slave_refresh(slave);
    if (status != STATUS_OK) {
        return status;
    }
    memset(&change, 0, sizeof change);
    memset(&still, 0, sizeof still);
    for (k = 0; k < n_knowns; k++) {
        bool known = knowns[k] < FIRST_OUTPUT && model_variables[knowns[k]].kind == REAL;
        if (!known || (knowns[k] < FIRST_INPUT && m->mode == STEPPING)) {
            return wrong_access(slave, knowns[k], "as a known of a derivative -- expected a Real input, or a parameter in "
                "initialisation mode -- " NEXT);
        }
        value_put(&change, (int)knowns[k], seed[k]);
    }
    slave->fault.raised = false;
    if (m->last_step > 0.0) {
        model_step_derivative(&m->values.p, &m->before, &m->held, m->last_step, &change.p, &still, &change.u, &moved,
            &change.y, &slave->fault);
    } else {
        model_start_derivative(&m->values.p, &m->held, &change.p, &change.u, &moved, &change.y, &slave->fault);
    }
    for (k = 0; k < n_unknowns; k++) {
        bool unknown = unknowns[k] >= FIRST_OUTPUT && unknowns[k] < VARIABLES;
        if (!unknown || model_variables[unknowns[k]].kind != REAL) {
            return wrong_access(slave, unknowns[k], "as an unknown of a derivative -- expected a Real output -- " NEXT);
        }
        result[k] = value_get(&change, (int)unknowns[k]);
        if (slave->fault.raised || !isfinite(result[k])) {
            return wrong_access(slave, unknowns[k], "has no derivative here -- the equations are not smooth there -- use "
                "a difference quotient");
        }
    }
    return STATUS_OK;
}

/* ---- FMU states */

typedef struct {
    char guid[48];
    size_t size;
} Header;

static Header header(void)
{
    Header made;
    memset(&made, 0, sizeof made);
    memcpy(made.guid, MODEL_GUID, sizeof MODEL_GUID < sizeof made.guid ? sizeof MODEL_GUID : sizeof made.guid - 1);
    made.size = sizeof(Memory);
    return made;
}

Memory *slave_copy(const Slave *slave, Memory *into)
{
    Memory *copy = into == NULL ? malloc(sizeof *copy) : into;
    if (copy != NULL) {
        memcpy(copy, &slave->memory, sizeof *copy);
    }
    return copy;
}

size_t slave_serialized_size(void)
{
    return sizeof(Header) + sizeof(Memory);
}

Status slave_serialize(Slave *slave, const Memory *state, unsigned char *bytes, size_t size)
{
    Header first = header();
    if (size < slave_serialized_size()) {
        return TELL(slave, STATUS_ERROR, "size %.0f of a serialised state -- expected %.0f bytes -- ask for the size first",
            (double)size, (double)slave_serialized_size());
    }
    memcpy(bytes, &first, sizeof first);
    memcpy(bytes + sizeof first, state, sizeof *state);
    return STATUS_OK;
}

Memory *slave_deserialize(Slave *slave, const unsigned char *bytes, size_t size)
{
    Header expected = header();
    Memory *state;
    if (size != slave_serialized_size() || memcmp(bytes, &expected, sizeof expected) != 0) {
        TELL(slave, STATUS_ERROR, "FMU state is foreign or damaged -- expected one saved by this FMU -- reset it");
        return NULL;
    }
    state = malloc(sizeof *state);
    if (state != NULL) {
        memcpy(state, bytes + sizeof expected, sizeof *state);
    }
    return state;
}
