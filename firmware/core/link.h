/* Frames between host and board: COBS, a CRC, a sequence number. docs/board.md */
#ifndef LINK_H
#define LINK_H

#include <stdbool.h>
#include <stdint.h>

#define LINK_LONGEST 48 /* bytes of a frame's contents with its CRC */

typedef struct {
    uint8_t id;
    uint8_t sequence;
    uint8_t size; /* of the fields */
    const uint8_t *fields;
} LinkFrame;

typedef struct {
    uint8_t bytes[LINK_LONGEST + 2];
    uint8_t filled;
    bool overrun; /* too long: wait for the next zero */
    uint16_t bad; /* frames that were no good */
} LinkIn;

#ifdef __AVR__
#include <util/crc16.h>
#endif

/* CRC-16/CCITT-FALSE of one byte more: eight steps of the polynomial 0x1021 at once. An AVR shifts
 * by one bit at a time: its library has it without shifts. */
static inline uint16_t link_crc(uint16_t crc, uint8_t byte)
{
#ifdef __AVR__
    return _crc_xmodem_update(crc, byte);
#else
    uint8_t x = (uint8_t)(crc >> 8) ^ byte;
    x ^= x >> 4;
    return (uint16_t)((crc << 8) ^ ((uint16_t)x << 12) ^ ((uint16_t)x << 5) ^ x);
#endif
}

/* A byte that came. True when it ends a good frame, which lasts until the next call. */
bool link_take(LinkIn *in, uint8_t byte, LinkFrame *frame);

/* Contents as they go over the line, zero included; `to` has room for size + 6. Its length. */
uint8_t link_stuffed(uint8_t id, uint8_t sequence, const uint8_t *fields, uint8_t size,
        uint8_t *to);

#endif
