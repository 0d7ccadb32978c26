/* avr-libc has no erff; this is Abramowitz and Stegun's 7.1.26, good to 1.5e-7. */
#include <math.h>
float erff(float x)
{
    const float a = fabsf(x), t = 1.0f / (1.0f + 0.3275911f * a);
    const float s = ((((1.061405429f * t - 1.453152027f) * t + 1.421413741f) * t - 0.284496736f)
                     * t + 0.254829592f) * t;
    return copysignf(1.0f - s * expf(-a * a), x);
}
