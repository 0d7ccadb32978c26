/* A control period of the macro-stage, as src/macromicro/plant computes it: the same
   arithmetic in C, to see what the compiled Python costs beside it. */
#include <math.h>

enum {
    MASS, RESISTANCE, INDUCTANCE, CONSTANT, PULLEY, COULOMB, STRIBECK, STRIBECK_SPEED,
    RIPPLE, RIPPLE_LONG, RIPPLE_SHORT, BRISTLE, BRISTLE_DAMPING, VISCOUS,
    FREQUENCY, DECAY, PARTICIPATION
};

static double smaller(double a, double b) { return a < b ? a : b; }
static double larger(double a, double b) { return a > b ? a : b; }

/* s: x, v, z, i, q, qv. `volts` changes sign every `half` periods. */
void macro(const double *p, double *s, double volts, long half, long periods, int steps, double dt)
{
    const double pi = 3.14159265358979323846;
    double x = s[0], v = s[1], z = s[2], i = s[3], q = s[4], qv = s[5];
    for (long k = 0; k < periods; k++) {
        double drive = (k / half) % 2 == 0 ? volts : -volts;
        double offset = p[RIPPLE] * 0.5
            * (sin(2.0 * pi * x / p[RIPPLE_LONG]) + sin(2.0 * pi * x / p[RIPPLE_SHORT] + 1.0));
        double h = dt / steps;
        for (int n = 0; n < steps; n++) {
            double denominator = 1.0 + h * p[RESISTANCE] / p[INDUCTANCE];
            double i0 = (i + h * drive / p[INDUCTANCE]) / denominator;
            double i1 = h * p[CONSTANT] / (p[PULLEY] * p[INDUCTANCE]) / denominator;
            double ratio = v / p[STRIBECK_SPEED];
            double level = larger(p[COULOMB] + offset + p[STRIBECK] * exp(-ratio * ratio), 1e-3);
            double hold = 1.0 / (1.0 + h * p[BRISTLE] * fabs(v) / level);
            double z0 = hold * z, z1 = hold * h;
            double stiff = p[BRISTLE] + p[BRISTLE_DAMPING] / h;
            double f0 = stiff * z0 - p[BRISTLE_DAMPING] * z / h, f1 = stiff * z1;
            double w = 2.0 * pi * p[FREQUENCY];
            double pull = p[PARTICIPATION] * p[MASS] * (w * w * q + 2.0 * p[DECAY] * qv);
            double push = p[CONSTANT] * i0 / p[PULLEY] - f0 + pull;
            double drag = p[CONSTANT] * i1 / p[PULLEY] + f1 + p[VISCOUS];
            double next = (p[MASS] * v + h * push) / (p[MASS] + h * drag);
            double quarter = 0.25 * h * h * w * w, damp = h * p[DECAY];
            double s0 = qv - (next - v);
            double s1 = (s0 * (1.0 - damp - quarter) - h * w * w * q) / (1.0 + damp + quarter);
            q += 0.5 * h * (s0 + s1);
            qv = s1;
            x += h * next;
            z = z0 + z1 * next;
            i = i0 - i1 * next;
            v = next;
        }
        x = smaller(larger(x, 0.0), 0.2); /* the end stops are not part of the comparison */
    }
    s[0] = x; s[1] = v; s[2] = z; s[3] = i; s[4] = q; s[5] = qv;
}
