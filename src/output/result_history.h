/// Result files that hold the accepted history of one simulation, whatever state it goes back to.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "output/result_budget.h"
#include "output/result_writer.h"
#include "output/text_file.h"

namespace mbcosim {

/// Passes on what it is told. What each file held after each step stands in an index beside the
/// files: a few bytes a step. When the simulation is restored the files are cut back to that step.
class ResultHistory final : public ResultWriter {
 public:
  /// `index`: path of the index; `budget` is of the files' bytes. Those of the index count, and are
  /// written even where nothing else fits: they are the way back.
  ResultHistory(std::shared_ptr<ResultWriter> writer, const std::string& index,
                ResultBudget& budget);

  /// Last step whose results are all in the files; -1: before the first record.
  std::int64_t end() const;
  /// The state that `restored` will be told shares its history with the files up to this step only;
  /// by default up to its own step.
  void expect(std::int64_t step) { expected_ = step; }
  /// Could the files be cut to what they share with a history up to this step?
  Status can_go_back(std::int64_t step);
  /// Is there room for another step as large as twice the largest since the last restore?
  bool has_room() const;

  void begin(const Model& model) override;
  void derivatives(double time, int iterations, double error) override {
    writer_->derivatives(time, iterations, error);
  }
  void dummy_steps(double time, int iterations, double error) override {
    writer_->dummy_steps(time, iterations, error);
  }
  void step(const StepLine& line) override;
  void begin_at(std::int64_t step, double time) override { writer_->begin_at(step, time); }
  void note(const std::string& text) override { writer_->note(text); }
  void eigenanalysis(const EigenReport& report) override { writer_->eigenanalysis(report); }
  void record(const EvalContext& context) override;
  void samples(const EvalContext& context) override;
  Status status() const override;
  Status finish() override;
  /// `restored` follows, with the state to go on from.
  void resume(const Model& model) override;
  Status restored(const EvalContext& context) override;
  Status flush(bool to_disk) override;

 private:
  struct Mark {
    std::int64_t step = -1;               ///< -1: before the first record
    std::vector<std::int64_t> positions;  ///< of the files; empty: there is no mark
    std::int64_t index_size = 0;          ///< of the index, this mark included
  };

  void arrive(std::int64_t step);
  void complete();
  Mark mark_now() const;
  void append(const Mark& mark);
  /// The last mark that is not after `step`.
  Mark find(std::int64_t step);
  Mark mark_for(std::int64_t step);
  Status go_back(const Mark& mark, const EvalContext& context);
  std::int64_t bytes() const;
  bool is_over_budget() const;

  static constexpr std::int64_t kOwn = INT64_MAX;

  const std::shared_ptr<ResultWriter> writer_;
  const std::string index_path_;
  ResultBudget& budget_;
  TextFile index_;
  Mark last_;               ///< in the index
  std::int64_t step_ = -1;  ///< that the files are at; -1: before the first record
  std::int64_t expected_ = kOwn;
  std::int64_t bytes_before_ = 0, largest_step_ = 0;  ///< since the last restore
};

}  // namespace mbcosim
