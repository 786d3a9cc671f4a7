#include "output/result_files.h"

#include <algorithm>

#include "output/netcdf_writer.h"
#include "output/text_writer.h"

namespace mbcosim {

namespace {

/// Two writers side by side.
class BothWriters : public ResultWriter {
 public:
  BothWriters(std::shared_ptr<ResultWriter> first, std::shared_ptr<ResultWriter> second)
      : first_(std::move(first)), second_(std::move(second)) {}
  std::vector<std::string> paths(const Model& model) const override {
    std::vector<std::string> all = first_->paths(model), more = second_->paths(model);
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  void begin(const Model& model) override {
    each([&](ResultWriter& w) { w.begin(model); });
  }
  void derivatives(double time, int iterations, double error) override {
    each([&](ResultWriter& w) { w.derivatives(time, iterations, error); });
  }
  void dummy_steps(double time, int iterations, double error) override {
    each([&](ResultWriter& w) { w.dummy_steps(time, iterations, error); });
  }
  void begin_at(std::int64_t step, double time) override {
    each([&](ResultWriter& w) { w.begin_at(step, time); });
  }
  void step(const StepLine& line) override {
    each([&](ResultWriter& w) { w.step(line); });
  }
  void note(const std::string& text) override {
    each([&](ResultWriter& w) { w.note(text); });
  }
  void eigenanalysis(const EigenReport& report) override {
    each([&](ResultWriter& w) { w.eigenanalysis(report); });
  }
  void record(const EvalContext& context) override {
    each([&](ResultWriter& w) { w.record(context); });
  }
  void samples(const EvalContext& context) override {
    each([&](ResultWriter& w) { w.samples(context); });
  }
  Status status() const override {
    Status first = first_->status();
    return first ? second_->status() : first;
  }
  void resume(const Model& model) override {
    each([&](ResultWriter& w) { w.resume(model); });
  }
  void positions(std::vector<std::int64_t>& out) const override {
    first_->positions(out);
    second_->positions(out);
  }
  Status go_back(std::span<const std::int64_t>& positions, const EvalContext& context) override {
    Status first = first_->go_back(positions, context),
           second = second_->go_back(positions, context);
    return first ? second : first;
  }
  Status flush(bool to_disk) override {
    Status first = first_->flush(to_disk), second = second_->flush(to_disk);
    return first ? second : first;
  }
  std::int64_t waiting() const override { return first_->waiting() + second_->waiting(); }
  Status finish() override {
    Status first = first_->finish(), second = second_->finish();
    return first ? second : first;
  }

 private:
  template <class Action>
  void each(Action&& action) {
    action(*first_);
    action(*second_);
  }
  std::shared_ptr<ResultWriter> first_, second_;
};

}  // namespace

std::vector<ResultFormat> result_formats(const Model& model) {
  if (model.control.netcdf) return {ResultFormat::text, ResultFormat::netcdf};
  return {ResultFormat::text};
}

std::shared_ptr<ResultWriter> make_result_writer(const std::vector<ResultFormat>& formats,
                                                 const std::string& prefix, ResultBudget* budget) {
  std::shared_ptr<ResultWriter> writer;
  for (const ResultFormat format : {ResultFormat::text, ResultFormat::netcdf}) {
    if (std::find(formats.begin(), formats.end(), format) == formats.end()) continue;
    auto next = format == ResultFormat::text ? make_text_writer(prefix, budget)
                                             : make_netcdf_writer(prefix, budget);
    writer = writer ? std::make_shared<BothWriters>(std::move(writer), std::move(next))
                    : std::move(next);
  }
  return writer;
}

std::shared_ptr<ResultWriter> make_result_writer(const Model& model, const std::string& prefix) {
  return make_result_writer(result_formats(model), prefix, nullptr);
}

}  // namespace mbcosim
