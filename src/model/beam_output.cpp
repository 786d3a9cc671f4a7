#include "model/beam_output.h"

#include <string>

#include "model/card.h"

namespace mbcosim {

namespace {

struct OutputFlag {
  std::string_view word;
  unsigned fields;
};
using Field = BeamOutput::Field;
constexpr OutputFlag kOutputFlags[] = {{"position", Field::position},
                                       {"orientation", Field::orientation},
                                       {"configuration", Field::position | Field::orientation},
                                       {"force", Field::force},
                                       {"moment", Field::moment},
                                       {"forces", Field::force | Field::moment},
                                       {"linear strain", Field::strain},
                                       {"angular strain", Field::curvature},
                                       {"strains", Field::strain | Field::curvature},
                                       {"linear strain rate", Field::strain_rate},
                                       {"angular strain rate", Field::curvature_rate},
                                       {"strain rates", Field::rates},
                                       {"all", Field::every},
                                       {"none", 0}};

/// The flag that comes next, null when there is none.
const OutputFlag* next_output_flag(Card& card) {
  for (const OutputFlag& flag : kOutputFlags)
    if (card.keyword(flag.word)) return &flag;
  return nullptr;
}

}  // namespace

BeamOutput read_beam_output(Card& card, std::string_view what, bool viscoelastic) {
  BeamOutput output;
  const std::string head = std::string(what) + ": ";
  const auto name = [](const OutputFlag& flag) { return "`" + std::string(flag.word) + "`"; };
  const OutputFlag* flag = next_output_flag(card);
  if (!flag) {
    std::string words;
    for (const OutputFlag& known : kOutputFlags)
      words += (words.empty() ? "" : ", ") + std::string(known.word);
    card.fail_expected(head + "a flag is expected", "accepted: " + words);
  }
  output.chosen = 0;
  unsigned seen = 0;
  for (; flag; flag = next_output_flag(card)) {
    const unsigned bit = 1u << (flag - kOutputFlags);
    if (seen & bit) card.fail(head + name(*flag) + " is given twice");
    seen |= bit;
    output.chosen |= flag->fields;
    const bool is_all = flag->fields == Field::every;
    if ((flag->fields & Field::orientation) && card.keyword("orientation description"))
      output.description = card.orientation_description();
    if (!viscoelastic && !is_all && (flag->fields & Field::rates))
      card.warn(head + name(*flag) + " is ignored, the beam is elastic");
  }
  return output;
}

}  // namespace mbcosim
