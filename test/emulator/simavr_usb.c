/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A host on the USB port of an emulated AVR chip: it resets the bus, asks for
 * the descriptors, configures the device and opens its serial port, as an
 * operating system does; bytes of the console then go by way of the bulk
 * endpoints that the descriptors name.
 *
 * All control transfers are recorded.  Made good here of libsimavr 1.6: an
 * endpoint's interrupt that is enabled while its flag stands.
 */
#include <stdlib.h>
#include <string.h>

#include <simavr/sim_avr.h>
#include <simavr/sim_interrupts.h>
#include <simavr/avr_usb.h>

#include "vmcu_abi.h"

enum {
    PACKET_CYCLES = 800,        /* between packets */
    N_ENDPOINTS = 5,
    R_UEINTX = 16, R_UENUM = 17, R_UEIENX = 24, /* behind USBCON */
    USB_COM_VECTOR = 11,
    MAX_PACKET = 64,
    TX_SIZE = 4096,
    MAX_RECORDS = 32,
};

int simavr_usb_connect(avr_t *avr, const struct vmcu_host *host,
                       uint64_t (*clock)(void));
void simavr_usb_run(void);
int simavr_usb_rx(const uint8_t *buf, uint32_t len);

struct record {
    uint8_t setup[8];
    int32_t len;                /* bytes of data, -1: refused */
    uint8_t data[256];
};
struct record simavr_usb_records[MAX_RECORDS];
uint32_t simavr_usb_n_records;

static const uint8_t script[][8] = {
    { 0x80, 6, 0, 1, 0, 0, 8, 0 },          /* device, its first part */
    { 0x00, 5, 42, 0, 0, 0, 0, 0 },         /* address */
    { 0x80, 6, 0, 1, 0, 0, 18, 0 },
    { 0x80, 6, 0, 2, 0, 0, 9, 0 },          /* configuration */
    { 0x80, 6, 0, 2, 0, 0, 255, 0 },
    { 0x80, 6, 0, 3, 0, 0, 255, 0 },        /* languages, texts */
    { 0x80, 6, 1, 3, 9, 4, 255, 0 },
    { 0x80, 6, 2, 3, 9, 4, 255, 0 },
    { 0x80, 6, 3, 3, 9, 4, 255, 0 },
    { 0x80, 6, 9, 3, 9, 4, 255, 0 },        /* there is none */
    { 0x00, 9, 1, 0, 0, 0, 0, 0 },          /* configure */
    { 0x21, 0x20, 0, 0, 0, 0, 7, 0 },       /* line coding */
    { 0xa1, 0x21, 0, 0, 0, 0, 7, 0 },
    { 0x21, 0x22, 3, 0, 0, 0, 0, 0 },       /* somebody listens */
    { 0x80, 0, 0, 0, 0, 0, 2, 0 },          /* status */
};
enum { SCRIPT_LENGTH = sizeof(script) / sizeof(script[0]) };

static struct {
    avr_t *avr;
    avr_usb_t *usb;
    struct vmcu_host host;
    uint64_t (*clock)(void);
    enum { DETACHED, ATTACHED, SETUP, DATA, STATUS, OPEN } phase;
    uint32_t step;
    uint64_t next;
    uint8_t ep_in, ep_out, line[7];
    uint32_t head, tail;
    uint8_t tx[TX_SIZE];
} bus;

static struct record *
current(void)
{
    return &simavr_usb_records[simavr_usb_n_records];
}

static int
transact(uint32_t kind, uint8_t pipe, uint8_t *buf, uint32_t *len)
{
    struct avr_io_usb packet = { .pipe = pipe, .sz = *len, .buf = buf };
    int result = avr_ioctl(bus.avr, kind, &packet);

    *len = packet.sz;
    return result;
}

static void
on_attach(avr_irq_t *irq, uint32_t value, void *param)
{
    (void)irq;
    (void)param;
    if (value) {
        bus.phase = ATTACHED;
        bus.step = 0;
        bus.next = bus.clock() + 100 * PACKET_CYCLES;
    }
}

/* The bulk endpoints, from the configuration descriptor. */
static void
find_endpoints(const struct record *record)
{
    int32_t pos;

    for (pos = 0; pos < record->len && record->data[pos];
         pos += record->data[pos])
        if (record->data[pos + 1] == 5 && record->data[pos + 3] == 2) {
            if (record->data[pos + 2] & 0x80)
                bus.ep_in = record->data[pos + 2];
            else
                bus.ep_out = record->data[pos + 2];
        }
}

static void
end_transfer(void)
{
    struct record *record = current();

    if (record->setup[1] == 6 && record->setup[3] == 2)
        find_endpoints(record);
    if (simavr_usb_n_records < MAX_RECORDS - 1)
        simavr_usb_n_records++;
    memset(current(), 0, sizeof(*current()));
    bus.phase = bus.step < SCRIPT_LENGTH ? SETUP : OPEN;
}

static void
refuse(void)
{
    current()->len = -1;
    end_transfer();
}

static void
send_setup(void)
{
    struct record *record = current();
    uint32_t len = 8;

    if (bus.step < SCRIPT_LENGTH)
        memcpy(record->setup, script[bus.step], 8);
    if (transact(AVR_IOCTL_USB_SETUP, 0, record->setup, &len))
        return;
    bus.step++;
    record->len = 0;
    bus.phase = record->setup[6] ? DATA : STATUS;
}

static void
move_data(void)
{
    struct record *record = current();
    uint8_t packet[MAX_PACKET];
    uint32_t len = record->setup[6];
    int result;

    if (!(record->setup[0] & 0x80)) {
        result = transact(AVR_IOCTL_USB_WRITE, 0, bus.line, &len);
        if (!result)
            bus.phase = STATUS;
    } else {
        result = transact(AVR_IOCTL_USB_READ, 0, packet, &len);
        if (!result) {
            memcpy(&record->data[record->len], packet, len);
            record->len += (int32_t)len;
            if (len < 16 || record->len >= record->setup[6])
                bus.phase = STATUS;
        }
    }
    if (result == AVR_IOCTL_USB_STALL)
        refuse();
}

static void
end_with_status(void)
{
    uint8_t packet[MAX_PACKET];
    uint32_t len = 0;
    uint32_t kind = current()->setup[0] & 0x80 && current()->setup[6]
        ? AVR_IOCTL_USB_WRITE : AVR_IOCTL_USB_READ;
    int result = transact(kind, 0, packet, &len);

    if (result == AVR_IOCTL_USB_STALL)
        refuse();
    else if (!result)
        end_transfer();
}

static void
move_bulk(void)
{
    uint8_t packet[MAX_PACKET];
    uint32_t len = 0, i, n = bus.head - bus.tail;

    if (!transact(AVR_IOCTL_USB_READ, bus.ep_in, packet, &len) && len)
        bus.host.tx(bus.host.ctx, bus.clock(), packet, len);
    if (n > MAX_PACKET)
        n = MAX_PACKET;
    for (i = 0; i < n; i++)
        packet[i] = bus.tx[(bus.tail + i) % TX_SIZE];
    len = n;
    if (n && !transact(AVR_IOCTL_USB_WRITE, bus.ep_out, packet, &len))
        bus.tail += n;
}

/* What the chip waits for, if that was there before it waited. */
static void
raise_lost_interrupt(void)
{
    avr_t *avr = bus.avr;
    avr_io_addr_t base = bus.usb->r_usbcon;
    uint8_t was = avr->data[base + R_UENUM], ep, flags = 0;
    avr_io_addr_t at[2] = { base + R_UEINTX, base + R_UEIENX };
    uint32_t i;

    for (ep = 0; ep < N_ENDPOINTS && !flags; ep++) {
        avr->data[base + R_UENUM] = ep;
        flags = 0xff;
        for (i = 0; i < 2; i++)
            flags &= avr->io[AVR_DATA_TO_IO(at[i])].r.c(
                avr, at[i], avr->io[AVR_DATA_TO_IO(at[i])].r.param);
        flags &= 0x5f; /* but for RWAL and FIFOCON */
    }
    avr->data[base + R_UENUM] = was;
    for (i = 0; flags && i < avr->interrupts.vector_count; i++)
        if (avr->interrupts.vector[i]->vector == USB_COM_VECTOR)
            avr_raise_interrupt(avr, avr->interrupts.vector[i]);
}

void
simavr_usb_run(void)
{
    if (bus.phase == DETACHED)
        return;
    if (bus.clock() < bus.next)
        return;
    raise_lost_interrupt();
    bus.next = bus.clock() + PACKET_CYCLES;
    if (bus.phase == ATTACHED) {
        avr_ioctl(bus.avr, AVR_IOCTL_USB_RESET, NULL);
        bus.phase = SETUP;
        bus.next = bus.clock() + 20 * PACKET_CYCLES;
    } else if (bus.phase == SETUP) {
        send_setup();
    } else if (bus.phase == DATA) {
        move_data();
    } else if (bus.phase == STATUS) {
        end_with_status();
    } else {
        move_bulk();
    }
}

/* One more control transfer; what it sends is the line coding. */
void simavr_usb_request(const uint8_t *setup, const uint8_t *line);
void
simavr_usb_request(const uint8_t *setup, const uint8_t *line)
{
    memcpy(current()->setup, setup, 8);
    memcpy(bus.line, line, sizeof(bus.line));
    bus.phase = SETUP;
}

int
simavr_usb_rx(const uint8_t *buf, uint32_t len)
{
    uint32_t i;

    if (len > TX_SIZE - (bus.head - bus.tail))
        return 0;
    for (i = 0; i < len; i++)
        bus.tx[bus.head++ % TX_SIZE] = buf[i];
    return 1;
}

int
simavr_usb_connect(avr_t *avr, const struct vmcu_host *host,
                   uint64_t (*clock)(void))
{
    static const uint8_t line[7] = { 0x90, 0xd0, 3, 0, 0, 0, 8 };
    avr_io_t *io = avr->io_port;

    while (io && strcmp(io->kind, "usb"))
        io = io->next;
    memset(&bus, 0, sizeof(bus));
    memset(simavr_usb_records, 0, sizeof(simavr_usb_records));
    simavr_usb_n_records = 0;
    if (!io)
        return 0;
    bus.avr = avr;
    bus.usb = (avr_usb_t *)io;
    bus.host = *host;
    bus.clock = clock;
    memcpy(bus.line, line, sizeof(line));
    avr_irq_register_notify(
        avr_io_getirq(avr, AVR_IOCTL_USB_GETIRQ(), USB_IRQ_ATTACH), on_attach,
        NULL);
    return 1;
}
