/* The Preisach model (2.11) in C: a table of first-order curves and a stack of the reversals
   that still matter, as src/macromicro/hysteresis computes it, operation by operation. */
#include <math.h>

typedef struct {
    double up, down;       /* a maximum and the minimum after it */
    double at_up, at_down; /* the output at either */
} corner_t;

typedef struct {
    double lo, step;
    long n;
    const double *values; /* n x n; E(lo + i step, lo + j step), 0 where i <= j */
} table_t;

static double smaller(double a, double b) { return b < a ? b : a; }
static double larger(double a, double b) { return b > a ? b : a; }

/* The weight of the relays up at or below alpha and down at or above beta; alpha > beta. */
static double weight(const table_t *t, double alpha, double beta)
{
    const double scale = 1.0 / t->step, top = (double)t->n - 1.0;
    double x = smaller(larger((alpha - t->lo) * scale, 0.0), top);
    double y = smaller(larger((beta - t->lo) * scale, 0.0), top);
    long i = (long)x, j = (long)y;
    i = i < t->n - 2 ? i : t->n - 2;
    j = j < t->n - 2 ? j : t->n - 2;
    const double *row = t->values + i * t->n, *after = row + t->n;
    if (i == j)
        return after[i] * (x - y);
    x -= (double)i;
    y -= (double)j;
    double near = row[j] * (1.0 - x) + after[j] * x;
    double far = row[j + 1] * (1.0 - x) + after[j + 1] * x;
    return near * (1.0 - y) + far * y;
}

/* Outputs [0..1] along n inputs without NaN, from negative saturation at the lowest input.
   `stack`: `rows` corners of room. Returns the samples done: fewer than n if it is full. */
long preisach(double lo, double step, long nodes, const double *values, const double *input, long n,
              corner_t *stack, long rows, double *output)
{
    const table_t t = {lo, step, nodes, values};
    const double hi = lo + (double)(nodes - 1) * step;
    stack[0] = (corner_t){INFINITY, -INFINITY, 0.0, 0.0};
    stack[1] = (corner_t){lo, lo, 0.0, 0.0};
    long k = 1;
    double now = lo;
    for (long s = 0; s < n; s++) {
        double u = smaller(larger(input[s], lo), hi), f;
        if (k >= rows - 1)
            return s;
        if (u > now) {
            while (stack[k].up <= u)
                k--;
            f = smaller(stack[k].at_down + weight(&t, u, stack[k].down), 1.0);
            k++;
            stack[k].up = u;
            stack[k].at_up = f;
        } else if (u < now) {
            while (stack[k - 1].down >= u)
                k--;
            f = larger(stack[k].at_up - weight(&t, stack[k].up, u), 0.0);
        } else {
            f = stack[k].at_down;
        }
        stack[k].down = u;
        stack[k].at_down = f;
        now = u;
        output[s] = f;
    }
    return n;
}
