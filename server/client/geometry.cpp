/// What can be drawn of a simulation, from the stream of its parts.
#include <algorithm>

#include "client/simulation.h"
#include "mbcosim/v1/geometry.grpc.pb.h"

namespace mbcosim::client {

namespace {

using Numbers = google::protobuf::RepeatedField<double>;

template <std::size_t n>
std::array<double, n> array_of(const Numbers& numbers) {
  std::array<double, n> out{};
  std::copy_n(numbers.begin(), std::min<std::size_t>(n, static_cast<std::size_t>(numbers.size())),
              out.begin());
  return out;
}

template <std::size_t n>
std::optional<std::array<double, n>> maybe_array(const Numbers& numbers) {
  if (numbers.empty()) return {};
  return array_of<n>(numbers);
}

std::vector<Geometry::Vector> vectors_of(const Numbers& numbers) {
  std::vector<Geometry::Vector> out;
  for (int i = 0; i + 3 <= numbers.size(); i += 3)
    out.push_back({numbers[i], numbers[i + 1], numbers[i + 2]});
  return out;
}

std::vector<int> integers(const google::protobuf::RepeatedField<std::int32_t>& numbers) {
  return {numbers.begin(), numbers.end()};
}

template <class Message>
std::optional<int> node_of(const Message& message) {
  if (!message.has_node_label()) return {};
  return message.node_label();
}

Geometry::Node to_node(const v1::NodeGeometry& from) {
  Geometry::Node node;
  node.label = from.label();
  node.kind = from.kind();
  node.name = from.name();
  node.position = array_of<3>(from.position());
  node.orientation = maybe_array<9>(from.orientation());
  node.position_handle = from.position_handle();
  if (from.has_orientation_handle()) node.orientation_handle = from.orientation_handle();
  return node;
}

Geometry::Line to_line(const v1::GeometryLine& from) {
  Geometry::Line line{
      from.name(), integers(from.points()), from.curved(), vectors_of(from.trace()), {}};
  if (from.has_value_handle()) line.value_handle = from.value_handle();
  return line;
}

Geometry::Element to_element(const v1::ElementGeometry& from) {
  Geometry::Element out;
  out.family = from.family();
  out.type = from.type();
  out.name = from.name();
  out.label = from.label();
  for (const auto& p : from.points())
    out.points.push_back(
        {p.name(), node_of(p), array_of<3>(p.offset()), array_of<3>(p.position())});
  for (const auto& f : from.frames())
    out.frames.push_back({f.name(), f.point(), array_of<9>(f.orientation())});
  for (const auto& line : from.lines()) out.lines.push_back(to_line(line));
  for (const auto& s : from.surfaces()) out.surfaces.push_back({s.name(), integers(s.points())});
  for (const auto& m : from.masses())
    out.masses.push_back(
        {m.point(), m.mass(), array_of<3>(m.principal_moments()), array_of<9>(m.principal_axes())});
  for (const auto& a : from.arrows())
    out.arrows.push_back({a.point(), a.handle(), a.reversed(), a.moment()});
  return out;
}

/// A body comes in several messages, one after the other.
void add_points(const v1::ModalPoints& from, Geometry* out) {
  if (from.first() == 0) {
    Geometry::FlexibleBody& body = out->flexible_bodies.emplace_back();
    body.joint = from.joint_label();
    body.node = node_of(from);
    body.position = array_of<3>(from.fixed_position());
    body.orientation = array_of<9>(from.fixed_orientation());
    body.amplitude_handles = integers(from.amplitude_handles());
  }
  if (out->flexible_bodies.empty()) return;  // a piece whose beginning did not come
  Geometry::FlexibleBody& body = out->flexible_bodies.back();
  body.labels.insert(body.labels.end(), from.labels().begin(), from.labels().end());
  const auto points = vectors_of(from.positions());
  body.points.insert(body.points.end(), points.begin(), points.end());
  body.shapes.insert(body.shapes.end(), from.shapes().begin(), from.shapes().end());
}

void add_header(const v1::GeometryHeader& from, Geometry* out) {
  out->model_digest = from.model_digest();
  out->step = from.step();
  out->time = from.time();
  out->lower = maybe_array<3>(from.lower());
  out->upper = maybe_array<3>(from.upper());
}

}  // namespace

Geometry Simulation::geometry(const GeometryOptions& options, double timeout) const {
  v1::DescribeGeometryRequest request;
  request.set_simulation(name());
  if (options.line_samples) request.set_line_samples(*options.line_samples);
  request.set_without_modal_points(!options.modal_points);
  CallContext context(*impl_->server, timeout, name());
  const auto service = v1::Geometry::NewStub(impl_->server->channel);
  const auto replies = service->DescribeGeometry(&context, request);
  Geometry geometry;
  v1::DescribeGeometryReply reply;
  while (replies->Read(&reply)) {
    if (reply.has_header()) add_header(reply.header(), &geometry);
    for (const auto& node : reply.nodes().nodes()) geometry.nodes.push_back(to_node(node));
    for (const auto& e : reply.elements().elements()) geometry.elements.push_back(to_element(e));
    if (reply.has_modal_points()) add_points(reply.modal_points(), &geometry);
  }
  require(replies->Finish());
  return geometry;
}

}  // namespace mbcosim::client
