/* SPDX-License-Identifier: GPL-3.0-or-later
 * Digital filter of second order sections. */
#include "core/arena.h"
#include "core/oid.h"
#include "core/sched.h"
#include "sensors/sos_filter.h"

enum { B0, B1, B2, A1, A2, COEFF_COUNT };

struct sos_section {
    int32_t coeff[COEFF_COUNT];
    int32_t state[2];
};

struct sos_filter {
    int32_t offset, scale;
    uint8_t scale_frac_bits, coeff_frac_bits;
    bool takes_offset;     /* from the next reading */
    uint8_t n_sections, max_sections;
    struct sos_section *sections;
};

static const ROM struct oid_kind sos_filter_kind = {
    sizeof(struct sos_filter)
};

struct sos_filter *sos_filter_lookup(uint8_t oid)
{
    return oid_lookup(oid, &sos_filter_kind);
}


/* ---- Arithmetic ---- */

static bool fits(int64_t value)
{
    return value >= INT32_MIN && value <= INT32_MAX;
}

/* A product of a fixed point number, rounded to the nearest. */
static int64_t multiply(int32_t fixed, int32_t value, uint8_t frac_bits)
{
    int64_t product = (int64_t)fixed * value;

    if (frac_bits)
        product += INT64_C(1) << (frac_bits - 1);
    return product >> frac_bits;
}

static bool apply_section(struct sos_section *s, uint8_t frac_bits,
                          int32_t *value)
{
    int32_t x = *value, y;
    int64_t sum = multiply(s->coeff[B0], x, frac_bits) + s->state[0];

    if (!fits(sum))
        return false;
    y = (int32_t)sum;
    sum = multiply(s->coeff[B1], x, frac_bits)
          - multiply(s->coeff[A1], y, frac_bits) + s->state[1];
    if (!fits(sum))
        return false;
    s->state[0] = (int32_t)sum;
    sum = multiply(s->coeff[B2], x, frac_bits)
          - multiply(s->coeff[A2], y, frac_bits);
    if (!fits(sum))
        return false;
    s->state[1] = (int32_t)sum;
    *value = y;
    return true;
}

bool sos_filter_apply(struct sos_filter *filter, int32_t *value)
{
    int64_t wide;

    if (filter->takes_offset) {
        if (*value == INT32_MIN)
            return false;
        filter->offset = -*value;
        filter->takes_offset = false;
    }
    wide = (int64_t)*value + filter->offset;
    if (!fits(wide))
        return false;
    wide = multiply(filter->scale, (int32_t)wide, filter->scale_frac_bits);
    if (!fits(wide))
        return false;
    *value = (int32_t)wide;
    for (uint8_t i = 0; i < filter->n_sections; i++)
        if (!apply_section(&filter->sections[i], filter->coeff_frac_bits,
                           value))
            return false;
    return true;
}


/* ---- Commands ---- */

void command_config_sos_filter(const struct args_config_sos_filter *args)
{
    struct sos_filter *f = oid_new(args->oid, &sos_filter_kind);

    f->max_sections = args->max_sections;
    f->sections = arena_alloc(
        (uint16_t)(args->max_sections * sizeof(*f->sections)));
    f->scale = 1;
}
DECL_COMMAND(command_config_sos_filter,
             "config_sos_filter oid=%c max_sections=%c");

static struct sos_section *lookup_section(uint8_t oid, uint8_t index)
{
    struct sos_filter *f = sos_filter_lookup(oid);

    if (index >= f->max_sections)
        shutdown("Filter section index larger than max_sections");
    return &f->sections[index];
}

void command_sos_filter_set_section(
    const struct args_sos_filter_set_section *args)
{
    struct sos_section *s = lookup_section(args->oid, args->section_idx);

    s->coeff[B0] = args->sos0;
    s->coeff[B1] = args->sos1;
    s->coeff[B2] = args->sos2;
    s->coeff[A1] = args->sos3;
    s->coeff[A2] = args->sos4;
}
DECL_COMMAND(command_sos_filter_set_section,
             "sos_filter_set_section oid=%c section_idx=%c sos0=%i sos1=%i"
             " sos2=%i sos3=%i sos4=%i");

void command_sos_filter_set_state(const struct args_sos_filter_set_state *args)
{
    struct sos_section *s = lookup_section(args->oid, args->section_idx);

    s->state[0] = args->state0;
    s->state[1] = args->state1;
}
DECL_COMMAND(command_sos_filter_set_state,
             "sos_filter_set_state oid=%c section_idx=%c state0=%i"
             " state1=%i");

static void check_frac_bits(uint8_t frac_bits)
{
    if (frac_bits > 31)
        shutdown("Invalid filter fraction bits");
}

/* The offset is added; with auto_offset the next reading becomes zero. */
void command_sos_filter_set_offset_scale(
    const struct args_sos_filter_set_offset_scale *args)
{
    struct sos_filter *f = sos_filter_lookup(args->oid);

    check_frac_bits(args->scale_frac_bits);
    f->offset = args->offset;
    f->scale = args->scale;
    f->scale_frac_bits = args->scale_frac_bits;
    f->takes_offset = args->auto_offset != 0;
}
DECL_COMMAND(command_sos_filter_set_offset_scale,
             "sos_filter_set_offset_scale oid=%c offset=%i scale=%i"
             " scale_frac_bits=%c auto_offset=%c");

void command_sos_filter_set_active(
    const struct args_sos_filter_set_active *args)
{
    struct sos_filter *f = sos_filter_lookup(args->oid);

    check_frac_bits(args->coeff_frac_bits);
    if (args->n_sections > f->max_sections)
        shutdown("Filter section index larger than max_sections");
    f->n_sections = args->n_sections;
    f->coeff_frac_bits = args->coeff_frac_bits;
}
DECL_COMMAND(command_sos_filter_set_active,
             "sos_filter_set_active oid=%c n_sections=%c coeff_frac_bits=%c");
