/// Parts of a model that only their makers and few users know.
#pragma once

#include "model/model.h"
#include "model/plain_element_set.h"

namespace mbcosim {

/// Data kept among the model's sets of elements, as a set without elements: fixed once the deck is
/// read, like all of the model.
template <class Data>
class ModelPart final : public PlainElementSet {
 public:
  Data data;

  int size() const override { return 0; }
  const ElementInfo& info(int) const override { return none_; }
  ElementInfo& info(int) override { return none_; }

 private:
  ElementInfo none_;
};

/// The part of the model being built, made when it is not there yet.
template <class Data>
Data& part(ModelBuilder& builder) {
  return builder.set<ModelPart<Data>>().data;
}

/// Null when the model has no such part.
template <class Data>
const Data* find_part(const Model& model) {
  for (const auto& set : model.sets)
    if (set->size() == 0)  // a cheap look first: this is asked in every step
      if (const auto* found = dynamic_cast<const ModelPart<Data>*>(set.get())) return &found->data;
  return nullptr;
}

}  // namespace mbcosim
