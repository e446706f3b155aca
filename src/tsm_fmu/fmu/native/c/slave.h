/* One instance of a model, whatever the version of FMI: values, state machine, checks, messages.
 *
 * Nothing here is global and nothing is allocated after instantiation, but for FMU states that the host asks for.
 * Numbers of a status are those of FMI 2.0 and 3.0, which agree.
 */
#ifndef TSM_FMU_SLAVE_H
#define TSM_FMU_SLAVE_H

#include <stddef.h>

#include "interface.h"

typedef enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL } Status;

typedef enum {
    INSTANTIATED = 1,
    INITIALIZATION = 2,
    STEPPING = 4,
    TERMINATED = 8,
    FAILED = 16, /* after an error in a step: only reading, an earlier state, reset and free are left */
    STALLED = 32 /* as STEPPING, but an input has been set to what is no number: a step looks at them all first */
} Mode;

enum { RUNNING = STEPPING | STALLED };
enum { ANY_MODE = 63, READABLE = INITIALIZATION | RUNNING | TERMINATED | FAILED };
enum { WRITABLE = INSTANTIATED | INITIALIZATION | RUNNING };

/* All that a later call depends on: an FMU state is a copy of it. */
typedef struct {
    Values values;
    State state;
    State before;    /* state, inputs and size of the last step, for derivatives */
    Inputs held;
    double last_step;
    double time;
    Mode mode;
    bool stale;      /* outputs are older than parameters or inputs; before the first step only */
    bool slack_told;
} Memory;

typedef struct Slave Slave;
typedef void (*Log)(const Slave *slave, Status status, const char *category, const char *text);

struct Slave {
    Memory memory;
    Fault fault;
    char text[2048];  /* of the last message */
    char *name;
    bool logging;     /* warnings too; errors are always told */
    Log log;
    void *environment;
    void *callback;   /* of the host, as its version of FMI has it */
};

Slave *slave_new(const char *name, const char *guid, bool logging, Log log, void *environment, void *callback);
void slave_free(Slave *slave);
void slave_reset(Slave *slave);

#define NEXT "see modelDescription.xml"
#define MEND "check what drives it"

/* Write a message into the instance, see fault_raise; give it to the host; both. */
void slave_note(Slave *slave, const char *format, ...);
Status slave_pass_on(Slave *slave, Status status);
COLD Status slave_tell(Slave *slave, Status status, const char *format, ...);
const char *slave_inputs_text(const Slave *slave, char *text, size_t size);

/* Whether the state machine does not allow a call; told then. */
#define SLAVE_REFUSES(slave, modes, function) \
    (((slave) == NULL || !((int)((const Slave *)(slave))->memory.mode & (modes))) && slave_disallowed(slave, function))
COLD bool slave_disallowed(Slave *slave, const char *function);
bool slave_refuses(Slave *slave, int modes, const char *function);

/* An error, with a message: the function is not there, an argument is NULL, a variable is a wrong one. */
COLD Status slave_unsupported(Slave *slave, const char *function, const char *why);
COLD Status slave_null(Slave *slave, const char *function, const char *argument);
COLD Status slave_wrong(Slave *slave, unsigned reference, const char *what);

/* Position of the first parameter out of its bounds; -1 if there is none. */
int slave_out_of_bounds(const Values *values);

Status slave_setup(Slave *slave, double start);
Status slave_enter_initialization(Slave *slave);
Status slave_exit_initialization(Slave *slave);
Status slave_step(Slave *slave, const char *function, double time, double step);

/* Numbers in the type in which the host asks: double, int or int64_t by `kind`. A value reference is a position in
 * model_variables; it may stand for an array, whose numbers follow each other. */
COLD Status slave_read(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, void *numbers, size_t count);
COLD Status slave_write(
    Slave *slave, const char *function, Kind kind, const unsigned *references, size_t n, const void *numbers, size_t count);

/* The same for REAL: what a running simulation does. */
Status slave_read_real(
    Slave *slave, const char *function, const unsigned *references, size_t n, double *numbers, size_t count);
Status slave_write_real(
    Slave *slave, const char *function, const unsigned *references, size_t n, const double *numbers, size_t count);
size_t slave_count(const unsigned *references, size_t n);

/* Position of a variable of that type, whose `count` numbers follow each other; VARIABLES for none. */
static inline unsigned slave_found(Kind kind, unsigned reference, size_t *count)
{
    if (reference < VARIABLES && model_variables[reference].kind == kind && model_variables[reference].count > 0) {
        *count = model_variables[reference].count;
        return reference;
    }
    *count = 1;
    return VARIABLES;
}
Status slave_refresh(Slave *slave);

/* Change of the unknowns, with the last step, along the seed of the knowns. */
Status slave_derivative(
    Slave *slave, const char *function, const unsigned *unknowns, size_t n_unknowns, const unsigned *knowns, size_t n_knowns,
    const double *seed, size_t n_seed, double *result, size_t n_result);

Memory *slave_copy(const Slave *slave, Memory *into);
size_t slave_serialized_size(void);
Status slave_serialize(Slave *slave, const Memory *state, unsigned char *bytes, size_t size);
Memory *slave_deserialize(Slave *slave, const unsigned char *bytes, size_t size);

#endif
