/* The law of a calibrated axis, which goes on in readings, with its correction. */
#include "axis_law.h"
#define EFFORTS
void begin(void);
float reading_at(float place, float t), push_at(float reading, float t);
#define START(x) begin(); const StageLawSample begun = {0.0f, (x)}; \
    CascadeMemory state = axis_law_start(&axis_law_gains, &begun)
#define STEP(a, x, t) do { \
    const StageLawTarget wanted = {reading_at((a), (t)), 0.0f, 0.0f, INFINITY}; \
    const StageLawSample sample = {(t), (x)}; \
    const AxisLawStepOut out = axis_law_step(&axis_law_gains, &state, &wanted, &sample, 0.001f); \
    state = out.memory; effort = out.effort + push_at((x), (t)); } while (0)
