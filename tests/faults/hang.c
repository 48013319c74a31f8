/* Preloaded (LD_PRELOAD) into a program, blocks one of its threads for good: the one named HANG_THREAD, when it next asks for
 * memory once the file HANG_WHEN is there. It holds no lock of the allocator then. tests/tests/ends.rs builds and uses it. */

#define _GNU_SOURCE
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <unistd.h>

/* glibc's own */
extern void *__libc_malloc(size_t size);

static _Thread_local enum { UNKNOWN, OTHER, WANTED } self;
static _Thread_local unsigned calls;

static void hang_if_wanted(void)
{
    const char *name = getenv("HANG_THREAD"), *when = getenv("HANG_WHEN");
    char own[16] = "";

    /* a thread has its name from its first moments, but not from its first allocation */
    if (self == UNKNOWN && name && when && !prctl(PR_GET_NAME, own) && ++calls > 100)
        self = strcmp(own, name) ? OTHER : WANTED;
    if (self == WANTED && access(when, F_OK) == 0)
        for (;;)
            pause();
}

void *malloc(size_t size)
{
    hang_if_wanted();
    return __libc_malloc(size);
}
