/* The model of chain.h as an FMI 3.0 co-simulation FMU. Value references are those of chain3 in native_fmu.py. */
#include <stdbool.h>
#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"
#include "chain.h"

enum { LABEL = 1, FAULT, FAULT_TIME, FAULT_STEP, U, Y, INPUT = 20, OUTPUT = 40 };

/* One input and one output of every numeric type, with the value references INPUT + number and OUTPUT + number. */
#define OTHER_TYPES(each) \
    each(Float32, float32, 0) each(Int8, int8, 1) each(UInt8, uint8, 2) each(Int16, int16, 3) each(UInt16, uint16, 4) \
    each(UInt32, uint32, 5) each(Int64, int64, 6) each(UInt64, uint64, 7) each(Boolean, boolean, 8)

#define FIELD(Name, name, number) fmi3##Name name;
typedef struct {
    Model model;
    fmi3Int32 int32;
    OTHER_TYPES(FIELD)
} State;

typedef struct {
    State state;
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
    bool logging;
} Instance;

#define MODEL (&((Instance *)c)->state.model)
#define STATE (((Instance *)c)->state)
#define STUB(name) fmi3Status name(void) { return fmi3Error; }
#define DONE(name) fmi3Status name(fmi3Instance c) { return c ? fmi3OK : fmi3Error; }

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    if (strcmp(token, GUID)) return NULL;
    Instance *instance = calloc(1, sizeof(Instance));
    instance->log = log;
    instance->environment = environment;
    instance->logging = logging;
    return instance;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    ((Instance *)c)->logging = on;
    return fmi3OK;
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    MODEL->time = MODEL->last_time = start;
    return fmi3OK;
}

DONE(fmi3ExitInitializationMode)
DONE(fmi3Terminate)

fmi3Status fmi3Reset(fmi3Instance c) {
    memset(&STATE, 0, sizeof STATE);
    return fmi3OK;
}

/* Place and number of elements of a variable, or NULL. */
static fmi3Float64 *float64(State *state, unsigned reference, size_t *elements) {
    Model *model = &state->model;
    *elements = reference == U ? INPUTS : reference == Y ? OUTPUTS : 1;
    if (reference == U) return model->u;
    if (reference == Y) return model->y;
    if (reference == FAULT_TIME) return &model->fault_time;
    return reference == FAULT_STEP ? &model->fault_step : NULL;
}

static fmi3Int32 *int32(State *state, unsigned reference, size_t *elements) {
    *elements = 1;
    if (reference == FAULT) return &state->model.fault;
    return reference == INPUT + 9 || reference == OUTPUT + 9 ? &state->int32 : NULL;
}

#define PLACE(Name, name, number) \
    static fmi3##Name *name(State *state, unsigned reference, size_t *elements) { \
        *elements = 1; \
        return reference == INPUT + number || reference == OUTPUT + number ? &state->name : NULL; \
    }
OTHER_TYPES(PLACE)

#define ACCESS(Name, name, number) \
    fmi3Status fmi3Get##Name(fmi3Instance c, const unsigned vr[], size_t n, fmi3##Name value[], size_t values) { \
        size_t k = 0, elements; \
        for (size_t i = 0; i < n; i++, k += elements) { \
            fmi3##Name *at = name(&STATE, vr[i], &elements); \
            if (!at || k + elements > values) return fmi3Error; \
            memcpy(value + k, at, elements * sizeof *at); \
        } \
        return k == values ? fmi3OK : fmi3Error; \
    } \
    fmi3Status fmi3Set##Name(fmi3Instance c, const unsigned vr[], size_t n, const fmi3##Name value[], size_t values) { \
        size_t k = 0, elements; \
        for (size_t i = 0; i < n; i++, k += elements) { \
            fmi3##Name *at = name(&STATE, vr[i], &elements); \
            if (!at || k + elements > values) return fmi3Error; \
            memcpy(at, value + k, elements * sizeof *at); \
        } \
        return k == values ? fmi3OK : fmi3Error; \
    }
ACCESS(Float64, float64, 0)
ACCESS(Int32, int32, 9)
OTHER_TYPES(ACCESS)

fmi3Status fmi3GetString(fmi3Instance c, const unsigned vr[], size_t n, fmi3String value[], size_t values) {
    for (size_t i = 0; i < n; i++) value[i] = MODEL->label;
    return fmi3OK;
}

fmi3Status fmi3SetString(fmi3Instance c, const unsigned vr[], size_t n, const fmi3String value[], size_t values) {
    for (size_t i = 0; i < n; i++) strncpy(MODEL->label, value[i], sizeof MODEL->label - 1);
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const unsigned vr[], size_t n, const fmi3Int32 order[],
                                    fmi3Float64 value[], size_t values) {
    if (values != n * OUTPUTS) return fmi3Error;
    for (size_t i = 0; i < n; i++) {
        if (vr[i] != Y) return fmi3Error;
        for (int k = 0; k < OUTPUTS; k++) *value++ = model_derivative(MODEL, k, order[i]);
    }
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_rollback,
                      fmi3Boolean *events, fmi3Boolean *terminate, fmi3Boolean *early_return, fmi3Float64 *last_time) {
    Instance *instance = c;
    const char *message;
    int status = model_step(MODEL, time, size, &message);
    bool due = MODEL->time >= MODEL->fault_time;
    if (message && instance->logging) instance->log(instance->environment, status, "logStatus", message);
    *events = false;
    *terminate = due && MODEL->fault == TERMINATE;
    *early_return = due && MODEL->fault == EARLY_RETURN;
    *last_time = MODEL->last_time;
    return status;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(State));
    memcpy(*state, &STATE, sizeof(State));
    return fmi3OK;
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    memcpy(&STATE, state, sizeof(State));
    return fmi3OK;
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    free(*state);
    *state = NULL;
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    *size = sizeof(State);
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte data[], size_t size) {
    memcpy(data, state, size);
    return fmi3OK;
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte data[], size_t size, fmi3FMUState *state) {
    if (size != sizeof(State)) return fmi3Error;
    return memcpy(*state = malloc(size), data, size) ? fmi3OK : fmi3Error;
}

/* What a library must export, without being used. */
STUB(fmi3InstantiateModelExchange)
STUB(fmi3InstantiateScheduledExecution)
STUB(fmi3EnterEventMode)
STUB(fmi3GetBinary)
STUB(fmi3SetBinary)
STUB(fmi3GetClock)
STUB(fmi3SetClock)
STUB(fmi3GetNumberOfVariableDependencies)
STUB(fmi3GetVariableDependencies)
STUB(fmi3GetDirectionalDerivative)
STUB(fmi3GetAdjointDerivative)
STUB(fmi3EnterConfigurationMode)
STUB(fmi3ExitConfigurationMode)
STUB(fmi3GetIntervalDecimal)
STUB(fmi3GetIntervalFraction)
STUB(fmi3GetShiftDecimal)
STUB(fmi3GetShiftFraction)
STUB(fmi3SetIntervalDecimal)
STUB(fmi3SetIntervalFraction)
STUB(fmi3SetShiftDecimal)
STUB(fmi3SetShiftFraction)
STUB(fmi3EvaluateDiscreteStates)
STUB(fmi3UpdateDiscreteStates)
STUB(fmi3EnterContinuousTimeMode)
STUB(fmi3CompletedIntegratorStep)
STUB(fmi3SetTime)
STUB(fmi3SetContinuousStates)
STUB(fmi3GetContinuousStateDerivatives)
STUB(fmi3GetEventIndicators)
STUB(fmi3GetContinuousStates)
STUB(fmi3GetNominalsOfContinuousStates)
STUB(fmi3GetNumberOfEventIndicators)
STUB(fmi3GetNumberOfContinuousStates)
STUB(fmi3EnterStepMode)
STUB(fmi3ActivateModelPartition)
