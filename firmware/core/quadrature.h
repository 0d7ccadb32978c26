/* An encoder in quadrature: four counts a period of its strip. */
#ifndef QUADRATURE_H
#define QUADRATURE_H

#include <stdint.h>

typedef struct {
    int32_t count;
    uint16_t skipped; /* both channels changed at once: a count was lost, its sign unknown */
    uint8_t last; /* channels A (bit 0) and B (bit 1) */
} Quadrature;

/* The channels as they are now, after any edge. A before B counts up. */
static inline void quadrature_edge(Quadrature *q, uint8_t now)
{
    const uint8_t changed = q->last ^ now;
    if (changed == 0) {
        return;
    }
    if (changed == 3) {
        q->skipped++;
    } else if (((q->last & 1) ^ (now >> 1)) == 0) {
        q->count++;
    } else {
        q->count--;
    }
    q->last = now;
}

#endif
