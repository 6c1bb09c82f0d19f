/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * An emulated SAM D21, C21 or D5x: what its blocks know of each other.
 */
#ifndef UNICORN_SAMD_H
#define UNICORN_SAMD_H

#include "unicorn_chip.h"

enum samd_line { SAMD21, SAMC21, SAMD51 };
enum samd_kind {
    SAMD_GATES, SAMD_GCLK, SAMD_OSC, SAMD_OSC32K, SAMD_WDT, SAMD_NVM, SAMD_PORT,
    SAMD_SERCOM, SAMD_TC, SAMD_TCC, SAMD_ADC, SAMD_USB, SAMD_CAN,
    SAMD_PLAIN,
};
enum { SAMD_REGS = 0x200, SAMD_PINS = 128, SAMD_DEVICES = 24 };

struct samd_info {
    uint32_t base;
    uint8_t kind, index, irq;
    uint8_t gate_offset, gate_bit;  /* of the bus interface; 0, 0: always on */
    int8_t channel;                 /* of the clock; -1: none */
};

/* A block: its registers as bytes, and what the model of some adds */
struct samd_device {
    const struct samd_info *info;
    uint8_t regs[SAMD_REGS];
    uint64_t due, next_rx;
    uint8_t inten, rx[2], n_rx, shift, wr[256], rd[64];
    uint32_t n_written, n_read;
    bool is_shifting, has_next, is_reading, is_open, is_latched;
    uint8_t next;
    uint32_t latch;
};

struct samd_state {
    enum samd_line line;
    struct samd_device devices[SAMD_DEVICES];
    uint32_t n_devices;
    struct samd_device *gates, *gclk, *osc, *osc32k, *nvm, *port, *usb;
    struct samd_device *console;
    uint8_t feeds[64];          /* generator + 1 of a clock channel */
    uint32_t gen_src[16], gen_div[16];
    uint64_t pll_ready[2], xosc_ready;
    uint32_t out[4], told_out[4], told_driven[4];
    uint32_t pwm_told[3][4][3];
};
extern struct samd_state samd;

uint32_t samd_get(const struct samd_device *d, uint32_t offset, uint32_t size);
void samd_put(struct samd_device *d, uint32_t offset, uint32_t size,
              uint32_t value);
/* What a clock channel gets; a fault if it gets nothing. */
uint32_t samd_feed_hz(const struct samd_device *d);
/* The function of a pin (A is 0), -1 without. */
int samd_mux_of(uint32_t pin);

/* unicorn_samd_io.c */
uint32_t samd_sercom_read(struct samd_device *d, uint32_t offset,
                          uint32_t size);
void samd_sercom_write(struct samd_device *d, uint32_t offset, uint32_t size,
                       uint32_t value);
void samd_sercom_event(struct samd_device *d);
void samd_usart_rx(struct samd_device *d, uint8_t byte);
void samd_adc_write(struct samd_device *d, uint32_t offset, uint32_t size,
                    uint32_t value);
void samd_adc_event(struct samd_device *d);
void samd_tcc_update(struct samd_device *d);

/* unicorn_samd_usb.c */
void samd_usb_write(struct samd_device *d, uint32_t offset, uint32_t size,
                    uint32_t value);
void samd_usb_start(void);
bool samd_usb_is_on(void);

/* unicorn_samd_can.c */
void samd_can_reset(struct samd_device *d);
uint32_t samd_can_read(struct samd_device *d, uint32_t offset, uint32_t size);
void samd_can_write(struct samd_device *d, uint32_t offset, uint32_t size,
                    uint32_t value);

#endif
