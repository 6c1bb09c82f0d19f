/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * What Linux on the ARM does for two PRUs: load their programs (remoteproc:
 * resource table, map of events) and exchange messages with PRU0 over two
 * queues of virtio (rpmsg), of which it makes a port of bytes.
 */
#include <elf.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pru_soc.h"

enum { MACHINE_PRU = 144, CODE_OFFSET_MASK = 0xffff, RING_SIZE = 16,
       BUF_SIZE = 512, HEADER_SIZE = 16, PORT = 30, MY_ADDRESS = 1024,
       NAME_SERVICE = 53, RSC_VDEV = 3, VIRTIO_RPMSG = 7, STATUS_READY = 7,
       RING_BYTES = 0x1000, BUFS = DDR_BASE + 2 * RING_BYTES, PENDING = 8192 };

static uint32_t table_addr;             /* in PRU0's memory; 0: none */
static bool is_announced;
static uint16_t seen[2];                /* used entries taken, of each ring */
static uint16_t given[2];               /* entries that were made available */
static uint16_t free_bufs[RING_SIZE], n_free;
static uint8_t pending[PENDING];        /* bytes that wait for a buffer */
static uint32_t n_pending;

static void
arm_fault(const char *what, uint32_t detail)
{
    soc_fault(&soc.cores[0], what, detail);
}

/*
 * Queues.  Ring 0 takes messages from the PRU, ring 1 brings them to it.
 */

struct descriptor {
    uint64_t addr;
    uint32_t len;
    uint16_t flags, next;
};
struct available {
    uint16_t flags, idx, ring[RING_SIZE];
};
struct used {
    uint16_t flags, idx;
    struct { uint32_t id, len; } ring[RING_SIZE];
};

static uint32_t
ring_addr(uint32_t ring)
{
    return DDR_BASE + ring * RING_BYTES;
}

static struct descriptor *
descriptors(uint32_t ring)
{
    return (void *)soc_ddr(ring_addr(ring), RING_BYTES);
}

static struct available *
available(uint32_t ring)
{
    return (void *)(descriptors(ring) + RING_SIZE);
}

static struct used *
used(uint32_t ring)
{
    uintptr_t end = (uintptr_t)(available(ring) + 1) + 2;

    return (void *)((end + 15) & ~(uintptr_t)15);
}

static uint32_t
buf_addr(uint32_t ring, uint32_t index)
{
    return BUFS + (ring * RING_SIZE + index) * BUF_SIZE;
}

static void
give_buf(uint32_t ring, uint16_t index, uint32_t len)
{
    struct available *avail = available(ring);

    descriptors(ring)[index] = (struct descriptor){
        .addr = buf_addr(ring, index), .len = len,
        .flags = ring == 0 ? 2 : 0 };
    avail->ring[given[ring]++ % RING_SIZE] = index;
    avail->idx = given[ring];
}

static void
open_rings(void)
{
    uint16_t i;

    for (i = 0; i < RING_SIZE; i++)
        give_buf(0, i, BUF_SIZE);
    for (n_free = 0; n_free < RING_SIZE; n_free++)
        free_bufs[n_free] = n_free;
}

/* Send as much as has buffers, each its own message. */
static void
send_pending(void)
{
    bool has_sent = false;

    while (n_pending && n_free && is_announced) {
        uint16_t index = free_bufs[--n_free];
        uint8_t *buf = soc_ddr(buf_addr(1, index), BUF_SIZE);
        uint32_t len = n_pending < BUF_SIZE - HEADER_SIZE ? n_pending
            : BUF_SIZE - HEADER_SIZE;
        uint32_t head[4] = { MY_ADDRESS, PORT, 0, len };
        memcpy(buf, head, HEADER_SIZE);
        memcpy(buf + HEADER_SIZE, pending, len);
        memmove(pending, pending + len, n_pending -= len);
        give_buf(1, index, HEADER_SIZE + len);
        has_sent = true;
    }
    if (has_sent)
        soc_raise(EVENT_FROM_ARM);
}

bool
arm_write(const uint8_t *buf, uint32_t len)
{
    if (len > PENDING - n_pending)
        return false;
    memcpy(pending + n_pending, buf, len);
    n_pending += len;
    send_pending();
    return true;
}

/* One message of the PRU. */
static void
take_message(uint64_t cycle, const uint8_t *buf, uint32_t len)
{
    uint32_t head[4], size;

    memcpy(head, buf, HEADER_SIZE);
    size = head[3] & 0xffff;
    if (len < HEADER_SIZE || size > len - HEADER_SIZE)
        arm_fault("a message is longer than its buffer", size);
    else if (head[1] == NAME_SERVICE && size == 40
             && !strcmp((const char *)buf + HEADER_SIZE, "rpmsg-pru"))
        is_announced = buf[HEADER_SIZE + 32] == PORT;
    else if (head[1] == MY_ADDRESS && is_announced)
        soc.host.tx(soc.host.ctx, soc_clock(cycle), buf + HEADER_SIZE, size);
    else
        arm_fault("a message to nobody", head[1]);
}

void
arm_run(uint64_t cycle)
{
    soc.arm_kicked = false;
    while (table_addr && seen[0] != used(0)->idx) {
        uint32_t id = used(0)->ring[seen[0] % RING_SIZE].id;
        uint32_t len = used(0)->ring[seen[0]++ % RING_SIZE].len;
        if (id >= RING_SIZE || len > BUF_SIZE) {
            arm_fault("a bad entry in the used ring", id);
            return;
        }
        take_message(cycle, soc_ddr(buf_addr(0, id), BUF_SIZE), len);
        give_buf(0, (uint16_t)id, BUF_SIZE);
    }
    while (table_addr && seen[1] != used(1)->idx)
        free_bufs[n_free++]
            = (uint16_t)used(1)->ring[seen[1]++ % RING_SIZE].id;
    send_pending();
}

/*
 * Programs
 */

struct resource_vdev {
    uint32_t type, id, notify_id, features, guest_features, config_len;
    uint8_t status, n_rings, reserved[2];
    struct { uint32_t da, align, num, notify_id, reserved; } rings[2];
};

/* The table says where rings are wanted; they are put there, and it is told. */
static int32_t
read_resources(uint32_t core, uint32_t addr, uint32_t size)
{
    uint8_t *table = soc.data[core] + addr;
    struct resource_vdev vdev;
    uint32_t head[5], i;

    if (addr + size > PRU_DATA_SIZE || size < sizeof(head))
        return -10;
    memcpy(head, table, sizeof(head));
    if (head[0] != 1)
        return -11;
    if (!head[1])
        return 0;
    if (head[1] != 1 || head[4] + sizeof(vdev) > size || core)
        return -12;
    memcpy(&vdev, table + head[4], sizeof(vdev));
    if (vdev.type != RSC_VDEV || vdev.id != VIRTIO_RPMSG || vdev.n_rings != 2)
        return -13;
    for (i = 0; i < 2; i++) {
        if (vdev.rings[i].num != RING_SIZE || vdev.rings[i].align != 16)
            return -14;
        vdev.rings[i].da = ring_addr(i);
        vdev.rings[i].notify_id = i;
    }
    vdev.guest_features = vdev.features;
    memcpy(table + head[4], &vdev, sizeof(vdev));
    table_addr = addr + head[4];
    return 0;
}

/* Version, count, then three bytes an event: it, its channel, its host. */
static int32_t
read_event_map(const uint8_t *map, uint32_t size)
{
    uint32_t i;

    if (size < 2 || map[0] != 0 || size < 2u + 3u * map[1])
        return -20;
    for (i = 0; i < map[1]; i++) {
        const uint8_t *entry = map + 2 + 3 * i;
        if (entry[0] >= N_EVENTS || entry[1] >= 10 || entry[2] >= 10)
            return -21;
        soc.channel_of[entry[0]] = entry[1];
        soc.host_of[entry[1]] = entry[2];
        soc.events_enabled |= UINT64_C(1) << entry[0];
        soc.hosts_enabled |= 1u << entry[2];
    }
    soc.are_events_on = true;
    return 0;
}

static uint8_t *
find_place(uint32_t core, const Elf32_Phdr *segment)
{
    uint32_t addr = segment->p_paddr, len = segment->p_memsz;

    if (segment->p_flags & PF_X) {
        addr &= CODE_OFFSET_MASK;
        return addr + len <= PRU_CODE_WORDS * 4
            ? (uint8_t *)soc.cores[core].code + addr : NULL;
    }
    if (addr + len <= PRU_DATA_SIZE)
        return soc.data[core] + addr;
    if (addr >= PRU_DATA_SIZE && addr + len <= 2 * PRU_DATA_SIZE)
        return soc.data[!core] + (addr - PRU_DATA_SIZE);
    if (addr >= 0x10000 && addr + len <= 0x10000 + PRU_SHARED_SIZE)
        return soc.shared + (addr - 0x10000);
    return NULL;
}

static int32_t
load_segments(const uint8_t *elf, const Elf32_Ehdr *head, uint32_t core)
{
    uint32_t i;

    for (i = 0; i < head->e_phnum; i++) {
        const Elf32_Phdr *segment = (const void *)(
            elf + head->e_phoff + i * head->e_phentsize);
        uint8_t *place;
        if (segment->p_type != PT_LOAD || !segment->p_memsz)
            continue;
        place = find_place(core, segment);
        if (!place)
            return -3;
        memset(place, 0, segment->p_memsz);
        memcpy(place, elf + segment->p_offset, segment->p_filesz);
    }
    return 0;
}

static int32_t
read_sections(const uint8_t *elf, const Elf32_Ehdr *head, uint32_t core)
{
    const Elf32_Shdr *sections = (const void *)(elf + head->e_shoff);
    const char *names = (const char *)elf
        + sections[head->e_shstrndx].sh_offset;
    int32_t result = 0;
    uint32_t i;

    for (i = 0; !result && i < head->e_shnum; i++) {
        const Elf32_Shdr *s = &sections[i];
        if (!strcmp(names + s->sh_name, ".resource_table"))
            result = read_resources(core, s->sh_addr, s->sh_size);
        if (!strcmp(names + s->sh_name, ".pru_irq_map"))
            result = read_event_map(elf + s->sh_offset, s->sh_size);
    }
    return result;
}

static uint8_t *
read_file(const char *path, long *size)
{
    FILE *file = path ? fopen(path, "rb") : NULL;
    uint8_t *data = NULL;

    if (!file)
        return NULL;
    fseek(file, 0, SEEK_END);
    *size = ftell(file);
    rewind(file);
    if (*size > (long)sizeof(Elf32_Ehdr))
        data = malloc((size_t)*size);
    if (data && fread(data, (size_t)*size, 1, file) != 1) {
        free(data);
        data = NULL;
    }
    fclose(file);
    return data;
}

int32_t
arm_load(const char *path, uint32_t core)
{
    long size = 0;
    uint8_t *elf = read_file(path, &size);
    const Elf32_Ehdr *head = (const void *)elf;
    int32_t result;

    if (!elf)
        return -1;
    if (memcmp(head->e_ident, ELFMAG, SELFMAG)
        || head->e_machine != MACHINE_PRU)
        result = -2;
    else
        result = load_segments(elf, head, core);
    if (!result)
        result = read_sections(elf, head, core);
    if (!result)
        soc.cores[core].pc = (head->e_entry & CODE_OFFSET_MASK) / 4;
    free(elf);
    return result;
}

void
arm_start(void)
{
    is_announced = false;
    n_pending = 0;
    memset(seen, 0, sizeof(seen));
    memset(given, 0, sizeof(given));
    if (table_addr) {
        open_rings();
        soc.data[0][table_addr + 24] = STATUS_READY;
        soc_raise(EVENT_FROM_ARM);
    }
    soc.cores[0].is_running = soc.cores[1].is_running = true;
}
