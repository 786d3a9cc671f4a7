#include "fmi/saved_state.h"

#include <cstring>

#include "math/hash.h"
#include "simulation/state_bytes.h"

namespace mbcosim::fmi {
namespace {

constexpr std::string_view kMagic = "mbcosim FMU state 4\n";

void put(std::uint64_t value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put(double value, std::string& out) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}
void put(std::string_view text, std::string& out) {
  put(static_cast<std::uint64_t>(text.size()), out);
  out.append(text);
}

void put(const SymbolValues& symbols, std::string& out) {
  put(static_cast<std::uint64_t>(symbols.size()), out);
  for (const auto& [name, value] : symbols) {
    put(std::string_view(name), out);
    put(static_cast<std::uint64_t>(value.index()), out);
    if (const auto* text = std::get_if<std::string>(&value))
      put(std::string_view(*text), out);
    else if (const double* real = std::get_if<double>(&value))
      put(*real, out);
    else if (const auto* integer = std::get_if<std::int32_t>(&value))
      put(static_cast<std::uint64_t>(static_cast<std::uint32_t>(*integer)), out);
    else
      put(static_cast<std::uint64_t>(std::get<bool>(value)), out);
  }
}

/// Reads what `put` wrote; past the end: zeros, and `good` is false.
struct Reader {
  std::string_view rest;
  bool good = true;

  template <class T>
  T take() {
    T value{};
    good = good && rest.size() >= sizeof value;
    if (!good) return value;
    std::memcpy(&value, rest.data(), sizeof value);
    rest.remove_prefix(sizeof value);
    return value;
  }
  std::string_view text() {
    const auto size = take<std::uint64_t>();
    good = good && size <= rest.size();
    if (!good) return {};
    const std::string_view found = rest.substr(0, size);
    rest.remove_prefix(size);
    return found;
  }
  std::vector<double> numbers() {
    const std::string_view bytes = text();
    std::vector<double> values(bytes.size() / sizeof(double));
    if (!values.empty()) std::memcpy(values.data(), bytes.data(), values.size() * sizeof(double));
    return values;
  }
  Value value() {
    switch (take<std::uint64_t>()) {
      case static_cast<int>(ValueType::boolean):
        return take<std::uint64_t>() != 0;
      case static_cast<int>(ValueType::integer):
        return static_cast<std::int32_t>(take<std::uint64_t>());
      case static_cast<int>(ValueType::real):
        return take<double>();
      case static_cast<int>(ValueType::string):
        return std::string(text());
    }
    good = false;
    return {};
  }
  SymbolValues symbols() {
    SymbolValues found;
    const auto count = take<std::uint64_t>();
    for (std::uint64_t k = 0; k < count && good; ++k) {
      std::string name(text());
      found.insert_or_assign(std::move(name), value());
    }
    return found;
  }
};

Error refused(ErrorKind kind, std::string message) {
  return make_error(kind, "", std::move(message));
}

}  // namespace

std::string to_bytes(const SavedState& saved, std::uint64_t model_digest) {
  std::string out(kMagic);
  put(saved.token, out);
  put(static_cast<std::uint64_t>(saved.mode), out);
  put(saved.communication_time, out);
  put(saved.last_time, out);
  put(static_cast<std::uint64_t>(saved.ended), out);
  put(static_cast<std::uint64_t>(saved.stop_time.has_value()), out);
  put(saved.stop_time.value_or(0.0), out);
  put(saved.symbols, out);
  put(static_cast<std::uint64_t>(saved.given.size()), out);
  for (const std::vector<double>& values : saved.given)
    put(std::string_view(reinterpret_cast<const char*>(values.data()),
                         values.size() * sizeof(double)),
        out);
  put(static_cast<std::uint64_t>(saved.state.has_value()), out);
  if (saved.state) put(state_to_bytes(*saved.state, model_digest), out);
  put(fnv1a(out), out);
  return out;
}

Result<SavedState> saved_state_from_bytes(std::string_view bytes, const std::string& token,
                                          const DigestOf& digest_of) {
  const Error damaged = refused(ErrorKind::data_loss, "the bytes of the state are damaged");
  if (bytes.size() < kMagic.size() + sizeof(std::uint64_t) ||
      bytes.substr(0, kMagic.size()) != kMagic)
    return damaged;
  Reader check{bytes.substr(bytes.size() - sizeof(std::uint64_t))};
  bytes.remove_suffix(sizeof(std::uint64_t));
  if (fnv1a(bytes) != check.take<std::uint64_t>()) return damaged;
  Reader in{bytes.substr(kMagic.size())};
  SavedState saved;
  saved.token = in.text();
  if (saved.token != token)
    return refused(ErrorKind::precondition, "the state belongs to another FMU");
  const auto mode = in.take<std::uint64_t>();
  if (mode > static_cast<std::uint64_t>(Mode::failed)) return damaged;
  saved.mode = static_cast<Mode>(mode);
  saved.communication_time = in.take<double>();
  saved.last_time = in.take<double>();
  saved.ended = in.take<std::uint64_t>() != 0;
  const bool has_stop_time = in.take<std::uint64_t>() != 0;
  const auto stop_time = in.take<double>();
  if (has_stop_time) saved.stop_time = stop_time;
  saved.symbols = in.symbols();
  const auto count = in.take<std::uint64_t>();
  for (std::uint64_t k = 0; k < count && in.good; ++k) saved.given.push_back(in.numbers());
  if (in.take<std::uint64_t>() != 0) {
    const auto digest = digest_of(saved.symbols);
    if (!digest) return digest.error();
    auto state = state_from_bytes(in.text(), *digest);
    if (!state) return state.error();
    saved.state = std::move(*state);
  }
  if (!in.good) return damaged;
  return saved;
}

}  // namespace mbcosim::fmi
