/* SPDX-License-Identifier: GPL-3.0-or-later
 * A board for tests. */
#include <string.h>
#include <ucontext.h>

#include "board/adc.h"
#include "board/console.h"
#include "board/gpio.h"
#include "board/i2c.h"
#include "board/irq.h"
#include "board/mem.h"
#include "board/pwm.h"
#include "board/reset.h"
#include "board/spi.h"
#include "board/timer.h"
#include "core/sched.h"
#include "fakeboard.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__clang__)
#include <sanitizer/common_interface_defs.h>
#define SWITCH_START __sanitizer_start_switch_fiber
#define SWITCH_FINISH __sanitizer_finish_switch_fiber
#else
#define SWITCH_START(SAVE, BOTTOM, SIZE) \
    ((void)(BOTTOM), (void)(SIZE), *(SAVE) = NULL)
#define SWITCH_FINISH(SAVE, BOTTOM, SIZE) \
    ((void)(SAVE), (void)(BOTTOM), (void)(SIZE))
#endif

DECL_ENUMERATION_RANGE("pin", "gpio0", 0, 256);
DECL_CONSTANT("ADC_MAX", 4095);
DECL_CONSTANT("PWM_MAX", 255);
DECL_CONSTANT("RECEIVE_WINDOW", 240);

struct fakeboard fake;


/* ---- The firmware as a coroutine ---- */

static ucontext_t test_side, firmware_side;
static uint8_t firmware_stack[1 << 18];
static const void *test_stack;
static size_t test_stack_size;

static void run_firmware(void)
{
    SWITCH_FINISH(NULL, &test_stack, &test_stack_size);
    sched_main();
}

static void leave_firmware(void)
{
    void *fiber;

    SWITCH_START(&fiber, test_stack, test_stack_size);
    swapcontext(&firmware_side, &test_side);
    SWITCH_FINISH(fiber, &test_stack, &test_stack_size);
}

static void enter_firmware(void)
{
    void *fiber;

    if (!firmware_side.uc_stack.ss_sp) {
        getcontext(&firmware_side);
        firmware_side.uc_stack.ss_sp = firmware_stack;
        firmware_side.uc_stack.ss_size = sizeof(firmware_stack);
        makecontext(&firmware_side, run_firmware, 0);
    }
    SWITCH_START(&fiber, firmware_stack, sizeof(firmware_stack));
    swapcontext(&test_side, &firmware_side);
    SWITCH_FINISH(fiber, NULL, NULL);
}


/* ---- Time ---- */

static void run_first_timer(void)
{
    if (timer_is_before(fake.clock, fake.timer))
        fake.clock = fake.timer;
    else if (fake.clock - fake.timer > CONFIG_CLOCK_FREQ / 1000)
        sched_shutdown_late();
    if (fake.events_left)
        fake.events_left--;
    fake.in_irq = true;
    fake.timer = sched_run_timer();
    fake.in_irq = false;
}

static void pass_point(void)
{
    if (fake.in_irq || ++fake.points != fake.inject_at)
        return;
    fake.irqs_off = true;
    run_first_timer();
    fake.irqs_off = false;
}

/* What the contracts of src/board call "irqs off". */
static void require_irqs_off(void)
{
    if (!fake.irqs_off)
        __builtin_trap();
}

void fake_note_access(void)
{
    if (!fake.irqs_off)
        pass_point();
}

void irq_disable(void)
{
    fake.irqs_off = true;
}

void irq_enable(void)
{
    fake.irqs_off = fake.in_irq = false;
    pass_point();
}

irq_flag_t irq_save(void)
{
    irq_flag_t flag = fake.irqs_off;

    fake.irqs_off = true;
    return flag;
}

void irq_restore(irq_flag_t flag)
{
    fake.irqs_off = flag;
    if (!flag)
        pass_point();
}

/* No task leaves interrupts off. */
void irq_poll(void)
{
    if (fake.irqs_off)
        __builtin_trap();
}

void irq_wait(void)
{
    require_irqs_off();
    if (fake.feed && fake.feed()) {
        console_note_rx();
        return;
    }
    if (!fake.events_left || timer_is_before(fake.run_until, fake.timer))
        leave_firmware();
    else
        run_first_timer();
}

uint32_t timer_read_clock(void)
{
    return fake.clock;
}

uint32_t timer_from_us(uint32_t us)
{
    return us * (CONFIG_CLOCK_FREQ / 1000000);
}

/* Interrupts strike at the points only. */
void fake_delay(uint32_t ticks)
{
    fake.clock += ticks;
}

void timer_kick(uint32_t clock)
{
    require_irqs_off();
    fake.timer = clock;
}

void fake_run(uint32_t until, uint32_t max_events)
{
    fake.run_until = until;
    fake.events_left = max_events;
    fake.in_irq = false;
    if (fake.rx_len)
        console_note_rx();
    enter_firmware();
}


/* ---- Console ---- */

bool fake_receive(const uint8_t *data, size_t len)
{
    if (len > (size_t)(FAKE_RX_SIZE - fake.rx_len))
        return false;
    memcpy(fake.rx + fake.rx_len, data, len);
    fake.rx_len = (uint8_t)(fake.rx_len + len);
    return true;
}

static uint16_t calc_crc(const uint8_t *data, size_t len)
{
    unsigned crc = 0xffff;

    while (len--) {
        crc ^= *data++;
        for (int bit = 0; bit < 8; bit++)
            crc = crc & 1 ? (crc >> 1) ^ 0x8408 : crc >> 1;
    }
    return (uint16_t)crc;
}

void fake_put_trailer(uint8_t *block, size_t len)
{
    uint16_t crc = calc_crc(block, len);

    block[len] = (uint8_t)(crc >> 8);
    block[len + 1] = (uint8_t)crc;
    block[len + 2] = 0x7e;
}

bool fake_send(const uint8_t *payload, size_t len)
{
    uint8_t block[CONSOLE_BLOCK_MAX];

    block[0] = (uint8_t)(len + 5);
    block[1] = (uint8_t)(0x10 | fake.next_seq);
    memcpy(block + 2, payload, len);
    fake_put_trailer(block, len + 2);
    fake.next_seq = (fake.next_seq + 1) & 15;
    return fake_receive(block, len + 5);
}

uint8_t console_peek(const uint8_t **data)
{
    *data = fake.rx;
    return fake.rx_len;
}

void console_consume(uint8_t len)
{
    fake.rx_len = (uint8_t)(fake.rx_len - len);
    memmove(fake.rx, fake.rx + len, fake.rx_len);
}

enum { BLOCK_MIN = 5 };

static uint8_t tx[CONSOLE_BLOCK_MAX];

uint8_t *console_reserve(uint8_t len)
{
    return len <= sizeof(tx) ? tx : NULL;
}

void console_commit(uint8_t len)
{
    uint16_t crc = calc_crc(tx, (size_t)len - 3);

    if (tx[0] != len || tx[len - 3] != crc >> 8 || tx[len - 2] != (crc & 255))
        __builtin_trap();
    fake.next_seq = tx[1] & 15;
    fake.n_blocks++;
    if (fake.note_message && len > BLOCK_MIN)
        fake.note_message(tx + 2, (uint8_t)(len - BLOCK_MIN));
}


/* ---- Pins ---- */

static void set_level(uint8_t pin, uint8_t level)
{
    struct fake_edge edge = { fake.clock, pin, level };

    fake.levels[pin] = level;
    if (fake.n_edges < FAKE_MAX_EDGES)
        fake.edges[fake.n_edges++] = edge;
}

struct gpio_out gpio_setup_output(uint32_t pin, uint8_t level)
{
    if (pin > 255)
        shutdown("Not an output pin");
    set_level((uint8_t)pin, level);
    return (struct gpio_out){ (uint8_t)pin };
}

void gpio_write(struct gpio_out out, uint8_t level)
{
    if (fake.levels[out.pin] != level)
        set_level(out.pin, level);
}

void gpio_drive(struct gpio_out out, uint8_t level)
{
    set_level(out.pin, level);
}

void gpio_float(struct gpio_in in, int8_t pull)
{
    fake.inputs[in.pin] = pull > 0;
}

void gpio_toggle_irq(struct gpio_out out)
{
    require_irqs_off();
    set_level(out.pin, !fake.levels[out.pin]);
}

struct gpio_in gpio_setup_input(uint32_t pin, int8_t pull)
{
    if (pin > 255 || pull < -1 || pull > 1)
        shutdown("Not a valid input pin");
    return (struct gpio_in){ (uint8_t)pin };
}

uint8_t gpio_read(struct gpio_in in)
{
    return fake.inputs[in.pin];
}

struct gpio_adc adc_setup(uint32_t pin)
{
    if (pin > 255)
        shutdown("Not a valid ADC pin");
    return (struct gpio_adc){ (uint8_t)pin };
}

enum { ADC_BUSY_TICKS = 200 };

/* Busy every other time, as a converter that others use too; nobody is to ask
 * again too early (by the time of his timer, for he may be late). */
uint32_t adc_sample(struct gpio_adc adc)
{
    (void)adc;
    if (fake.is_adc_busy && timer_is_before(fake.timer, fake.adc_ready))
        __builtin_trap();
    fake.is_adc_busy = ++fake.n_samples & 1;
    fake.adc_ready = fake.timer + ADC_BUSY_TICKS;
    return fake.is_adc_busy ? ADC_BUSY_TICKS : 0;
}

uint16_t adc_read(struct gpio_adc adc)
{
    return adc.pin;
}

void adc_cancel(struct gpio_adc adc)
{
    (void)adc;
    fake.is_adc_busy = false;
}

struct gpio_pwm pwm_setup(uint32_t pin, uint32_t cycle_ticks, uint16_t value)
{
    struct gpio_pwm pwm = { (uint8_t)pin };

    (void)cycle_ticks;
    if (pin > 255)
        shutdown("Not a valid PWM pin");
    pwm_write(pwm, value);
    return pwm;
}

void pwm_write(struct gpio_pwm pwm, uint16_t value)
{
    set_level(pwm.pin, (uint8_t)value);
}


/* ---- Buses: devices that answer anything ---- */

static uint8_t make_answer(void)
{
    fake.noise = fake.noise * 1664525 + 1013904223;
    return (uint8_t)(fake.noise >> 24);
}

struct spi_config spi_setup(uint32_t bus, uint8_t mode, uint32_t rate)
{
    (void)rate;
    if (bus > 3 || mode > 3)
        shutdown("Invalid spi bus");
    return (struct spi_config){ (uint8_t)bus };
}

void spi_prepare(struct spi_config config)
{
    (void)config;
}

void spi_transfer(struct spi_config config, uint8_t receive_data, uint8_t len,
                  uint8_t *data)
{
    (void)config;
    for (uint8_t i = 0; receive_data && i < len; i++)
        data[i] = make_answer();
}

struct i2c_config i2c_setup(uint32_t bus, uint32_t rate, uint8_t addr)
{
    (void)rate;
    if (bus > 3 || addr > 0x7f)
        shutdown("Unsupported i2c bus");
    return (struct i2c_config){ (uint8_t)bus };
}

enum i2c_result i2c_transfer(struct i2c_config config, uint8_t write_len,
                             const uint8_t *write, uint8_t read_len,
                             uint8_t *read)
{
    (void)config;
    (void)write_len;
    (void)write;
    for (uint8_t i = 0; i < read_len; i++)
        read[i] = make_answer();
    return make_answer() & 7 ? I2C_OK : I2C_NACK;
}


/* ---- Memory ---- */

static uint64_t arena[4096];
static uint32_t debug_word;

void *mem_get_arena(size_t *size)
{
    memset(arena, 0xa5, sizeof(arena));
    *size = sizeof(arena);
    return arena;
}

uint32_t mem_debug_read(uint8_t order, uint32_t addr)
{
    return debug_word + order + addr;
}

void mem_debug_write(uint8_t order, uint32_t addr, uint32_t val)
{
    debug_word = val - order - addr;
}

/* The tests restart the board themselves. */
void reset_mcu(void)
{
}
