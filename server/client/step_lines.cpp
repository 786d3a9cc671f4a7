#include "client/step_lines.h"

#include <algorithm>
#include <optional>
#include <system_error>
#include <utility>

#include "client/deadline.h"

namespace mbcosim::client {

// ------------------------------------------------------------------ StepLine

StepLine::StepLine(const Server::Impl& server, const std::string& simulation) : server_(server) {
  open(simulation);
}

StepLine::~StepLine() {
  if (stream_->finished()) return;
  std::optional<Deadline> deadline;
  try {
    if (!abandoned_) deadline.emplace(kParting, [this] { stream_->cancel(); });
  } catch (const std::system_error&) {  // no thread to be had
    stream_->cancel();
  }
  stream_->end_writing();
  (void)stream_->finish();
}

void StepLine::open(const std::string& simulation) {
  stream_ = std::make_unique<Stream>(server_, simulation, [&](auto* context, auto* queue) {
    return server_.simulations->PrepareAsyncStepStream(context, queue);
  });
}

void StepLine::exchange(const v1::StepRequest& request, v1::StepStreamReply* reply,
                        double timeout) {
  const Clock::time_point start = Clock::now();
  const Turn turn(*this, timeout);
  if (stream_->finished()) open(request.simulation());
  const double waited = std::chrono::duration<double>(Clock::now() - start).count();
  const double left = timeout == kEndless ? kEndless : std::max(timeout - waited, 1e-3);
  const Deadline deadline(left, [this] { stream_->cancel(); });
  if (stream_->write(request) && stream_->read(reply)) return;
  const grpc::Status status = stream_->finish();
  if (deadline.is_over()) throw_late("the step", timeout);
  require(status);
  throw Error("the stream has ended", static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
}

StepLine::Turn::Turn(StepLine& line, double timeout) : line_(line) {
  const bool ends = timeout != kEndless;
  const Clock::time_point end =
      Clock::now() + std::chrono::duration_cast<Clock::duration>(
                         std::chrono::duration<double>(ends ? timeout : 0));
  const server::Guard guard(line_.mutex_);
  while (line_.taken_ && (!ends || Clock::now() < end)) {
    if (ends)
      line_.given_back_.wait_until(line_.mutex_, end);
    else
      line_.given_back_.wait(line_.mutex_);
  }
  if (line_.taken_) throw_late("the step", timeout);
  line_.taken_ = true;
}

StepLine::Turn::~Turn() {
  const server::Guard guard(line_.mutex_);
  line_.taken_ = false;
  line_.given_back_.notify_one();
}

// ------------------------------------------------------------------ StepLines

StepLines::~StepLines() {
  stop_.stop();
  std::thread watch;
  {
    const server::Guard guard(mutex_);
    watch = std::move(watch_);
    for (const Line& line : resting_) line.line->abandon();
  }
  if (watch.joinable()) watch.join();
}

bool StepLines::step(const v1::StepRequest& request, v1::StepReply* reply) {
  Line line = take(request.simulation());
  if (!line.line) return false;
  const bool is_others = line.simulation != request.simulation();
  v1::StepStreamReply message;
  try {
    line.line->exchange(request, &message, kEndless);
  } catch (const Error& error) {
    lose(is_others, error);
    return false;
  }
  line.simulation = request.simulation();
  give_back(std::move(line));
  *reply = std::move(*message.mutable_step());
  return true;
}

void StepLines::note_step() {
  const server::Guard guard(mutex_);
  last_step_ = Clock::now();
}

StepLines::Line StepLines::take(const std::string& simulation) {
  const server::Guard guard(mutex_);
  if (!allowed_ || Clock::now() - last_step_ > kSoon) return {};
  auto found = std::find_if(resting_.begin(), resting_.end(),
                            [&](const Line& line) { return line.simulation == simulation; });
  if (found == resting_.end() && one_daemon_ && !resting_.empty()) found = resting_.end() - 1;
  if (found != resting_.end()) {
    Line line = std::move(*found);
    resting_.erase(found);
    return line;
  }
  if (open_ == kMost || !start_watch()) return {};
  ++open_;
  return {std::make_unique<StepLine>(server_, simulation), simulation, {}};
}

void StepLines::give_back(Line line) {
  const server::Guard guard(mutex_);
  line.used = Clock::now();
  resting_.push_back(std::move(line));
}

// A proxy may have led the stream to a daemon that has other simulations.
void StepLines::lose(bool is_others, const Error& error) {
  const server::Guard guard(mutex_);
  --open_;
  const auto code = static_cast<grpc::StatusCode>(error.code());
  if (is_others && code == grpc::StatusCode::NOT_FOUND) one_daemon_ = false;
  if (code == grpc::StatusCode::RESOURCE_EXHAUSTED) allowed_ = false;  // as many as one may have
}

bool StepLines::start_watch() {
  if (watched_) return true;
  if (watch_.joinable()) watch_.join();  // its end needs no lock
  try {
    watch_ = std::thread([this] { watch(); });
  } catch (const std::system_error&) {  // no thread to be had
    return false;
  }
  watched_ = true;
  return true;
}

void StepLines::watch() {
  while (!stop_.stopped_within(kIdle / 2)) {
    std::vector<Line> idle;
    const server::Guard guard(mutex_);
    const Clock::time_point now = Clock::now();
    const auto rests = [&](const Line& line) { return now - line.used < kIdle; };
    const auto first = std::stable_partition(resting_.begin(), resting_.end(), rests);
    std::move(first, resting_.end(), std::back_inserter(idle));
    resting_.erase(first, resting_.end());
    open_ -= idle.size();
    for (const Line& line : idle) line.line->abandon();
    if (open_ > 0) continue;
    watched_ = false;
    return;
  }
}

}  // namespace mbcosim::client
