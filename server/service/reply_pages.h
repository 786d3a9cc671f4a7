/// Large replies in pages: all are made at once and kept until the last one is told.
#pragma once

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "threads/mutex.h"
#include "wire/memory.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// Pages in the making.
template <class Reply>
class PageWriter {
 public:
  /// `size`: numbers on a page.
  explicit PageWriter(std::int64_t size) : size_(size), pages_(1) {}
  /// The page on which something of so many numbers goes; things come in the order of the reply.
  Reply& room(std::int64_t numbers) {
    if (used_ > 0 && used_ + numbers > size_) {
      pages_.emplace_back();
      used_ = 0;
    }
    used_ += numbers;
    return pages_.back();
  }
  std::vector<Reply> take() { return std::move(pages_); }

 private:
  const std::int64_t size_;
  std::int64_t used_ = 0;
  std::vector<Reply> pages_;
};

/// `page_size` of a request. Throws BAD_ARGUMENT.
template <class Request>
std::int64_t page_size_of(const Request& request, std::int64_t usual,
                          std::int64_t most = std::numeric_limits<std::int64_t>::max()) {
  if (!request.has_page_size()) return usual;
  if (request.page_size() <= 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`page_size` must be positive, got " + std::to_string(request.page_size()));
  return std::min<std::int64_t>(request.page_size(), most);
}

/// Thread-safe. The last reply that was more than one page.
template <class Reply>
class ReplyPages {
 public:
  struct Whole {
    std::vector<Reply> pages;
    MemoryShare share;
  };

  /// Tells the first page and keeps the others; `digest`: of the request without its token.
  void first(std::unique_ptr<Whole> whole, std::uint64_t digest, Reply* page) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    ++number_;
    digest_ = digest;
    whole_ = std::move(whole);
    tell(0, page);
  }
  /// Throws BAD_ARGUMENT when the token is another request's, or too old.
  void next(const std::string& token, std::uint64_t digest, Reply* page) TS_EXCLUDES(mutex_) {
    std::int64_t number = 0, index = 0;
    const char* const end = token.data() + token.size();
    auto parsed = std::from_chars(token.data(), end, number);
    if (parsed.ec == std::errc() && parsed.ptr != end && *parsed.ptr == '.')
      parsed = std::from_chars(parsed.ptr + 1, end, index);
    Guard guard(mutex_);
    if (parsed.ec != std::errc() || parsed.ptr != end || !whole_ || number != number_ ||
        digest != digest_ || index < 1 || index >= std::ssize(whole_->pages) ||
        Clock::now() - told_ > kLife)
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`page_token` belongs to another request, or is too old: ask for the first "
                    "page");
    tell(index, page);
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::minutes kLife{1};

  void tell(std::int64_t index, Reply* page) TS_REQUIRES(mutex_) {
    *page = whole_->pages[static_cast<std::size_t>(index)];
    told_ = Clock::now();
    if (index + 1 < std::ssize(whole_->pages))
      page->set_next_page_token(std::to_string(number_) + "." + std::to_string(index + 1));
    else
      whole_.reset();
  }

  Mutex mutex_;
  std::unique_ptr<Whole> whole_ TS_GUARDED_BY(mutex_);
  std::uint64_t digest_ TS_GUARDED_BY(mutex_) = 0;
  std::int64_t number_ TS_GUARDED_BY(mutex_) = 0;
  Clock::time_point told_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
