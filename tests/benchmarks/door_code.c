/* A code that speaks MBDyn's protocol over a Unix socket; doors.py runs it.

   usage: door_code PATH POINTS PER_STEP

   Pushes the first point, is done with every PER_STEP-th answer, and prints the median and the 99 % quantile of the time from the first message
   of a step to that of the next one [us] when the other side ends. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <time.h>
#include <unistd.h>

enum { kMostSteps = 1 << 20, kMostPoints = 64, kState = 18, kLoads = 6 };

static void take(int s, void* bytes, size_t size) {
  for (char* p = bytes; size > 0;) {
    const ssize_t n = recv(s, p, size, 0);
    if (n <= 0) exit(2);
    p += n;
    size -= (size_t)n;
  }
}

static int connect_to(const char* path) {
  struct sockaddr_un address = {.sun_family = AF_UNIX};
  strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  for (int tries = 0; tries < 30000; ++tries) {
    const int s = socket(AF_UNIX, SOCK_STREAM, 0);
    if (connect(s, (const struct sockaddr*)&address, sizeof address) == 0) return s;
    close(s);
    usleep(1000);
  }
  exit(3);
}

static double microseconds(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e6 * (double)t.tv_sec + 1e-3 * (double)t.tv_nsec;
}

static int compare(const void* a, const void* b) {
  const double x = *(const double*)a, y = *(const double*)b;
  return x < y ? -1 : x > y;
}

int main(int count, char** arguments) {
  static double begins[kMostSteps], state[kState * kMostPoints];
  static char answer[1 + sizeof(double) * kLoads * kMostPoints];
  if (count != 4) return 1;
  const int points = atoi(arguments[2]), per_step = atoi(arguments[3]), s = connect_to(arguments[1]);
  unsigned char request[9] = {7, 2, 2, 0, 0, (unsigned char)points, 0, 0, 0};
  const double push = 1;
  if (points < 1 || points > kMostPoints || send(s, request, sizeof request, 0) != sizeof request) return 1;
  take(s, request, 1);
  memcpy(answer + 1, &push, sizeof push);
  int steps = 0;
  for (long exchanges = 0;; ++exchanges) {
    take(s, request, 1);
    if (request[0] == 5 || steps == kMostSteps) break;
    take(s, state, sizeof(double) * kState * (size_t)points);
    if (exchanges % per_step == 0) begins[steps++] = microseconds();
    answer[0] = (exchanges + 1) % per_step == 0 ? 6 : 2;
    if (send(s, answer, 1 + sizeof(double) * kLoads * (size_t)points, 0) < 0) return 2;
  }
  const int first = steps / 10, samples = steps - 1 - first;
  if (samples < 1) return 1;
  for (int k = 0; k + 1 < steps; ++k) begins[k] = begins[k + 1] - begins[k];
  qsort(begins + first, (size_t)samples, sizeof(double), compare);
  printf("%.1f %.1f\n", begins[first + samples / 2], begins[first + samples * 99 / 100]);
  return 0;
}
