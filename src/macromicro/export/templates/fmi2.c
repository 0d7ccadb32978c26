/* $name as an FMU: FMI 2.0 for co-simulation. MIT licence. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "$name.h"

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif

#define PERIOD $period /* s */

enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };

typedef struct {
    int started; /* initialisation is over */
    double time, began; /* s */
    double periods; /* since it began */
    double behind; /* remainder of the last step that is no whole period, s */
$fields
} Model;

typedef unsigned int Reference;

/* Parameters, inputs and state as at the start. */
static void reset(Model *m)
{
    memset(m, 0, sizeof *m);
$reset
}

/* The outputs as parameters, inputs and state are now. */
static void show(Model *m)
{
$show
    (void)m;
}

/* The state that follows from parameters and inputs, and the outputs at that time. */
static void start(Model *m)
{
    m->time = m->began;
    m->periods = m->behind = 0.0;
$start
    show(m);
}

/* Control periods for so long; inputs are held. */
static void step(Model *m, double length)
{
    m->behind += length;
    while (m->behind > 0.5 * PERIOD) {
        m->behind -= PERIOD;
$step
        m->periods += 1.0;
        m->time = m->began + m->periods * PERIOD;
    }
    show(m);
}

/* A variable by its value reference; NULL if there is none. */
static double *variable(Model *m, Reference reference)
{
    switch (reference) {
$variables
    default:
        return NULL;
    }
}

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
    if (type != 1 || token == NULL || strcmp(token, "$token") != 0) {
        return NULL;
    }
    Model *m = malloc(sizeof *m);
    if (m != NULL) {
        reset(m);
    }
    return m;
}

EXPORT void fmi2FreeInstance(void *c)
{
    free(c);
}

EXPORT int fmi2SetupExperiment(void *c, int given, double tolerance, double begin, int ends,
        double stop)
{
    (void)given, (void)tolerance, (void)ends, (void)stop;
    ((Model *)c)->began = begin;
    return OK;
}

EXPORT int fmi2EnterInitializationMode(void *c)
{
    (void)c;
    return OK;
}

EXPORT int fmi2ExitInitializationMode(void *c)
{
    Model *m = c;
    start(m);
    m->started = 1;
    return OK;
}

EXPORT int fmi2Terminate(void *c)
{
    (void)c;
    return OK;
}

EXPORT int fmi2Reset(void *c)
{
    reset(c);
    return OK;
}

EXPORT int fmi2GetReal(void *c, const Reference r[], size_t n, double values[])
{
    Model *m = c;
    if (m->started) {
        show(m);
    } else {
        start(m);
    }
    for (size_t k = 0; k < n; k++) {
        const double *at = variable(m, r[k]);
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
        double *at = variable(c, r[k]);
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
    step(c, length);
    return OK;
}

EXPORT int fmi2GetFMUstate(void *c, void **state)
{
    if (*state == NULL) {
        *state = malloc(sizeof(Model));
    }
    if (*state == NULL) {
        return ERROR;
    }
    memcpy(*state, c, sizeof(Model));
    return OK;
}

EXPORT int fmi2SetFMUstate(void *c, void *state)
{
    Model *m = c;
    memcpy(m, state, sizeof *m);
$pointers
    return OK;
}

EXPORT int fmi2FreeFMUstate(void *c, void **state)
{
    (void)c;
    free(*state);
    *state = NULL;
    return OK;
}

/* Functions of the standard without a meaning here. */
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
