/* Cycles of each period of an exported law on an AVR, over readings of a run, on the UART.
 * Timer 1 counts every cycle; its overflows are counted by an interrupt, 0.1 % of the time.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/pgmspace.h>
#include <avr/sleep.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include CALLS
#include "replay.h"

static volatile uint16_t over;
ISR(TIMER1_OVF_vect)
{
    over++;
}

static uint32_t now(void)
{
    cli();
    uint16_t low = TCNT1, high = over;
    if ((TIFR1 & _BV(TOV1)) && low < 0x8000) {
        high++;
    }
    sei();
    return (uint32_t)high << 16 | low;
}

static void put(uint32_t value, char end)
{
    char text[12];
    ultoa(value, text, 10);
    for (const char *c = text; *c; c++) {
        loop_until_bit_is_set(UCSR0A, UDRE0);
        UDR0 = *c;
    }
    loop_until_bit_is_set(UCSR0A, UDRE0);
    UDR0 = end;
}

#ifdef EFFORTS
static void show(float effort) /* V, as whole microvolts */
{
    const int32_t whole = lrintf(1e6f * effort);
    if (whole < 0) {
        loop_until_bit_is_set(UCSR0A, UDRE0);
        UDR0 = '-';
    }
    put(labs(whole), '\n');
}
#endif

extern uint8_t _end;

int main(void)
{
    for (uint8_t *p = &_end; p < (uint8_t *)SP - 16; p++) {
        *p = 0xA5; /* the stack leaves its mark */
    }
    UCSR0B = _BV(TXEN0);
    TCCR1B = _BV(CS10);
    TIMSK1 = _BV(TOIE1);
    sei();
    uint32_t most = 0, sum = 0;
    uint16_t lost = 0; /* periods without an effort */
    volatile float effort = 0.0f;
    START(SCALE * (int32_t)pgm_read_dword(&places[0]));
    for (uint16_t k = 0; k < PERIODS; k++) {
        const float aim = SCALE * (int32_t)pgm_read_dword(&aims[k]);
        const float place = SCALE * (int32_t)pgm_read_dword(&places[k]);
        const uint32_t before = now();
        STEP(aim, place, k * 0.001f);
        const uint32_t spent = now() - before;
        lost += !isfinite(effort);
        sum += spent;
        most = spent > most ? spent : most;
#ifdef EFFORTS
        show(effort);
#endif
    }
    (void)effort;
    const uint8_t *p = &_end;
    while (*p == 0xA5) {
        p++;
    }
    put(sum / PERIODS, ' ');
    put(most, ' ');
    put((uint32_t)(RAMEND - (uint16_t)p + 1), ' ');
    put(lost, '\n');
    loop_until_bit_is_set(UCSR0A, UDRE0);
    cli();
    sleep_enable();
    sleep_cpu(); /* simavr ends here */
    return 0;
}
