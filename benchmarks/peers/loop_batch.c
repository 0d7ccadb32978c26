/* The common job for many pairs of gains at once: what a batch engine may be measured by.
   The arithmetic of each variant is that of loop.c. A block of variants goes through the
   same time step together, so that the compiler can put neighbours into one register and
   the processor need not wait for one variant's result before it begins the next. */
#include <pthread.h>

#include "job.h"

enum { BLOCK = 32, THREADS = 16 };

typedef struct {
    const job_t *job;
    const double *reference;
    const double *now, *before;
    double *last, *highest, *iae;
    long samples, first, end;
} part_t;

/* Variants first .. first + BLOCK - 1; `live` of them are wanted. */
static void block(const part_t *q, long first, long live)
{
    const job_t p = *q->job;
    double now[BLOCK], before[BLOCK], x[BLOCK], v[BLOCK], old[BLOCK], seen[BLOCK];
    double highest[BLOCK], iae[BLOCK];
    for (int j = 0; j < BLOCK; j++) {
        long from = first + (j < live ? j : live - 1);
        now[j] = q->now[from];
        before[j] = q->before[from];
        x[j] = v[j] = old[j] = seen[j] = highest[j] = iae[j] = 0.0;
    }
    for (long k = 0; k < q->samples; k++) {
        const double aim = q->reference[k];
        for (int j = 0; j < BLOCK; j++) {
            double counts = floor(x[j]);
            double error = aim - counts;
            double u = now[j] * error + before[j] * old[j];
            double lift = u == 0.0 ? 0.0 : copysign(p.width, u);
            u += lift;
            u = u > p.limit ? p.limit : u;
            u = u < -p.limit ? -p.limit : u;
            double w = u > p.rail ? p.rail : u;
            w = w < -p.rail ? -p.rail : w;
            double size = fabs(w) - p.zone;
            double net = copysign(p.a0 + p.delta * size, w);
            net = size > 0.0 ? net : 0.0;
            x[j] = x[j] + p.dt * v[j];
            v[j] = p.b * net - p.a * v[j];
            old[j] = error;
            seen[j] = counts;
            highest[j] = counts > highest[j] ? counts : highest[j];
            iae[j] += fabs(error);
        }
    }
    for (int j = 0; j < live; j++) {
        q->last[first + j] = seen[j];
        q->highest[first + j] = highest[j];
        q->iae[first + j] = iae[j] * p.dt;
    }
}

static void *work(void *given)
{
    const part_t *q = given;
    for (long first = q->first; first < q->end; first += BLOCK)
        block(q, first, q->end - first < BLOCK ? q->end - first : BLOCK);
    return 0;
}

/* Last and highest count and integral of the absolute error [counts s] of each variant. */
void batch(const job_t *job, const double *reference, long samples, const double *now,
           const double *before, long variants, int threads, double *last, double *highest,
           double *iae)
{
    pthread_t thread[THREADS];
    part_t part[THREADS];
    int begun[THREADS];
    threads = threads < 1 ? 1 : (threads > THREADS ? THREADS : threads);
    long blocks = (variants + BLOCK - 1) / BLOCK;
    for (int t = 0; t < threads; t++) {
        long first = blocks * t / threads * BLOCK, end = blocks * (t + 1) / threads * BLOCK;
        part[t] = (part_t){job, reference, now, before, last, highest, iae, samples, first,
                           end < variants ? end : variants};
        begun[t] = t > 0 && pthread_create(&thread[t], 0, work, &part[t]) == 0;
    }
    for (int t = 0; t < threads; t++)
        if (!begun[t])
            work(&part[t]);
    for (int t = 0; t < threads; t++)
        if (begun[t])
            pthread_join(thread[t], 0);
}
