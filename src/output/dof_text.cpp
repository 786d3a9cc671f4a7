#include "output/dof_text.h"

#include <algorithm>
#include <iterator>
#include <span>

#include "model/model_part.h"
#include "model/printed_dofs.h"

namespace mbcosim {

namespace {

/// The next `count` unknowns, or equations, of their owner.
struct Lines {
  int count;
  const char* text;
};
struct Description {
  std::span<const Lines> dofs, equations;
};

constexpr Lines kPlace[] = {{3, "position [px,py,pz]"}, {3, "orientation parameters [gx,gy,gz]"}};
constexpr Lines kBalance[] = {{3, "force equilibrium [Fx,Fy,Fz]"},
                              {3, "moment equilibrium [Mx,My,Mz]"}};
constexpr Lines kDynamic[] = {{3, "position [px,py,pz]"},
                              {3, "orientation parameters [gx,gy,gz]"},
                              {3, "momentum [Bx,By,Bz]"},
                              {3, "momenta moment [Gx,Gy,Gz]"}};
constexpr Lines kDynamicEquations[] = {{3, "momentum definition [Bx,By,Bz]"},
                                       {3, "momenta moment definition [Gx,Gy,Gz]"},
                                       {3, "force equilibrium [Fx,Fy,Fz]"},
                                       {3, "moment equilibrium [Mx,My,Mz]"}};
constexpr Lines kModal[] = {{3, "position [px,py,pz]"},
                            {3, "orientation parameters [gx,gy,gz]"},
                            {3, "velocity [vx,vy,vz]"},
                            {3, "angular velocity [wx,wy,wz]"}};
constexpr Lines kModalEquations[] = {{3, "linear velocity definition [vx,vy,vz]"},
                                     {3, "angular velocity definition [wx,wy,wz]"},
                                     {3, "force equilibrium [Fx,Fy,Fz]"},
                                     {3, "moment equilibrium [Mx,My,Mz]"}};
constexpr Lines kPoint[] = {{3, "position [px,py,pz]"}, {3, "momentum [Bx,By,Bz]"}};
constexpr Lines kPointEquations[] = {{3, "momentum definition [Bx,By,Bz]"},
                                     {3, "force equilibrium [Fx,Fy,Fz]"}};

Description description_of(const StructuralNode& node) {
  switch (node.kind) {
    case StructuralKind::dynamic:
      return {kDynamic, kDynamicEquations};
    case StructuralKind::modal:
      return {kModal, kModalEquations};
    case StructuralKind::dynamic_displacement:
      return {kPoint, kPointEquations};
    case StructuralKind::static_displacement:
      return {std::span(kPlace).first(1), std::span(kBalance).first(1)};
    default:
      return {kPlace, kBalance};
  }
}

constexpr Lines kReactions[] = {{3, "reaction forces [Fx,Fy,Fz]"},
                                {3, "reaction couples [mx,my,mz]"}};
constexpr Lines kHingeReactions[] = {{3, "reaction forces [Fx,Fy,Fz]"},
                                     {2, "reaction couples [mx,my]"}};
constexpr Lines kClamp[] = {
    {3, "position constraints [Px=Px0,Py=Py0,Pz=Pz0]"},
    {3, "orientation constraints [thetax=thetax0,thetay=thetay0,thetaz=thetaz0]"}};
constexpr Lines kHingeToGround[] = {{3, "position constraints [Px=Px0,Py=Py0,Pz=Pz0]"},
                                    {2, "orientation constraints [gx=gx0,gy=gy0]"}};
/// The last line lacks a bracket in MBDyn, too.
constexpr Lines kHinge[] = {{3, "position constraints [Px1=Px2,Py1=Py2,Pz1=Pz2]"},
                            {2, "orientation constraints [gx1=gx2,gy1=gy2]"},
                            {1, "angular velocity constraint wz2-wz1=Omega]"}};
constexpr Lines kTurn[] = {{3, "orientation constraints [gx1=gx2,gy1=gy2,gz1=gz2]"}};
constexpr Lines kShiftReactions[] = {{3, "reaction forces [fx,fy,fz]"}};
constexpr Lines kShift[] = {{3, "position constraints [px1=px2,py1=py2,pz1=pz2]"}};

struct JointDescription {
  std::string_view type;
  Description lines;
};
constexpr JointDescription kJoints[] = {
    {"clamp", {kReactions, kClamp}},
    {"revolute pin", {kHingeReactions, kHingeToGround}},
    {"plane pin", {kHingeReactions, kHingeToGround}},
    {"revolute hinge", {kHingeReactions, std::span(kHinge).first(2)}},
    {"plane hinge", {kHingeReactions, std::span(kHinge).first(2)}},
    {"revolute rotation", {std::span(kHingeReactions).subspan(1), std::span(kHinge).subspan(1, 1)}},
    {"axial rotation", {kReactions, kHinge}},
    {"drive hinge", {std::span(kReactions).subspan(1), kTurn}},
    {"drive displacement", {kShiftReactions, kShift}},
    {"drive displacement pin", {kShiftReactions, kShift}},
};

/// "7", "7->9": unknowns count from one.
std::string range_text(int first, int count) {
  std::string s = std::to_string(first + 1);
  if (count > 1) s += "->" + std::to_string(first + count);
  return s;
}

/// Node or element with unknowns.
struct Owner {
  std::string title;
  int first, count;
};

void append_statistics(std::string& out, const Owner& owner) {
  out += owner.title + ": " + std::to_string(owner.count) + ' ' +
         range_text(owner.first, owner.count) + '\n';
}

void append_lines(std::string& out, const Owner& owner, std::span<const Lines> lines) {
  int k = 0;
  for (const Lines& l : lines) {
    out += "        " + range_text(owner.first + k, l.count) + ": " + l.text + '\n';
    k += l.count;
  }
}

const char* title(ScalarKind kind) {
  constexpr const char* kTitles[] = {"Abstract", "Electric", "Hydraulic", "Thermal", "Parameter"};
  return kTitles[static_cast<int>(kind)];
}

std::string title(const ElementInfo& info) {
  std::string words;
  switch (info.family) {
    case Family::body:
      words = "Rigid Body";
      break;
    case Family::genel:
      words = "GENEL";
      break;
    case Family::electric:
    case Family::thermal:
    case Family::hydraulic:
    case Family::bulk:
      words = family_name(info.family);
      words.resize(words.find(' '));
      break;
    case Family::loadable:
      words = "Loadable";
      break;
    default:
      words = family_name(info.family);
  }
  for (std::size_t k = 0; k < words.size(); ++k)
    if ((k == 0 || words[k - 1] == ' ') && words[k] >= 'a' && words[k] <= 'z')
      words[k] -= 'a' - 'A';
  return words + '(' + std::to_string(info.label) + ')';
}

std::string title(const StructuralNode& node) {
  return "Structural(" + std::to_string(node.label) + ')';
}
std::string title(const ScalarNode& node) {
  return std::string(title(node.kind)) + '(' + std::to_string(node.label) + ')';
}

class DofText {
 public:
  DofText(const Model& model, const PrintedDofs& items) : model_(model), items_(items) {
    number_nodes();
    connect();
  }

  std::string text() {
    if (items_.statistics || items_.dofs || items_.equations) append_unknowns();
    if (items_.element_connections) append_elements();
    if (items_.node_connections) append_nodes();
    return std::move(out_);
  }

 private:
  /// Structural nodes, then scalar ones.
  struct Node {
    std::string title;
    std::vector<std::string> elements;
  };
  struct Element {
    std::string title;
    std::vector<int> nodes;  ///< indices
  };

  void number_nodes() {
    owner_.assign(model_.unknowns, -1);
    for (const StructuralNode& n : model_.structural) {
      for (int i = 0; i < n.unknowns(); ++i) owner_[n.first + i] = static_cast<int>(nodes_.size());
      nodes_.push_back({title(n), {}});
    }
    for (const ScalarNode& n : model_.scalars) {
      if (n.unknown >= 0) owner_[n.unknown] = static_cast<int>(nodes_.size());
      nodes_.push_back({title(n), {}});
    }
  }

  void add(std::string name, const std::vector<int>& nodes) {
    Element element{std::move(name), {}};
    for (const int node : nodes) {
      if (node < 0 || std::ranges::find(element.nodes, node) != element.nodes.end()) continue;
      element.nodes.push_back(node);
      nodes_[node].elements.push_back(element.title);
    }
    elements_.push_back(std::move(element));
  }
  void connect() {
    for (std::size_t k = 0; k < model_.structural.size(); ++k)
      if (const StructuralNode& n = model_.structural[k]; n.has_momentum())
        add("Automatic Structural(" + std::to_string(n.label) + ')', {static_cast<int>(k)});
    for (const ElementRef& e : model_.elements) {
      const ElementInfo& info = e.set->info(e.index);
      if (info.family == Family::inertia) continue;
      std::vector<int> nodes = e.set->nodes(e.index), rows;
      e.set->append_rows(model_, e.index, rows);
      for (const int row : rows)
        if (row >= 0) nodes.push_back(owner_[row]);
      add(title(info), nodes);
    }
    if (model_.gravity) add("Gravity(1)", {});
  }

  void append_unknowns() {
    out_ += "Regular steps dof stats\n";
    for (const StructuralNode& n : model_.structural)
      if (!n.is_dummy()) append(Owner{title(n), n.first, n.unknowns()}, description_of(n));
    for (const ScalarNode& n : model_.scalars)
      if (n.unknown >= 0) append_statistics(out_, {title(n), n.unknown, 1});
    for (const ElementRef& e : model_.elements) append(e);
  }
  void append(const Owner& owner, const Description& lines) {
    append_statistics(out_, owner);
    if (items_.dofs) append_lines(out_, owner, lines.dofs);
    if (items_.equations) append_lines(out_, owner, lines.equations);
  }
  /// Equations that MBDyn does not describe are called as messages call them.
  void append(const ElementRef& e) {
    const int count = e.set->unknowns(e.index);
    if (count == 0) return;
    const ElementInfo& info = e.set->info(e.index);
    const Owner owner{title(info), e.set->first_own(e.index), count};
    const auto* const known = std::ranges::find(kJoints, info.type, &JointDescription::type);
    const Description lines =
        info.family == Family::joint && known != std::end(kJoints) ? known->lines : Description{};
    append(owner, lines);
    if (!items_.equations) return;
    int described = 0;
    for (const Lines& l : lines.equations) described += l.count;
    for (int k = described; k < count; ++k)
      out_ +=
          "        " + range_text(owner.first + k, 1) + ": " + e.set->row_name(e.index, k) + '\n';
  }

  void append_elements() {
    out_ += "Element connections\n";
    for (const Element& element : elements_) {
      out_ += element.title + (element.nodes.empty() ? " not connected\n" : " connecting\n");
      for (const int node : element.nodes) out_ += "        " + nodes_[node].title + '\n';
    }
  }
  void append_nodes() {
    out_ += "Node connections\n";
    append_scalars(ScalarKind::abstract);
    for (std::size_t k = 0; k < model_.structural.size(); ++k) append_node(nodes_[k]);
    for (const ScalarKind kind :
         {ScalarKind::electric, ScalarKind::thermal, ScalarKind::parameter, ScalarKind::hydraulic})
      append_scalars(kind);
  }
  void append_scalars(ScalarKind kind) {
    for (std::size_t k = 0; k < model_.scalars.size(); ++k)
      if (model_.scalars[k].kind == kind) append_node(nodes_[model_.structural.size() + k]);
  }
  void append_node(const Node& node) {
    if (node.elements.empty()) return;
    out_ += node.title + " connected to\n";
    for (const std::string& element : node.elements) out_ += "        " + element + '\n';
  }

  const Model& model_;
  const PrintedDofs items_;
  std::vector<int> owner_;  ///< (unknowns) index of the node, −1 of elements
  std::vector<Node> nodes_;
  std::vector<Element> elements_;
  std::string out_;
};

}  // namespace

std::string dof_text(const Model& model) {
  const PrintedDofs* items = find_part<PrintedDofs>(model);
  return items ? DofText(model, *items).text() : std::string();
}

bool has_dof_file(const Model& model) {
  const PrintedDofs* items = find_part<PrintedDofs>(model);
  return items && items->to_file;
}

}  // namespace mbcosim
