#include "peer/controller.h"

#include <dlfcn.h>

#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>

#include "fmi/fmi2_types.h"
#include "fmi/fmi3_types.h"
#include "fmi/location.h"

namespace mbcosim::peer {
namespace {

constexpr int kWarning = 1, kDiscard = 2;

/// A shared library, closed at the end.
class Library {
 public:
  explicit Library(const std::string& path)
      : handle_(::dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)) {
    if (!handle_) throw std::runtime_error(std::string("cannot load the FMU: ") + ::dlerror());
  }
  ~Library() { ::dlclose(handle_); }
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  template <class Function>
  Function* find(const char* name) const {
    void* symbol = ::dlsym(handle_, name);
    if (!symbol) throw std::runtime_error(std::string("the FMU lacks ") + name);
    return reinterpret_cast<Function*>(symbol);
  }

 private:
  void* handle_;
};

void require(int status, const char* what) {
  if (status <= kWarning) return;
  throw std::runtime_error(std::string("the FMU ") +
                           (status == kDiscard ? "discards " : "fails at ") + what);
}

void tell(const char* category, const char* message) {
  std::fprintf(stderr, "FMU: %s: %s\n", category ? category : "log", message ? message : "");
}

// ------------------------------------------------------------------ FMI 2

void log_fmi2(fmi2::Environment, fmi2::String, fmi2::Code status, fmi2::String category,
              fmi2::String format, ...) {
  if (status < kWarning) return;
  char text[1000];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  tell(category, text);
}

class Controller2 : public Controller {
 public:
  explicit Controller2(const FmuArchive& archive) : library_(archive.library()) {
    constexpr fmi2::Type kCoSimulation = 1;
    const auto instantiate =
        library_.find<fmi2::Component(fmi2::String, fmi2::Type, fmi2::String, fmi2::String,
                                      const fmi2::Callbacks*, fmi2::Boolean, fmi2::Boolean)>(
            "fmi2Instantiate");
    handle_ = instantiate("controller", kCoSimulation, archive.token().c_str(),
                          fmi::uri_of(archive.resources()).c_str(), &callbacks_, 0, 1);
    if (!handle_) throw std::runtime_error("the FMU cannot be instantiated");
  }
  ~Controller2() override {
    if (state_) library_.find<fmi2::Code(void*, void**)>("fmi2FreeFMUstate")(handle_, &state_);
    library_.find<void(void*)>("fmi2FreeInstance")(handle_);
  }
  void start(double time) override {
    require(library_.find<fmi2::Code(void*, int, double, double, int, double)>(
                "fmi2SetupExperiment")(handle_, 0, 0, time, 0, 0),
            "its setup");
    require(library_.find<fmi2::Code(void*)>("fmi2EnterInitializationMode")(handle_),
            "its initialization");
    require(library_.find<fmi2::Code(void*)>("fmi2ExitInitializationMode")(handle_),
            "its initialization");
  }
  void set(const std::vector<std::uint32_t>& references,
           const std::vector<double>& values) override {
    require(set_(handle_, references.data(), references.size(), values.data()), "its inputs");
  }
  std::vector<double> get(const std::vector<std::uint32_t>& references, std::size_t size) override {
    std::vector<double> values(size);
    require(get_(handle_, references.data(), references.size(), values.data()), "its outputs");
    return values;
  }
  void do_step(double time, double length) override {
    require(do_step_(handle_, time, length, 0), "the step");
  }
  void keep() override {
    require(library_.find<fmi2::Code(void*, void**)>("fmi2GetFMUstate")(handle_, &state_),
            "keeping its state");
  }
  void restore() override {
    require(library_.find<fmi2::Code(void*, void*)>("fmi2SetFMUstate")(handle_, state_),
            "restoring its state");
  }

 private:
  Library library_;
  fmi2::Callbacks callbacks_{log_fmi2, std::calloc, std::free, nullptr, nullptr};
  void* handle_ = nullptr;
  void* state_ = nullptr;
  using Set = fmi2::Code(void*, const fmi2::Reference*, std::size_t, const double*);
  using Get = fmi2::Code(void*, const fmi2::Reference*, std::size_t, double*);
  Set* set_ = library_.find<Set>("fmi2SetReal");
  Get* get_ = library_.find<Get>("fmi2GetReal");
  using DoStep = fmi2::Code(void*, double, double, int);
  DoStep* do_step_ = library_.find<DoStep>("fmi2DoStep");
};

// ------------------------------------------------------------------ FMI 3

void log_fmi3(fmi3::Environment, fmi3::Code status, fmi3::String category, fmi3::String message) {
  if (status >= kWarning) tell(category, message);
}

class Controller3 : public Controller {
 public:
  explicit Controller3(const FmuArchive& archive) : library_(archive.library()) {
    using Instantiate = fmi3::Handle(fmi3::String, fmi3::String, fmi3::String, bool, bool, bool,
                                     bool, const fmi3::Reference*, std::size_t, fmi3::Environment,
                                     fmi3::LogMessage, fmi3::IntermediateUpdate);
    handle_ = library_.find<Instantiate>("fmi3InstantiateCoSimulation")(
        "controller", archive.token().c_str(), (archive.resources() + "/").c_str(), false, true,
        false, false, nullptr, 0, nullptr, log_fmi3, nullptr);
    if (!handle_) throw std::runtime_error("the FMU cannot be instantiated");
  }
  ~Controller3() override {
    if (state_) library_.find<fmi3::Code(void*, void**)>("fmi3FreeFMUState")(handle_, &state_);
    library_.find<void(void*)>("fmi3FreeInstance")(handle_);
  }
  void start(double time) override {
    require(library_.find<fmi3::Code(void*, bool, double, double, bool, double)>(
                "fmi3EnterInitializationMode")(handle_, false, 0, time, false, 0),
            "its initialization");
    require(library_.find<fmi3::Code(void*)>("fmi3ExitInitializationMode")(handle_),
            "its initialization");
  }
  void set(const std::vector<std::uint32_t>& references,
           const std::vector<double>& values) override {
    require(set_(handle_, references.data(), references.size(), values.data(), values.size()),
            "its inputs");
  }
  std::vector<double> get(const std::vector<std::uint32_t>& references, std::size_t size) override {
    std::vector<double> values(size);
    require(get_(handle_, references.data(), references.size(), values.data(), values.size()),
            "its outputs");
    return values;
  }
  void do_step(double time, double length) override {
    bool event = false, terminate = false, early = false;
    double last = time;
    require(do_step_(handle_, time, length, false, &event, &terminate, &early, &last), "the step");
    if (terminate) throw std::runtime_error("the FMU asks for the end of the simulation");
  }
  void keep() override {
    require(library_.find<fmi3::Code(void*, void**)>("fmi3GetFMUState")(handle_, &state_),
            "keeping its state");
  }
  void restore() override {
    require(library_.find<fmi3::Code(void*, void*)>("fmi3SetFMUState")(handle_, state_),
            "restoring its state");
  }

 private:
  Library library_;
  void* handle_ = nullptr;
  void* state_ = nullptr;
  using Set = fmi3::Code(void*, const fmi3::Reference*, std::size_t, const double*, std::size_t);
  using Get = fmi3::Code(void*, const fmi3::Reference*, std::size_t, double*, std::size_t);
  Set* set_ = library_.find<Set>("fmi3SetFloat64");
  Get* get_ = library_.find<Get>("fmi3GetFloat64");
  using DoStep = fmi3::Code(void*, double, double, bool, bool*, bool*, bool*, double*);
  DoStep* do_step_ = library_.find<DoStep>("fmi3DoStep");
};

}  // namespace

std::unique_ptr<Controller> make_controller(const FmuArchive& archive) {
  if (archive.is_fmi3()) return std::make_unique<Controller3>(archive);
  return std::make_unique<Controller2>(archive);
}

}  // namespace mbcosim::peer
