#include "output/text_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <utility>

#include "output/dof_text.h"
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
  TextWriter(const std::string& prefix, ResultBudget* budget) : prefix_(prefix), budget_(budget) {
    for (std::size_t k = 0; k < files_.size(); ++k)
      files_[k].open(prefix + "." + extension(static_cast<OutputFile>(k)), budget);
    out_.open(prefix + ".out", budget);
    log_.open(prefix + ".log", budget);
  }

  std::vector<std::string> paths(const Model& model) const override {
    std::vector<std::string> all = sample_paths(model, prefix_);
    for (const TextFile& file : files_) all.push_back(file.path());
    all.insert(all.end(), {out_.path(), log_.path()});
    if (has_dof_file(model)) all.push_back(dof_path());
    each_eigenanalysis(model, [&](const std::string& path, double) { all.push_back(path); });
    return all;
  }

  void begin(const Model& model) override {
    know(model);
    out_.create();
    log_.create();
    log_.text(model_log(model));
    if (has_dof_file(model)) write_whole(dof_path(), dof_text(model));
    if (has_joint_output(model)) files_[static_cast<std::size_t>(OutputFile::jnt)].create();
    if (model.control.output_reference_frames) write_reference_frames(model, *this);
  }
  void derivatives(double time, int iterations, double error) override {
    if (!messages_) return;
    out_.text("# Derivatives solution step at time " + general(time) + " performed in " +
              std::to_string(iterations) + " iterations with " + general(error) + " error\n");
    header_is_due_ = true;
  }
  void dummy_steps(double time, int iterations, double error) override {
    if (!messages_) return;
    out_.text("# Initial solution after dummy steps at time " + general(time) + " performed in " +
              std::to_string(iterations) + " iterations with " + general(error) + " error\n");
  }
  void begin_at(std::int64_t step, double time) override {
    if (!messages_) return;
    out_.text("# Begins at step " + std::to_string(step) + ", time " + general(time) + "\n");
    header();
  }
  void step(const StepLine& s) override {
    if (!messages_) return;
    if (std::exchange(header_is_due_, false)) header();
    char* p = out_.room(256);
    const auto put = [&](std::string_view t) {
      std::memcpy(p, t.data(), t.size());
      p += t.size();
    };
    const auto number = [&](double v) {
      *p++ = ' ';
      p = write_general(p, v, precision_);
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
    out_.text(eigen_table(report, precision_));
    if (report.settings.has_file())
      write_whole(prefix_ + eigen_suffix(report.settings, report.index) + ".m",
                  eigen_file(report, *model_));
  }
  void record(const EvalContext& context) override { write_record(context, *this); }
  void samples(const EvalContext& context) override {
    samples_.write(*context.state);
    write_traces(context, *this);
  }
  Status status() const override {
    Status found = other_;
    each_of(*this, [&](const TextFile& file) {
      if (found) found = file.status();
    });
    return found;
  }
  Status finish() override {
    each([](TextFile& file) { file.finish(); });
    return status();
  }

  void resume(const Model& model) override {
    know(model);
    each([](TextFile& file) { file.reopen(); });
    if (budget_ && has_dof_file(model)) (void)budget_->take(size_of(dof_path()));
    each_eigenanalysis(*model_, [&](const std::string& path, double) {
      if (budget_) (void)budget_->take(size_of(path));
    });
  }
  void positions(std::vector<std::int64_t>& out) const override {
    each_of(*this, [&](const TextFile& file) { out.push_back(file.size()); });
  }
  Status go_back(std::span<const std::int64_t>& positions, const EvalContext& context) override {
    bool whole = true;
    each([&](TextFile& file) {
      whole = file.cut(positions.front()) && whole;
      positions = positions.subspan(1);
    });
    samples_.go_back(*context.state);
    other_ = ok();
    forget_eigenanalyses_after(context.state->time);
    if (const Status now = status(); whole || !now) return now;
    return make_error(ErrorKind::data_loss, "RESULTS_CUT_SHORT",
                      "the result files end before step " + std::to_string(context.state->step));
  }
  Status flush(bool to_disk) override {
    each([&](TextFile& file) {
      file.retry();
      if (to_disk) file.sync();
    });
    return status();
  }
  std::int64_t waiting() const override {
    std::int64_t bytes = 0;
    each_of(*this, [&](const TextFile& file) { bytes += file.waiting(); });
    return bytes;
  }

 private:
  static constexpr std::size_t kField = 64;  ///< room for a number of any precision
  static constexpr int kAtOnce = 16;
  static constexpr int kLabel = 8;  ///< columns

  void know(const Model& model) {
    model_ = &model;
    precision_ = model.control.output_precision;
    messages_ = model.initial_value.messages;
    samples_.open(model, prefix_, budget_);
  }
  std::string dof_path() const { return prefix_ + ".dof"; }
  /// A file that is written once.
  void write_whole(const std::string& path, std::string_view text) {
    TextFile file;
    file.open(path, budget_);
    file.create();
    file.text(text);
    if (!file.finish() && other_) other_ = file.status();
  }
  /// Calls `action` with each file, always in the same order.
  template <class Self, class Action>
  static void each_of(Self& self, Action&& action) {
    for (auto& file : self.files_) action(file);
    action(self.out_);
    action(self.log_);
    self.samples_.each(action);
  }
  template <class Action>
  void each(Action&& action) {
    each_of(*this, action);
  }
  /// Calls `action` with the path and the time of each eigenanalysis of the deck.
  template <class Action>
  void each_eigenanalysis(const Model& model, Action&& action) const {
    const std::optional<EigenSettings>& s = model.initial_value.eigenanalysis;
    if (!s || !s->has_file()) return;
    for (std::size_t k = 0; k < s->times.size(); ++k)
      action(prefix_ + eigen_suffix(*s, static_cast<int>(k)) + ".m", s->times[k]);
  }
  /// Their files are none of this history any more.
  void forget_eigenanalyses_after(double now) {
    each_eigenanalysis(*model_, [&](const std::string& path, double time) {
      const std::int64_t size = size_of(path);
      if (size == 0 || time <= now) return;
      std::error_code none;
      std::filesystem::remove(path, none);
      if (budget_) budget_->give_back(size);
    });
  }
  static std::int64_t size_of(const std::string& path) {
    std::error_code none;
    const auto size = std::filesystem::file_size(path, none);
    return none ? 0 : static_cast<std::int64_t>(size);
  }
  void header() {
    out_.text(
        "# Key for lines starting with \"Step\":\n# Step Time TStep NIter ResErr SolErr SolConv "
        "Out\n");
  }
  std::string general(double v) const {
    char buffer[64];
    return std::string(buffer, write_general(buffer, v, precision_));
  }

  // OutputRow
  void begin(OutputFile file, int label) override {
    current_ = &files_[static_cast<std::size_t>(file)];
    char digits[16] = {};
    const auto end = std::to_chars(digits, digits + sizeof digits, label).ptr;
    const int count = static_cast<int>(end - digits);
    char* p = current_->room(32);
    if (count < kLabel && file != OutputFile::frc && file != OutputFile::drv &&
        file != OutputFile::trc) {
      std::memset(p, ' ', kLabel);
      p += kLabel - count;
    }
    std::memcpy(p, digits, sizeof digits);  // all of it: as many bytes each time
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
  void scalar(const char*, const char*, double value) override { numbers(&value, 1); }
  void vec3(const char*, const char*, const Vec3& v) override { numbers(v.data(), 3); }
  void values(const char*, const char*, const double* data, int count) override {
    for (; count > kAtOnce; data += kAtOnce, count -= kAtOnce) numbers(data, kAtOnce);
    numbers(data, count);
  }
  void numbers(const double* data, int count) {
    char* p = current_->room(kField * count);
    for (int k = 0; k < count; ++k) {
      *p++ = ' ';
      p = write_scientific(p, data[k], precision_);
    }
    current_->commit(p);
  }
  void end() override {
    char* p = current_->room(1);
    *p = '\n';
    current_->commit(p + 1);
  }

  const std::string prefix_;
  ResultBudget* const budget_;  ///< may be null
  const Model* model_ = nullptr;
  int precision_ = 6;
  bool messages_ = true;
  bool header_is_due_ = false;  ///< before the next step; eigenanalyses stand above it
  Status other_ = ok();         ///< of files other than the members
  std::array<TextFile, static_cast<std::size_t>(OutputFile::count)> files_;
  TextFile out_, log_;
  SampleFiles samples_;
  TextFile* current_ = nullptr;
};

}  // namespace

std::shared_ptr<ResultWriter> make_text_writer(const std::string& prefix, ResultBudget* budget) {
  return std::make_shared<TextWriter>(prefix, budget);
}

}  // namespace mbcosim
