#include "service/keeping.h"

#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr std::int64_t kLongestJournal = 64 << 20;  // a checkpoint takes its place then
constexpr std::chrono::seconds kPause(1);           // also where checkpoints fail

std::chrono::milliseconds interval_of(const v1::CreateOptions& options,
                                      std::chrono::milliseconds usual) {
  if (!options.has_checkpoint_interval()) return usual;
  const std::chrono::milliseconds interval =
      milliseconds_of(options.checkpoint_interval(), "checkpoint_interval");
  if (interval <= std::chrono::milliseconds(0))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`checkpoint_interval` must be at least 1 ms");
  return interval;
}

std::optional<std::int64_t> steps_of(const v1::CreateOptions& options) {
  if (!options.has_checkpoint_steps()) return std::nullopt;
  if (options.checkpoint_steps() > 0) return options.checkpoint_steps();
  throw Refusal(v1::REASON_BAD_ARGUMENT, "`checkpoint_steps` must be positive, got " +
                                             std::to_string(options.checkpoint_steps()));
}

}  // namespace

Keeping::Keeping(const v1::CreateOptions& options, std::chrono::milliseconds usual)
    : interval_(interval_of(options, usual)), steps_(steps_of(options)) {}

bool Keeping::due(std::int64_t changes, std::int64_t step, Clock::time_point now) const {
  Guard guard(look_);
  if (changes == changes_) return false;
  const bool long_journal = journal && journal->bytes() > kLongestJournal;
  return now - last_ >= interval_ || (steps_ && step - step_ >= *steps_) ||
         ((long_journal || doubted_) && now - last_ >= kPause);
}

bool Keeping::stale(std::int64_t changes) const {
  Guard guard(look_);
  return changes != changes_;
}

void Keeping::done(std::int64_t changes, std::int64_t step) {
  Guard guard(look_);
  changes_ = changes;
  step_ = step;
  last_ = Clock::now();
  doubted_ = false;
}

void Keeping::doubted() {
  Guard guard(look_);
  doubted_ = true;
}

void Keeping::failed() {
  Guard guard(look_);
  last_ = Clock::now();
}

}  // namespace mbcosim::server
