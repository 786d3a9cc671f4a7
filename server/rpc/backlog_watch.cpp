#include "rpc/backlog_watch.h"

#include <grpcpp/generic/generic_stub.h>
#include <malloc.h>
#include <pthread.h>

#include <algorithm>
#include <numeric>

#include "threads/top_frame.h"
#include "wire/memory.h"

namespace mbcosim::server {
namespace {

constexpr std::chrono::milliseconds kLook(30), kQuietLook(100);  // between two calls
constexpr std::chrono::milliseconds kShort(100);  // in which each comes, or memory is looked at
constexpr std::chrono::milliseconds kSlice(20);   // between two looks at it
constexpr std::int64_t kGrowth = 48 << 20;        // of memory [bytes] that is much
constexpr int kOwn = 1;                           // call of the last look
constexpr const char* kThread = "backlog";

std::int64_t allocated_bytes() {
  const struct mallinfo2 info = ::mallinfo2();
  return static_cast<std::int64_t>(info.uordblks + info.hblkhd);
}

/// The answer is that it has come.
class Come final : public Handler {
  void start(Exchange& exchange) override { exchange.finish(grpc::Status::OK); }
  void on_message(Exchange&, grpc::ByteBuffer) override {}
  void on_half_close(Exchange&) override {}
};

}  // namespace

Method BacklogWatch::method() {
  return {Role::observe, true, Counted::no, [] { return std::make_unique<Come>(); }};
}

BacklogWatch::BacklogWatch(Gate& gate, const MemoryBudget& memory, std::size_t most_alive,
                           Connect connect, BreakOff break_off)
    : gate_(gate),
      most_alive_(most_alive),
      connect_(std::move(connect)),
      break_off_(std::move(break_off)),
      trim_(memory),
      thread_([this] { run_caught(kThread, [this] { watch(); }); }) {}

BacklogWatch::~BacklogWatch() {
  {
    Guard guard(mutex_);
    ends_ = true;
  }
  end_.notify_all();
  thread_.join();
}

bool BacklogWatch::is_to_end() {
  Guard guard(mutex_);
  return ends_;
}

void BacklogWatch::watch() {
  pthread_setname_np(pthread_self(), kThread);
  while (!is_to_end()) {
    {
      Guard guard(mutex_);
      if (!ends_) end_.wait_for(mutex_, quiet_ ? kQuietLook : kLook);
    }
    run_caught(kThread, [&] { look(gate_.counts().take()); });
  }
}

void BacklogWatch::look(CallCounts::Counts counts) {
  const std::int64_t resident = resident_bytes();
  const bool grows = resident - std::exchange(resident_, resident) > kGrowth;
  const int all = std::accumulate(counts.begin(), counts.end(), 0,
                                  [](int sum, const auto& each) { return sum + each.second; });
  quiet_ = all <= kOwn && !grows;
  trim_.look(HeapTrim::Clock::now());
  if (quiet_) return;
  if (gate_.alive() > most_alive_)
    counts = gate_.alive_by_connection();
  else if (comes_in_time() || is_to_end())
    return;
  else
    for (const auto& [connection, count] : gate_.counts().take()) counts[connection] += count;
  trim_.ask(HeapTrim::Clock::now());
  for (const std::string& connection : busiest(counts)) break_off_(connection);
}

// A machine that is busy with something else makes calls wait, too, but not take memory.
bool BacklogWatch::comes_in_time() {
  if (!channel_) channel_ = connect_();
  grpc::GenericStub stub(channel_);
  grpc::CompletionQueue queue;
  grpc::ClientContext context;
  grpc::ByteBuffer answer;
  grpc::Status status;
  void* tag = nullptr;
  bool ok = false, came = false;
  const auto call = stub.PrepareUnaryCall(&context, kMethod, {}, &queue);
  call->StartCall();
  call->Finish(&answer, &status, &answer);
  const auto comes_within = [&](std::chrono::milliseconds wait) {
    came = queue.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + wait) ==
           grpc::CompletionQueue::GOT_EVENT;
    return came;
  };
  if (!comes_within(kShort)) {
    const std::int64_t before = allocated_bytes();
    while (!is_to_end() && !comes_within(kSlice) && allocated_bytes() - before < kGrowth) {
    }
  }
  if (!came) {
    context.TryCancel();
    queue.Next(&tag, &ok);
  }
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
  return came;
}

}  // namespace mbcosim::server
