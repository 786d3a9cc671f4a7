#include "model/card.h"

#include "model/model.h"

namespace mbcosim {

Model& Card::model() { return builder().model(); }

}  // namespace mbcosim
