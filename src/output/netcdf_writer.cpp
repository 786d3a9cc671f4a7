#include "output/netcdf_writer.h"

#include <map>
#include <set>
#include <unordered_map>

#include "model/family.h"
#include "model/model_part.h"
#include "model/netcdf_sync.h"
#include "model/unit_system.h"
#include "output/netcdf_file.h"
#include "output/record.h"

namespace mbcosim {

namespace {

/// "node.struct", "elem.joint", ...: what the lines of a result file are about.
std::string owner_kind(OutputFile file) {
  switch (file) {
    case OutputFile::mov:
    case OutputFile::ine:
      return "node.struct";
    case OutputFile::prs:
      return "node.hydraulic";
    case OutputFile::abs:
      return "node.abstract";
    case OutputFile::thn:
      return "node.thermal";
    case OutputFile::prm:
      return "node.parameter";
    case OutputFile::drv:
      return "drive";
    default:
      break;
  }
  const FamilyFacts* const family = family_by_file(extension(file));
  return std::string("elem.") + (family ? family->owner : extension(file));
}

/// One column group of a line.
struct Field {
  int variable = -1;
  std::vector<std::size_t> shape;
};

class NetcdfWriter : public ResultWriter, public OutputRow {
 public:
  NetcdfWriter(const std::string& prefix, ResultBudget* budget)
      : path_(prefix + ".nc"), budget_(budget) {}

  bool has_named_fields() const override { return true; }

  std::vector<std::string> paths(const Model&) const override { return {path_}; }
  void begin(const Model& model) override {
    file_.create(path_, budget_);
    file_.attribute(-1, "title", model.title);
    define_all(model);
  }
  void derivatives(double, int, double) override {}
  void dummy_steps(double, int, double) override {}
  void step(const StepLine&) override {}
  void note(const std::string&) override {}

  void record(const EvalContext& context) override {
    file_.put_record(step_, record_, static_cast<int>(context.state->step));
    file_.put_record(time_, record_, {}, &context.state->time);
    file_.put_record(h_, record_, {}, &context.state->h);
    write_record(context, *this);
    ++record_;
    if (sync_) (void)file_.flush(false);  // status() tells of a failure
  }
  void eigenanalysis(const EigenReport& report) override;
  Status status() const override { return file_.status(); }
  Status finish() override { return file_.finish(); }

  // What a later eigenanalysis left stays defined, until it is done again.
  void resume(const Model& model) override {
    file_.reopen(path_, budget_);
    define_all(model);
  }
  void positions(std::vector<std::int64_t>& out) const override {
    out.push_back(static_cast<std::int64_t>(record_));
    out.push_back(file_.bytes());
  }
  Status go_back(std::span<const std::int64_t>& positions, const EvalContext&) override {
    record_ = static_cast<std::size_t>(positions[0]);
    file_.cut(record_, positions[1]);
    positions = positions.subspan(2);
    return status();
  }
  Status flush(bool to_disk) override { return file_.flush(to_disk); }

 private:
  void define_all(const Model& model) {
    model_ = &model;
    units_ = find_part<UnitSystem>(model);
    const NetcdfSync* const sync = find_part<NetcdfSync>(model);
    sync_ = sync && sync->on;
    time_dimension_ = file_.dimension("time", NetcdfFile::kUnlimited);
    dimensions_ = {{1, file_.dimension("Vec1", 1)}, {3, file_.dimension("Vec3", 3)}};
    step_ = define("run.step", NetcdfFile::Type::integer, {time_dimension_}, "", "integer",
                   "time step index");
    time_ =
        define("time", NetcdfFile::Type::real, {time_dimension_}, "s", "real", "simulation time");
    h_ =
        define("run.timestep", NetcdfFile::Type::real, {time_dimension_}, "s", "real", "time step");
    define_labels();
  }
  int define(const std::string& name, NetcdfFile::Type type, const std::vector<int>& dimensions,
             const std::string& units, const std::string& kind, const std::string& description) {
    const int id = file_.variable(name, type, dimensions);
    file_.attribute(id, "units", units_ ? units_->name(units) : units);
    file_.attribute(id, "type", kind);
    file_.attribute(id, "description", description);
    return id;
  }
  int dimension(std::size_t length) {
    const auto [found, added] = dimensions_.try_emplace(length, -1);
    if (added) found->second = file_.dimension("dim" + std::to_string(length), length);
    return found->second;
  }
  void labels(const std::string& name, const std::vector<int>& values,
              const std::string& description) {
    if (values.empty()) return;
    std::string dimension_name = name.substr(name.find('.') + 1) +
                                 (name[0] == 'n' ? "_node_labels_dim" : "_elem_labels_dim");
    const int size = file_.dimension(dimension_name, values.size()),
              id = define(name, NetcdfFile::Type::integer, {size}, "", "integer", description);
    if (name == "node.struct") node_dimension_ = size;
    label_values_.emplace_back(id, values);
  }
  void define_labels();
  void put_first_unknowns(const EigenReport& report);
  /// `size`: the dimension of rows and of columns.
  void put_matrices(const EigenReport& report, const std::string& name, int size);

  /// The fields of the line that starts; known by file and label.
  void start_line(OutputFile file, const std::string& label) {
    key_ = std::to_string(static_cast<int>(file)) + ' ' + label;
    line_ = &lines_.try_emplace(key_).first->second;
    next_ = 0;
    file_of_line_ = file;
  }
  std::string owner() const {
    const std::string label = key_.substr(key_.find(' ') + 1);
    const bool couple = file_of_line_ == OutputFile::frc && is_couple(label);
    return (couple ? "elem.couple" : owner_kind(file_of_line_)) + '.' + label;
  }
  bool is_couple(const std::string& label) const {
    const ElementRef e = model_->find_element(Family::force, std::atoi(label.c_str()));
    return e.set && e.set->info(e.index).type.find("couple") != std::string::npos;
  }

  /// The next field of the line, defined at its first appearance.
  const Field& field(const std::string& name, const char* unit, NetcdfFile::Type type,
                     std::vector<std::size_t> shape) {
    if (next_ < line_->size()) return (*line_)[next_++];
    const std::string base = owner() + '.' + name;
    std::string full = base;
    for (int k = 2; !names_.insert(full).second; ++k) full = base + '_' + std::to_string(k);
    std::vector<int> dimensions = {time_dimension_};
    for (const std::size_t n : shape) dimensions.push_back(dimension(n));
    const char* kind = type == NetcdfFile::Type::integer ? "integer"
                       : shape.empty()                   ? "real"
                       : shape.size() == 2               ? "Mat3x3"
                       : shape[0] == 3                   ? "Vec3"
                                                         : "vector";
    const std::string units = unit;
    Field f;
    f.variable = define(full, type, dimensions, units == "-" ? "" : units, kind, "");
    f.shape = std::move(shape);
    line_->push_back(std::move(f));
    return (*line_)[next_++];
  }
  std::string field_name(const char* name, const char* unit) const {
    const std::string n = name;
    if (n == "R")
      return std::string(unit) == "deg" ? "E" : std::string(unit) == "rad" ? "Phi" : "R";
    if (file_of_line_ == OutputFile::frc && n[0] == 'X') return "Arm" + n.substr(1);
    return n;
  }

  // OutputRow
  void begin(OutputFile file, int label) override { start_line(file, std::to_string(label)); }
  void begin_text(OutputFile file, std::string_view label) override {
    const std::size_t first = label.find_first_not_of(' ');
    start_line(file, std::string(first == label.npos ? label : label.substr(first)));
  }
  void integer(int value) override {
    file_.put_record(field(file_of_line_ == OutputFile::frc ? "node" : "state", "",
                           NetcdfFile::Type::integer, {})
                         .variable,
                     record_, value);
  }
  void scalar(const char* name, const char* unit, double value) override {
    const Field& f = field(field_name(name, unit), unit, NetcdfFile::Type::real, {});
    file_.put_record(f.variable, record_, f.shape, &value);
  }
  void vec3(const char* name, const char* unit, const Vec3& value) override {
    const Field& f = field(field_name(name, unit), unit, NetcdfFile::Type::real, {3});
    file_.put_record(f.variable, record_, f.shape, value.data());
  }
  void values(const char* name, const char* unit, const double* data, int count) override {
    const bool matrix = count == 9;
    const std::size_t n = static_cast<std::size_t>(count);
    const Field& f = field(field_name(name, unit), unit, NetcdfFile::Type::real,
                           matrix ? std::vector<std::size_t>{3, 3} : std::vector<std::size_t>{n});
    file_.put_record(f.variable, record_, f.shape, data);
  }
  void end() override {}

  const std::string path_;
  ResultBudget* const budget_;  ///< may be null
  const Model* model_ = nullptr;
  bool sync_ = false;
  const UnitSystem* units_ = nullptr;  ///< that the deck declares
  NetcdfFile file_;
  int time_dimension_ = -1, step_ = -1, time_ = -1, h_ = -1;
  int node_dimension_ = -1, first_unknowns_ = -1;
  std::map<std::size_t, int> dimensions_;  ///< by length
  std::vector<std::pair<int, std::vector<int>>> label_values_;
  std::unordered_map<std::string, std::vector<Field>> lines_;
  std::set<std::string> names_;
  std::vector<Field>* line_ = nullptr;
  std::size_t next_ = 0, record_ = 0;
  OutputFile file_of_line_ = OutputFile::mov;
  std::string key_;  ///< file and label of the line
};

void NetcdfWriter::define_labels() {
  std::vector<int> nodes;
  for (const StructuralNode& n : model_->structural) {
    if (n.output) nodes.push_back(n.label);
    define("node.struct." + std::to_string(n.label), NetcdfFile::Type::integer, {dimension(1)}, "",
           kind_name(n.kind), "");
  }
  labels("node.struct", nodes, "labels of the structural nodes");
  std::map<std::string, std::vector<int>> elements;
  for (const ElementRef& e : model_->elements) {
    const ElementInfo& info = e.set->info(e.index);
    if (!info.output) continue;
    const bool couple =
        info.family == Family::force && info.type.find("couple") != std::string::npos;
    elements[couple ? "couple" : family_name(info.family)].push_back(info.label);
  }
  for (const auto& [type, list] : elements) {
    std::string name = type;
    for (char& c : name)
      if (c == ' ') c = '_';
    labels("elem." + name, list, "labels of the elements");
  }
  for (const auto& [id, values] : label_values_) file_.put(id, values);
}

// In the order of `node.struct`; -1: the node has no unknowns.
void NetcdfWriter::put_first_unknowns(const EigenReport& report) {
  std::map<int, int> first;
  for (const auto& n : report.nodes) first[n.label] = n.first_unknown;
  std::vector<int> values;
  for (const StructuralNode& n : model_->structural)
    if (n.output) values.push_back(first.contains(n.label) ? first.at(n.label) : -1);
  if (values.empty()) return;
  if (first_unknowns_ < 0)
    first_unknowns_ = define("eig.idx", NetcdfFile::Type::integer, {node_dimension_}, "", "integer",
                             "first unknown of each structural node, from zero");
  file_.put(first_unknowns_, values);
}

void NetcdfWriter::put_matrices(const EigenReport& report, const std::string& name, int size) {
  for (const bool plus : {true, false}) {
    const MatX dense = model_->dense(plus ? report.pencil.plus : report.pencil.minus).transpose();
    file_.put(define(name + (plus ? ".Aplus" : ".Aminus"), NetcdfFile::Type::real, {size, size}, "",
                     "real", "F/xPrime +- dCoef F/x"),
              std::vector<double>(dense.data(), dense.data() + dense.size()));
  }
}

void NetcdfWriter::eigenanalysis(const EigenReport& report) {
  const std::string name = "eig." + std::to_string(report.index),
                    size_name = "eig_" + std::to_string(report.index);
  using Type = NetcdfFile::Type;
  const auto number = [&](const char* what, Type type, const char* units, const char* description) {
    return define(name + what, type, {dimension(1)}, units,
                  type == Type::integer ? "integer" : "real", description);
  };
  const int step = number(".step", Type::integer, "", "time step of the analysis"),
            time = number(".time", Type::real, "s", "its time"),
            kappa = number(".dCoef", Type::real, "s", "coefficient of the bilinear transformation");
  file_.put(step, std::vector<int>{static_cast<int>(report.step)});
  file_.put(time, std::vector<double>{report.time});
  file_.put(kappa, std::vector<double>{report.pencil.kappa});
  if (report.settings.geometry) put_first_unknowns(report);
  const bool matrices = report.settings.matrices_full || report.settings.matrices_sparse;
  if (report.modes.empty() && !matrices) return;
  const std::size_t n = static_cast<std::size_t>(model_->unknowns), m = report.modes.size();
  const int size = file_.dimension(size_name + "_iSize", n);
  if (matrices) put_matrices(report, name, size);
  if (report.modes.empty()) return;
  const int modes = file_.dimension(size_name + "_iNVec_out", m), three = dimension(3),
            two = dimension(2);
  std::vector<double> alpha;
  const GeneralizedEigen& s = report.solution;
  for (const int k : report.modes)
    alpha.insert(alpha.end(), {s.alpha_r(k), s.alpha_i(k), s.beta(k)});
  file_.put(
      define(name + ".alpha", Type::real, {modes, three}, "", "real", "re(alpha), im(alpha), beta"),
      alpha);
  if (!report.settings.eigenvectors) return;
  for (const bool right : {true, false}) {
    const Eigen::MatrixXcd& v = right ? report.solution.right : report.solution.left;
    if (v.cols() == 0) continue;
    std::vector<double> data;
    for (const bool real : {true, false})
      for (const int k : report.modes)
        for (std::size_t i = 0; i < n; ++i) data.push_back(real ? v(i, k).real() : v(i, k).imag());
    file_.put(define(name + (right ? ".VR" : ".VL"), Type::real, {two, modes, size}, "", "real",
                     "real and imaginary parts"),
              data);
  }
}

}  // namespace

std::shared_ptr<ResultWriter> make_netcdf_writer(const std::string& prefix, ResultBudget* budget) {
  return std::make_shared<NetcdfWriter>(prefix, budget);
}

}  // namespace mbcosim
