/// Readers of the kinds of control data of `discrete control`.
#pragma once

#include "elements/control/adaptive_control.h"
#include "model/card.h"

namespace mbcosim {

/// Counts of signals and orders of the card.
struct ControlSizes {
  int outputs = 1, inputs = 1, order_a = 1, order_b = 1;
};

/// An integer from `least` to `most`; `what`: "number of outputs".
int read_control_number(Card& card, const char* what, int least, int most);

/// What follows `identification` or `adaptive control`, as far as `outputs`.
AdaptiveControl::Settings read_identification(Card& card, const ControlSizes& sizes);
AdaptiveControl::Settings read_adaptive_control(Card& card, const ControlSizes& sizes);

}  // namespace mbcosim
