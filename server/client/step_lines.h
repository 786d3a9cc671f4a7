/// Internal to the client library: streams on which steps travel.
#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "client/wakeful_stream.h"

namespace mbcosim::client {

/// A stream that steppers of one server may share. Thread-safe: one step after the other.
class StepLine {
 public:
  /// `server` outlives it; `simulation`: by which a proxy finds the daemon.
  StepLine(const Server::Impl& server, const std::string& simulation);
  /// Ends the stream; waits for that at most `kParting`.
  ~StepLine();
  StepLine(const StepLine&) = delete;
  StepLine& operator=(const StepLine&) = delete;

  /// The reply within `timeout` [s]. After an Error the next one opens another stream.
  void exchange(const v1::StepRequest& request, v1::StepStreamReply* reply, double timeout)
      TS_EXCLUDES(mutex_);
  /// Its end waits for nothing.
  void abandon() {
    abandoned_ = true;
    stream_->cancel();
  }

 private:
  using Clock = std::chrono::steady_clock;
  using Stream = WakefulStream<v1::StepRequest, v1::StepStreamReply>;

  /// The right to use the stream, for which others wait.
  class Turn {
   public:
    /// Throws DEADLINE_EXCEEDED.
    Turn(StepLine& line, double timeout);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

   private:
    StepLine& line_;
  };
  void open(const std::string& simulation);

  const Server::Impl& server_;
  std::unique_ptr<Stream> stream_;  // of who has the turn
  bool abandoned_ = false;
  server::Mutex mutex_;
  server::Condition given_back_;
  bool taken_ TS_GUARDED_BY(mutex_) = false;
};

/// Steps of a connection that are asked for one by one: when they follow each other quickly they
/// travel on open streams, which takes less time than calls. A stream that rests is closed, as it
/// would keep the simulation alive. Thread-safe.
class StepLines {
 public:
  explicit StepLines(const Server::Impl& server) : server_(server) {}
  ~StepLines() TS_EXCLUDES(mutex_);
  StepLines(const StepLines&) = delete;
  StepLines& operator=(const StepLines&) = delete;

  /// False: make a call of it. What a stream could not do, or refused, is asked again by that: the
  /// request has an id, so that it is done once.
  bool step(const v1::StepRequest& request, v1::StepReply* reply) TS_EXCLUDES(mutex_);
  /// A step has ended.
  void note_step() TS_EXCLUDES(mutex_);

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMost = 16;  ///< streams; one for each thread that steps
  static constexpr std::chrono::milliseconds kSoon{50};  ///< within which a step follows in a loop
  static constexpr std::chrono::milliseconds kIdle{1000};  ///< after which a stream is closed
  struct Line {
    std::unique_ptr<StepLine> line;
    std::string simulation;  ///< that it stepped last
    Clock::time_point used{};
  };

  /// Empty: there is none to be had.
  Line take(const std::string& simulation) TS_EXCLUDES(mutex_);
  void give_back(Line line) TS_EXCLUDES(mutex_);
  void lose(bool is_others, const Error& error) TS_EXCLUDES(mutex_);
  bool start_watch() TS_REQUIRES(mutex_);
  void watch() TS_EXCLUDES(mutex_);

  const Server::Impl& server_;
  server::StopSignal stop_;
  server::Mutex mutex_;
  std::vector<Line> resting_ TS_GUARDED_BY(mutex_);
  std::size_t open_ TS_GUARDED_BY(mutex_) = 0;  ///< those at work, too
  Clock::time_point last_step_ TS_GUARDED_BY(mutex_){};
  bool allowed_ TS_GUARDED_BY(mutex_) = true;
  bool one_daemon_ TS_GUARDED_BY(mutex_) = true;  ///< a stream reaches every simulation
  bool watched_ TS_GUARDED_BY(mutex_) = false;
  std::thread watch_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::client
