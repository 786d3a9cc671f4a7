/// Methods that carry whole simulations from one server to another.
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "durable/record_file.h"
#include "math/hash.h"
#include "rpc/places.h"
#include "service/display_name.h"
#include "service/durability.h"
#include "service/simulations_service.h"

namespace mbcosim::server {
namespace {

using ExportReplies = Series<v1::ExportCheckpointRequest, v1::ExportCheckpointReply>;

/// What `read` returns; what it finds damaged is refused.
template <class Read>
auto readable(Read&& read) {
  try {
    return read();
  } catch (const StorageError& error) {
    throw Refusal(v1::REASON_DAMAGED_STATE,
                  std::string("the checkpoint cannot be read: ") + error.what());
  }
}

/// An export holds its files open for as long as its reader takes: an identity has a few at a time.
using Exports = std::shared_ptr<Places>;
Exports few_exports() { return std::make_shared<Places>(8, std::numeric_limits<int>::max()); }

ExportReplies::Source exported(const Parts& parts, const Exports& exports, const CallFrame& frame,
                               const v1::ExportCheckpointRequest& request) {
  const SessionHold session(parts.store, request.simulation(), frame.caller, frame.call,
                            Access::control);
  const auto place = std::make_shared<Place>(*exports, frame.caller.identity);
  if (!place->held())
    throw limit_refusal("identity_exports", exports->most_per_identity(),
                        "too many exports of checkpoints are open; read them to their ends");
  auto files = std::make_shared<OpenFiles>(parts.durability.open_files(*session));
  return [exports, place, files](auto* reply) {
    std::string piece = readable([&] { return files->read(kChunkBytes); });
    const bool some = !piece.empty();
    reply->set_data(std::move(piece));
    return some ? Next::message : Next::nothing;
  };
}

class ImportHandler final : public Upload<v1::ImportCheckpointRequest> {
 public:
  explicit ImportHandler(const Parts& parts)
      : parts_(parts), reader_(parts.config.limits.state_bytes, [this](auto kind, auto content) {
          bundle_.add(reader_.file(), kind, std::move(content));
        }) {}

 private:
  void add(Exchange& exchange, v1::ImportCheckpointRequest& request, MemoryShare share) override {
    if (!header_) {
      if (!request.has_header())
        throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
      parts_.durability.require();
      check_request_id(request.header().request_id());
      header_ = request.header();
      check_display_name(header_->display_name());
      header_share_ = std::move(share);
      share_ = MemoryShare(exchange.memory());
      return;
    }
    if (request.has_header())
      throw Refusal(v1::REASON_OUT_OF_TURN, "after `header` an import has only `data` messages");
    share_.grow(2 * static_cast<std::int64_t>(request.data().size()));
    digest_ = fnv1a(request.data(), digest_);
    readable([&] { reader_.take(request.data()); });
  }
  void complete(Exchange& exchange) override {
    if (!header_)
      throw Refusal(v1::REASON_OUT_OF_TURN, "the first message of an import must be `header`");
    readable([&] { reader_.finish(); });
    v1::ImportCheckpointReply reply;
    *reply.mutable_simulation() = parts_.durability.import(std::move(bundle_), *header_, digest_,
                                                           exchange.caller(), exchange.call());
    exchange.end(serialized(reply));
  }

  const Parts& parts_;
  std::optional<v1::ImportCheckpointHeader> header_;
  StoredBundle bundle_;
  RecordReader reader_;
  std::uint64_t digest_ = kFnvBasis;
  MemoryShare header_share_, share_;
};

}  // namespace

void add_checkpoints(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("ExportCheckpoint"),
           series<v1::ExportCheckpointRequest, v1::ExportCheckpointReply>(
               Role::control, Lane::work,
               [&parts, exports = few_exports()](const CallFrame& frame, const auto& request) {
                 return exported(parts, exports, frame, request);
               }));
  gate.add(simulations_path("ImportCheckpoint"),
           stream(Role::control, [&parts] { return std::make_unique<ImportHandler>(parts); }));
}

}  // namespace mbcosim::server
