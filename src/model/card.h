/// The arguments of one statement, read in order: what the readers of elements, drives and laws see
/// of the deck.
///
/// Every method reads the next argument(s) and throws DeckError, with the place and the remedy,
/// when they do not fit. Readers check values with `fail`, which points at the argument read last
/// (or at a span taken before).
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "math/rotation.h"
#include "math/types.h"
#include "model/diagnostic.h"
#include "model/element_set.h"
#include "model/fwd.h"
#include "model/node.h"

namespace mbcosim {

/// First node of a two-node element, for `reference, other node | other position | other
/// orientation` (MBDyn input manual, "use of reference frames").
struct OtherNode {
  int node = -1;                        ///< index among the structural nodes
  Vec3 offset = Vec3::Zero();           ///< f_a, in the frame of `node`
  Mat3 orientation = Mat3::Identity();  ///< R_ha, relative to `node`
};

/// How the vectors of a template drive are read and given.
struct VectorAxes {
  Mat3 R = Mat3::Identity();  ///< what `reference, node` and `reference, local` mean -> global
  bool global = true;         ///< components: global (also without `reference`), or along `R`
};

class Card {
 public:
  virtual ~Card() = default;

  // ------------------------------------------------------------------ words
  /// Consumes the optional keyword `word` when it is the whole next argument (blanks and case do
  /// not matter).
  virtual bool keyword(std::string_view word) = 0;
  /// Index of the keyword among `words` that is the next argument, consumed; -1 (nothing consumed)
  /// when it is none of them.
  virtual int one_of(std::initializer_list<std::string_view> words) = 0;
  /// The same, but refused with the list of what is accepted. `what`: "integration method".
  virtual int required(std::string_view what, std::initializer_list<std::string_view> words) = 0;
  /// The next argument as a normalized word if it looks like one (letters, digits, blanks, ended by
  /// `,` or `;`), not consumed; empty otherwise.
  virtual std::string peek_word() = 0;
  /// Consumes the next argument as a word and returns it normalized; refused when it is not one.
  virtual std::string word(std::string_view what) = 0;
  /// Are there more arguments in this statement?
  virtual bool more() = 0;
  /// Is the next argument a quoted string?
  virtual bool at_string() = 0;

  // ------------------------------------------------------------------ scalars (an empty argument
  // takes `fallback`)
  virtual double real(std::string_view what, double fallback = 0) = 0;
  virtual int integer(std::string_view what, int fallback = 0) = 0;
  virtual int label(std::string_view what) = 0;    ///< 0..2147483647
  virtual bool yes_no(std::string_view what) = 0;  ///< `yes`, `no` or an expression
  virtual std::string quoted(std::string_view what) = 0;
  /// A file name: quoted, found relative to the file being read; returns the text of the file.
  /// `name` gets the name as written.
  virtual std::string file_contents(std::string_view what, std::string* name) = 0;

  // ------------------------------------------------------------------
  // structured values without frames
  virtual Vec3 vec3(std::string_view what) = 0;
  virtual Vec6 vec6(std::string_view what) = 0;
  virtual Mat3 mat3(std::string_view what) = 0;
  virtual Mat6 mat6(std::string_view what) = 0;
  virtual MatX mat6xn(std::string_view what, int columns) = 0;
  /// `rows`×`columns` numbers by rows, no keyword forms.
  virtual MatX numbers(std::string_view what, int rows, int columns) = 0;
  virtual Mat3 orientation(std::string_view what) = 0;
  virtual OrientationDescription orientation_description() = 0;

  // ------------------------------------------------------------------
  // in frames; `node`: structural node index
  /// `context`: structural node that `reference, node` and `reference, local` mean; -1: the global
  /// frame, as in MBDyn for the ground point of pins.
  virtual Vec3 absolute_position(std::string_view what, int context = -1,
                                 const OtherNode* other = nullptr) = 0;
  virtual Mat3 absolute_orientation(std::string_view what, int context = -1,
                                    const OtherNode* other = nullptr) = 0;
  virtual Vec3 absolute_velocity(std::string_view what, const Vec3& at) = 0;
  virtual Vec3 absolute_angular_velocity(std::string_view what) = 0;
  virtual Vec3 absolute_vector(std::string_view what) = 0;
  virtual Vec3 relative_position(std::string_view what, int node,
                                 const OtherNode* other = nullptr) = 0;
  virtual Mat3 relative_orientation(std::string_view what, int node,
                                    const OtherNode* other = nullptr) = 0;
  virtual Vec3 relative_vector(std::string_view what, int node) = 0;
  /// Free vector, normalised; refused when null, warning when its norm was not 1.
  virtual Vec3 relative_unit_vector(std::string_view what, int node) = 0;
  /// `context`: structural node that `reference, node` and `reference, local` mean; -1: the global
  /// frame.
  virtual Vec3 absolute_unit_vector(std::string_view what, int context = -1) = 0;
  virtual Mat3 relative_tensor(std::string_view what, int node) = 0;

  // ------------------------------------------------------------------ shared objects
  virtual DrivePtr drive(std::string_view what = "drive") = 0;
  /// One-dimensional template drive: a drive, after `component` or `single` or alone; `reference`
  /// means the label of a template drive caller.
  virtual DrivePtr scalar_template_drive(std::string_view what) = 0;
  /// Vector template drive.
  virtual Vec3DrivePtr vec3_drive(std::string_view what = "vector drive",
                                  const VectorAxes& axes = {}) = 0;
  virtual TplDrivePtr<6> vec6_drive(std::string_view what = "vector drive") = 0;
  virtual TplDrivePtr<3, 3> mat3_drive(std::string_view what = "matrix drive") = 0;
  virtual LawPtr<1> law1() = 0;
  virtual LawPtr<3> law3() = 0;
  virtual LawPtr<6> law6() = 0;
  template <int N>
  LawPtr<N> law() {
    if constexpr (N == 1)
      return law1();
    else if constexpr (N == 3)
      return law3();
    else
      return law6();
  }
  virtual ScalarFunctionPtr scalar_function(std::string_view what = "scalar function") = 0;
  virtual FluidPtr fluid() = 0;
  /// A file driver of the `drivers` block, by label.
  virtual FileDriverPtr file_driver() = 0;
  /// A quoted expression as a function of time, compiled once. Unknown names are reported at the
  /// end of the deck.
  virtual DrivePtr string_expression(const std::string& text) = 0;
  /// A quoted expression with further variables `names` ("eps" of a symbolic law), whose values are
  /// passed at evaluation.
  virtual ExpressionPtr expression_of(const std::string& text,
                                      const std::vector<std::string>& names) = 0;
  /// Sets a symbol that `model::current("L")` sees until the end of this card.
  virtual void set_current(const std::string& name, double value) = 0;

  /// The drive of a `driven` element's datum: `given` as the card has it or, with the hint
  /// `<name>{<drive>}`, that drive, made anew whenever the element becomes active.
  virtual DrivePtr hinted(std::string_view name, DrivePtr given) = 0;
  /// The same for `<name>{<vector drive>}`.
  virtual Vec3DrivePtr hinted(std::string_view name, Vec3DrivePtr given) = 0;

  // ------------------------------------------------------------------ references to nodes and
  // elements
  enum class NodeNeed { any, six_dof, not_dummy };
  /// Index of a structural node read by label. `six_dof`: refuses displacement and dummy nodes.
  virtual int structural_node(NodeNeed need = NodeNeed::six_dof) = 0;
  virtual int scalar_node(ScalarKind kind) = 0;  ///< index among the scalar nodes
  /// `<label>, <type> [, index] [, order]`; order words are read only when `with_order` and the dof
  /// is differential.
  virtual NodeDof node_dof(bool with_order) = 0;
  /// `<label>, <element type>` or the family given: an element declared before.
  virtual ElementRef element(Family family) = 0;
  virtual Family element_family(std::string_view what) = 0;  ///< reads the type word, e.g. `joint`

  // ------------------------------------------------------------------ context
  virtual const Registry& registry() const = 0;
  virtual ModelBuilder& builder() = 0;
  Model& model();
  /// Span of the argument read last.
  virtual SourceSpan last() const = 0;
  /// Span of the next argument.
  virtual SourceSpan next() = 0;
  /// Refuses the card: `message` without position; `hint` says how to mend it; `code` tells
  /// programs what is wrong (Diagnostic::code).
  [[noreturn]] void fail(const std::string& message, const std::string& hint = "",
                         const char* code = "card");
  [[noreturn]] virtual void fail_at(SourceSpan where, const std::string& message,
                                    const std::string& hint = "", const char* code = "card") = 0;
  /// Refuses the next argument: `message` says what is expected in its place.
  [[noreturn]] void fail_expected(const std::string& message, const std::string& hint = "");
  /// Refuses a reference to what the deck does not define: "<kind> <label> is not defined". Not
  /// reported when the definition itself was refused.
  [[noreturn]] virtual void fail_undefined(SourceSpan where, const std::string& kind, int label,
                                           const std::string& hint = "") = 0;
  virtual void warn(const std::string& message, const std::string& hint = "") = 0;
  virtual void warn_at(SourceSpan where, const std::string& message,
                       const std::string& hint = "") = 0;
};

}  // namespace mbcosim
