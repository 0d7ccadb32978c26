/* Begin with the first reading x; a period with the aim a and the reading x, at the time t. */
#include "two_stage_pid_heat.h"
#define START(x) const StageLawSample begun = {0.0f, (x)}; \
    PidHeatMemory state = two_stage_pid_heat_start(&two_stage_pid_heat_gains, &begun)
#define STEP(a, x, t) do { \
    const StageLawTarget target = {(a), 0.0f, 0.0f}; \
    const StageLawSample sample = {(t), (x)}; \
    const TwoStagePidHeatStepOut out = two_stage_pid_heat_step( \
        &two_stage_pid_heat_gains, &state, &target, &sample, 0.001f); \
    state = out.memory; effort = out.effort; } while (0)
