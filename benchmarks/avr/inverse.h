/* Begin with the first reading x; a period with the aim a and the reading x, at the time t. */
#include "two_stage_inverse.h"
#define START(x) static LawStateStore store; LawState state; \
    two_stage_inverse_begin(&state, &store); (void)(x)
#define STEP(a, x, t) do { \
    const StageLawTarget target = {(a), 0.0f, 0.0f}; \
    const StageLawSample sample = {(t), (x)}; \
    const TwoStageInverseStepOut out = two_stage_inverse_step( \
        &two_stage_inverse_gains, &state, &target, &sample, 0.001f); \
    state = out.state; effort = out.effort; } while (0)
