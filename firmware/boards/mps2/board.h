/* Figures of the MPS2 that the core needs: those of its pins, which are a second serial line. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_FULL_SCALE 5.0f /* V that a whole duty stands for, and of the converter */
#define BOARD_MOTOR_STEPS 800 /* of a whole duty */
#define BOARD_WIRE_STEPS 250

#endif
