#include "service/upload.h"

#include <algorithm>
#include <filesystem>

#include "math/hash.h"
#include "service/kept_replies.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

void check_name(const std::string& name) {
  constexpr std::size_t kLongest = 1024;
  const fs::path path(name);
  const bool climbs =
      std::any_of(path.begin(), path.end(), [](const fs::path& part) { return part == ".."; });
  if (name.empty() || name.size() > kLongest || name.find('\0') != std::string::npos ||
      path.is_absolute() || climbs || name.back() == '/') {
    throw Refusal(
        v1::REASON_BAD_ARGUMENT,
        "file names must be relative, without \"..\", and at most 1024 bytes long; got \"" +
            name.substr(0, 100) + "\"");
  }
}

/// Keeps what is read.
class KeepingSource final : public FileSource {
 public:
  KeepingSource(const FileSource& files, KeptDeck& kept) : files_(files), kept_(kept) {}
  Result<std::string> read(const std::string& name) const override {
    auto text = files_.read(name);
    if (text) kept_.files[name] = *text;
    return text;
  }

 private:
  const FileSource& files_;
  KeptDeck& kept_;
};

/// Where an uploaded deck is.
struct DeckPlace {
  std::unique_ptr<const FileSource> files;
  std::string main_file;
};

DeckReport read(const FileSource& files, const std::string& main_file,
                const v1::CreateOptions& options, const Limits& limits) {
  return read_deck(files, main_file,
                   {limits, attachments(options), symbols_of(options), units_of(options)});
}

LoadedDeck read_all(const FileSource& files, const std::string& main_file,
                    const v1::CreateOptions& options, const Limits& limits) {
  LoadedDeck deck{read(files, main_file, options, limits), nullptr};
  if (deck.ok())
    deck.attached =
        std::make_shared<const AttachedFiles>(read_attached(files, main_file, limits.deck_bytes));
  return deck;
}

DeckPlace place_in_root(const std::string& name, const std::string& model_root) {
  if (model_root.empty())
    throw Refusal(v1::REASON_NO_SUCH_MODEL, "the server has no model root; upload a bundle");
  check_name(name);
  std::error_code error;
  const fs::path root = fs::canonical(model_root, error);
  const fs::path file = error ? fs::path() : fs::canonical(root / name, error);
  const bool inside =
      !error &&
      std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first == root.end();
  if (!inside || !fs::is_regular_file(file, error))
    throw Refusal(v1::REASON_NO_SUCH_MODEL,
                  "no deck is named \"" + name + "\" under the model root");
  return {std::make_unique<FolderSource>(file.parent_path().string()), file.filename().string()};
}

DeckPlace place_of(DeckUpload& upload, const Config& config) {
  const v1::UploadHeader& header = upload.header();
  if (header.has_model_root_file())
    return place_in_root(header.model_root_file(), config.model_root);
  const std::string& main_file = header.bundle_main_file();
  check_name(main_file);
  std::map<std::string, std::string> files = upload.take_files();
  if (files.count(main_file) == 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "the main file \"" + main_file.substr(0, 100) + "\" is not in the bundle");
  return {std::make_unique<BundleSource>(std::move(files)), main_file};
}

}  // namespace

SymbolValues symbols_of(const v1::CreateOptions& options) {
  SymbolValues values;
  for (const auto& [name, value] : options.symbols()) {
    switch (value.value_case()) {
      case v1::SymbolValue::kNumber:
        values.emplace(name, value.number());
        break;
      case v1::SymbolValue::kText:
        values.emplace(name, value.text());
        break;
      case v1::SymbolValue::kFlag:
        values.emplace(name, value.flag());
        break;
      default:
        throw Refusal(v1::REASON_BAD_ARGUMENT,
                      "`symbols` has no value for \"" + name.substr(0, 100) + "\"");
    }
  }
  return values;
}

std::optional<UnitSystem> units_of(const v1::CreateOptions& options) {
  if (!options.has_units()) return std::nullopt;
  UnitSystem units = to_units(options.units());
  if (const auto fault = check(units))
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`units." + std::string(fault->member) + "` " + utf8(fault->text));
  return units;
}

std::vector<PortAttachment> attachments(const v1::CreateOptions& options) {
  std::vector<PortAttachment> found;
  for (const v1::PortDefinition& port : options.ports()) {
    const bool motion = port.kind() == v1::PORT_KIND_MOTION;
    if (!motion && port.kind() != v1::PORT_KIND_MODAL) continue;
    found.push_back({motion ? ElementPort::Kind::motion : ElementPort::Kind::modal,
                     port.name(),
                     {port.node_labels().begin(), port.node_labels().end()},
                     port.positions_only(),
                     port.modal_joint_label()});
  }
  return found;
}

void Bundle::add(const v1::FileChunk& chunk) {
  check_name(chunk.path());
  bytes_ += static_cast<std::int64_t>(chunk.data().size());
  if (bytes_ > limits_.engine.deck_bytes)
    throw limit_refusal("deck_bytes", limits_.engine.deck_bytes,
                        "the bundle is larger than allowed");
  share_.grow(static_cast<std::int64_t>(chunk.path().size() + chunk.data().size()));
  files_[chunk.path()] += chunk.data();
  if (static_cast<int>(files_.size()) > limits_.bundle_files)
    throw limit_refusal("bundle_files", limits_.bundle_files,
                        "the bundle has more files than allowed");
}

void DeckUpload::add(v1::UploadRequest& message, MemoryShare share) {
  if (!header_) {
    if (!message.has_header())
      throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an upload must be `header`");
    if (message.header().source_case() == v1::UploadHeader::SOURCE_NOT_SET)
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "the header must have `bundle_main_file` or `model_root_file`");
    header_ = std::move(*message.mutable_header());
    header_share_ = std::move(share);
    return;
  }
  if (!message.has_chunk())
    throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` an upload has only `chunk` messages");
  if (!header_->has_bundle_main_file())
    throw Refusal(v1::REASON_OUT_OF_TURN, "a deck of the model root takes no `chunk` messages");
  bundle_.add(message.chunk());
}

void DeckUpload::add(const v1::InlineUpload& whole) {
  v1::UploadRequest message;
  *message.mutable_header() = whole.header();
  add(message, {});
  for (const v1::FileChunk& file : whole.files()) {
    *message.mutable_chunk() = file;
    add(message, {});
  }
}

std::uint64_t Bundle::digest() const {
  std::uint64_t sum = 0;  // of independent terms: pieces may come in any order of files
  for (const auto& [name, data] : files_) {
    sum += fnv1a(name + '\0' + std::to_string(fnv1a(data)));
  }
  return sum;
}

std::uint64_t DeckUpload::digest() const {
  return digest_of("CreateSimulation", header()) + bundle_.digest();
}

const v1::UploadHeader& DeckUpload::header() const {
  if (!header_)
    throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an upload must be `header`");
  return *header_;
}

DeckReport read_alone(DeckUpload& upload, const Config& config, const Limits& limits) {
  const DeckPlace place = place_of(upload, config);
  return read(*place.files, place.main_file, upload.header().options(), limits);
}

LoadedDeck load(DeckUpload& upload, const Config& config, KeptDeck* kept) {
  const DeckPlace place = place_of(upload, config);
  const v1::CreateOptions& options = upload.header().options();
  if (!kept) return read_all(*place.files, place.main_file, options, config.limits.engine);
  kept->main_file = place.main_file;
  kept->options = options;
  return read_all(KeepingSource(*place.files, *kept), place.main_file, options,
                  config.limits.engine);
}

LoadedDeck load(KeptDeck deck, const Config& config) {
  return read_all(BundleSource(std::move(deck.files)), deck.main_file, deck.options,
                  config.limits.engine);
}

void refuse_deck(const LoadReport& report) {
  Error error;
  error.kind = ErrorKind::deck;
  error.diagnostics = report.diagnostics;
  const auto first =
      std::find_if(report.diagnostics.begin(), report.diagnostics.end(),
                   [](const Diagnostic& d) { return d.severity == Severity::error; });
  if (first == report.diagnostics.end()) {
    error.message = "the deck cannot be read";
  } else {
    error.message = utf8(first->file + ":" + std::to_string(first->line) + ":" +
                         std::to_string(first->column) + ": error: " + first->message);
    constexpr std::string_view kLimit = "limit-";
    if (first->code == "internal") error.kind = ErrorKind::internal;
    if (first->code == "port") throw Refusal(v1::REASON_BAD_ARGUMENT, utf8(first->message));
    if (first->code == "units")
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`units`: " + utf8(first->message));
    if (first->code.compare(0, kLimit.size(), kLimit) == 0) {
      error.kind = ErrorKind::limit;
      error.reason = first->code.substr(kLimit.size());
      std::replace(error.reason.begin(), error.reason.end(), '-', '_');
    }
  }
  throw Refusal(error);
}

}  // namespace mbcosim::server
