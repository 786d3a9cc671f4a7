#include "service/analysis.h"

#include <complex>

#include "model/diagnostic.h"
#include "service/kept_replies.h"
#include "simulation/linearize.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr int kLargestStateSpace = 2000;  ///< unknowns; the elimination works on full matrices
constexpr double kNoRate = 1e-9;

constexpr std::int64_t kPageNumbers = 100000;

using LinearizePages = PageWriter<v1::LinearizeReply>;

/// All entries; `part` is the matrix of a page.
template <class Pages, class Part>
void put(const MatX& from, Pages& pages, Part part) {
  const auto begin = [&](std::int64_t numbers) {
    v1::Matrix* to = part(pages.room(numbers));
    to->set_rows(static_cast<int>(from.rows()));
    to->set_columns(static_cast<int>(from.cols()));
    return to;
  };
  begin(0);
  for (Eigen::Index i = 0; i < from.rows(); ++i)
    for (Eigen::Index j = 0; j < from.cols(); ++j) begin(1)->add_values(from(i, j));
}

/// What is not zero, by columns.
template <class Part>
void put(const Model& model, const std::vector<double>& values, LinearizePages& pages, Part part) {
  const auto begin = [&](std::int64_t numbers) {
    v1::Matrix* to = part(pages.room(numbers));
    to->set_rows(model.unknowns);
    to->set_columns(model.unknowns);
    to->set_sparse(true);
    return to;
  };
  begin(0);
  for (int j = 0; j < model.unknowns; ++j)
    for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k) {
      if (values[k] == 0) continue;
      v1::Matrix* to = begin(2);
      to->add_values(values[k]);
      to->add_row_indices(model.row_index[k]);
      to->add_column_indices(j);
    }
}

void put_name(std::string name, LinearizePages& pages) {
  pages.room(1 + std::ssize(name) / 8).add_state_names(std::move(name));
}

v1::Matrix* part_a(v1::LinearizeReply& page) { return page.mutable_a(); }
v1::Matrix* part_b(v1::LinearizeReply& page) { return page.mutable_b(); }
v1::Matrix* part_c(v1::LinearizeReply& page) { return page.mutable_c(); }
v1::Matrix* part_d(v1::LinearizeReply& page) { return page.mutable_d(); }
v1::Matrix* part_e(v1::LinearizeReply& page) { return page.mutable_e(); }

void fill_descriptor(const Linearization& system, const InputsOutputs& io, LinearizePages& pages) {
  const double scale = io.c0.size() > 0 ? 1 + io.c0.cwiseAbs().maxCoeff() : 1;
  if (io.c1.size() > 0 && io.c1.cwiseAbs().maxCoeff() > kNoRate * scale)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "an output depends on rates of unknowns (a velocity, say), which the descriptor "
                  "form cannot express: ask for the state space form");
  put(*system.model, system.a, pages, part_a);
  put(*system.model, system.e, pages, part_e);
  put(io.b, pages, part_b);
  put(io.c0, pages, part_c);
  put(io.d0, pages, part_d);
  for (int i = 0; i < system.model->unknowns; ++i) {
    const auto [owner, equation] = system.model->row_text(i);
    put_name(owner + ", unknown of: " + equation, pages);
  }
}

void fill_state_space(const Linearization& system, const InputsOutputs& io,
                      const CancelToken& cancel, LinearizePages& pages) {
  if (system.model->unknowns > kLargestStateSpace)
    throw limit_refusal("state_space_unknowns", kLargestStateSpace,
                        "the model is too large for the state space form: ask for the descriptor "
                        "form");
  auto reduced = state_space(system, io, &cancel);
  if (!reduced) throw Refusal(reduced.error());
  put(reduced->a, pages, part_a);
  put(reduced->b, pages, part_b);
  put(reduced->c, pages, part_c);
  put(reduced->d, pages, part_d);
  for (Eigen::Index i = 0; i < reduced->a.rows(); ++i) put_name("z" + std::to_string(i + 1), pages);
}

void fill_spectrum(const Spectrum& spectrum, bool vectors,
                   PageWriter<v1::ComputeEigenvaluesReply>& pages) {
  for (const std::complex<double>& s : spectrum.values) {
    v1::ComputeEigenvaluesReply& page = pages.room(2);
    page.add_real(s.real());
    page.add_imaginary(s.imag());
  }
  if (!vectors) return;
  put(spectrum.vectors.real(), pages, [](auto& page) { return page.mutable_vectors_real(); });
  put(spectrum.vectors.imag(), pages, [](auto& page) { return page.mutable_vectors_imaginary(); });
}

/// Computes a reply in pages, all of it counted, and tells the first.
template <class Reply, class Request, class Compute>
void tell_pages(ReplyPages<Reply>& kept, const Request& request, MemoryBudget& memory, Call& call,
                Reply* reply, Compute compute) {
  const std::int64_t size = page_size_of(request, kPageNumbers);
  Request question = request;
  question.clear_page_token();
  const std::uint64_t digest = digest_of("", question);
  if (!request.page_token().empty()) return kept.next(request.page_token(), digest, reply);
  auto whole = std::make_unique<typename ReplyPages<Reply>::Whole>();
  const CallToken token(call);
  MemoryShare share;
  whole->pages = within(memory, &token, &share, [&] {
    PageWriter<Reply> pages(size);
    std::int64_t step = 0;
    try {
      step = compute(token, pages);
    } catch (const EvaluationError& error) {  // at a state that was imported, say
      throw Refusal(v1::REASON_EVALUATION, error.what());
    }
    std::vector<Reply> made = pages.take();
    for (Reply& page : made) page.set_step(step);
    return made;
  });
  whole->share = std::move(share);
  kept.first(std::move(whole), digest, reply);
}

}  // namespace

void Analysis::linearize(const v1::LinearizeRequest& request, const TakeState& take_state,
                         Call& call, v1::LinearizeReply* reply) {
  variables_.check(request.inputs());
  variables_.check(request.outputs());
  tell_pages(linearization_, request, memory_, call, reply,
             [&](const CancelToken& token, LinearizePages& pages) {
               std::int64_t step = 0;
               const State state = take_state(&step);
               const Linearization system = mbcosim::linearize(model_, state);
               const auto io = linearize_inputs_outputs(
                   model_, state, Variables(model_),
                   std::vector<int>(request.inputs().begin(), request.inputs().end()),
                   std::vector<int>(request.outputs().begin(), request.outputs().end()), &token);
               if (!io) throw Refusal(io.error());
               if (request.descriptor_form())
                 fill_descriptor(system, *io, pages);
               else
                 fill_state_space(system, *io, token, pages);
               return step;
             });
}

void Analysis::eigenvalues(const v1::ComputeEigenvaluesRequest& request,
                           const TakeState& take_state, Call& call,
                           v1::ComputeEigenvaluesReply* reply) {
  if (request.has_count() && request.count() <= 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`count` must be positive, got " + std::to_string(request.count()));
  if (!std::isfinite(request.shift()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`shift` must be finite");
  tell_pages(spectrum_, request, memory_, call, reply, [&](const CancelToken& token, auto& pages) {
    std::int64_t step = 0;
    const State state = take_state(&step);
    const auto spectrum = eigen(mbcosim::linearize(model_, state), request.count(),
                                std::complex<double>(0, 2 * M_PI * request.shift()),
                                {request.eigenvectors(), &token});
    if (!spectrum) throw Refusal(spectrum.error());
    fill_spectrum(*spectrum, request.eigenvectors(), pages);
    return step;
  });
}

}  // namespace mbcosim::server
