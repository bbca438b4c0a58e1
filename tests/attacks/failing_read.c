// Loaded before a program (LD_PRELOAD): its read number FAILING_READ of a regular file says that the device is broken.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static int fails(int file) {
  static atomic_int count;
  struct stat status;
  const char* at = getenv("FAILING_READ");
  if (at == NULL || fstat(file, &status) != 0 || !S_ISREG(status.st_mode)) return 0;
  if (atomic_fetch_add(&count, 1) + 1 != atoi(at)) return 0;
  errno = EIO;
  return 1;
}

ssize_t read(int file, void* to, size_t size) {
  static ssize_t (*next)(int, void*, size_t);
  if (next == NULL) next = (ssize_t(*)(int, void*, size_t))dlsym(RTLD_NEXT, "read");
  return fails(file) ? -1 : next(file, to, size);
}

ssize_t __read_chk(int file, void* to, size_t size, size_t room) {
  (void)room;
  return read(file, to, size);
}
