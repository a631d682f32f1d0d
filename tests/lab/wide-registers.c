/* For the user-mode kernel of vcan-run on a CPU with AMX, loaded into it with LD_PRELOAD.
 *
 * The register state (XSAVE) of such a CPU is larger than that kernel's buffer for it. Linux lets a tracer
 * read a part of it and refuses a part that is written (x86 xstateregs_set: EFAULT or EINVAL), and the kernel
 * panics in put_fp_registers before its first process. So the part is written into the whole.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <elf.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/types.h>
#include <sys/uio.h>

#ifndef NT_X86_XSTATE
#define NT_X86_XSTATE 0x202
#endif

static long (*next)(int, pid_t, void *, void *);

__attribute__((constructor)) static void find_next(void) { next = dlsym(RTLD_NEXT, "ptrace"); }

long ptrace(enum __ptrace_request request, ...)
{
    static char whole[1 << 16] __attribute__((aligned(64)));
    va_list rest;
    va_start(rest, request);
    pid_t pid = va_arg(rest, pid_t);
    void *address = va_arg(rest, void *);
    void *data = va_arg(rest, void *);
    va_end(rest);
    if (request == PTRACE_SETREGSET && (long)address == NT_X86_XSTATE) {
        struct iovec *part = data;
        struct iovec all = {whole, sizeof whole};
        long result = next(PTRACE_GETREGSET, pid, address, &all);
        if (result == 0 && part->iov_len < all.iov_len) {
            memcpy(whole, part->iov_base, part->iov_len);
            return next(PTRACE_SETREGSET, pid, address, &all);
        }
    }
    return next(request, pid, address, data);
}
