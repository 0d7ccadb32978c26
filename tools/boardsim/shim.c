/* An ATmega328P in simavr, as a library for Python: time, pins, converter and UART.
 *
 * Edges of the encoder and bytes from the host are put in by timers of the simulated clock, so
 * what happens does not depend on the machine that simulates.
 */
#include <avr_adc.h>
#include <avr_extint.h>
#include <avr_ioport.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define EVENTS 4096
#define BYTES 65536

typedef struct {
    uint64_t when;
    char port;
    uint8_t bit, level;
} Event;

static avr_t *avr;
static elf_firmware_t firmware;
static Event events[EVENTS];
static unsigned first_event, last_event;
static uint8_t from_host[BYTES], to_host[BYTES];
static unsigned host_head, host_tail, to_count;
static avr_irq_t *uart_in;

static void no_sleep(avr_t *a, avr_cycle_count_t cycles)
{
    (void)a;
    (void)cycles;
}

static void quiet(avr_t *a, const int level, const char *format, va_list list)
{
    (void)a;
    (void)level;
    (void)format;
    (void)list;
}

static avr_ioport_external_t outside[3] = {{'B', 0, 0}, {'C', 0, 0}, {'D', 0, 0}};

/* Drive an input, against the pull-up inside. */
static void driven(char port, int bit, int level)
{
    avr_ioport_external_t *it = &outside[port - 'B'];
    it->mask |= 1 << bit;
    it->value = (it->value & ~(1 << bit)) | level << bit;
    avr_ioctl(avr, AVR_IOCTL_IOPORT_SET_EXTERNAL(port), it);
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_IOPORT_GETIRQ(port), (uint32_t)bit), level);
}

static avr_cycle_count_t event_due(avr_t *a, avr_cycle_count_t when, void *given)
{
    (void)when;
    (void)given;
    while (first_event != last_event && events[first_event % EVENTS].when <= a->cycle) {
        const Event *e = &events[first_event++ % EVENTS];
        driven(e->port, e->bit, e->level);
    }
    return first_event == last_event ? 0 : events[first_event % EVENTS].when;
}

static avr_cycle_count_t byte_due(avr_t *a, avr_cycle_count_t when, void *given)
{
    (void)a;
    (void)given;
    if (host_tail == host_head) {
        return 0;
    }
    avr_raise_irq(uart_in, from_host[host_tail++ % BYTES]);
    return when + 160; /* 10 bits at 1 Mbaud */
}

static void sent(struct avr_irq_t *irq, uint32_t value, void *given)
{
    (void)irq;
    (void)given;
    if (to_count < BYTES) {
        to_host[to_count++] = (uint8_t)value;
    }
}

/* 0, or why not. */
int sim_open(const char *elf)
{
    avr_global_logger_set(quiet);
    memset(&firmware, 0, sizeof firmware);
    if (elf_read_firmware(elf, &firmware) != 0) {
        return 1;
    }
    avr = avr_make_mcu_by_name("atmega328p");
    if (avr == NULL || avr_init(avr) != 0) {
        return 2;
    }
    firmware.frequency = 16000000;
    avr_load_firmware(avr, &firmware);
    avr->frequency = 16000000;
    avr->vcc = avr->avcc = avr->aref = 5000;
    avr->sleep = no_sleep;
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    /* Else simavr takes a low INT1 for a level that interrupts again and again, in any mode. */
    avr_extint_set_strict_lvl_trig(avr, EXTINT_IRQ_OUT_INT0, 0);
    avr_extint_set_strict_lvl_trig(avr, EXTINT_IRQ_OUT_INT1, 0);
    uart_in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
    avr_irq_register_notify(
            avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, NULL);
    return 0;
}

/* A reset by the reset pin: the RAM stays. */
void sim_reset(void)
{
    avr_reset(avr);
    avr_regbit_set(avr, avr->reset_flags.extrf);
    for (int k = 0; k < 3; k++) { /* simavr forgets the levels at the pins */
        avr->data[0x23 + 3 * k] = (uint8_t)(outside[k].value & outside[k].mask);
    }
    avr->vcc = avr->avcc = avr->aref = 5000;
    host_tail = host_head;
    to_count = 0;
}

uint64_t sim_cycle(void)
{
    return avr->cycle;
}

/* Run to a cycle; the state of the CPU (4 sleeping, 2 running, 5 and more: it died). */
int sim_run(uint64_t until)
{
    int state = avr->state;
    while (avr->cycle < until && state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
    }
    return state;
}

/* Run on until no interrupt is held up: a duty that is half written, byte by byte, is none; the
 * timer itself takes it as a whole, which simavr does not. */
int sim_settle(int most)
{
    const uint64_t until = avr->cycle + (uint64_t)most;
    int state = avr->state;
    while (!avr->sreg[S_I] && avr->cycle < until && state != cpu_Done && state != cpu_Crashed) {
        state = avr_run(avr);
    }
    return state;
}

void sim_pin(char port, int bit, int level)
{
    driven(port, bit, level);
}

/* Later: levels at cycles, in their order. */
int sim_later(uint64_t when, char port, int bit, int level)
{
    if (last_event - first_event == EVENTS) {
        return 1;
    }
    const int idle = first_event == last_event;
    events[last_event++ % EVENTS] = (Event){when, port, (uint8_t)bit, (uint8_t)level};
    if (idle) {
        avr_cycle_timer_register(avr, when > avr->cycle ? when - avr->cycle : 1, event_due, NULL);
    }
    return 0;
}

void sim_volts(int channel, int millivolts)
{
    avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, (uint32_t)channel), millivolts);
}

void sim_put(const uint8_t *bytes, int size)
{
    const int idle = host_head == host_tail;
    for (int k = 0; k < size; k++) {
        from_host[host_head++ % BYTES] = bytes[k];
    }
    if (idle && size > 0) {
        avr_cycle_timer_register(avr, 160, byte_due, NULL);
    }
}

int sim_take(uint8_t *bytes, int room)
{
    const int size = (int)to_count < room ? (int)to_count : room;
    memcpy(bytes, to_host, (size_t)size);
    memmove(to_host, to_host + size, to_count - (unsigned)size);
    to_count -= (unsigned)size;
    return size;
}

/* Between interrupts: put a jump to itself at the next instruction; its place, and what was there. */
int sim_hang(uint16_t *was)
{
    while (!avr->sreg[S_I] || avr->pc >= avr->flashend || avr->interrupts.running_ptr > 0) {
        avr_run(avr);
    }
    const int place = (int)avr->pc;
    memcpy(was, avr->flash + place, 2);
    avr->flash[place] = 0xFF;
    avr->flash[place + 1] = 0xCF; /* rjmp . */
    return place;
}

void sim_mend(int place, uint16_t was)
{
    memcpy(avr->flash + place, &was, 2);
}

int sim_register(int address)
{
    return avr->data[address];
}

int sim_data(int address, int value)
{
    const int before = avr->data[address];
    avr->data[address] = (uint8_t)value;
    return before;
}
