#include "fmi/manifest.h"

#include <nlohmann/json.hpp>

/// A number with a point is a real one.
template <>
struct nlohmann::adl_serializer<mbcosim::Value> {
  static void to_json(json& j, const mbcosim::Value& value) {
    std::visit([&](const auto& held) { j = held; }, value);
  }
  static void from_json(const json& j, mbcosim::Value& value) {
    if (j.is_boolean())
      value = j.get<bool>();
    else if (j.is_number_integer())
      value = j.get<std::int32_t>();
    else if (j.is_number())
      value = j.get<double>();
    else
      value = j.get<std::string>();
  }
};

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
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FmuSymbol, reference, name, start, given)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Manifest, token, deck, digest, files, variables, symbols, remote,
                                   remote_timeout)

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
