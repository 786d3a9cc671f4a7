#include "cli/lsp/server.h"

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "elements/families.h"
#include "input/sources.h"

namespace mbcosim::lsp {
namespace {

namespace fs = std::filesystem;

constexpr int kParseError = -32700, kInvalidRequest = -32600, kMethodNotFound = -32601,
              kInvalidParameters = -32602, kNotInitialized = -32002;

/// Path of a `file:` URI; other URIs as they are.
std::string path_of(const std::string& uri) {
  constexpr std::string_view kFile = "file://";
  if (!uri.starts_with(kFile)) return uri;
  std::string path;
  for (std::size_t k = kFile.size(); k < uri.size(); ++k) {
    const bool escaped = uri[k] == '%' && k + 2 < uri.size() &&
                         std::isxdigit(static_cast<unsigned char>(uri[k + 1])) &&
                         std::isxdigit(static_cast<unsigned char>(uri[k + 2]));
    path += escaped ? static_cast<char>(std::stoi(uri.substr(k + 1, 2), nullptr, 16)) : uri[k];
    if (escaped) k += 2;
  }
  return path;
}

std::string uri_of(const std::string& path) {
  std::ostringstream uri;
  uri << "file://" << std::hex << std::uppercase;
  for (const char c : path)
    if (std::isalnum(static_cast<unsigned char>(c)) ||
        std::string_view("/-._~").find(c) != std::string_view::npos)
      uri << c;
    else
      uri << '%' << (static_cast<unsigned char>(c) < 16 ? "0" : "")
          << static_cast<int>(static_cast<unsigned char>(c));
  return uri.str();
}

/// The user's files; those that are open in the editor as they stand there.
class OpenFiles : public FolderSource {
 public:
  explicit OpenFiles(std::map<std::string, std::string> texts)
      : FolderSource(".", /*unrestricted=*/true), texts_(std::move(texts)) {}
  Result<std::string> read(const std::string& name) const override {
    const auto text = texts_.find(fs::path(name).lexically_normal().string());
    return text == texts_.end() ? FolderSource::read(name) : Result<std::string>(text->second);
  }

 private:
  std::map<std::string, std::string> texts_;  ///< by path
};

Json to_json(Position position) {
  return {{"line", position.line}, {"character", position.character}};
}
Json to_json(Range range) { return {{"start", to_json(range.start)}, {"end", to_json(range.end)}}; }

Position position_in(const Json& parameters) {
  const Json& position = parameters.at("position");
  return {position.at("line").get<int>(), position.at("character").get<int>()};
}

std::string uri_in(const Json& parameters) {
  return parameters.at("textDocument").at("uri").get<std::string>();
}

Json to_json(const Diagnostic& diagnostic, const Document* document) {
  Position start{std::max(diagnostic.line, 1) - 1, std::max(diagnostic.column, 1) - 1};
  Position end{start.line, start.character + std::max(diagnostic.length, 1)};
  if (document) {
    start = document->from_reader(diagnostic.line, diagnostic.column);
    end =
        document->from_reader(diagnostic.line, diagnostic.column + std::max(diagnostic.length, 1));
  }
  const int severity = diagnostic.severity == Severity::error     ? 1
                       : diagnostic.severity == Severity::warning ? 2
                                                                  : 3;
  std::string text = diagnostic.message;
  if (!diagnostic.hint.empty()) text += "\n" + diagnostic.hint;
  for (const std::string& line : diagnostic.trail) text += "\n" + line;
  return {{"range", to_json(Range{start, end})},
          {"severity", severity},
          {"source", "mbcosim"},
          {"code", diagnostic.code},
          {"message", text}};
}

std::string shown(const DeckSymbol::Value& value) {
  return std::visit(
      [](const auto& v) { return Json(v).dump(-1, ' ', false, Json::error_handler_t::replace); },
      value);
}

/// The letters of a word, lower case, without what separates them: as the reader compares.
std::string bare(const std::string& text) {
  std::string result;
  for (const char c : text)
    if (c != ' ' && c != '\t')
      result += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return result;
}

/// How a statement with the word is written: its form, or its group's, with the word and its
/// grammar.
std::string statement_of(const VocabularyGroup& words, const VocabularyWord& word) {
  if (word.grammar.empty()) return "";
  std::string text = !word.form.empty()   ? word.form
                     : words.form.empty() ? "<word> , <grammar>"
                                          : words.form;
  for (const auto& [name, value] :
       {std::pair<std::string, std::string>{"<word>", word.word}, {"<grammar>", word.grammar}})
    if (const std::size_t at = text.find(name); at != std::string::npos)
      text.replace(at, name.size(), value);
  return text;
}

/// A word with its grammar, results and support, in Markdown.
std::string told(const VocabularyGroup& words, const VocabularyWord& word) {
  std::string text = "**" + word.word + "** (" + words.title + ")";
  if (!word.served)
    return text + (word.reason.empty() ? ": not supported" : ": not supported; " + word.reason);
  if (const std::string statement = statement_of(words, word); !statement.empty())
    text += "\n```mbcosim\n" + statement + "\n```";
  if (!word.output.empty()) text += "\nWrites " + word.output;
  if (word.support != "yes" || !word.note.empty())
    text += "\n\nServed: " + word.support + (word.note.empty() ? "" : "; " + word.note);
  return text;
}

/// Group of the words that may come next in a statement: `joint: 5, …` wants those of joints.
std::string wanted_group(const std::string& statement) {
  const std::size_t colon = statement.find(':');
  if (colon == std::string::npos) return "";
  std::string card = statement.substr(0, colon);
  card.erase(0, card.find_first_not_of(" \t\n\r"));
  if (card == "begin" || card == "end") return "block";
  return std::count(statement.begin(), statement.end(), ',') == 1 ? card : "";
}

}  // namespace

Server::Server(Wire& wire) : wire_(wire), words_(vocabulary(full_registry())) {}

int Server::run() {
  while (!left_) {
    const std::optional<Json> message = wire_.read();
    if (!message) return shut_down_ ? 0 : 1;
    dispatch(*message);
    if (!wire_.waiting()) check_changed();  // only the last of several changes is read
  }
  return shut_down_ ? 0 : 1;
}

void Server::dispatch(const Json& message) {
  const auto refuse = [&](const Json& id, int code, const char* text) {
    wire_.write({{"jsonrpc", "2.0"}, {"id", id}, {"error", {{"code", code}, {"message", text}}}});
  };
  if (message.is_discarded()) return refuse(nullptr, kParseError, "the message is no JSON");
  if (!message.is_object() || !message.contains("method")) return;  // an answer; none is wanted
  const bool asks = message.contains("id");
  if (!message["method"].is_string()) {
    if (asks) refuse(message["id"], kInvalidRequest, "`method` must be a string");
    return;
  }
  const std::string method = message["method"];
  static const Json kNone = Json::object();
  const Json& parameters = message.contains("params") ? message["params"] : kNone;
  if (asks && shut_down_) return refuse(message["id"], kInvalidRequest, "shutdown was asked for");
  if (asks && !initialized_ && method != "initialize")
    return refuse(message["id"], kNotInitialized, "`initialize` comes first");
  if (!message.contains("id")) {
    try {
      note(method, parameters);
    } catch (const Json::exception&) {  // a notification has no answer, and changes nothing then
    }
    return;
  }
  Json reply = {{"jsonrpc", "2.0"}, {"id", message["id"]}};
  try {
    reply["result"] = answer(method, parameters);
  } catch (const Json::exception& error) {
    reply["error"] = {{"code", kInvalidParameters}, {"message", error.what()}};
  } catch (const std::invalid_argument& error) {
    reply["error"] = {{"code", kMethodNotFound}, {"message", error.what()}};
  }
  wire_.write(reply);
}

Json Server::answer(const std::string& method, const Json& parameters) {
  if (method == "initialize") {
    initialized_ = true;
    return {{"capabilities",
             {{"textDocumentSync", 1},
              {"completionProvider", {{"triggerCharacters", {":", ","}}}},
              {"hoverProvider", true},
              {"definitionProvider", true},
              {"referencesProvider", true}}},
            {"serverInfo", {{"name", "mbcosim"}, {"version", MBCOSIM_VERSION}}}};
  }
  if (method == "shutdown") {
    shut_down_ = true;
    return nullptr;
  }
  if (!method.starts_with("textDocument/"))
    throw std::invalid_argument("method " + method + " is not served");
  const std::string uri = uri_in(parameters);
  const auto entry = open_.find(uri);
  if (entry == open_.end()) return nullptr;
  const std::size_t offset = entry->second.document.offset(position_in(parameters));
  if (method == "textDocument/completion") return complete(entry->second, offset);
  if (method == "textDocument/hover") return hover(entry->second, offset);
  if (method == "textDocument/definition") return definitions(uri, offset);
  if (method == "textDocument/references") return references(uri, offset);
  throw std::invalid_argument("method " + method + " is not served");
}

void Server::note(const std::string& method, const Json& parameters) {
  if (method == "exit") {
    left_ = true;
  } else if (method == "textDocument/didOpen") {
    change(uri_in(parameters), parameters.at("textDocument").at("text").get<std::string>());
  } else if (method == "textDocument/didChange") {
    change(uri_in(parameters),
           parameters.at("contentChanges").back().at("text").get<std::string>());
  } else if (method == "textDocument/didClose") {
    const std::string uri = uri_in(parameters);
    for (const std::string& file : shown_in_[uri]) publish(file, {});
    shown_in_.erase(uri);
    open_.erase(uri);
    changed_.erase(uri);
  }
}

void Server::change(const std::string& uri, std::string text) {
  const auto entry = open_.find(uri);
  if (entry == open_.end())
    open_.emplace(uri, Entry{Document(std::move(text)), {}});
  else
    entry->second.document = Document(std::move(text));
  // A file that a deck includes is read with the deck.
  for (const auto& [other, unused] : open_) changed_.insert(other);
}

void Server::check_changed() {
  for (const std::string& uri : std::exchange(changed_, {})) check(uri);
}

/// Reads a deck; a text without `begin: data` is a part of one and is left alone.
void Server::check(const std::string& uri) {
  const auto entry = open_.find(uri);
  if (entry == open_.end() || entry->second.document.text().find("begin") == std::string::npos)
    return;
  std::map<std::string, std::string> texts;
  for (const auto& [other, content] : open_)
    texts[fs::path(path_of(other)).lexically_normal().string()] = content.document.text();
  const std::string path = fs::path(path_of(uri)).lexically_normal().string();
  LoadRequest request;
  request.limits.statements = 2'000'000;  // an answer while one types
  request.limits.loop_iterations = 100'000;
  const DeckReport report = read_deck(OpenFiles(std::move(texts)), path, request);
  if (report.ok()) entry->second.symbols = report.symbols;
  std::map<std::string, std::vector<Diagnostic>> by_file{{uri, {}}};
  for (const std::string& file : shown_in_[uri]) by_file[file];
  for (const Diagnostic& diagnostic : report.diagnostics)
    by_file[diagnostic.file == path || diagnostic.file.empty() ? uri : uri_of(diagnostic.file)]
        .push_back(diagnostic);
  shown_in_[uri].clear();
  for (const auto& [file, diagnostics] : by_file) {
    publish(file, diagnostics);
    if (!diagnostics.empty()) shown_in_[uri].insert(file);
  }
}

void Server::publish(const std::string& uri, const std::vector<Diagnostic>& diagnostics) {
  const auto entry = open_.find(uri);
  Json list = Json::array();
  for (const Diagnostic& diagnostic : diagnostics)
    list.push_back(to_json(diagnostic, entry == open_.end() ? nullptr : &entry->second.document));
  wire_.write({{"jsonrpc", "2.0"},
               {"method", "textDocument/publishDiagnostics"},
               {"params", {{"uri", uri}, {"diagnostics", list}}}});
}

Json Server::complete(const Entry& entry, std::size_t offset) const {
  std::size_t from = 0;
  const std::string begun = bare(entry.document.phrase_before(offset, from));
  const std::string group = wanted_group(entry.document.statement_before(offset));
  const Json range = to_json(entry.document.range(from, offset - from));
  constexpr int kKeyword = 14, kVariable = 6;
  Json items = Json::array();
  const auto add = [&](const std::string& word, const std::string& detail, int kind, bool first) {
    if (bare(word).starts_with(begun))
      items.push_back({{"label", word},
                       {"detail", detail},
                       {"kind", kind},
                       {"sortText", (first ? "0" : "1") + word},
                       {"textEdit", {{"range", range}, {"newText", word}}}});
  };
  for (const VocabularyGroup& words : words_)
    for (const VocabularyWord& word : words.words)
      if (word.served && (group.empty() || !begun.empty() || words.name == group))
        add(word.word, words.title, kKeyword, words.name == group);
  for (const DeckSymbol& symbol : entry.symbols)
    add(symbol.name, "= " + shown(symbol.value), kVariable, false);
  return {{"isIncomplete", false}, {"items", items}};
}

Json Server::hover(const Entry& entry, std::size_t offset) const {
  const Document& document = entry.document;
  std::size_t from = 0, start = 0;
  const std::string name = document.word(offset, from);
  if (name.empty() || !document.is_code(from)) return nullptr;
  const std::string phrase = document.phrase_before(from + name.size(), start);
  std::size_t end = from + name.size();  // a keyword may go on behind the word
  while (end < document.text().size() &&
         std::string_view(",;:(){}=\n").find(document.text()[end]) == std::string_view::npos)
    ++end;
  const std::string whole = bare(document.text().substr(start, end - start));
  std::string text;
  for (const DeckSymbol& symbol : entry.symbols)
    if (symbol.name == name)
      text = "**" + name + "** = " + shown(symbol.value) + (symbol.constant ? " (const)" : "");
  std::string here, elsewhere;  // what may stand at this place, and words that are spelled so
  const std::string group = wanted_group(document.statement_before(start));
  for (const VocabularyGroup& words : words_)
    for (const VocabularyWord& word : words.words)
      if (bare(word.word) == whole || bare(word.word) == bare(phrase))
        (words.name == group ? here : elsewhere) += "\n\n" + told(words, word);
  text += here.empty() ? elsewhere : here;
  text.erase(0, text.find_first_not_of('\n'));
  if (text.empty()) return nullptr;
  return {{"contents", {{"kind", "markdown"}, {"value", text}}},
          {"range", to_json(document.range(from, name.size()))}};
}

/// In the document itself, else in the others that are open.
Json Server::definitions(const std::string& uri, std::size_t offset) const {
  std::size_t from = 0;
  const std::string name = open_.at(uri).document.word(offset, from);
  Json found = Json::array();
  const auto add = [&](const std::string& file) {
    const Document& document = open_.at(file).document;
    for (const std::size_t at : document.declarations(name))
      found.push_back({{"uri", file}, {"range", to_json(document.range(at, name.size()))}});
  };
  add(uri);
  for (const auto& [other, unused] : open_)
    if (found.empty() && other != uri) add(other);
  return found;
}

Json Server::references(const std::string& uri, std::size_t offset) const {
  std::size_t from = 0;
  const std::string name = open_.at(uri).document.word(offset, from);
  Json found = Json::array();
  for (const auto& [file, entry] : open_)
    for (const std::size_t at : entry.document.occurrences(name))
      found.push_back({{"uri", file}, {"range", to_json(entry.document.range(at, name.size()))}});
  return found;
}

}  // namespace mbcosim::lsp
