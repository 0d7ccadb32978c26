/* FMI 3.0 for co-simulation, in front of a model. MIT licence. */
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "model.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK, WARNING, DISCARD, ERROR, FATAL };

typedef struct {
    bool started; /* initialisation is over */
    double time; /* of the start, s */
    Model *model;
} Instance;

typedef uint32_t Reference;

EXPORT const char *fmi3GetVersion(void) { return "3.0"; }

EXPORT int fmi3SetDebugLogging(void *c, bool on, size_t n, const char *const names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return OK;
}

EXPORT void *fmi3InstantiateCoSimulation(const char *name, const char *token,
        const char *resources, bool visible, bool logging, bool events, bool early,
        const Reference required[], size_t n, void *environment, void *log, void *update)
{
    (void)name, (void)resources, (void)visible, (void)logging, (void)events, (void)early;
    (void)required, (void)n, (void)environment, (void)log, (void)update;
    if (token == NULL || strcmp(token, MODEL_TOKEN) != 0) {
        return NULL;
    }
    Instance *it = calloc(1, sizeof *it);
    if (it == NULL) {
        return NULL;
    }
    it->model = calloc(1, model_size());
    if (it->model == NULL) {
        free(it);
        return NULL;
    }
    model_reset(it->model);
    return it;
}

EXPORT void fmi3FreeInstance(void *c)
{
    Instance *it = c;
    if (it != NULL) {
        free(it->model);
        free(it);
    }
}

EXPORT int fmi3EnterInitializationMode(void *c, bool given, double tolerance, double start,
        bool ends, double stop)
{
    (void)given, (void)tolerance, (void)ends, (void)stop;
    ((Instance *)c)->time = start;
    return OK;
}

EXPORT int fmi3ExitInitializationMode(void *c)
{
    Instance *it = c;
    model_start(it->model, it->time);
    it->started = true;
    return OK;
}

EXPORT int fmi3Terminate(void *c)
{
    (void)c;
    return OK;
}

EXPORT int fmi3Reset(void *c)
{
    Instance *it = c;
    model_reset(it->model);
    it->started = false;
    return OK;
}

EXPORT int fmi3GetFloat64(void *c, const Reference r[], size_t n, double values[], size_t m)
{
    Instance *it = c;
    if (it->started) {
        model_show(it->model);
    } else {
        model_start(it->model, it->time);
    }
    for (size_t k = 0; k < n && k < m; k++) {
        const double *at = model_at(it->model, r[k]);
        if (at == NULL) {
            return ERROR;
        }
        values[k] = *at;
    }
    return OK;
}

EXPORT int fmi3SetFloat64(void *c, const Reference r[], size_t n, const double values[], size_t m)
{
    for (size_t k = 0; k < n && k < m; k++) {
        double *at = model_at(((Instance *)c)->model, r[k]);
        if (at == NULL) {
            return ERROR;
        }
        *at = values[k];
    }
    return OK;
}

EXPORT int fmi3DoStep(void *c, double time, double length, bool final, bool *event,
        bool *terminate, bool *early, double *last)
{
    (void)final;
    model_step(((Instance *)c)->model, length);
    *event = *terminate = *early = false;
    *last = time + length;
    return OK;
}

EXPORT int fmi3GetFMUState(void *c, void **state)
{
    if (*state == NULL) {
        *state = malloc(model_size());
    }
    if (*state == NULL) {
        return ERROR;
    }
    memcpy(*state, ((Instance *)c)->model, model_size());
    return OK;
}

EXPORT int fmi3SetFMUState(void *c, void *state)
{
    Instance *it = c;
    memcpy(it->model, state, model_size());
    model_moved(it->model);
    return OK;
}

EXPORT int fmi3FreeFMUState(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}

EXPORT void *fmi3InstantiateModelExchange(void) { return NULL; }
EXPORT void *fmi3InstantiateScheduledExecution(void) { return NULL; }

/* What this model has not. */
#define REFUSED(name) \
    EXPORT int name(void) { return ERROR; }
#define NONE(type) \
    EXPORT int fmi3Get##type(void *c, const Reference r[], size_t n) \
    { \
        (void)c, (void)r; \
        return n == 0 ? OK : ERROR; \
    } \
    EXPORT int fmi3Set##type(void *c, const Reference r[], size_t n) \
    { \
        (void)c, (void)r; \
        return n == 0 ? OK : ERROR; \
    }

NONE(Float32)
NONE(Int8)
NONE(UInt8)
NONE(Int16)
NONE(UInt16)
NONE(Int32)
NONE(UInt32)
NONE(Int64)
NONE(UInt64)
NONE(Boolean)
NONE(String)
NONE(Binary)
NONE(Clock)
REFUSED(fmi3EnterEventMode)
REFUSED(fmi3GetNumberOfVariableDependencies)
REFUSED(fmi3GetVariableDependencies)
REFUSED(fmi3SerializedFMUStateSize)
REFUSED(fmi3SerializeFMUState)
REFUSED(fmi3DeserializeFMUState)
REFUSED(fmi3GetDirectionalDerivative)
REFUSED(fmi3GetAdjointDerivative)
REFUSED(fmi3EnterConfigurationMode)
REFUSED(fmi3ExitConfigurationMode)
REFUSED(fmi3GetIntervalDecimal)
REFUSED(fmi3GetIntervalFraction)
REFUSED(fmi3GetShiftDecimal)
REFUSED(fmi3GetShiftFraction)
REFUSED(fmi3SetIntervalDecimal)
REFUSED(fmi3SetIntervalFraction)
REFUSED(fmi3SetShiftDecimal)
REFUSED(fmi3SetShiftFraction)
REFUSED(fmi3EvaluateDiscreteStates)
REFUSED(fmi3UpdateDiscreteStates)
REFUSED(fmi3EnterContinuousTimeMode)
REFUSED(fmi3CompletedIntegratorStep)
REFUSED(fmi3SetTime)
REFUSED(fmi3SetContinuousStates)
REFUSED(fmi3GetContinuousStateDerivatives)
REFUSED(fmi3GetEventIndicators)
REFUSED(fmi3GetContinuousStates)
REFUSED(fmi3GetNominalsOfContinuousStates)
REFUSED(fmi3GetNumberOfEventIndicators)
REFUSED(fmi3GetNumberOfContinuousStates)
REFUSED(fmi3EnterStepMode)
REFUSED(fmi3GetOutputDerivatives)
REFUSED(fmi3ActivateModelPartition)
