#include "output/result_history.h"

#include <algorithm>
#include <fstream>
#include <utility>

namespace mbcosim {

namespace {

// A mark: the step and the positions as differences from the mark before; of the positions those
// that changed, each after its number counted from 1, and a zero. Numbers have seven bits a byte.

void put(std::string& out, std::uint64_t value) {
  for (; value >= 128; value >>= 7) out += static_cast<char>(value | 128);
  out += static_cast<char>(value);
}

void put_signed(std::string& out, std::int64_t value) {
  put(out, (static_cast<std::uint64_t>(value) << 1) ^ static_cast<std::uint64_t>(value >> 63));
}

bool get(std::istream& in, std::uint64_t* value) {
  *value = 0;
  for (int shift = 0; shift < 64; shift += 7) {
    const int byte = in.get();
    if (byte < 0) return false;
    *value |= static_cast<std::uint64_t>(byte & 127) << shift;
    if (byte < 128) return true;
  }
  return false;
}

bool get_signed(std::istream& in, std::int64_t* value) {
  std::uint64_t bits = 0;
  if (!get(in, &bits)) return false;
  *value = static_cast<std::int64_t>(bits >> 1) ^ -static_cast<std::int64_t>(bits & 1);
  return true;
}

bool read_mark(std::istream& in, std::int64_t* step, std::vector<std::int64_t>& positions) {
  std::int64_t steps = 0;
  if (!get_signed(in, &steps)) return false;
  std::uint64_t number = 0;
  while (get(in, &number) && number != 0) {
    std::int64_t change = 0;
    if (!get_signed(in, &change) || number > positions.size()) return false;
    positions[number - 1] += change;
  }
  *step += steps;
  return in.good();
}

}  // namespace

ResultHistory::ResultHistory(std::shared_ptr<ResultWriter> writer, const std::string& index,
                             ResultBudget& budget)
    : writer_(std::move(writer)), index_path_(index), budget_(budget) {
  index_.open(index);
}

// ------------------------------------------------------------------ marks

ResultHistory::Mark ResultHistory::mark_now() const {
  Mark mark;
  mark.step = step_;
  writer_->positions(mark.positions);
  mark.index_size = std::max<std::int64_t>(0, index_.size());
  return mark;
}

void ResultHistory::append(const Mark& mark) {
  std::string text;
  put_signed(text, mark.step - last_.step);
  last_.positions.resize(mark.positions.size(), 0);
  for (std::size_t k = 0; k < mark.positions.size(); ++k) {
    const std::int64_t change = mark.positions[k] - last_.positions[k];
    if (change == 0) continue;
    put(text, k + 1);
    put_signed(text, change);
  }
  text += '\0';
  index_.text(text);
  last_ = mark;
  last_.index_size = index_.size();
}

ResultHistory::Mark ResultHistory::find(std::int64_t step) {
  Mark found, next;
  if (!index_.retry()) return found;
  next.positions.resize(mark_now().positions.size(), 0);
  std::ifstream in(index_path_, std::ios::binary);
  while (read_mark(in, &next.step, next.positions) && next.step <= step) {
    next.index_size = in.tellg();
    found = next;
  }
  return found;
}

std::int64_t ResultHistory::bytes() const {
  return budget_.used() + writer_->waiting() + std::max<std::int64_t>(0, index_.size());
}

bool ResultHistory::is_over_budget() const {
  const Status written = status();
  return !written && written.error().kind == ErrorKind::limit;
}

std::int64_t ResultHistory::end() const {
  return is_over_budget() ? std::min(last_.step, step_) : step_;
}

bool ResultHistory::has_room() const { return bytes() + 2 * largest_step_ <= budget_.most(); }

// Something of this step comes: the one before is complete.
void ResultHistory::arrive(std::int64_t step) {
  if (step == step_) return;
  const std::int64_t now = bytes();
  if (step_ > 0) largest_step_ = std::max(largest_step_, now - bytes_before_);
  bytes_before_ = now;
  complete();
  step_ = step;
}

// The present step's mark stands in the index.
void ResultHistory::complete() {
  if (last_.positions.empty() || last_.step != step_) append(mark_now());
}

// ------------------------------------------------------------------ what is told

void ResultHistory::begin(const Model& model) {
  writer_->begin(model);
  index_.create();
}

void ResultHistory::step(const StepLine& line) {
  arrive(line.step);
  writer_->step(line);
}

void ResultHistory::record(const EvalContext& context) {
  arrive(context.state->step);
  writer_->record(context);
}

void ResultHistory::samples(const EvalContext& context) {
  arrive(context.state->step);
  writer_->samples(context);
}

Status ResultHistory::status() const {
  Status written = writer_->status();
  return written ? index_.status() : written;
}

Status ResultHistory::finish() {
  Status written = writer_->finish();
  index_.finish();
  return written ? index_.status() : written;
}

Status ResultHistory::flush(bool to_disk) {
  if (!is_over_budget()) complete();  // else a part of the step is missing
  Status written = writer_->flush(to_disk);
  index_.retry();
  if (to_disk) index_.sync();
  return written ? index_.status() : written;
}

// ------------------------------------------------------------------ going back

void ResultHistory::resume(const Model& model) {
  writer_->resume(model);
  index_.reopen();
  step_ = INT64_MAX;  // as far as the index goes
}

namespace {

Error nothing_of(std::int64_t step) {
  return make_error(ErrorKind::data_loss, "RESULTS_CUT_SHORT",
                    "the result files have nothing of step " + std::to_string(step) + " or before");
}

}  // namespace

ResultHistory::Mark ResultHistory::mark_for(std::int64_t step) {
  return step_ <= step ? mark_now() : find(step);
}

Status ResultHistory::can_go_back(std::int64_t step) {
  if (mark_for(step).positions.empty()) return nothing_of(step);
  return ok();
}

Status ResultHistory::restored(const EvalContext& context) {
  const std::int64_t expected = std::exchange(expected_, kOwn);
  const std::int64_t target = context.state->step, common = std::min(target, expected);
  const Mark mark = mark_for(common);
  if (mark.positions.empty()) return nothing_of(common);
  if (auto status = go_back(mark, context); !status) return status;
  if (mark.step < target)
    writer_->note("# Goes on after step " + std::to_string(target) +
                  ": the steps between are not in these files\n");
  return ok();
}

Status ResultHistory::go_back(const Mark& mark, const EvalContext& context) {
  std::span<const std::int64_t> positions = mark.positions;
  if (auto status = writer_->go_back(positions, context); !status) return status;
  if (last_.step > mark.step || step_ > mark.step) {
    index_.cut(mark.index_size);
    last_ = mark;
  }
  step_ = mark.step;
  bytes_before_ = bytes();
  largest_step_ = 0;
  return index_.status();
}

}  // namespace mbcosim
