/* ATmega328P at 16 MHz: Arduino Uno and Nano. Which pin is what: pins.toml.
 *
 * Timer 0 makes the wire's PWM, timer 1 the motor's, timer 2 the control period. The control
 * interrupt lets all others in: an edge of the encoder waits for the longest of those alone.
 */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <util/atomic.h>

#include "core.h"
#include "pins.h"
#include "port.h"
#include "protocol.h"
#include "quadrature.h"

#define PRESCALED 64U /* timer 2: cycles a step */
#define CONVERSIONS 16
#define TO_HOST 128 /* bytes; a power of two, as the next */
#define FROM_HOST 64
#define AT_ONCE 32 /* bytes that a period has time for; an order has 16 to 18 */
#define PAINT 0xA5

#define BIT(name) (1U << name##_BIT)

static Quadrature encoder;

static struct {
    uint16_t sum;
    uint8_t done;
    uint16_t whole; /* sum of the last 16 */
    uint8_t late; /* periods since it came */
} hall;

static struct {
    uint8_t bytes[TO_HOST];
    volatile uint8_t head, tail;
} out;

static struct {
    uint8_t bytes[FROM_HOST];
    volatile uint8_t head, tail;
} in;

static uint8_t why; /* it began */
static volatile bool ticked;
static volatile uint8_t locks; /* above 0: the control interrupt waits */
static volatile bool due; /* and it does */

/* Before main, while the stack is empty: paint what it may use; a watchdog's reset leaves it on. */
__attribute__((naked, used, section(".init3"))) static void first(void)
{
    extern uint8_t _end;
    for (uint8_t *place = &_end; place < (uint8_t *)SP; place++) {
        *place = PAINT;
    }
    wdt_reset();
    MCUSR = 0;
    wdt_disable();
}

/* The reset's cause, before anything else; optiboot has cleared it, and leaves it in r2. */
__attribute__((naked, used, section(".init0"))) static void cause(void)
{
    __asm__ volatile("in r3, %0\n\tand r3, r3\n\tbrne 1f\n\tmov r3, r2\n1:\tout %1, r3" ::"I"(
            _SFR_IO_ADDR(MCUSR)), "I"(_SFR_IO_ADDR(GPIOR0)));
}

/* Encoder: any edge of either channel */
static void edge(void)
{
    quadrature_edge(&encoder, (ENCODER_A_IN >> ENCODER_A_BIT) & 3);
}

ISR(INT0_vect)
{
    edge();
}

ISR(INT1_vect, ISR_ALIASOF(INT0_vect));

/* It converts without a pause: 16 conversions take 832 us, so each period has new ones. */
ISR(ADC_vect)
{
    hall.sum += ADC;
    if (++hall.done == CONVERSIONS) {
        hall.whole = hall.sum;
        hall.late = 0;
        hall.sum = 0;
        hall.done = 0;
    }
}

ISR(USART_RX_vect)
{
    const uint8_t byte = UDR0;
    const uint8_t head = (in.head + 1) & (FROM_HOST - 1);
    if (head != in.tail) { /* else the CRC will say that one is missing */
        in.bytes[in.head] = byte;
        in.head = head;
    }
}

ISR(USART_UDRE_vect)
{
    if (out.tail == out.head) {
        UCSR0B &= ~_BV(UDRIE0);
        return;
    }
    UDR0 = out.bytes[out.tail];
    out.tail = (out.tail + 1) & (TO_HOST - 1);
}

/* A control period; all other interrupts come through. */
static void control(void)
{
    const uint8_t head = in.head; /* what comes meanwhile is for the next period */
    for (uint8_t k = 0; k < AT_ONCE && in.tail != head; k++) {
        const uint8_t byte = in.bytes[in.tail];
        in.tail = (in.tail + 1) & (FROM_HOST - 1);
        core_byte(byte);
    }
    core_tick();
    const bool late = due; /* the counter has begun anew */
    core_ticked((TCNT2 + (late ? OCR2A + 1U : 0U)) * PRESCALED, late);
    ticked = true;
}

ISR(TIMER2_COMPA_vect)
{
    if (locks != 0) { /* `port_unlock` sees to it */
        due = true;
        return;
    }
    locks = 1;
    sei();
    control();
    cli();
    locks = 0;
    due = false;
}

void port_lock(void)
{
    locks++;
}

void port_unlock(void)
{
    for (;;) {
        cli();
        if (locks > 1 || !due) {
            locks--;
            sei();
            return;
        }
        due = false;
        sei();
        control();
    }
}

PortInputs port_inputs(void)
{
    PortInputs seen = {0};
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        seen.encoder = encoder.count;
        seen.skipped = encoder.skipped;
        /* A period that began late makes the next one short. */
        seen.hall = hall.late > 1 ? 0xFFFF : hall.whole / (CONVERSIONS / 4);
        hall.late += hall.late <= 1;
    }
    seen.lines = (LIMIT_LOW_IN & BIT(LIMIT_LOW) ? LINES_LIMIT_LOW : 0)
            | (LIMIT_HIGH_IN & BIT(LIMIT_HIGH) ? LINES_LIMIT_HIGH : 0)
            | (EXTEND_IN & BIT(EXTEND) ? LINES_EXTEND : 0)
            | (CONTRACT_IN & BIT(CONTRACT) ? LINES_CONTRACT : 0)
            | (BRIDGE_FAULT_IN & BIT(BRIDGE_FAULT) ? 0 : LINES_BRIDGE_FAULT);
    return seen;
}

/* A pin that its timer drives, or low: a duty of 0 in fast PWM would leave a spike. */
static uint8_t connected(uint8_t control, uint8_t bit, bool on)
{
    return on ? control | bit : control & ~bit;
}

void port_outputs(int16_t motor, int16_t wire)
{
    const uint16_t forward = motor > 0 ? (uint16_t)motor : 0;
    const uint16_t back = motor < 0 ? (uint16_t)-motor : 0;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        OCR1A = forward > 0 ? forward - 1 : 0;
        OCR1B = back > 0 ? back - 1 : 0;
        const uint8_t control = connected(TCCR1A, _BV(COM1A1), forward > 0);
        TCCR1A = connected(control, _BV(COM1B1), back > 0);
        OCR0B = wire > 0 ? (uint8_t)(wire - 1) : 0;
        TCCR0A = connected(TCCR0A, _BV(COM0B1), wire > 0);
        ENABLE_PORT |= BIT(ENABLE);
    }
}

void port_safe(void)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        ENABLE_PORT &= ~BIT(ENABLE);
        TCCR1A &= ~(_BV(COM1A1) | _BV(COM1B1));
        TCCR0A &= ~_BV(COM0B1);
        OCR1A = OCR1B = 0;
        OCR0B = 0;
    }
}

uint16_t port_skipped(void)
{
    uint16_t found;
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        found = encoder.skipped;
    }
    return found;
}

void port_place(int32_t count)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        encoder.count = count;
    }
}

void port_send(const uint8_t *bytes, uint8_t size)
{
    const uint8_t room = (out.tail - out.head - 1) & (TO_HOST - 1);
    if (size > room) {
        return;
    }
    uint8_t head = out.head;
    for (uint8_t k = 0; k < size; k++) {
        out.bytes[head] = bytes[k];
        head = (head + 1) & (TO_HOST - 1);
    }
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
        out.head = head;
        UCSR0B |= _BV(UDRIE0);
    }
}

uint16_t port_stack_free(void)
{
    extern uint8_t _end;
    const uint8_t *place = &_end;
    while (place < (const uint8_t *)RAMEND && *place == PAINT) {
        place++;
    }
    return (uint16_t)(place - &_end);
}

uint16_t port_stack_deepest(void)
{
    extern uint8_t _end;
    return (uint16_t)((uint8_t *)RAMEND + 1 - &_end) - port_stack_free();
}

uint8_t port_reset(void)
{
    return why & (RESETS_POWER | RESETS_PIN | RESETS_BROWN_OUT | RESETS_WATCHDOG);
}

uint8_t port_board(void)
{
    return BOARDS_ATMEGA328P;
}

static void begin(void)
{
    /* Low before they are outputs. */
    MOTOR_FORWARD_PORT &= ~BIT(MOTOR_FORWARD);
    MOTOR_BACK_PORT &= ~BIT(MOTOR_BACK);
    WIRE_PORT &= ~BIT(WIRE);
    ENABLE_PORT &= ~BIT(ENABLE);
    MOTOR_FORWARD_DDR |= BIT(MOTOR_FORWARD);
    MOTOR_BACK_DDR |= BIT(MOTOR_BACK);
    WIRE_DDR |= BIT(WIRE);
    ENABLE_DDR |= BIT(ENABLE);
    BRIDGE_FAULT_PORT |= BIT(BRIDGE_FAULT);
    LIMIT_LOW_PORT |= BIT(LIMIT_LOW);
    LIMIT_HIGH_PORT |= BIT(LIMIT_HIGH);
    ENCODER_A_PORT |= BIT(ENCODER_A) | BIT(ENCODER_B);
    DIDR0 = BIT(HALL);

    TCCR0A = _BV(WGM01) | _BV(WGM00); /* fast PWM up to OCR0A, 64 kHz */
    OCR0A = BOARD_WIRE_STEPS - 1;
    TCCR0B = _BV(WGM02) | _BV(CS00);
    TCCR1A = _BV(WGM11); /* fast PWM up to ICR1, 20 kHz */
    ICR1 = BOARD_MOTOR_STEPS - 1;
    TCCR1B = _BV(WGM13) | _BV(WGM12) | _BV(CS10);
    TCCR2A = _BV(WGM21); /* back to 0 at OCR2A */
    OCR2A = F_CPU / PRESCALED / (1000000UL / PROTOCOL_PERIOD) - 1;
    TCCR2B = _BV(CS22);

    EICRA = _BV(ISC10) | _BV(ISC00);
    EIMSK = _BV(INT1) | _BV(INT0);
    encoder.last = (ENCODER_A_IN >> ENCODER_A_BIT) & 3;

    ADMUX = _BV(REFS0) | HALL_BIT;
    hall.late = 2;
    ADCSRA = _BV(ADEN) | _BV(ADSC) | _BV(ADATE) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1); /* 250 kHz */

    UCSR0A = _BV(U2X0);
    UBRR0 = F_CPU / 8 / PROTOCOL_BAUD - 1;
    UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);
    UCSR0B = _BV(RXCIE0) | _BV(RXEN0) | _BV(TXEN0);
}

int main(void)
{
    why = GPIOR0;
    begin();
    core_begin();
    wdt_enable(WDTO_30MS);
    TIMSK2 = _BV(OCIE2A);
    set_sleep_mode(SLEEP_MODE_IDLE);
    sei();
    for (;;) {
        core_poll();
        if (ticked) { /* both this loop and the control interrupt must go on */
            ticked = false;
            wdt_reset();
        }
        cli();
        if (!ticked) {
            sleep_enable();
            sei();
            sleep_cpu();
            sleep_disable();
        }
        sei();
    }
}
