/// Reader of `joint: <label>, modal, ...`.

#include <algorithm>
#include <map>
#include <numeric>

#include "elements/modal/modal_joint.h"
#include "elements/modal/readers.h"
#include "model/card.h"

namespace mbcosim {

namespace {

class ModalJointReader {
 public:
  ModalJointReader(Card& card, ElementInfo& info) : card_(card), info_(info) {}

  void read() {
    if (card_.model().frame_motion)
      card_.fail(
          "modal joint: flexible bodies cannot be used in a model with `rigid body kinematics`");
    read_frame();
    mode_count_ = card_.integer("number of modes");
    if (mode_count_ < 1)
      card_.fail("modal joint: the number of modes must be at least 1, got " +
                 std::to_string(mode_count_));
    read_list();
    read_initial_values();
    read_node_count();
    read_damping();
    read_file();
    read_thresholds();
    read_file_options();
    read_origin();
    if (read_invariant9()) selection_.second_order_inertia = true;
    prepare_body();
    read_interfaces();
    read_trailing();
    finish();
  }

 private:
  void read_frame() {
    if (!card_.keyword("clamped")) {
      joint_.node = card_.structural_node();
      const StructuralNode& node = card_.model().structural[joint_.node];
      if (node.kind != StructuralKind::modal)
        card_.fail(
            "modal joint: structural node " + std::to_string(node.label) + " is not a modal node",
            "declare it as `structural: " + std::to_string(node.label) + ", modal, ...`");
      return;
    }
    if (card_.keyword("position"))
      joint_.x0 = card_.absolute_position("position of the floating frame");
    if (card_.keyword("orientation"))
      joint_.R0 = card_.absolute_orientation("orientation of the floating frame");
  }

  /// Counts of the card are checked against the FEM data file, which comes later: nothing is sized
  /// by them before.
  void read_list() {
    if (!card_.keyword("list")) return;
    listed_ = true;
    std::vector<int>& modes = selection_.modes;
    for (int k = 0; k < mode_count_; ++k) {
      const int mode = card_.integer("mode number");
      if (mode < 1) card_.fail("modal joint: mode numbers start at 1, got " + std::to_string(mode));
      if (std::binary_search(modes.begin(), modes.end(), mode))
        card_.fail("modal joint: mode " + std::to_string(mode) + " is listed twice");
      if (k > 0 && mode < modes.back())
        card_.fail("modal joint: the list of modes must be ascending, got " + std::to_string(mode) +
                       " after " + std::to_string(modes.back()),
                   "MBDyn takes the shapes in the order of the file but the labels in the order of "
                   "the list");
      modes.push_back(mode);
    }
  }

  /// Index of a FEM mode number among the active modes.
  int active_mode(int number) {
    const std::vector<int>& modes = selection_.modes;
    const auto it = std::lower_bound(modes.begin(), modes.end(), number);
    const bool found =
        listed_ ? it != modes.end() && *it == number : number >= 1 && number <= mode_count_;
    if (!found)
      card_.fail("modal joint: mode " + std::to_string(number) + " is not one of the active modes");
    return listed_ ? static_cast<int>(it - modes.begin()) : number - 1;
  }

  void read_initial_value(int j) {
    const double q = card_.real("initial amplitude");
    initial_values_.push_back({j, q, card_.real("initial velocity")});
  }
  void read_initial_values() {
    if (!card_.keyword("initial value")) return;
    has_initial_values_ = true;
    if (card_.keyword("mode")) {
      do {
        read_initial_value(active_mode(card_.integer("mode number")));
      } while (card_.keyword("mode"));
      return;
    }
    for (int j = 0; j < mode_count_; ++j) read_initial_value(j);
    if (mode_count_ > 1)
      card_.warn(
          "modal joint: `initial value` gives one pair to each mode in turn; MBDyn keeps only the "
          "last pair, for the first mode",
          "name the modes: `initial value, mode, 1, <q>, <p>, mode, 2, ...`");
  }

  void read_node_count() {
    if (card_.keyword("from file")) return;
    fem_nodes_ = card_.integer("number of FEM nodes");
    if (fem_nodes_ < 1)
      card_.fail("modal joint: the number of FEM nodes must be at least 1, got " +
                     std::to_string(fem_nodes_),
                 "write `from file` to take it from the FEM data file");
  }

  double ratio(const char* what) {
    const double v = card_.real(what);
    if (v < 0) card_.warn(std::string("modal joint: negative ") + what);
    return v;
  }

  void read_damping() {
    ModalDamping& d = selection_.damping;
    d.kind = ModalDamping::Kind::diagonal;
    switch (card_.one_of({"no damping", "rayleigh damping", "single factor damping",
                          "proportional damping", "diag damping", "damping from file"})) {
      case 0:
        d.kind = ModalDamping::Kind::none;
        return;
      case 1:
        d.kind = ModalDamping::Kind::rayleigh;
        d.mass_factor = ratio("damping factor of the mass matrix");
        d.stiffness_factor = ratio("damping factor of the stiffness matrix");
        return;
      case 3:
        card_.warn("modal joint: `proportional damping` is an old name",
                   "write `single factor damping`");
        [[fallthrough]];
      case 2:
        uniform_ratio_ = ratio("damping ratio");
        return;
      case 4:
        return read_diagonal_damping();
      case 5:
        d.kind = ModalDamping::Kind::from_file;
        return;
      default:
        d.kind = ModalDamping::Kind::from_file;
        card_.warn(
            "modal joint: no damping keyword; record group 13 of the FEM data is used when it is "
            "there",
            "write `damping from file` or `no damping`");
    }
  }

  void read_diagonal_damping() {
    if (card_.keyword("all")) {
      for (int j = 0; j < mode_count_; ++j) ratios_[j] = ratio("damping ratio");
      return;
    }
    const int count = card_.integer("number of damped modes");
    if (count < 1 || count > mode_count_)
      card_.fail("modal joint: the number of damped modes must be 1 to " +
                 std::to_string(mode_count_) + ", got " + std::to_string(count));
    for (int k = 0; k < count; ++k) {
      const int index = card_.integer("index of a damped mode");
      if (index < 1 || index > mode_count_)
        card_.fail("modal joint: the index of a damped mode counts the active modes, 1 to " +
                   std::to_string(mode_count_) + "; got " + std::to_string(index));
      if (ratios_.count(index - 1))
        card_.fail("modal joint: the damping of active mode " + std::to_string(index) +
                   " is given twice");
      ratios_[index - 1] = ratio("damping ratio");
    }
  }

  void read_file() {
    std::string name;
    const std::string bytes = card_.file_contents("FEM data file", &name);
    file_span_ = card_.last();
    data_ = parse_fem_data(name, bytes);
    for (const Diagnostic& note : data_.notes)
      card_.warn("FEM data file \"" + name + "\"" +
                     (note.line > 0 ? ", line " + std::to_string(note.line) : "") + ": " +
                     note.message,
                 note.hint);
    if (fem_nodes_ >= 0 && fem_nodes_ != data_.node_count())
      refuse_file("the card announces " + std::to_string(fem_nodes_) + " FEM nodes, but \"" + name +
                      "\" has " + std::to_string(data_.node_count()),
                  "write `from file` for the number of FEM nodes");
    const int last = listed_ ? selection_.modes.back() : mode_count_;
    if (last > data_.mode_count())
      refuse_file("\"" + name + "\" has " + std::to_string(data_.mode_count()) +
                  " modes, but mode " + std::to_string(last) + " is asked for");
    size_modes();
  }

  /// What the card says of its modes, now that their number is known to be right.
  void size_modes() {
    if (!listed_) {
      selection_.modes.resize(mode_count_);
      std::iota(selection_.modes.begin(), selection_.modes.end(), 1);
    }
    selection_.damping.ratios.assign(mode_count_, uniform_ratio_);
    for (const auto& [j, ratio] : ratios_) selection_.damping.ratios[j] = ratio;
    if (!has_initial_values_) return;
    joint_.initial_q.setZero(mode_count_);
    joint_.initial_p.setZero(mode_count_);
    for (const InitialValue& v : initial_values_) {
      joint_.initial_q(v.mode) = v.q;
      joint_.initial_p(v.mode) = v.p;
    }
  }
  [[noreturn]] void refuse_file(const std::string& message, const std::string& hint = "") {
    card_.fail_at(file_span_, "modal joint: " + message, hint);
    throw std::logic_error("fail_at returned");
  }

  void read_thresholds() {
    while (true) {
      const int which =
          card_.one_of({"threshold", "mass threshold", "damping threshold", "stiffness threshold"});
      if (which < 0) return;
      const double v = card_.real("threshold");
      if (v < 0) card_.fail("modal joint: a threshold must not be negative");
      if (which == 0 || which == 1) selection_.mass_threshold = v;
      if (which == 0 || which == 2) selection_.damping_threshold = v;
      if (which == 0 || which == 3) selection_.stiffness_threshold = v;
    }
  }

  /// The binary copy and the echo of the FEM data are files that a deck may not write: the text is
  /// read each time.
  void read_file_options() {
    bool binary = false;
    while (card_.one_of({"create binary", "use binary", "update binary"}) >= 0) binary = true;
    if (binary && !data_.binary)
      card_.warn(
          "modal joint: the named FEM data file is read; no binary copy is written or looked for",
          "a packed copy is written by `mbcosim fem-info FILE --convert FILE.bin`, and read when "
          "it is named");
    if (!card_.keyword("echo")) return;
    card_.quoted("name of the echo file");
    if (card_.keyword("precision")) card_.integer("precision of the echo");
    card_.warn("modal joint: the echo of the FEM data is not written",
               "use `mbcosim fem-info FILE --convert COPY`");
  }

  std::string fem_label() {
    return card_.at_string() ? card_.quoted("FEM node label")
                             : std::to_string(card_.integer("FEM node label"));
  }
  int fem_node() {
    const std::string label = fem_label();
    const int node = data_.find_node(label);
    if (node < 0)
      card_.fail("modal joint: FEM node " + label + " is not in \"" + data_.name + "\"");
    return node;
  }

  void read_origin() {
    if (card_.keyword("origin node"))
      selection_.origin = data_.positions.col(fem_node());
    else if (card_.keyword("origin position"))
      selection_.origin = card_.vec3("origin position");
    else
      return;
    if (data_.lumped && data_.rigid && !selection_.origin.isZero(0))
      card_.warn(
          "modal joint: the centre of mass of record group 12 is shifted to the new origin; MBDyn "
          "does not do so when record group 11 is there too");
  }

  bool read_invariant9() {
    if (!card_.keyword("use invariant 9")) return false;
    if (!data_.lumped)
      card_.fail("modal joint: `use invariant 9` needs record group 11 (lumped masses), which \"" +
                 data_.name + "\" lacks");
    return true;
  }

  void prepare_body() { positions_ = data_.positions.colwise() - selection_.origin; }

  void read_interfaces() {
    const int count = card_.integer("number of interface nodes");
    if (count < 0) card_.fail("modal joint: the number of interface nodes must not be negative");
    if (count > data_.node_count())
      card_.fail("modal joint: " + std::to_string(count) + " interface nodes, but the body has " +
                 std::to_string(data_.node_count()) + " FEM nodes");
    bool all = false;
    if (card_.keyword("output")) all = card_.yes_no("output of interface nodes");
    for (int k = 0; k < count; ++k) {
      ModalInterface interface;
      interface.fem_node = fem_node();
      interface.node = card_.structural_node();
      if (interface.node == joint_.node)
        card_.fail("modal joint: the modal node cannot be an interface node of its own body");
      for (const ModalInterface& other : joint_.interfaces)
        if (other.fem_node == interface.fem_node && other.node == interface.node)
          card_.fail("modal joint: this pair of FEM node and node appears twice");
      interface.o = card_.relative_position("offset of the interface node", interface.node);
      if (card_.one_of({"hinge", "orientation"}) >= 0)
        card_.relative_orientation("orientation of the interface node", interface.node);
      if (card_.keyword("output")) interface.output = card_.yes_no("output of the interface node");
      interface.output = interface.output || all;
      interface.f = positions_.col(interface.fem_node);
      joint_.interfaces.push_back(std::move(interface));
    }
  }

  void read_trailing() {
    if (read_invariant9()) selection_.second_order_inertia = true;
    if (card_.keyword("consistent rotary coupling"))
      joint_.consistent_rotary_coupling = card_.yes_no("consistent rotary coupling");
    if (card_.more() && card_.at_string()) {
      card_.quoted("output file name");
      card_.warn("modal joint: the file name at the end is an old form and has no effect");
    }
  }

  void finish() {
    std::vector<std::string> warnings;
    joint_.body = make_modal_body(data_, selection_, warnings);
    for (const std::string& w : warnings) card_.warn_at(file_span_, "modal joint: " + w);
    const ModalBody& body = *joint_.body;
    if (body.modes < data_.mode_count() && !listed_)
      card_.warn_at(file_span_, "modal joint: the first " + std::to_string(body.modes) + " of " +
                                    std::to_string(data_.mode_count()) + " modes are used");
    if (joint_.initial_q.size() == 0) {
      joint_.initial_q = body.initial_amplitudes;
      joint_.initial_p = body.initial_velocities;
    }
    if (!joint_.initial_q.isZero(0) && !card_.model().control.skip_assembly)
      card_.warn(
          "modal joint: the initial assembly relaxes the initial amplitudes to the static "
          "equilibrium of the modes",
          "write `skip initial joint assembly;` in the control data to keep them");
    for (ModalInterface& interface : joint_.interfaces) {
      interface.U = body.displacement_shapes(interface.fem_node);
      interface.V = body.rotation_shapes(interface.fem_node);
    }
    check_placement();
    auto& set = card_.builder().set<ModalJointSet>();
    set.add(info_, std::move(joint_));
    card_.builder().register_element(set);
  }

  /// Interface nodes should be where the deformed body puts them.
  void check_placement() {
    const auto& nodes = card_.model().structural;
    const Vec3 x = joint_.node >= 0 ? nodes[joint_.node].x : joint_.x0;
    const Mat3 R = joint_.node >= 0 ? nodes[joint_.node].R : joint_.R0;
    double size = 0;
    for (int i = 0; i < positions_.cols(); ++i) size = std::max(size, positions_.col(i).norm());
    for (const ModalInterface& interface : joint_.interfaces) {
      const StructuralNode& node = nodes[interface.node];
      if (node.is_dummy()) continue;
      const Vec3 place = x + R * (interface.f + interface.U * joint_.initial_q),
                 turn = interface.V * joint_.initial_q;
      const double gap = (node.x + node.R * interface.o - place).norm();
      const double angle = vector_of_rotation<double>(node.R.transpose() * R *
                                                      (Mat3::Identity() + cross<double>(turn)))
                               .norm();
      const std::string what =
          "modal joint: structural node " + std::to_string(node.label) + " is ";
      if (gap > 1e-6 * std::max(size, 1e-12))
        card_.warn(what + std::to_string(gap) + " m away from FEM node " +
                   data_.labels[interface.fem_node]);
      if (angle > 1e-6)
        card_.warn(
            what + "turned by " + std::to_string(angle) + " rad against the floating frame",
            "interface nodes must be parallel to the frame of the body; `hinge` has no effect");
    }
  }

  struct InitialValue {
    int mode;  ///< index among the active modes
    double q, p;
  };

  Card& card_;
  ElementInfo& info_;
  ModalJoint joint_;
  ModalSelection selection_;
  FemData data_;
  MatX positions_;
  SourceSpan file_span_;
  int mode_count_ = 0, fem_nodes_ = -1;
  bool listed_ = false, has_initial_values_ = false;
  std::vector<InitialValue> initial_values_;
  double uniform_ratio_ = 0;
  std::map<int, double> ratios_;  ///< `diag damping`, by index among the active modes
};

}  // namespace

void read_modal_joint(Card& card, ElementInfo& info) { ModalJointReader(card, info).read(); }

}  // namespace mbcosim
