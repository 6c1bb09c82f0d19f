/* SPDX-License-Identifier: GPL-3.0-or-later
 * Which I2C peripheral has which pins. */
#include "board/timer.h"
#include "chip.h"
#include "core/sched.h"
#include "i2c_buses.h"
#include "i2c_pins.h"

static const struct {
    uint8_t number, scl, sda, function;
} buses[] = {
#define X(NUMBER, SCL, SDA, FUNCTION) { NUMBER, SCL, SDA, FUNCTION },
    I2C_BUSES
#undef X
};
#define N_BUSES (sizeof(buses) / sizeof(buses[0]))

static const struct {
    i2c_regs_t *regs;
    uint16_t gate;
} units[] = {
    { (i2c_regs_t *)I2C1_BASE, I2C1_GATE },
    { (i2c_regs_t *)I2C2_BASE, I2C2_GATE },
#ifdef I2C3_BASE
    { (i2c_regs_t *)I2C3_BASE, I2C3_GATE },
#endif
};

i2c_regs_t *i2c_open(uint32_t bus)
{
    uint8_t function;

    if (bus >= N_BUSES || !buses[bus].number)
        shutdown("Unsupported i2c bus");
    function = buses[bus].function;
#if CONFIG_MACH_STM32F1
    if (buses[bus].number == 1)
        gpio_remap(2, function);
#endif
    chip_enable(units[buses[bus].number - 1].gate);
    gpio_alternate(buses[bus].scl, function | GPIO_OPEN_DRAIN, 1);
    gpio_alternate(buses[bus].sda, function | GPIO_OPEN_DRAIN, 1);
    return units[buses[bus].number - 1].regs;
}

bool i2c_wait_for(volatile uint32_t *reg, uint32_t bits)
{
    uint32_t start = timer_read_clock();
    uint32_t limit = timer_from_us(I2C_BYTE_TIMEOUT_US);

    while (!(*reg & bits))
        if (timer_read_clock() - start > limit)
            return !!(*reg & bits);
    return true;
}
