/// In which units a port's values are.
#include "coupling/port_model.h"
#include "wire/convert.h"

namespace mbcosim::server {
namespace {

std::string name_in(const UnitSystem* units, const SignalUnit& signal) {
  if (signal.is_si) return unit_name(units, signal.text);
  const auto unit = read_unit(signal.text);
  return units && unit ? units->name(unit->dimension) : signal.text;
}

}  // namespace

void PortModel::add_output(const std::string& name, SignalUnit unit) {
  layout_.add_output_names(utf8(name));
  layout_.add_output_units(utf8(unit.is_si ? name_in(units_, unit) : unit.text));
  output_units_.push_back(std::move(unit));
}

void PortModel::add_input(const std::string& name, SignalUnit unit) {
  layout_.add_input_names(utf8(name));
  layout_.add_input_units(utf8(name_in(units_, unit)));
  input_units_.push_back(std::move(unit));
}

UnitConversion PortModel::conversion(const UnitSystem& peer) const {
  return {*units_, peer, static_cast<int>(points_.size()), output_units_, input_units_};
}

void PortModel::tell_units(const UnitSystem& units, v1::PortLayout* out) const {
  to_proto(units, out->mutable_units());
  for (int k = 0; k < out->output_units_size(); ++k)
    out->set_output_units(k, name_in(&units, output_units_[k]));
  for (int k = 0; k < out->input_units_size(); ++k)
    out->set_input_units(k, name_in(&units, input_units_[k]));
}

}  // namespace mbcosim::server
