/*
 * Lets User-Mode Linux run on processors whose extended state is larger than its buffer (AMX).
 *
 * The kernel of the host takes back the registers of a process only as a whole: a PTRACE_SETREGSET of NT_X86_XSTATE with a
 * shorter buffer fails with EFAULT. User-Mode Linux 6.1 has 2696 bytes, up to the protection keys. This library, loaded in
 * front of libc by LD_PRELOAD, fills the rest with what the process has.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <string.h>
/* The declaration of libc has no fixed arguments. */
#define ptrace other_ptrace
#include <sys/ptrace.h>
#undef ptrace
#include <sys/types.h>
#include <sys/uio.h>

typedef long (*call)(int request, pid_t process, void *address, void *data);

/* Static: the stacks of that kernel are small, and it has one thread that does this. */
static unsigned char whole[64 * 1024] __attribute__((aligned(64)));

long ptrace(int request, pid_t process, void *address, void *data)
{
    static call next;
    if (!next)
        next = (call)dlsym(RTLD_NEXT, "ptrace");
    if (request == PTRACE_SETREGSET && address == (void *)NT_X86_XSTATE) {
        const struct iovec *part = data;
        struct iovec all = { whole, sizeof whole };
        if (next(PTRACE_GETREGSET, process, address, &all) == 0 && all.iov_len > part->iov_len) {
            memcpy(whole, part->iov_base, part->iov_len);
            return next(request, process, address, &all);
        }
    }
    return next(request, process, address, data);
}
