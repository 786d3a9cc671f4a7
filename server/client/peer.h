/// Internal to the client library: the stream of a peer.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "client/connection.h"
#include "client/wire.h"
#include "threads/mutex.h"

namespace mbcosim::client {

PortLayout to_layout(const v1::PortLayout& from);
v1::Hello make_hello(const v1::SimulationInfo& simulation, const std::string& port,
                     const PeerOptions& options);

struct Peer::Impl {
  ~Impl() { close(); }
  bool next(Motion& motion);
  std::optional<Error> error() const TS_EXCLUDES(blame_mutex);
  void answer(const Loads& loads);
  void fail(const std::string& why);
  void reject(const Reject& rejection);
  void serve(Answer answer);  ///< in a thread of its own
  void answer_all(const Answer& answer);
  void give_up(const std::string& why);  ///< after an exception of the program's
  void start_heart(const PeerOptions& options);
  void beat(double beats, double limit);
  void stop_heart();
  bool read();
  void note(const v1::StepNotice& notice, bool accepted);
  void end();                                               ///< learns how the stream has ended
  void blame(const Error& error) TS_EXCLUDES(blame_mutex);  ///< the first counts
  void write(const v1::PeerMessage& message) TS_EXCLUDES(write_mutex);
  void part() TS_EXCLUDES(write_mutex);  ///< the last thing that is written
  void close();

  std::shared_ptr<Server::Impl> server;
  std::unique_ptr<Wire> wire;
  server::Mutex write_mutex;  ///< the heart writes to the wire, too
  bool parted TS_GUARDED_BY(write_mutex) = false;
  Tangent tangent = Tangent::none;
  StepEnded step_ended;
  PortLayout layout;
  v1::ServerMessage in;
  v1::PeerMessage out;
  std::thread thread, heart;
  std::atomic<std::int64_t> reading_since{0};  ///< clock's count of nanoseconds; 0: nobody reads
  server::StopSignal stop;                     ///< of the heart
  std::atomic<std::int64_t> exchanges{0};
  std::atomic<std::int64_t> step{0};  ///< at whose end the peer stands
  std::atomic<bool> ended{false};
  mutable server::Mutex blame_mutex;
  std::optional<Error> failure TS_GUARDED_BY(blame_mutex);
  bool open = true;
};

/// Opens the stream and shakes hands. Throws Error.
std::unique_ptr<Peer::Impl> attach_peer(std::shared_ptr<Server::Impl> server,
                                        const v1::Hello& hello, const PeerOptions& options);

}  // namespace mbcosim::client
