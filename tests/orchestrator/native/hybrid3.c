/* The model of hybrid.h as an FMI 3.0 model-exchange FMU. Value references are those of hybrid_fmu.py. */
#include <stdbool.h>
#include "fmi3PlatformTypes.h"
#include "fmi3FunctionTypes.h"
#include "hybrid.h"

#define MODEL ((Model *)c)

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    if (strcmp(token, GUID)) return NULL;
    Model *model = malloc(sizeof(Model));
    model_start(model);
    return model;
}

void fmi3FreeInstance(fmi3Instance c) { free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean has_stop, fmi3Float64 stop) {
    MODEL->time = start;
    return fmi3OK;
}

#define DONE(name) fmi3Status name(fmi3Instance c) { return c ? fmi3OK : fmi3Error; }
DONE(fmi3ExitInitializationMode)
DONE(fmi3Terminate)

#define MODE(name, value) fmi3Status name(fmi3Instance c) { MODEL->continuous = value; return fmi3OK; }
MODE(fmi3EnterEventMode, 0)
MODE(fmi3EnterContinuousTimeMode, 1)

fmi3Status fmi3SetFloat64(fmi3Instance c, const unsigned vr[], size_t n, const fmi3Float64 value[], size_t values) {
    for (size_t i = 0; i < n; i++) {
        double *place = model_real(MODEL, vr[i]);
        if (!place) return fmi3Error;
        *place = value[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const unsigned vr[], size_t n, fmi3Float64 value[], size_t values) {
    int status = fmi3OK;
    for (size_t i = 0; i < n && !status; i++) status = model_get_real(MODEL, vr[i], &value[i]);
    return status;
}

fmi3Status fmi3SetInt32(fmi3Instance c, const unsigned vr[], size_t n, const fmi3Int32 value[], size_t values) {
    for (size_t i = 0; i < n; i++) {
        int *place = model_integer(MODEL, vr[i]);
        if (!place || MODEL->continuous) return fmi3Error;
        *place = value[i];
    }
    return fmi3OK;
}

fmi3Status fmi3GetInt32(fmi3Instance c, const unsigned vr[], size_t n, fmi3Int32 value[], size_t values) {
    for (size_t i = 0; i < n; i++) {
        int *place = model_integer(MODEL, vr[i]);
        if (!place) return fmi3Error;
        value[i] = *place;
    }
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
    MODEL->time = time;
    return fmi3OK;
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    if (n != STATES) return fmi3Error;
    memcpy(MODEL->x, x, n * sizeof *x);
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    if (n != STATES) return fmi3Error;
    memcpy(x, MODEL->x, n * sizeof *x);
    return fmi3OK;
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    for (size_t i = 0; i < n; i++) x[i] = 1.0;
    return fmi3OK;
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 dx[], size_t n) {
    return n == STATES ? model_derivatives(MODEL, dx) : fmi3Error;
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 z[], size_t n) {
    if (n != INDICATORS) return fmi3Error;
    model_indicators(MODEL, z);
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_rollback, fmi3Boolean *enter_event_mode,
                                       fmi3Boolean *terminate) {
    *enter_event_mode = MODEL->time >= MODEL->step_event;
    *terminate = false;
    return fmi3OK;
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *has_next, fmi3Float64 *next) {
    *terminate = model_event(MODEL);
    *again = *nominals = false;
    *values = true;
    *next = model_next_event(MODEL);
    *has_next = *next < INFINITY;
    return fmi3OK;
}
