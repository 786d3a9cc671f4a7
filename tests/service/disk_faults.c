/* Preloaded into the daemon: calls on files fail as long as a file says so, whose path is in MBCOSIM_DISK_FAULTS. Its lines: CALL ERRNO PATTERN,
   as fnmatch understands it, of the file's path. In place of an error -N: it takes N seconds. */
#define _GNU_SOURCE
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

static int fails(const char* call, const char* path) {
  char text[4096], name[32], pattern[1024], *rest = NULL;
  const int before = errno;
  const char* faults = getenv("MBCOSIM_DISK_FAULTS");
  const long file = faults ? syscall(SYS_openat, AT_FDCWD, faults, O_RDONLY | O_CLOEXEC) : -1;
  const long size = file < 0 ? 0 : syscall(SYS_read, file, text, sizeof text - 1);
  if (file >= 0) syscall(SYS_close, file);
  text[size > 0 ? size : 0] = '\0';
  errno = before;
  for (char* line = strtok_r(text, "\n", &rest); line; line = strtok_r(NULL, "\n", &rest)) {
    int number = 0;
    if (sscanf(line, "%31s %d %1023s", name, &number, pattern) != 3 || strcmp(name, call) != 0 || fnmatch(pattern, path, 0) != 0) continue;
    if (number < 0) {
      sleep((unsigned)-number);
      return 0;
    }
    errno = number;
    return 1;
  }
  return 0;
}

static int fails_at(const char* call, int file) {
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const int before = errno;
  const ssize_t size = readlink(link, path, sizeof path - 1);
  errno = before;
  if (size < 0) return 0;
  path[size] = '\0';
  return fails(call, path);
}

int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = va_arg(arguments, mode_t);
  va_end(arguments);
  if ((flags & O_ACCMODE) != O_RDONLY && fails("open", path)) return -1;
  return (int)syscall(SYS_openat, AT_FDCWD, path, flags, mode);
}
int open64(const char* path, int flags, ...) __attribute__((alias("open")));

ssize_t write(int file, const void* bytes, size_t size) { return fails_at("write", file) ? -1 : syscall(SYS_write, file, bytes, size); }
int fsync(int file) { return fails_at("fsync", file) ? -1 : (int)syscall(SYS_fsync, file); }
int fdatasync(int file) { return fails_at("fdatasync", file) ? -1 : (int)syscall(SYS_fdatasync, file); }
int ftruncate(int file, off_t size) { return fails_at("ftruncate", file) ? -1 : (int)syscall(SYS_ftruncate, file, size); }
int ftruncate64(int file, off64_t size) __attribute__((alias("ftruncate")));
int mkdir(const char* path, mode_t mode) { return fails("mkdir", path) ? -1 : (int)syscall(SYS_mkdir, path, mode); }
int unlink(const char* path) { return fails("unlink", path) ? -1 : (int)syscall(SYS_unlink, path); }
int unlinkat(int folder, const char* path, int flags) {
  const int is_refused = path[0] == '/' ? fails("unlink", path) : fails_at("unlink", folder);
  return is_refused ? -1 : (int)syscall(SYS_unlinkat, folder, path, flags);
}
int rename(const char* from, const char* to) { return fails("rename", from) ? -1 : (int)syscall(SYS_rename, from, to); }
