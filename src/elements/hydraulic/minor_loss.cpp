#include "elements/hydraulic/minor_loss.h"

#include "elements/hydraulic/read_values.h"
#include "elements/hydraulic/readers.h"

namespace mbcosim {
namespace {

void print(OutputRow& row, int label, double v, double q) {
  row.begin(OutputFile::hyd, label);
  row.scalar("v", "m/s", v);
  row.scalar("q", "kg/s", q);
  row.end();
}

}  // namespace

void MinorLoss::output(const Local<double>& u, OutputRow& row) const {
  const double q = flow(u);
  print(row, u.label(), q / (fluid->density(0.5 * (u.scalar(0) + u.scalar(1))) * area), q);
}

void ThreeWayMinorLoss::output(const Local<double>& u, OutputRow& row) const {
  const int branch = active_branch(u);
  const double q = flow(u, branch);
  print(row, u.label(), q / (fluid->density(0.5 * (u.scalar(0) + u.scalar(branch))) * area(branch)),
        q);
}

void hydraulic::read_minor_loss(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<2>(card);
  MinorLoss loss;
  loss.node1 = nodes.index[0];
  loss.node2 = nodes.index[1];
  loss.K12 = read_positive(card, "loss coefficient from node 1 to node 2");
  loss.K21 = read_positive(card, "loss coefficient from node 2 to node 1");
  loss.area = read_positive(card, "area");
  loss.fluid = card.fluid();
  add_element(card.builder(), info, std::move(loss));
}

void hydraulic::read_three_way_minor_loss(Card& card, ElementInfo& info) {
  const auto nodes = read_nodes<3>(card);
  ThreeWayMinorLoss loss;
  loss.node0 = nodes.index[0];
  loss.node1 = nodes.index[1];
  loss.node2 = nodes.index[2];
  loss.K_out = read_positive(card, "loss coefficient out of node 0");
  loss.K_in = read_positive(card, "loss coefficient into node 0");
  loss.area1 = read_positive(card, "area of branch 1");
  loss.area2 = read_positive(card, "area of branch 2");
  loss.fluid = card.fluid();
  add_element(card.builder(), info, std::move(loss));
}

}  // namespace mbcosim
