// A drive's reader runs twice: while the deck is read, on a card that notes every answer, and
// whenever the numbers changed, on a card that repeats the answers with the new numbers.
#include "input/late_drive.h"

#include <atomic>
#include <variant>

#include "input/deck.h"
#include "input/deck_card.h"
#include "model/drives/template_drives.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

/// The answers of a card in the order in which a reader asked for them.
struct Tape {
  struct Sampled {
    int index;  ///< of the numbers that are sampled
  };
  using Answer =
      std::variant<bool, int, std::string, DrivePtr, ScalarFunctionPtr, NodeDof, Sampled>;
  std::vector<Answer> answers;
  std::vector<HintSample> samples;
  std::string what;  ///< begins the messages of a repeated reading
};

/// What both cards cannot answer.
class DriveCard : public Card {
 public:
  DrivePtr drive(std::string_view what) override;
  Vec3DrivePtr vec3_drive(std::string_view what, const VectorAxes& axes) override;

  std::string file_contents(std::string_view, std::string*) override { refuse("a file"); }
  std::string quoted(std::string_view) override { refuse("a string"); }
  Vec3 vec3(std::string_view) override { refuse("a vector"); }
  Vec6 vec6(std::string_view) override { refuse("a vector"); }
  Mat3 mat3(std::string_view) override { refuse("a matrix"); }
  Mat6 mat6(std::string_view) override { refuse("a matrix"); }
  MatX mat6xn(std::string_view, int) override { refuse("a matrix"); }
  MatX numbers(std::string_view, int, int) override { refuse("a matrix"); }
  Mat3 orientation(std::string_view) override { refuse("an orientation"); }
  OrientationDescription orientation_description() override { refuse("an orientation"); }
  Vec3 absolute_position(std::string_view, int, const OtherNode*) override { refuse("a frame"); }
  Mat3 absolute_orientation(std::string_view, int, const OtherNode*) override { refuse("a frame"); }
  Vec3 absolute_velocity(std::string_view, const Vec3&) override { refuse("a frame"); }
  Vec3 absolute_angular_velocity(std::string_view) override { refuse("a frame"); }
  Vec3 absolute_vector(std::string_view) override { refuse("a frame"); }
  Vec3 relative_position(std::string_view, int, const OtherNode*) override { refuse("a frame"); }
  Mat3 relative_orientation(std::string_view, int, const OtherNode*) override { refuse("a frame"); }
  Vec3 relative_vector(std::string_view, int) override { refuse("a frame"); }
  Vec3 relative_unit_vector(std::string_view, int) override { refuse("a frame"); }
  Vec3 absolute_unit_vector(std::string_view, int) override { refuse("a frame"); }
  Mat3 relative_tensor(std::string_view, int) override { refuse("a frame"); }
  DrivePtr scalar_template_drive(std::string_view) override { refuse("a template drive"); }
  TplDrivePtr<6> vec6_drive(std::string_view) override { refuse("a vector of six drives"); }
  TplDrivePtr<3, 3> mat3_drive(std::string_view) override { refuse("a matrix of drives"); }
  LawPtr<1> law1() override { refuse("a constitutive law"); }
  LawPtr<3> law3() override { refuse("a constitutive law"); }
  LawPtr<6> law6() override { refuse("a constitutive law"); }
  FluidPtr fluid() override { refuse("a fluid"); }
  FileDriverPtr file_driver() override { refuse("a file driver"); }
  DrivePtr string_expression(const std::string&) override { refuse("a string"); }
  ExpressionPtr expression_of(const std::string&, const std::vector<std::string>&) override {
    refuse("a string");
  }
  void set_current(const std::string&, double) override {}
  DrivePtr hinted(std::string_view, DrivePtr given) override { return given; }
  Vec3DrivePtr hinted(std::string_view, Vec3DrivePtr given) override { return given; }
  int structural_node(NodeNeed) override { refuse("a node"); }
  int scalar_node(ScalarKind) override { refuse("a node"); }
  ElementRef element(Family) override { refuse("an element"); }
  Family element_family(std::string_view) override { refuse("an element"); }
  ModelBuilder& builder() override { refuse("a drive that remembers its past"); }

 protected:
  [[noreturn]] void refuse(const char* what) {
    fail(std::string("a hint cannot have ") + what + " inside its drive",
         "the hint's numbers are expressions, evaluated when the element becomes active");
  }
  virtual DrivePtr drive_reference() = 0;
  virtual bool take_empty() = 0;  ///< consumes an empty argument

 private:
  DrivePtr nested_drive(std::string_view what);
  int depth_ = 0;
};

DrivePtr DriveCard::drive(std::string_view what) {
  constexpr int kDeepest = 50;
  if (depth_ == kDeepest)
    fail("drives inside a hint are nested deeper than " + std::to_string(kDeepest) + " levels");
  ++depth_;
  DrivePtr made = nested_drive(what);
  --depth_;
  return made;
}

DrivePtr DriveCard::nested_drive(std::string_view what) {
  if (take_empty()) return make_constant_drive(0);
  if (keyword("reference")) return drive_reference();
  const std::string name = peek_word();
  const auto* const found = registry().drives.find(name);
  if (!found) return make_constant_drive(real(what));
  word(what);
  return found->value(*this);
}

Vec3DrivePtr DriveCard::vec3_drive(std::string_view what, const VectorAxes&) {
  std::vector<SumTplDrive<3>::Term> terms;
  const auto term = [&] {
    Vec3 entity;
    for (int k = 0; k < 3; ++k) entity(k) = real(what);
    terms.push_back({entity, more() ? drive(what) : make_constant_drive(1)});
  };
  switch (one_of({"null", "zero", "component", "array", "single"})) {
    case 0:
    case 1:
      break;
    case 2: {
      std::vector<DrivePtr> drives(3);
      for (DrivePtr& d : drives)
        if (!keyword("inactive")) d = drive(what);
      return std::make_shared<ComponentTplDrive<3>>(std::move(drives));
    }
    case 3: {
      const int count = integer("number of drives in the array");
      if (count < 1) fail("number of drives in the array must be at least 1");
      for (int k = 0; k < count; ++k) term();
      break;
    }
    default:
      term();
  }
  return std::make_shared<SumTplDrive<3>>(std::move(terms));
}

/// Notes the answers of the deck's card.
class NotingCard final : public DriveCard {
 public:
  NotingCard(DeckCard& card, Tape& tape) : card_(card), tape_(tape) {}

  bool keyword(std::string_view w) override { return note(card_.keyword(w)); }
  int one_of(std::initializer_list<std::string_view> w) override { return note(card_.one_of(w)); }
  int required(std::string_view what, std::initializer_list<std::string_view> w) override {
    return note(card_.required(what, w));
  }
  std::string peek_word() override { return note(card_.peek_word()); }
  std::string word(std::string_view what) override { return note(card_.word(what)); }
  bool more() override { return note(card_.more()); }
  bool at_string() override { return note(card_.at_string()); }
  double real(std::string_view what, double fallback) override {
    if (take_empty()) return fallback;
    if (!card_.more()) card_.fail(std::string(what) + ": number expected in the hint");
    const std::string text(card_.next_text());
    card_.skip();
    HintSample sample;
    sample.source = card_.string_expression(text);
    sample.memory = card_.builder().allocate_memory(1, 0);
    tape_.answers.emplace_back(Tape::Sampled{static_cast<int>(tape_.samples.size())});
    tape_.samples.push_back(sample);
    return provisional();
  }
  /// Counts and labels shape the drive: they are those of the deck.
  int integer(std::string_view what, int fallback) override {
    return note(card_.integer(what, fallback));
  }
  int label(std::string_view what) override { return note(card_.label(what)); }
  bool yes_no(std::string_view what) override { return note(card_.yes_no(what)); }
  ScalarFunctionPtr scalar_function(std::string_view what) override {
    return note(card_.scalar_function(what));
  }
  NodeDof node_dof(bool with_order) override { return note(card_.node_dof(with_order)); }

  const Registry& registry() const override { return card_.registry(); }
  SourceSpan last() const override { return card_.last(); }
  SourceSpan next() override { return card_.next(); }
  [[noreturn]] void fail_at(SourceSpan where, const std::string& message, const std::string& hint,
                            const char* code) override {
    card_.fail_at(where, message, hint, code);
  }
  [[noreturn]] void fail_undefined(SourceSpan where, const std::string& kind, int label,
                                   const std::string& hint) override {
    card_.fail_undefined(where, kind, label, hint);
  }
  void warn(const std::string& message, const std::string& hint) override {
    card_.warn(message, hint);
  }
  void warn_at(SourceSpan where, const std::string& message, const std::string& hint) override {
    card_.warn_at(where, message, hint);
  }

 private:
  template <class A>
  A note(A answer) {
    tape_.answers.emplace_back(answer);
    return answer;
  }
  /// Readers compare instants; these increase.
  double provisional() const { return static_cast<double>(tape_.samples.size()); }
  DrivePtr drive_reference() override {
    // The label's drive, read as such by the deck's card.
    const int label = card_.label("drive caller label");
    const auto found = card_.deck().drives.find(label);
    if (found == card_.deck().drives.end())
      card_.fail_undefined(card_.last(), "drive caller", label);
    card_.refer("drive caller " + std::to_string(label), found->second.weight);
    return note(found->second.object);
  }
  bool take_empty() override {
    if (card_.at_empty()) card_.fail_at(card_.next(), "empty expression in the hint");
    return note(false);
  }

  DeckCard& card_;
  Tape& tape_;
};

/// Repeats them with new numbers.
class RepeatingCard final : public DriveCard {
 public:
  RepeatingCard(const Tape& tape, const double* numbers, const Registry& registry)
      : tape_(tape), numbers_(numbers), registry_(registry) {}

  bool keyword(std::string_view) override { return answer<bool>(); }
  int one_of(std::initializer_list<std::string_view>) override { return answer<int>(); }
  int required(std::string_view, std::initializer_list<std::string_view>) override {
    return answer<int>();
  }
  std::string peek_word() override { return answer<std::string>(); }
  std::string word(std::string_view) override { return answer<std::string>(); }
  bool more() override { return answer<bool>(); }
  bool at_string() override { return answer<bool>(); }
  double real(std::string_view, double fallback) override {
    return take_empty() ? fallback : numbers_[answer<Tape::Sampled>().index];
  }
  int integer(std::string_view, int) override { return answer<int>(); }
  int label(std::string_view) override { return answer<int>(); }
  bool yes_no(std::string_view) override { return answer<bool>(); }
  ScalarFunctionPtr scalar_function(std::string_view) override {
    return answer<ScalarFunctionPtr>();
  }
  NodeDof node_dof(bool) override { return answer<NodeDof>(); }

  const Registry& registry() const override { return registry_; }
  SourceSpan last() const override { return {}; }
  SourceSpan next() override { return {}; }
  [[noreturn]] void fail_at(SourceSpan, const std::string& message, const std::string&,
                            const char*) override {
    throw EvaluationError(tape_.what + ": " + message);
  }
  [[noreturn]] void fail_undefined(SourceSpan, const std::string& kind, int label,
                                   const std::string&) override {
    throw EvaluationError(tape_.what + ": " + kind + " " + std::to_string(label));
  }
  void warn(const std::string&, const std::string&) override {}
  void warn_at(SourceSpan, const std::string&, const std::string&) override {}

 private:
  template <class A>
  A answer() {
    if (position_ < tape_.answers.size())
      if (const A* found = std::get_if<A>(&tape_.answers[position_++])) return *found;
    // A reader that asks otherwise than before: its drive depends on the numbers in kind.
    throw EvaluationError(tape_.what + ": the numbers of the hint change the kind of its drive");
  }
  DrivePtr drive_reference() override { return answer<DrivePtr>(); }
  bool take_empty() override { return answer<bool>(); }

  const Tape& tape_;
  const double* numbers_;
  const Registry& registry_;
  std::size_t position_ = 0;
};

/// What is made from the sampled numbers, kept until they change: the exception to the rule that
/// nothing in a model changes. Safe, because the value depends on the numbers alone, so that what
/// is kept only saves time, and because threads replace an immutable entry by one atomic pointer.
template <class Ptr>
class Made {
 public:
  using Make = Ptr (*)(DriveCard&);
  Made(Tape tape, Make make, const Registry& registry)
      : tape_(std::move(tape)), make_(make), registry_(registry) {}

  Ptr at(const EvalContext& context) const {
    std::vector<double> numbers(tape_.samples.size());
    for (std::size_t k = 0; k < numbers.size(); ++k)
      numbers[k] = context.state->memory[tape_.samples[k].memory];
    if (const auto last = last_.load(); last && last->numbers == numbers) return last->object;
    RepeatingCard card(tape_, numbers.data(), registry_);
    auto made = std::make_shared<const Entry>(Entry{numbers, make_(card)});
    last_.store(made);
    return made->object;
  }

 private:
  struct Entry {
    std::vector<double> numbers;
    Ptr object;
  };
  Tape tape_;
  Make make_;
  const Registry& registry_;
  mutable std::atomic<std::shared_ptr<const Entry>> last_;
};

class LateDrive final : public Drive {
 public:
  LateDrive(Tape tape, bool has_derivative, const Registry& registry)
      : made_(std::move(tape), &make, registry), has_derivative_(has_derivative) {}
  double value(const EvalContext& context, double t) const override {
    return made_.at(context)->value(context, t);
  }
  double value(const EvalContext& context) const override {
    return made_.at(context)->value(context);
  }
  bool has_derivative() const override { return has_derivative_; }
  double derivative(const EvalContext& context, double t) const override {
    return made_.at(context)->derivative(context, t);
  }
  static DrivePtr make(DriveCard& card) { return card.drive("drive"); }

 private:
  Made<DrivePtr> made_;
  bool has_derivative_;
};

class LateVec3Drive final : public TplDrive<3, 1> {
 public:
  LateVec3Drive(Tape tape, bool has_derivative, const Registry& registry)
      : made_(std::move(tape), &make, registry), has_derivative_(has_derivative) {}
  Vec3 value(const EvalContext& context) const override {
    return made_.at(context)->value(context);
  }
  bool has_derivative() const override { return has_derivative_; }
  Vec3 derivative(const EvalContext& context) const override {
    return made_.at(context)->derivative(context);
  }
  static Vec3DrivePtr make(DriveCard& card) { return card.vec3_drive("vector drive", {}); }

 private:
  Made<Vec3DrivePtr> made_;
  bool has_derivative_;
};

template <class Late>
auto read_late(DeckCard& card, std::string_view what, std::vector<HintSample>& samples) {
  Tape tape;
  tape.what = card.subject() + ": hint \"" + std::string(what) + "\"";
  NotingCard noting(card, tape);
  const bool has_derivative = Late::make(noting)->has_derivative();
  samples.insert(samples.end(), tape.samples.begin(), tape.samples.end());
  return std::make_shared<Late>(std::move(tape), has_derivative, card.registry());
}

}  // namespace

DrivePtr read_late_drive(DeckCard& card, std::string_view what, std::vector<HintSample>& samples) {
  return read_late<LateDrive>(card, what, samples);
}

Vec3DrivePtr read_late_vec3_drive(DeckCard& card, std::string_view what,
                                  std::vector<HintSample>& samples) {
  return read_late<LateVec3Drive>(card, what, samples);
}

}  // namespace mbcosim
