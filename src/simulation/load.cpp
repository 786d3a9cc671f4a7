/// Text to model.
#include "simulation/load.h"

#include "elements/families.h"
#include "input/deck_reader.h"
#include "input/symbol_values.h"
#include "model/model_part.h"
#include "simulation/model_check.h"

namespace mbcosim {

namespace {

/// Of all files read: the deck, what it includes, data files in the order of reading. Names count
/// relative to the deck's folder.
std::uint64_t digest(const Reading& reading, Digest data) {
  const std::string& main = reading.file(0).name;
  const std::string folder = main.substr(0, main.rfind('/') + 1);
  for (int i = 0; i < reading.file_count(); ++i) {
    const std::string& name = reading.file(i).name;
    data.add(name.starts_with(folder) ? name.substr(folder.size()) : name);
    data.add(reading.file(i).text);
  }
  return data.value();
}

/// As .log prints it; plugin variables with what they have in the input configuration.
std::string printed_value(const Symbol& s, const EvalContext& input) {
  if (!s.plugin) return printed(s.value);
  try {
    return printed(s.plugin->value(input));
  } catch (const EvaluationError&) {  // has no value there
    return printed(s.value);
  }
}

void store_symbols(const Reading& reading, ModelBuilder& builder) {
  const EvalContext& input = builder.input_context();
  for (const Symbol* s : reading.symbols.sorted())
    builder.model().symbols.emplace_back(std::string(s->constant || s->plugin ? "const " : "") +
                                             type_name(type_of(s->value)) + " " + s->name,
                                         printed_value(*s, input));
}

std::vector<DeckSymbol> declared_symbols(const Reading& reading) {
  std::vector<DeckSymbol> found;
  for (const Symbol* s : reading.symbols.sorted())
    if (s->declared && !s->predefined && s->role == SymbolRole::plain)
      found.push_back({s->name, s->constant, s->overridden, *s->declared, s->value});
  return found;
}

Diagnostic plain_error(std::string code, std::string file, std::string message) {
  Diagnostic d;
  d.code = std::move(code);
  d.file = std::move(file);
  d.message = std::move(message);
  return d;
}

std::int64_t count_unknowns(const Model& model) {
  std::int64_t n = 0;
  for (const StructuralNode& node : model.structural) n += node.unknowns();
  for (const ScalarNode& node : model.scalars) n += node.kind != ScalarKind::parameter;
  for (const ElementRef& e : model.elements) n += e.set->unknowns(e.index);
  return n;
}

Diagnostic full_note(const Limits& limits) {
  Diagnostic d;
  d.severity = Severity::note;
  d.code = "limit-errors";
  d.message = "reading stops after " + std::to_string(limits.errors) + " errors (limit `errors`)";
  return d;
}

std::uint64_t digest_with(std::uint64_t deck, const std::vector<PortAttachment>& ports) {
  if (ports.empty()) return deck;
  Digest all;
  all.add(std::to_string(deck));
  for (const PortAttachment& port : ports) {
    std::string text = port.name +
                       (port.kind == ElementPort::Kind::modal ? " modal " : " motion ") +
                       std::to_string(port.modal_joint) + (port.positions_only ? " positions" : "");
    for (const int label : port.node_labels) text += " " + std::to_string(label);
    all.add(text);
  }
  return all.value();
}

std::uint64_t digest_with(std::uint64_t deck, const SymbolValues& symbols) {
  if (symbols.empty()) return deck;
  Digest all;
  all.add(std::to_string(deck));
  all.add(exact_text(symbols));
  return all.value();
}

bool attach(ModelBuilder& builder, const std::vector<PortAttachment>& ports,
            const std::string& file, std::vector<Diagnostic>& extra) {
  for (const PortAttachment& port : ports)
    if (const Status status = attach_port(builder, port); !status) {
      extra.push_back(plain_error("port", file, status.error().message));
      return false;
    }
  return true;
}

bool declare_units(ModelBuilder& builder, const std::optional<UnitSystem>& given,
                   const std::string& file, std::vector<Diagnostic>& extra) {
  if (!given) return true;
  const UnitSystem* told = find_part<UnitSystem>(builder.model());
  if (told && !(*told == *given)) {
    extra.push_back(plain_error("units", file, "the card `units` of the deck tells other units"));
    return false;
  }
  if (!told) part<UnitSystem>(builder) = *given;
  return true;
}

/// Reads into `reading`; the model, or null with the reason in the reading's diagnostics.
ModelPtr read_model(Reading& reading, ModelBuilder& builder, const LoadRequest& request,
                    std::vector<Diagnostic>& extra) {
  Deck deck(reading, builder, full_registry());
  Statements statements(reading);
  DeckReader(deck, statements).read();
  if (reading.errors() == 0) reading.bind_strings();
  if (reading.errors() > 0) return nullptr;
  extra = unreached_symbols(reading);
  if (!extra.empty()) return nullptr;
  if (!attach(builder, request.ports, reading.file(0).name, extra)) return nullptr;
  if (!declare_units(builder, request.units, reading.file(0).name, extra)) return nullptr;
  Model& model = builder.model();
  if (const std::int64_t n = count_unknowns(model); n > reading.limits.unknowns) {
    extra.push_back(plain_error("limit-unknowns", reading.file(0).name,
                                "the model has " + std::to_string(n) + " unknowns; the limit is " +
                                    std::to_string(reading.limits.unknowns) +
                                    " (limit `unknowns`)"));
    return nullptr;
  }
  model.digest =
      digest_with(digest_with(digest(reading, deck.data_files), request.ports), request.symbols);
  store_symbols(reading, builder);
  Result<ModelPtr> finished = builder.finish();
  if (!finished) {
    extra.push_back(plain_error("model", reading.file(0).name, finished.error().message));
    return nullptr;
  }
  check_model(reading, **finished);
  return reading.errors() == 0 ? *finished : nullptr;
}

}  // namespace

LoadReport load_deck(const FileSource& files, const std::string& main_file, const Limits& limits,
                     const std::vector<PortAttachment>& ports) {
  return read_deck(files, main_file, {limits, ports});
}

DeckReport read_deck(const FileSource& files, const std::string& main_file,
                     const LoadRequest& request) {
  const Limits& limits = request.limits;
  DeckReport report;
  try {
    ModelBuilder builder;
    ReaderOptions options;
    options.symbols = request.symbols;
    Reading reading(files, limits, &builder, std::move(options));
    const Result<int> opened = reading.open_file(main_file);
    if (!opened) {
      const bool limit = opened.error().kind == ErrorKind::limit;
      report.diagnostics.push_back(
          plain_error(limit ? "limit-deck-bytes" : "no-file", main_file,
                      opened.error().message + (limit ? " (limit `deck-bytes`)" : "")));
      if (!limit) report.diagnostics.back().hint = "check the name of the deck's main file";
      return report;
    }
    std::vector<Diagnostic> extra;
    report.model = read_model(reading, builder, request, extra);
    if (report.model) report.symbols = declared_symbols(reading);
    report.files = reading.files();
    report.printed = reading.printed;
    report.diagnostics = reading.release_diagnostics();
    report.diagnostics.insert(report.diagnostics.end(), extra.begin(), extra.end());
    if (reading.errors() >= limits.errors) report.diagnostics.push_back(full_note(limits));
  } catch (const std::exception& error) {
    report.model = nullptr;
    report.diagnostics.push_back(plain_error(
        "internal", main_file, std::string("the deck cannot be read: ") + error.what()));
  }
  return report;
}

}  // namespace mbcosim
