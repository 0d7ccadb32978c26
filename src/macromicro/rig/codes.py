"""Fault numbers of the guard; 0: none."""

(
    OK,
    ILLEGAL,
    MACRO_LOST,
    MICRO_LOST,
    ENCODER_SILENT,
    HALL_SILENT,
    HALL_FROZEN,
    HALL_RANGE,
    STUCK,
    TOO_HOT,
    NO_MOTION,
    ENCODER_JUMP,
    ENCODER_AGAINST,
    HALL_NOISY,
    CLOCK,
    CLOCK_STANDS,
) = range(16)
