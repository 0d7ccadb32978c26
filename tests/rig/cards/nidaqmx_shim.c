/* The calls of NI-DAQmx that the package `nidaqmx` makes for a rig, answered by the test.
 *
 * A task has channels of one kind. Signatures as nidaqmx declares them.
 */
#include <stdio.h>
#include <string.h>

typedef int int32;
typedef unsigned int uint32;
typedef unsigned char byte;
typedef double (*reader)(const char *line);
typedef void (*writer)(const char *line, double value);

enum { LINES = 16, TASKS = 32, NO_LINE = -200170 };
struct task { int used, started, count; char line[LINES][40]; };
static struct task tasks[TASKS];
static reader read_one;
static writer write_one;
static char refused[40], asked[400];
static int error;

void shim_couple(reader r, writer w) { read_one = r; write_one = w; }
void shim_refuse(const char *line) { snprintf(refused, sizeof refused, "%s", line); }
const char *shim_asked(void) { return asked; }
int shim_tasks(void)
{
	int k, n = 0;
	for (k = 0; k < TASKS; k++)
		n += tasks[k].used;
	return n;
}

static int32 text(const char *value, char *into, uint32 size)
{
	if (!size)
		return (int32)strlen(value) + 1;
	snprintf(into, size, "%s", value);
	return 0;
}
static int32 add(void *handle, const char *line, const char *how)
{
	struct task *t = handle;
	if (strncmp(line, "Dev1/", 5) || strstr(line, "99"))
		return error = NO_LINE;
	snprintf(t->line[t->count++], sizeof t->line[0], "%s", line);
	strncat(asked, how, sizeof asked - strlen(asked) - 1);
	return 0;
}
static int fails(struct task *t)
{
	int k;
	for (k = 0; k < t->count; k++)
		if (!strcmp(t->line[k], refused))
			error = -50405;
	for (k = 0; k < t->count; k++)
		if (!strcmp(t->line[k], refused))
			return 1;
	return !t->started;
}

/* Attributes of NIDAQmx.h: versions, names of devices, channels of a task, lines of a channel. */
int32 DAQmxGetSystemInfoAttribute(int32 attribute, void *value, uint32 size)
{
	if (attribute == 0x193b)
		return text("Dev1, Dev2", value, size);
	*(uint32 *)value = 20;
	return 0;
}
int32 DAQmxGetExtendedErrorInfo(char *into, uint32 size)
{
	return text(error == NO_LINE ? "Physical channel does not exist." : "No transfer.", into, size);
}
int32 DAQmxGetErrorString(int32 code, char *into, uint32 size)
{
	(void)code;
	return text("", into, size);
}
int32 DAQmxCreateTask(const char *name, void **handle)
{
	int k = 0;
	(void)name;
	while (tasks[k].used)
		k++;
	memset(&tasks[k], 0, sizeof tasks[k]);
	tasks[k].used = 1;
	*handle = &tasks[k];
	return 0;
}
int32 DAQmxClearTask(void *handle) { ((struct task *)handle)->used = 0; return 0; }
int32 DAQmxStartTask(void *handle) { ((struct task *)handle)->started = 1; return 0; }
int32 DAQmxStopTask(void *handle) { ((struct task *)handle)->started = 0; return 0; }
static int32 attribute_of(struct task *t, int32 attribute, void *value, uint32 size)
{
	switch (attribute) {
	case 0x1276: /* Task_Name */
		return text("task", value, size);
	case 0x2181: case 0x217b: case 0x217e: /* Task_, Read_, Write_NumChans */
		*(uint32 *)value = (uint32)t->count;
		return 0;
	case 0x217c: case 0x217f: /* Read_, Write_DigitalLines_BytesPerChan */
		*(uint32 *)value = 1;
		return 0;
	}
	printf("nidaqmx_shim: attribute %#x\n", attribute);
	return -200452;
}
int32 DAQmxGetTaskAttribute(void *h, int32 attribute, void *value, uint32 size)
{
	return attribute_of(h, attribute, value, size);
}
int32 DAQmxGetReadAttribute(void *h, int32 attribute, void *value, uint32 size)
{
	return attribute_of(h, attribute, value, size);
}
int32 DAQmxGetWriteAttribute(void *h, int32 attribute, void *value, uint32 size)
{
	return attribute_of(h, attribute, value, size);
}

int32 DAQmxCreateAIVoltageChan(void *h, const char *line, const char *name, int32 config, double low,
			       double high, int32 units, const char *scale)
{
	char how[60];
	(void)name; (void)units; (void)scale;
	snprintf(how, sizeof how, "%s:%d:%g:%g;", line, config, low, high);
	return add(h, line, how);
}
int32 DAQmxCreateAOVoltageChan(void *h, const char *line, const char *name, double low, double high,
			       int32 units, const char *scale)
{
	char how[60];
	(void)name; (void)units; (void)scale;
	snprintf(how, sizeof how, "%s:%g:%g;", line, low, high);
	return add(h, line, how);
}
int32 DAQmxCreateDIChan(void *h, const char *line, const char *name, int32 grouping)
{
	(void)name; (void)grouping;
	return add(h, line, "");
}
int32 DAQmxCreateDOChan(void *h, const char *line, const char *name, int32 grouping)
{
	(void)name; (void)grouping;
	return add(h, line, "");
}
int32 DAQmxCreateCIAngEncoderChan(void *h, const char *line, const char *name, int32 decoding,
				  uint32 index, double value, int32 phase, int32 units,
				  uint32 pulses, double angle, const char *scale)
{
	char how[60];
	(void)name; (void)index; (void)value; (void)phase; (void)pulses; (void)angle; (void)scale;
	snprintf(how, sizeof how, "%s:%d:%d;", line, decoding, units);
	return add(h, line, how);
}
int32 DAQmxReadAnalogF64(void *h, int32 samples, double timeout, int32 fill, double *into,
			 uint32 size, int32 *read, uint32 *reserved)
{
	struct task *t = h;
	int k;
	(void)samples; (void)timeout; (void)fill; (void)size; (void)reserved;
	if (fails(t))
		return -50405;
	for (k = 0; k < t->count; k++)
		into[k] = read_one(t->line[k]);
	*read = 1;
	return 0;
}
int32 DAQmxReadDigitalLines(void *h, int32 samples, double timeout, int32 fill, byte *into,
			    uint32 size, int32 *read, int32 *bytes, uint32 *reserved)
{
	struct task *t = h;
	int k;
	(void)samples; (void)timeout; (void)fill; (void)size; (void)reserved;
	if (fails(t))
		return -50405;
	for (k = 0; k < t->count; k++)
		into[k] = (byte)read_one(t->line[k]);
	*read = *bytes = 1;
	return 0;
}
int32 DAQmxReadCounterScalarU32(void *h, double timeout, uint32 *value, uint32 *reserved)
{
	struct task *t = h;
	(void)timeout; (void)reserved;
	if (fails(t))
		return -50405;
	*value = (uint32)(long long)read_one(t->line[0]);
	return 0;
}
int32 DAQmxWriteAnalogF64(void *h, int32 samples, uint32 start, double timeout, uint32 layout,
			  const double *from, int32 *written, uint32 *reserved)
{
	struct task *t = h;
	int k;
	(void)samples; (void)start; (void)timeout; (void)layout; (void)reserved;
	if (fails(t))
		return -50405;
	for (k = 0; k < t->count; k++)
		write_one(t->line[k], from[k]);
	*written = 1;
	return 0;
}
int32 DAQmxWriteDigitalLines(void *h, int32 samples, uint32 start, double timeout, uint32 layout,
			     const byte *from, int32 *written, uint32 *reserved)
{
	struct task *t = h;
	int k;
	(void)samples; (void)start; (void)timeout; (void)layout; (void)reserved;
	if (fails(t))
		return -50405;
	for (k = 0; k < t->count; k++)
		write_one(t->line[k], from[k]);
	*written = 1;
	return 0;
}
