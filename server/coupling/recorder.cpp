#include "coupling/recorder.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

#include "wire/refusal.h"

namespace mbcosim::server {

v1::StepNotice step_notice(std::int64_t step, double time) {
  v1::StepNotice notice;
  notice.set_step(step);
  notice.set_time(time);
  return notice;
}

void Recorder::add(const v1::RecordEntry& entry) {
  const Guard guard(mutex_);
  if (full_) return;
  const v1::RecordEntry* kept = &entry;
  v1::RecordEntry end;
  if (!has_room(static_cast<std::int64_t>(bytes_.size() + entry.ByteSizeLong()))) {
    end.set_cut_off(true);
    kept = &end;
    full_ = true;
  }
  google::protobuf::io::StringOutputStream out(&bytes_);
  google::protobuf::util::SerializeDelimitedToZeroCopyStream(*kept, &out);
}

// At the end of the server's memory the record ends as at its own limit.
bool Recorder::has_room(std::int64_t bytes) {
  constexpr std::int64_t kSlab = 1 << 20;
  if (bytes > most_bytes_) return false;
  try {
    while (memory_.bytes() < bytes) memory_.grow(kSlab);
    return true;
  } catch (const Refusal&) {
    return false;
  }
}

void Recorder::attached(const std::string& port, const v1::Welcome& welcome) {
  v1::RecordEntry entry;
  entry.set_port(port);
  *entry.mutable_from_peer()->mutable_hello() = welcome.agreed();
  add(entry);
  *entry.mutable_to_peer()->mutable_welcome() = welcome;
  add(entry);
}

void Recorder::detached(const std::string& port) {
  v1::RecordEntry entry;
  entry.set_port(port);
  entry.set_detached(true);
  add(entry);
}

void Recorder::sent(const std::string& port, const v1::ServerMessage& message) {
  v1::RecordEntry entry;
  entry.set_port(port);
  *entry.mutable_to_peer() = message;
  add(entry);
}

void Recorder::received(const std::string& port, const v1::PeerExchange& answer) {
  v1::RecordEntry entry;
  entry.set_port(port);
  *entry.mutable_from_peer()->mutable_exchange() = answer;
  add(entry);
}

void Recorder::lost(const std::string& port, const std::string& why) {
  v1::RecordEntry entry;
  entry.set_port(port);
  entry.set_lost(why);
  add(entry);
}

void Recorder::stepped(bool accepted, std::int64_t step, double time) {
  v1::RecordEntry entry;
  *(accepted ? entry.mutable_accepted() : entry.mutable_failed()) = step_notice(step, time);
  add(entry);
}

void Recorder::restored(std::int64_t step, double time) {
  v1::RecordEntry entry;
  *entry.mutable_restored() = step_notice(step, time);
  add(entry);
}

void Recorder::inputs(const v1::Values& values) {
  v1::RecordEntry entry;
  *entry.mutable_inputs() = values;
  add(entry);
}

void Recorder::chosen(const v1::StepRequest& step) {
  v1::RecordEntry entry;
  *entry.mutable_chosen() = step;
  add(entry);
}

std::string Recorder::read(std::size_t at, std::size_t size) const {
  const Guard guard(mutex_);
  return at < bytes_.size() ? bytes_.substr(at, size) : std::string();
}

}  // namespace mbcosim::server
