/* SPDX-License-Identifier: GPL-3.0-or-later
 *
 * A serial queue on a socket, with its thread, and one into a file, again and
 * again, with the N-th allocation failing: whoever asked is told, a message of
 * the mcu that is lost is told of, and nothing leaks.  Built with malloc,
 * calloc, realloc and strdup wrapped.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <unistd.h>

#include "failing_memory.h"
#include "serialqueue.h"

enum { N_RECEIVED = 16, N_SENT = 8 };

/* 0, or -1 if somebody was told that there is no memory. */
static int
send_all(struct serialqueue *sq)
{
    const uint8_t message[] = { 7, 8 };
    struct cmdqueue *cq = serialqueue_add_queue(sq);
    int ret = 0;

    if (!cq)
        return -1;
    for (uint64_t i = 1; i <= N_SENT && !ret; i++)
        ret = serialqueue_send(sq, cq, message, sizeof(message), 0, 0, i);
    expect(!ret || ret == -ENOMEM, "the reason");
    return ret ? -1 : 0;
}

/* Pull what an mcu said; returns how often there was word of a loss. */
static int
receive_all(struct serialqueue *sq, int mcu_fd)
{
    int n_told = 0;

    for (uint8_t i = 0; i < N_RECEIVED; i++) {
        uint8_t block[MSGBLOCK_MAX], payload[] = { 9, i };
        size_t len = msgblock_build(block, i, payload, sizeof(payload));
        struct qmsg *m;
        expect(write(mcu_fd, block, len) == (ssize_t)len, "the mcu speaks");
        m = serialqueue_pull(sq, 1);
        expect(m != NULL, "something comes");
        expect(!m->notify_id && (!m->len || m->data[1] == i), "what came");
        n_told += !m->len;
        qmsg_free(m);
    }
    return n_told;
}

/* 0, -1 if refused, else how often a loss was told of. */
static int
try_thread(void)
{
    int fds[2], ret = -1;
    struct serialqueue *sq;

    expect(!socketpair(AF_UNIX, SOCK_STREAM, 0, fds), "sockets");
    sq = serialqueue_open_fd(hostclock_get_real(), fds[0], SERIALQUEUE_UART,
                             0);
    if (sq) {
        ret = receive_all(sq, fds[1]);
        if (!ret)
            ret = send_all(sq);
        expect(!serialqueue_check(sq), "the queue holds");
        expect(!serialqueue_close(sq), "the link works to the end");
    }
    serialqueue_free(sq);
    close(fds[0]);
    close(fds[1]);
    return ret;
}

static int
try_file(void)
{
    FILE *file = tmpfile();
    struct serialqueue *sq;
    int ret = -1;

    expect(file != NULL, "a file");
    sq = serialqueue_open_file(hostclock_get_real(), fileno(file));
    if (sq) {
        ret = send_all(sq);
        expect(!serialqueue_check(sq), "the file's queue holds");
        expect(!serialqueue_close(sq), "all is written");
        if (!ret)
            expect(lseek(fileno(file), 0, SEEK_END) > 2 * N_SENT, "the file");
    }
    serialqueue_free(sq);
    fclose(file);
    return ret;
}

int
main(void)
{
    long total, refused = 0, told = 0;

    expect(!try_thread() && !try_file(), "no error");
    total = n_allocs;
    for (failing = 1; failing <= total; failing++) {
        int by_thread, by_file;
        n_allocs = 0;
        by_thread = try_thread();
        by_file = by_thread ? 0 : try_file();
        expect(by_thread <= 1, "it is told once");
        refused += by_thread < 0 || by_file < 0;
        told += by_thread > 0;
    }
    printf("%ld allocations, %ld refused, %ld told\n", total, refused, told);
    return 0;
}
