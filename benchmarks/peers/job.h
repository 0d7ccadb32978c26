/* The common job: its numbers, its controller and its friction, as job.py and the package
   have them. */
#include <math.h>

typedef struct {
    double now, before;   /* (4.10) [V/count] */
    double width, limit;  /* dead-zone inverse and saturation [V] */
    double a, b, dt;      /* (4.3) */
    double a0, delta;     /* (4.5) */
    double zone, rail;    /* the model's dead zone and saturation [V] */
} job_t;

static inline double within(double limit, double u)
{
    return u > limit ? limit : (u < -limit ? -limit : u);
}

static inline double controller(const job_t *p, double error, double last)
{
    double u = p->now * error + p->before * last;
    if (u > 0.0)
        u += p->width;
    else if (u < 0.0)
        u -= p->width;
    return within(p->limit, u);
}

static inline double friction(const job_t *p, double volts)
{
    double u = within(p->rail, volts), rest = 0.0;
    if (u > p->zone)
        rest = u - p->zone;
    else if (u < -p->zone)
        rest = u + p->zone;
    return rest == 0.0 ? 0.0 : copysign(p->a0 + p->delta * fabs(rest), rest);
}
