/* The functions that FMI 2.0 and 3.0 have alike: a version gives its names and types, then includes this file.
 *
 * FMI(x) is x with the version's prefix; Instance is its type of an instance; the functions of FMU states are spelled
 * differently, so that they are given one by one.
 */
#define TEXT_(x) #x
#define TEXT(x) TEXT_(x)
#define ALLOWED(modes, function) \
    do { if (slave_refuses(c, modes, TEXT(function))) return FMI(Error); } while (0)
#define NOT_NULL(argument, function) \
    do { if ((argument) == NULL) return (FMI(Status))slave_null(c, TEXT(function), #argument); } while (0)

FMI(Status) FMI(SetDebugLogging)(Instance c, FMI(Boolean) loggingOn, size_t nCategories, const FMI(String) categories[])
{
    size_t k;
    ALLOWED(ANY_MODE, FMI(SetDebugLogging));
    for (k = 0; k < nCategories; k++) {
        if (categories == NULL || categories[k] == NULL || strncmp(categories[k], "log", 3) != 0) {
            return (FMI(Status))slave_unsupported(c, TEXT(FMI(SetDebugLogging)), "expected categories of the model description");
        }
    }
    ((Slave *)c)->logging = loggingOn != FMI(False);
    return FMI(OK);
}

/* ---- life cycle */

void FMI(FreeInstance)(Instance c)
{
    slave_free(c);
}

FMI(Status) FMI(ExitInitializationMode)(Instance c)
{
    ALLOWED(INITIALIZATION, FMI(ExitInitializationMode));
    return (FMI(Status))slave_exit_initialization(c);
}

FMI(Status) FMI(Terminate)(Instance c)
{
    ALLOWED(RUNNING, FMI(Terminate));
    ((Slave *)c)->memory.mode = TERMINATED;
    return FMI(OK);
}

FMI(Status) FMI(Reset)(Instance c)
{
    ALLOWED(ANY_MODE, FMI(Reset));
    slave_reset(c);
    return FMI(OK);
}

/* ---- FMU states */

FMI(Status) GET_STATE(Instance c, FmuState *state)
{
    ALLOWED(ANY_MODE, GET_STATE);
    NOT_NULL(state, GET_STATE);
    *state = slave_copy(c, *state);
    return *state == NULL ? FMI(Error) : FMI(OK);
}

FMI(Status) SET_STATE(Instance c, FmuState state)
{
    ALLOWED(ANY_MODE, SET_STATE);
    NOT_NULL(state, SET_STATE);
    ((Slave *)c)->memory = *(const Memory *)state;
    return FMI(OK);
}

FMI(Status) FREE_STATE(Instance c, FmuState *state)
{
    ALLOWED(ANY_MODE, FREE_STATE);
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return FMI(OK);
}

FMI(Status) STATE_SIZE(Instance c, FmuState state, size_t *size)
{
    ALLOWED(ANY_MODE, STATE_SIZE);
    NOT_NULL(state, STATE_SIZE);
    NOT_NULL(size, STATE_SIZE);
    *size = slave_serialized_size();
    return FMI(OK);
}

FMI(Status) SERIALIZE(Instance c, FmuState state, FMI(Byte) bytes[], size_t size)
{
    ALLOWED(ANY_MODE, SERIALIZE);
    NOT_NULL(state, SERIALIZE);
    NOT_NULL(bytes, SERIALIZE);
    return (FMI(Status))slave_serialize(c, state, (unsigned char *)bytes, size);
}

FMI(Status) DESERIALIZE(Instance c, const FMI(Byte) bytes[], size_t size, FmuState *state)
{
    ALLOWED(ANY_MODE, DESERIALIZE);
    NOT_NULL(bytes, DESERIALIZE);
    NOT_NULL(state, DESERIALIZE);
    *state = slave_deserialize(c, (const unsigned char *)bytes, size);
    return *state == NULL ? FMI(Error) : FMI(OK);
}
