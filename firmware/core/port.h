/* What the core needs of a board. Each board is one file in ../boards. */
#ifndef PORT_H
#define PORT_H

#include <stdbool.h>
#include <stdint.h>

#include "board.h"

/* Constants that a microcontroller with a memory of its own for them keeps there. */
#ifdef __AVR__
#include <avr/pgmspace.h>
#define PORT_CONSTANT PROGMEM
#define port_constant(place) pgm_read_word(&(place))
#else
#define PORT_CONSTANT
#define port_constant(place) (place)
#endif

/* Variables that a reset leaves as they are; any number after the power was off. */
#define PORT_KEPT __attribute__((section(".noinit")))

typedef struct {
    int32_t encoder;
    uint16_t skipped; /* edges that came too fast for it, since the reset */
    uint16_t hall; /* 12 bits; above 4095: no value */
    uint8_t lines; /* LINES_... */
} PortInputs;

/* Inputs at the beginning of a period. */
PortInputs port_inputs(void);

/* Duties from now on, the bridge on: in steps of board.h, of the motor with its sign. */
void port_outputs(int16_t motor, int16_t wire);

/* All outputs off, now; may be called at any time. */
void port_safe(void);

/* Edges that came too fast, now. */
uint16_t port_skipped(void);

/* Count of the encoder from now on. */
void port_place(int32_t count);

/* Bytes for the host: all of them, or, where there is no room, none. */
void port_send(const uint8_t *bytes, uint8_t size);

/* Keep the control interrupt out, and let it in again; a pair may stand in another. */
void port_lock(void);
void port_unlock(void);

/* Bytes of the stack that were never used, and its greatest depth. */
uint16_t port_stack_free(void);
uint16_t port_stack_deepest(void);

/* Why it began: RESETS_... */
uint8_t port_reset(void);

/* Which board: BOARDS_... */
uint8_t port_board(void);

#endif
