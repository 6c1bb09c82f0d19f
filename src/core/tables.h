/* SPDX-License-Identifier: GPL-3.0-or-later
 * What scripts/build_commands.py generates from all declarations.
 */
#ifndef CORE_TABLES_H
#define CORE_TABLES_H

#include <stdint.h>
#include "board/mem.h"

void tables_run_inits(void);
void tables_run_tasks(void);
void tables_run_shutdowns(void);

typedef void command_handler(const void *args);

struct command_entry {
    command_handler *handler; /* NULL: this number is no command */
    uint16_t buffers;         /* bit n: parameter n is a byte string */
    uint8_t n_params;
    uint8_t flags;
};

/* A port may build the tables once for each of its cores. */
#ifndef TABLES_HANDLER
#define TABLES_HANDLER(FUNC) ((command_handler *)(void (*)(void))FUNC)
#define TABLES_FLAGS(FLAGS) (FLAGS)
#define TABLES_CALL(FUNC) FUNC()
#endif

extern const ROM struct command_entry tables_commands[];
extern const uint16_t tables_command_count;

/* Messages to the host by number, for a port one of whose cores encodes what
 * another has to say.  Of commands nothing is said. */
struct message_entry {
    uint16_t buffers; /* bit n: parameter n is a byte string */
    uint8_t n_params;
};

extern const ROM struct message_entry tables_messages[];

/* The compressed dictionary. */
extern const ROM uint8_t tables_dictionary[];
extern const uint32_t tables_dictionary_size;

struct initial_pin {
    uint32_t pin;
    uint8_t level;
};

extern const ROM struct initial_pin tables_initial_pins[];
extern const uint8_t tables_initial_pin_count;

#endif
