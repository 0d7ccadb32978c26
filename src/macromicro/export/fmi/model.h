/* What both interfaces of an FMU ask of the model in it. MIT licence. */
#ifndef MODEL_H
#define MODEL_H

#include <stddef.h>

extern const char MODEL_TOKEN[];

typedef struct Model Model;

size_t model_size(void);
/* Parameters, inputs and state as at the start. */
void model_reset(Model *m);
/* The state that follows from parameters and inputs, and the outputs at that time. */
void model_start(Model *m, double time);
/* Control periods for so long; inputs are held. */
void model_step(Model *m, double length);
/* After a copy: the state's arrays are those of the copy. */
void model_moved(Model *m);
/* The outputs as parameters, inputs and state are now. */
void model_show(Model *m);
/* A variable by its value reference; NULL if there is none. */
double *model_at(Model *m, unsigned int reference);

#endif
