#include "service/geometry_service.h"

#include "service/geometry_messages.h"

namespace mbcosim::server {

void add_geometry(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Geometry/DescribeGeometry",
           series<v1::DescribeGeometryRequest, v1::DescribeGeometryReply>(
               Role::observe, Lane::work,
               [&parts](const CallFrame& frame, const v1::DescribeGeometryRequest& request) {
                 auto session = std::make_shared<SessionHold>(
                     parts.store, request.simulation(), frame.caller, frame.call, Access::observe);
                 State state = (*session)->state(frame.call);
                 auto share = std::make_shared<MemoryShare>(frame.memory, size_of(state));
                 auto messages = std::make_shared<GeometryMessages>(
                     (*session)->model(), std::move(state),
                     [session](const std::string& name) { return (*session)->find_variable(name); },
                     (*session)->origin().files, (*session)->origin().attached, request);
                 return [session, share, messages](v1::DescribeGeometryReply* reply) {
                   return messages->next(reply) ? Next::message : Next::nothing;
                 };
               }));
}

}  // namespace mbcosim::server
