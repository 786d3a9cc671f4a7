#include "service/results_service.h"

#include <algorithm>
#include <memory>

namespace mbcosim::server {
namespace {

constexpr std::int64_t kPieceBytes = 1 << 20;

using FileReplies = Series<v1::GetResultsRequest, v1::GetResultsReply>;

std::int64_t end_of(const v1::GetResultsRequest& request, std::int64_t size) {
  if (request.offset_bytes() < 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`offset_bytes` must not be negative");
  if (!request.has_length_bytes()) return size;
  if (request.length_bytes() < 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`length_bytes` must not be negative");
  const std::int64_t left = size - std::min(size, request.offset_bytes());
  return request.offset_bytes() + std::min(left, request.length_bytes());
}

FileReplies::Source file_pieces(const Parts& parts, const CallFrame& frame,
                                const v1::GetResultsRequest& request) {
  auto session = std::make_shared<SessionHold>(parts.store, request.simulation(), frame.caller,
                                               frame.call, Access::observe);
  std::int64_t cuts = 0;
  const std::int64_t size = (*session)->size_of_result(request.file(), frame.call, &cuts);
  const std::int64_t end = end_of(request, size);
  return [session, file = request.file(), at = request.offset_bytes(), end,
          cuts](v1::GetResultsReply* reply) mutable {
    if (at >= end) return Next::nothing;
    const std::size_t most = static_cast<std::size_t>(std::min(kPieceBytes, end - at));
    reply->set_data((*session)->results().read(file, at, most, cuts));
    at += static_cast<std::int64_t>(reply->data().size());
    return at < end ? Next::message : Next::last;
  };
}

}  // namespace

void add_results(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Results/ListResults",
           on_session<v1::ListResultsRequest, v1::ListResultsReply>(
               parts, Role::observe, Lane::work,
               [](Session& session, const auto&, auto* reply, const CallFrame& frame) {
                 session.list_results(frame.call, reply);
               }));
  gate.add("/mbcosim.v1.Results/GetResults",
           series<v1::GetResultsRequest, v1::GetResultsReply>(
               Role::observe, Lane::work, [&parts](const CallFrame& frame, const auto& request) {
                 return file_pieces(parts, frame, request);
               }));
}

}  // namespace mbcosim::server
