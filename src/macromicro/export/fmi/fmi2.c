/* FMI 2.0 for co-simulation, in front of a model. MIT licence. */
#include <stdlib.h>
#include <string.h>

#include "model.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };

typedef struct {
    int started; /* initialisation is over */
    double time; /* of the start, s */
    Model *model;
} Instance;

typedef unsigned int Reference;

EXPORT const char *fmi2GetTypesPlatform(void) { return "default"; }
EXPORT const char *fmi2GetVersion(void) { return "2.0"; }

EXPORT int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return OK;
}

EXPORT void *fmi2Instantiate(const char *name, int type, const char *token, const char *resources,
        const void *callbacks, int visible, int logging)
{
    (void)name, (void)resources, (void)callbacks, (void)visible, (void)logging;
    if (type != 1 || token == NULL || strcmp(token, MODEL_TOKEN) != 0) {
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

EXPORT void fmi2FreeInstance(void *c)
{
    Instance *it = c;
    if (it != NULL) {
        free(it->model);
        free(it);
    }
}

EXPORT int fmi2SetupExperiment(void *c, int given, double tolerance, double start, int ends,
        double stop)
{
    (void)given, (void)tolerance, (void)ends, (void)stop;
    ((Instance *)c)->time = start;
    return OK;
}

EXPORT int fmi2EnterInitializationMode(void *c)
{
    (void)c;
    return OK;
}

EXPORT int fmi2ExitInitializationMode(void *c)
{
    Instance *it = c;
    model_start(it->model, it->time);
    it->started = 1;
    return OK;
}

EXPORT int fmi2Terminate(void *c)
{
    (void)c;
    return OK;
}

EXPORT int fmi2Reset(void *c)
{
    Instance *it = c;
    model_reset(it->model);
    it->started = 0;
    return OK;
}

EXPORT int fmi2GetReal(void *c, const Reference r[], size_t n, double values[])
{
    Instance *it = c;
    if (it->started) {
        model_show(it->model);
    } else {
        model_start(it->model, it->time);
    }
    for (size_t k = 0; k < n; k++) {
        const double *at = model_at(it->model, r[k]);
        if (at == NULL) {
            return ERROR;
        }
        values[k] = *at;
    }
    return OK;
}

EXPORT int fmi2SetReal(void *c, const Reference r[], size_t n, const double values[])
{
    for (size_t k = 0; k < n; k++) {
        double *at = model_at(((Instance *)c)->model, r[k]);
        if (at == NULL) {
            return ERROR;
        }
        *at = values[k];
    }
    return OK;
}

EXPORT int fmi2DoStep(void *c, double time, double length, int final)
{
    (void)time, (void)final;
    model_step(((Instance *)c)->model, length);
    return OK;
}

EXPORT int fmi2GetFMUstate(void *c, void **state)
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

EXPORT int fmi2SetFMUstate(void *c, void *state)
{
    Instance *it = c;
    memcpy(it->model, state, model_size());
    model_moved(it->model);
    return OK;
}

EXPORT int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}

/* What this model has not. */
#define REFUSED(name, ...) \
    EXPORT int name(__VA_ARGS__) { return ERROR; }
#define NONE(name, type) \
    EXPORT int name(void *c, const Reference r[], size_t n, type values[]) \
    { \
        (void)c, (void)r, (void)values; \
        return n == 0 ? OK : ERROR; \
    }

NONE(fmi2GetInteger, int)
NONE(fmi2GetBoolean, int)
NONE(fmi2GetString, const char *)
NONE(fmi2SetInteger, const int)
NONE(fmi2SetBoolean, const int)
NONE(fmi2SetString, const char *const)
REFUSED(fmi2SerializedFMUstateSize, void)
REFUSED(fmi2SerializeFMUstate, void)
REFUSED(fmi2DeSerializeFMUstate, void)
REFUSED(fmi2GetDirectionalDerivative, void)
REFUSED(fmi2SetRealInputDerivatives, void)
REFUSED(fmi2GetRealOutputDerivatives, void)
REFUSED(fmi2CancelStep, void)
REFUSED(fmi2GetStatus, void)
REFUSED(fmi2GetRealStatus, void)
REFUSED(fmi2GetIntegerStatus, void)
REFUSED(fmi2GetBooleanStatus, void)
REFUSED(fmi2GetStringStatus, void)
