/* SPDX-License-Identifier: GPL-3.0-or-later
 * Changes inputs of libFuzzer as somebody would who knows the protocol: whole
 * messages of commands that the dictionary has, other values in them, blocks
 * with right and wrong frames. */
#include <string.h>

#include "core/command.h"
#include "fakeboard.h"
#include "fuzz_input.h"
#include "fuzz_message.h"
#include "tests.h"

#ifndef DECL_SCAN
enum { FORMAT_BYTE, FORMAT_SHORT, FORMAT_SIGNED, FORMAT_LONG, FORMAT_BYTES,
       FORMAT_OID, FORMAT_CLOCK, FORMAT_PIN };
#include "fuzz_formats.h"
#endif

enum { MAX_CHUNKS = 64, MAX_SIZE = 2048, MAX_MESSAGE = 160 };
#define N_FORMATS (sizeof(formats) / sizeof(formats[0]))

size_t LLVMFuzzerMutate(uint8_t *data, size_t size, size_t max_size);
size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size,
                               unsigned int seed);

struct chunk {
    uint8_t flags, len;
    uint8_t data[FUZZ_LENGTH];
};

static struct chunk chunks[MAX_CHUNKS];
static uint32_t n_chunks, seed;

static uint32_t pick(uint32_t n)
{
    return next_random(&seed) % n;
}


/* ---- Messages ---- */

static uint32_t make_any(void)
{
    static const uint32_t edges[] = {
        0, 1, 2, 0x5f, 0x60, 0x7f, 0x80, 0xff, 0x100, 0x7fff, 0x8000, 0xffff,
        0x10000, 0x7fffffff, 0x80000000, 0xffffffe0, 0xffffffff,
    };

    switch (pick(4)) {
    case 0:
        return edges[pick(sizeof(edges) / sizeof(edges[0]))];
    case 1:
        return pick(1 << 16);
    case 2:
        return pick(1 << 24) << 8;
    default:
        return pick(16);
    }
}

static uint32_t make_value(uint8_t kind)
{
    if (!pick(8))
        return make_any();
    switch (kind) {
    case FORMAT_OID:
        return pick(41);
    case FORMAT_CLOCK:
        return FUZZ_CLOCK + pick(pick(2) ? 20000 : 200000);
    case FORMAT_PIN:
        return pick(258);
    case FORMAT_SIGNED:
        return pick(2) ? pick(300) : 0 - pick(300);
    case FORMAT_LONG:
        return pick(2) ? pick(20000) : make_any();
    case FORMAT_SHORT:
        return pick(2) ? pick(2000) : make_any();
    default:
        return pick(2) ? pick(6) : make_any();
    }
}

static uint8_t *put_buffer(uint8_t *p)
{
    uint8_t len = (uint8_t)pick(pick(4) ? 9 : 50);

    *p++ = len;
    for (uint8_t i = 0; i < len; i++)
        *p++ = (uint8_t)pick(256);
    return p;
}

/* More bytes than an integer may have, or than this one needs. */
static uint8_t *put_long_int(uint8_t *p, uint32_t value)
{
    uint8_t extra = (uint8_t)pick(5);

    while (extra--)
        *p++ = 0x80;
    return command_put_int(p, value);
}

static uint8_t *put_param(uint8_t *p, uint8_t kind)
{
    if (kind == FORMAT_BYTES)
        return put_buffer(p);
    if (!pick(100))
        return put_long_int(p, make_value(kind));
    return command_put_int(p, make_value(kind));
}

static const struct format *find_format(uint32_t id)
{
    for (size_t i = 0; i < N_FORMATS; i++)
        if (formats[i].id == id)
            return &formats[i];
    return NULL;
}

/* Most often a command that a configured mcu has an object for. */
static uint8_t *put_message(uint8_t *p)
{
    const struct format *f = &formats[pick(N_FORMATS)];
    uint8_t oid, i = 0;

    if (pick(4)) {
        uint32_t id = fuzz_pick_command(&oid, &seed);
        f = find_format(id);
        p = command_put_int(p, id);
        p = command_put_int(p, oid);
        i = 1;
    } else {
        p = command_put_int(p, f->id);
    }
    for (; i < f->n_params; i++)
        p = put_param(p, f->kinds[i]);
    return p;
}

/* Copy one parameter (or, if it is told, a new value for it). */
static const uint8_t *copy_param(uint8_t **out, const uint8_t *p,
                                 const uint8_t *end, uint8_t kind, bool renew)
{
    const uint8_t *start = p;
    uint32_t value;

    if (!command_get_int(&p, end, &value))
        return NULL;
    if (kind == FORMAT_BYTES) {
        if (value > (uint32_t)(end - p))
            return NULL;
        p += value;
    }
    if (renew) {
        *out = put_param(*out, kind);
    } else {
        memcpy(*out, start, (size_t)(p - start));
        *out += p - start;
    }
    return p;
}

/* Another value for one parameter of the first message. */
static void renew_param(struct chunk *c)
{
    uint8_t text[MAX_MESSAGE + FUZZ_LENGTH], *out = text;
    const uint8_t *p = c->data, *end = c->data + c->len;
    const struct format *f;
    uint32_t id;
    uint8_t which;

    if (!command_get_int(&p, end, &id) || !(f = find_format(id))
        || !f->n_params)
        return;
    which = (uint8_t)pick(f->n_params);
    out = command_put_int(out, id);
    for (uint8_t i = 0; i < f->n_params; i++)
        if (!(p = copy_param(&out, p, end, f->kinds[i], i == which)))
            return;
    memcpy(out, p, (size_t)(end - p));
    out += end - p;
    if (out - text > COMMAND_PAYLOAD_MAX)
        return;
    c->len = (uint8_t)(out - text);
    memcpy(c->data, text, c->len);
}


/* ---- Chunks ---- */

static struct chunk *insert_chunk(void)
{
    uint32_t at = pick(n_chunks + 1);

    if (n_chunks == MAX_CHUNKS)
        return NULL;
    memmove(&chunks[at + 1], &chunks[at],
            (n_chunks - at) * sizeof(chunks[0]));
    n_chunks++;
    chunks[at] = (struct chunk){ 0 };
    return &chunks[at];
}

static void fill_proper(struct chunk *c)
{
    uint8_t message[MAX_MESSAGE * 4];

    do {
        size_t size = (size_t)(put_message(message) - message);
        if (c->len + size > COMMAND_PAYLOAD_MAX)
            break;
        memcpy(c->data + c->len, message, size);
        c->len = (uint8_t)(c->len + size);
    } while (pick(2));
}

/* A block with a checksum, any sequence number, and perhaps one wrong bit. */
static void fill_frame(struct chunk *c)
{
    uint8_t len;

    fill_proper(c);
    len = c->len > FUZZ_LENGTH - 5 ? FUZZ_LENGTH - 5 : c->len;
    memmove(c->data + 2, c->data, len);
    c->len = (uint8_t)(len + 5);
    c->data[0] = pick(8) ? c->len : (uint8_t)pick(256);
    c->data[1] = (uint8_t)(0x10 | pick(pick(8) ? 16 : 256));
    fake_put_trailer(c->data, (size_t)len + 2);
    if (!pick(4))
        c->data[pick(c->len)] ^= (uint8_t)(1 << pick(8));
    c->flags = FUZZ_RAW;
}

static void erase_chunk(uint32_t at)
{
    n_chunks--;
    memmove(&chunks[at], &chunks[at + 1],
            (n_chunks - at) * sizeof(chunks[0]));
}

static void change_bytes(struct chunk *c)
{
    c->len = (uint8_t)LLVMFuzzerMutate(c->data, c->len, COMMAND_PAYLOAD_MAX);
}

static void insert_copy(uint32_t from)
{
    struct chunk copy = chunks[from], *c = insert_chunk();

    if (c)
        *c = copy;
}

static void insert_new(uint32_t kind)
{
    struct chunk *c = insert_chunk();

    if (!c)
        return;
    if (kind == 0)
        c->flags = FUZZ_RAW; /* time passes */
    else if (kind == 1)
        fill_frame(c);
    else
        fill_proper(c);
}

static void change_chunks(void)
{
    uint32_t at = n_chunks ? pick(n_chunks) : 0, kind = pick(12);

    if (kind < 6 || !n_chunks)
        insert_new(kind);
    else if (kind < 9)
        renew_param(&chunks[at]);
    else if (kind == 9)
        change_bytes(&chunks[at]);
    else if (kind == 10)
        insert_copy(at);
    else
        erase_chunk(at);
}


/* ---- Inputs ---- */

static uint8_t read_chunks(const uint8_t *data, size_t size)
{
    uint8_t flags = size ? data[0] & FUZZ_CONFIGURED : FUZZ_CONFIGURED;

    n_chunks = 0;
    while (size && n_chunks < MAX_CHUNKS) {
        struct chunk *c = &chunks[n_chunks++];
        c->flags = *data & FUZZ_RAW;
        c->len = *data++ & FUZZ_LENGTH;
        size--;
        if (c->len > size)
            c->len = (uint8_t)size;
        memcpy(c->data, data, c->len);
        data += c->len;
        size -= c->len;
    }
    return flags;
}

static size_t write_chunks(uint8_t *data, size_t max_size, uint8_t flags)
{
    size_t size = 0;

    for (uint32_t i = 0; i < n_chunks; i++) {
        const struct chunk *c = &chunks[i];
        if (size + c->len + 1 > max_size)
            break;
        data[size++] = (uint8_t)(c->flags | c->len | flags);
        memcpy(data + size, c->data, c->len);
        size += c->len;
    }
    return size;
}

size_t LLVMFuzzerCustomMutator(uint8_t *data, size_t size, size_t max_size,
                               unsigned int new_seed)
{
    uint8_t flags = read_chunks(data, size);

    seed = new_seed;
    if (!pick(50))
        flags ^= FUZZ_CONFIGURED;
    do
        change_chunks();
    while (pick(3));
    return write_chunks(data, max_size, flags);
}
