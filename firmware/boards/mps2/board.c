/* Arm's MPS2 (image AN386, a Cortex-M4F), as QEMU has it: the proof that nothing in the core clings
 * to AVR.
 *
 * It has no encoder, converter or PWM, so its pins are a second serial line: in each period the
 * bench sends the edges of the encoder, the converter's sum and the lines, and is answered with
 * duties. What has come releases the control interrupt, so time passes as the bench says.
 */
#include <stdbool.h>
#include <stdint.h>

#include "core.h"
#include "port.h"
#include "protocol.h"
#include "quadrature.h"

#define REGISTER(place) (*(volatile uint32_t *)(place))
#define UART(k) (0x40004000U + 0x1000U * (k))
#define DATA(k) REGISTER(UART(k))
#define STATE(k) REGISTER(UART(k) + 4)
#define CONTROL(k) REGISTER(UART(k) + 8)
#define CLEAR(k) REGISTER(UART(k) + 12)
#define DIVIDER(k) REGISTER(UART(k) + 16)
#define SEND_FULL 1U
#define HAS_COME 2U
#define HOST 0
#define PINS 1

#define SYSTICK_CONTROL REGISTER(0xE000E010)
#define SYSTICK_RELOAD REGISTER(0xE000E014)
#define SYSTICK_NOW REGISTER(0xE000E018)
#define INTERRUPTS_ON REGISTER(0xE000E100)
#define PRIORITIES REGISTER(0xE000E400)
#define PENDING REGISTER(0xE000ED04)
#define PENDSV_PRIORITY REGISTER(0xE000ED20)
#define LOWEST 0xC0U
#define HIGHER 0x40U

#define MOST 256 /* bytes of the host within a period, and edges */
#define HEAD 6 /* bytes of the bench before the edges */
#define PAINT 0xA5A5A5A5U
#define MAGIC 0x4B455054U

extern uint32_t data_begin, data_end, data_from, bss_begin, bss_end, stack_low, stack_high;

static Quadrature encoder;
static PortInputs inputs;
static struct {
    uint8_t bytes[MOST];
    volatile uint16_t come; /* since the reset; the rest of it by MOST is a place */
    uint16_t taken;
} in;
static struct {
    uint8_t bytes[HEAD + MOST];
    uint16_t filled;
} bench;
static volatile uint16_t sent;
static volatile bool ticked;
static uint8_t locks;
static int16_t motor_steps, wire_steps;
static bool enabled;
static uint32_t magic PORT_KEPT;
static uint8_t why;

static void put(int line, uint8_t byte)
{
    while (STATE(line) & SEND_FULL) {
    }
    DATA(line) = byte;
}

static void host_byte(void)
{
    CLEAR(HOST) = 2; /* first: a byte that comes behind the loop asks again */
    while (STATE(HOST) & HAS_COME) {
        in.bytes[in.come % MOST] = (uint8_t)DATA(HOST);
        in.come++;
    }
}

static void pins_byte(void)
{
    CLEAR(PINS) = 2;
    while (STATE(PINS) & HAS_COME) {
        bench.bytes[bench.filled++] = (uint8_t)DATA(PINS);
        if (bench.filled >= HEAD && bench.filled == HEAD + bench.bytes[5]) {
            bench.filled = 0;
            PENDING = 1UL << 28; /* PendSV */
        }
    }
}

/* The control interrupt. The bench says how many bytes of the host have come by now. */
static void control(void)
{
    const uint8_t *from = bench.bytes;
    const uint16_t come = (uint16_t)(from[0] | from[1] << 8);
    while (in.come != come) {
    }
    const uint32_t due = SYSTICK_NOW;
    inputs.hall = (uint16_t)(from[2] | from[3] << 8);
    inputs.lines = from[4];
    for (uint8_t k = 0; k < from[5]; k++) {
        quadrature_edge(&encoder, from[HEAD + k]);
    }
    while (in.taken != come) {
        core_byte(in.bytes[in.taken++ % MOST]);
    }
    core_tick();
    const uint32_t cycles = (due - SYSTICK_NOW) & 0xFFFFFF; /* it counts down */
    core_ticked(cycles > 0xFFFF ? 0xFFFF : (uint16_t)cycles, false);
    ticked = true;
}

static void told(uint16_t word)
{
    put(PINS, (uint8_t)word);
    put(PINS, (uint8_t)(word >> 8));
}

/* What the pins put out now, and how many bytes the host must have been sent. */
static void answer(void)
{
    told((uint16_t)motor_steps);
    told((uint16_t)wire_steps);
    put(PINS, enabled);
    told(sent);
}

PortInputs port_inputs(void)
{
    inputs.encoder = encoder.count;
    inputs.skipped = encoder.skipped;
    return inputs;
}

void port_outputs(int16_t motor, int16_t wire)
{
    motor_steps = motor;
    wire_steps = wire;
    enabled = true;
}

void port_safe(void)
{
    motor_steps = wire_steps = 0;
    enabled = false;
}

uint16_t port_skipped(void)
{
    return encoder.skipped;
}

void port_place(int32_t count)
{
    encoder.count = count;
}

void port_send(const uint8_t *bytes, uint8_t size)
{
    for (uint8_t k = 0; k < size; k++) {
        put(HOST, bytes[k]);
    }
    sent += size;
}

void port_lock(void)
{
    __asm__ volatile("msr basepri, %0" ::"r"(LOWEST) : "memory");
    locks++;
}

void port_unlock(void)
{
    if (--locks == 0) {
        __asm__ volatile("msr basepri, %0" ::"r"(0) : "memory");
    }
}

uint16_t port_stack_free(void)
{
    const uint32_t *place = &stack_low;
    while (place < &stack_high && *place == PAINT) {
        place++;
    }
    return (uint16_t)((uintptr_t)place - (uintptr_t)&stack_low);
}

uint16_t port_stack_deepest(void)
{
    return (uint16_t)((uintptr_t)&stack_high - (uintptr_t)&stack_low) - port_stack_free();
}

uint8_t port_reset(void)
{
    return why;
}

uint8_t port_board(void)
{
    return BOARDS_MPS2;
}

static void run(void)
{
    why = magic == MAGIC ? RESETS_PIN : RESETS_POWER;
    magic = MAGIC;
    inputs.hall = 0xFFFF;
    core_begin();
    SYSTICK_RELOAD = 0xFFFFFF;
    SYSTICK_CONTROL = 5; /* it counts the processor's cycles, and interrupts nobody */
    PENDSV_PRIORITY = LOWEST << 16;
    PRIORITIES = HIGHER | HIGHER << 16; /* of both lines' receivers, interrupts 0 and 2 */
    for (int line = HOST; line <= PINS; line++) {
        DIVIDER(line) = 25;
        CONTROL(line) = 1 | 2 | 8; /* sends, receives, interrupts with what comes */
    }
    INTERRUPTS_ON = 1 | 4;
    for (;;) {
        if (ticked) {
            ticked = false;
            core_poll();
            answer();
        }
        __asm__ volatile("cpsid i" ::: "memory");
        if (!ticked) { /* what has come since then wakes it all the same */
            __asm__ volatile("wfi");
        }
        __asm__ volatile("cpsie i" ::: "memory");
    }
}

/* The floating point unit first: any function may use it. */
__attribute__((naked, used)) void reset(void)
{
    __asm__ volatile("ldr r0, =0xE000ED88\n\tldr r1, [r0]\n\torr r1, r1, #0xF00000\n\t"
                     "str r1, [r0]\n\tdsb\n\tisb\n\tbl begin");
}

/* Variables and the stack's paint, before `run`. */
__attribute__((used, noreturn)) static void begin(void)
{
    const uint32_t *from = &data_from;
    for (uint32_t *to = &data_begin; to < &data_end;) {
        *to++ = *from++;
    }
    for (uint32_t *to = &bss_begin; to < &bss_end;) {
        *to++ = 0;
    }
    uint32_t *top;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    for (volatile uint32_t *to = &stack_low; to < top;) { /* no memset, which uses the stack */
        *to++ = PAINT;
    }
    run();
    for (;;) {
    }
}

/* A fault of the processor: off, and nothing more. */
static void halted(void)
{
    port_safe();
    for (;;) {
    }
}

typedef void (*Vector)(void);

__attribute__((used, section(".vectors"))) static const Vector vectors[19] = {
        (Vector)&stack_high, reset, halted, halted, halted, halted, halted, [11] = halted,
        [14] = control, [16] = host_byte, [18] = pins_byte};
