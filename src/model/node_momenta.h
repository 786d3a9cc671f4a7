/// The private data of `automatic structural` elements: momenta of nodes.
#pragma once

#include "model/model.h"
#include "model/plain_element_set.h"

namespace mbcosim {

/// One for each node with momentum, by the label of the node (MBDyn input manual, "Automatic
/// structural"). They are found by label but are no elements of the model: the equations are the
/// node's.
class NodeMomenta final : public PlainElementSet {
 public:
  void add(const StructuralNode& node, int index);

  int size() const override { return static_cast<int>(nodes_.size()); }
  const ElementInfo& info(int i) const override { return info_[i]; }
  ElementInfo& info(int i) override { return info_[i]; }
  std::vector<int> nodes(int i) const override { return {nodes_[i]}; }
  int private_datum(int i, std::string_view name) const override;
  std::vector<Datum> private_data(int i) const override;
  double private_value(const EvalContext& context, int i, int datum) const override;

 private:
  std::vector<int> nodes_;  ///< index of the node
  std::vector<ElementInfo> info_;
};

}  // namespace mbcosim
