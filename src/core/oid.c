/* SPDX-License-Identifier: GPL-3.0-or-later
 * Objects by number, and the life of a configuration. */
#include <stdbool.h>
#include <stddef.h>

#include "core/arena.h"
#include "core/oid.h"
#include "core/sched.h"

struct oid_entry {
    const ROM struct oid_kind *kind;
    void *object;
};

static struct oid_entry *oid_table;
static uint8_t oid_count;
static bool is_finalized;
static uint32_t config_crc;

void *oid_new(uint8_t oid, const ROM struct oid_kind *kind)
{
    struct oid_entry *entry;

    if (is_finalized)
        shutdown("Already finalized");
    if (oid >= oid_count || oid_table[oid].kind)
        shutdown("Can't assign oid");
    entry = &oid_table[oid];
    entry->object = arena_alloc(kind->size);
    entry->kind = kind;
    return entry->object;
}

void *oid_lookup(uint8_t oid, const ROM struct oid_kind *kind)
{
    if (oid >= oid_count || oid_table[oid].kind != kind)
        shutdown("Invalid oid type");
    return oid_table[oid].object;
}

void *oid_next(int16_t *oid, const ROM struct oid_kind *kind)
{
    uint16_t i = (uint16_t)(*oid + 1);

    while (i < oid_count && oid_table[i].kind != kind)
        i++;
    *oid = (int16_t)i;
    return i < oid_count ? oid_table[i].object : NULL;
}

void command_allocate_oids(const struct args_allocate_oids *args)
{
    if (oid_table)
        shutdown("oids already allocated");
    oid_table = arena_alloc((uint16_t)(args->count * sizeof(*oid_table)));
    oid_count = args->count;
}
DECL_COMMAND(command_allocate_oids, "allocate_oids count=%c");

void command_get_config(const struct args_get_config *args)
{
    (void)args;
    sendf("config is_config=%c crc=%u is_shutdown=%c move_count=%hu",
          is_finalized, config_crc, sched_is_shutdown(), movecell_count());
}
DECL_COMMAND_FLAGS(command_get_config, COMMAND_IN_SHUTDOWN, "get_config");

void command_finalize_config(const struct args_finalize_config *args)
{
    if (!oid_table || is_finalized)
        shutdown("Can't finalize");
    arena_finalize();
    config_crc = args->crc;
    is_finalized = true;
}
DECL_COMMAND(command_finalize_config, "finalize_config crc=%u");

#if CONFIG_HAVE_CONFIG_RESET
/* For mcus whose reset would end the process: forget the configuration. */
void command_config_reset(const struct args_config_reset *args)
{
    (void)args;
    if (!sched_is_shutdown())
        shutdown("config_reset only available when shutdown");
    oid_table = NULL;
    oid_count = 0;
    config_crc = 0;
    is_finalized = false;
    arena_reset();
}
DECL_COMMAND_FLAGS(command_config_reset, COMMAND_IN_SHUTDOWN,
                   "config_reset");
#endif
