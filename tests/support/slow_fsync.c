// Preloaded into a program: its first fsync of a checkpoint takes BEDFLOW_SLOW_FSYNC_SECONDS, as on a disk that has stalled.
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

int fsync(int file) {
  static int done = 0;
  char link[64], path[4096];
  snprintf(link, sizeof link, "/proc/self/fd/%d", file);
  const ssize_t length = readlink(link, path, sizeof path - 1);
  const char* seconds = getenv("BEDFLOW_SLOW_FSYNC_SECONDS");
  if (length > 0 && seconds && !done) {
    path[length] = 0;
    if (strstr(path, "/checkpoint_")) {
      done = 1;
      usleep((useconds_t)(1e6 * atof(seconds)));
    }
  }
  int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
  return real(file);
}
