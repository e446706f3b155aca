/* Derivatives and FMU states. */
#include "slave.h"

#include <string.h>

/* ---- derivatives */

/* The seed in the places of parameters and inputs. */
static Status seeded(Slave *slave, const unsigned *knowns, size_t n, const double *seed, Values *change)
{
    size_t k, j, many;
    for (k = 0; k < n; k++) {
        unsigned first = slave_found(REAL, knowns[k], &many);
        if (first >= FIRST_OUTPUT || (first < FIRST_INPUT && (slave->memory.mode & RUNNING))) {
            return slave_wrong(slave, knowns[k], "as a known of a derivative -- expected a Real input, or a parameter in "
                "initialisation mode -- " NEXT);
        }
        for (j = 0; j < many; j++) {
            value_put(change, (int)(first + j), *seed++);
        }
    }
    return STATUS_OK;
}

Status slave_derivative(
    Slave *slave, const char *function, const unsigned *unknowns, size_t n_unknowns, const unsigned *knowns, size_t n_knowns,
    const double *seed, size_t n_seed, double *result, size_t n_result)
{
    Memory *m = &slave->memory;
    Values change;
    State still, moved;
    size_t k, j, many;
    Status status;
    if (SLAVE_REFUSES(slave, INITIALIZATION | RUNNING | TERMINATED, function)) {
        return STATUS_ERROR;
    }
    if ((n_knowns > 0 && (knowns == NULL || seed == NULL)) || (n_unknowns > 0 && (unknowns == NULL || result == NULL))) {
        return slave_null(slave, function, "an argument");
    }
    if (n_seed != slave_count(knowns, n_knowns) || n_result != slave_count(unknowns, n_unknowns)) {
        return slave_unsupported(slave, function, "number of values -- expected one for each element of each variable");
    }
    memset(&change, 0, sizeof change);
    memset(&still, 0, sizeof still);
    status = slave_refresh(slave);
    status = status == STATUS_OK ? seeded(slave, knowns, n_knowns, seed, &change) : status;
    if (status != STATUS_OK) {
        return status;
    }
    slave->fault.raised = false;
    if (m->last_step > 0.0) {
        model_step_derivative(&m->values.p, &m->before, &m->held, m->last_step, &change.p, &still, &change.u, &moved,
            &change.y, &slave->fault);
    } else {
        model_start_derivative(&m->values.p, &m->held, &change.p, &change.u, &moved, &change.y, &slave->fault);
    }
    for (k = 0; k < n_unknowns; k++) {
        unsigned first = slave_found(REAL, unknowns[k], &many);
        if (first < FIRST_OUTPUT || first == VARIABLES) {
            return slave_wrong(slave, unknowns[k], "as an unknown of a derivative -- expected a Real output -- " NEXT);
        }
        for (j = 0; j < many; j++, result++) {
            *result = value_get(&change, (int)(first + j));
            if (slave->fault.raised || !isfinite(*result)) {
                return slave_wrong(slave, unknowns[k], "has no derivative here -- the equations are not smooth there -- "
                    "use a difference quotient");
            }
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
    Memory *copy = into == NULL ? calloc(1, sizeof *copy) : into;
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
        return slave_tell(slave, STATUS_ERROR, "size %.0f of a serialised state -- expected %.0f bytes -- ask for the size first",
            (double)size, (double)slave_serialized_size());
    }
    memcpy(bytes, &first, sizeof first);
    memcpy(bytes + sizeof first, state, sizeof *state);
    return STATUS_OK;
}

/* Whether a state may run: steps take parameters within their bounds for granted. */
static bool sound(const Memory *m)
{
    return !(m->mode & RUNNING) || slave_out_of_bounds(&m->values) < 0;
}

Memory *slave_deserialize(Slave *slave, const unsigned char *bytes, size_t size)
{
    Header expected = header();
    bool ours = size == slave_serialized_size() && memcmp(bytes, &expected, sizeof expected) == 0;
    Memory *state = ours ? calloc(1, sizeof *state) : NULL;
    if (state != NULL) {
        memcpy(state, bytes + sizeof expected, sizeof *state);
        ours = sound(state);
    }
    if (!ours) {
        free(state);
        state = NULL;
        slave_tell(slave, STATUS_ERROR, "FMU state is foreign or damaged -- expected one saved by this FMU -- reset it");
    }
    return state;
}
