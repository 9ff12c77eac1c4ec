/* Preloaded into the programs of tests/faults: counts the calls that change files below one folder, and makes one of
   them fail or the last. fault_arm() arms it in the process that is to suffer. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>

enum { COUNT, KILL, FAIL, INTERRUPT, RUN_FULL };

static char folder[4096];
static int kind = COUNT, error_number = 0;
static volatile long at = -1, count = 0, failed = 0;

/* `at` counts from 0. FAIL: that call fails with `number`. RUN_FULL: that one and all later ones that need room. */
void fault_arm(const char* path, int what, long call, int number) {
    strncpy(folder, path, sizeof folder - 1);
    kind = what;
    at = call;
    error_number = number;
    count = failed = 0;
}
long fault_count(void) { return count; }
long fault_failed(void) { return failed; }

static __attribute__((noinline)) int is_ours(const char* path) {
    char whole[8192];
    if (!folder[0] || !path) return 0;
    if (path[0] != '/') {
        if (!getcwd(whole, 4096)) return 0;
        strcat(whole, "/");
        strncat(whole, path, 4000);
        path = whole;
    }
    return strncmp(path, folder, strlen(folder)) == 0 && path[strlen(folder)] == '/';
}

static __attribute__((noinline)) int has_our_name(int file) {
    char link[64], path[4096];
    snprintf(link, sizeof link, "/proc/self/fd/%d", file);
    const ssize_t length = readlink(link, path, sizeof path - 1);
    if (length <= 0) return 0;
    path[length] = 0;
    return path[0] == '/' && (is_ours(path) || strcmp(path, folder) == 0);
}

/* Python's handlers of signals write to a socket, on faulthandler's small stack: nothing large may be on it. */
static int is_our_file(int file) {
    struct stat status;
    if (!folder[0] || fstat(file, &status) != 0 || !(S_ISREG(status.st_mode) || S_ISDIR(status.st_mode))) return 0;
    return has_our_name(file);
}

/* Whether this call has to fail. Of a write that is the last call, half arrives. */
static int strikes(int needs_room) {
    const long now = __sync_fetch_and_add(&count, 1);
    if (at < 0 || now < at || (now > at && !(kind == RUN_FULL && needs_room))) return 0;
    __sync_fetch_and_add(&failed, 1);
    if (kind == INTERRUPT) {
        kill(getpid(), SIGINT);
        return 0;
    }
    return kind != COUNT;
}

#define REAL(type, name, ...) \
    static type (*real)(__VA_ARGS__); \
    if (!real) real = (type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, name)
#define FALL(half) \
    do { \
        if (kind == KILL) { half; kill(getpid(), SIGKILL); for (;;) pause(); } \
        errno = error_number; \
        return -1; \
    } while (0)

ssize_t write(int file, const void* data, size_t size) {
    REAL(ssize_t, "write", int, const void*, size_t);
    if (is_our_file(file) && strikes(1)) FALL(if (real(file, data, size / 2)) {});
    return real(file, data, size);
}
#define PWRITE(name) \
    ssize_t name(int file, const void* data, size_t size, off_t place) { \
        REAL(ssize_t, #name, int, const void*, size_t, off_t); \
        if (is_our_file(file) && strikes(1)) FALL(if (real(file, data, size / 2, place)) {}); \
        return real(file, data, size, place); \
    }
PWRITE(pwrite)
PWRITE(pwrite64)
#define ONE_FILE(name) \
    int name(int file) { \
        REAL(int, #name, int); \
        if (is_our_file(file) && strikes(0)) FALL(); \
        return real(file); \
    }
ONE_FILE(fsync)
ONE_FILE(fdatasync)
#define TRUNCATE(name) \
    int name(int file, off_t size) { \
        REAL(int, #name, int, off_t); \
        if (is_our_file(file) && strikes(0)) FALL(); \
        return real(file, size); \
    }
TRUNCATE(ftruncate)
TRUNCATE(ftruncate64)
int fchmod(int file, mode_t mode) {
    REAL(int, "fchmod", int, mode_t);
    if (is_our_file(file) && strikes(0)) FALL();
    return real(file, mode);
}
int rename(const char* from, const char* to) {
    REAL(int, "rename", const char*, const char*);
    if (is_ours(to) && strikes(0)) FALL();
    return real(from, to);
}
int unlink(const char* path) {
    REAL(int, "unlink", const char*);
    if (is_ours(path) && strikes(0)) FALL();
    return real(path);
}
int mkdir(const char* path, mode_t mode) {
    REAL(int, "mkdir", const char*, mode_t);
    if (is_ours(path) && strikes(1)) FALL();
    return real(path, mode);
}
#define OPEN(name) \
    int name(const char* path, int flags, ...) { \
        REAL(int, #name, const char*, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest); \
        if (flags & (O_CREAT | O_WRONLY | O_RDWR) && is_ours(path) && strikes(1)) FALL(); \
        return real(path, flags, mode); \
    }
OPEN(open)
OPEN(open64)
#define OPENAT(name) \
    int name(int where, const char* path, int flags, ...) { \
        REAL(int, #name, int, const char*, int, ...); \
        va_list rest; \
        va_start(rest, flags); \
        const mode_t mode = flags & (O_CREAT | O_TMPFILE) ? va_arg(rest, mode_t) : 0; \
        va_end(rest); \
        if (flags & (O_CREAT | O_WRONLY | O_RDWR) && is_ours(path) && strikes(1)) FALL(); \
        return real(where, path, flags, mode); \
    }
OPENAT(openat)
OPENAT(openat64)
