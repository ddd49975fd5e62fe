/* A model that can be checked by hand, and that fails in any way that is asked for.

   State k follows x' = k u - x, stepped by the backward Euler method with the input at the end of the step, where u is
   input 1 + (k - 1) mod INPUTS; output k is state k. Faults happen in steps that end at `fault_time` or later and are
   longer than `fault_step`. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#ifndef INPUTS
#define INPUTS 6
#endif
#ifndef OUTPUTS
#define OUTPUTS 12
#endif

enum {
    NO_FAULT, SEGFAULT, HANG, EXIT, FATAL, NOT_A_NUMBER, ERROR, DISCARD, WARNING, PRINT, EARLY_RETURN, TERMINATE, PENDING
};
/* The statuses of FMI 2.0; those of FMI 3.0 are the same but for the last one. */
enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL, STATUS_PENDING };

typedef struct {
    double u[INPUTS], y[OUTPUTS];
    double time, fault_time, fault_step, last_time;
    int fault;
    char label[64];
} Model;

/* The derivatives of output k by the equation of its state. */
static double model_derivative(const Model *model, int k, int order) {
    double slope = (k + 1) * model->u[k % INPUTS] - model->y[k];
    return order == 1 ? slope : -slope;
}

static int model_step(Model *model, double time, double size, const char **message) {
    int due = time + size >= model->fault_time * (1.0 - 1e-12) && size > model->fault_step;
    int fault = due ? model->fault : NO_FAULT;
    double part = fault == DISCARD ? 0.5 * size : size;
    double scale = 1.0 / (1.0 + part);
    *message = NULL;
    if (fault == SEGFAULT) *(volatile int *)0 = 1;
    while (fault == HANG) sleep(1);
    if (fault == EXIT) exit(3);
    if (fault == FATAL) { *message = "the model is lost at 100 %"; return STATUS_FATAL; }
    if (fault == ERROR) { *message = "the model cannot go on at 100 %"; return STATUS_ERROR; }
    for (int k = 0; k < OUTPUTS; k++)
        model->y[k] = (model->y[k] + part * (k + 1) * model->u[k % INPUTS]) * scale;
    model->time = model->last_time = time + part;
    if (fault == NOT_A_NUMBER) model->y[0] = NAN;
    if (fault == DISCARD) { *message = "the step is too long"; return STATUS_DISCARD; }
    if (fault == WARNING) { *message = "the result is rough"; return STATUS_WARNING; }
    if (fault == PRINT) { printf("the model prints\n"); fflush(stdout); }
    return fault == PENDING ? STATUS_PENDING : STATUS_OK;
}
