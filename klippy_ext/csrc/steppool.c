/* SPDX-License-Identifier: GPL-3.0-or-later
 * Threads that work beside the main thread.  See steppool.h. */
#include <errno.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>

#include "steppool.h"

struct piece {
    void (*work)(void *ctx);
    void *ctx;
};

struct steppool {
    pthread_mutex_t lock;       /* of all that follows */
    pthread_cond_t begun, done;
    struct piece *pieces;
    int n_pieces, size;
    int n_started;              /* pieces that threads may take */
    int next;                   /* the first that nobody has taken */
    int n_running;
    int is_ending;
    pthread_t *threads;
    int n_threads, n_wanted;
};

struct steppool *_Atomic steppool_running;

struct steppool *
steppool_new(int n_threads)
{
    struct steppool *p = calloc(1, sizeof(*p));

    if (!p)
        return NULL;
    p->threads = calloc((size_t)n_threads + 1, sizeof(*p->threads));
    if (!p->threads) {
        free(p);
        return NULL;
    }
    p->n_wanted = n_threads;
    pthread_mutex_init(&p->lock, NULL);
    pthread_cond_init(&p->begun, NULL);
    pthread_cond_init(&p->done, NULL);
    return p;
}

int
steppool_add(struct steppool *p, void (*work)(void *ctx), void *ctx)
{
    if (p->n_pieces == p->size) {
        int size = 2 * p->size + 8;
        struct piece *grown = realloc(p->pieces,
                                      (size_t)size * sizeof(*grown));
        if (!grown)
            return -ENOMEM;
        p->pieces = grown;
        p->size = size;
    }
    p->pieces[p->n_pieces++] = (struct piece) { work, ctx };
    return 0;
}

/* Do one piece that nobody has taken; the lock is held, but not meanwhile.
 * Returns 0 if there was none. */
static int
do_one(struct steppool *p)
{
    struct piece piece;

    if (p->next == p->n_started)
        return 0;
    piece = p->pieces[p->next++];
    p->n_running++;
    pthread_mutex_unlock(&p->lock);
    piece.work(piece.ctx);
    pthread_mutex_lock(&p->lock);
    p->n_running--;
    if (!p->n_running && p->next == p->n_started)
        pthread_cond_broadcast(&p->done);
    return 1;
}

static void *
run_thread(void *arg)
{
    struct steppool *p = arg;

    pthread_mutex_lock(&p->lock);
    while (!p->is_ending)
        if (!do_one(p))
            pthread_cond_wait(&p->begun, &p->lock);
    pthread_mutex_unlock(&p->lock);
    return NULL;
}

/* Signals are for the main thread.  With fewer threads than wanted, or none,
 * the work is done nevertheless. */
static void
begin_threads(struct steppool *p)
{
    sigset_t all, old;

    if (p->n_threads == p->n_wanted)
        return;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    while (p->n_threads < p->n_wanted
           && !pthread_create(&p->threads[p->n_threads], NULL, run_thread, p))
        p->n_threads++;
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    p->n_wanted = p->n_threads;
}

void
steppool_start(struct steppool *p)
{
    steppool_settle();
    if (!p->n_pieces)
        return;
    begin_threads(p);
    pthread_mutex_lock(&p->lock);
    p->n_started = p->n_pieces;
    p->next = 0;
    atomic_store_explicit(&steppool_running, p, memory_order_release);
    pthread_cond_broadcast(&p->begun);
    pthread_mutex_unlock(&p->lock);
}

void
steppool_finish(struct steppool *p)
{
    pthread_mutex_lock(&p->lock);
    while (do_one(p))
        ;
    while (p->n_running)
        pthread_cond_wait(&p->done, &p->lock);
    if (p->n_started) {
        p->n_started = p->next = p->n_pieces = 0;
        atomic_store_explicit(&steppool_running, NULL, memory_order_release);
    }
    pthread_mutex_unlock(&p->lock);
}

/* Is every count in its range?  The lock is held. */
static int
is_consistent(const struct steppool *p)
{
    struct steppool *running = atomic_load_explicit(&steppool_running,
                                                    memory_order_acquire);

    return 0 <= p->next && p->next <= p->n_started
        && p->n_started <= p->n_pieces && p->n_pieces <= p->size
        && 0 <= p->n_running && p->n_running <= p->next
        && 0 <= p->n_threads && p->n_threads <= p->n_wanted
        && (running == p) == (p->n_started > 0);
}

int
steppool_check(struct steppool *p)
{
    int ret = 0;

    pthread_mutex_lock(&p->lock);
    if (!is_consistent(p))
        ret = -EINVAL;
    for (int i = 0; i < p->n_pieces; i++)
        if (!p->pieces[i].work)
            ret = -EINVAL;
    pthread_mutex_unlock(&p->lock);
    return ret;
}

void
steppool_delete(struct steppool *p)
{
    if (!p)
        return;
    steppool_finish(p);
    pthread_mutex_lock(&p->lock);
    p->is_ending = 1;
    pthread_cond_broadcast(&p->begun);
    pthread_mutex_unlock(&p->lock);
    for (int i = 0; i < p->n_threads; i++)
        pthread_join(p->threads[i], NULL);
    pthread_cond_destroy(&p->begun);
    pthread_cond_destroy(&p->done);
    pthread_mutex_destroy(&p->lock);
    free(p->threads);
    free(p->pieces);
    free(p);
}
