/* The model of chain.h as an FMI 2.0 co-simulation FMU. Value references are those of chain2 in native_fmu.py. */
#include "fmi2FunctionTypes.h"
#include "chain.h"

enum { LABEL = 1, FAULT, FAULT_TIME, FAULT_STEP, COUNT_IN, COUNT, FLAG_IN, FLAG, U = 100, Y = 100000 };

typedef struct {
    Model model;
    int count, flag;
} State;

typedef struct {
    State state;
    const fmi2CallbackFunctions *callbacks;
    char name[128];
    int logging, terminated;
} Instance;

#define MODEL (&((Instance *)c)->state.model)
#define STATE (((Instance *)c)->state)
#define STUB(name) fmi2Status name(void) { return fmi2Error; }
#define DONE(name) fmi2Status name(fmi2Component c) { return c ? fmi2OK : fmi2Error; }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2CoSimulation || strcmp(guid, GUID)) return NULL;
    Instance *instance = calloc(1, sizeof(Instance));
    instance->callbacks = callbacks;
    instance->logging = logging;
    strncpy(instance->name, name, sizeof instance->name - 1);
    return instance;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    ((Instance *)c)->logging = on;
    return fmi2OK;
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
    MODEL->time = MODEL->last_time = start;
    return fmi2OK;
}

DONE(fmi2EnterInitializationMode)
DONE(fmi2ExitInitializationMode)
DONE(fmi2Terminate)

fmi2Status fmi2Reset(fmi2Component c) {
    memset(&STATE, 0, sizeof STATE);
    return fmi2OK;
}

static double *real(Model *model, unsigned reference) {
    if (reference >= U && reference < U + INPUTS) return &model->u[reference - U];
    if (reference >= Y && reference < Y + OUTPUTS) return &model->y[reference - Y];
    if (reference == FAULT_TIME) return &model->fault_time;
    return reference == FAULT_STEP ? &model->fault_step : NULL;
}

static int *integer(State *state, unsigned reference) {
    if (reference == FAULT) return &state->model.fault;
    return reference == COUNT_IN || reference == COUNT ? &state->count : NULL;
}

static int *boolean(State *state, unsigned reference) {
    return reference == FLAG_IN || reference == FLAG ? &state->flag : NULL;
}

#define ACCESS(Name, Type, place, from) \
    fmi2Status fmi2Get##Name(fmi2Component c, const unsigned vr[], size_t n, Type value[]) { \
        for (size_t i = 0; i < n; i++) { \
            Type *at = place(from, vr[i]); \
            if (!at) return fmi2Error; \
            value[i] = *at; \
        } \
        return fmi2OK; \
    } \
    fmi2Status fmi2Set##Name(fmi2Component c, const unsigned vr[], size_t n, const Type value[]) { \
        for (size_t i = 0; i < n; i++) { \
            Type *at = place(from, vr[i]); \
            if (!at) return fmi2Error; \
            *at = value[i]; \
        } \
        return fmi2OK; \
    }

ACCESS(Real, fmi2Real, real, MODEL)
ACCESS(Integer, fmi2Integer, integer, &STATE)
ACCESS(Boolean, fmi2Boolean, boolean, &STATE)

fmi2Status fmi2GetString(fmi2Component c, const unsigned vr[], size_t n, fmi2String value[]) {
    for (size_t i = 0; i < n; i++) value[i] = MODEL->label;
    return fmi2OK;
}

fmi2Status fmi2SetString(fmi2Component c, const unsigned vr[], size_t n, const fmi2String value[]) {
    for (size_t i = 0; i < n; i++) strncpy(MODEL->label, value[i], sizeof MODEL->label - 1);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_rollback) {
    Instance *instance = c;
    const char *message;
    int status = model_step(MODEL, time, size, &message);
    int due = MODEL->fault == TERMINATE && MODEL->time >= MODEL->fault_time;
    if (message && instance->logging)
        instance->callbacks->logger(instance->callbacks->componentEnvironment, instance->name, status, "logStatus",
                                    "%s", message);
    instance->terminated = due;
    return due ? fmi2Discard : status;
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const unsigned vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) value[i] = model_derivative(MODEL, vr[i] - Y, order[i]);
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
    *value = MODEL->last_time;
    return kind == fmi2LastSuccessfulTime ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) {
    *value = ((Instance *)c)->terminated;
    return kind == fmi2Terminated ? fmi2OK : fmi2Discard;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, &STATE, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(&STATE, state, sizeof(State));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    *size = sizeof(State);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte data[], size_t size) {
    memcpy(data, state, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte data[], size_t size, fmi2FMUstate *state) {
    if (size != sizeof(State)) return fmi2Error;
    return memcpy(*state = malloc(size), data, size) ? fmi2OK : fmi2Error;
}

/* What a library must export, without being used. */
STUB(fmi2GetDirectionalDerivative)
STUB(fmi2SetRealInputDerivatives)
STUB(fmi2CancelStep)
STUB(fmi2GetStatus)
STUB(fmi2GetIntegerStatus)
STUB(fmi2GetStringStatus)
