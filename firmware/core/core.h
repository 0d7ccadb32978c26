/* The board's behaviour, the same on every microcontroller. */
#ifndef CORE_H
#define CORE_H

#include <stdbool.h>
#include <stdint.h>

/* Once, before interrupts are let in: outputs are safe, nothing is known. */
void core_begin(void);

/* A byte from the host, in the timer's interrupt, before its `core_tick`. */
void core_byte(uint8_t byte);

/* Each period, from the timer's interrupt: outputs, inputs, the sample for the host, the laws. */
void core_tick(void);

/* Behind it: cycles since that interrupt was due, and whether the next one came meanwhile. */
void core_ticked(uint16_t cycles, bool late);

/* Over and over, outside of interrupts: the guard, and what the host asks for without haste. */
void core_poll(void);

#endif
