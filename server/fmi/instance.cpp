#include "fmi/instance.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>

#include "fmi/saved_state.h"
#include "fmi/times.h"
#include "input/sources.h"
#include "solver/state_space.h"

namespace mbcosim::fmi {
namespace {

std::optional<std::string> read_file(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

void put(const Vec3& v, std::vector<double>& out) { out.insert(out.end(), v.data(), v.data() + 3); }

/// x, R by rows, v or ω of all points.
void put_motion(const Simulation& simulation, const PointMotion& motion, FmuVariable::Source what,
                std::vector<double>& out) {
  for (int k = 0; k < motion.size(); ++k) {
    const PointState point = motion.at(simulation, k);
    if (what == FmuVariable::Source::positions) put(point.x, out);
    if (what == FmuVariable::Source::velocities) put(point.v, out);
    if (what == FmuVariable::Source::angular_velocities) put(point.w, out);
    if (what == FmuVariable::Source::orientations)
      for (int i = 0; i < 3; ++i) put(point.R.row(i).transpose(), out);
  }
}

}  // namespace

// ------------------------------------------------------------------ life

std::unique_ptr<Instance> Instance::create(Standard standard, const std::string& name,
                                           const std::string& token, const std::string& resources,
                                           Log log) {
  std::unique_ptr<Instance> instance(new Instance(standard, name, std::move(log)));
  if (name.find_first_not_of(" \t\n") == std::string::npos) {
    instance->log_.write(Status::error, "the name of the instance is empty");
    return nullptr;
  }
  if (!instance->load(token, resources)) return nullptr;
  return instance;
}

bool Instance::load(const std::string& token, const std::string& resources) {
  const auto refuse = [this](const std::string& message) {
    log_.write(Status::error, message);
    return false;
  };
  const auto text = read_file(resources + "/mbcosim.json");
  if (!text) return refuse("cannot read \"" + resources + "/mbcosim.json\"");
  auto manifest = manifest_from_json(*text);
  if (!manifest) return refuse(manifest.error().message);
  manifest_ = std::move(*manifest);
  if (token != manifest_.token)
    return refuse("the token \"" + token + "\" is not that of these resources, \"" +
                  manifest_.token + "\"");
  for (const auto& [name, path] : manifest_.files) {
    auto content = read_file(resources + "/" + path);
    if (!content) return refuse("cannot read \"" + resources + "/" + path + "\"");
    files_[name] = std::move(*content);
  }
  for (const FmuSymbol& symbol : manifest_.symbols)
    if (symbol.given) exported_.insert_or_assign(symbol.name, symbol.start);
  DeckReport report = read_with(exported_);
  if (!report.ok()) return false;
  take(std::move(report), exported_);
  log_.write(Status::ok, "model read: " + std::to_string(model_->unknowns) + " unknowns");
  initial_time_ = model_->initial_value.initial_time;
  set_start_values();
  return bind();
}

DeckReport Instance::read_with(const SymbolValues& symbols) {
  DeckReport report = read_deck(BundleSource(files_), manifest_.deck, {.symbols = symbols});
  for (const Diagnostic& d : report.diagnostics)
    log_.write(d.severity == Severity::error ? Status::error : Status::warning, d.text());
  return report;
}

void Instance::take(DeckReport report, const SymbolValues& symbols) {
  remote_.reset();  // it has another model
  model_ = std::move(report.model);
  read_ = symbols;
  declared_.clear();
  for (DeckSymbol& symbol : report.symbols)
    declared_.insert_or_assign(std::move(symbol.name), std::move(symbol.declared));
}

mbcosim::Status Instance::ensure_read() {
  if (chosen_ == read_) return ok();
  const auto refuse = [](const std::string& message) {
    return make_error(ErrorKind::argument, "", message);
  };
  DeckReport report = read_with(chosen_);
  if (!report.ok()) return refuse("the deck is refused with these parameters");
  const auto names = [](const Simulation& simulation) {
    std::vector<std::pair<std::string, std::vector<int>>> all;
    for (const mbcosim::Variable& v : simulation.variables()) all.emplace_back(v.name, v.shape);
    return all;
  };
  if (names(*Simulation::prepare(report.model)) != names(*Simulation::prepare(model_)))
    return refuse("with these parameters the model has other variables: export an FMU with -D");
  take(std::move(report), chosen_);
  simulation_ = Simulation::prepare(model_);
  if (!bind()) return refuse("with these parameters the model has other variables");
  return ok();
}

Result<std::uint64_t> Instance::digest_with(const SymbolValues& symbols) {
  if (symbols == read_) return model_->digest;
  const DeckReport report = read_with(symbols);
  if (!report.ok())
    return make_error(ErrorKind::argument, "", "the deck is refused with the state's parameters");
  return report.model->digest;
}

void Instance::set_start_values() {
  mode_ = Mode::instantiated;
  communication_time_ = last_time_ = initial_time_;
  stop_time_.reset();
  chosen_ = exported_;
  given_.clear();
  for (const FmuVariable& variable : manifest_.variables) given_.push_back(variable.start);
  simulation_ = Simulation::prepare(model_);
  started_ = ahead_ = ended_ = false;
  behind_ = true;
  ++revision_;
}

bool Instance::bind() {
  motions_.clear();
  variables_.clear();
  index_.clear();
  for (const FmuVariable& variable : manifest_.variables) {
    Variable bound{&variable};
    if (variable.source == FmuVariable::Source::variable) {
      bound.handle = simulation_->find_variable(variable.name);
    } else if (const StructuralPort* port = find_structural_port(*model_, variable.name)) {
      motions_.push_back(std::make_unique<PointMotion>(*simulation_, *port));
      bound.motion = motions_.back().get();
    }
    if (bound.handle < 0 && !bound.motion) {
      log_.write(Status::error, "the model has no variable \"" + variable.name + "\"");
      return false;
    }
    index_.emplace(variable.reference, static_cast<int>(variables_.size()));
    variables_.push_back(bound);
  }
  return true;
}

bool Instance::admit(Call call, const char* function) {
  if (is_allowed(standard_, call, mode_)) return true;
  fail(std::string(function) + " is not allowed in the state \"" + mode_name(standard_, mode_) +
       "\"");
  return false;
}

Status Instance::fail(const std::string& message) {
  log_.write(Status::error, name_ + ": " + message);
  mode_ = standard_ == Standard::fmi2 ? Mode::failed : Mode::terminated;
  return Status::error;
}

Status Instance::discard(const std::string& message) {
  log_.write(Status::discard, name_ + ": " + message);
  return Status::discard;
}

Status Instance::setup(double start_time, std::optional<double> stop_time) {
  const double initial = initial_time_;
  if (!(std::abs(start_time - initial) <= kRounding * std::max(1.0, std::abs(initial))))
    return fail("the deck starts at " + number(initial) + " s, the importer at " +
                number(start_time) + " s");
  if (stop_time && !(*stop_time >= start_time))
    return fail("the stop time " + number(*stop_time) + " s lies before the start");
  communication_time_ = last_time_ = start_time;
  stop_time_ = stop_time;
  mode_ = Mode::set_up;
  return Status::ok;
}

Status Instance::enter_initialization() {
  mode_ = Mode::initialization;
  return Status::ok;
}

mbcosim::Status Instance::ensure_started() {
  if (started_) return ok();
  if (auto read = ensure_read(); !read) return read;
  if (model_->initial_value.initial_time != initial_time_)
    return make_error(ErrorKind::argument, "",
                      "with these parameters the deck starts at " +
                          number(model_->initial_value.initial_time) + " s");
  simulation_ = Simulation::prepare(model_);
  simulation_->set_final_time(std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < variables_.size(); ++k)
    if (!given_[k].empty() && !write(variables_[k], given_[k]))
      return Error{ErrorKind::argument, "a start value was refused", {}, {}, {}};
  if (auto status = simulation_->start(); !status) return status;
  started_ = behind_ = true;
  ahead_ = false;
  ++revision_;
  return ok();
}

Status Instance::exit_initialization() {
  if (const auto started = ensure_started(); !started) return fail(started.error().message);
  if (const auto connected = ensure_connected(); !connected) return fail(connected.error().message);
  mode_ = Mode::step;
  return Status::ok;
}

Status Instance::terminate() {
  mode_ = Mode::terminated;
  return Status::ok;
}

Status Instance::reset() {
  remote_.reset();
  set_start_values();
  return Status::ok;
}

// ------------------------------------------------------------------ values

const Instance::Variable* Instance::find(std::uint32_t reference) const {
  const auto it = index_.find(reference);
  return it == index_.end() ? nullptr : &variables_[it->second];
}

void Instance::read(const Variable& variable, std::vector<double>& all,
                    std::vector<double>& out) const {
  all.clear();
  if (variable.motion)
    put_motion(*simulation_, *variable.motion, variable.of->source, all);
  else
    simulation_->get(variable.handle, all);
  for (const int element : variable.of->elements) out.push_back(all[element]);
}

Status Instance::get(std::span<const std::uint32_t> references, std::span<double> values) {
  if (mode_ == Mode::initialization)
    if (const auto started = ensure_started(); !started) return fail(started.error().message);
  if (const auto pulled = pull(); !pulled) return fail(pulled.error().message);
  std::vector<double> all, one;
  std::size_t at = 0;
  for (const std::uint32_t reference : references) {
    const Variable* variable = find(reference);
    const FmuSymbol* symbol = variable ? nullptr : find_symbol(reference, ValueType::real);
    if (!variable && !symbol)
      return fail("no real variable has the reference " + std::to_string(reference));
    if (symbol)
      one = {std::get<double>(value_of(*symbol))};
    else if (variable->of->role == FmuVariable::Role::independent)
      one = {communication_time_};
    else if (one = given_[index_of(*variable)]; one.empty())
      read(*variable, all, one);
    if (one.size() > values.size() - at)
      return fail("the variables have more than " + std::to_string(values.size()) + " values");
    std::copy(one.begin(), one.end(), values.begin() + static_cast<std::ptrdiff_t>(at));
    at += one.size();
  }
  if (at != values.size())
    return fail("the variables have " + std::to_string(at) + " values, not " +
                std::to_string(values.size()));
  return Status::ok;
}

Status Instance::may_set(const Variable& variable) {
  const FmuVariable::Role role = variable.of->role;
  if (role == FmuVariable::Role::input || role == FmuVariable::Role::tunable) return Status::ok;
  return fail("\"" + variable.of->name + "\" is neither an input nor a parameter");
}

bool Instance::write(const Variable& variable, std::span<const double> values) {
  std::vector<double> all;
  simulation_->get(variable.handle, all);
  const std::vector<double> before = all;
  for (std::size_t k = 0; k < values.size(); ++k) all[variable.of->elements[k]] = values[k];
  if (all == before) return true;
  behind_ = true;
  return static_cast<bool>(simulation_->set(variable.handle, all));
}

Status Instance::set(std::span<const std::uint32_t> references, std::span<const double> values) {
  std::size_t at = 0;
  for (const std::uint32_t reference : references) {
    const Variable* variable = find(reference);
    const FmuSymbol* symbol = variable ? nullptr : find_symbol(reference, ValueType::real);
    if (!variable && !symbol)
      return fail("no real variable has the reference " + std::to_string(reference));
    const Status status = symbol ? may_choose(*symbol) : may_set(*variable);
    if (status != Status::ok) return status;
    const std::size_t size = symbol ? 1 : variable->of->elements.size();
    if (size > values.size() - at)
      return fail("the variables have more than " + std::to_string(values.size()) + " values");
    at += size;
  }
  if (at != values.size())
    return fail("the variables have " + std::to_string(at) + " values, not " +
                std::to_string(values.size()));
  if (!std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); }))
    return discard("a value is not finite; none was set");
  if (const auto pulled = pull(); !pulled) return fail(pulled.error().message);
  for (const std::uint32_t reference : references) {
    const Variable* found = find(reference);
    if (!found) {
      choose(*find_symbol(reference, ValueType::real), values[0]);
      values = values.subspan(1);
      continue;
    }
    const Variable& variable = *found;
    const auto mine = values.first(variable.of->elements.size());
    values = values.subspan(mine.size());
    given_[index_of(variable)].assign(mine.begin(), mine.end());
    if (mode_ == Mode::step && !write(variable, mine))
      return fail("\"" + variable.of->name + "\" cannot be set");
  }
  if (mode_ != Mode::step) started_ = false;
  ++revision_;
  return Status::ok;
}

// ------------------------------------------------------------------ symbols of the deck

const FmuSymbol* Instance::find_symbol(std::uint32_t reference, ValueType type) const {
  for (const FmuSymbol& symbol : manifest_.symbols)
    if (symbol.reference == reference) return type_of(symbol.start) == type ? &symbol : nullptr;
  return nullptr;
}

/// What the deck computes from other symbols follows them once it was read with them.
Value Instance::value_of(const FmuSymbol& symbol) const {
  if (const auto chosen = chosen_.find(symbol.name); chosen != chosen_.end()) return chosen->second;
  const auto declared = declared_.find(symbol.name);
  const bool known = chosen_ == read_ && declared != declared_.end();
  return known ? declared->second : symbol.start;
}

Status Instance::may_choose(const FmuSymbol& symbol) {
  if (mode_ != Mode::step) return Status::ok;
  return fail("\"symbol." + symbol.name + "\" is fixed: it is set before the first step");
}

/// The start value leaves the choice to the deck.
void Instance::choose(const FmuSymbol& symbol, const Value& value) {
  if (value == symbol.start && !symbol.given)
    chosen_.erase(symbol.name);
  else
    chosen_.insert_or_assign(symbol.name, value);
}

Status Instance::get_symbols(std::span<const std::uint32_t> references, ValueType type,
                             const std::vector<Value>*& values) {
  if (mode_ == Mode::initialization)
    if (const auto started = ensure_started(); !started) return fail(started.error().message);
  handed_out_.clear();
  for (const std::uint32_t reference : references) {
    const FmuSymbol* symbol = find_symbol(reference, type);
    if (!symbol)
      return fail(std::string("no ") + type_name(type) + " variable has the reference " +
                  std::to_string(reference));
    handed_out_.push_back(value_of(*symbol));
  }
  values = &handed_out_;
  return Status::ok;
}

Status Instance::set_symbols(std::span<const std::uint32_t> references, ValueType type,
                             const std::vector<Value>& values) {
  if (values.size() != references.size())
    return fail("the variables have " + std::to_string(references.size()) + " values, not " +
                std::to_string(values.size()));
  for (const std::uint32_t reference : references) {
    const FmuSymbol* symbol = find_symbol(reference, type);
    if (!symbol)
      return fail(std::string("no ") + type_name(type) + " variable has the reference " +
                  std::to_string(reference));
    if (const Status status = may_choose(*symbol); status != Status::ok) return status;
  }
  for (std::size_t k = 0; k < references.size(); ++k)
    choose(*find_symbol(references[k], type), values[k]);
  started_ = false;
  ++revision_;
  return Status::ok;
}

// ------------------------------------------------------------------ states

std::unique_ptr<SavedState> Instance::save() {
  if (const auto pulled = pull(); !pulled) {
    fail(pulled.error().message);
    return nullptr;
  }
  auto saved = std::make_unique<SavedState>();
  saved->token = manifest_.token;
  saved->mode = mode_;
  saved->given = given_;
  saved->symbols = chosen_;
  saved->communication_time = communication_time_;
  saved->last_time = last_time_;
  saved->ended = ended_;
  saved->stop_time = stop_time_;
  if (started_) saved->state = simulation_->snapshot();
  return saved;
}

Status Instance::restore(const SavedState& saved) {
  if (saved.token != manifest_.token) return fail("the state belongs to another FMU");
  ahead_ = false;
  behind_ = true;
  given_ = saved.given;
  chosen_ = saved.symbols;
  if (chosen_ != read_) started_ = false;
  if (saved.state) {
    if (!started_)
      if (const auto started = ensure_started(); !started) return fail(started.error().message);
    if (const auto restored = simulation_->restore(*saved.state); !restored)
      return fail(restored.error().message);
  } else {
    started_ = false;
    simulation_ = Simulation::prepare(model_);
  }
  mode_ = saved.mode;
  communication_time_ = saved.communication_time;
  last_time_ = saved.last_time;
  ended_ = saved.ended;
  stop_time_ = saved.stop_time;
  ++revision_;
  log_.write(Status::ok, "state of t = " + number(communication_time_) + " s restored");
  return Status::ok;
}

std::string Instance::serialize(const SavedState& saved) {
  const auto digest = digest_with(saved.symbols);
  return to_bytes(saved, digest ? *digest : 0);
}

std::unique_ptr<SavedState> Instance::deserialize(std::string_view bytes) {
  auto saved = saved_state_from_bytes(
      bytes, manifest_.token, [this](const SymbolValues& symbols) { return digest_with(symbols); });
  if (!saved) {
    fail(saved.error().message);
    return nullptr;
  }
  bool fits = saved->given.size() == given_.size();
  for (std::size_t k = 0; fits && k < given_.size(); ++k)
    fits = saved->given[k].size() == given_[k].size();
  if (fits) return std::make_unique<SavedState>(std::move(*saved));
  fail("the state has other variables");
  return nullptr;
}

// ------------------------------------------------------------------ derivatives

int Instance::Sums::place_of(int handle, int handle_size) {
  const auto known = std::find(handles.begin(), handles.end(), handle);
  if (known != handles.end()) return starts[known - handles.begin()];
  handles.push_back(handle);
  starts.push_back(size);
  size += handle_size;
  return starts.back();
}

void Instance::Sums::add(int number, double factor) { rows.back().emplace_back(number, factor); }

/// Derivatives of x = X + R f, R, v = V + ω × R f and ω of points are those of their nodes:
///
///   dx = dX + dR f,  dv = dV + dω × R f + ω × dR f
void Instance::add_motion(const Variable& variable, Sums& sums) const {
  using Source = FmuVariable::Source;
  const Source source = variable.of->source;
  const int per_point = source == Source::orientations ? 9 : 3;
  for (const int element : variable.of->elements) {
    const int k = element / per_point, i = element % per_point;
    const PointMotion::Point& from = variable.motion->point(k);
    const auto add = [&](int handle, int number, double factor) {
      if (handle < 0 || factor == 0) return;  // a node without orientation
      const int size = simulation_->variables()[handle].size;
      sums.add(sums.place_of(handle, size) + number, factor);
    };
    const auto add_arm = [&](int row, double factor) {
      for (int j = 0; j < 3; ++j) add(from.R, 3 * row + j, factor * from.offset[j]);
    };
    sums.rows.emplace_back();
    if (source == Source::orientations) add(from.R, i, 1);
    if (source == Source::angular_velocities) add(from.w, i, 1);
    if (source == Source::positions) {
      add(from.x, i, 1);
      add_arm(i, 1);
    }
    if (source == Source::velocities) {
      const PointState point = variable.motion->at(*simulation_, k);
      const Vec3 arm = point.R * from.offset;
      const int p = (i + 1) % 3, q = (i + 2) % 3;
      add(from.v, i, 1);
      add(from.w, p, arm[q]);
      add(from.w, q, -arm[p]);
      add_arm(q, point.w[p]);
      add_arm(p, -point.w[q]);
    }
  }
}

std::optional<Instance::Sums> Instance::sums_of(std::span<const std::uint32_t> references,
                                                bool inputs) {
  Sums sums;
  for (const std::uint32_t reference : references) {
    const Variable* variable = find(reference);
    const bool fits = variable && variable->of->role != FmuVariable::Role::independent &&
                      given_[index_of(*variable)].empty() != inputs;
    if (!fits) {
      fail("variable " + std::to_string(reference) + " is no " +
           (inputs ? "input" : "output with derivatives"));
      return std::nullopt;
    }
    if (variable->motion) {
      add_motion(*variable, sums);
      continue;
    }
    const int start =
        sums.place_of(variable->handle, simulation_->variables()[variable->handle].size);
    for (const int element : variable->of->elements) {
      sums.rows.emplace_back();
      sums.add(start + element, 1);
    }
  }
  return sums;
}

mbcosim::Status Instance::compute_derivative(std::span<const std::uint32_t> unknowns,
                                             std::span<const std::uint32_t> knowns) {
  constexpr int kLargest = 2000;  ///< unknowns; the elimination works on full matrices
  Derivative now{{unknowns.begin(), unknowns.end()}, {knowns.begin(), knowns.end()}, revision_, {}};
  if (derivative_ && derivative_->revision == revision_ && derivative_->unknowns == now.unknowns &&
      derivative_->knowns == now.knowns)
    return ok();
  const auto outputs = sums_of(unknowns, false);
  const auto inputs = outputs ? sums_of(knowns, true) : std::nullopt;
  if (!inputs) return make_error(ErrorKind::argument, "", "");
  if (model_->unknowns > kLargest)
    return make_error(ErrorKind::limit, "",
                      "derivatives are given for models of at most " + std::to_string(kLargest) +
                          " unknowns; this one has " + std::to_string(model_->unknowns));
  const auto io = simulation_->linearize(inputs->handles, outputs->handles);
  if (!io) return io.error();
  const auto system = state_space(simulation_->linearize(), *io);
  if (!system) return system.error();
  now.d = MatX::Zero(static_cast<Eigen::Index>(outputs->rows.size()),
                     static_cast<Eigen::Index>(inputs->rows.size()));
  for (Eigen::Index j = 0; j < now.d.cols(); ++j)
    for (Eigen::Index i = 0; i < now.d.rows(); ++i)
      for (const auto& [number, factor] : outputs->rows[i])
        now.d(i, j) += factor * system->d(number, inputs->rows[j].front().first);
  derivative_ = std::move(now);
  return ok();
}

Status Instance::derivative(std::span<const std::uint32_t> unknowns,
                            std::span<const std::uint32_t> knowns, std::span<const double> seed,
                            std::span<double> sensitivity, bool transposed) {
  if (mode_ == Mode::initialization)
    if (const auto started = ensure_started(); !started) return fail(started.error().message);
  if (const auto pulled = pull(); !pulled) return fail(pulled.error().message);
  if (const auto computed = compute_derivative(unknowns, knowns); !computed)
    return computed.error().message.empty() ? Status::error : discard(computed.error().message);
  const MatX D = transposed ? MatX(derivative_->d.transpose()) : derivative_->d;
  if (D.cols() != static_cast<Eigen::Index>(seed.size()) ||
      D.rows() != static_cast<Eigen::Index>(sensitivity.size()))
    return fail("the derivative is " + std::to_string(D.rows()) + " by " +
                std::to_string(D.cols()) + ", the arrays have " +
                std::to_string(sensitivity.size()) + " and " + std::to_string(seed.size()) +
                " numbers");
  Eigen::Map<VecX>(sensitivity.data(), D.rows()) =
      D * Eigen::Map<const VecX>(seed.data(), D.cols());
  return Status::ok;
}

}  // namespace mbcosim::fmi
