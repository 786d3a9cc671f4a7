#include "elements/modal/fem_data.h"

#include <algorithm>
#include <unordered_set>

namespace mbcosim {

int FemData::find_node(std::string_view label) const {
  const auto it = std::find(labels.begin(), labels.end(), label);
  return it == labels.end() ? -1 : static_cast<int>(it - labels.begin());
}

FemData parse_fem_data(const std::string& name, std::string_view bytes) {
  return bytes.substr(0, 4) == "bmod" ? detail::parse_fem_binary(name, bytes)
                                      : detail::parse_fem_text(name, bytes);
}

namespace detail {

namespace {

Diagnostic fem_diagnostic(const std::string& name, int line, const std::string& message,
                          const std::string& hint) {
  Diagnostic d;
  d.code = "fem-data";
  d.file = name;
  d.line = line;
  d.column = line > 0 ? 1 : 0;
  d.message = message;
  d.hint = hint;
  return d;
}

}  // namespace

void refuse_fem_data(const std::string& name, int line, const std::string& message,
                     const std::string& hint) {
  throw DeckError(fem_diagnostic(name, line, message, hint));
}

void refuse_fem_group(const std::string& name, int line, int group) {
  const std::string what =
      "record group " + std::to_string(std::max(group, 0)) + " is not supported";
  if (group == 19)
    refuse_fem_data(name, line, what + " (geometric stiffness matrices)",
                    "groups 1 to 13 are read; without it the body does not stiffen under load");
  if (group >= 14 && group <= 18)
    refuse_fem_data(name, line, what + " (an inertia invariant)",
                    "groups 1 to 13 are read; leave out 14 to 18 and give group 11, the lumped "
                    "inertia, from which they are computed");
  refuse_fem_data(name, line, what, "groups 1 to 13 are read");
}

void note_fem_data(FemData& data, int line, const std::string& message, const std::string& hint) {
  Diagnostic d = fem_diagnostic(data.name, line, message, hint);
  d.severity = Severity::warning;
  data.notes.push_back(std::move(d));
}

void check_fem_data(FemData& data) {
  std::unordered_set<std::string_view> seen;
  for (const std::string& label : data.labels)
    if (!seen.insert(label).second)
      refuse_fem_data(data.name, 0, "record group 2: node label " + label + " appears twice");
  const auto finite = [&](const MatX& m, const char* group) {
    if (!m.allFinite())
      refuse_fem_data(data.name, 0,
                      std::string("record group ") + group + ": a value is not finite");
  };
  finite(data.initial_amplitudes, "3");
  finite(data.initial_velocities, "4");
  finite(data.positions, "5, 6 or 7");
  finite(data.shapes, "8");
  finite(data.mass, "9");
  finite(data.stiffness, "10");
  if (data.lumped) {
    finite(*data.lumped, "11");
    for (int i = 0; i < data.node_count(); ++i)
      if ((data.lumped->col(i).array() < 0).any())
        refuse_fem_data(data.name, 0,
                        "record group 11: negative mass or inertia at node " + data.labels[i]);
    const auto m = data.lumped->topRows<3>();
    if ((m.row(0) - m.row(1)).cwiseAbs().maxCoeff() > 0 ||
        (m.row(0) - m.row(2)).cwiseAbs().maxCoeff() > 0)
      note_fem_data(
          data, 0,
          "record group 11: the masses of a node differ between directions; the first is used");
  }
  if (data.rigid) {
    finite(data.rigid->inertia, "12");
    finite(data.rigid->center, "12");
    if (!(data.rigid->mass >= 0))
      refuse_fem_data(data.name, 0, "record group 12: the mass must not be negative");
  }
  if (data.damping) finite(*data.damping, "13");
}

}  // namespace detail

}  // namespace mbcosim
