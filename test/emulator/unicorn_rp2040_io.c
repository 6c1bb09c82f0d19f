/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * Serial blocks, converter and pwm of an RP2040 (data sheet, chapter 4).
 */
#include <string.h>

#include "unicorn_rp2040.h"

enum { READ_AHEAD = 64 };

static uint8_t
fifo_get(struct rp_fifo *fifo)
{
    if (!fifo->count)
        return 0;
    fifo->count--;
    return fifo->data[fifo->first++ % RP_FIFO];
}

static void
fifo_put(struct rp_fifo *fifo, uint8_t byte)
{
    fifo->data[(fifo->first + fifo->count++) % RP_FIFO] = byte;
}

static uint64_t
least(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/*
 * UART: queues of 32; interrupts when four bytes have come, or one has waited
 * for 32 bits' time, and when the transmit queue falls to four.
 */

enum { U_DR = 0, U_FR = 6, U_IBRD = 9, U_FBRD = 10, U_LCR = 11, U_CR = 12,
       U_IFLS = 13, U_IMSC = 14, U_RIS = 15, U_MIS = 16, U_ICR = 17 };
enum { U_RX = 0x10, U_TX = 0x20, U_RT = 0x40, U_OE = 0x400, U_LEVEL = 4 };

static struct uart {
    struct rp_fifo rx, tx;
    uint64_t tx_due, next_rx, rt_due;
    uint32_t ris;
    bool is_shifting;
} uarts[2];
static int console = -1;

static uint64_t
byte_cycles(uint32_t index)
{
    const uint32_t *regs = rp.regs[RP_UART0 + index];
    double baud = rp.peri_hz * 4. / (regs[U_IBRD] * 64 + regs[U_FBRD]);

    if (!rp.peri_hz || baud < chip.baud * .97 || baud > chip.baud * 1.03) {
        chip_fault("uart at %.0f baud instead of %u", baud, chip.baud);
        return 1;
    }
    if (regs[U_LCR] != 0x70 || regs[U_IFLS] != 0)
        chip_fault("uart with settings that are not modelled");
    return (uint64_t)(10. * chip.core_hz / baud);
}

static void
update_uart(uint32_t index)
{
    core_set_level(rp.uart_irq + index,
                   uarts[index].ris & rp.regs[RP_UART0 + index][U_IMSC]);
}

static void
start_shifting(uint32_t index)
{
    struct uart *u = &uarts[index];

    if (u->is_shifting || !u->tx.count)
        return;
    u->is_shifting = true;
    u->tx_due = chip.cycle + byte_cycles(index);
    chip_wake_at(u->tx_due);
}

static void
uart_events(uint32_t index)
{
    struct uart *u = &uarts[index];

    if (chip.cycle >= u->tx_due) {
        uint8_t byte = fifo_get(&u->tx);

        chip.host.tx(chip.host.ctx, chip_now(), &byte, 1);
        u->tx_due = NEVER;
        u->is_shifting = false;
        if (u->tx.count == U_LEVEL)
            u->ris |= U_TX;
        start_shifting(index);
        update_uart(index);
    }
    if (chip.cycle >= u->rt_due) {
        u->rt_due = NEVER;
        u->ris |= u->rx.count ? U_RT : 0;
        update_uart(index);
    }
}

static uint32_t
uart_read(uint32_t index, uint32_t word)
{
    struct uart *u = &uarts[index];
    uint32_t value = rp.regs[RP_UART0 + index][word];

    switch (word) {
    case U_DR:
        value = fifo_get(&u->rx);
        if (u->rx.count < U_LEVEL)
            u->ris &= ~(uint32_t)U_RX;
        if (!u->rx.count)
            u->ris &= ~(uint32_t)U_RT;
        update_uart(index);
        return value;
    case U_FR:
        return (u->rx.count ? 0 : 0x10) | (u->tx.count == RP_FIFO ? 0x20 : 0)
            | (u->is_shifting ? 8 : 0) | (u->tx.count ? 0 : 0x80);
    case U_RIS:
        return u->ris;
    case U_MIS:
        return u->ris & rp.regs[RP_UART0 + index][U_IMSC];
    default:
        return value;
    }
}

static void
uart_write(uint32_t index, uint32_t word, uint32_t value)
{
    struct uart *u = &uarts[index];

    if (word == U_DR) {
        if (u->tx.count == RP_FIFO)
            chip_fault("a byte too much for the uart");
        else
            fifo_put(&u->tx, (uint8_t)value);
        if (u->tx.count > U_LEVEL)
            u->ris &= ~(uint32_t)U_TX;
        start_shifting(index);
    } else if (word == U_ICR) {
        u->ris &= ~value;
    } else {
        rp.regs[RP_UART0 + index][word] = value;
        if (word == U_CR && (value & 0x301) == 0x301)
            console = (int)index;
    }
    update_uart(index);
}

/* Do the console's pins belong to this uart?  They go by fours. */
static bool
has_pins(uint32_t index)
{
    uint32_t pin;

    for (pin = 0; pin < rp.n_pins; pin += 4)
        if (((pin + 4) / 8) % 2 == index && rp_function(pin) == RP_FUNC_UART
            && rp_function(pin + 1) == RP_FUNC_UART)
            return true;
    return false;
}

uint64_t
rp_uart_free_at(void)
{
    return console >= 0 && has_pins((uint32_t)console)
        ? uarts[console].next_rx : NEVER;
}

void
rp_uart_rx(uint8_t byte)
{
    struct uart *u = &uarts[console];
    uint64_t cycles = byte_cycles((uint32_t)console);

    u->next_rx = chip.cycle + cycles;
    if (u->rx.count == RP_FIFO)
        u->ris |= U_OE;
    else
        fifo_put(&u->rx, byte);
    if (u->rx.count >= U_LEVEL)
        u->ris |= U_RX;
    u->rt_due = chip.cycle + cycles * 32 / 10;
    chip_wake_at(u->rt_due);
    update_uart((uint32_t)console);
}

/*
 * SPI: a byte takes eight bits' time
 */

enum { S_CR0 = 0, S_CR1 = 1, S_DR = 2, S_SR = 3, S_CPSR = 4 };

static struct spi {
    struct rp_fifo rx;
    uint64_t due;
    uint8_t byte;
} spis[2];

static void
pl022_write(uint32_t index, uint32_t word, uint32_t value)
{
    uint32_t *regs = rp.regs[RP_SPI0 + index];
    struct spi *s = &spis[index];

    if (word != S_DR) {
        if (word != S_CR1 && regs[S_CR1] & 2)
            chip_fault("spi %u is changed while it is on", index);
        regs[word] = value;
        return;
    }
    if (!(regs[S_CR1] & 2) || regs[S_CPSR] < 2 || regs[S_CPSR] & 1
        || (regs[S_CR0] & 0x3f) != 7 || !rp.peri_hz || s->due != NEVER
        || s->rx.count >= 8) {
        chip_fault("spi %u is not ready", index);
        return;
    }
    s->byte = (uint8_t)value;
    chip.host.spi(chip.host.ctx, chip_now(), index, &s->byte, 1);
    s->due = chip.cycle + 8ull * regs[S_CPSR] * ((regs[S_CR0] >> 8 & 255) + 1);
    chip_wake_at(s->due);
}

static uint32_t
pl022_read(uint32_t index, uint32_t word)
{
    struct spi *s = &spis[index];

    if (word == S_SR)
        return (s->due == NEVER ? 3 : 0x12) | (s->rx.count ? 4 : 0);
    return word == S_DR ? fifo_get(&s->rx) : rp.regs[RP_SPI0 + index][word];
}

/*
 * I2C: bytes take no time; a read asks the world for more than there may be
 */

enum { I_CON = 0, I_TAR = 1, I_DATA = 4, I_HCNT = 7, I_LCNT = 8, I_RAW = 13,
       I_CLR_INTR = 16, I_CLR_ABRT = 21, I_ENABLE = 27, I_STATUS = 28,
       I_RXFLR = 30, I_SOURCE = 32, I_SPKLEN = 40 };
enum { I_ABRT = 0x40, I_STOPPED = 0x200 };

static struct i2c {
    uint8_t wr[256], rd[READ_AHEAD];
    uint32_t n_written, n_read;
    bool is_reading, is_open, is_aborted;
    struct rp_fifo rx;
} i2cs[2];

static bool
ask_world(uint32_t index, uint32_t n_write, uint32_t n_read)
{
    struct i2c *c = &i2cs[index];

    return chip.host.i2c(chip.host.ctx, chip_now(), index,
                         (uint8_t)rp.regs[RP_I2C0 + index][I_TAR], c->wr,
                         n_write, c->rd, n_read) >= 0;
}

static void
i2c_stop(uint32_t index)
{
    i2cs[index].is_open = i2cs[index].is_reading = false;
    i2cs[index].n_written = 0;
    rp.regs[RP_I2C0 + index][I_RAW] |= I_STOPPED;
}

static void
i2c_abort(uint32_t index, uint32_t source)
{
    rp.regs[RP_I2C0 + index][I_RAW] |= I_ABRT;
    rp.regs[RP_I2C0 + index][I_SOURCE] = source;
    i2cs[index].is_aborted = true;
    i2c_stop(index);
}

static void
i2c_check(uint32_t index)
{
    const uint32_t *regs = rp.regs[RP_I2C0 + index];
    double hz = (double)chip.core_hz
        / (regs[I_HCNT] + regs[I_LCNT] + regs[I_SPKLEN] + 8.);

    if (!(regs[I_ENABLE] & 1) || (regs[I_CON] & 0x47) != 0x45)
        chip_fault("i2c %u is no master, or off", index);
    if (hz > 410000)
        chip_fault("i2c %u at %.0f Hz", index, hz);
}

static void
i2c_command(uint32_t index, uint32_t value)
{
    struct i2c *c = &i2cs[index];
    bool is_read = value & 0x100;

    i2c_check(index);
    if (c->is_aborted)
        return;
    if (is_read && c->is_open && !c->is_reading && !(value & 0x400))
        chip_fault("i2c %u turns around without a restart", index);
    if (is_read && !c->is_reading) {
        c->is_reading = true;
        c->n_read = 0;
        if (!ask_world(index, c->n_written, READ_AHEAD)) {
            i2c_abort(index, 1);
            return;
        }
    } else if (!is_read && !c->is_open && !ask_world(index, 0, 0)) {
        i2c_abort(index, 1);
        return;
    }
    c->is_open = true;
    if (!is_read)
        c->wr[c->n_written++ & 255] = (uint8_t)value;
    else if (c->rx.count == 16)
        chip_fault("i2c %u receives more than its queue holds", index);
    else
        fifo_put(&c->rx, c->rd[c->n_read++ % READ_AHEAD]);
    if (!(value & 0x200))
        return;
    if (!is_read)
        ask_world(index, c->n_written, 0);
    i2c_stop(index);
}

static void
dw_write(uint32_t index, uint32_t word, uint32_t value)
{
    uint32_t *regs = rp.regs[RP_I2C0 + index];

    if (word == I_DATA) {
        i2c_command(index, value);
        return;
    }
    if (word != I_ENABLE && regs[I_ENABLE] & 1)
        chip_fault("i2c %u is changed while it is on", index);
    if (word == I_ENABLE && !(value & 1))
        memset(&i2cs[index], 0, sizeof(i2cs[index]));
    regs[word] = value;
}

static uint32_t
dw_read(uint32_t index, uint32_t word)
{
    uint32_t *regs = rp.regs[RP_I2C0 + index];

    if (word == I_DATA)
        return fifo_get(&i2cs[index].rx);
    if (word == I_RXFLR)
        return i2cs[index].rx.count;
    if (word == I_STATUS)
        return 2 | 4 | (i2cs[index].is_open ? 0x21 : 0);
    if (word == I_CLR_INTR || word == I_CLR_ABRT) {
        regs[I_RAW] &= word == I_CLR_ABRT ? ~(uint32_t)I_ABRT : 0;
        regs[I_SOURCE] = 0;
        i2cs[index].is_aborted = false;
        return 0;
    }
    return regs[word];
}

/*
 * Converter
 */

enum { A_CS = 0, A_RESULT = 1 };
#define AT_27_DEGREES 876       /* 0.706 V of 3.3 V */

static void
adc_write_word(uint32_t word, uint32_t value)
{
    uint32_t channel = value >> 12 & 7;

    rp.regs[RP_ADC][word] = value & ~4u;
    if (word != A_CS || !(value & 4))
        return;
    if (rp.adc_hz != 48000000 || !(value & 1) || rp.adc_due != NEVER
        || (channel == 4 && !(value & 2)))
        chip_fault("the converter is not ready");
    /* its pin must not be digital, too */
    if (channel < 4 && rp.regs[RP_PADS_BANK0][27 + channel] & 0x14c)
        chip_fault("gpio%u is no analog input", 26 + channel);
    rp.adc_due = chip.cycle + 96ull * chip.core_hz / rp.adc_hz;
    chip_wake_at(rp.adc_due);
}

static uint32_t
adc_read_word(uint32_t word)
{
    uint32_t value = rp.regs[RP_ADC][word];

    if (word == A_CS && value & 1 && rp.adc_due == NEVER)
        value |= 0x100;
    return value;
}

static void
adc_event(void)
{
    uint32_t channel = rp.regs[RP_ADC][A_CS] >> 12 & 7;

    if (chip.cycle < rp.adc_due)
        return;
    rp.adc_due = NEVER;
    rp.regs[RP_ADC][A_RESULT] = channel == 4 ? AT_27_DEGREES
        : chip.host.adc_in(chip.host.ctx, chip_now(), 26 + channel) >> 4u;
}

/*
 * Pwm
 */

static uint32_t
slice_of(uint32_t pin)
{
    return pin < 32 ? pin / 2 % 8 : 8 + (pin - 32) / 2 % 4;
}

void
rp_pwm_update(void)
{
    uint32_t pin;

    if (rp_in_reset(rp.pwm_reset))
        return;
    for (pin = 0; pin < rp.n_pins; pin++) {
        const uint32_t *slice = &rp.regs[RP_PWM][slice_of(pin) * 5];
        uint32_t now[3], counts = (slice[4] & 0xffff) + 1;

        if (rp_function(pin) != RP_FUNC_PWM || !(slice[0] & 1))
            continue;
        if ((slice[1] & 0xfff) < 16)
            chip_fault("slice of gpio%u divides by less than one", pin);
        now[0] = (uint32_t)((uint64_t)counts * (slice[1] & 0xfff)
                            * chip.tick_mul / (16 * chip.tick_div));
        now[1] = slice[3] >> (pin % 2 ? 16 : 0) & 0xffff;
        now[2] = counts;
        if (!memcmp(rp.pwm_told[pin], now, sizeof(now)))
            continue;
        memcpy(rp.pwm_told[pin], now, sizeof(now));
        chip.host.pwm_out(chip.host.ctx, chip_now(), pin, now[0], now[1],
                          now[2]);
    }
}

/*
 * All of them
 */

void
rp_io_reset(void)
{
    uint32_t i;

    memset(uarts, 0, sizeof(uarts));
    memset(spis, 0, sizeof(spis));
    memset(i2cs, 0, sizeof(i2cs));
    console = -1;
    for (i = 0; i < 2; i++) {
        uarts[i].tx_due = uarts[i].rt_due = spis[i].due = NEVER;
        rp.regs[RP_UART0 + i][U_IFLS] = 0x12;
        rp.regs[RP_I2C0 + i][I_SPKLEN] = 7;
    }
    for (i = 0; i < 12; i++) {
        rp.regs[RP_PWM][5 * i + 1] = 0x10;
        rp.regs[RP_PWM][5 * i + 4] = 0xffff;
    }
}

uint32_t
rp_io_read(uint32_t block, uint32_t word)
{
    if (block <= RP_UART1)
        return uart_read(block - RP_UART0, word);
    if (block <= RP_SPI1)
        return pl022_read(block - RP_SPI0, word);
    if (block <= RP_I2C1)
        return dw_read(block - RP_I2C0, word);
    return adc_read_word(word);
}

void
rp_io_write(uint32_t block, uint32_t word, uint32_t value)
{
    if (block <= RP_UART1) {
        uart_write(block - RP_UART0, word, value);
    } else if (block <= RP_SPI1) {
        pl022_write(block - RP_SPI0, word, value);
    } else if (block <= RP_I2C1) {
        dw_write(block - RP_I2C0, word, value);
    } else if (block == RP_ADC) {
        adc_write_word(word, value);
    } else {
        rp.regs[RP_PWM][word] = value;
        rp_pwm_update();
    }
}

void
rp_io_run_events(void)
{
    uint32_t i;

    for (i = 0; i < 2; i++) {
        uart_events(i);
        if (chip.cycle >= spis[i].due) {
            spis[i].due = NEVER;
            fifo_put(&spis[i].rx, spis[i].byte);
        }
    }
    adc_event();
}

uint64_t
rp_io_next_event(void)
{
    uint64_t next = rp.adc_due;
    uint32_t i;

    for (i = 0; i < 2; i++) {
        next = least(next, least(uarts[i].tx_due, uarts[i].rt_due));
        next = least(next, spis[i].due);
    }
    return next;
}
