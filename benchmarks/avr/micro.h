/* Begin with the first reading x; a period with the aim a and the reading x, at the time t. */
#include "two_stage_micro.h"
#define START(x) float state = 0.0f; (void)(x)
#define STEP(a, x, t) do { \
    const TwoStageMicroStepOut out = \
        two_stage_micro_step(&two_stage_micro_gains, state, (a) - (x), 0.001f); \
    state = out.integral; effort = out.effort; } while (0)
