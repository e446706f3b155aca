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
    FAILED = 16  /* after an error in a step: only reading, an earlier state, reset and free are left */
} Mode;

enum { ANY_MODE = 31, READABLE = INITIALIZATION | STEPPING | TERMINATED | FAILED };
enum { WRITABLE = INSTANTIATED | INITIALIZATION | STEPPING };

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

/* False, with a message, where the state machine does not allow a call. */
bool slave_allowed(Slave *slave, int modes, const char *function);
Status slave_unsupported(Slave *slave, const char *function, const char *why);
Status slave_null(Slave *slave, const char *function, const char *argument);

Status slave_setup(Slave *slave, double start);
Status slave_enter_initialization(Slave *slave);
Status slave_exit_initialization(Slave *slave);
Status slave_step(Slave *slave, double time, double step);

/* `reference` is a position in model_variables; `kind` is the type in which the host asks. */
Status slave_get(Slave *slave, Kind kind, unsigned reference, double *value);
Status slave_set(Slave *slave, Kind kind, unsigned reference, double value);
Status slave_refresh(Slave *slave);

Status slave_derivative(
    Slave *slave, const unsigned *unknowns, size_t n_unknowns, const unsigned *knowns, size_t n_knowns,
    const double *seed, double *result);

Memory *slave_copy(const Slave *slave, Memory *into);
size_t slave_serialized_size(void);
Status slave_serialize(Slave *slave, const Memory *state, unsigned char *bytes, size_t size);
Memory *slave_deserialize(Slave *slave, const unsigned char *bytes, size_t size);

#endif
