#include "coupling/recorder.h"

#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/util/delimited_message_util.h>

namespace mbcosim::server {

v1::StepNotice step_notice(std::int64_t step, double time) {
  v1::StepNotice notice;
  notice.set_step(step);
  notice.set_time_s(time);
  return notice;
}

void Recorder::add(const v1::RecordEntry& entry) {
  const std::lock_guard guard(mutex_);
  if (full_) return;
  const v1::RecordEntry* kept = &entry;
  v1::RecordEntry end;
  if (static_cast<std::int64_t>(bytes_.size() + entry.ByteSizeLong()) > most_bytes_) {
    end.set_cut_off(true);
    kept = &end;
    full_ = true;
  }
  google::protobuf::io::StringOutputStream out(&bytes_);
  google::protobuf::util::SerializeDelimitedToZeroCopyStream(*kept, &out);
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

void Recorder::read(std::size_t size, const std::function<bool(const std::string&)>& piece) const {
  for (std::size_t at = 0;; at += size) {
    std::string part;
    {
      const std::lock_guard guard(mutex_);
      if (at >= bytes_.size()) return;
      part = bytes_.substr(at, size);
    }
    if (!piece(part)) return;
  }
}

}  // namespace mbcosim::server
