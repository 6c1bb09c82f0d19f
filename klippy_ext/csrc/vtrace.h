/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What is connected to the pins of a virtual mcu: step counters, duty meters,
 * logs of edges, input levels, analog levels and end switches.
 *
 * A step counter counts active edges of its step pin, up while its dir pin is
 * active; it goes on counting over a reset of the mcu.  Duty meters integrate
 * over the mcu's total ticks (vpins.epoch + clock), which never go back.
 */
#ifndef VTRACE_H
#define VTRACE_H

#include <stddef.h>
#include <stdint.h>

struct vpins;

struct vstep {
    struct vstep *next_on_pin;
    const struct vpins *pins;
    uint32_t dir_pin;
    uint8_t active, dir_active, both_edges;     /* levels that count */
    uint8_t is_recording, is_full;
    int64_t position;           /* steps */
    uint64_t n_steps;           /* in both directions */
    int64_t *record;            /* pairs of clock and +1 or -1 */
    size_t used, size;          /* in int64 */
};

struct voutput {
    struct voutput *next_on_pin;
    uint8_t invert;
    double fraction;            /* of the time that it is on, now */
    double on_ticks;            /* up to last_ticks */
    uint64_t last_ticks, read_ticks;
};

/* One change of one pin: its on-fraction from `clock` on, 0 or 1 for a gpio. */
struct vedge {
    int64_t clock;              /* since the last power-up */
    int64_t pin;
    double fraction;
};

/* Changes of some pins, in the order in which they happened. */
struct vedgelog {
    struct vedgelog *next;
    struct vedge *edges;
    size_t used, size;
    int is_full;
};

/* A pin that a log listens to. */
struct vedgetap {
    struct vedgetap *next_on_pin;
    struct vedgelog *log;
};

struct vswitch {
    int n_steps;
    struct vstep **steps;
    double *coeffs;
    double threshold;
    uint8_t is_above, invert;
};

struct vpin {
    uint8_t level, is_known;    /* as the mcu drives it */
    uint8_t input, has_input;
    uint16_t analog;
    struct vstep *steps;
    struct voutput *outputs;
    struct vedgetap *taps;
    struct vswitch *sw;
};

struct vpins {
    uint32_t n_pins;
    uint64_t epoch;             /* ticks before the last reset */
    struct vpin *pins;
    struct vedgelog *logs;
};

/* Returns 0 or -ENOMEM. */
int vpins_init(struct vpins *v, uint32_t n_pins);
void vpins_free(struct vpins *v);
/* The mcu lost power at `clock`: nothing is driven any more. */
void vpins_reset(struct vpins *v, uint64_t clock);

void vpins_note_level(struct vpins *v, uint64_t clock, uint32_t pin,
                      uint8_t level);
void vpins_note_pwm(struct vpins *v, uint64_t clock, uint32_t pin,
                    double fraction);
uint8_t vpins_read_level(const struct vpins *v, uint32_t pin, int8_t pull);

/* The pins own what these return; NULL when out of memory. */
struct vstep *vpins_watch_step(struct vpins *v, uint32_t step_pin,
                               uint32_t dir_pin, int invert_step,
                               int invert_dir, int both_edges);
struct voutput *vpins_watch_output(struct vpins *v, uint32_t pin, int invert,
                                   uint64_t clock);
struct vedgelog *vpins_new_log(struct vpins *v);
/* Have a log listen to a pin.  Returns 0 or -ENOMEM. */
int vpins_tap(struct vpins *v, struct vedgelog *log, uint32_t pin);
/* Close the switch at `pin` by a weighted sum of positions.  Returns 0 or
 * -ENOMEM. */
int vpins_bind_switch(struct vpins *v, uint32_t pin, struct vstep **steps,
                      const double *coeffs, int n_steps, double threshold,
                      int is_above, int invert);

/* 0, or a negative number that says which invariant does not hold. */
int vpins_check(const struct vpins *v);

/* Mean on-fraction since the last read. */
double voutput_read_duty(struct voutput *o, uint64_t total_ticks);

#endif
