#include "service/kept_replies.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message_lite.h>

#include <algorithm>

#include "math/hash.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {

namespace {

constexpr std::size_t kLongestId = 128;

std::string bytes_of(const google::protobuf::MessageLite& message) {
  std::string bytes;
  google::protobuf::io::StringOutputStream stream(&bytes);
  google::protobuf::io::CodedOutputStream out(&stream);
  out.SetSerializationDeterministic(true);
  message.SerializeToCodedStream(&out);
  out.Trim();
  return bytes;
}

}  // namespace

std::uint64_t digest_of(const char* method, const google::protobuf::MessageLite& request) {
  return fnv1a(method + bytes_of(request));
}

void check_request_id(const std::string& id) {
  if (id.size() > kLongestId)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`request_id` must not be longer than " + std::to_string(kLongestId) + " bytes");
}

void refuse_other_request(const std::string& id) {
  throw Refusal(v1::REASON_BAD_ARGUMENT, "`request_id` \"" + utf8(id) + "\" was another request's");
}

// ------------------------------------------------------------------ one request

KeptReplies::Turn::Turn(KeptReplies& kept, const Caller& caller, const std::string& request_id,
                        std::uint64_t digest, const Call& call, bool of_state, Repeat repeat)
    : kept_(kept),
      identity_(caller.identity),
      id_(request_id),
      digest_(digest),
      of_state_(of_state) {
  constexpr std::chrono::milliseconds kLook(20);  // how soon the end of the call is noticed
  if (id_.empty()) return;
  check_request_id(id_);
  Guard guard(kept_.mutex_);
  bool waits = false;
  for (Entry* entry = kept_.find(identity_, id_); entry; entry = kept_.find(identity_, id_)) {
    if (entry->digest != digest_) refuse_other_request(id_);
    if (!entry->at_work) {
      (entry->begun ? begun_ : known_) = entry->reply;
      entry->at_work = entry->begun;
      entry->awaited = false;
      return;
    }
    must_wait_ = repeat == Repeat::leaves;
    if (must_wait_) return;
    if (entry->awaited && !waits)
      throw Refusal(v1::REASON_SIMULATION_BUSY,
                    "this request is at work, and another repeat waits for it already");
    entry->awaited = waits = true;
    kept_.changed_.wait_for(kept_.mutex_, kLook);
    if (!call.cancelled()) continue;
    if (Entry* still = kept_.find(identity_, id_)) still->awaited = false;
    throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
  }
  kept_.entries_.push_back({identity_, id_, digest_, of_state_});
}

KeptReplies::Turn::~Turn() {
  if (id_.empty() || known_ || must_wait_) return;
  Guard guard(kept_.mutex_);
  Entry* entry = kept_.find(identity_, id_);
  if (entry && entry->at_work) {
    if (entry->begun)
      entry->at_work = false;  // refused before it went on
    else
      kept_.forget(identity_, id_);
  }
  kept_.changed_.notify_all();
}

void KeptReplies::Turn::keep(const google::protobuf::MessageLite& reply, bool stored) {
  put(reply, /*begun=*/false, stored);
}

void KeptReplies::Turn::break_off(const google::protobuf::MessageLite& reply) {
  put(reply, /*begun=*/true, /*stored=*/true);
}

void KeptReplies::Turn::put(const google::protobuf::MessageLite& reply, bool begun, bool stored) {
  if (id_.empty() || known_) return;
  std::string bytes = reply.SerializeAsString();
  Guard guard(kept_.mutex_);
  Entry* entry = kept_.find(identity_, id_);
  kept_.share_.shrink(static_cast<std::int64_t>(entry->reply.size()));  // of what was begun
  entry->reply.clear();
  entry->begun = false;
  if (!kept_.make_room(static_cast<std::int64_t>(bytes.size()))) return;
  entry = kept_.find(identity_, id_);
  entry->reply = std::move(bytes);
  entry->at_work = false;
  entry->begun = begun;
  entry->stored = stored;
}

v1::KeptReply KeptReplies::Turn::described(const google::protobuf::MessageLite& reply,
                                           bool begun) const {
  v1::KeptReply kept;
  kept.set_identity(identity_);
  kept.set_request_id(id_);
  kept.set_request_digest(digest_);
  kept.set_reply(reply.SerializeAsString());
  kept.set_begun(begun);
  kept.set_of_state(of_state_);
  return kept;
}

// ------------------------------------------------------------------ the store

KeptReplies::Entry* KeptReplies::find(const std::string& identity, const std::string& id) {
  const auto found = std::find_if(entries_.rbegin(), entries_.rend(), [&](const Entry& e) {
    return e.id == id && e.identity == identity;
  });
  return found == entries_.rend() ? nullptr : &*found;
}

void KeptReplies::forget(const std::string& identity, const std::string& id) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) {
    return e.id == id && e.identity == identity;
  });
  share_.shrink(static_cast<std::int64_t>(found->reply.size()));
  entries_.erase(found);
}

void KeptReplies::describe(Messages* out) const {
  Guard guard(mutex_);
  for (const Entry& entry : entries_)
    if (!entry.at_work || entry.begun) describe(entry, out->Add());
}

void KeptReplies::describe(const Entry& entry, v1::KeptReply* out) {
  out->set_identity(entry.identity);
  out->set_request_id(entry.id);
  out->set_request_digest(entry.digest);
  out->set_reply(entry.reply);
  out->set_begun(entry.begun);
  out->set_of_state(entry.of_state);
}

void KeptReplies::describe_unstored(Messages* out) const {
  Guard guard(mutex_);
  for (const Entry& entry : entries_)
    if (!entry.at_work && !entry.stored) describe(entry, out->Add());
}

void KeptReplies::all_stored() {
  Guard guard(mutex_);
  for (Entry& entry : entries_)
    if (!entry.at_work) entry.stored = true;
}

void KeptReplies::put_last(v1::KeptReply reply, Messages* kept) {
  const auto same = std::remove_if(kept->begin(), kept->end(), [&](const v1::KeptReply& other) {
    return other.request_id() == reply.request_id() && other.identity() == reply.identity();
  });
  kept->erase(same, kept->end());
  *kept->Add() = std::move(reply);
  const int over = kept->size() - static_cast<int>(kReplies);
  if (over > 0) kept->DeleteSubrange(0, over);
}

void KeptReplies::take_over(const Messages& kept) {
  Guard guard(mutex_);
  for (const v1::KeptReply& reply : kept)
    if (make_room(std::ssize(reply.reply())))
      entries_.push_back({.identity = reply.identity(),
                          .id = reply.request_id(),
                          .digest = reply.request_digest(),
                          .of_state = reply.of_state(),
                          .at_work = false,
                          .reply = reply.reply(),
                          .begun = reply.begun(),
                          .stored = true});
}

bool KeptReplies::drop_oldest() {
  const auto oldest =
      std::find_if(entries_.begin(), entries_.end(), [](const Entry& e) { return !e.at_work; });
  if (oldest == entries_.end()) return false;
  share_.shrink(static_cast<std::int64_t>(oldest->reply.size()));
  entries_.erase(oldest);
  return true;
}

std::size_t KeptReplies::kept() const {
  return static_cast<std::size_t>(
      std::count_if(entries_.begin(), entries_.end(), [](const Entry& e) { return !e.at_work; }));
}

bool KeptReplies::make_room(std::int64_t bytes) {
  if (bytes > kBytes) return false;
  while (kept() >= kReplies || share_.bytes() + bytes > kBytes)
    if (!drop_oldest()) return false;
  try {
    share_.grow(bytes);
  } catch (const Refusal&) {  // no memory: as if it had been dropped at once
    return false;
  }
  return true;
}

}  // namespace mbcosim::server
