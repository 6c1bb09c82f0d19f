/* SPDX-License-Identifier: GPL-3.0-or-later
 * Digital pins: lines of gpio chips. */
#include "board/gpio.h"
#include "core/sched.h"
#include "devices.h"
#include "pins.h"

DECL_ENUMERATION_RANGE("pin", "gpio0", PINS_GPIO(0), PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip0/gpio0", PINS_GPIO(0),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip1/gpio0", PINS_GPIO(1),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip2/gpio0", PINS_GPIO(2),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip3/gpio0", PINS_GPIO(3),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip4/gpio0", PINS_GPIO(4),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip5/gpio0", PINS_GPIO(5),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip6/gpio0", PINS_GPIO(6),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip7/gpio0", PINS_GPIO(7),
                       PINS_GPIO_LINES);
DECL_ENUMERATION_RANGE("pin", "gpiochip8/gpio0", PINS_GPIO(8),
                       PINS_GPIO_LINES);

enum { LINES_MAX = 256 };

struct gpio_line {
    uint32_t pin;
    int handle;
    bool is_open, is_output;
    uint8_t level;
};

static struct gpio_line lines[LINES_MAX];
static uint32_t line_count;

/* The line of a pin, whether or not it was in use before; NULL: none. */
static struct gpio_line *find_line(uint32_t pin)
{
    if (pin >= PINS_GPIO(PINS_GPIO_CHIPS))
        return NULL;
    for (uint32_t i = 0; i < line_count; i++)
        if (lines[i].pin == pin)
            return &lines[i];
    if (line_count >= LINES_MAX)
        return NULL;
    lines[line_count].pin = pin;
    return &lines[line_count++];
}

static bool configure(struct gpio_line *line, const struct gpio_setting *set)
{
    int result;

    if (line->is_open) {
        result = devices.gpio->configure(line->handle, set);
    } else {
        result = devices.gpio->open(line->pin / PINS_GPIO_LINES,
                                    line->pin % PINS_GPIO_LINES, set);
        line->handle = result;
        line->is_open = result >= 0;
    }
    line->is_output = set->is_output;
    line->level = set->level;
    return result >= 0;
}


/* ---- Outputs ---- */

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    struct gpio_setting set = { .is_output = true, .level = !!level };
    struct gpio_out out = { find_line(pin) };

    if (!out.line || !configure(out.line, &set))
        shutdown("Not an output pin");
    return out;
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    struct gpio_setting set = { .is_output = true, .level = !!level };

    if (out.line->is_output)
        gpio_write(out, level);
    else if (!configure(out.line, &set))
        try_shutdown("Gpio cannot be driven");
}

void gpio_toggle_irq(struct gpio_out out)
{
    struct gpio_line *line = out.line;

    line->level = !line->level;
    if (devices.gpio->write(line->handle, line->level) < 0)
        try_shutdown("Gpio write failed");
}

void gpio_toggle(struct gpio_out out)
{
    gpio_toggle_irq(out);
}

void gpio_write(struct gpio_out out, uint8_t level)
{
    if (out.line->level != !!level)
        gpio_toggle_irq(out);
}


/* ---- Inputs ---- */

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    struct gpio_setting set = { .pull = pull };
    struct gpio_in in = { find_line(pin) };

    if (!in.line || pull < -1 || pull > 1 || !configure(in.line, &set))
        shutdown("Not a valid input pin");
    return in;
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    struct gpio_setting set = { .pull = pull };

    if (!configure(in.line, &set))
        try_shutdown("Gpio cannot be an input");
}

uint8_t gpio_read(struct gpio_in in)
{
    int level;

    if (in.line->is_output)
        return in.line->level;
    level = devices.gpio->read(in.line->handle);
    if (level < 0)
        try_shutdown("Gpio read failed");
    return level > 0;
}
