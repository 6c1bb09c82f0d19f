/* SPDX-License-Identifier: GPL-3.0-or-later
 * Pins that must have a level from the very start (CONFIG_INITIAL_PINS). */
#include "board/gpio.h"
#include "core/decl.h"
#include "core/tables.h"

DECL_INITIAL_PINS(CONFIG_INITIAL_PINS);

void initial_pins_setup(void)
{
    for (uint8_t i = 0; i < tables_initial_pin_count; i++)
        gpio_setup_output(tables_initial_pins[i].pin,
                          tables_initial_pins[i].level);
}
DECL_INIT(initial_pins_setup);
