// Hints of `driven` (input manual, section on driven elements): data of an element that are taken
// from the model's state whenever the element becomes active.

#include <algorithm>

#include "input/deck.h"
#include "input/deck_card.h"
#include "input/lexer.h"
#include "model/context.h"
#include "model/drive.h"
#include "model/registry.h"
#include "model/state.h"

namespace mbcosim {

namespace {

/// The number that was sampled last.
class SampledDrive final : public Drive {
 public:
  explicit SampledDrive(int memory) : memory_(memory) {}
  double value(const EvalContext& context, double) const override {
    return context.state->memory[memory_];
  }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double) const override { return 0; }

 private:
  int memory_;
};

/// Three sampled numbers times a drive.
class SampledVec3Drive final : public TplDrive<3, 1> {
 public:
  SampledVec3Drive(const int (&memory)[3], DrivePtr factor) : factor_(std::move(factor)) {
    std::copy(memory, memory + 3, memory_);
  }
  Vec3 value(const EvalContext& context) const override {
    return vector(context) * factor_->value(context);
  }
  bool has_derivative() const override { return factor_->has_derivative(); }
  Vec3 derivative(const EvalContext& context) const override {
    return has_derivative() ? Vec3(vector(context) * derivative_in_time(*factor_, context))
                            : Vec3(Vec3::Zero());
  }

 private:
  Vec3 vector(const EvalContext& context) const {
    const std::vector<double>& m = context.state->memory;
    return {m[memory_[0]], m[memory_[1]], m[memory_[2]]};
  }
  int memory_[3];
  DrivePtr factor_;
};

}  // namespace

Hint DeckCard::hint() {
  Hint hint;
  hint.arguments = cursor_.quoted_statement("hint");
  hint.where = last();
  std::string_view& text = hint.arguments.text;
  const std::size_t open = text.find('{');
  const std::size_t close = text.rfind('}');
  if (open == std::string_view::npos || close == std::string_view::npos || close < open ||
      skip_blanks(text, close + 1) < text.size())
    fail_at(hint.where, "hint must have the form <name>{<arguments>}",
            "e.g. \"drive{model::distance(1, 2)}\"");
  hint.name = text.substr(0, open);
  while (!hint.name.empty() && is_blank(hint.name.back())) hint.name.pop_back();
  while (!hint.name.empty() && is_blank(hint.name.front())) hint.name.erase(0, 1);
  text = text.substr(open + 1, close - open - 1);
  hint.arguments.offset += open + 1;
  hint.arguments.word = hint.name;
  hint.arguments.has_arguments = true;
  hint.arguments.arguments = 0;
  return hint;
}

void DeckCard::set_hints(std::vector<Hint>* hints, std::vector<HintSample>* samples) {
  hints_ = hints;
  samples_ = samples;
}

Hint* DeckCard::use_hint(std::string_view name) {
  if (!hints_) return nullptr;
  const auto hint = std::find_if(hints_->begin(), hints_->end(),
                                 [&](const Hint& h) { return !h.used && h.name == name; });
  if (hint == hints_->end()) return nullptr;
  hint->used = true;
  return &*hint;
}

/// The next argument as an expression that is evaluated at each activation; its place in
/// State::memory.
int DeckCard::sample(DeckCard& arguments, std::string_view what) {
  if (!arguments.more())
    arguments.fail(std::string(what) + ": number expected in the hint", "", "wrong-argument");
  if (registry().drives.count(arguments.peek_word()))
    arguments.fail_expected(std::string(what) + ": a number is expected in the hint",
                            "a hint sets a value that is constant while the element is active");
  const std::string text(arguments.next_text());
  arguments.skip();
  HintSample sample;
  sample.source = arguments.string_expression(text);
  sample.memory = builder().allocate_memory(1, 0);
  samples_->push_back(sample);
  return sample.memory;
}

template <class Given, class Read>
Given DeckCard::from_hint(std::string_view name, std::string_view form, Given given, Read read) {
  Hint* hint = use_hint(name);
  if (!hint) return given;
  DeckCard arguments(deck_, hint->arguments);
  arguments.set_subject(subject_);
  arguments.keyword(form);
  Given sampled = read(arguments);
  arguments.expect_end();
  return sampled;
}

DrivePtr DeckCard::hinted(std::string_view name, DrivePtr given) {
  return from_hint(name, "const", std::move(given), [&](DeckCard& arguments) {
    return std::make_shared<SampledDrive>(sample(arguments, name));
  });
}

Vec3DrivePtr DeckCard::hinted(std::string_view name, Vec3DrivePtr given) {
  return from_hint(name, "single", std::move(given), [&](DeckCard& arguments) {
    int memory[3];
    for (int& m : memory) m = sample(arguments, name);
    DrivePtr factor = arguments.more() ? arguments.drive() : make_constant_drive(1);
    return std::make_shared<SampledVec3Drive>(memory, std::move(factor));
  });
}

}  // namespace mbcosim
