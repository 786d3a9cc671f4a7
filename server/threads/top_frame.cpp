#include "threads/top_frame.h"

#include <spdlog/spdlog.h>

#include <exception>

namespace mbcosim::server {
namespace {

void report(const char* thread, const char* what) noexcept {
  try {
    spdlog::error("{}: uncaught: {}", thread, what);
  } catch (...) {  // the log itself failed; there is nobody left to tell
  }
}

}  // namespace

void run_caught(const char* thread, const std::function<void()>& body) noexcept {
  try {
    body();
  } catch (const std::exception& error) {
    report(thread, error.what());
  } catch (...) {
    report(thread, "something that is no exception");
  }
}

}  // namespace mbcosim::server
