#include "http/reaper.h"

#include <sys/socket.h>

#include <algorithm>

#include "threads/top_frame.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kEndLook{100};  // how late a socket may be ended
constexpr int kRestAfter = 20;                      // looks at nothing

}  // namespace

Reaper::Reaper() : thread_([this] { run_caught("http reaper", [this] { loop(); }); }) {}

Reaper::~Reaper() {
  {
    const Guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void Reaper::arm(int socket, std::chrono::milliseconds time) {
  if (socket < 0) return;
  const Guard lock(mutex_);
  deadlines_[socket] = std::min(end_, Clock::now() + time);
  if (rests_) changed_.notify_one();
}

void Reaper::disarm(int socket) {
  const Guard lock(mutex_);
  deadlines_.erase(socket);
}

void Reaper::hurry(std::chrono::milliseconds time) {
  const Guard lock(mutex_);
  end_ = Clock::now() + time;
  for (auto& [socket, deadline] : deadlines_) deadline = std::min(end_, deadline);
}

// Requests come and go quicker than a thread wakes: it looks now and then as long as some do.
void Reaper::loop() {
  const Guard lock(mutex_);
  int looks_at_nothing = 0;
  while (!stop_) {
    looks_at_nothing = deadlines_.empty() ? looks_at_nothing + 1 : 0;
    rests_ = looks_at_nothing > kRestAfter;
    if (rests_) {
      changed_.wait(mutex_);
      continue;
    }
    const Clock::time_point now = Clock::now();
    for (auto entry = deadlines_.begin(); entry != deadlines_.end();) {
      const bool late = entry->second <= now;
      if (late) ::shutdown(entry->first, SHUT_RDWR);
      entry = late ? deadlines_.erase(entry) : std::next(entry);
    }
    changed_.wait_for(mutex_, kEndLook);
  }
}

}  // namespace mbcosim::server::http
