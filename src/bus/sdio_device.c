/* SPDX-License-Identifier: GPL-3.0-or-later
 * An SD card that the host reads and writes by blocks, through a buffer. */
#include <string.h>

#include "board/sdio.h"
#include "core/arena.h"
#include "core/command.h"
#include "core/oid.h"
#include "core/sched.h"

/* Of a block: log2 of the bytes, and how many a message has room for */
enum { LOG2_MAX = 11, PART_MAX = 48 };

/* enum sdio_error */
DECL_ENUMERATION("sdio_error", "none", 0);
DECL_ENUMERATION("sdio_error", "no_answer", 1);
DECL_ENUMERATION("sdio_error", "bad_crc", 2);
DECL_ENUMERATION("sdio_error", "data_timeout", 3);
DECL_ENUMERATION("sdio_error", "data_crc", 4);
DECL_ENUMERATION("sdio_error", "too_slow", 5);

struct sdio_device {
    uint8_t *block;
    uint8_t log2_size;
    bool is_set_up;
};

static const ROM struct oid_kind sdio_device_kind = {
    sizeof(struct sdio_device)
};

static struct sdio_device *lookup(uint8_t oid)
{
    struct sdio_device *device = oid_lookup(oid, &sdio_device_kind);

    if (!device->is_set_up)
        shutdown("Invalid sdio bus");
    return device;
}

void command_config_sdio(const struct args_config_sdio *args)
{
    struct sdio_device *device;
    uint8_t log2_size = 0;

    while (log2_size < LOG2_MAX && 1u << log2_size < args->blocksize)
        log2_size++;
    if (1u << log2_size != args->blocksize)
        shutdown("Invalid sdio block size");
    device = oid_new(args->oid, &sdio_device_kind);
    device->log2_size = log2_size;
    device->block = arena_alloc((uint16_t)args->blocksize);
}
DECL_COMMAND(command_config_sdio, "config_sdio oid=%c blocksize=%u");

void command_sdio_set_bus(const struct args_sdio_set_bus *args)
{
    struct sdio_device *device = oid_lookup(args->oid, &sdio_device_kind);

    sdio_setup(args->sdio_bus);
    device->is_set_up = true;
}
DECL_COMMAND(command_sdio_set_bus, "sdio_set_bus oid=%c sdio_bus=%u");

void command_sdio_set_speed(const struct args_sdio_set_speed *args)
{
    lookup(args->oid);
    sdio_set_rate(args->speed);
}
DECL_COMMAND(command_sdio_set_speed, "sdio_set_speed oid=%c speed=%u");

/* wait: 0 for no answer, 1 for one of 48 bits, 3 for one of 136. */
void command_sdio_send_command(const struct args_sdio_send_command *args)
{
    uint8_t data[SDIO_ANSWER_MAX], len = 0;
    enum sdio_answer answer = SDIO_NONE;
    enum sdio_error error;

    if (args->wait == SDIO_SHORT)
        answer = SDIO_SHORT;
    else if (args->wait == SDIO_LONG)
        answer = SDIO_LONG;
    lookup(args->oid);
    error = sdio_command(args->cmd, args->argument, answer, data);
    if (error == SDIO_OK && answer != SDIO_NONE)
        len = answer == SDIO_LONG ? 16 : 4;
    sendf("sdio_send_command_response oid=%c error=%c response=%*s", args->oid,
          error, len, data);
}
DECL_COMMAND(command_sdio_send_command,
             "sdio_send_command oid=%c cmd=%c argument=%u wait=%c");

void command_sdio_read_data(const struct args_sdio_read_data *args)
{
    struct sdio_device *device = lookup(args->oid);
    uint32_t done = 0;
    enum sdio_error error = sdio_read(args->cmd, args->argument, device->block,
                                      device->log2_size, &done);

    sendf("sdio_read_data_response oid=%c error=%c read=%u", args->oid, error,
          done);
}
DECL_COMMAND(command_sdio_read_data,
             "sdio_read_data oid=%c cmd=%c argument=%u");

void command_sdio_write_data(const struct args_sdio_write_data *args)
{
    struct sdio_device *device = lookup(args->oid);
    uint32_t done = 0;
    enum sdio_error error = sdio_write(args->cmd, args->argument,
                                       device->block, device->log2_size,
                                       &done);

    sendf("sdio_write_data_response oid=%c error=%c write=%u", args->oid,
          error, done);
}
DECL_COMMAND(command_sdio_write_data,
             "sdio_write_data oid=%c cmd=%c argument=%u");

/* Part of the buffer; there is none behind its end. */
static uint8_t *find_part(const struct sdio_device *device, uint32_t offset,
                          uint8_t len)
{
    uint32_t size = 1u << device->log2_size;

    if (len > PART_MAX || offset > size || len > size - offset)
        shutdown("Invalid sdio buffer offset");
    return &device->block[offset];
}

void command_sdio_read_data_buffer(
    const struct args_sdio_read_data_buffer *args)
{
    uint8_t *part = find_part(lookup(args->oid), args->offset, args->len);

    sendf("sdio_read_data_buffer_response oid=%c data=%*s", args->oid,
          args->len, part);
}
DECL_COMMAND(command_sdio_read_data_buffer,
             "sdio_read_data_buffer oid=%c offset=%u len=%c");

void command_sdio_write_data_buffer(
    const struct args_sdio_write_data_buffer *args)
{
    uint8_t *part = find_part(lookup(args->oid), args->offset,
                              args->data_len);

    memcpy(part, args->data, args->data_len);
}
DECL_COMMAND(command_sdio_write_data_buffer,
             "sdio_write_data_buffer oid=%c offset=%u data=%*s");
