/* SPDX-License-Identifier: GPL-3.0-or-later
 * Meters and switches at the pins of a virtual mcu.  See vtrace.h. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "vtrace.h"

int
vpins_init(struct vpins *v, uint32_t n_pins)
{
    v->n_pins = n_pins;
    v->epoch = 0;
    v->logs = NULL;
    v->pins = calloc(n_pins ? n_pins : 1, sizeof(*v->pins));
    return v->pins ? 0 : -ENOMEM;
}

static void
free_switch(struct vpin *p)
{
    if (!p->sw)
        return;
    free(p->sw->steps);
    free(p->sw->coeffs);
    free(p->sw);
    p->sw = NULL;
}

static void
free_logs(struct vpins *v)
{
    while (v->logs) {
        struct vedgelog *log = v->logs;
        v->logs = log->next;
        free(log->edges);
        free(log);
    }
}

void
vpins_free(struct vpins *v)
{
    free_logs(v);
    for (uint32_t i = 0; v->pins && i < v->n_pins; i++) {
        struct vpin *p = &v->pins[i];
        while (p->steps) {
            struct vstep *s = p->steps;
            p->steps = s->next_on_pin;
            free(s->record);
            free(s);
        }
        while (p->outputs) {
            struct voutput *o = p->outputs;
            p->outputs = o->next_on_pin;
            free(o);
        }
        while (p->taps) {
            struct vedgetap *tap = p->taps;
            p->taps = tap->next_on_pin;
            free(tap);
        }
        free_switch(p);
    }
    free(v->pins);
    v->pins = NULL;
}

static void
set_fraction(struct voutput *o, uint64_t ticks, double fraction)
{
    if (ticks > o->last_ticks) {
        o->on_ticks += o->fraction * (double)(ticks - o->last_ticks);
        o->last_ticks = ticks;
    }
    o->fraction = fraction;
}

double
voutput_read_duty(struct voutput *o, uint64_t total_ticks)
{
    double duty = o->fraction;

    set_fraction(o, total_ticks, o->fraction);
    if (o->last_ticks > o->read_ticks)
        duty = o->on_ticks / (double)(o->last_ticks - o->read_ticks);
    o->on_ticks = 0.;
    o->read_ticks = o->last_ticks;
    return duty;
}

void
vpins_reset(struct vpins *v, uint64_t clock)
{
    v->epoch += clock;
    for (uint32_t i = 0; i < v->n_pins; i++) {
        v->pins[i].level = v->pins[i].is_known = 0;
        for (struct voutput *o = v->pins[i].outputs; o; o = o->next_on_pin)
            set_fraction(o, v->epoch, 0.);
    }
}

static void
log_edge(struct vedgelog *log, uint64_t clock, uint32_t pin, double fraction)
{
    if (log->is_full)
        return;
    if (log->used == log->size) {
        size_t size = 2 * log->size + 1024;
        struct vedge *grown = realloc(log->edges, size * sizeof(*grown));
        if (!grown) {
            log->is_full = 1;
            return;
        }
        log->edges = grown;
        log->size = size;
    }
    log->edges[log->used++] = (struct vedge){ (int64_t)clock, pin, fraction };
}

static void
record_step(struct vstep *s, uint64_t clock, int64_t dir)
{
    if (s->used + 2 > s->size) {
        size_t size = 2 * s->size + 4096;
        int64_t *grown = realloc(s->record, size * sizeof(*grown));
        if (!grown) {
            s->is_full = 1;
            return;
        }
        s->record = grown;
        s->size = size;
    }
    s->record[s->used++] = (int64_t)clock;
    s->record[s->used++] = dir;
}

static void
count_step(struct vstep *s, uint64_t clock)
{
    int is_up = s->pins->pins[s->dir_pin].level == s->dir_active;
    int64_t dir = is_up ? 1 : -1;

    s->position += dir;
    s->n_steps++;
    if (s->is_recording && !s->is_full)
        record_step(s, clock, dir);
}

void
vpins_note_level(struct vpins *v, uint64_t clock, uint32_t pin, uint8_t level)
{
    struct vpin *p = &v->pins[pin];
    int is_edge = p->level != level, was_known = p->is_known;

    p->level = level;
    p->is_known = 1;
    for (struct vstep *s = p->steps; s && is_edge; s = s->next_on_pin)
        if (s->both_edges ? was_known : level == s->active)
            count_step(s, clock);
    for (struct voutput *o = p->outputs; o; o = o->next_on_pin)
        set_fraction(o, v->epoch + clock, level ^ o->invert);
    for (struct vedgetap *t = p->taps; t && (is_edge || !was_known);
         t = t->next_on_pin)
        log_edge(t->log, clock, pin, level);
}

void
vpins_note_pwm(struct vpins *v, uint64_t clock, uint32_t pin, double fraction)
{
    for (struct voutput *o = v->pins[pin].outputs; o; o = o->next_on_pin)
        set_fraction(o, v->epoch + clock,
                     o->invert ? 1. - fraction : fraction);
    for (struct vedgetap *t = v->pins[pin].taps; t; t = t->next_on_pin)
        log_edge(t->log, clock, pin, fraction);
}

static uint8_t
read_switch(const struct vswitch *sw)
{
    double sum = 0.;
    int is_pressed;

    for (int i = 0; i < sw->n_steps; i++)
        sum += sw->coeffs[i] * (double)sw->steps[i]->position;
    is_pressed = sw->is_above ? sum > sw->threshold : sum < sw->threshold;
    return (uint8_t)(is_pressed ^ sw->invert);
}

uint8_t
vpins_read_level(const struct vpins *v, uint32_t pin, int8_t pull)
{
    const struct vpin *p = &v->pins[pin];

    if (p->sw)
        return read_switch(p->sw);
    return p->has_input ? p->input : pull > 0;
}

struct vstep *
vpins_watch_step(struct vpins *v, uint32_t step_pin, uint32_t dir_pin,
                 int invert_step, int invert_dir, int both_edges)
{
    struct vstep *s = calloc(1, sizeof(*s));

    if (!s)
        return NULL;
    s->pins = v;
    s->dir_pin = dir_pin;
    s->active = !invert_step;
    s->dir_active = !invert_dir;
    s->both_edges = !!both_edges;
    s->next_on_pin = v->pins[step_pin].steps;
    v->pins[step_pin].steps = s;
    return s;
}

struct voutput *
vpins_watch_output(struct vpins *v, uint32_t pin, int invert, uint64_t clock)
{
    struct vpin *p = &v->pins[pin];
    struct voutput *o = calloc(1, sizeof(*o));

    if (!o)
        return NULL;
    o->invert = !!invert;
    o->fraction = p->is_known ? p->level ^ o->invert : 0.;
    o->last_ticks = o->read_ticks = v->epoch + clock;
    o->next_on_pin = p->outputs;
    p->outputs = o;
    return o;
}

struct vedgelog *
vpins_new_log(struct vpins *v)
{
    struct vedgelog *log = calloc(1, sizeof(*log));

    if (!log)
        return NULL;
    log->next = v->logs;
    v->logs = log;
    return log;
}

int
vpins_tap(struct vpins *v, struct vedgelog *log, uint32_t pin)
{
    struct vedgetap *tap = calloc(1, sizeof(*tap));

    if (!tap)
        return -ENOMEM;
    tap->log = log;
    tap->next_on_pin = v->pins[pin].taps;
    v->pins[pin].taps = tap;
    return 0;
}

int
vpins_bind_switch(struct vpins *v, uint32_t pin, struct vstep **steps,
                  const double *coeffs, int n_steps, double threshold,
                  int is_above, int invert)
{
    struct vpin *p = &v->pins[pin];
    size_t n = n_steps > 0 ? (size_t)n_steps : 0;

    free_switch(p);
    p->sw = calloc(1, sizeof(*p->sw));
    if (!p->sw)
        return -ENOMEM;
    p->sw->steps = calloc(n + 1, sizeof(*p->sw->steps));
    p->sw->coeffs = calloc(n + 1, sizeof(*p->sw->coeffs));
    if (!p->sw->steps || !p->sw->coeffs) {
        free_switch(p);
        return -ENOMEM;
    }
    if (n) {
        memcpy(p->sw->steps, steps, n * sizeof(*steps));
        memcpy(p->sw->coeffs, coeffs, n * sizeof(*coeffs));
    }
    p->sw->n_steps = n_steps;
    p->sw->threshold = threshold;
    p->sw->is_above = !!is_above;
    p->sw->invert = !!invert;
    return 0;
}

static int
check_step(const struct vpins *v, const struct vstep *s)
{
    uint64_t off = s->position < 0 ? -(uint64_t)s->position
                                   : (uint64_t)s->position;

    if (s->pins != v || s->dir_pin >= v->n_pins || s->active > 1
        || s->dir_active > 1)
        return -85;
    if (off > s->n_steps || ((off ^ s->n_steps) & 1))
        return -86;
    return s->used <= s->size && s->used % 2 == 0 ? 0 : -87;
}

static int
check_pin(const struct vpins *v, const struct vpin *pin)
{
    int ret = 0;

    for (const struct vstep *s = pin->steps; s && !ret; s = s->next_on_pin)
        ret = check_step(v, s);
    for (const struct voutput *o = pin->outputs; o; o = o->next_on_pin)
        if (!(o->fraction >= 0. && o->fraction <= 1.)
            || !(o->on_ticks >= 0.) || o->read_ticks > o->last_ticks)
            return -88;
    for (const struct vedgetap *t = pin->taps; t; t = t->next_on_pin)
        if (!t->log || t->log->used > t->log->size)
            return -89;
    if (pin->level > 1 || (pin->sw && pin->sw->n_steps < 0))
        return -90;
    return ret;
}

int
vpins_check(const struct vpins *v)
{
    int ret = 0;

    for (uint32_t i = 0; i < v->n_pins && !ret; i++)
        ret = check_pin(v, &v->pins[i]);
    return ret;
}
