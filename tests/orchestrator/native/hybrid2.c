/* The model of hybrid.h as an FMI 2.0 model-exchange FMU. Value references are those of hybrid_fmu.py. */
#include "fmi2FunctionTypes.h"
#include "hybrid.h"

#define MODEL ((Model *)c)

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    if (type != fmi2ModelExchange || strcmp(guid, GUID)) return NULL;
    Model *model = malloc(sizeof(Model));
    model_start(model);
    return model;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean has_stop, fmi2Real stop) {
    MODEL->time = start;
    return fmi2OK;
}

#define DONE(name) fmi2Status name(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
DONE(fmi2EnterInitializationMode)
DONE(fmi2ExitInitializationMode)
DONE(fmi2Terminate)

#define MODE(name, value) fmi2Status name(fmi2Component c) { MODEL->continuous = value; return fmi2OK; }
MODE(fmi2EnterEventMode, 0)
MODE(fmi2EnterContinuousTimeMode, 1)

fmi2Status fmi2SetReal(fmi2Component c, const unsigned vr[], size_t n, const fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) {
        double *place = model_real(MODEL, vr[i]);
        if (!place) return fmi2Error;
        *place = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetReal(fmi2Component c, const unsigned vr[], size_t n, fmi2Real value[]) {
    int status = fmi2OK;
    for (size_t i = 0; i < n && !status; i++) status = model_get_real(MODEL, vr[i], &value[i]);
    return status;
}

fmi2Status fmi2SetInteger(fmi2Component c, const unsigned vr[], size_t n, const fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++) {
        int *place = model_integer(MODEL, vr[i]);
        if (!place || MODEL->continuous) return fmi2Error;
        *place = value[i];
    }
    return fmi2OK;
}

fmi2Status fmi2GetInteger(fmi2Component c, const unsigned vr[], size_t n, fmi2Integer value[]) {
    for (size_t i = 0; i < n; i++) {
        int *place = model_integer(MODEL, vr[i]);
        if (!place) return fmi2Error;
        value[i] = *place;
    }
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    MODEL->time = time;
    return fmi2OK;
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    if (n != STATES) return fmi2Error;
    memcpy(MODEL->x, x, n * sizeof *x);
    return fmi2OK;
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    if (n != STATES) return fmi2Error;
    memcpy(x, MODEL->x, n * sizeof *x);
    return fmi2OK;
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi2OK;
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real dx[], size_t n) {
    return n == STATES ? model_derivatives(MODEL, dx) : fmi2Error;
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) {
    if (n != INDICATORS) return fmi2Error;
    model_indicators(MODEL, z);
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_rollback, fmi2Boolean *enter_event_mode,
                                       fmi2Boolean *terminate) {
    *enter_event_mode = MODEL->time >= MODEL->step_event;
    *terminate = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    info->terminateSimulation = model_event(MODEL);
    info->newDiscreteStatesNeeded = info->nominalsOfContinuousStatesChanged = fmi2False;
    info->valuesOfContinuousStatesChanged = fmi2True;
    info->nextEventTime = model_next_event(MODEL);
    info->nextEventTimeDefined = info->nextEventTime < INFINITY;
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(c, state, sizeof(Model));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    *size = sizeof(Model);
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte data[], size_t size) {
    memcpy(data, state, size);
    return fmi2OK;
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte data[], size_t size, fmi2FMUstate *state) {
    *state = malloc(sizeof(Model));
    memcpy(*state, data, size);
    return fmi2OK;
}

/* What the model does not have, but a loader may look for. */
#define STUB(name) fmi2Status name(void) { return fmi2Error; }
STUB(fmi2SetDebugLogging)
STUB(fmi2Reset)
STUB(fmi2GetBoolean)
STUB(fmi2SetBoolean)
STUB(fmi2GetString)
STUB(fmi2SetString)
STUB(fmi2GetDirectionalDerivative)
