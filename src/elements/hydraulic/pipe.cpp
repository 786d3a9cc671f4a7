#include "elements/hydraulic/pipe.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {

void Pipe::output(const Local<double>& u, OutputRow& row) const {
  const double mean = fluid->density(0.5 * (u.scalar(0) + u.scalar(1)));
  row.begin(OutputFile::hyd, u.label());
  row.scalar("v", "m/s", u.own(0) / (mean * pipe.A));
  row.scalar("q", "kg/s", u.own(0));
  row.scalar("Re", "-", reynolds(u));
  row.end();
}

void hydraulic::read_pipe_element(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<2>(card);
  PipeCard pipe = read_pipe(card);
  const double declared =
      0.5 * (declared_pressure(card, nodes.index[0]) + declared_pressure(card, nodes.index[1]));
  const double rho = pipe.fluid->density(declared);
  add_element(card.builder(), info,
              Pipe{nodes.index[0], nodes.index[1], pipe.geometry, pipe.turbulent, pipe.initial_flow,
                   std::move(pipe.fluid), rho});
}

}  // namespace mbcosim
