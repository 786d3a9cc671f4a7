#include "coupling/unit_conversion.h"

#include <algorithm>

#include "coupling/port_numbers.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr Dimension kLength{0, 1}, kTime{0, 0, 1}, kForce{1, 1, -2}, kMoment{1, 2, -2};

void scale(Numbers* numbers, double factor) {
  for (double& number : *numbers) number *= factor;
}

/// The units of a signal's numbers, which take turns: "N, N m".
std::vector<Unit> units_of(const SignalUnit& signal) {
  constexpr std::string_view kSeparator = ", ";
  std::vector<Unit> units;
  for (std::size_t at = 0; at != std::string::npos && !signal.text.empty();) {
    const std::size_t comma = signal.text.find(kSeparator, at);
    const std::string part = signal.text.substr(at, comma - at);
    const auto unit = read_unit(part);
    if (!unit)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "the unit \"" + part.substr(0, 100) +
                                                 "\" of a signal is unknown: it cannot be "
                                                 "converted");
    units.push_back(*unit);
    at = comma == std::string::npos ? comma : comma + kSeparator.size();
  }
  return units;
}

}  // namespace

UnitConversion::UnitConversion(const UnitSystem& deck, const UnitSystem& peer, int nodes,
                               const std::vector<SignalUnit>& outputs,
                               const std::vector<SignalUnit>& inputs)
    : deck_(deck),
      peer_(peer),
      nodes_(nodes),
      length_(factor(kLength)),
      time_(factor(kTime)),
      force_(factor(kForce)),
      moment_(factor(kMoment)),
      outputs_(factors(outputs)),
      inputs_(factors(inputs)) {}

double UnitConversion::factor(const Dimension& dimension) const {
  return deck_.si(dimension) / peer_.si(dimension);
}

std::vector<double> UnitConversion::factors(const std::vector<SignalUnit>& signals) const {
  constexpr std::size_t kTurn = 3;  // numbers of one kind, where there are several kinds
  std::vector<double> all;
  for (const SignalUnit& signal : signals) {
    const std::vector<Unit> units = units_of(signal);
    for (std::size_t k = 0; k < static_cast<std::size_t>(signal.size); ++k) {
      if (units.empty()) {
        all.push_back(1);
        continue;
      }
      const Unit& unit = units[k / kTurn % units.size()];
      const double given = signal.is_si ? deck_.si(unit.dimension) : unit.si;
      all.push_back(given / peer_.si(unit.dimension));
    }
  }
  return all;
}

void UnitConversion::to_peer(v1::ServerExchange* out) const {
  const double acceleration = length_ / (time_ * time_), angular = 1 / (time_ * time_);
  out->set_time(out->time() * time_);
  out->set_target_time(out->target_time() * time_);
  scale(out->mutable_positions(), length_);
  scale(out->mutable_velocities(), length_ / time_);
  scale(out->mutable_angular_velocities(), 1 / time_);
  scale(out->mutable_accelerations(), acceleration);
  scale(out->mutable_angular_accelerations(), angular);
  scale(out->mutable_reference_position(), length_);
  scale(out->mutable_reference_velocity(), length_ / time_);
  scale(out->mutable_reference_angular_velocity(), 1 / time_);
  scale(out->mutable_reference_acceleration(), acceleration);
  scale(out->mutable_reference_angular_acceleration(), angular);
  scale(out->mutable_forces(), force_);
  scale(out->mutable_moments(), moment_);
  const int signals = std::min(out->signals_size(), static_cast<int>(outputs_.size()));
  for (int k = 0; k < signals; ++k) out->set_signals(k, out->signals(k) * outputs_[k]);
}

void UnitConversion::to_deck(v1::PeerAnswer* in) const {
  scale(in->mutable_forces(), 1 / force_);
  scale(in->mutable_moments(), 1 / moment_);
  scale(in->mutable_reference_force(), 1 / force_);
  scale(in->mutable_reference_moment(), 1 / moment_);
  scale(in->mutable_positions(), 1 / length_);
  const int signals = std::min(in->signals_size(), static_cast<int>(inputs_.size()));
  for (int k = 0; k < signals; ++k) in->set_signals(k, in->signals(k) / inputs_[k]);
  if (in->has_tangent()) to_deck(in->mutable_tangent());
}

// Rows are force and moment, columns position and rotation, of each node in turn; of modes they are
// moments and numbers.
void UnitConversion::to_deck(v1::Tangent* tangent) const {
  const auto convert = [&](Numbers* numbers, double time) {
    const int columns = tangent->block_diagonal() ? 6 : 6 * nodes_;
    for (int k = 0; k < numbers->size(); ++k) {
      const bool of_force = nodes_ > 0 && k / columns % 6 < 3, by_length = nodes_ > 0 && k % 6 < 3;
      const double peers = (of_force ? force_ : moment_) * time / (by_length ? length_ : 1);
      (*numbers)[k] /= peers;
    }
  };
  convert(tangent->mutable_stiffness(), 1);
  convert(tangent->mutable_damping(), time_);
}

void UnitConversion::to_deck(v1::Rejection* rejection) const {
  if (rejection->has_preferred_step_size())
    rejection->set_preferred_step_size(rejection->preferred_step_size() / time_);
}

}  // namespace mbcosim::server
