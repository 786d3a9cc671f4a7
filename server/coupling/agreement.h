/// What a peer and a port have agreed on in their handshake.
#pragma once

#include <chrono>
#include <memory>

#include "coupling/fixed_point.h"
#include "coupling/unit_conversion.h"
#include "mbcosim/v1/coupling.pb.h"

namespace mbcosim::server {

struct Agreement {
  v1::RotationForm rotation_form = v1::ROTATION_FORM_MATRIX;
  v1::PortFrame frame = v1::PORT_FRAME_GLOBAL;
  bool accelerations = false;
  bool following_loads = false;  ///< answers stay in `frame`; they are turned at each iterate
  bool global_reference_loads = false;  ///< those on the reference node do not come in `frame`
  v1::CouplingMode mode = v1::COUPLING_MODE_LOOSE;
  int every = 1;  ///< steps between exchanges; tight: iterations
  v1::InputHold hold = v1::INPUT_HOLD_ZERO_ORDER;
  std::chrono::milliseconds timeout{10000};  ///< longest wait for an answer
  v1::PeerPolicy policy = v1::PEER_POLICY_FAIL_STEP;
  Acceleration acceleration = Acceleration::none;
  double relaxation = 0.5;
  double tolerance = 1e-6;  ///< of the interface, relative
  int maximum_passes = 50;
  v1::TangentForm tangent = v1::TANGENT_FORM_NONE;
  std::chrono::milliseconds heartbeat_interval{0};  ///< of the server; 0: none
  std::chrono::milliseconds heartbeat_timeout{0};   ///< longest silence of the peer; 0: any
  std::shared_ptr<const UnitConversion> units;      ///< null: the peer counts in the deck's
  int generation = 0;                               ///< number of the handshake on this port

  /// Answers that the held inputs follow.
  std::size_t held_answers() const {
    return hold == v1::INPUT_HOLD_QUADRATIC ? 3 : hold == v1::INPUT_HOLD_LINEAR ? 2 : 1;
  }
  bool is_window() const { return mode == v1::COUPLING_MODE_WINDOW; }
  bool is_tight() const { return mode == v1::COUPLING_MODE_TIGHT; }
  bool is_implicit() const { return is_window() || is_tight(); }
  /// Are answers kept in `frame` until the next one?
  bool follows() const {
    return following_loads && frame > v1::PORT_FRAME_GLOBAL && !is_implicit();
  }
  bool has_tangent() const { return is_tight() && tangent != v1::TANGENT_FORM_NONE; }
};

}  // namespace mbcosim::server
