/// The arguments of one statement as the readers of cards see them: `Card` over a cursor and the
/// deck read so far.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "input/cursor.h"
#include "input/deck.h"
#include "model/card.h"
#include "model/element_set.h"

namespace mbcosim {

/// `"<name>{<arguments>}"` of a `driven` card.
struct Hint {
  std::string name;
  Statement arguments;
  SourceSpan where;
  bool used = false;
};

class DeckCard final : public Card, public BeamOutputDefault {
 public:
  DeckCard(Deck& deck, const Statement& statement);

  bool keyword(std::string_view word) override;
  int one_of(std::initializer_list<std::string_view> words) override;
  int required(std::string_view what, std::initializer_list<std::string_view> words) override;
  std::string peek_word() override;
  std::string word(std::string_view what) override;
  bool more() override;
  bool at_string() override;

  double real(std::string_view what, double fallback = 0) override;
  int integer(std::string_view what, int fallback = 0) override;
  int label(std::string_view what) override;
  bool yes_no(std::string_view what) override;
  std::string quoted(std::string_view what) override;
  std::string file_contents(std::string_view what, std::string* name) override;

  Vec3 vec3(std::string_view what) override;
  Vec6 vec6(std::string_view what) override;
  Mat3 mat3(std::string_view what) override;
  Mat6 mat6(std::string_view what) override;
  MatX mat6xn(std::string_view what, int columns) override;
  MatX numbers(std::string_view what, int rows, int columns) override;
  Mat3 orientation(std::string_view what) override;
  OrientationDescription orientation_description() override;

  Vec3 absolute_position(std::string_view what, int context = -1,
                         const OtherNode* other = nullptr) override;
  Mat3 absolute_orientation(std::string_view what, int context = -1,
                            const OtherNode* other = nullptr) override;
  Vec3 absolute_velocity(std::string_view what, const Vec3& at) override;
  Vec3 absolute_angular_velocity(std::string_view what) override;
  Vec3 absolute_vector(std::string_view what) override;
  Vec3 relative_position(std::string_view what, int node,
                         const OtherNode* other = nullptr) override;
  Mat3 relative_orientation(std::string_view what, int node,
                            const OtherNode* other = nullptr) override;
  Vec3 relative_vector(std::string_view what, int node) override;
  Vec3 relative_unit_vector(std::string_view what, int node) override;
  Vec3 absolute_unit_vector(std::string_view what, int context = -1) override;
  Mat3 relative_tensor(std::string_view what, int node) override;

  BeamOutput default_beam_output() const override;

  DrivePtr drive(std::string_view what = "drive") override;
  DrivePtr scalar_template_drive(std::string_view what) override;
  Vec3DrivePtr vec3_drive(std::string_view what = "vector drive",
                          const VectorAxes& axes = {}) override;
  TplDrivePtr<6> vec6_drive(std::string_view what = "vector drive") override;
  TplDrivePtr<3, 3> mat3_drive(std::string_view what = "matrix drive") override;
  LawPtr<1> law1() override;
  LawPtr<3> law3() override;
  LawPtr<6> law6() override;
  ScalarFunctionPtr scalar_function(std::string_view what = "scalar function") override;
  FluidPtr fluid() override;
  FileDriverPtr file_driver() override;
  DrivePtr string_expression(const std::string& text) override;
  ExpressionPtr expression_of(const std::string& text,
                              const std::vector<std::string>& names) override;
  void set_current(const std::string& name, double value) override;
  DrivePtr hinted(std::string_view name, DrivePtr given) override;
  Vec3DrivePtr hinted(std::string_view name, Vec3DrivePtr given) override;

  int structural_node(NodeNeed need = NodeNeed::six_dof) override;
  int scalar_node(ScalarKind kind) override;
  NodeDof node_dof(bool with_order) override;
  ElementRef element(Family family) override;
  Family element_family(std::string_view what) override;

  const Registry& registry() const override;
  ModelBuilder& builder() override;
  SourceSpan last() const override { return cursor_.last(); }
  SourceSpan next() override { return cursor_.next(); }
  [[noreturn]] void fail_at(SourceSpan where, const std::string& message,
                            const std::string& hint = "", const char* code = "card") override;
  [[noreturn]] void fail_undefined(SourceSpan where, const std::string& kind, int label,
                                   const std::string& hint = "") override;
  void warn_at(SourceSpan where, const std::string& message, const std::string& hint = "") override;
  void warn(const std::string& message, const std::string& hint = "") override;

  // ---- for the readers of blocks
  void note(const std::string& message);  ///< of the whole card, not of an argument
  std::string card_name() const;          ///< as it is written: "max iterations"
  Deck& deck() { return deck_; }
  const Statement& statement() const { return statement_; }
  /// The whole card word, for messages about the statement.
  SourceSpan head() const;
  /// What messages begin with: "joint 3 (revolute hinge)".
  void set_subject(std::string subject, std::string type = "");
  const std::string& subject() const { return subject_; }
  bool at_empty() { return more() && cursor_.at_empty(); }
  /// The entity that this statement defines; when it is refused, errors that follow from that are
  /// not reported.
  void set_defining(std::string kind, int label = -1);
  const std::string& defined_kind() const { return defined_kind_; }
  int defined_label() const { return defined_label_; }
  /// The word of the grammar that the card reads now: errors without a remedy tell its form.
  void set_form(std::string_view group, std::string_view word) { form_ = {group, word, "", ""}; }
  /// The same for a type of it, unless the grammar does not have it.
  void set_type_form(std::string_view group, std::string_view word) {
    form_ = {group, word, form_.group, form_.word};
  }
  /// Adds the form to an error about the card that has no hint.
  void add_remedy(Diagnostic& d) const;
  /// Of what the card has read.
  const Weight& weight() const { return weight_; }
  /// It refers to an object, called `name` in errors.
  void refer(const std::string& name, const Weight& weight);
  std::string_view next_text();                     ///< the next argument as it is written
  void skip();                                      ///< the next argument
  FileDriverPtr file_driver_definition(int label);  ///< `<type>, ...` of a `file` card
  FluidPtr fluid_definition();                      ///< `<type>, ...` of a `hydraulic fluid` card
  void read_function_definition();  ///< `"<name>", <definition>` of a `scalar function` card
  /// Refuses arguments that nobody read.
  void expect_end();
  /// Refuses a word of the language that this program does not serve: "`rotor` (induced velocity
  /// element) is not supported yet".
  [[noreturn]] void fail_unsupported(SourceSpan where, const std::string& word,
                                     const std::string& what);
  /// The same, when `word` is registered as such in `context` ("elements", "joint", "drive", ...).
  void refuse_unsupported(SourceSpan where, const std::string& context, const std::string& word);
  /// The same for words that will not be served, with the reason and what to write instead.
  void refuse_for_good(SourceSpan where, const std::string& context, const std::string& word);
  /// For `driven`: what follows, as a statement of its own.
  Statement rest_as_statement() { return cursor_.rest_as_statement(); }
  Hint hint();  ///< reads a quoted hint
  /// For the card inside a `driven` card; the hints outlive it. What they sample is appended to
  /// `samples`.
  void set_hints(std::vector<Hint>* hints, std::vector<HintSample>* samples);
  /// A count: an integer >= 0, 0 when empty.
  int count(std::string_view what);
  /// An integer or real > 0 (or >= `least`).
  double real_above(std::string_view what, double bound, bool inclusive);
  int integer_at_least(std::string_view what, int least);
  /// By what residuals of equations are multiplied in the residual test, > 0; 1 when empty.
  double equation_scale();
  /// `name, "<text>"` when it is there.
  std::string optional_name();
  TplDrivePtr<6, 6> mat6_drive(std::string_view what);
  Value value(std::string_view what);

 private:
  /// A frame in which an entity is given: axes, origin and motion, all global.
  struct Frame {
    Vec3 x = Vec3::Zero();
    Mat3 R = Mat3::Identity();
    Vec3 v = Vec3::Zero(), w = Vec3::Zero();
  };
  struct Form {
    std::string_view group, word;              ///< of the grammar; texts of tables that stay
    std::string_view wider_group, wider_word;  ///< where the grammar does not have the word
  };
  enum class Entity { position, orientation, other };
  enum class Prefix {
    none,
    node,
    global,
    local,
    frame,
    other_node,
    other_position,
    other_orientation
  };
  /// `reference, ...` before an entity, with its frame.
  struct Reference {
    Prefix prefix = Prefix::none;
    Frame frame;  ///< of `<label>`
    Mat3 local = Mat3::Identity();
  };

  /// Counts nested drives, laws and functions; hostile nesting is refused before the stack is used
  /// up.
  class Nesting {
   public:
    explicit Nesting(DeckCard& card);
    ~Nesting() { --card_.nesting_; }
    Nesting(const Nesting&) = delete;
    Nesting& operator=(const Nesting&) = delete;

   private:
    DeckCard& card_;
  };

  void need_argument(std::string_view what);
  /// What `read` makes of the arguments of a drive, law, function or fluid. An error leaves its
  /// form.
  template <class Read>
  auto read_as(std::string_view group, std::string_view word, const Read& read) {
    const Form outer = std::exchange(form_, {group, word, "", ""});
    auto made = read(*this);
    form_ = outer;
    return made;
  }
  /// Consumes a keyword; a variable of the deck with the same name is hidden by it, with a warning.
  void accept_word();
  /// Refuses a matrix with more entries than the card can hold.
  void need_numbers(std::string_view what, std::int64_t count);
  void consumed();
  /// The next argument is a word of the language but no variable: refused where a number is
  /// expected.
  void refuse_word(std::string_view what);
  double component(std::string_view what, int index);
  template <class V>
  V vector(std::string_view what);
  template <class M>
  void matrix_body(std::string_view what, bool allow_skew, M& m);
  void scale(std::string_view what, double& factor);
  Mat3 two_vectors(std::string_view what);
  Mat3 matrix_orientation(std::string_view what);
  Vec3 angles(std::string_view what);

  Frame node_frame(int node) const;
  Frame frame_of_label();
  Reference reference_prefix(Entity entity, const OtherNode* other);
  Vec3 free_vector(std::string_view what, const VectorAxes& axes);
  Vec3 unit(std::string_view what, const Vec3& v);

  DrivePtr constant_drive(std::string_view what);
  template <int N>
  LawPtr<N> law_of();
  template <int N>
  void refuse_other_dimension();
  void refuse_order(const std::string& reason);
  /// The next argument is an expression: no string, no word of the language, not empty.
  bool at_expression();
  ScalarFunctionPtr function_definition(const std::string& name, SourceSpan where);
  template <int R, int C, class ReadEntity>
  TplDrivePtr<R, C> template_drive(std::string_view what, ReadEntity read);
  template <int R, int C>
  TplDrivePtr<R, C> component_drive(std::string_view what);
  template <class Table>
  [[noreturn]] void fail_word(std::string_view what, const std::string& word, const Table& table,
                              const std::string& context);

  NodeDof structural_dof(int label, SourceSpan where);
  void read_order(NodeDof& dof, bool dynamic);

  Hint* use_hint(std::string_view name);
  /// What `read` makes of the hint `name`; without one, `given`.
  template <class Given, class Read>
  Given from_hint(std::string_view name, Given given, Read read);

  Deck& deck_;
  std::vector<Hint>* hints_ = nullptr;
  std::vector<HintSample>* samples_ = nullptr;
  Statement statement_;
  Cursor cursor_;
  std::string subject_, type_, defined_kind_;
  int defined_label_ = -1;
  int nesting_ = 0;
  Weight weight_;
  Form form_;
  std::string peeked_;
  bool has_peeked_ = false;
};

}  // namespace mbcosim
