#include "service/reduction_service.h"

#include <cmath>
#include <optional>

#include "input/sources.h"
#include "mbcosim/v1/reduction.pb.h"
#include "reduction/job.h"
#include "service/upload.h"

namespace mbcosim::server {
namespace {

constexpr const char* kFileName = "body.fem";

/// A wrong file, option or model.
[[noreturn]] void refuse(const ReductionError& error) {
  constexpr std::size_t kLongest = 2000;  // what is quoted may be of any length, a status may not
  throw Refusal(v1::REASON_BAD_ARGUMENT, utf8(std::string(error.what()).substr(0, kLongest)));
}

/// Options of the request, over those of the job file.
ReductionJob read_request(const v1::ReduceHeader& header, const BundleSource& files) {
  const auto text = files.read(header.main_file());
  if (!text)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "the job file \"" + header.main_file().substr(0, 100) +
                                               "\" is not among the files");
  ReductionJob job;
  ReductionNames names;
  read_job(header.main_file(), *text, job);
  if (header.interface_nodes_size() > 0) {
    names.add("interface");
    job.options.interface_nodes.clear();
    for (const int label : header.interface_nodes())
      job.options.interface_nodes.push_back(std::to_string(label));
  }
  if (header.has_fixed_interface_modes()) {
    names.add("modes");
    job.set("modes", std::to_string(header.fixed_interface_modes()));
  }
  if (header.has_highest_frequency()) {
    if (!(header.highest_frequency() > 0 && std::isfinite(header.highest_frequency())))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`highest_frequency` must be positive");
    names.add("max-frequency");
    job.options.max_frequency = header.highest_frequency();
  }
  for (const auto& [name, value] : header.options()) {
    names.add(name);
    job.set(name, value);
  }
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
  r.mutable_frequencies()->Assign(report.frequencies.begin(), report.frequencies.end());
  r.set_mass(report.inertia.mass);
  r.set_rigid_motions(report.rigid_motions);
  r.set_removed_shapes(report.removed_shapes);
  if (report.static_error >= 0) r.set_static_error(report.static_error);
  const MatX& e = report.effective_masses;
  r.mutable_effective_masses()->Assign(e.data(), e.data() + e.size());
  for (const std::string& warning : report.warnings) r.add_warnings(warning);
  return reply;
}

/// Tells what is being done, at most ten times a second and at each new phase.
class ProgressSender {
 public:
  explicit ProgressSender(Exchange& exchange) : exchange_(exchange) {}
  void send(const std::string& phase, double fraction) {
    const auto now = std::chrono::steady_clock::now();
    const bool goes_on = phase == last_.progress().phase();
    const bool soon = now - sent_ < std::chrono::milliseconds(100);
    if (goes_on && (soon || !exchange_.all_written())) return;
    sent_ = now;
    last_.mutable_progress()->set_phase(phase);
    last_.mutable_progress()->set_fraction(fraction);
    exchange_.write(serialized(last_));
  }

 private:
  Exchange& exchange_;
  v1::ReduceReply last_;
  std::chrono::steady_clock::time_point sent_;
};

class ReduceHandler final : public Upload<v1::ReduceRequest> {
 public:
  explicit ReduceHandler(const Parts& parts) : parts_(parts) {}

 private:
  void add(Exchange& exchange, v1::ReduceRequest& message, MemoryShare share) override {
    if (!header_) {
      if (!message.has_header())
        throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `header`");
      header_ = message.header();
      header_share_ = std::move(share);
      bundle_.emplace(parts_.config.limits, exchange.memory());
      return;
    }
    if (!message.has_chunk())
      throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` there are only `chunk` messages");
    bundle_->add(message.chunk());
  }
  void complete(Exchange& exchange) override {
    if (!header_) throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `header`");
    try {
      answer(exchange);
    } catch (const ReductionError& error) {
      refuse(error);
    }
  }
  void answer(Exchange& exchange) {
    ProgressSender sender(exchange);
    const CallToken token(exchange.call());
    const BundleSource files(bundle_->take());
    const ReductionJob job = read_request(*header_, files);
    const FeModel model = within(exchange.memory(), &token, &model_share_,
                                 [&] { return load(job, files, parts_.config.limits.engine); });
    const auto progress = [&](const std::string& phase, double fraction) {
      const MemoryPause uncounted;
      sender.send(phase, fraction);
      return !exchange.call().cancelled();
    };
    v1::ReduceReply report;
    std::string text = within(exchange.memory(), &token, &text_share_, [&] {
      const auto reduction = reduce(model, job.options, progress);
      if (!reduction) throw Refusal(reduction.error());
      report = message_of(reduction->report);
      return write_fem_text(reduction->data, reduction->comments);
    });
    Guard guard(mutex_);
    exchange.write(serialized(report));
    text_ = std::move(text);
  }
  void on_written(Exchange& exchange) override {
    exchange.post(Lane::work, [this, &exchange] { send_piece(exchange); });
  }
  void send_piece(Exchange& exchange) {
    constexpr std::size_t kPiece = 1 << 20;
    Guard guard(mutex_);
    if (!text_ || !exchange.all_written()) return;
    if (sent_ >= text_->size()) return exchange.finish(grpc::Status::OK);
    v1::ReduceReply reply;
    reply.mutable_chunk()->set_path(kFileName);
    reply.mutable_chunk()->set_data(text_->substr(sent_, kPiece));
    sent_ += kPiece;
    exchange.write(serialized(reply));
  }

  const Parts& parts_;
  std::optional<v1::ReduceHeader> header_;
  std::optional<Bundle> bundle_;
  MemoryShare header_share_, model_share_, text_share_;
  Mutex mutex_;
  std::optional<std::string> text_ TS_GUARDED_BY(mutex_);  ///< when the report has been sent
  std::size_t sent_ TS_GUARDED_BY(mutex_) = 0;
};

}  // namespace

void add_reduction(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Reduction/Reduce",
           stream(Role::control, [&parts] { return std::make_unique<ReduceHandler>(parts); }));
}

}  // namespace mbcosim::server
