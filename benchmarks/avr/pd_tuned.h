/* Begin with the first reading x; a period with the aim a and the reading x, at the time t. */
#include "two_stage_pd_tuned.h"
#define START(x) PdMemory state = two_stage_pd_tuned_start(0.0f); (void)(x)
#define STEP(a, x, t) do { \
    const TwoStagePdTunedStepOut out = \
        two_stage_pd_tuned_step(&two_stage_pd_tuned_gains, &state, (a) - (x), 0.001f); \
    state = out.memory; effort = out.effort; } while (0)
