#include "link.h"

/* Undo the stuffing in place. The length, or 0 for what cannot be. */
static uint8_t plain(uint8_t *bytes, uint8_t size)
{
    uint8_t out = 0;
    uint8_t place = 0;
    while (place < size) {
        const uint8_t length = bytes[place];
        if (length == 0 || length > size - place) {
            return 0;
        }
        for (uint8_t k = 1; k < length; k++) {
            bytes[out++] = bytes[place + k];
        }
        place += length;
        if (place < size) {
            bytes[out++] = 0;
        }
    }
    return out;
}

bool link_take(LinkIn *in, uint8_t byte, LinkFrame *frame)
{
    if (byte != 0) {
        if (in->filled == sizeof in->bytes) {
            in->overrun = true;
        } else {
            in->bytes[in->filled++] = byte;
        }
        return false;
    }
    const uint8_t size = in->filled;
    const bool overrun = in->overrun;
    in->filled = 0;
    in->overrun = false;
    if (size == 0) {
        return false;
    }
    const uint8_t length = overrun ? 0 : plain(in->bytes, size);
    uint16_t crc = 0xFFFF;
    for (uint8_t k = 0; k + 2 < length; k++) {
        crc = link_crc(crc, in->bytes[k]);
    }
    if (length < 4 || in->bytes[length - 2] != (uint8_t)crc
            || in->bytes[length - 1] != (uint8_t)(crc >> 8)) {
        in->bad++;
        return false;
    }
    *frame = (LinkFrame){in->bytes[0], in->bytes[1], (uint8_t)(length - 4), in->bytes + 2};
    return true;
}

typedef struct {
    uint8_t *to;
    uint8_t filled;
    uint8_t mark; /* where the length of the present block stands */
} Stuffing;

static void put(Stuffing *s, uint8_t byte)
{
    if (byte == 0) {
        s->to[s->mark] = s->filled - s->mark;
        s->mark = s->filled++;
    } else {
        s->to[s->filled++] = byte;
    }
}

uint8_t link_stuffed(uint8_t id, uint8_t sequence, const uint8_t *fields, uint8_t size,
        uint8_t *to)
{
    Stuffing s = {to, 1, 0};
    uint16_t crc = link_crc(link_crc(0xFFFF, id), sequence);
    put(&s, id);
    put(&s, sequence);
    for (uint8_t k = 0; k < size; k++) {
        crc = link_crc(crc, fields[k]);
        put(&s, fields[k]);
    }
    put(&s, (uint8_t)crc);
    put(&s, (uint8_t)(crc >> 8));
    to[s.mark] = s.filled - s.mark;
    to[s.filled++] = 0;
    return s.filled;
}
