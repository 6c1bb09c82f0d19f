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
    DEV_I2C, DEV_USBFS, DEV_USB_MEMORY, DEV_OTG, DEV_CRS, DEV_BACKUP, DEV_CAN,
    DEV_FDCAN, DEV_FDCAN_RAM, DEV_SDIO,
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

/* What the chips of a maker have around the core. */
struct family {
    uint32_t flash_base;
    bool maps_flash;            /* itself, when the program has made it ready */
    uint8_t timer_vector;       /* whose interrupts run timers; 0: SysTick */
    void (*map)(uc_engine *uc); /* peripherals */
    void (*reset)(void);
    /* What a boot ROM does; NULL: stack and program by the table at `start` */
    void (*boot)(uint32_t start);
    void (*run_events)(void);
    uint64_t (*next_event)(void);
    /* Cycle at which the console's line is free; NEVER while it is off */
    uint64_t (*rx_free_at)(void);
    void (*rx)(uint8_t byte);
    int32_t (*find_pin)(const char *name);
};

struct chip_model {
    const char *name;
    const struct family *family;
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

/* What others have had to wait for, at most, since it was last cleared. */
struct delays {
    uint64_t off_cycles;        /* with interrupts off, outside of any */
    uint64_t irq_cycles;        /* in one interrupt, with entry */
    uint64_t min_timer, max_timer; /* instructions of a timer interrupt */
};

struct chip {
    const struct chip_model *model;
    uc_engine *uc;
    struct vmcu_host host;
    uint64_t cycle, base;       /* base: the world's clock at cycle 0 */
    uint64_t tick_mul, tick_div; /* ticks in so many cycles */
    bool is_counting;           /* the program has started its clock */
    bool is_broken, is_asleep, wants_reset, in_handler;
    bool wants_bootloader;
    uint32_t hse_hz, baud, start;
    uint8_t *flash, *ram;
    /* core */
    uint64_t stop_at;           /* cycle at which the loop looks around */
    bool check_irqs;            /* something enabled is pending */
    uint8_t pending[N_VECTORS], enabled[N_VECTORS], active[N_VECTORS];
    uint32_t n_pending;         /* of those enabled */
    uint8_t level[N_VECTORS];
    uint32_t n_levels;
    uint32_t mpu_ctrl, mpu_number, mpu_rbar[8], mpu_rasr[8];
    uint32_t vtor, systick_csr, systick_rvr, ccr, dwt_ctrl, demcr;
    uint64_t systick_due, systick_zero;
    uint64_t cyccnt_zero;       /* cycle at which the program's clock was 0 */
    /* peripherals */
    struct device devices[MAX_DEVICES];
    uint32_t n_devices;
    uint32_t pwm_told[MAX_PWM][3]; /* cycle, value, max */
    struct device *rcc, *flash_ctrl, *pwr, *syscfg, *console;
    uint32_t core_hz, bus_hz[3];
    /* statistics */
    uint64_t n_timer_irqs, n_instructions, n_irq_instructions;
    struct delays delays;
    uint64_t irq_begin, irq_first; /* cycle, and instructions before it */
    uint64_t off_since;         /* cycle; NEVER while interrupts are on */
    bool has_set_mask;          /* the last instruction, maybe */
};

extern struct chip chip;

/* The world's clock: ticks of the program's, a fraction of the cycles. */
static inline uint64_t chip_now(void)
{
    return chip.base + chip.cycle * chip.tick_mul / chip.tick_div;
}

void chip_fault(const char *format, ...)
    __attribute__((format(printf, 1, 2)));
/* Something will happen at `cycle`: look around then. */
void chip_wake_at(uint64_t cycle);
/* Flash can be read, at the family's address. */
void chip_map_flash(void);
/* Pins by letter and number, `per_port` of them a letter. */
int32_t chip_find_pin(const char *name, uint32_t per_port);

/* unicorn_core.c */
void core_reset(void);
void core_map(uc_engine *uc);
void core_set_pending(uint32_t vector, bool on);
/* The same for a line that interrupts again as long as it is on. */
void core_set_level(uint32_t vector, bool on);
bool core_has_irq(void);        /* one that can be taken now */
void core_take_irq(void);
bool core_end_irq(uint32_t pc); /* is pc the end of an exception? */
/* The instruction is about to run, for its effect on interrupts. */
void core_note_mask(uint16_t opcode);
void core_read_mask(void);      /* after chip.has_set_mask */
/* Does the processor cache this part of its memory? */
bool core_is_cached(uint32_t address);
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
extern const struct family stm32_family;

/* Chips of other families; each table ends without a name. */
extern const struct chip_model lpc176x_models[], rp2040_models[];
extern const struct chip_model sam_models[], samd_models[];

#endif
