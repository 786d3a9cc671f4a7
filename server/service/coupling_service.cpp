#include "service/coupling_service.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>

#include "service/convert.h"

namespace mbcosim::server {
namespace {

constexpr int kProtocolVersion = 1;

/// Collects what does not fit in a handshake, so that all of it is told at once.
class Mismatches {
 public:
  void expect(bool fits, const char* what, const std::string& text) {
    if (!fits) found_[what] = text;
  }
  void refuse_if_any(const std::string& port) const {
    if (found_.empty()) return;
    std::string text = "the handshake does not fit port \"" + port + "\":";
    for (const auto& [what, detail] : found_) text += " " + what + ": " + detail + ";";
    text.pop_back();
    throw Refusal(v1::REASON_PORT_MISMATCH, text, found_);
  }

 private:
  std::map<std::string, std::string> found_;
};

template <class Enum>
Enum chosen(Enum wanted, Enum fallback) {
  return static_cast<int>(wanted) == 0 ? fallback : wanted;
}

void check_layout(const v1::Hello& hello, const PortModel& port, const Model& model,
                  Mismatches& mismatches) {
  const v1::PortLayout& layout = port.layout();
  const std::string digest = digest_text(model.digest);
  mismatches.expect(
      hello.model_digest().empty() || hello.model_digest() == digest, "model_digest",
      "the model has " + digest + ", the peer expects " + hello.model_digest().substr(0, 32));
  mismatches.expect(hello.length_unit().empty() || hello.length_unit() == "m", "length_unit",
                    "only \"m\" is served");
  const bool same_nodes = hello.node_labels_size() == 0 ||
                          std::equal(hello.node_labels().begin(), hello.node_labels().end(),
                                     layout.node_labels().begin(), layout.node_labels().end());
  mismatches.expect(same_nodes, "node_labels", "the port has other nodes, or in another order");
  mismatches.expect(!hello.accelerations() || port.offers_accelerations(), "accelerations",
                    "not all nodes of the port have them");
  mismatches.expect(hello.frame() != v1::PORT_FRAME_REFERENCE || layout.has_reference_node_label(),
                    "frame", "the port has no reference node");
}

void check_choices(const v1::Hello& hello, Mismatches& mismatches) {
  mismatches.expect(
      v1::CouplingMode_IsValid(hello.mode()) && v1::RotationForm_IsValid(hello.rotation_form()) &&
          v1::PortFrame_IsValid(hello.frame()) && v1::InputHold_IsValid(hello.input_hold()) &&
          v1::PeerPolicy_IsValid(hello.policy()) && v1::Acceleration_IsValid(hello.acceleration()),
      "enum", "a choice is unknown to this server");
  mismatches.expect(hello.every() >= 0, "every", "must not be negative");
  mismatches.expect(hello.mode() != v1::COUPLING_MODE_WINDOW || hello.every() <= 1, "every",
                    "must be 1 in mode WINDOW");
  mismatches.expect(hello.relaxation() >= 0 && hello.relaxation() < 2, "relaxation",
                    "must be in (0, 2)");
  mismatches.expect(hello.interface_tolerance() >= 0, "interface_tolerance",
                    "must not be negative");
  mismatches.expect(hello.maximum_passes() >= 0, "maximum_passes", "must not be negative");
}

Agreement agree(const v1::Hello& hello, const Port& port, const Model& model) {
  const v1::VersionRange& range = hello.protocol();
  const bool any = range.lowest() == 0 && range.highest() == 0;
  if (!any && (range.lowest() > kProtocolVersion || range.highest() < kProtocolVersion))
    throw Refusal(v1::REASON_VERSION_MISMATCH, "the server speaks protocol version 1",
                  {{"lowest", "1"}, {"highest", "1"}});
  Mismatches mismatches;
  check_layout(hello, port.model(), model, mismatches);
  check_choices(hello, mismatches);
  mismatches.refuse_if_any(hello.port());

  Agreement agreement;
  const v1::PortLayout& layout = port.model().layout();
  agreement.rotation_form = chosen(hello.rotation_form(),
                                   chosen(layout.default_rotation_form(), agreement.rotation_form));
  agreement.frame = chosen(hello.frame(), chosen(layout.default_frame(), agreement.frame));
  agreement.accelerations = hello.accelerations() || port.model().needs_accelerations();
  agreement.mode = chosen(hello.mode(), chosen(layout.default_mode(), agreement.mode));
  agreement.every = std::max(hello.every(), 1);
  agreement.hold = chosen(hello.input_hold(), agreement.hold);
  agreement.policy = chosen(hello.policy(), agreement.policy);
  agreement.acceleration = chosen(hello.acceleration(), agreement.acceleration);
  if (hello.has_peer_timeout())
    agreement.timeout = std::chrono::milliseconds(
        google::protobuf::util::TimeUtil::DurationToMilliseconds(hello.peer_timeout()));
  if (hello.relaxation() > 0) agreement.relaxation = hello.relaxation();
  if (hello.interface_tolerance() > 0) agreement.tolerance = hello.interface_tolerance();
  if (hello.maximum_passes() > 0) agreement.maximum_passes = hello.maximum_passes();
  return agreement;
}

constexpr auto kHandshake = std::chrono::seconds(10);  // longest wait for its next message

/// Over gRPC; a peer that does not read until the deadline loses its stream.
class GrpcStream : public PeerStream {
 public:
  GrpcStream(CouplingService::Stream* stream, Call& call) : stream_(stream), call_(call) {}
  bool read(v1::PeerMessage* message) override { return stream_->Read(message); }
  bool send(const v1::ServerMessage& message,
            std::chrono::steady_clock::time_point deadline) override {
    call_.set_deadline(deadline);
    const bool sent = stream_->Write(message);
    call_.clear_deadline();
    return sent;
  }

 private:
  CouplingService::Stream* stream_;
  Call& call_;
};

/// Keeps the port taken while it lives.
class Attachment {
 public:
  Attachment(Port& port, const Agreement& agreement) : port_(port) { port_.reserve(agreement); }
  ~Attachment() { port_.detach(); }
  Attachment(const Attachment&) = delete;
  Attachment& operator=(const Attachment&) = delete;

 private:
  Port& port_;
};

}  // namespace

grpc::Status CouplingService::Attach(grpc::ServerContext* context, Stream* stream) {
  return server::serve(parts_, *context, "Attach", Role::control, [&](const Caller& caller) {
    Call call(parts_.watch, *context);
    GrpcStream peer(stream, call);
    serve(peer, caller);
  });
}

void CouplingService::serve(PeerStream& stream, const Caller& caller) {
  v1::PeerMessage first;
  if (!stream.read(&first) || !first.has_hello())
    throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `hello`");
  const SessionPtr session = parts_.store.get(first.hello().simulation(), caller);
  const Session::Use use(*session);
  serve_peer(first.hello(), *session, stream);
}

void CouplingService::serve_peer(const v1::Hello& hello, Session& session, PeerStream& stream) {
  Port& port = session.port(hello.port());
  const Attachment attachment(port, agree(hello, port, session.model()));
  v1::ServerMessage message;
  v1::Welcome* welcome = message.mutable_welcome();
  v1::SimulationInfo info;
  session.fill(&info);
  welcome->set_protocol_version(kProtocolVersion);
  port.fill(welcome->mutable_layout());
  welcome->set_model_digest(info.model_digest());
  welcome->set_step_size_s(info.next_step_s());
  welcome->set_step(info.step());
  welcome->set_time_s(info.time_s());
  if (!stream.send(message, std::chrono::steady_clock::now() + kHandshake)) return;
  port.attach(&stream);
  v1::PeerMessage in;
  while (stream.read(&in)) port.receive(in);
}

}  // namespace mbcosim::server
