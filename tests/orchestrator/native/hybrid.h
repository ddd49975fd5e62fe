/* A model of differential equations and events whose solution is known.

   x' = gain (u - x)                          with the output y = 2 x + u
   h' = v, v' = -g, at h = 0 downwards        v := -restitution v: a bouncing ball, and `bounces` counts
   at every multiple of `period`              `ticks` counts
   when u crosses 1 or `level` changes        `changes` counts
   when a step ends after `step_event`        `steps` counts, once

   Faults happen from `fault_time` on, but DISCARD wherever x < 0. Integers cannot be set in continuous-time mode. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { NO_FAULT, NOT_A_NUMBER, TERMINATE, CHATTER, DISCARD, FATAL };
enum { X, H, V, STATES };
enum { STATUS_OK, STATUS_WARNING, STATUS_DISCARD, STATUS_ERROR, STATUS_FATAL };

typedef struct {
    double time, x[STATES], u, gain, g, restitution, period, step_event, fault_time;
    int fault, level, known_level, above, ticks, bounces, changes, steps, continuous;
} Model;

static void model_start(Model *m) {
    memset(m, 0, sizeof *m);
    m->x[X] = m->x[H] = m->gain = m->restitution = 1.0;
    m->g = 9.81;
    m->period = m->step_event = m->fault_time = INFINITY;
}

static int faulty(const Model *m, int fault) { return m->fault == fault && m->time >= m->fault_time; }

static int model_derivatives(const Model *m, double *dx) {
    if (faulty(m, FATAL)) return STATUS_FATAL;
    if (m->fault == DISCARD && m->x[X] < 0.0) return STATUS_DISCARD;
    dx[X] = faulty(m, NOT_A_NUMBER) ? NAN : m->gain * (m->u - m->x[X]);
    dx[H] = m->x[V];
    dx[V] = -m->g;
    return STATUS_OK;
}

enum { INDICATORS = 2 };
static void model_indicators(const Model *m, double *z) {
    z[0] = m->x[H];
    z[1] = m->u - 1.0;
}

static double model_next_event(const Model *m) {
    if (faulty(m, CHATTER)) return m->time;
    return m->period < INFINITY ? (m->ticks + 1) * m->period : INFINITY;
}

/* Handle what is due; nonzero when the simulation is to end. */
static int model_event(Model *m) {
    if (m->time >= (m->ticks + 1) * m->period) m->ticks++;
    if (m->x[H] <= 0.0 && m->x[V] < 0.0) {
        m->x[H] = 0.0;
        m->x[V] *= -m->restitution;
        m->bounces++;
    }
    if ((m->u > 1.0) != m->above || m->level != m->known_level) m->changes++;
    m->above = m->u > 1.0;
    m->known_level = m->level;
    if (m->time >= m->step_event) {
        m->steps++;
        m->step_event = INFINITY;
    }
    return faulty(m, TERMINATE);
}

static double *model_real(Model *m, unsigned reference) {
    double *places[] = {&m->x[X], &m->x[H], &m->x[V], &m->u, &m->gain, &m->g, &m->restitution, &m->period,
                        &m->step_event, &m->fault_time};
    return reference < sizeof places / sizeof *places ? places[reference] : NULL;
}

enum { DERIVATIVE = 20, Y = 30, INTEGER = 40 };
static int *model_integer(Model *m, unsigned reference) {
    int *places[] = {&m->fault, &m->level, &m->ticks, &m->bounces, &m->changes, &m->steps};
    unsigned number = reference - INTEGER;
    return reference >= INTEGER && number < sizeof places / sizeof *places ? places[number] : NULL;
}

static int model_get_real(Model *m, unsigned reference, double *value) {
    double dx[STATES], *place = model_real(m, reference);
    if (reference == Y) {
        *value = 2.0 * m->x[X] + m->u;
    } else if (reference >= DERIVATIVE && reference < DERIVATIVE + STATES) {
        int status = model_derivatives(m, dx);
        *value = dx[reference - DERIVATIVE];
        return status;
    } else if (place) {
        *value = *place;
    } else {
        return STATUS_ERROR;
    }
    return STATUS_OK;
}
