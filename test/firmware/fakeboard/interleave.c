/* SPDX-License-Identifier: GPL-3.0-or-later
 * A point where an interrupt may strike, before each memory access of the
 * firmware: what gcc's thread sanitizer would call in its own library. */
#include "fakeboard.h"

#define ACCESS(NAME) \
    void __tsan_##NAME(void *address); \
    void __tsan_##NAME(void *address) \
    { \
        (void)address; \
        fake_note_access(); \
    }

ACCESS(read1)
ACCESS(read2)
ACCESS(read4)
ACCESS(read8)
ACCESS(read16)
ACCESS(write1)
ACCESS(write2)
ACCESS(write4)
ACCESS(write8)
ACCESS(write16)
ACCESS(unaligned_read2)
ACCESS(unaligned_read4)
ACCESS(unaligned_read8)
ACCESS(unaligned_read16)
ACCESS(unaligned_write2)
ACCESS(unaligned_write4)
ACCESS(unaligned_write8)
ACCESS(unaligned_write16)

void __tsan_read_range(void *address, long size);
void __tsan_write_range(void *address, long size);
void __tsan_init(void);

void __tsan_read_range(void *address, long size)
{
    (void)address;
    (void)size;
    fake_note_access();
}

void __tsan_write_range(void *address, long size)
{
    __tsan_read_range(address, size);
}

void __tsan_init(void)
{
}
