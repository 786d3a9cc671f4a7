#include "output/result_files.h"

#include "output/netcdf_writer.h"
#include "output/text_writer.h"

namespace mbcosim {

namespace {

/// Two writers side by side.
class BothWriters : public ResultWriter {
 public:
  BothWriters(std::shared_ptr<ResultWriter> first, std::shared_ptr<ResultWriter> second)
      : first_(std::move(first)), second_(std::move(second)) {}
  void begin(const Model& model) override {
    each([&](ResultWriter& w) { w.begin(model); });
  }
  void derivatives(double time, int iterations, double error) override {
    each([&](ResultWriter& w) { w.derivatives(time, iterations, error); });
  }
  void dummy_steps(double time, int iterations, double error) override {
    each([&](ResultWriter& w) { w.dummy_steps(time, iterations, error); });
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

std::shared_ptr<ResultWriter> make_result_writer(const Model& model, const std::string& prefix) {
  auto text = make_text_writer(prefix);
  if (!model.control.netcdf) return text;
  return std::make_shared<BothWriters>(std::move(text), make_netcdf_writer(prefix));
}

}  // namespace mbcosim
