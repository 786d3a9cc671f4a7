/// Two-node beams in inverse dynamics.
#pragma once

#include "elements/beams/beam.h"

namespace mbcosim {

/// Starts a record: the section's reference orientation and curvature from the rotation parameters
/// of the nodes as the last record left them.
///
/// N.B. these are the increment of the last record, whose rotation and curvature the section has
/// already: they are counted twice, as in the reference solver. Rotations and forces of beams drift
/// from the second record that moves on.
void predict_inverse(const ElementSetOf<Beam2>& beams, int i, const EvalContext& context,
                     State& state);
/// Ends a record of a beam that only loads the nodes: its section is the reference one.
void accept_reference(const ElementSetOf<Beam2>& beams, int i, State& state);

/// Takes the internal forces of a beam that has no part in the problem out of the results.
void unload(const ElementSetOf<Beam2>& beams, int i, State& state);

}  // namespace mbcosim
