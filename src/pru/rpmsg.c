/* SPDX-License-Identifier: GPL-3.0-or-later
 * PRU0: messages to and from Linux over two queues of virtio (rpmsg; virtio
 * 1.2, section 2.7), which lie in the ARM's memory. */
#include <string.h>

#include "lib/pru/am335x.h"
#include "rpmsg.h"

enum { RING_SIZE = 16, PORT = 30, NAME_SERVICE = 53,
       RSC_VDEV = 3, VIRTIO_RPMSG = 7, FEATURE_NAME_SERVICE = 1,
       STATUS_DRIVER_OK = 4, NO_INTERRUPT = 1,
       EVENT_TO_ARM = 16, EVENT_FROM_ARM = 17 };
#define ANY_ADDRESS 0xffffffffu

static uint32_t read_events(void)
{
    uint32_t events;

    __asm__ volatile("mov %0, r31" : "=r"(events));
    return events;
}

static void raise_event(uint32_t event)
{
    __asm__ volatile("mov r31, %0" : : "r"(R31_RAISE(event)) : "memory");
}


/* ---- What remoteproc reads ---- */

struct ring_resource {
    uint32_t addr, align, count, notify_id, reserved;
};

/* One entry: a device of virtio with two rings, to PRU0's left Linux's input */
static volatile struct {
    uint32_t version, entries, reserved[2], offset;
    uint32_t type, device, notify_id, features, guest_features, config_len;
    uint8_t status, rings, reserved_too[2];
    struct ring_resource ring[2];
} resources __attribute__((section(".resource_table"), used)) = {
    1, 1, { 0, 0 }, 20,
    RSC_VDEV, VIRTIO_RPMSG, 0, FEATURE_NAME_SERVICE, 0, 0,
    0, 2, { 0, 0 },
    { { ANY_ADDRESS, 16, RING_SIZE, 0, 0 },
      { ANY_ADDRESS, 16, RING_SIZE, 0, 0 } },
};

/* Events, their channels and hosts: 0 is this core, 2 the ARM */
static const uint8_t event_map[]
    __attribute__((section(".pru_irq_map"), used)) = {
    0, 2, EVENT_TO_ARM, 2, 2, EVENT_FROM_ARM, 0, 0,
};


/* ---- Rings ---- */

struct descriptor {
    uint32_t addr, addr_high, len;
    uint16_t flags, next;
};

struct available {
    volatile uint16_t flags, idx, ring[RING_SIZE];
};

struct used {
    volatile uint16_t flags, idx;
    struct { volatile uint32_t id, len; } ring[RING_SIZE];
};

struct ring {
    const struct descriptor *descriptors;
    struct available *available;
    struct used *used;
    uint16_t taken;             /* entries of available */
};
static struct ring to_arm, from_arm;

static void open_ring(struct ring *ring, uint32_t addr)
{
    uint32_t avail = addr + RING_SIZE * sizeof(struct descriptor);

    ring->descriptors = (void *)addr;
    ring->available = (void *)avail;
    /* behind it a number that nobody uses, then aligned */
    ring->used = (void *)((avail + sizeof(struct available) + 2 + 15) & ~15u);
    ring->taken = ring->used->idx;
}

/* Number of the next buffer that Linux gives; -1: none. */
static int32_t peek_buffer(const struct ring *ring)
{
    if (ring->available->idx == ring->taken)
        return -1;
    return ring->available->ring[ring->taken % RING_SIZE];
}

static void return_buffer(struct ring *ring, uint32_t id, uint32_t len)
{
    uint16_t idx = ring->used->idx;

    ring->taken++;
    ring->used->ring[idx % RING_SIZE].id = id;
    ring->used->ring[idx % RING_SIZE].len = len;
    ring->used->idx = (uint16_t)(idx + 1);
    if (!(ring->available->flags & NO_INTERRUPT))
        raise_event(EVENT_TO_ARM);
}


/* ---- Messages ---- */

struct header {
    uint32_t from, to, reserved;
    uint16_t len, flags;
};

static uint32_t peer;           /* who has opened the port; 0: nobody yet */
static const uint8_t *rx_pos;   /* of the message that is being read */
static uint32_t rx_left;

/* In as few stores as the burst allows. */
static void copy_out(uint8_t *to, const uint8_t *from, uint32_t size)
{
    struct chunk {
        uint32_t words[8];
    };

    for (; size >= sizeof(struct chunk); size -= sizeof(struct chunk)) {
        *(struct chunk *)to = *(const struct chunk *)from;
        to += sizeof(struct chunk);
        from += sizeof(struct chunk);
    }
    memcpy(to, from, size);
}

static bool send_to(uint32_t address, const uint8_t *from, uint32_t size)
{
    int32_t id = peek_buffer(&to_arm);
    uint8_t *buf;

    if (id < 0)
        return false;
    buf = (uint8_t *)to_arm.descriptors[id].addr;
    *(struct header *)buf = (struct header){
        .from = PORT, .to = address, .len = (uint16_t)size };
    copy_out(buf + sizeof(struct header), from, size);
    return_buffer(&to_arm, (uint32_t)id, sizeof(struct header) + size);
    return true;
}

static void announce(void)
{
    static const struct {
        char name[32];
        uint32_t address, is_gone;
    } service = { "rpmsg-pru", PORT, 0 };

    while (!send_to(NAME_SERVICE, (const uint8_t *)&service, sizeof(service)))
        ;
}

void rpmsg_open(void)
{
    while (!(resources.status & STATUS_DRIVER_OK))
        ;
    open_ring(&to_arm, resources.ring[0].addr);
    open_ring(&from_arm, resources.ring[1].addr);
    announce();
}

bool rpmsg_write(const uint8_t *from, uint32_t size)
{
    return peer && send_to(peer, from, size);
}

/* The ARM has said that there is something, or what there is was not read. */
static bool next_message(void)
{
    static bool is_told;
    int32_t id;

    if (read_events() & R31_HOST0) {
        INTC_SICR = EVENT_FROM_ARM;
        is_told = true;
    }
    if (!is_told)
        return false;
    id = peek_buffer(&from_arm);
    if (id < 0) {
        is_told = false;
        return false;
    }
    const struct header *head = (const void *)from_arm.descriptors[id].addr;
    peer = head->from;
    rx_left = head->len;
    rx_pos = (const uint8_t *)(head + 1);
    return true;
}

uint32_t rpmsg_read(uint8_t *to, uint32_t room)
{
    uint32_t size;

    if (!rx_left && !next_message())
        return 0;
    size = rx_left < room ? rx_left : room;
    copy_out(to, rx_pos, size);
    rx_pos += size;
    rx_left -= size;
    if (!rx_left)
        return_buffer(&from_arm, from_arm.available->ring[
            from_arm.taken % RING_SIZE], 0);
    return size;
}
