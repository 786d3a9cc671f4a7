#include "reduction/job.h"

#include <charconv>
#include <cmath>

#include "model/text.h"

namespace mbcosim {

namespace {

std::vector<std::string> list(std::string_view text, char separator = ',') {
  std::vector<std::string> items;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(separator), text.size());
    if (const std::string_view item = trimmed(text.substr(0, end)); !item.empty())
      items.emplace_back(item);
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return items;
}

double real(const std::string& name, const std::string& value) {
  double number = 0;
  const auto [end, error] = std::from_chars(value.data(), value.data() + value.size(), number);
  if (error != std::errc() || end != value.data() + value.size() || !std::isfinite(number))
    refuse_reduction(name + ": a number expected, got `" + value + "`");
  return number;
}

int whole(const std::string& name, const std::string& value) {
  const double number = real(name, value);
  if (number != std::floor(number) || number < 0 || number > 1e6)
    refuse_reduction(name + ": a whole number expected, got `" + value + "`");
  return static_cast<int>(number);
}

bool yes_or_no(const std::string& name, const std::string& value) {
  if (value != "yes" && value != "no")
    refuse_reduction(name + ": `yes` or `no` expected, got `" + value + "`");
  return value == "yes";
}

/// `1:123456; 9:3`
void set_components(const std::string& value, ReductionOptions& options) {
  for (const std::string& item : list(value, ';')) {
    const std::size_t colon = item.find(':');
    if (colon == std::string::npos)
      refuse_reduction("components: `label:digits` expected, got `" + item + "`");
    const std::string label(trimmed(item.substr(0, colon))),
        digits(trimmed(item.substr(colon + 1)));
    parse_components(digits);
    options.interface_components[label] = digits;
  }
}

/// `auto`, `mean-axes`, `node:LABEL`, `point:x,y,z`
void set_frame(const std::string& value, ReductionOptions& options) {
  if (value == "auto") {
    options.frame = ReductionFrame::automatic;
  } else if (value == "mean-axes") {
    options.frame = ReductionFrame::mean_axes;
  } else if (value.starts_with("node:")) {
    options.frame = ReductionFrame::node;
    options.frame_node = trimmed(value.substr(5));
  } else if (value.starts_with("point:")) {
    const std::vector<std::string> numbers = list(value.substr(6));
    if (numbers.size() != 3) refuse_reduction("frame: three coordinates expected after `point:`");
    options.frame = ReductionFrame::point;
    for (int a = 0; a < 3; ++a) options.frame_point(a) = real("frame", numbers[a]);
  } else {
    refuse_reduction("unknown frame `" + value + "`",
                     "accepted: auto, mean-axes, node:LABEL, point:x,y,z");
  }
}

ReductionInertia parse_inertia(const std::string& value) {
  if (value == "lumped") return ReductionInertia::lumped;
  if (value == "rigid") return ReductionInertia::rigid;
  if (value == "both") return ReductionInertia::both;
  if (value == "none") return ReductionInertia::none;
  refuse_reduction("unknown inertia `" + value + "`", "accepted: lumped, rigid, both, none");
}

ReductionNormal parse_normal(const std::string& value) {
  if (value == "auto") return ReductionNormal::automatic;
  if (value == "omitted") return ReductionNormal::omitted;
  if (value == "whole") return ReductionNormal::whole;
  refuse_reduction("normal: unknown choice `" + value + "`", "accepted: auto, omitted, whole");
}

/// Must the mass matrix be lumped already?
bool parse_lumping(const std::string& value) {
  if (value != "hrz" && value != "diagonal")
    refuse_reduction("unknown lumping `" + value + "`", "accepted: hrz, diagonal");
  return value == "diagonal";
}

double share(const std::string& name, const std::string& value) {
  const double number = real(name, value);
  if (!(number > 0 && number < 1))
    refuse_reduction(name + ": a number between 0 and 1 expected, got `" + value + "`");
  return number;
}

double above_zero(const std::string& name, const std::string& value) {
  const double number = real(name, value);
  if (!(number > 0)) refuse_reduction(name + ": a number above zero expected, got `" + value + "`");
  return number;
}

/// Takes the place of a highest frequency that another source gave.
void set_modes(const std::string& value, ReductionOptions& options) {
  options.modes = whole("modes", value);
  options.max_frequency = 0;
}

double shift(const std::string& value) {
  const double number = real("shift", value);
  if (number > 0)
    refuse_reduction(
        "shift: a number below zero expected, got `" + value + "`",
        "a tenth of the lowest elastic frequency squared, with a minus sign, is a good choice");
  return number;
}

}  // namespace

const std::vector<ReductionOptionHelp>& reduction_option_help() {
  static const std::vector<ReductionOptionHelp> kHelp = {
      {"mass", "File of the mass matrix (Matrix Market)"},
      {"stiffness", "File of the stiffness matrix (Matrix Market)"},
      {"nodes", "File of nodes: lines `label,x,y,z`"},
      {"dofs", "File of matrix rows: lines `label,component` (1 to 6); default: 6 rows a node"},
      {"supports", "File of supports: lines `label,components`, e.g. `7,123456`"},
      {"basis",
       "free, constrained, craig-bampton, complement, inertia-relief or inertia-decoupling"},
      {"interface", "Labels of the interface nodes, separated by commas"},
      {"components", "Components of interface nodes, `LABEL:DIGITS; ...`; default: all"},
      {"modes", "Number of normal modes"},
      {"max-frequency", "All normal modes below this frequency [Hz], instead of a number"},
      {"frame", "Floating frame: auto, mean-axes, node:LABEL or point:x,y,z"},
      {"inertia", "lumped (record group 11), rigid (12), both or none"},
      {"expose", "Labels of the nodes in the file, or `interface`; default: all"},
      {"diagonalize", "yes or no: shapes that make the reduced matrices diagonal"},
      {"normal", "Normal modes with the interface held (omitted) or not (whole); default: auto"},
      {"lumping", "hrz: lump the mass by its diagonal; diagonal: refuse a mass that is not lumped"},
      {"tolerance", "Relative tolerance of the normal modes; default: 1e-10"},
      {"shift", "Shift of the eigensolution [1/s^2], below zero; default: none"},
      {"processor",
       "Instructions of the factorization, which round differently: plain, x86-64-v3 or x86-64-v4; "
       "default: the last that this processor has"},
      {"rank-tolerance", "Relative energy below which a combination of shapes is dependent"},
  };
  return kHelp;
}

void ReductionJob::set(const std::string& name, const std::string& value) {
  if (name == "mass" || name == "stiffness" || name == "nodes" || name == "dofs" ||
      name == "supports")
    files[name] = value;
  else if (name == "basis")
    options.basis = parse_basis(value);
  else if (name == "interface")
    options.interface_nodes = list(value);
  else if (name == "components")
    set_components(value, options);
  else if (name == "modes")
    set_modes(value, options);
  else if (name == "max-frequency")
    options.max_frequency = above_zero(name, value);
  else if (name == "frame")
    set_frame(value, options);
  else if (name == "inertia")
    options.inertia = parse_inertia(value);
  else if (name == "expose")
    options.exposed = list(value);
  else if (name == "diagonalize")
    options.diagonalize = yes_or_no(name, value);
  else if (name == "normal")
    options.normal = parse_normal(value);
  else if (name == "lumping")
    options.must_be_lumped = parse_lumping(value);
  else if (name == "tolerance")
    options.eigen_tolerance = share(name, value);
  else if (name == "shift")
    options.shift = shift(value);
  else if (name == "processor")
    options.processor = value;
  else if (name == "rank-tolerance")
    options.rank_tolerance = share(name, value);
  else
    refuse_reduction("unknown option `" + name + "`");
}

void ReductionNames::add(const std::string& name) {
  if (!names_.insert(name).second) refuse_reduction("`" + name + "` is given twice");
  if (names_.contains("modes") && names_.contains("max-frequency"))
    refuse_reduction("both `modes` and `max-frequency` say how many normal modes there are",
                     "give one of them");
}

void read_job(const std::string& name, std::string_view text, ReductionJob& job) {
  ReductionNames names;
  int number = 0;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = trimmed(text.substr(0, std::min(end, text.find('#'))));
    text.remove_prefix(std::min(end + 1, text.size()));
    ++number;
    if (line.empty()) continue;
    const std::size_t equal = line.find('=');
    const std::string place = name + ":" + std::to_string(number) + ": ";
    if (equal == std::string_view::npos) refuse_reduction(place + "`name = value` expected");
    try {
      const std::string option(trimmed(line.substr(0, equal)));
      names.add(option);
      job.set(option, std::string(trimmed(line.substr(equal + 1))));
    } catch (const ReductionError& error) {
      throw ReductionError(error.kind, place + error.what());
    }
  }
}

FeModel load_model(const ReductionJob& job,
                   const std::function<std::string(const std::string&)>& read) {
  const auto text = [&](const char* name, bool needed) {
    const auto file = job.files.find(name);
    if (file != job.files.end() && !file->second.empty()) return read(file->second);
    if (needed) refuse_reduction(std::string("the file `") + name + "` is not given");
    return std::string();
  };
  return make_fe_model({text("mass", true), text("stiffness", true), text("nodes", true),
                        text("dofs", false), text("supports", false)});
}

}  // namespace mbcosim
