/* The common job in C: the tuned macro-stage controller on the tuned macro model, as
   src/macromicro/models/macro.py computes it, operation by operation. */
#include "job.h"

/* counts, effort: what the controller sees and sends, n samples each. */
void closed_loop(const job_t *p, const double *reference, long n, double *counts, double *effort)
{
    double x = 0.0, v = 0.0, last = 0.0;
    for (long k = 0; k < n; k++) {
        double seen = floor(x);
        double error = reference[k] - seen;
        double u = controller(p, error, last);
        last = error;
        counts[k] = seen;
        effort[k] = u;
        x = x + p->dt * v;
        v = p->b * friction(p, u) - p->a * v;
    }
}
