/* The correction of a calibrated axis; each exported unit is a translation unit of its own. */
#include <math.h>
#include "axis_correction.h"
static CorrectionFlank flank;
static StageLawTarget wanted, target;
void begin(void) { axis_correction_begin(&flank); }
float reading_at(float place, float t)
{
    wanted = (StageLawTarget){place, 0.0f, 0.0f, INFINITY};
    const float alone[] = {place}, still[] = {0.0f};
    const AxisCorrectionAimedOut out = axis_correction_aimed(
        &axis_correction_tables, &flank, &wanted, alone, still, 20.0f, t);
    flank = out.flank;
    target = out.target;
    return target.position;
}
float push_at(float reading, float t)
{
    return axis_correction_effort(
        &axis_correction_tables, &flank, &wanted, &target, reading, t);
}
