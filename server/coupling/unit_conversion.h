/// Between the units of a deck and those of a peer.
#pragma once

#include <vector>

#include "mbcosim/v1/coupling.pb.h"
#include "model/unit_system.h"

namespace mbcosim::server {

/// Numbers of a port's signals in SI units: "N, N m" takes turns with each three numbers.
struct SignalUnit {
  std::string text;
  int size = 1;
  bool is_si = true;  ///< else the unit that the number really has
};

/// Factors make the peer's numbers from the deck's.
class UnitConversion {
 public:
  /// `nodes`: of the port. `peer` is a system. Throws BAD_ARGUMENT for a signal with a unit that
  /// nobody knows.
  UnitConversion(const UnitSystem& deck, const UnitSystem& peer, int nodes,
                 const std::vector<SignalUnit>& outputs, const std::vector<SignalUnit>& inputs);

  const UnitSystem& peer() const { return peer_; }
  double time() const { return time_; }
  void to_peer(v1::ServerExchange* exchange) const;
  void to_peer(v1::StepNotice* notice) const { notice->set_time(notice->time() * time_); }
  void to_deck(v1::PeerAnswer* answer) const;
  void to_deck(v1::Rejection* rejection) const;

 private:
  double factor(const Dimension& dimension) const;
  std::vector<double> factors(const std::vector<SignalUnit>& signals) const;
  void to_deck(v1::Tangent* tangent) const;

  UnitSystem deck_, peer_;
  int nodes_;
  double length_, time_, force_, moment_;
  std::vector<double> outputs_, inputs_;
};

}  // namespace mbcosim::server
