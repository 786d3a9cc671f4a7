#include "fmi/manifest.h"

#include <nlohmann/json.hpp>

namespace mbcosim::fmi {

using nlohmann::json;

NLOHMANN_JSON_SERIALIZE_ENUM(FmuVariable::Role, {{FmuVariable::Role::independent, "independent"},
                                                 {FmuVariable::Role::input, "input"},
                                                 {FmuVariable::Role::output, "output"},
                                                 {FmuVariable::Role::tunable, "tunable"}})
NLOHMANN_JSON_SERIALIZE_ENUM(FmuVariable::Source,
                             {{FmuVariable::Source::variable, "variable"},
                              {FmuVariable::Source::positions, "positions"},
                              {FmuVariable::Source::orientations, "orientations"},
                              {FmuVariable::Source::velocities, "velocities"},
                              {FmuVariable::Source::angular_velocities, "angular velocities"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FmuVariable, reference, role, source, name, elements, start)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Manifest, token, deck, digest, files, variables)

std::string to_json(const Manifest& manifest) { return json(manifest).dump(1); }

Result<Manifest> manifest_from_json(const std::string& text) {
  try {
    return json::parse(text).get<Manifest>();
  } catch (const json::exception& e) {
    return make_error(ErrorKind::data_loss, "",
                      std::string("resources/mbcosim.json is damaged: ") + e.what());
  }
}

}  // namespace mbcosim::fmi
