/* The common job as an FMI 2.0 co-simulation unit: real variables 0 to 10 are job_t, 11 the
   target, 12 and 13 the outputs counts and volts. Only what a master of fixed steps calls
   does anything. */
#include <stdlib.h>

#include "job.h"

typedef struct {
    union { job_t job; double value[11]; } parameter;
    double target, counts, volts;
    double x, v, last;
} unit_t;

enum { OK = 0, ERROR = 3, PARAMETERS = 11 };

static double *variable(unit_t *u, unsigned n)
{
    if (n < PARAMETERS)
        return &u->parameter.value[n];
    return n == 11 ? &u->target : n == 12 ? &u->counts : n == 13 ? &u->volts : 0;
}

static void control(unit_t *u)
{
    u->counts = floor(u->x);
    double error = u->target - u->counts;
    u->volts = controller(&u->parameter.job, error, u->last);
    u->last = error;
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const names[])
{
    (void)c, (void)on, (void)n, (void)names;
    return OK;
}

void *fmi2Instantiate(const char *name, int type, const char *guid, const char *place,
                      const void *functions, int visible, int logging)
{
    (void)name, (void)type, (void)guid, (void)place, (void)functions, (void)visible, (void)logging;
    return calloc(1, sizeof(unit_t));
}
void fmi2FreeInstance(void *c) { free(c); }

int fmi2SetupExperiment(void *c, int defined, double tolerance, double start, int ends, double stop)
{
    (void)c, (void)defined, (void)tolerance, (void)start, (void)ends, (void)stop;
    return OK;
}
int fmi2EnterInitializationMode(void *c) { (void)c; return OK; }
int fmi2ExitInitializationMode(void *c)
{
    unit_t *u = c;
    u->x = u->v = u->last = 0.0;
    control(u);
    return OK;
}
/* The standard asks for these too; this unit has no such variable and cannot do it. */
#define ABSENT(name) int name(void *c) { (void)c; return ERROR; }
ABSENT(fmi2GetInteger) ABSENT(fmi2GetBoolean) ABSENT(fmi2GetString)
ABSENT(fmi2SetInteger) ABSENT(fmi2SetBoolean) ABSENT(fmi2SetString)
ABSENT(fmi2GetFMUstate) ABSENT(fmi2SetFMUstate) ABSENT(fmi2FreeFMUstate)
ABSENT(fmi2SerializedFMUstateSize) ABSENT(fmi2SerializeFMUstate) ABSENT(fmi2DeSerializeFMUstate)
ABSENT(fmi2GetDirectionalDerivative) ABSENT(fmi2SetRealInputDerivatives)
ABSENT(fmi2GetRealOutputDerivatives) ABSENT(fmi2CancelStep) ABSENT(fmi2GetStatus)
ABSENT(fmi2GetRealStatus) ABSENT(fmi2GetIntegerStatus) ABSENT(fmi2GetBooleanStatus)
ABSENT(fmi2GetStringStatus)

int fmi2Terminate(void *c) { (void)c; return OK; }
int fmi2Reset(void *c) { *(unit_t *)c = (unit_t){0}; return OK; }

int fmi2GetReal(void *c, const unsigned *which, size_t n, double *value)
{
    for (size_t i = 0; i < n; i++) {
        const double *from = variable(c, which[i]);
        if (!from)
            return ERROR;
        value[i] = *from;
    }
    return OK;
}
int fmi2SetReal(void *c, const unsigned *which, size_t n, const double *value)
{
    for (size_t i = 0; i < n; i++) {
        double *to = variable(c, which[i]);
        if (!to)
            return ERROR;
        *to = value[i];
    }
    return OK;
}

/* One control period a step. */
int fmi2DoStep(void *c, double now, double step, int keep)
{
    unit_t *u = c;
    const job_t *p = &u->parameter.job;
    (void)now, (void)keep;
    if (fabs(step - p->dt) > 1e-9 * p->dt)
        return ERROR;
    u->x = u->x + p->dt * u->v;
    u->v = p->b * friction(p, u->volts) - p->a * u->v;
    control(u);
    return OK;
}
