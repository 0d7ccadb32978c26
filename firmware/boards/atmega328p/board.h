/* Figures of an Arduino Uno or Nano that the core needs. */
#ifndef BOARD_H
#define BOARD_H

#define BOARD_FULL_SCALE 5.0f /* V that a whole duty stands for, and of the converter */
#define BOARD_MOTOR_STEPS 800 /* of a whole duty; timer 1: 16 MHz / 20 kHz */
#define BOARD_WIRE_STEPS 250 /* timer 0: 16 MHz / 64 kHz */

#endif
