#include "model/drives/composed_drives.h"
#include "model/drives/readers.h"
#include "model/model.h"
#include "model/model_part.h"

namespace mbcosim {

namespace {

DrivePtr read_product(Card& card) {
  DrivePtr f = card.drive("first factor");
  DrivePtr g = card.drive("second factor");
  return std::make_shared<ProductDrive>(std::move(f), std::move(g));
}

std::vector<DrivePtr> read_drives(Card& card) {
  const int n = read_count(card, "number of drives");
  std::vector<DrivePtr> parts;
  for (int k = 0; k < n; ++k) parts.push_back(card.drive());
  return parts;
}

DrivePtr read_array(Card& card) {
  std::vector<DrivePtr> parts = read_drives(card);
  if (parts.size() == 1) return parts[0];
  return std::make_shared<SumDrive>(std::move(parts));
}

DrivePtr read_smallest(Card& card) {
  return std::make_shared<ExtremeDrive>(read_drives(card), false);
}
DrivePtr read_largest(Card& card) {
  return std::make_shared<ExtremeDrive>(read_drives(card), true);
}

DrivePtr read_chain(Card& card) {
  DrivePtr f = card.drive("outer drive");
  DrivePtr g = card.drive("inner drive");
  return std::make_shared<ChainDrive>(std::move(f), std::move(g));
}

DrivePtr read_periodic(Card& card) {
  const double t0 = card.real("initial time"), period = card.real("period");
  if (!(period > 0))
    card.fail("periodic: the period must be positive, got " + std::to_string(period));
  return std::make_shared<PeriodicDrive>(t0, period, card.drive());
}

DrivePtr read_file(Card& card) {
  FileDriverPtr driver = card.file_driver();
  int column = 1;
  const std::string word = card.peek_word();
  const bool is_word =
      word == "amplitude" || word == "output" || card.registry().drives.find(word) != nullptr;
  if (card.more() && !card.at_string() && !is_word) {
    column = card.integer("column", 1);
    if (column < 1 || column > driver->channels())
      card.fail("column " + std::to_string(column) + " does not exist; the file driver has " +
                std::to_string(driver->channels()));
  }
  const double amplitude = card.keyword("amplitude") ? card.real("amplitude") : 1;
  return std::make_shared<FileDrive>(std::move(driver), column - 1, amplitude);
}

DrivePtr read_dof(Card& card) {
  const NodeDof dof = card.node_dof(true);
  return std::make_shared<DofDrive>(dof, card.drive("function of the degree of freedom"));
}

/// Which private datum: `string, "name"`, `name, "name"`, `index, n`, or nothing when there is only
/// one.
std::string read_datum_name(Card& card, const std::string& owner,
                            const std::vector<std::string>& names) {
  if (card.one_of({"string", "name"}) >= 0) return card.quoted("name of the private datum");
  if (card.keyword("index")) {
    const int n = card.integer("index of the private datum");
    if (n < 1 || n > static_cast<int>(names.size()))
      card.fail(owner + " has " + std::to_string(names.size()) + " private data, got index " +
                std::to_string(n));
    return names[n - 1];
  }
  if (names.size() != 1)
    card.fail_at(
        card.next(),
        owner + " has " + std::to_string(names.size()) + " private data; which one is meant?",
        "write `string, \"<name>\"`");
  return names[0];
}

std::string listed(const std::vector<std::string>& names) {
  std::string s = names.empty() ? "it has none" : "it has";
  for (std::size_t k = 0; k < names.size() && k < 40; ++k) s += (k ? ", `" : " `") + names[k] + "`";
  return s;
}

DrivePtr read_scalar_node_drive(Card& card, ScalarKind kind, int label, SourceSpan where) {
  const Model& model = card.model();
  const int node = model.find_scalar(kind, label);
  const std::string type = std::string(kind_name(kind)) + " node";
  if (node < 0) card.fail_undefined(where, type, label);
  const std::string owner = type + " " + std::to_string(label);
  const bool differential = model.scalars[node].differential && kind != ScalarKind::parameter;
  std::vector<std::string> names{"x"};
  if (differential) names.push_back("xP");
  const std::string name = read_datum_name(card, owner, names);
  if (name != "x" && !(differential && name == "xP"))
    card.fail(owner + " has no private datum `" + name + "`", listed(names));
  const NodeDof datum{false, node, 0, name == "xP" ? 1 : 0, differential};
  return std::make_shared<ScalarNodeDrive>(datum, card.drive("function of the private datum"));
}

DrivePtr read_node(Card& card) {
  const int label = card.label("node");
  const SourceSpan where = card.last();
  const int type = card.required("node type", kNodeWords);
  if (type > 0)
    return read_scalar_node_drive(card, static_cast<ScalarKind>(type - 1), label, where);
  const Model& model = card.model();
  const int node = model.find_structural(label);
  if (node < 0) card.fail_undefined(where, "structural node", label);
  const std::string owner = "structural node " + std::to_string(label);
  const std::vector<std::string> names = Model::structural_data_names(model.structural[node]);
  const std::string name = read_datum_name(card, owner, names);
  const int datum = model.structural_datum(node, name);
  if (datum < 0) card.fail(owner + " has no private datum `" + name + "`", listed(names));
  return std::make_shared<NodeDrive>(node, datum, card.drive("function of the private datum"));
}

DrivePtr read_element(Card& card) {
  const int label = card.label("element");
  const SourceSpan where = card.last();
  const Family family = card.element_family("element type");
  const Model& model = card.model();
  const ElementRef element = model.find_element(family, label);
  if (!element.set)
    card.fail_undefined(
        where, family_name(family), label,
        "elements must be defined before they are referred to; `postponed` defers a drive");
  const std::string owner = model.element_text(element);
  const std::vector<std::string> names = element.set->data_names(element.index);
  const std::string name = read_datum_name(card, owner, names);
  const int datum = element.set->private_datum(element.index, name);
  if (datum < 0) card.fail(owner + " has no private datum `" + name + "`", listed(names));
  return std::make_shared<ElementDrive>(element, datum,
                                        card.drive("function of the private datum"));
}

}  // namespace

void register_composed_drives(Registry& registry) {
  registry.drive({"mult"}, read_product);
  registry.drive({"array"}, read_array);
  registry.drive({"min"}, read_smallest);
  registry.drive({"max"}, read_largest);
  registry.drive({"drive"}, read_chain);
  registry.drive({"periodic"}, read_periodic);
  registry.drive({"postponed"}, [](Card& card) {
    const int label = card.label("drive caller");
    part<PostponedLabels>(card.builder()).labels.emplace_back(label, card.last());
    return std::make_shared<PostponedDrive>(label);
  });
  registry.drive({"scalar function"}, [](Card& card) {
    return std::make_shared<ScalarFunctionDrive>(card.scalar_function());
  });
  registry.drive({"string"},
                 [](Card& card) { return card.string_expression(card.quoted("expression")); });
  registry.drive({"file"}, read_file);
  registry.drive({"dof"}, read_dof);
  registry.drive({"node"}, read_node);
  registry.drive({"element"}, read_element);
}

}  // namespace mbcosim
