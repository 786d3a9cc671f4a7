#include "simulation/state_bytes.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>

#include "math/hash.h"

namespace mbcosim {

namespace {

constexpr char kMagic[8] = {'m', 'b', 'c', 's', 't', 'a', 't', 'e'};
constexpr std::uint32_t kVersion = 2;

/// Writes or measures plain values one after another, little-endian as on every machine this runs
/// on.
class Out {
 public:
  template <class T>
  void value(const T& v) {
    bytes.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  void value(bool flag) { value(static_cast<std::uint8_t>(flag)); }
  void array(const std::vector<double>& v) {
    value(static_cast<std::uint64_t>(v.size()));
    bytes.append(reinterpret_cast<const char*>(v.data()), v.size() * sizeof(double));
  }
  std::string bytes;
};

class In {
 public:
  explicit In(std::string_view b) : bytes_(b) {}
  template <class T>
  bool value(T& v) {
    if (bytes_.size() < sizeof v) return false;
    std::memcpy(&v, bytes_.data(), sizeof v);
    bytes_.remove_prefix(sizeof v);
    return true;
  }
  bool value(bool& flag) {
    std::uint8_t byte = 0;
    if (!value(byte) || byte > 1) return false;
    flag = byte == 1;
    return true;
  }
  bool array(std::vector<double>& v) {
    std::uint64_t n = 0;
    if (!value(n) || n > bytes_.size() / sizeof(double)) return false;
    v.resize(n);
    if (n > 0) std::memcpy(v.data(), bytes_.data(), n * sizeof(double));
    bytes_.remove_prefix(n * sizeof(double));
    return true;
  }
  bool empty() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
};

constexpr std::size_t kRotationDoubles = 4 * 9 + 4 * 3;

template <class Rotation, class History, class Action>
void each_part(Rotation& q, History& past, Action action) {
  for (auto* m : {&q.R, &past.R_ref, &past.R1, &past.R2}) action(m->data(), 9);
  for (auto* v : {&q.w, &past.w_ref, &past.w1, &past.w2}) action(v->data(), 3);
}

std::vector<double> flat_rotations(const State& state) {
  std::vector<double> r;
  r.reserve(state.rotation.size() * kRotationDoubles);
  for (std::size_t k = 0; k < state.rotation.size(); ++k)
    each_part(state.rotation[k], state.rotation_history[k],
              [&](const double* d, int n) { r.insert(r.end(), d, d + n); });
  return r;
}

void unflatten_rotations(const std::vector<double>& r, State& state) {
  state.rotation.resize(r.size() / kRotationDoubles);
  state.rotation_history.resize(state.rotation.size());
  const double* p = r.data();
  for (std::size_t k = 0; k < state.rotation.size(); ++k)
    each_part(state.rotation[k], state.rotation_history[k], [&](double* d, int n) {
      std::memcpy(d, p, n * sizeof(double));
      p += n;
    });
}

template <class Control, class Visit>
void each_member(Control& c, Visit visit) {
  for (auto* flag :
       {&c.started, &c.strategy.last_chance, &c.chosen_step, &c.hope_odd, &c.exact_time})
    visit(*flag);
  for (auto* count : {&c.regular_steps, &c.strategy.since_reduction, &c.strategy.since_raise,
                      &c.last_iterations, &c.kept_iterations, &c.grid_count})
    visit(*count);
  for (auto* number : {&c.strategy_step, &c.kept_coefficient, &c.kept_algebraic_coefficient,
                       &c.grid_start, &c.grid_step})
    visit(*number);
}

/// Counts go on from here, and times are added to.
bool can_go_on(const State& state) {
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  const auto counts = [](std::int64_t count) { return count >= 0 && count <= kMost; };
  bool fine = counts(state.step) && std::isfinite(state.time) && std::isfinite(state.h) &&
              std::isfinite(state.h_previous);
  each_member(state.control, [&](const auto& member) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, std::int64_t>)
      fine = fine && counts(member);
  });
  return fine;
}

}  // namespace

std::string state_to_bytes(const State& state, std::uint64_t model_digest) {
  Out out;
  out.bytes.append(kMagic, sizeof kMagic);
  out.value(kVersion);
  out.value(model_digest);
  out.value(state.time);
  out.value(state.h);
  out.value(state.h_previous);
  out.value(state.step);
  each_member(state.control, [&](const auto& v) { out.value(v); });
  for (const auto array : kStateArrays) out.array(state.*array);
  out.array(flat_rotations(state));
  out.value(fnv1a(out.bytes));
  return std::move(out.bytes);
}

Result<State> state_from_bytes(std::string_view bytes, std::uint64_t model_digest) {
  const Error damaged = make_error(ErrorKind::data_loss, "STATE_DAMAGED",
                                   "the state's bytes are damaged or cut short");
  std::uint64_t checksum = 0, digest = 0;
  if (bytes.size() < sizeof kMagic + sizeof kVersion + sizeof checksum ||
      std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    return damaged;
  std::memcpy(&checksum, bytes.data() + bytes.size() - sizeof checksum, sizeof checksum);
  bytes.remove_suffix(sizeof checksum);
  if (fnv1a(bytes) != checksum) return damaged;
  In in(bytes.substr(sizeof kMagic));
  std::uint32_t version = 0;
  if (!in.value(version) || !in.value(digest)) return damaged;
  if (version != kVersion)
    return make_error(ErrorKind::precondition, "STATE_VERSION",
                      "the state has format version " + std::to_string(version) +
                          "; this program reads " + std::to_string(kVersion) +
                          ": it was saved by another version of mbcosim, start the run anew");
  if (digest != model_digest) {
    return make_error(ErrorKind::precondition, "STATE_OF_ANOTHER_MODEL",
                      "the state belongs to the model with digest " + digest_text(digest) +
                          ", this model has " + digest_text(model_digest));
  }
  State state;
  bool fine = in.value(state.time) && in.value(state.h) && in.value(state.h_previous) &&
              in.value(state.step);
  each_member(state.control, [&](auto& v) { fine = fine && in.value(v); });
  for (const auto array : kStateArrays) fine = fine && in.array(state.*array);
  std::vector<double> rotations;
  fine = fine && in.array(rotations) && rotations.size() % kRotationDoubles == 0 && in.empty();
  if (!fine || !can_go_on(state)) return damaged;
  unflatten_rotations(rotations, state);
  return state;
}

}  // namespace mbcosim
