#include "core.h"

#include <math.h>
#include <stddef.h>

#include "link.h"
#include "parameters.h"
#include "port.h"
#include "protocol.h"
#include "two_stage_board.h"

#define PERIOD (1e-6f * PROTOCOL_PERIOD) /* s */
#define FULL ((int16_t)PROTOCOL_FULL)
#define LONG_AGO 60000U
#define HALL_CODE (BOARD_FULL_SCALE / 4096.0f) /* V */
#define REBASE 1000000UL /* periods after which the guard's time begins again: floats end */
#define PATIENCE 50 /* periods that the guard may take before the board stops */
#define SPIKE 9000 /* codes; PATIENCE squares of it have room */

static const uint16_t offsets[PARAMETERS_ALONE] PORT_CONSTANT = {PARAMETER_OFFSETS};

static float table[PROTOCOL_TABLE];
static ControlBoard params; /* nothing until the host has written them */
static ControlEffort effort; /* of the laws, in the interrupt */
static GuardWatch watch; /* of the guard, outside of it */

/* The estimated heat in the wire outlives a reset: else each one would let it be heated anew. So
   does the room it is above, for the host to read before it has written the parameters again. */
static struct Kept {
    ElectrothermalHeating heating;
    float ambient;
    uint16_t crc;
} kept PORT_KEPT;

static uint32_t now; /* periods since the reset */
static uint32_t base; /* the guard's time is from here */
static uint32_t judged; /* period that the guard has seen last */
static uint16_t quiet; /* periods since the host's last frame */
static bool driving, trusted, silent, streaming;
static uint16_t skipped; /* edges lost until the host said where the carriage stands */
static ControlOrder asked;
static PortInputs seen;
static uint16_t hall_before; /* of the last period */
/* Second differences of its codes since the guard's last look: motion has next to none. */
static struct {
    uint32_t squares;
    uint8_t count;
    uint16_t most; /* one counts for no more */
} jitter;
static float motor, ctrl; /* V, from the next period on; from now on in the host's loop */
static int16_t out_motor, out_ctrl; /* the same, in parts of the full scale, as put out now */
static int16_t left_motor, left_ctrl; /* of the rounding to duties, in such parts */

static struct {
    uint8_t code;
    float value, limit;
    uint32_t when;
} fault;
static uint16_t worst, missed; /* cycles of a period that ended in time; others */
static uint8_t sequence;
static LinkIn in;
static struct {
    volatile bool full;
    uint8_t id;
    uint8_t fields[LONGEST_HOST];
} waiting; /* a frame that the interrupt has no time for */

/* A sample may overtake an answer: the lock holds the control interrupt up for no longer than it must. */
static void send(uint8_t id, const uint8_t *fields, uint8_t size)
{
    uint8_t bytes[LINK_LONGEST];
    port_lock();
    const uint8_t number = sequence++;
    port_unlock();
    const uint8_t length = link_stuffed(id, number, fields, size, bytes);
    port_lock();
    port_send(bytes, length);
    port_unlock();
}

static void safe(void)
{
    driving = false;
    motor = ctrl = 0.0f;
    out_motor = out_ctrl = 0;
    left_motor = left_ctrl = 0;
    asked.holds = false;
    asked.motor = asked.ctrl = 0.0f;
    port_safe();
}

/* A fault of the board alone, or of the guard; the first one stays. */
static void failed(uint8_t code, float value, float limit)
{
    if (fault.code == 0) {
        fault.code = code;
        fault.value = value;
        fault.limit = limit;
        fault.when = now;
    }
    safe();
}

/* All but the estimated heat begins again: clearing a fault cools no wire. */
static void renewed(void)
{
    const ElectrothermalHeating heating = watch.heat.heating;
    two_stage_board_begin(&watch);
    watch.heat.heating = heating;
    base = now;
}

static uint16_t kept_crc(void)
{
    const uint8_t *bytes = (const uint8_t *)&kept;
    uint16_t crc = 0x5AA5; /* not that of zeros */
    for (uint8_t k = 0; k < offsetof(struct Kept, crc); k++) {
        crc = link_crc(crc, bytes[k]);
    }
    return crc;
}

void core_begin(void)
{
    params.guard.calibration.position = table;
    two_stage_board_begin(&watch);
    if ((port_reset() & RESETS_POWER) == 0 && kept.crc == kept_crc()) {
        watch.heat.heating = kept.heating;
        params.guard.limits.ambient = kept.ambient;
    }
    quiet = LONG_AGO;
}

static uint8_t state(void)
{
    return (driving ? STATE_DRIVING : 0) | (trusted ? STATE_TRUSTED : 0)
            | (silent ? STATE_SILENT : 0) | (asked.holds ? STATE_HELD : 0)
            | (streaming ? STATE_STREAMING : 0);
}

/* A voltage in parts of the full scale; the end of it beyond, 0 for no number. */
static int16_t parts(float volts)
{
    const float found = volts * (FULL / BOARD_FULL_SCALE);
    if (found > FULL) {
        return FULL;
    }
    return found > -FULL ? (int16_t)found : found < 0.0f ? -FULL : 0;
}

/* Steps of a duty, `each` parts a step; what rounding leaves goes into the next period. */
static int16_t dithered(int16_t wanted, int16_t each, int16_t *left)
{
    const int16_t sum = wanted + *left; /* FULL and less than a step: no overflow */
    const int16_t steps = sum / each;
    *left = sum - steps * each;
    return steps;
}

/* Codes of the Hall sensor's converter in V; NaN for no value. */
static float hall_volts(uint16_t code)
{
    return code > 4095 ? NAN : code * HALL_CODE;
}

/* The laws, which pass nothing on that the limits forbid. */
static void drive(float hall)
{
    asked.quiet = quiet * PERIOD;
    asked.low = (seen.lines & LINES_LIMIT_LOW) != 0;
    asked.high = (seen.lines & LINES_LIMIT_HIGH) != 0;
    asked.fault = (seen.lines & LINES_BRIDGE_FAULT) != 0;
    const TwoStageBoardDriveOut out = two_stage_board_drive(
            &params, &effort, (float)seen.encoder, hall, &asked, PERIOD);
    effort = out.state;
    motor = out.motor;
    ctrl = out.ctrl;
    if (effort.fault != 0) {
        silent = effort.fault == FAULTS_HOST_SILENT;
        const float value = (uint8_t)effort.fault >= FAULTS_LIMIT_SWITCH ? asked.quiet : asked.motor;
        failed((uint8_t)effort.fault, value, params.guard.limits.motor);
    }
}

static void tell_sample(void)
{
    uint8_t fields[SIZE_SAMPLE];
    const SampleFrame sample = {(uint16_t)now, now, seen.encoder, seen.hall, seen.lines, state(),
            fault.code, out_motor, out_ctrl};
    sample_write(&sample, fields);
    send(FRAME_SAMPLE, fields, SIZE_SAMPLE);
}

/* The Hall sensor's code of this period, and what it differs from a line through the last two. */
static void note_hall(uint16_t before)
{
    const uint16_t earlier = hall_before;
    hall_before = before;
    if ((seen.hall | before | earlier) > 4095 || jitter.count >= PATIENCE) {
        return;
    }
    const int16_t second = (int16_t)(seen.hall - 2 * before + earlier);
    uint16_t size = second < 0 ? (uint16_t)-second : (uint16_t)second;
    if (size > jitter.most) {
        size = jitter.most;
    }
    jitter.squares += (uint32_t)size * size;
    jitter.count++;
}

void core_tick(void)
{
    now++;
    if (quiet < LONG_AGO) {
        quiet++;
    }
    const uint16_t hall = seen.hall;
    seen = port_inputs();
    note_hall(hall);
    if (seen.skipped != skipped) {
        trusted = false;
    }
    if (driving && now - judged > PATIENCE) {
        failed(FAULTS_LATE, (now - judged) * PERIOD, PATIENCE * PERIOD);
    }
    if (driving && !asked.holds) {
        drive(NAN);
    }
    if (driving) {
        out_motor = parts(motor);
        out_ctrl = parts(ctrl);
        port_outputs(dithered(out_motor, FULL / BOARD_MOTOR_STEPS, &left_motor),
                dithered(out_ctrl, FULL / BOARD_WIRE_STEPS, &left_ctrl));
    }
    if (streaming) {
        tell_sample();
    }
    if (driving && asked.holds) {
        drive(hall_volts(seen.hall));
    }
}

void core_ticked(uint16_t cycles, bool late)
{
    if (!late) {
        if (cycles > worst) {
            worst = cycles;
        }
        return;
    }
    missed++;
    if (driving) {
        failed(FAULTS_LATE, cycles, 0.0f);
    }
}

/* The guard, some periods behind: it takes longer than the interrupt may. It is shown a reading
 * before the last two whose second difference has the mean square of all that it has missed: a motor
 * that turns in motion shakes the stage, and one such reading is not to stand for ten. */
static void judge(void)
{
    port_lock(); /* copies alone: the control interrupt waits meanwhile */
    const uint32_t at = now;
    const PortInputs in_now = seen;
    const uint16_t before = hall_before;
    const uint32_t squares = jitter.squares;
    const uint8_t count = jitter.count;
    jitter.squares = 0;
    jitter.count = 0;
    const ControlOrder order = asked;
    TypesOutputs out = {motor, ctrl, 0.0f, 0.0f};
    const bool drove = driving;
    port_unlock();
    const float passed = (at - judged) * PERIOD;
    if (passed == 0.0f) {
        return;
    }
    const float hall = hall_volts(in_now.hall), last = hall_volts(before);
    const float second = count > 0 ? HALL_CODE * sqrtf((float)squares / count) : NAN;
    if (at - base >= REBASE) {
        base += REBASE;
        watch.seen.time -= REBASE * PERIOD;
    }
    watch.seen.hall = last;
    watch.seen.before = second - hall + 2.0f * last;
    const TypesSample sample = {(at - base) * PERIOD, (float)in_now.encoder,
            hall, NAN, in_now.lines & LINES_EXTEND ? 1.0f : 0.0f,
            in_now.lines & LINES_CONTRACT ? 1.0f : 0.0f};
    const bool holds = order.holds && drove;
    const TypesCommand command = {order.macro_reference,
            holds && order.macro_active ? 1.0f : 0.0f, order.micro_reference,
            holds && order.micro_active ? 1.0f : 0.0f, 0.0f};
    const TwoStageBoardJudgeOut judgement
            = two_stage_board_judge(&params.guard, &watch, &sample, &command, &out, passed);
    watch = judgement.state;
    if (!drove) { /* nothing was asked for: what it saw is no fault */
        renewed();
    }
    port_lock();
    judged = at;
    if (driving && watch.fault != 0) {
        failed((uint8_t)watch.fault, watch.value, watch.limit);
    }
    port_unlock();
    kept.heating = watch.heat.heating;
    kept.ambient = params.guard.limits.ambient;
    kept.crc = kept_crc();
}

static float *parameter(uint8_t index)
{
    if (index >= PARAMETERS_ALONE) {
        return &table[index - PARAMETERS_ALONE];
    }
    return (float *)((char *)&params + port_constant(offsets[index]));
}

static uint16_t parameters_crc(void)
{
    uint16_t crc = 0xFFFF;
    for (uint8_t k = 0; k < PARAMETERS; k++) {
        const uint8_t *bytes = (const uint8_t *)parameter(k);
        for (uint8_t j = 0; j < 4; j++) {
            crc = link_crc(crc, bytes[j]);
        }
    }
    return crc;
}

static void done(uint8_t id, uint8_t refused)
{
    uint8_t fields[SIZE_DONE];
    const DoneFrame it = {id, refused};
    done_write(&it, fields);
    send(FRAME_DONE, fields, SIZE_DONE);
}

static void say_parameter(uint8_t index)
{
    uint8_t fields[SIZE_PARAMETER];
    const ParameterFrame it = {index, *parameter(index)};
    parameter_write(&it, fields);
    send(FRAME_PARAMETER, fields, SIZE_PARAMETER);
}

static void say_identity(void)
{
    uint8_t fields[SIZE_IDENTITY];
    const IdentityFrame it = {PROTOCOL_VERSION, PROTOCOL_FIRMWARE, PROTOCOL_LAYOUT,
            PROTOCOL_PERIOD, PARAMETERS, port_board(), port_reset()};
    identity_write(&it, fields);
    send(FRAME_IDENTITY, fields, SIZE_IDENTITY);
}

static void say_status(void)
{
    uint8_t fields[SIZE_STATUS];
    const uint16_t deepest = port_stack_deepest();
    const uint16_t unused = port_stack_free();
    const float temperature = two_stage_board_temperature(&params.guard.limits, &watch);
    port_lock();
    const StatusFrame it = {state(), fault.code, fault.value, fault.limit, fault.when, worst,
            missed, deepest, unused, in.bad, port_skipped(), temperature};
    port_unlock();
    status_write(&it, fields);
    send(FRAME_STATUS, fields, SIZE_STATUS);
}

static uint8_t begin(uint16_t crc)
{
    if (driving) {
        return REFUSALS_DRIVING;
    }
    if (crc != parameters_crc()) {
        return REFUSALS_PARAMETERS;
    }
    const float most = two_stage_board_spike(&params.guard.limits) / HALL_CODE;
    port_lock();
    safe();
    renewed();
    jitter.squares = 0;
    jitter.count = 0;
    jitter.most = most > 0.0f && most < SPIKE ? (uint16_t)most : SPIKE;
    effort = two_stage_board_rest;
    fault.code = 0;
    fault.value = fault.limit = 0.0f;
    silent = false;
    judged = now;
    driving = true;
    port_unlock();
    return REFUSALS_NONE;
}

static void place(int32_t count)
{
    port_lock();
    port_place(count);
    skipped = port_skipped();
    trusted = true;
    if (driving) {
        renewed(); /* the guard would see a jump */
    }
    port_unlock();
}

/* What must be obeyed before this period's outputs, in the interrupt. */
static bool obey_now(const LinkFrame *frame)
{
    switch (frame->id) {
    case FRAME_OUTPUTS: {
        const OutputsFrame it = outputs_read(frame->fields);
        asked.holds = false;
        asked.motor = it.motor;
        asked.ctrl = it.ctrl;
        return true;
    }
    case FRAME_TARGETS: {
        const TargetsFrame it = targets_read(frame->fields);
        asked.holds = true;
        asked.macro_reference = it.macro_reference;
        asked.micro_reference = it.micro_reference;
        asked.macro_active = (it.active & ACTIVE_MACRO) != 0;
        asked.micro_active = (it.active & ACTIVE_MICRO) != 0;
        return true;
    }
    case FRAME_KEEP:
        return true;
    case FRAME_STOP:
        safe();
        done(FRAME_STOP, REFUSALS_NONE);
        return true;
    default:
        return false;
    }
}

static void obey(uint8_t id, const uint8_t *from)
{
    switch (id) {
    case FRAME_HELLO:
        say_identity();
        break;
    case FRAME_GET:
    case FRAME_SET:
        if (from[0] >= PARAMETERS) {
            done(id, REFUSALS_INDEX);
        } else if (id == FRAME_SET && driving) {
            done(id, REFUSALS_DRIVING);
        } else {
            if (id == FRAME_SET) {
                *parameter(from[0]) = set_read(from).value;
            }
            say_parameter(from[0]);
        }
        break;
    case FRAME_BEGIN:
        done(id, begin(begin_read(from).parameters));
        break;
    case FRAME_PLACE:
        place(place_read(from).count);
        done(id, REFUSALS_NONE);
        break;
    case FRAME_ASK:
        say_status();
        break;
    case FRAME_STREAM:
        streaming = from[0] != 0;
        done(id, REFUSALS_NONE);
        break;
    default:
        done(id, REFUSALS_UNKNOWN);
        break;
    }
}

void core_byte(uint8_t byte)
{
    LinkFrame frame;
    if (!link_take(&in, byte, &frame)) {
        return;
    }
    const bool known = frame.size == protocol_size(frame.id);
    if (known) {
        quiet = 0;
        if (obey_now(&frame)) {
            return;
        }
    }
    if (!waiting.full) { /* else it is lost: the host asks again */
        waiting.id = known ? frame.id : 0;
        memcpy(waiting.fields, frame.fields, known ? frame.size : 0);
        waiting.full = true;
    }
}

void core_poll(void)
{
    if (waiting.full) {
        obey(waiting.id, waiting.fields);
        waiting.full = false;
    }
    judge();
}
