/* The calls of libcomedi that a rig makes, answered by functions of the test: a MultiQ-3.
 *
 * With libcomedi's own header at hand the signatures are compared by the compiler.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>
#if defined(__has_include)
#if __has_include(<comedilib.h>)
#include <comedilib.h>
#define DECLARED 1
#endif
#endif
#ifndef DECLARED
typedef struct comedi_t_struct comedi_t;
typedef unsigned int lsampl_t;
typedef struct { double min; double max; unsigned int unit; } comedi_range;
#endif

typedef unsigned int (*reader)(unsigned int subdevice, unsigned int channel);
typedef void (*writer)(unsigned int subdevice, unsigned int channel, unsigned int data);

static const int TYPES[] = {1, 2, 3, 4, 6, 5};   /* AI, AO, DI, DO, counter, DIO */
static const int CHANNELS[] = {8, 8, 16, 16, 8, 8};
static const lsampl_t LARGEST[] = {0x1fff, 0xfff, 1, 1, 0xffffff, 1};
static comedi_range FIVE = {-5.0, 5.0, 0};
static int error, refused = -1, directions[8];
static reader read_one;
static writer write_one;
static int opened;

void shim_couple(reader r, writer w) { read_one = r; write_one = w; }
void shim_refuse(int subdevice) { refused = subdevice; }
int shim_opened(void) { return opened; }
int shim_direction(int channel) { return directions[channel]; }

static int fails(unsigned int subdevice)
{
	if ((int)subdevice != refused)
		return 0;
	error = 5;
	return 1;
}

comedi_t *comedi_open(const char *name)
{
	if (strcmp(name, "/dev/comedi0")) {
		error = 2;
		return NULL;
	}
	opened++;
	return (comedi_t *)&opened;
}
int comedi_close(comedi_t *d) { opened -= d == (comedi_t *)&opened; return 0; }
int comedi_errno(void) { return error; }
const char *comedi_strerror(int number) { return strerror(number); }
int comedi_get_n_subdevices(comedi_t *d) { (void)d; return 6; }
int comedi_get_subdevice_type(comedi_t *d, unsigned int s) { (void)d; return TYPES[s]; }
int comedi_get_n_channels(comedi_t *d, unsigned int s) { (void)d; return CHANNELS[s]; }
int comedi_get_n_ranges(comedi_t *d, unsigned int s, unsigned int c)
{
	(void)d; (void)c;
	return s < 2 ? 1 : 0;
}
lsampl_t comedi_get_maxdata(comedi_t *d, unsigned int s, unsigned int c)
{
	(void)d; (void)c;
	return LARGEST[s];
}
comedi_range *comedi_get_range(comedi_t *d, unsigned int s, unsigned int c, unsigned int r)
{
	(void)d; (void)s; (void)c; (void)r;
	return &FIVE;
}
int comedi_data_read(comedi_t *d, unsigned int s, unsigned int c, unsigned int r, unsigned int a,
		     lsampl_t *data)
{
	(void)d; (void)r; (void)a;
	if (fails(s))
		return -1;
	*data = read_one(s, c);
	return 1;
}
int comedi_data_write(comedi_t *d, unsigned int s, unsigned int c, unsigned int r, unsigned int a,
		      lsampl_t data)
{
	(void)d; (void)r; (void)a;
	if (fails(s))
		return -1;
	write_one(s, c, data);
	return 1;
}
int comedi_dio_config(comedi_t *d, unsigned int s, unsigned int c, unsigned int direction)
{
	(void)d; (void)s;
	directions[c] = (int)direction;
	return 0;
}
int comedi_dio_read(comedi_t *d, unsigned int s, unsigned int c, unsigned int *bit)
{
	(void)d;
	if (fails(s))
		return -1;
	*bit = read_one(s, c);
	return 1;
}
int comedi_dio_write(comedi_t *d, unsigned int s, unsigned int c, unsigned int bit)
{
	(void)d;
	if (fails(s))
		return -1;
	write_one(s, c, bit);
	return 1;
}
double comedi_to_phys(lsampl_t data, comedi_range *r, lsampl_t largest)
{
	if (data == 0 || data >= largest)
		return NAN; /* as libcomedi: out of range */
	return r->min + (r->max - r->min) * data / largest;
}
lsampl_t comedi_from_phys(double value, comedi_range *r, lsampl_t largest)
{
	double part = (value - r->min) / (r->max - r->min) * largest;
	if (part < 0.0)
		return 0;
	return part > largest ? largest : (lsampl_t)(part + 0.5);
}
