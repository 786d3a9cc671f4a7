#include "output/text_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>

#include "output/eigen_text.h"
#include "output/model_log.h"
#include "output/record.h"
#include "output/sample_files.h"
#include "output/scientific.h"
#include "output/text_file.h"

namespace mbcosim {

namespace {

/// Modal joints print elsewhere but have an (empty) file of joints.
bool has_joint_output(const Model& model) {
  return std::any_of(model.elements.begin(), model.elements.end(), [](const ElementRef& e) {
    const ElementInfo& info = e.set->info(e.index);
    return info.family == Family::joint && info.output;
  });
}

class TextWriter : public ResultWriter, private OutputRow {
 public:
  explicit TextWriter(const std::string& prefix) : prefix_(prefix) {
    for (std::size_t k = 0; k < files_.size(); ++k)
      files_[k].open(prefix + "." + extension(static_cast<OutputFile>(k)));
    out_.open(prefix + ".out");
    log_.open(prefix + ".log");
  }

  void begin(const Model& model) override {
    model_ = &model;
    precision_ = model.control.output_precision;
    out_.create();
    log_.create();
    log_.text(model_log(model));
    samples_.open(model, prefix_);
    if (has_joint_output(model)) files_[static_cast<std::size_t>(OutputFile::jnt)].create();
    if (model.control.output_reference_frames) write_reference_frames(model, *this);
  }
  void derivatives(double time, int iterations, double error) override {
    out_.text("# Derivatives solution step at time " + general(time) + " performed in " +
              std::to_string(iterations) + " iterations with " + general(error) + " error\n");
    if (model_->initial_value.dummy_steps == 0) header();
  }
  void dummy_steps(double time, int iterations, double error) override {
    out_.text("# Initial solution after dummy steps at time " + general(time) + " performed in " +
              std::to_string(iterations) + " iterations with " + general(error) + " error\n");
    header();
  }
  void step(const StepLine& s) override {
    char* p = out_.room(256);
    const auto put = [&](std::string_view t) {
      std::memcpy(p, t.data(), t.size());
      p += t.size();
    };
    const auto number = [&](double v) {
      *p++ = ' ';
      p = std::to_chars(p, p + 40, v, std::chars_format::general, precision_).ptr;
    };
    put("Step ");
    p = std::to_chars(p, p + 24, s.step).ptr;
    number(s.time);
    number(s.h);
    *p++ = ' ';
    p = std::to_chars(p, p + 24, s.iterations).ptr;
    number(s.residual_error);
    number(s.solution_error);
    put(s.by_solution ? " 1" : " 0");
    put(s.recorded ? " 1\n" : " 0\n");
    out_.commit(p);
  }
  void note(const std::string& text) override { out_.text(text); }
  void eigenanalysis(const EigenReport& report) override {
    out_.text(eigen_table(report));
    TextFile file;
    file.open(prefix_ + eigen_suffix(report) + ".m");
    file.text(eigen_file(report, *model_));
    if (!file.finish() && error_.empty()) error_ = file.error();
  }
  void record(const EvalContext& context) override { write_record(context, *this); }
  void samples(const EvalContext& context) override {
    samples_.write(*context.state);
    write_traces(context, *this);
  }
  Status status() const override {
    if (!error_.empty()) return not_written(error_);
    for (const TextFile* f : {&out_, &log_})
      if (!f->error().empty()) return not_written(f->error());
    for (const TextFile& f : files_)
      if (!f.error().empty()) return not_written(f.error());
    return ok();
  }
  Status finish() override {
    out_.finish();
    log_.finish();
    for (TextFile& f : files_) f.finish();
    if (!samples_.finish() && error_.empty())
      error_ = "cannot write the samples \"" + prefix_ + ".*\"";
    return status();
  }

 private:
  static constexpr std::size_t kField =
      48;  ///< bytes of one field, with margin for the largest precision used

  static Error not_written(const std::string& what) {
    return make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN", what);
  }
  void header() {
    out_.text(
        "# Key for lines starting with \"Step\":\n# Step Time TStep NIter ResErr SolErr SolConv "
        "Out\n");
  }
  std::string general(double v) const {
    char buffer[64];
    return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, v,
                                             std::chars_format::general, precision_)
                                   .ptr);
  }

  // OutputRow
  void begin(OutputFile file, int label) override {
    current_ = &files_[static_cast<std::size_t>(file)];
    char digits[16];
    const auto end = std::to_chars(digits, digits + sizeof digits, label).ptr;
    const int count = static_cast<int>(end - digits);
    char* p = current_->room(32);
    if (file != OutputFile::frc && file != OutputFile::trc)
      for (int k = count; k < 8; ++k) *p++ = ' ';
    std::memcpy(p, digits, count);
    current_->commit(p + count);
  }
  void begin_text(OutputFile file, std::string_view label) override {
    current_ = &files_[static_cast<std::size_t>(file)];
    current_->text(label);
  }
  void integer(int value) override {
    char* p = current_->room(16);
    *p++ = ' ';
    current_->commit(std::to_chars(p, p + 15, value).ptr);
  }
  void number(double value) {
    char* p = current_->room(kField + precision_);
    *p++ = ' ';
    current_->commit(write_scientific(p, value, precision_));
  }
  void scalar(const char*, const char*, double value) override { number(value); }
  void vec3(const char*, const char*, const Vec3& v) override {
    number(v(0));
    number(v(1));
    number(v(2));
  }
  void values(const char*, const char*, const double* data, int count) override {
    for (int k = 0; k < count; ++k) number(data[k]);
  }
  void end() override {
    char* p = current_->room(1);
    *p = '\n';
    current_->commit(p + 1);
  }

  std::string prefix_;
  const Model* model_ = nullptr;
  int precision_ = 6;
  std::string error_;  ///< of files other than the members
  std::array<TextFile, static_cast<std::size_t>(OutputFile::count)> files_;
  TextFile out_, log_;
  SampleFiles samples_;
  TextFile* current_ = nullptr;
};

}  // namespace

std::shared_ptr<ResultWriter> make_text_writer(const std::string& prefix) {
  return std::make_shared<TextWriter>(prefix);
}

}  // namespace mbcosim
