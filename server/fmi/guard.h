/// What every function of the C interfaces does around its own work.
#pragma once

#include <exception>
#include <span>

#include "fmi/instance.h"
#include "fmi/location.h"

namespace mbcosim::fmi {

inline constexpr int kError = static_cast<int>(Status::error);

/// One call's hold on an instance; false: another call has it, which is logged. An instance that
/// was freed meanwhile ends with the hold.
class Hold {
 public:
  Hold(Instance& instance, const char* function) : instance_(instance) {
    auto use = Instance::Use::idle;
    held_ = instance.use.compare_exchange_strong(use, Instance::Use::busy);
    if (held_) return;
    instance.log().write(Status::error,
                         std::string(function) + ": another call runs on this instance");
  }
  ~Hold() {
    auto use = Instance::Use::busy;
    if (held_ && !instance_.use.compare_exchange_strong(use, Instance::Use::idle))
      delete &instance_;
  }
  Hold(const Hold&) = delete;
  Hold& operator=(const Hold&) = delete;

  explicit operator bool() const { return held_; }

 private:
  Instance& instance_;
  bool held_ = false;
};

/// Runs work(instance) when the call is allowed. Nothing is thrown through the C interface, and a
/// call while another one runs on the instance is refused without touching it.
template <class Work>
int guarded(void* handle, Call call, const char* function, Work&& work) {
  if (!handle) return kError;
  Instance& instance = *static_cast<Instance*>(handle);
  const Hold hold(instance, function);
  if (!hold) return kError;
  try {
    return instance.admit(call, function) ? static_cast<int>(work(instance)) : kError;
  } catch (const std::exception& e) {
    return static_cast<int>(instance.fail(std::string(function) + ": " + e.what()));
  }
}

/// Allowed in all states. While another call runs on the instance, that call frees it at its end.
inline void free_instance(void* handle, const char* function) {
  if (!handle) return;
  auto* instance = static_cast<Instance*>(handle);
  auto use = Instance::Use::idle;
  if (!instance->use.compare_exchange_strong(use, Instance::Use::freed)) {
    instance->log().write(
        Status::error,
        std::string(function) + ": another call runs on this instance, which is freed at its end");
    if (instance->use.exchange(Instance::Use::freed) != Instance::Use::idle) return;
  }
  delete instance;
}

/// An instance with the resources at a location, FMI 2's URI or FMI 3's path; null: the log says
/// why.
inline void* instantiate(Standard standard, const char* name, const char* token,
                         const char* location, const Log& log) try {
  const auto folder = folder_of(location ? location : "");
  if (!folder) {
    log.write(Status::error,
              "the location of the resources is no URI: \"" + std::string(location) + "\"");
    return nullptr;
  }
  return Instance::create(standard, name ? name : "", token ? token : "", *folder, log).release();
} catch (const std::exception& e) {
  log.write(Status::error, e.what());
  return nullptr;
}

/// Arrays of the C interface; a null pointer counts as empty.
template <class T>
std::span<T> array(T* first, std::size_t size) {
  return first ? std::span<T>(first, size) : std::span<T>();
}

/// A function of FMI that the capabilities in modelDescription.xml rule out.
inline int unsupported(void* handle, const char* function) {
  if (!handle) return kError;
  Instance& instance = *static_cast<Instance*>(handle);
  const Hold hold(instance, function);
  if (!hold) return kError;
  return static_cast<int>(
      instance.fail(std::string(function) + " is not supported, as modelDescription.xml says"));
}

/// Values of a type that none of our variables has.
inline int no_such_type(void* handle, Call call, const char* function, const char* type,
                        std::size_t references) {
  return guarded(handle, call, function, [&](Instance& instance) {
    if (references == 0) return Status::ok;
    return instance.fail(std::string(function) + ": no variable is of type " + type);
  });
}

/// Hands symbols of the deck to the C interface; `text` of strings lives until the next such call.
template <class Out>
int get_symbols(void* handle, const char* function, ValueType type,
                std::span<const std::uint32_t> references, std::span<Out> out) {
  return guarded(handle, Call::get, function, [&](Instance& instance) {
    const std::vector<Value>* values = nullptr;
    const Status status = instance.get_symbols(references, type, values);
    if (status != Status::ok) return status;
    if (values->size() != out.size())
      return instance.fail("the variables have " + std::to_string(values->size()) +
                           " values, not " + std::to_string(out.size()));
    for (std::size_t k = 0; k < out.size(); ++k) {
      const Value& value = (*values)[k];
      if constexpr (std::is_pointer_v<Out>)
        out[k] = std::get<std::string>(value).c_str();
      else if (type == ValueType::boolean)
        out[k] = static_cast<Out>(std::get<bool>(value));
      else
        out[k] = static_cast<Out>(std::get<std::int32_t>(value));
    }
    return Status::ok;
  });
}

template <class In>
int set_symbols(void* handle, const char* function, ValueType type,
                std::span<const std::uint32_t> references, std::span<const In> in) {
  return guarded(handle, Call::set, function, [&](Instance& instance) {
    std::vector<Value> values;
    for (const In given : in) {
      if constexpr (std::is_pointer_v<In>)
        values.emplace_back(std::string(given ? given : ""));
      else if (type == ValueType::boolean)
        values.emplace_back(given != 0);
      else
        values.emplace_back(static_cast<std::int32_t>(given));
    }
    return instance.set_symbols(references, type, values);
  });
}

/// Saves into *state; what *state held before is replaced.
inline Status save_state(Instance& instance, void** state) {
  if (!state) return instance.fail("no place for the state was given");
  auto saved = instance.save();
  if (!saved) return Status::error;
  if (*state)
    *static_cast<SavedState*>(*state) = std::move(*saved);
  else
    *state = saved.release();
  return Status::ok;
}

inline Status restore_state(Instance& instance, void* state) {
  if (!state) return instance.fail("no state was given");
  return instance.restore(*static_cast<SavedState*>(state));
}

inline Status free_state(void** state) {
  if (!state) return Status::ok;
  delete static_cast<SavedState*>(*state);
  *state = nullptr;
  return Status::ok;
}

inline Status state_size(Instance& instance, void* state, std::size_t* size) {
  if (!state || !size) return instance.fail("no state was given");
  *size = instance.serialize(*static_cast<SavedState*>(state)).size();
  return Status::ok;
}

template <class Byte>
Status serialize_state(Instance& instance, void* state, Byte* out, std::size_t size) {
  if (!state || !out) return instance.fail("no state was given");
  const std::string bytes = instance.serialize(*static_cast<SavedState*>(state));
  if (bytes.size() > size)
    return instance.fail("the state has " + std::to_string(bytes.size()) + " bytes, room is for " +
                         std::to_string(size));
  std::copy(bytes.begin(), bytes.end(), out);
  return Status::ok;
}

template <class Byte>
Status deserialize_state(Instance& instance, const Byte* bytes, std::size_t size, void** state) {
  if (!bytes || !state) return instance.fail("no bytes were given");
  auto saved = instance.deserialize({reinterpret_cast<const char*>(bytes), size});
  if (!saved) return Status::error;
  *state = saved.release();
  return Status::ok;
}

/// Log categories of `Set…DebugLogging`; none means all.
inline Status switch_logging(Instance& instance, bool on, std::size_t count,
                             const char* const categories[]) {
  if (count == 0) instance.log().switch_all(on);
  for (std::size_t k = 0; k < count; ++k)
    if (!categories || !categories[k] || !instance.log().switch_one(categories[k], on))
      return instance.fail(
          "there is no such log category; they are listed in "
          "modelDescription.xml");
  return Status::ok;
}

}  // namespace mbcosim::fmi
