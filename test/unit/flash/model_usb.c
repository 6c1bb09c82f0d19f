// SPDX-License-Identifier: GPL-3.0-or-later
/* A libusb-1.0 whose only device is a model behind a socket: the functions that
 * dfu-util asks for.  Put in place of the real one by LD_LIBRARY_PATH.
 *
 * A request on the socket $MODEL_USB: 'C', the 8 bytes of the setup packet, and
 * the data of an OUT transfer; or 'R' for a reset of the bus.  The answer is an
 * int32, length or LIBUSB_ERROR_x, and the data of an IN transfer.  The device is
 * gone when the other side hangs up.
 */
#include <libusb-1.0/libusb.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#define MAX_DATA 65536
#define SETUP_SIZE 8
#define TIMEOUT 1000

struct libusb_context { int unused; };
struct libusb_device { int fd; };
struct libusb_device_handle { libusb_device *device; };

static struct libusb_context context;
static struct libusb_device model = {.fd = -1};
static struct libusb_device_handle handle = {.device = &model};
static const struct libusb_version version = {1, 0, 26, 0, "", "model"};

// ---- The socket

static int lose_device(void)
{
    if (model.fd >= 0)
        close(model.fd);
    model.fd = -1;
    return LIBUSB_ERROR_NO_DEVICE;
}

static int transmit(const void *data, size_t size)
{
    for (const char *at = data; size > 0;) {
        ssize_t done = send(model.fd, at, size, MSG_NOSIGNAL);
        if (done <= 0)
            return -1;
        at += done;
        size -= (size_t)done;
    }
    return 0;
}

static int receive(void *data, size_t size)
{
    return size && recv(model.fd, data, size, MSG_WAITALL) != (ssize_t)size ? -1 : 0;
}

/* Send a request of `size` bytes; what comes back goes to `in`, if it is not
 * NULL.  Returns the length or an error, as libusb does. */
static int request(const void *out, size_t size, unsigned char *in)
{
    int32_t status;
    if (model.fd < 0 || transmit(out, size) || receive(&status, sizeof(status)))
        return lose_device();
    if (in && status > 0 && receive(in, (size_t)status))
        return lose_device();
    return status;
}

static void find_device(void)
{
    struct sockaddr_un addr = {.sun_family = AF_UNIX};
    const char *path = getenv("MODEL_USB");
    if (model.fd >= 0 || !path)
        return;
    strncpy(addr.sun_path, path, sizeof(addr.sun_path) - 1);
    model.fd = socket(AF_UNIX, SOCK_STREAM, 0);
    if (connect(model.fd, (struct sockaddr *)&addr, sizeof(addr)))
        lose_device();
}

// ---- Transfers

int libusb_control_transfer(libusb_device_handle *h, uint8_t type, uint8_t req,
                            uint16_t value, uint16_t index, unsigned char *data,
                            uint16_t length, unsigned int timeout)
{
    unsigned char out[1 + SETUP_SIZE + MAX_DATA] = {
        'C', type, req, value & 0xff, value >> 8, index & 0xff, index >> 8,
        length & 0xff, length >> 8};
    int is_in = type & LIBUSB_ENDPOINT_IN;
    (void)h, (void)timeout;
    if (!is_in && length)
        memcpy(out + 1 + SETUP_SIZE, data, length);
    return request(out, 1 + SETUP_SIZE + (is_in ? 0 : length), is_in ? data : NULL);
}

static int get_descriptor(uint8_t type, unsigned char *data, uint16_t length)
{
    return libusb_control_transfer(&handle, LIBUSB_ENDPOINT_IN,
                                   LIBUSB_REQUEST_GET_DESCRIPTOR,
                                   (uint16_t)(type << 8), 0, data, length, TIMEOUT);
}

int libusb_set_interface_alt_setting(libusb_device_handle *h, int interface, int alt)
{
    return libusb_control_transfer(h, LIBUSB_RECIPIENT_INTERFACE,
                                   LIBUSB_REQUEST_SET_INTERFACE, (uint16_t)alt,
                                   (uint16_t)interface, NULL, 0, TIMEOUT);
}

int libusb_reset_device(libusb_device_handle *h)
{
    (void)h;
    // what comes back is another device, which libusb says so
    return request("R", 1, NULL) < 0 ? LIBUSB_ERROR_NOT_FOUND : 0;
}

// ---- Descriptors

static uint16_t read_u16(const unsigned char *at)
{
    return (uint16_t)(at[0] | at[1] << 8);
}

int libusb_get_device_descriptor(libusb_device *dev,
                                 struct libusb_device_descriptor *desc)
{
    unsigned char raw[LIBUSB_DT_DEVICE_SIZE];
    int status = get_descriptor(LIBUSB_DT_DEVICE, raw, sizeof(raw));
    (void)dev;
    if (status < 0)
        return status;
    memcpy(desc, raw, sizeof(raw));
    desc->bcdUSB = read_u16(raw + 2);
    desc->idVendor = read_u16(raw + 8);
    desc->idProduct = read_u16(raw + 10);
    desc->bcdDevice = read_u16(raw + 12);
    return 0;
}

static void append(const unsigned char **extra, int *length, const unsigned char *at)
{
    unsigned char *grown = malloc((size_t)*length + at[0]);
    if (*length)
        memcpy(grown, *extra, (size_t)*length);
    memcpy(grown + *length, at, at[0]);
    free((void *)*extra);
    *extra = grown;
    *length += at[0];
}

/* The one interface of a DFU device: its alternate settings, each with what the
 * class adds. */
static void add_alternate(struct libusb_interface *all, const unsigned char *at)
{
    size_t size = sizeof(*all->altsetting);
    struct libusb_interface_descriptor *list = realloc(
        (void *)all->altsetting, (size_t)(all->num_altsetting + 1) * size);
    memset(&list[all->num_altsetting], 0, size);
    memcpy(&list[all->num_altsetting], at, LIBUSB_DT_INTERFACE_SIZE);
    all->altsetting = list;
    all->num_altsetting++;
}

int libusb_get_config_descriptor(libusb_device *dev, uint8_t index,
                                 struct libusb_config_descriptor **found)
{
    unsigned char raw[1024];
    int size = get_descriptor(LIBUSB_DT_CONFIG, raw, sizeof(raw));
    (void)dev, (void)index;
    if (size < LIBUSB_DT_CONFIG_SIZE)
        return size < 0 ? size : LIBUSB_ERROR_IO;
    struct libusb_config_descriptor *config = calloc(1, sizeof(*config));
    struct libusb_interface *interface = calloc(1, sizeof(*interface));
    memcpy(config, raw, 2);
    config->wTotalLength = read_u16(raw + 2);
    memcpy(&config->bNumInterfaces, raw + 4, 5);
    config->interface = interface;
    for (int at = raw[0]; at + 2 <= size && raw[at]; at += raw[at]) {
        struct libusb_interface_descriptor *last = interface->num_altsetting
            ? (void *)&interface->altsetting[interface->num_altsetting - 1] : NULL;
        if (raw[at + 1] == LIBUSB_DT_INTERFACE)
            add_alternate(interface, raw + at);
        else if (last)
            append(&last->extra, &last->extra_length, raw + at);
        else
            append(&config->extra, &config->extra_length, raw + at);
    }
    *found = config;
    return 0;
}

void libusb_free_config_descriptor(struct libusb_config_descriptor *config)
{
    const struct libusb_interface *interface = config->interface;
    for (int i = 0; i < interface->num_altsetting; i++)
        free((void *)interface->altsetting[i].extra);
    free((void *)interface->altsetting);
    free((void *)interface);
    free((void *)config->extra);
    free(config);
}

// ---- The bus

ssize_t libusb_get_device_list(libusb_context *ctx, libusb_device ***list)
{
    (void)ctx;
    find_device();
    *list = calloc(2, sizeof(**list));
    (*list)[0] = model.fd < 0 ? NULL : &model;
    return model.fd >= 0;
}

void libusb_free_device_list(libusb_device **list, int unref)
{
    (void)unref;
    free(list);
}

int libusb_init(libusb_context **ctx)
{
    if (ctx)
        *ctx = &context;
    return 0;
}

void libusb_exit(libusb_context *ctx)
{
    (void)ctx;
    lose_device();
}

int libusb_set_option(libusb_context *ctx, enum libusb_option option, ...)
{
    (void)ctx, (void)option;
    return 0;
}

const struct libusb_version *libusb_get_version(void)
{
    return &version;
}

const char *libusb_error_name(int code)
{
    return code == LIBUSB_ERROR_PIPE ? "LIBUSB_ERROR_PIPE"
        : code == LIBUSB_ERROR_NO_DEVICE ? "LIBUSB_ERROR_NO_DEVICE"
        : "LIBUSB_ERROR_OTHER";
}

int libusb_open(libusb_device *dev, libusb_device_handle **h)
{
    (void)dev;
    *h = &handle;
    return model.fd < 0 ? LIBUSB_ERROR_NO_DEVICE : 0;
}

void libusb_close(libusb_device_handle *h)
{
    (void)h;
}

libusb_device *libusb_ref_device(libusb_device *dev)
{
    return dev;
}

void libusb_unref_device(libusb_device *dev)
{
    (void)dev;
}

int libusb_claim_interface(libusb_device_handle *h, int interface)
{
    (void)h, (void)interface;
    return 0;
}

int libusb_release_interface(libusb_device_handle *h, int interface)
{
    (void)h, (void)interface;
    return 0;
}

uint8_t libusb_get_bus_number(libusb_device *dev)
{
    (void)dev;
    return 1;
}

uint8_t libusb_get_device_address(libusb_device *dev)
{
    (void)dev;
    return 2;
}

int libusb_get_port_numbers(libusb_device *dev, uint8_t *ports, int size)
{
    (void)dev, (void)size;
    ports[0] = 1;
    return 1;
}
