#include "service/reduction_service.h"

#include "input/sources.h"
#include "reduction/job.h"
#include "service/upload.h"

namespace mbcosim::server {
namespace {

using Stream = ReductionService::Stream;

constexpr const char* kFileName = "body.fem";

/// A wrong file, option or model.
[[noreturn]] void refuse(const ReductionError& error) {
  throw Refusal(v1::REASON_BAD_ARGUMENT, error.what());
}

/// Options of the request, over those of the job file.
ReductionJob read_request(const v1::ReduceHeader& header, const BundleSource& files) {
  const auto text = files.read(header.main_file());
  if (!text)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "the job file \"" + header.main_file().substr(0, 100) +
                                               "\" is not among the files");
  ReductionJob job;
  read_job(header.main_file(), *text, job);
  if (header.interface_nodes_size() > 0) {
    job.options.interface_nodes.clear();
    for (const int label : header.interface_nodes())
      job.options.interface_nodes.push_back(std::to_string(label));
  }
  if (header.fixed_interface_modes() != 0)
    job.set("modes", std::to_string(header.fixed_interface_modes()));
  if (header.highest_frequency_hz() != 0) job.options.max_frequency = header.highest_frequency_hz();
  for (const auto& [name, value] : header.options()) job.set(name, value);
  return job;
}

FeModel load(const ReductionJob& job, const BundleSource& files, const Limits& limits) {
  FeModel model = load_model(job, [&](const std::string& name) {
    auto text = files.read(name);
    if (!text) refuse_reduction(text.error().message);
    return std::move(*text);
  });
  if (model.rows() > limits.unknowns)
    throw limit_refusal("unknowns", limits.unknowns, "the model has more unknowns than allowed");
  return model;
}

v1::ReduceReply message_of(const ReductionReport& report) {
  v1::ReduceReply reply;
  v1::ReduceReport& r = *reply.mutable_report();
  r.set_modes(static_cast<int>(report.frequencies.size()));
  r.mutable_frequencies_hz()->Assign(report.frequencies.begin(), report.frequencies.end());
  r.set_mass_kg(report.inertia.mass);
  r.set_rigid_motions(report.rigid_motions);
  r.set_removed_shapes(report.removed_shapes);
  if (report.static_error >= 0) r.set_static_error(report.static_error);
  const MatX& e = report.effective_masses;
  r.mutable_effective_masses()->Assign(e.data(), e.data() + e.size());
  for (const std::string& warning : report.warnings) r.add_warnings(warning);
  return reply;
}

void send_file(const std::string& text, Stream* stream) {
  constexpr std::size_t kPiece = 1 << 20;
  v1::ReduceReply reply;
  reply.mutable_chunk()->set_path(kFileName);
  for (std::size_t at = 0; at < text.size(); at += kPiece) {
    reply.mutable_chunk()->set_data(text.substr(at, kPiece));
    if (!stream->Write(reply)) return;
  }
}

/// Sends what is being done, at most ten times a second and at each new phase.
class ProgressSender {
 public:
  explicit ProgressSender(Stream* stream) : stream_(stream) {}
  void send(const std::string& phase, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    if (phase == last_.progress().phase() && now - sent_ < std::chrono::milliseconds(100)) return;
    sent_ = now;
    last_.mutable_progress()->set_phase(phase);
    last_.mutable_progress()->set_fraction(fraction);
    stream_->Write(last_);
  }

 private:
  Stream* stream_;
  v1::ReduceReply last_;
  std::chrono::steady_clock::time_point sent_;
};

}  // namespace

grpc::Status ReductionService::Reduce(grpc::ServerContext* context, Stream* stream) {
  return serve(parts_, *context, "Reduce", Role::control, [&](const Caller&) {
    Call call(parts_.watch, *context);
    try {
      answer(stream, call);
    } catch (const ReductionError& error) {
      refuse(error);
    }
  });
}

void ReductionService::answer(Stream* stream, Call& call) {
  v1::ReduceRequest message;
  if (!stream->Read(&message) || !message.has_header())
    throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `header`");
  const v1::ReduceHeader header = message.header();
  Bundle bundle(parts_.config.limits);
  while (stream->Read(&message)) {
    if (!message.has_chunk())
      throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` there are only `chunk` messages");
    bundle.add(message.chunk());
  }
  const BundleSource files(bundle.take());
  const ReductionJob job = read_request(header, files);
  const FeModel model = load(job, files, parts_.config.limits.engine);

  CancelToken waiting;
  call.attach(&waiting);
  const SolverSlots::Slot slot = parts_.slots.acquire(waiting);
  call.attach(nullptr);
  ProgressSender sender(stream);
  const auto reduction = reduce(model, job.options, [&](const std::string& phase, double fraction) {
    sender.send(phase, fraction);
    return !call.cancelled();
  });
  if (!reduction) throw Refusal(reduction.error());
  if (stream->Write(message_of(reduction->report)))
    send_file(write_fem_text(reduction->data, reduction->comments), stream);
}

}  // namespace mbcosim::server
