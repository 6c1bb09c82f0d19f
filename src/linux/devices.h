/* SPDX-License-Identifier: GPL-3.0-or-later
 * What the port needs of the world, one small interface a peripheral, each with
 * two implementations: this computer's devices, and a fake board.
 *
 * Functions return 0 or more, or a negative errno; a failed open() has said
 * on stderr what is wrong.  Handles are small numbers of the implementation.
 */
#ifndef LINUX_DEVICES_H
#define LINUX_DEVICES_H

#include <stdbool.h>
#include <stdint.h>

struct gpio_setting {
    bool is_output;
    uint8_t level;  /* of an output */
    int8_t pull;    /* of an input: -1, 0, 1 */
};

struct gpio_device {
    int (*open)(uint32_t chip, uint32_t line, const struct gpio_setting *set);
    int (*configure)(int handle, const struct gpio_setting *set);
    int (*write)(int handle, uint8_t level);
    int (*read)(int handle);
};

struct pwm_device {
    int (*open)(uint32_t chip, uint32_t channel);
    int (*set_cycle)(int handle, uint64_t cycle_ns, uint64_t on_ns);
    int (*set_on)(int handle, uint64_t on_ns);
};

struct adc_device {
    int (*open)(uint32_t input);
    uint32_t (*sample)(int handle); /* as adc_sample() of board/adc.h */
    int (*read)(int handle);        /* 0..4095 */
    void (*cancel)(int handle);
};

struct spi_device {
    int (*open)(uint32_t bus, uint32_t select);
    int (*set_mode)(int handle, uint8_t mode);
    int (*transfer)(int handle, uint32_t rate, const uint8_t *tx, uint8_t *rx,
                    uint8_t len); /* rx may be NULL or tx */
};

struct i2c_device {
    int (*open)(uint32_t bus);
    int (*transfer)(int handle, uint8_t addr, uint8_t write_len,
                    const uint8_t *write, uint8_t read_len, uint8_t *read);
};

struct devices {
    const struct gpio_device *gpio;
    const struct pwm_device *pwm;
    const struct adc_device *adc;
    const struct spi_device *spi;
    const struct i2c_device *i2c;
};

extern struct devices devices;

extern const struct gpio_device gpio_chardev;
extern const struct pwm_device pwm_sysfs;
extern const struct adc_device adc_iio;
extern const struct spi_device spi_dev;
extern const struct i2c_device i2c_dev;
extern const struct devices fake_devices;

/* Choose as the options say; 0, or -1 after a message. */
int devices_open(void);

/* fake.c: map the fake board's state. */
int fake_open(const char *folder);

#endif
