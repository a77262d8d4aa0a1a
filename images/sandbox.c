#include "sandbox.h"

#include <errno.h>
#include <fcntl.h>
#include <linux/fs.h>
#include <sched.h>
#include <seccomp.h>
#include <signal.h>
#include <stddef.h>
#include <sys/resource.h>
#include <unistd.h>

#include "memory_limits.h"

/* AddressSanitizer keeps freed memory, which would count against the limit. */
#if defined(__SANITIZE_ADDRESS__)
#define TRIP_HEAP_IS_WATCHED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define TRIP_HEAP_IS_WATCHED 1
#endif
#endif
#ifndef TRIP_HEAP_IS_WATCHED
#define TRIP_HEAP_IS_WATCHED 0
#endif

/* Room for decoders' tables, file buffers and the stacks of their threads. */
#define LIBRARIES_BYTES ((uint64_t)64 << 20)

/* System calls that are missing in headers older than the kernel. x86-64 and 64-bit ARM use the
 * same numbers. */
enum {
    CALL_FCHMODAT2 = 452,
    CALL_SETXATTRAT = 463,
    CALL_REMOVEXATTRAT = 466,
    CALL_FILE_SETATTR = 469,
};

/* Calls that no decoder needs. libseccomp defines the names and ignores calls that the machine does
 * not have. */
static const int denied[] = {
    /* programs and processes */
    SCMP_SYS(execve),
    SCMP_SYS(execveat),
    SCMP_SYS(fork),
    SCMP_SYS(vfork),
    SCMP_SYS(ptrace),
    SCMP_SYS(process_vm_readv),
    SCMP_SYS(process_vm_writev),
    SCMP_SYS(process_madvise),
    SCMP_SYS(pidfd_open),
    SCMP_SYS(pidfd_getfd),
    SCMP_SYS(pidfd_send_signal),
    SCMP_SYS(kcmp),
    SCMP_SYS(setpriority),
    /* network */
    SCMP_SYS(socket),
    SCMP_SYS(socketpair),
    SCMP_SYS(connect),
    SCMP_SYS(bind),
    SCMP_SYS(listen),
    SCMP_SYS(accept),
    SCMP_SYS(accept4),
    SCMP_SYS(socketcall),
    /* names and attributes of files */
    SCMP_SYS(creat),
    SCMP_SYS(unlink),
    SCMP_SYS(unlinkat),
    SCMP_SYS(rename),
    SCMP_SYS(renameat),
    SCMP_SYS(renameat2),
    SCMP_SYS(link),
    SCMP_SYS(linkat),
    SCMP_SYS(symlink),
    SCMP_SYS(symlinkat),
    SCMP_SYS(mkdir),
    SCMP_SYS(mkdirat),
    SCMP_SYS(rmdir),
    SCMP_SYS(mknod),
    SCMP_SYS(mknodat),
    SCMP_SYS(truncate),
    SCMP_SYS(chmod),
    SCMP_SYS(fchmod),
    SCMP_SYS(fchmodat),
    SCMP_SYS(chown),
    SCMP_SYS(fchown),
    SCMP_SYS(lchown),
    SCMP_SYS(fchownat),
    SCMP_SYS(utime),
    SCMP_SYS(utimes),
    SCMP_SYS(utimensat),
    SCMP_SYS(futimesat),
    SCMP_SYS(setxattr),
    SCMP_SYS(lsetxattr),
    SCMP_SYS(fsetxattr),
    SCMP_SYS(removexattr),
    SCMP_SYS(lremovexattr),
    SCMP_SYS(fremovexattr),
    CALL_FCHMODAT2,
    CALL_SETXATTRAT,
    CALL_REMOVEXATTRAT,
    CALL_FILE_SETATTR,
    /* the system */
    SCMP_SYS(mount),
    SCMP_SYS(umount2),
    SCMP_SYS(pivot_root),
    SCMP_SYS(chroot),
    SCMP_SYS(unshare),
    SCMP_SYS(setns),
    SCMP_SYS(fsopen),
    SCMP_SYS(move_mount),
    SCMP_SYS(open_tree),
    SCMP_SYS(open_by_handle_at),
    SCMP_SYS(bpf),
    SCMP_SYS(perf_event_open),
    SCMP_SYS(userfaultfd),
    SCMP_SYS(keyctl),
    SCMP_SYS(add_key),
    SCMP_SYS(request_key),
    SCMP_SYS(init_module),
    SCMP_SYS(finit_module),
    SCMP_SYS(delete_module),
    SCMP_SYS(kexec_load),
    SCMP_SYS(reboot),
    SCMP_SYS(swapon),
    SCMP_SYS(swapoff),
    SCMP_SYS(sethostname),
    SCMP_SYS(setdomainname),
    SCMP_SYS(personality),
    SCMP_SYS(io_uring_setup),
    SCMP_SYS(io_uring_enter),
    SCMP_SYS(quotactl),
    SCMP_SYS(acct),
    SCMP_SYS(clock_settime),
    SCMP_SYS(settimeofday),
};

static bool deny(scmp_filter_ctx filter, int call)
{
    return seccomp_rule_add(filter, SCMP_ACT_ERRNO(EPERM), call, 0) == 0;
}

/* Denies a call if `argument` has all of `bits` set. */
static bool deny_bits(scmp_filter_ctx filter, int call, unsigned argument, uint64_t bits)
{
    struct scmp_arg_cmp has = SCMP_CMP64(argument, SCMP_CMP_MASKED_EQ, bits, bits);
    return seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EPERM), call, 1, &has) == 0;
}

/* Denies changes to a file's flags and project, which need only a descriptor for reading. */
static bool deny_flags(scmp_filter_ctx filter)
{
    static const unsigned requests[] = { FS_IOC_SETFLAGS, FS_IOC_FSSETXATTR };
    bool good = true;
    for (size_t i = 0; i < sizeof requests / sizeof requests[0]; i++) {
        struct scmp_arg_cmp is = SCMP_CMP64(1, SCMP_CMP_MASKED_EQ, UINT32_MAX, requests[i]);
        good = good &&
               seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(ioctl), 1, &is) == 0;
    }
    return good;
}

/* Denies opening files for writing. Filters cannot see the flags of openat2(), so it fails as an
 * unknown call. */
static bool deny_writing(scmp_filter_ctx filter)
{
    static const uint64_t flags[] = { O_WRONLY, O_RDWR, O_CREAT, O_TRUNC };
    bool good = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(openat2), 0) == 0;
    for (size_t i = 0; i < sizeof flags / sizeof flags[0]; i++)
        good = good && deny_bits(filter, SCMP_SYS(open), 1, flags[i]) &&
               deny_bits(filter, SCMP_SYS(openat), 2, flags[i]);
    return good;
}

/* Allows threads but no other processes, and signals only to this process, which abort() needs.
 * Filters cannot see the flags of clone3(), so it fails as an unknown call. The C library then uses
 * clone(). */
static bool deny_others(scmp_filter_ctx filter)
{
    static const int signals[] = { SCMP_SYS(kill), SCMP_SYS(tgkill), SCMP_SYS(rt_sigqueueinfo),
                                   SCMP_SYS(rt_tgsigqueueinfo) };
    struct scmp_arg_cmp no_thread = SCMP_CMP64(0, SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0);
    struct scmp_arg_cmp other = SCMP_CMP64(0, SCMP_CMP_NE, (uint64_t)getpid(), 0);
    bool good = seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0) == 0 &&
                seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EPERM), SCMP_SYS(clone), 1,
                                       &no_thread) == 0 &&
                deny(filter, SCMP_SYS(tkill));
    for (size_t i = 0; i < sizeof signals / sizeof signals[0]; i++)
        good = good &&
               seccomp_rule_add_array(filter, SCMP_ACT_ERRNO(EPERM), signals[i], 1, &other) == 0;
    return good;
}

bool trip_sandbox_enter(void)
{
    scmp_filter_ctx filter = seccomp_init(SCMP_ACT_ALLOW);
    /* Includes the threads that libraries have already started, if the kernel supports it. */
    if (filter)
        (void)seccomp_attr_set(filter, SCMP_FLTATR_CTL_TSYNC, 1);
    bool good = filter && deny_writing(filter) && deny_flags(filter) && deny_others(filter);
    for (size_t i = 0; good && i < sizeof denied / sizeof denied[0]; i++)
        good = deny(filter, denied[i]);
    good = good && seccomp_load(filter) == 0;
    if (filter)
        seccomp_release(filter);
    return good;
}

void trip_sandbox_limit_memory(uint64_t bytes)
{
#if !TRIP_HEAP_IS_WATCHED
    uint64_t limit = trip_proc_field_bytes("/proc/self/status", "VmData");
    struct rlimit old;
    if (__builtin_add_overflow(limit, LIBRARIES_BYTES, &limit) ||
        __builtin_add_overflow(limit, bytes, &limit) || getrlimit(RLIMIT_DATA, &old) != 0)
        return;
    if (limit < old.rlim_cur)
        setrlimit(RLIMIT_DATA, &(struct rlimit){ limit, limit });
#else
    (void)bytes;
#endif
}
