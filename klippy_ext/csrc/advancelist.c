/* SPDX-License-Identifier: GPL-3.0-or-later
 * Settings of pressure advance.  See advancelist.h. */
#include <errno.h>
#include <math.h>
#include <string.h>

#include "advancelist.h"

const struct advance_setting *
advancelist_find(const struct advance_list *list, double print_time)
{
    int i = list->count - 1;

    while (i > 0 && list->settings[i].print_time > print_time + 1e-9)
        i--;
    return &list->settings[i];
}

/* Window of two settings that follow each other: the longer serves both. */
static double
get_reach(const struct advance_setting *s)
{
    return fmax(s[0].state.half, s[1].state.half);
}

static int
is_valid(const struct advance_model *m)
{
    double sum = m->linear + m->offset + m->velocity + m->smooth_time
        + m->time_offset;

    return isfinite(sum) && m->linear >= 0. && m->offset >= 0.
        && m->velocity >= 0. && m->smooth_time >= 0.
        && (m->kind == ADVANCE_LINEAR || m->offset == 0.
            || m->velocity > 0.);
}

static struct advance_setting
make_setting(double print_time, const struct advance_model *m)
{
    struct advance_setting s = { .print_time = print_time };
    int is_bent = m->kind != ADVANCE_LINEAR && m->offset > 0.;

    s.state.shift = m->time_offset;
    if (m->smooth_time == 0. || (m->linear == 0. && !is_bent))
        return s;
    s.advance = m->linear;
    s.state.half = .5 * m->smooth_time;
    if (is_bent)
        s.state.bend = (struct bend) { m->kind, m->offset,
                                       1. / m->velocity };
    return s;
}

static int
is_same_bend(const struct bend *a, const struct bend *b)
{
    return a->kind == b->kind && a->offset == b->offset
        && a->inv_velocity == b->inv_velocity;
}

int
advancelist_is_same(const struct advance_state *a,
                    const struct advance_state *b)
{
    return a->half == b->half && a->shift == b->shift
        && is_same_bend(&a->bend, &b->bend);
}

/* Half the window at a time; *until is lowered to when that may change. */
static double
get_half(const struct advance_list *list, double time, double *until)
{
    const struct advance_setting *s = list->settings;
    double half = 0.;

    for (int i = list->count - 1; i >= 0; i--) {
        double from = i ? s[i].print_time - get_reach(&s[i - 1]) : -INFINITY;
        double to = i + 1 < list->count
            ? s[i + 1].print_time + get_reach(&s[i]) : INFINITY;
        if (from > time) {
            *until = fmin(*until, from);
            continue;
        }
        if (to > time) {
            half = fmax(half, s[i].state.half);
            *until = fmin(*until, to);
        }
    }
    return half;
}

/* When the setting after the one for a time begins. */
static double
get_next_setting(const struct advance_list *list, double time)
{
    const struct advance_setting *s = advancelist_find(list, time) + 1;

    return s < list->settings + list->count ? s->print_time : INFINITY;
}

struct advance_state
advancelist_get_state(const struct advance_list *list, double time,
                      double *until)
{
    struct advance_state state = advancelist_find(list, time)->state;
    double motion = time + state.shift, motion_until = INFINITY;

    if (list->count == 1)
        return state;
    *until = fmin(*until, get_next_setting(list, time));
    state.half = get_half(list, motion, &motion_until);
    state.bend = advancelist_find(list, motion)->state.bend;
    motion_until = fmin(motion_until, get_next_setting(list, motion));
    *until = fmin(*until, motion_until - state.shift);
    return state;
}

/* ---- Changes ---- */

/* Forget settings that serve no segment from `needed` on any more. */
static void
prune(struct advance_list *list, double needed)
{
    struct advance_setting *s = list->settings;
    int n = 0;

    while (n + 1 < list->count
           && s[n + 1].print_time + get_reach(&s[n]) < needed)
        n++;
    if (list->count - n == ADVANCELIST_SIZE)
        n++;
    list->count -= n;
    memmove(s, s + n, (size_t)list->count * sizeof(*s));
}

int
advancelist_add(struct advance_list *list, double print_time,
                const struct advance_model *model, double needed)
{
    struct advance_setting *s = list->settings, *last, fresh;

    if (!isfinite(print_time) || !is_valid(model))
        return -EINVAL;
    fresh = make_setting(print_time, model);
    while (list->count > 1 && s[list->count - 1].print_time >= print_time)
        list->count--;
    prune(list, needed);
    last = &s[list->count - 1];
    if (last->advance != fresh.advance
        || !advancelist_is_same(&last->state, &fresh.state))
        s[list->count++] = fresh;
    return 0;
}

void
advancelist_get_scan(const struct advance_list *list, double *pre,
                     double *post)
{
    double half = 0., low = INFINITY, high = -INFINITY;

    for (int i = 0; i < list->count; i++) {
        const struct advance_state *state = &list->settings[i].state;
        half = fmax(half, state->half);
        low = fmin(low, state->shift);
        high = fmax(high, state->shift);
    }
    *pre = fmax(half - low, 0.);
    *post = fmax(half + high, 0.);
}

int
advancelist_check(const struct advance_list *list)
{
    const struct advance_setting *s = list->settings;

    if (list->count < 1 || list->count > ADVANCELIST_SIZE)
        return -20;
    for (int i = 2; i < list->count; i++)
        if (s[i].print_time <= s[i - 1].print_time)
            return -21;
    for (int i = 0; i < list->count; i++)
        if (s[i].advance < 0. || s[i].state.half < 0.
            || s[i].state.bend.offset < 0.)
            return -22;
    return 0;
}
