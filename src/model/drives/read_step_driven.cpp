#include "model/drives/readers.h"
#include "model/drives/step_driven_drives.h"
#include "model/model.h"

namespace mbcosim {

namespace {

/// Makes a drive that advances once a step known to the model.
template <class D, class... Arguments>
DrivePtr add_step_driven(Card& card, Arguments&&... arguments) {
  auto drive = std::make_shared<D>(std::forward<Arguments>(arguments)...);
  card.builder().on_step(drive);
  return drive;
}

/// `t1 | forever` of a drive that works from t0 on.
double read_end_after(Card& card, double t0, const char* drive) {
  const double t1 = read_end(card);
  if (t1 < t0)
    card.fail(std::string(drive) + ": it ends at " + std::to_string(t1) + ", before its start " +
              std::to_string(t0));
  return t1;
}

DrivePtr read_meter(Card& card) {
  const double t0 = card.real("initial time"), t1 = read_end_after(card, t0, "meter");
  const int steps = card.keyword("steps") ? read_count(card, "number of steps") : 1;
  return std::make_shared<MeterDrive>(t0, t1, steps);
}

DrivePtr read_closest_next(Card& card) {
  const double t0 = card.real("initial time"), t1 = read_end_after(card, t0, "closest next");
  DrivePtr increment = card.drive("increment");
  const int memory = card.builder().allocate_memory(ClosestNextDrive::kMemory);
  card.builder().set_memory(memory + 1, t0);
  return add_step_driven<ClosestNextDrive>(card, memory, t1, std::move(increment));
}

DrivePtr read_random(Card& card) {
  RandomDrive::Range range;
  range.amplitude = card.real("amplitude");
  range.mean = card.real("mean value");
  range.t0 = card.real("initial time");
  range.t1 = read_end_after(card, range.t0, "random");
  range.steps = card.keyword("steps") ? read_count(card, "number of steps") : 1;
  const int memory = card.builder().allocate_memory(RandomDrive::kMemory, range.mean);
  auto seed = static_cast<std::uint32_t>(memory) + 1;
  if (card.keyword("seed")) {
    if (card.keyword("time"))
      card.warn("the seed is not taken from the clock: runs are reproducible");
    else
      seed = static_cast<std::uint32_t>(card.integer("seed"));
  }
  card.builder().set_memory(memory + 1, RandomDrive::seeded(seed));
  return add_step_driven<RandomDrive>(card, memory, range);
}

DrivePtr read_sample_and_hold(Card& card) {
  DrivePtr f = card.drive("sampled drive");
  DrivePtr trigger = card.drive("trigger");
  const double initial = card.keyword("initial value") ? card.real("initial value") : 0;
  const int memory = card.builder().allocate_memory(SampleAndHoldDrive::kMemory, initial);
  return add_step_driven<SampleAndHoldDrive>(card, memory, std::move(f), std::move(trigger));
}

std::vector<double> read_coefficients(Card& card, const char* what) {
  const int n = read_count(card, what, 0);
  std::vector<double> c;
  for (int k = 0; k < n; ++k) c.push_back(card.real("coefficient"));
  return c;
}

DrivePtr read_discrete_filter(Card& card) {
  std::vector<double> a = read_coefficients(card, "number of output coefficients");
  const double b0 = card.real("b0");
  std::vector<double> b = read_coefficients(card, "number of input coefficients");
  DrivePtr input = card.drive("input");
  const int memory = card.builder().allocate_memory(1 + static_cast<int>(a.size() + b.size()));
  return add_step_driven<DiscreteFilterDrive>(card, memory, std::move(a), b0, std::move(b),
                                              std::move(input));
}

DrivePtr read_bistop(Card& card) {
  const bool active =
      card.keyword("initial status") && card.required("status", {"inactive", "active"}) == 1;
  DrivePtr on = card.drive("activation");
  DrivePtr off = card.drive("deactivation");
  const int memory = card.builder().allocate_memory(BistopDrive::kMemory, active ? 1 : 0);
  return add_step_driven<BistopDrive>(card, memory, std::move(on), std::move(off));
}

}  // namespace

void register_step_driven_drives(Registry& registry) {
  registry.drive({"meter"}, read_meter);
  registry.drive({"closest next"}, read_closest_next);
  registry.drive({"random"}, read_random);
  registry.drive({"sample and hold"}, read_sample_and_hold);
  registry.drive({"discrete filter"}, read_discrete_filter);
  registry.drive({"bistop"}, read_bistop);
}

}  // namespace mbcosim
