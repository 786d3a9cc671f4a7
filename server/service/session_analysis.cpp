/// Linearization and eigenvalues of a session's current state. They take no slot of the steps: the
/// lane of heavy work bounds them, at a lower priority, so that a few of them starve no step.
#include <complex>

#include "model/inverse_problem.h"
#include "service/session.h"
#include "simulation/linearize.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr int kLargestStateSpace = 2000;  ///< unknowns; the elimination works on full matrices
constexpr double kNoRate = 1e-9;

void put(const MatX& from, v1::Matrix* to) {
  to->set_rows(static_cast<int>(from.rows()));
  to->set_columns(static_cast<int>(from.cols()));
  to->mutable_values()->Reserve(static_cast<int>(from.size()));
  for (Eigen::Index i = 0; i < from.rows(); ++i)
    for (Eigen::Index j = 0; j < from.cols(); ++j) to->add_values(from(i, j));
}

void put(const Model& model, const std::vector<double>& values, v1::Matrix* to) {
  to->set_rows(model.unknowns);
  to->set_columns(model.unknowns);
  to->set_sparse(true);
  for (int j = 0; j < model.unknowns; ++j)
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k) {
      if (values[k] == 0) continue;
      to->add_values(values[k]);
      to->add_row_indices(model.row_index[k]);
      to->add_column_indices(j);
    }
}

void fill_descriptor(const Linearization& system, const InputsOutputs& io,
                     v1::LinearizeReply* reply) {
  const double scale = io.c0.size() > 0 ? 1 + io.c0.cwiseAbs().maxCoeff() : 1;
  if (io.c1.size() > 0 && io.c1.cwiseAbs().maxCoeff() > kNoRate * scale)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "an output depends on rates of unknowns (a velocity, say), which the descriptor "
                  "form cannot express: ask for the state space form");
  put(*system.model, system.a, reply->mutable_a());
  put(*system.model, system.e, reply->mutable_e());
  put(io.b, reply->mutable_b());
  put(io.c0, reply->mutable_c());
  put(io.d0, reply->mutable_d());
  for (int i = 0; i < system.model->unknowns; ++i) {
    const auto [owner, equation] = system.model->row_text(i);
    reply->add_state_names(owner + ", unknown of: " + equation);
  }
}

void fill_state_space(const Linearization& system, const InputsOutputs& io,
                      const CancelToken& cancel, v1::LinearizeReply* reply) {
  if (system.model->unknowns > kLargestStateSpace)
    throw limit_refusal("state_space_unknowns", kLargestStateSpace,
                        "the model is too large for the state space form: ask for the descriptor "
                        "form");
  auto reduced = state_space(system, io, &cancel);
  if (!reduced) throw Refusal(reduced.error());
  put(reduced->a, reply->mutable_a());
  put(reduced->b, reply->mutable_b());
  put(reduced->c, reply->mutable_c());
  put(reduced->d, reply->mutable_d());
  for (Eigen::Index i = 0; i < reduced->a.rows(); ++i)
    reply->add_state_names("z" + std::to_string(i + 1));
}

}  // namespace

// A copy: the analysis of a large model takes long, and the simulation is free meanwhile.
State Session::state_at_rest(std::int64_t* step) {
  require_usable();
  if (inverse_problem(*model_))
    throw Refusal(
        v1::REASON_BAD_ARGUMENT,
        "an inverse dynamics problem prescribes the motion: there is nothing to linearize");
  if (status_.stepping())
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; it is analysed between advances");
  std::lock_guard lock(lock_);
  *step = simulation_->step_number();
  return simulation_->snapshot();
}

void Session::linearize(const v1::LinearizeRequest& request, Call& call,
                        v1::LinearizeReply* reply) {
  variables_.check(request.inputs());
  variables_.check(request.outputs());
  std::int64_t step = 0;
  const State state = state_at_rest(&step);
  const CallToken token(call);
  MemoryShare share;
  within(shared_.memory, &token, &share, [&] {
    const Linearization system = mbcosim::linearize(*model_, state);
    const auto io = linearize_inputs_outputs(
        *model_, state, Variables(*model_),
        std::vector<int>(request.inputs().begin(), request.inputs().end()),
        std::vector<int>(request.outputs().begin(), request.outputs().end()), &token);
    if (!io) throw Refusal(io.error());
    if (request.descriptor_form())
      fill_descriptor(system, *io, reply);
    else
      fill_state_space(system, *io, token, reply);
    return true;
  });
  reply->set_step(step);
}

void Session::eigenvalues(const v1::ComputeEigenvaluesRequest& request, Call& call,
                          v1::ComputeEigenvaluesReply* reply) {
  if (request.count() < 0) throw Refusal(v1::REASON_BAD_ARGUMENT, "`count` must not be negative");
  if (!std::isfinite(request.shift_hz()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`shift_hz` must be finite");
  std::int64_t step = 0;
  const State state = state_at_rest(&step);
  const CallToken token(call);
  MemoryShare share;
  const auto spectrum = within(shared_.memory, &token, &share, [&] {
    return eigen(mbcosim::linearize(*model_, state), request.count(),
                 std::complex<double>(0, 2 * M_PI * request.shift_hz()),
                 {request.eigenvectors(), &token});
  });
  if (!spectrum) throw Refusal(spectrum.error());
  reply->set_step(step);
  for (const std::complex<double>& s : spectrum->values) {
    reply->add_real(s.real());
    reply->add_imaginary(s.imag());
  }
  if (!request.eigenvectors()) return;
  put(spectrum->vectors.real(), reply->mutable_vectors_real());
  put(spectrum->vectors.imag(), reply->mutable_vectors_imaginary());
}

}  // namespace mbcosim::server
