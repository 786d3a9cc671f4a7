/// One record of results: nodes, then elements in declaration order.
#pragma once

#include "model/model.h"
#include "model/output_row.h"

namespace mbcosim {

/// Writes every line of one record.
void write_record(const EvalContext& context, OutputRow& row);

/// Writes the `.trc` lines (drives with `output trace`), after the initial solution and every step.
void write_traces(const EvalContext& context, OutputRow& row);

/// Writes the `.rfm` lines (reference frames), once at the start of a run.
void write_reference_frames(const Model& model, OutputRow& row);

}  // namespace mbcosim
