/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An emulated Cortex-M chip: what its parts know of each other.
 *
 * Unicorn executes instructions; everything else is modelled here: exceptions
 * (unicorn_core.c), clocks (unicorn_rcc.c), peripherals (unicorn_periph.c).
 * One instruction takes one cycle.  What a real chip would not do (a register
 * of a peripheral without a clock, a frequency beyond its limits, too few wait
 * states) is a fault: it is reported, and the chip stands still.
 */
#ifndef UNICORN_CHIP_H
#define UNICORN_CHIP_H

#include <stdbool.h>
#include <stdint.h>

#include <unicorn/unicorn.h>

#include "vmcu_abi.h"

enum { MAX_REGS = 224, MAX_DEVICES = 64, N_IRQS = 160, N_VECTORS = 16 + N_IRQS,
       N_PINS = 11 * 16, VECTOR_SYSTICK = 15 };
#define NEVER UINT64_MAX

enum device_kind {
    DEV_GPIO, DEV_USART, DEV_ADC, DEV_ADC_COMMON, DEV_TIM, DEV_RCC, DEV_FLASH,
    DEV_PWR, DEV_IWDG, DEV_AFIO, DEV_SYSCFG, DEV_SPI,
    DEV_I2C,
};

/* A peripheral: where it is, what clocks it. */
struct device_info {
    uint32_t base;
    uint8_t kind, index, irq;
    uint8_t bus;                /* 1, 2: of the APBs; 0: core */
    uint16_t gate_offset;       /* in RCC; 0: always on */
    uint8_t gate_bit;
};

struct device {
    const struct device_info *info;
    uint32_t regs[MAX_REGS];
    uint64_t due;               /* cycle of its next event, or NEVER */
    /* usart */
    uint32_t rx_data, shift;
    uint64_t next_rx;
    uint64_t zero;              /* timer: cycle at which it was 0 */
    bool has_tdr;
    /* gpio: what the world was told, and whether */
    uint32_t out, driven;
};

/* A pin that a timer's channel can drive. */
struct pwm_info {
    uint8_t pin, timer, channel, function;
};
enum { MAX_PWM = 8 };

enum line { LINE_F1, LINE_F2F4F7, LINE_F0, LINE_G0, LINE_G4, LINE_L4,
            LINE_H7 };

struct chip_model {
    const char *name;
    int cpu;                    /* of Unicorn */
    enum line line;
    uint32_t flash_size, ram_base, ram_size, max_hz, hsi_hz;
    bool gpio_v2, usart_v2;
    uint8_t adc_version;
    uint8_t clock_timer;        /* that the program counts with; 0: DWT */
    const struct device_info *devices;
    /* channel of the converter of a pin; -1 none */
    int (*adc_pin)(uint8_t unit, uint8_t channel);
    const struct pwm_info *pwm; /* ends with timer 0 */
};

const struct chip_model *unicorn_find_model(const char *name);

struct chip {
    const struct chip_model *model;
    uc_engine *uc;
    struct vmcu_host host;
    uint64_t cycle, base;       /* base: the world's clock at cycle 0 */
    bool is_counting;           /* the program has started its clock */
    bool is_broken, is_asleep, wants_reset, in_handler;
    uint32_t hse_hz, baud;
    uint8_t *flash, *ram;
    /* core */
    uint64_t stop_at;           /* cycle at which the loop looks around */
    bool check_irqs;            /* something enabled is pending */
    uint8_t pending[N_VECTORS], enabled[N_VECTORS], active[N_VECTORS];
    uint32_t n_pending;         /* of those enabled */
    uint32_t vtor, systick_csr, systick_rvr, ccr, dwt_ctrl, demcr;
    uint64_t systick_due, systick_zero, cyccnt_zero;
    /* peripherals */
    struct device devices[MAX_DEVICES];
    uint32_t n_devices;
    uint32_t pwm_told[MAX_PWM][3]; /* cycle, value, max */
    struct device *rcc, *flash_ctrl, *pwr, *syscfg, *console;
    uint32_t core_hz, bus_hz[3];
    /* statistics */
    uint64_t n_timer_irqs, n_instructions, n_irq_instructions;
};

extern struct chip chip;

/* The world's clock. */
static inline uint64_t chip_now(void)
{
    return chip.base + chip.cycle;
}

void chip_fault(const char *format, ...)
    __attribute__((format(printf, 1, 2)));
/* Something will happen at `cycle`: look around then. */
void chip_wake_at(uint64_t cycle);

/* unicorn_core.c */
void core_reset(void);
void core_map(uc_engine *uc);
void core_set_pending(uint32_t vector, bool on);
bool core_has_irq(void);        /* one that can be taken now */
void core_take_irq(void);
bool core_end_irq(uint32_t pc); /* is pc the end of an exception? */
void core_run_events(void);
uint64_t core_next_event(void);

/* unicorn_rcc.c */
uint32_t rcc_read(struct device *d, uint32_t offset);
void rcc_write(struct device *d, uint32_t offset, uint32_t value);
bool rcc_has_clock(const struct device *d);
void rcc_reset(struct device *d);

/* unicorn_adc.c */
uint32_t adc_read(struct device *d, uint32_t word);
void adc_write(struct device *d, uint32_t word, uint32_t value);
void adc_run_event(struct device *d);

/* unicorn_spi.c */
uint32_t spi_read(struct device *d, uint32_t word);
void spi_write(struct device *d, uint32_t word, uint32_t value);
void spi_run_event(struct device *d);

/* unicorn_i2c.c */
uint32_t i2c_read(struct device *d, uint32_t word);
void i2c_write(struct device *d, uint32_t word, uint32_t value);

/* unicorn_timer.c */
uint32_t timer_read(struct device *d, uint32_t word);
void timer_write(struct device *d, uint32_t word, uint32_t value);
/* Registers of a timer or a pin have changed. */
void timer_update_pwm(void);

/* unicorn_periph.c */
/* 0 input, 1 output, 2 alternate, 3 analog; and the pull of an input. */
uint32_t gpio_mode_of(const struct device *d, uint32_t bit, int8_t *pull);
void periph_reset(void);
void periph_map(uc_engine *uc);
void periph_run_events(void);
uint64_t periph_next_event(void);
void periph_rx(uint8_t byte);   /* the console's line starts a byte now */
bool periph_rx_busy(void);

#endif
